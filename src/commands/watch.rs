//! `lampyris status --watch`: the progress of a folder again and again, until all is done. It reads files and nothing
//! else, so it works for any engine, from any machine that sees the folder, and may be ended at any time.

use super::{CHEAP, Exit, Outcome, judged_status};
use console::Term;
use lampyris::error::Result;
use lampyris::farm::folder::Folder;
use std::time::{Duration, Instant};

/// Time between two looks.
const PAUSE: Duration = Duration::from_secs(2);
/// A look may take at most this share of the time: thousands of headers on a slow disk are not to be read all the time.
const SHARE: u32 = 10;

/// Shows the progress of `folder` until it is done.
pub(super) fn watch(folder: &Folder) -> Result<Outcome> {
    let screen = Term::stdout();
    loop {
        let begun = Instant::now();
        let status = judged_status(folder, CHEAP)?;
        let exit = if status.refused.is_empty() { Exit::Done } else { Exit::Refused };
        if status.is_done() {
            return Ok(Outcome { text: status.to_string(), exit });
        }
        show(&screen, |lines| status.text(lines));
        std::thread::sleep(PAUSE.max(begun.elapsed() * SHARE));
    }
}

/// On a terminal over what stood there before, as much as fits; elsewhere below it, with a blank line between.
fn show(screen: &Term, text: impl Fn(usize) -> String) {
    if !screen.is_term() {
        return crate::say(&(text(20) + "\n"));
    }
    let (rows, columns) = screen.size();
    // Hosts and shards share what the first lines leave.
    let text = text(usize::from(rows.saturating_sub(10) / 2).max(1));
    let lines = text.lines().take(usize::from(rows).saturating_sub(1));
    let cut: String =
        lines.map(|line| format!("{}\n", line.chars().take(columns.into()).collect::<String>())).collect();
    // A terminal that cannot be cleared shows one text after the other.
    let _ = screen.clear_screen();
    crate::say(&cut);
}
