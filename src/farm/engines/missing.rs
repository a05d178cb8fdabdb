//! Plan and progress -> the shards that are still to be computed.
//!
//! With a goal these are the shards up to the next look, and none once it has been reached: whoever computed up to the
//! limit at once would mostly compute for nothing. So a goal takes as many submissions as looks.

use crate::farm::plan::Plan;
use crate::farm::status::{Status, Verdict};
use std::collections::BTreeSet;

/// What is still to be computed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Missing {
    /// Numbers of the shards, ascending.
    pub shards: Vec<u64>,
    /// The look up to which they go; None without a goal, or where the limit comes first.
    pub look: Option<u64>,
}

impl Missing {
    /// Of `plan`, whose progress is `status`: judged, where the plan has a goal.
    pub fn of(plan: &Plan, status: &Status) -> Missing {
        let (end, look) = match status.goal {
            None => (plan.job.run.batches, None),
            Some(goal) if matches!(goal.verdict, Verdict::ReachedAt(_)) => (0, None),
            Some(goal) => (goal.next_look.unwrap_or(plan.job.run.batches), goal.next_look),
        };
        let done: BTreeSet<u64> = status.shards.iter().filter(|s| s.batches >= s.of).map(|s| s.shard).collect();
        let wanted = (0..plan.shard_count()).take_while(|&k| plan.shard(k).start < end);
        Missing { shards: wanted.filter(|k| !done.contains(k)).collect(), look }
    }
}

/// Numbers in ascending order as Slurm and people write them: `0-3,7`.
pub fn list(numbers: impl IntoIterator<Item = u64>) -> String {
    let mut ranges: Vec<(u64, u64)> = Vec::new();
    for n in numbers {
        match ranges.last_mut() {
            Some((_, last)) if *last + 1 == n => *last = n,
            _ => ranges.push((n, n)),
        }
    }
    let text = |&(a, b): &(u64, u64)| if a == b { a.to_string() } else { format!("{a}-{b}") };
    ranges.iter().map(text).collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::farm::status::ShardStatus;
    use crate::farm::testing::{JOB, plan, plan_of};

    fn missing(plan: &Plan, batches: &[u64], reached: Option<u64>) -> Missing {
        let of = |(k, &batches): (u64, &u64)| ShardStatus { batches, ..ShardStatus::not_begun(plan, k) };
        let mut status = Status::new(plan, (0..).zip(batches).map(of).collect(), Vec::new());
        status.judge(plan, reached, None);
        Missing::of(plan, &status)
    }

    #[test]
    fn without_a_goal_every_unfinished_shard_is_missing() {
        assert_eq!(missing(&plan(), &[], None), Missing { shards: vec![0, 1, 2], look: None });
        assert_eq!(missing(&plan(), &[3, 4], None).shards, [0, 2]);
        assert_eq!(missing(&plan(), &[4, 4, 2], None).shards, [0; 0]);
    }

    #[test]
    fn with_a_goal_the_shards_up_to_the_next_look_are_missing() {
        let goal = "[stop]\nrelative_half_width = 0.01\nmax_batches = 26\n[[camera]]";
        let plan = plan_of(&JOB.replace("batches = 10\n", "").replacen("[[camera]]", goal, 1)).unwrap();
        assert_eq!(plan.looks(), [16, 24]);
        let at = |batches: &[u64]| missing(&plan, batches, None);
        assert_eq!(at(&[]), Missing { shards: vec![0, 1, 2, 3], look: Some(16) });
        assert_eq!(at(&[4, 4, 1, 4, 4]), Missing { shards: vec![2], look: Some(16) });
        assert_eq!(at(&[4, 4, 4, 4]), Missing { shards: vec![4, 5], look: Some(24) });
        assert_eq!(at(&[4; 6]), Missing { shards: vec![6], look: None });
        assert_eq!(missing(&plan, &[4; 4], Some(16)).shards, [0; 0]);
    }

    #[test]
    fn lists_are_short() {
        assert_eq!(list([0, 1, 2, 3, 7, 9, 10]), "0-3,7,9-10");
        assert_eq!(list([5]), "5");
    }
}
