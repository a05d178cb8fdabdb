//! Progress of a run on standard error: a bar on a terminal, lines at growing intervals elsewhere.

use crate::farm::plan::Plan;
use crate::farm::status::{ShardStatus, Status};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Time between two looks at the headers.
const REFRESH: Duration = Duration::from_millis(500);
/// Longest time between two lines.
const LONGEST: Duration = Duration::from_secs(60);

/// Where progress is shown.
enum Display {
    Silent,
    Bar(ProgressBar),
    Lines { interval: Duration, next: Instant },
}

/// Shows batches, rate, time left and median relative error so far.
pub struct Progress<'a> {
    plan: &'a Plan,
    display: Display,
    begun: Instant,
    /// Batches done before this run.
    before: u64,
    looked: Instant,
}

impl<'a> Progress<'a> {
    pub fn new(plan: &'a Plan, shards: &[ShardStatus], quiet: bool) -> Self {
        let begun = Instant::now();
        let before = shards.iter().map(|s| s.batches).sum();
        let display = match (quiet, std::io::stderr().is_terminal()) {
            (true, _) => Display::Silent,
            (false, true) => Display::Bar(bar(plan.job.run.batches)),
            (false, false) => Display::Lines { interval: Duration::from_secs(2), next: begun + Duration::from_secs(2) },
        };
        Progress { plan, display, begun, before, looked: begun }
    }

    /// True when it is time to look at the headers again.
    pub fn due(&mut self) -> bool {
        let due = self.looked.elapsed() >= REFRESH && !matches!(self.display, Display::Silent);
        if due {
            self.looked = Instant::now();
        }
        due
    }

    /// Shows the progress of all shards, when it is time.
    pub fn show(&mut self, shards: &[ShardStatus]) {
        let now = Instant::now();
        match &mut self.display {
            Display::Lines { next, .. } if now < *next => return,
            Display::Lines { interval, next } => {
                *interval = (2 * *interval).min(LONGEST);
                *next = now + *interval;
            }
            Display::Silent | Display::Bar(_) => {}
        }
        self.say(shards);
    }

    /// The last word.
    pub fn finish(&mut self, shards: &[ShardStatus]) {
        self.say(shards);
        if let Display::Bar(bar) = &self.display {
            bar.abandon();
        }
    }

    fn say(&self, shards: &[ShardStatus]) {
        let (done, message) = self.words(shards);
        match &self.display {
            Display::Silent => {}
            Display::Bar(bar) => {
                bar.set_position(done);
                bar.set_message(message);
            }
            Display::Lines { .. } => {
                let comma = if message.is_empty() { "" } else { ", " };
                eprintln!("{done} of {} batches{comma}{message}", self.plan.job.run.batches);
            }
        }
    }

    /// Batches done, and rate, time left and error as far as known.
    fn words(&self, shards: &[ShardStatus]) -> (u64, String) {
        let status = Status::new(self.plan, shards.to_vec(), Vec::new());
        let rate = status.batches.saturating_sub(self.before) as f64 / self.begun.elapsed().as_secs_f64();
        let mut parts = Vec::new();
        if rate > 0.0 {
            let left = (status.of - status.batches) as f64 / rate;
            let at_most = if status.goal.is_some() { "at most " } else { "" };
            parts.push(format!("{rate:.2} batches/s, {at_most}{left:.0} s left"));
        }
        if let Some(error) = status.relative_error_estimate {
            parts.push(format!("median relative error about {:.2} %", 100.0 * error));
        }
        if let Some(look) = status.goal.and_then(|goal| goal.next_look) {
            parts.push(format!("next look at {look}"));
        }
        (status.batches, parts.join(", "))
    }
}

/// Two lines: on one, the words would leave no room for the bar in 80 columns.
fn bar(batches: u64) -> ProgressBar {
    let style = ProgressStyle::with_template("{wide_bar} {pos}/{len} batches\n{msg}");
    ProgressBar::new(batches).with_style(style.expect("the template is a constant that a test parses"))
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_bar_has_a_valid_template() {
        assert_eq!(super::bar(3).length(), Some(3));
    }
}
