//! Progress as text, of bounded length: what matters first, then machines, then shards that are begun and unfinished.

use super::{ShardStatus, Status, Verdict};
use std::fmt::{Display, Formatter, Result, Write};

/// Lines for machines, and as many for shards, unless somebody says otherwise.
const LINES: usize = 100;

impl Display for Status {
    fn fmt(&self, f: &mut Formatter) -> Result {
        self.write(f, LINES)
    }
}

impl Status {
    /// The text with at most `lines` lines for machines and as many for shards.
    pub fn text(&self, lines: usize) -> String {
        let mut text = String::new();
        self.write(&mut text, lines).expect("a string takes all that is written");
        text
    }

    fn write(&self, f: &mut dyn Write, lines: usize) -> Result {
        writeln!(
            f,
            "{}: {} of {} batches, {} of {} shards done",
            self.job, self.batches, self.of, self.shards_done, self.shard_count
        )?;
        if let Some(rate) = self.rate_of_a_worker {
            writeln!(f, "{rate:.3} batches/s per worker, {} at work, {:.1} s spent", self.shards_active, self.seconds)?;
        }
        if let Some(eta) = self.eta_seconds {
            let about = if self.goal.is_some() { "at most about" } else { "about" };
            writeln!(f, "{about} {} left", duration(eta))?;
        }
        if let Some(error) = self.relative_error_estimate {
            writeln!(f, "median relative error so far: {:.3} % (an estimate)", 100.0 * error)?;
        }
        self.write_goal(f)?;
        if !self.goal.is_some_and(|goal| matches!(goal.verdict, Verdict::ReachedAt(_))) {
            self.write_hosts(f, lines)?;
            self.write_shards(f, lines)?;
        }
        self.refused.iter().try_for_each(|line| writeln!(f, "{line}"))
    }

    fn write_goal(&self, f: &mut dyn Write) -> Result {
        let Some(goal) = &self.goal else { return Ok(()) };
        writeln!(f, "{goal}")?;
        if let (Some(seen), Some(look)) = (goal.seen, goal.expected_look) {
            let eta = goal.eta_seconds.map(|eta| format!(", in about {}", duration(eta))).unwrap_or_default();
            let width = 100.0 * seen.relative_half_width;
            writeln!(f, "half-width {width:.3} % at {} batches: goal likely at {look}{eta}", seen.batches)?;
        }
        Ok(())
    }

    fn write_hosts(&self, f: &mut dyn Write, lines: usize) -> Result {
        if self.hosts.len() < 2 || self.shards_active == 0 {
            return Ok(());
        }
        writeln!(
            f,
            "{:<20} {:>7} {:>7} {:>9} {:>10}  last heard of",
            "host", "at work", "done", "batches", "batches/s"
        )?;
        for host in self.hosts.iter().take(lines) {
            let rate = host.rate.map_or_else(|| "-".to_owned(), |rate| format!("{rate:.3}"));
            let (name, age) = (shortened(&host.host), duration(host.age_seconds as f64));
            let (active, done) = (host.shards_active, host.shards_done);
            writeln!(f, "{name:<20} {active:>7} {done:>7} {:>9} {rate:>10}  {age} ago", host.batches)?;
        }
        left_out(f, self.hosts.len(), lines, "hosts")
    }

    /// Those at work first, then those that wait for somebody to go on.
    fn write_shards(&self, f: &mut dyn Write, lines: usize) -> Result {
        let unfinished = || self.shards.iter().filter(|s| s.batches < s.of);
        let in_order = unfinished().filter(|s| s.active).chain(unfinished().filter(|s| !s.active));
        in_order.take(lines).try_for_each(|shard| write_shard(f, shard))?;
        left_out(f, unfinished().count(), lines, "shards")
    }
}

fn write_shard(f: &mut dyn Write, s: &ShardStatus) -> Result {
    let ShardStatus { shard, batches, of, .. } = s;
    let what = if *batches > 0 { "written" } else { "begun" };
    let (age, host) = (duration(s.age_seconds as f64), shortened(&s.host));
    write!(f, "shard {shard}: {batches} of {of} batches, {what} {age} ago on {host}")?;
    if s.attempts > 1 {
        write!(f, ", attempt {}", s.attempts)?;
    }
    if let Some(rate) = s.rate() {
        write!(f, ", {rate:.3} batches/s")?;
    }
    writeln!(f, "{}", if s.active { "" } else { ", not at work" })
}

fn left_out(f: &mut dyn Write, all: usize, lines: usize, what: &str) -> Result {
    match all.checked_sub(lines) {
        Some(more @ 1..) => writeln!(f, "... and {more} more {what}"),
        _ => Ok(()),
    }
}

/// A host name that leaves room for the rest.
fn shortened(host: &str) -> String {
    host.chars().take(20).collect()
}

/// A time for people: seconds, then minutes, then hours.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 100.0 => format!("{s:.0} s"),
        s if s < 6000.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use crate::farm::attempts::Attempt;
    use crate::farm::status::{ShardStatus, Status};
    use crate::farm::testing::plan;

    fn shard(k: u64, batches: u64, host: &str) -> ShardStatus {
        let plan = plan();
        let seconds = 2.0 * batches as f64;
        let begun = ShardStatus { batches, host: host.to_owned(), seconds, ..ShardStatus::not_begun(&plan, k) };
        ShardStatus { age_seconds: 7, active: batches < begun.of, ..begun }
    }

    #[test]
    fn the_text_names_hosts_attempts_and_rates_and_is_as_long_as_is_asked_for() {
        let mut shards = vec![shard(0, 4, "n1"), shard(1, 1, "n2"), shard(2, 0, "")];
        let attempt = |host: &str| Attempt { started: u64::MAX, host: host.to_owned(), process: 1, batches: 0 };
        shards[1].tried(&plan(), &[attempt("n1"), attempt("n2")]);
        shards[2].tried(&plan(), &[attempt("n3")]);
        let status = Status::new(&plan(), shards, Vec::new());
        assert_eq!((status.attempts, status.shards_active, status.hosts.len()), (3, 2, 3));
        let text = status.text(100);
        let expected = "\
test: 5 of 10 batches, 1 of 3 shards done
0.500 batches/s per worker, 2 at work, 10.0 s spent
about 5 s left
host                 at work    done   batches  batches/s  last heard of
n1                         0       1         4          -  7 s ago
n2                         1       0         1      0.500  7 s ago
n3                         1       0         0          -  0 s ago
shard 1: 1 of 4 batches, written 7 s ago on n2, attempt 2, 0.500 batches/s
shard 2: 0 of 2 batches, begun 0 s ago on n3
";
        assert_eq!(text, expected);
        let short = status.text(1);
        assert!(
            short.contains("... and 2 more hosts\nshard 1: ") && short.ends_with("... and 1 more shards\n"),
            "{short}"
        );
    }

    #[test]
    fn times_are_for_people() {
        let times = [0.4, 99.4, 100.0, 5999.0, 6000.0, 90_000.0].map(super::duration);
        assert_eq!(times, ["0 s", "99 s", "2 min", "100 min", "1.7 h", "25.0 h"]);
    }
}
