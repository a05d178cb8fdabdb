//! When a run with a goal is looked at: numbers of batches, by arithmetic alone.
//!
//! ```text
//! look 1      the smallest multiple of batches_per_shard that is at least 16
//! look k + 1  the smallest multiple of batches_per_shard that is at least 1.5 x look k
//! ```
//!
//! The looks are a function of `batches_per_shard` and of nothing else: not of the goal, the limit or the workers.
//! They are few and far apart because each is one more chance to be deceived by a standard error that is small by
//! luck, and the first is late because that luck is common below 16 batches. `max_batches` is a limit, not a look:
//! a run that ends there has not chosen its end.

use super::Plan;
use crate::error::{Error, Result};
use std::ops::Range;

/// Batches before the first look, at least: with 15 degrees of freedom a standard error is rarely half of what it
/// should be; with one or two it often is.
const FEWEST: u64 = 16;

/// The numbers of batches after which a run is looked at, ascending.
pub fn looks(batches_per_shard: u64) -> impl Iterator<Item = u64> {
    let whole_shards = move |batches: u64| batches.div_ceil(batches_per_shard).checked_mul(batches_per_shard);
    let next = move |look: &u64| whole_shards(look.checked_mul(3)?.div_ceil(2));
    std::iter::successors(whole_shards(FEWEST), next)
}

impl Plan {
    /// The looks of this plan within its limit, ascending; none without a goal.
    pub fn looks(&self) -> Vec<u64> {
        let run = &self.job.run;
        let all = self.job.stop.iter().flat_map(|_| looks(run.batches_per_shard));
        all.take_while(|&look| look <= run.batches).collect()
    }

    /// The last look that can be judged when `done` are the ranges of batches that are there, in order: every
    /// batch before it is.
    pub fn last_look(&self, done: impl Iterator<Item = Range<u64>>) -> Option<u64> {
        let mut end = 0;
        for range in done {
            if range.start > end {
                break;
            }
            end = range.end.max(end);
        }
        self.looks().into_iter().rfind(|&look| look <= end)
    }

    /// Refuses a goal at which nobody would ever look.
    ///
    /// # Errors
    /// [`Error::Input`] naming the limit and the first look.
    pub fn check_looks(&self) -> Result<()> {
        let Some(stop) = &self.job.stop else { return Ok(()) };
        match looks(self.job.run.batches_per_shard).next() {
            Some(first) if first > stop.max_batches => {
                let allowed = format!(
                    "at least {first}, the first look: whole shards of run.batches_per_shard, {FEWEST} batches"
                );
                Err(Error::input(&self.job_file.name, "stop.max_batches", stop.max_batches, allowed))
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::farm::testing::{JOB, plan, plan_of};

    #[test]
    fn looks_are_whole_shards_from_sixteen_batches_on_and_grow_by_half() {
        let first = |batches_per_shard: u64| looks(batches_per_shard).take(6).collect::<Vec<_>>();
        assert_eq!(first(1), [16, 24, 36, 54, 81, 122]);
        assert_eq!(first(5), [20, 30, 45, 70, 105, 160]);
        assert_eq!(first(16), [16, 32, 48, 80, 128, 192]);
        assert_eq!(first(17), [17, 34, 51, 85, 136, 204]);
        assert_eq!(first(32), [32, 64, 96, 160, 256, 384]);
        assert_eq!(first(1 << 20)[..2], [1 << 20, 2 << 20]);
        for n in 1..200 {
            let pairs: Vec<u64> = looks(n).take(20).collect();
            assert!(pairs[0] >= 16 && pairs[0] < 16 + n);
            assert!(pairs.windows(2).all(|p| p[1] % n == 0 && 2 * p[1] >= 3 * p[0] && 2 * p[1] < 3 * p[0] + 2 * n));
        }
    }

    #[test]
    fn looks_end_before_they_overflow() {
        let all: Vec<u64> = looks((1 << 62) + 1).collect();
        assert_eq!(all, [(1 << 62) + 1, (1 << 63) + 2]);
    }

    #[test]
    fn the_limit_cuts_the_looks_and_moves_none() {
        let with = |max_batches: u64| {
            let stop = format!("[stop]\nrelative_half_width = 0.01\nmax_batches = {max_batches}\n[[camera]]");
            plan_of(&JOB.replace("batches = 10\n", "").replacen("[[camera]]", &stop, 1))
        };
        for (limit, looks) in [(16, &[16][..]), (23, &[16]), (24, &[16, 24]), (60, &[16, 24, 36, 56])] {
            let plan = with(limit).unwrap();
            assert_eq!((plan.looks().as_slice(), plan.job.run.batches), (looks, limit));
        }
        assert!(plan().looks().is_empty(), "no goal, no looks");
        let wide = JOB.replace("batches = 10\nbatches_per_shard = 4", "batches_per_shard = 40").replacen(
            "[[camera]]",
            "[stop]\nrelative_half_width = 0.01\nmax_batches = 39\n[[camera]]",
            1,
        );
        let refused = plan_of(&wide).unwrap_err().to_string();
        assert!(refused.contains("stop.max_batches = 39: at least 40, the first look"), "{refused}");
    }
}
