//! Precision as the goal: how the sets stand at a look, and what ended a run.
//!
//! ```text
//! h(bin) = t(confidence, n - 1) x standard error / |mean|        light that is the same in every batch included
//! h(set) = the smallest h that at least `share` of its bins with a receiver do not exceed
//! the goal is reached  <=>  h(set) <= relative_half_width for each set by itself
//! ```
//!
//! An exact bin has h = 0, a bin without information h = infinity. At which batches to look is for the plan to say.
//! Here nothing is known of files, shards and workers: the decision is a function of the batches before the look.

use crate::error::Result;
use crate::farm::checkpoint::Checksum;
use crate::farm::plan::Plan;
use crate::job::Stop;
use crate::tally::statistics::{Estimate, select, student_quantile};

/// What ended a run that has a goal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// A look found the goal reached: the result is that of the batches before it, whatever else was computed.
    GoalReached {
        /// Batches of the result.
        batches: u64,
    },
    /// All batches up to the limit are done and no look found the goal reached.
    Limit,
}

/// What was seen at a look.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// Batches before it.
    pub batches: u64,
    /// The largest h of the sets \[1\]; infinite where too many bins have no information.
    pub relative_half_width: f64,
    /// The set it belongs to.
    pub set: String,
    /// Whether the goal was reached.
    pub reached: bool,
}

/// The goal of a plan.
#[derive(Clone, Debug)]
pub struct Goal {
    stop: Stop,
    confidence: f64,
    /// Number and name of each set that must reach it.
    sets: Vec<(usize, String)>,
}

/// Gives the estimate of every bin of a set that has a receiver to a function, in order.
pub type Estimates<'a> = &'a dyn Fn(usize, &mut dyn FnMut(Estimate)) -> Result<()>;

impl Goal {
    /// The goal of `plan`; None where the job has none.
    pub fn of(plan: &Plan) -> Option<Goal> {
        let stop = plan.job.stop.clone()?;
        let wanted = |name: &String| stop.receivers.is_empty() || stop.receivers.contains(name);
        let sets = plan.sets().into_iter().enumerate();
        let sets = sets.filter(|(_, s)| wanted(&s.name)).map(|(i, s)| (i, s.name)).collect();
        Some(Goal { stop, confidence: plan.job.run.confidence, sets })
    }

    /// Numbers of the sets that must reach it.
    pub fn sets(&self) -> Vec<usize> {
        self.sets.iter().map(|(set, _)| *set).collect()
    }

    /// Digest of what is asked, the number that is to be reached left out: a look that was judged answers the same question
    /// again, whatever that number is.
    pub fn question(&self) -> Checksum {
        let sets: Vec<u64> = self.sets.iter().map(|(set, _)| *set as u64).collect();
        let asked = postcard::to_stdvec(&(sets, self.stop.share, self.confidence));
        let hash = blake3::hash(&asked.expect("plain data of known length always has a postcard form"));
        hash.as_bytes()[..16].try_into().expect("a hash is longer than 16 bytes")
    }

    /// Looks at the sets after `batches` batches.
    ///
    /// # Errors
    /// Those of `estimates`.
    pub fn look(&self, batches: u64, estimates: Estimates) -> Result<Look> {
        let quantile = student_quantile(self.confidence, batches);
        let (mut widest, mut of) = (0.0, None);
        for (set, _) in &self.sets {
            let pass = |take: &mut dyn FnMut(f64)| estimates(*set, &mut |e| take(relative_half_width(e, quantile)));
            let width = width_of_share(pass, self.stop.share)?;
            if of.is_none() || width > widest {
                (widest, of) = (width, Some(*set));
            }
        }
        Ok(self.judge(batches, widest, of.unwrap_or(0)))
    }

    /// The look after `batches` at which the set number `set` had the largest half width `relative_half_width`.
    pub fn judge(&self, batches: u64, relative_half_width: f64, set: usize) -> Look {
        let named = self.sets.iter().find(|(number, _)| *number == set);
        let name = named.map(|(_, name)| name.clone()).unwrap_or_default();
        let reached = relative_half_width <= self.stop.relative_half_width;
        Look { batches, relative_half_width, set: name, reached }
    }

    /// The number of the set called `name`.
    pub fn number_of(&self, name: &str) -> usize {
        self.sets.iter().find(|(_, set)| set == name).map_or(0, |(number, _)| *number)
    }
}

/// h of one bin: half the width of its interval over the size of its mean \[1\].
pub fn relative_half_width(estimate: Estimate, quantile: f64) -> f64 {
    match quantile * estimate.standard_error {
        0.0 => 0.0,
        half if half.is_nan() => f64::INFINITY,
        half => half / estimate.mean.abs(),
    }
}

/// The smallest h that at least `share` of the bins, whose widths `pass` gives, do not exceed; 0 without bins: nothing is
/// wanted.
fn width_of_share(pass: impl Fn(&mut dyn FnMut(f64)) -> Result<()>, share: f64) -> Result<f64> {
    let mut count = 0;
    pass(&mut |_| count += 1)?;
    match enough(count, share).checked_sub(1) {
        Some(last) => select(last as u64, count as u64, pass),
        None => Ok(0.0),
    }
}

/// The least k with k / n >= share.
fn enough(n: usize, share: f64) -> usize {
    let k = ((share * n as f64).ceil() as usize).min(n);
    // The product may be rounded up across an integer, the quotient is what was asked.
    if k > 0 && (k - 1) as f64 / n as f64 >= share { k - 1 } else { k }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(mean: f64, standard_error: f64) -> Estimate {
        Estimate { n: 16, mean, standard_error }
    }

    #[test]
    fn half_widths_count_exact_bins_as_met_and_unknown_ones_as_not() {
        assert_eq!(relative_half_width(estimate(-4.0, 0.5), 2.0), 0.25);
        assert_eq!(relative_half_width(estimate(0.0, 0.0), 2.0), 0.0, "nothing is wrong about an exact zero");
        assert_eq!(relative_half_width(estimate(5.0, 0.0), 2.0), 0.0);
        assert_eq!(relative_half_width(estimate(5.0, f64::NAN), 2.0), f64::INFINITY);
        assert_eq!(relative_half_width(estimate(0.0, 0.5), 2.0), f64::INFINITY);
        assert_eq!(relative_half_width(Estimate::from_moments(1, 3.0, 0.0), 2.0), f64::INFINITY);
    }

    #[test]
    fn a_share_is_at_least_that_share() {
        let cases =
            [(10, 1.0, 10), (10, 0.9, 9), (10, 0.91, 10), (100, 0.07, 7), (3, 0.5, 2), (1, 1e-9, 1), (0, 1.0, 0)];
        for (n, share, k) in cases {
            assert_eq!(enough(n, share), k, "{share} of {n}");
        }
        for n in 1..1000 {
            for percent in 1..=100 {
                assert_eq!(enough(n, percent as f64 / 100.0), (n * percent).div_ceil(100), "{percent} % of {n}");
            }
        }
        let width = |widths: &[f64], share| {
            let pass = |take: &mut dyn FnMut(f64)| {
                widths.iter().for_each(|w| take(*w));
                Ok(())
            };
            width_of_share(pass, share).unwrap()
        };
        let widths = [f64::INFINITY, 0.3, 0.0, 0.1];
        assert_eq!([0.25, 0.5, 0.75, 1.0].map(|share| width(&widths, share)), [0.0, 0.1, 0.3, f64::INFINITY]);
        assert_eq!(width(&[], 1.0), 0.0);
    }
}
