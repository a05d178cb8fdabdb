//! How far a run with a goal is: which looks have come, what they showed, and which is likely to be the last.

use super::ShardStatus;
use crate::farm::plan::Plan;
use serde::Serialize;

/// How far a run with a goal is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GoalStatus {
    /// The last look before which every batch is done; None before the first.
    pub last_look: Option<u64>,
    /// The look after that; None when the limit comes first.
    pub next_look: Option<u64>,
    /// What is known of the looks so far.
    pub verdict: Verdict,
    /// What the last look showed; None when nobody has looked.
    pub seen: Option<Seen>,
    /// The look at which the goal is likely to be reached, from what the last one showed; None when that is not
    /// known, or beyond the limit.
    pub expected_look: Option<u64>,
    /// Time until then with as many workers as now \[s\].
    pub eta_seconds: Option<f64>,
}

/// What a look showed of the worst set.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Seen {
    /// Batches at the look.
    pub batches: u64,
    /// Half the width of the interval over the mean that the share asked for does not exceed \[1\].
    pub relative_half_width: f64,
}

/// What is known of the looks of a run so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Nobody has looked: it would take reading tallies.
    Open,
    /// The goal was reached at no look so far.
    NotReached,
    /// The goal was reached after this number of batches: the run is done.
    ReachedAt(u64),
}

impl GoalStatus {
    /// From the progress of the shards of `plan`, in shard order; None without a goal.
    pub(super) fn new(plan: &Plan, shards: &[ShardStatus]) -> Option<Self> {
        plan.job.stop.as_ref()?;
        let last_look = plan.last_look(shards.iter().map(|s| s.done(plan)));
        let next_look = plan.looks().into_iter().find(|&look| Some(look) > last_look);
        let verdict = if last_look.is_some() { Verdict::Open } else { Verdict::NotReached };
        Some(GoalStatus { last_look, next_look, verdict, seen: None, expected_look: None, eta_seconds: None })
    }

    /// Takes in what the looks showed.
    pub(super) fn judge(&mut self, plan: &Plan, reached: Option<u64>, seen: Option<Seen>) {
        self.verdict = reached.map_or(Verdict::NotReached, Verdict::ReachedAt);
        self.seen = seen;
        let wanted = plan.job.stop.as_ref().map(|stop| stop.relative_half_width);
        self.expected_look = match (reached, seen, wanted) {
            (None, Some(seen), Some(wanted)) => expected_look(&plan.looks(), seen, wanted),
            _ => None,
        };
    }
}

/// The first of `looks` after `seen` by which the half-width, falling as 1/sqrt(batches), is `wanted`.
fn expected_look(looks: &[u64], seen: Seen, wanted: f64) -> Option<u64> {
    let ratio = seen.relative_half_width / wanted;
    let needed = seen.batches as f64 * ratio * ratio;
    looks.iter().copied().find(|&look| look > seen.batches && look as f64 >= needed)
}

impl std::fmt::Display for GoalStatus {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match (self.verdict, self.last_look) {
            (Verdict::ReachedAt(batches), _) => return write!(f, "goal reached at {batches} batches: done"),
            (Verdict::Open, Some(look)) => write!(f, "look at {look} batches: `lampyris merge` says what it shows, ")?,
            (Verdict::NotReached, Some(look)) => write!(f, "goal not reached at {look} batches, ")?,
            (_, None) => {}
        }
        match self.next_look {
            Some(look) => write!(f, "next look at {look} batches"),
            None => write!(f, "no look left before the limit"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_expected_look_is_the_first_that_is_late_enough() {
        let looks = [16, 24, 36, 56];
        let expected =
            |batches, width, wanted| expected_look(&looks, Seen { batches, relative_half_width: width }, wanted);
        assert_eq!(expected(16, 0.012, 0.01), Some(24), "16 x 1.44 = 23.04");
        assert_eq!(expected(16, 0.015, 0.01), Some(36), "16 x 2.25 = 36");
        assert_eq!(expected(24, 0.0101, 0.01), Some(36), "never a look that has come");
        assert_eq!(expected(16, 0.02, 0.01), None, "64 batches are beyond the limit");
        assert_eq!(expected(16, f64::INFINITY, 0.01), None, "nothing is known");
    }
}
