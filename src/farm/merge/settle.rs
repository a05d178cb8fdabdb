//! Waiting for files that a network file system shows late, or short at first.
//!
//! What another machine has just written may be missing from a folder, or shorter than it is, for as long as names and
//! sizes are remembered here: on NFS a minute at most with the usual settings. Who merges right after the last worker
//! has ended therefore looks again until all is there, for a limited time; nothing else waits, and nothing that was
//! seen meanwhile is kept.

use super::{choose, common_plan, goal_reached};
use crate::error::Result;
use crate::farm::checkpoint::Span;
use crate::farm::folder::Folder;
use std::time::{Duration, Instant};

/// Time between two looks.
const PAUSE: Duration = Duration::from_secs(1);

/// Looks into `folders` until their checkpoints are whole or so many seconds are over: with a goal until it is reached,
/// otherwise until no batch of the plan is missing. Says nothing of what it sees: the merge that follows does.
pub fn wait_until_whole(folders: &[Folder], seconds: u64) {
    let (begun, patience) = (Instant::now(), Duration::from_secs(seconds));
    let mut seen = None;
    loop {
        // Whatever cannot be read may be readable later.
        let now = batches_there(folders).ok();
        // Judging a goal reads more than headers, so that is only done where something is new.
        let news = now != seen;
        if news && now.as_ref().is_some_and(|there| there.whole || goal_reached(folders).is_ok_and(|at| at.is_some())) {
            return;
        }
        seen = now;
        let left = patience.saturating_sub(begun.elapsed());
        if left.is_zero() {
            return;
        }
        std::thread::sleep(PAUSE.min(left));
    }
}

/// What the headers say.
#[derive(PartialEq)]
struct There {
    /// Batches of each file that counts.
    batches: Vec<(Span, u64)>,
    /// True when no batch of the plan is missing.
    whole: bool,
}

fn batches_there(folders: &[Folder]) -> Result<There> {
    let plan = common_plan(folders)?;
    let chosen = choose(&plan, folders)?;
    let batches: Vec<(Span, u64)> = chosen.iter().map(|file| (file.span, file.batches())).collect();
    let all: u64 = batches.iter().map(|(_, batches)| batches).sum();
    Ok(There { whole: all >= plan.job.run.batches, batches })
}
