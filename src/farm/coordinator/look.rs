//! When to ask whether the goal has been reached: once at every look of the plan, as soon as every shard before it is
//! complete. Workers run ahead meanwhile; what they do beyond the look is not used.

use super::GoalReached;
use crate::error::Result;
use crate::farm::folder::Folder;
use crate::farm::plan::Plan;
use crate::farm::status::ShardStatus;

/// Follows the looks of a plan.
pub struct Watch<'a> {
    folder: &'a Folder,
    plan: &'a Plan,
    goal_reached: GoalReached<'a>,
    /// The last look that was asked about; 0 before the first.
    asked: u64,
}

impl<'a> Watch<'a> {
    pub fn new(folder: &'a Folder, plan: &'a Plan, goal_reached: GoalReached<'a>) -> Self {
        Watch { folder, plan, goal_reached, asked: 0 }
    }

    /// True when `shards` complete a look not asked about before, and the goal has been reached.
    pub fn goal_reached(&mut self, shards: &[ShardStatus]) -> Result<bool> {
        match self.plan.last_look(shards.iter().map(|s| s.done(self.plan))) {
            Some(look) if look > self.asked => {
                self.asked = look;
                (self.goal_reached)(self.folder)
            }
            _ => Ok(false),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::farm::testing::{JOB, plan, plan_of};
    use std::cell::Cell;

    fn shards(plan: &Plan, batches: &[u64]) -> Vec<ShardStatus> {
        let of = |(k, &batches): (u64, &u64)| ShardStatus { batches, ..ShardStatus::not_begun(plan, k) };
        (0..).zip(batches).map(of).collect()
    }

    #[test]
    fn each_look_is_asked_about_once_when_every_shard_before_it_is_complete() {
        let goal = "[stop]\nrelative_half_width = 0.01\nmax_batches = 30\n[[camera]]";
        let plan = plan_of(&JOB.replace("batches = 10\n", "").replacen("[[camera]]", goal, 1)).unwrap();
        assert_eq!(plan.looks(), [16, 24]);
        let asked = Cell::new(0);
        let ask = |_: &Folder| {
            asked.set(asked.get() + 1);
            Ok(asked.get() == 2)
        };
        let folder = Folder::new(std::path::Path::new("nowhere"));
        let mut watch = Watch::new(&folder, &plan, &ask);
        // (batches of the shards of four, questions so far, answer)
        let cases: [(&[u64], u32, bool); 7] = [
            (&[4, 4, 4, 0, 0], 0, false),
            (&[4, 4, 3, 4, 4, 4], 0, false),
            (&[4, 4, 4, 4, 1], 1, false),
            (&[4, 4, 4, 4, 4], 1, false),
            (&[4, 4, 4, 4, 4, 3, 4], 1, false),
            (&[4, 4, 4, 4, 4, 4, 4, 2], 2, true),
            (&[4, 4, 4, 4, 4, 4, 4, 2], 2, false),
        ];
        for (batches, questions, reached) in cases {
            assert_eq!(watch.goal_reached(&shards(&plan, batches)).unwrap(), reached, "{batches:?}");
            assert_eq!(asked.get(), questions, "{batches:?}");
        }
    }

    #[test]
    fn without_a_goal_nobody_is_asked() {
        let (plan, folder) = (plan(), Folder::new(std::path::Path::new("nowhere")));
        let mut watch = Watch::new(&folder, &plan, &|_| panic!("asked"));
        assert!(!watch.goal_reached(&shards(&plan, &[4, 4, 2])).unwrap());
    }
}
