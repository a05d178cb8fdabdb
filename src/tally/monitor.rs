//! Single histories of the few bins whose intervals are examined closely: power sums and the largest totals.
//!
//! Power sums are kept for each batch, so that those of any number of batches can be put together again, merged by
//! docs/method.md, equation (11.1). They are for diagnosis only: no interval comes from them, since histories of a
//! batch depend on each other (they share positions, samples of lights, or a quasi-random set).

use crate::job::SetShape;
use serde::{Deserialize, Serialize};

/// Totals that are remembered one by one: what the fit of the tail is made of.
pub const LARGEST: usize = 200;

/// What the histories of one batch gave one monitored bin.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Watched {
    /// The luminous total of every history, zeros included, in the order of the histories \[lx or cd/m2\].
    pub totals: Vec<f64>,
}

/// Number, mean and central power sums of history totals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HistoryMoments {
    /// Number of histories, zeros included.
    pub n: u64,
    /// Mean of the totals.
    pub mean: f64,
    /// Sum of the squared deviations from the mean.
    pub m2: f64,
    /// Sum of the cubed deviations.
    pub m3: f64,
    /// Sum of the fourth powers of the deviations.
    pub m4: f64,
}

impl HistoryMoments {
    /// Of `totals`, in two passes.
    pub fn of(totals: &[f64]) -> Self {
        if totals.is_empty() {
            return HistoryMoments::default();
        }
        let mean = totals.iter().sum::<f64>() / totals.len() as f64;
        let mut moments = HistoryMoments { n: totals.len() as u64, mean, ..HistoryMoments::default() };
        for total in totals {
            let d = total - mean;
            moments.m2 += d * d;
            moments.m3 += d * d * d;
            moments.m4 += (d * d) * (d * d);
        }
        moments
    }

    /// Of both together, equation (11.1).
    pub fn merged(self, other: Self) -> Self {
        if other.n == 0 {
            return self;
        }
        if self.n == 0 {
            return other;
        }
        let (a, b) = (self.n as f64, other.n as f64);
        let (n, d) = (a + b, other.mean - self.mean);
        // The shares, and d/n with them, so that no product of counts can lose digits or overflow.
        let (pa, pb) = (a / n, b / n);
        HistoryMoments {
            // Saturating: a count from a file is not ours to trust.
            n: self.n.saturating_add(other.n),
            mean: self.mean + d * pb,
            m2: self.m2 + other.m2 + d * d * a * pb,
            m3: self.m3 + other.m3 + d * d * d * a * pb * (pa - pb) + 3.0 * d * (pa * other.m2 - pb * self.m2),
            m4: self.m4
                + other.m4
                + (d * d) * (d * d) * a * pb * (pa * pa - pa * pb + pb * pb)
                + 6.0 * d * d * (pa * pa * other.m2 + pb * pb * self.m2)
                + 4.0 * d * (pa * other.m3 - pb * self.m3),
        }
    }

    /// Variance of the variance of the totals, M4/M2^2 - 1/n, equation (11.2) \[1\]; NaN where M2 = 0.
    pub fn variance_of_variance(&self) -> f64 {
        if self.m2 > 0.0 { self.m4 / (self.m2 * self.m2) - 1.0 / self.n as f64 } else { f64::NAN }
    }
}

/// The history of one monitored bin.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Monitor {
    /// Number of the bin in its set.
    pub bin: u32,
    /// Score of each batch, in batch order: the bins of a map keep none elsewhere.
    pub scores: Vec<f64>,
    /// Single histories of each batch, in batch order.
    pub histories: Vec<HistoryMoments>,
    /// The largest totals of all batches, in descending order, at most [`LARGEST`], zeros left out.
    pub largest: Vec<f64>,
}

impl Monitor {
    /// No batches yet of the bin number `bin`.
    pub fn new(bin: u32) -> Self {
        Monitor { bin, ..Monitor::default() }
    }

    /// No batches yet of each monitored bin of `shape`.
    pub fn of_set(shape: &SetShape) -> Vec<Monitor> {
        shape.monitored.iter().map(|&bin| Monitor::new(bin)).collect()
    }

    /// Takes in the score of the next batch and its single histories.
    pub fn accumulate(&mut self, score: f64, watched: &Watched) {
        let largest = watched.totals.iter().copied().filter(|&x| x > 0.0).collect();
        let histories = vec![HistoryMoments::of(&watched.totals)];
        self.append(Monitor { bin: self.bin, scores: vec![score], histories, largest });
    }

    /// Appends the batches of the next shard.
    pub fn append(&mut self, mut next: Monitor) {
        assert_eq!(self.bin, next.bin, "the monitor of another bin");
        self.scores.append(&mut next.scores);
        self.histories.append(&mut next.histories);
        self.largest.append(&mut next.largest);
        self.largest.sort_unstable_by(|a, b| b.total_cmp(a));
        self.largest.truncate(LARGEST);
    }

    /// True when this holds `batches` batches of `bin` and an ordered list, as one read from a file must.
    pub fn has_shape(&self, bin: u32, batches: u64) -> bool {
        let ordered = self.largest.windows(2).all(|w| w[0] >= w[1]) && self.largest.iter().all(|&x| x > 0.0);
        let counts = [self.scores.len(), self.histories.len()];
        let whole = counts.iter().all(|&n| n as u64 == batches);
        self.bin == bin && whole && self.largest.len() <= LARGEST && ordered
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Domain, Stream};

    /// `n` uniform totals between 10 and 11.
    fn totals(n: usize) -> Vec<f64> {
        let mut g = Stream::new(3, Domain::Receiver, "totals").generator(n as u64);
        (0..n).map(|_| 10.0 + g.uniform()).collect()
    }

    fn close(a: f64, b: f64, scale: f64) -> bool {
        (a - b).abs() <= 1e-12 * scale
    }

    #[test]
    fn any_grouping_gives_the_same_power_sums() {
        let all = totals(10_000);
        let whole = HistoryMoments::of(&all);
        let n = all.len() as f64;
        for pieces in [vec![10_000], vec![1; 10_000], vec![3, 5000, 1, 4996], vec![64; 156]] {
            let (mut at, mut sum) = (0, HistoryMoments::default());
            for piece in pieces.into_iter().chain([16]) {
                let end = (at + piece).min(all.len());
                sum = sum.merged(HistoryMoments::of(&all[at..end]));
                at = end;
            }
            assert_eq!(sum.n, 10_000);
            // M3 of a symmetric density is near zero: its scale is that of the deviations, n sigma^3.
            assert!(close(sum.mean, whole.mean, 10.0) && close(sum.m2, whole.m2, whole.m2), "{sum:?} {whole:?}");
            assert!(close(sum.m3, whole.m3, n) && close(sum.m4, whole.m4, whole.m4), "{sum:?} {whole:?}");
        }
    }

    #[test]
    fn merging_is_associative_within_rounding_and_zero_is_neutral() {
        let parts: Vec<_> = [7, 100, 31].map(|n| HistoryMoments::of(&totals(n))).into();
        let left = parts[0].merged(parts[1]).merged(parts[2]);
        let right = parts[0].merged(parts[1].merged(parts[2]));
        assert!(close(left.m2, right.m2, left.m2) && close(left.m4, right.m4, left.m4));
        assert!(close(left.m3, right.m3, left.n as f64));
        let nothing = HistoryMoments::default();
        assert_eq!((left.merged(nothing), nothing.merged(left)), (left, left));
    }

    #[test]
    fn power_sums_are_those_of_a_hand_made_sample() {
        // Mean 3, deviations -3, -1, 4.
        let m = HistoryMoments::of(&[0.0, 2.0, 7.0]);
        assert_eq!((m.n, m.mean, m.m2, m.m3, m.m4), (3, 3.0, 26.0, 36.0, 338.0));
        assert_eq!(m.variance_of_variance(), 338.0 / 676.0 - 1.0 / 3.0);
        assert!(HistoryMoments::of(&[2.0; 5]).variance_of_variance().is_nan());
        assert!(HistoryMoments::default().variance_of_variance().is_nan());
    }

    #[test]
    fn the_largest_are_kept_whatever_the_grouping() {
        let batches: Vec<Vec<f64>> = (0..30).map(|b| totals(20 + b)).collect();
        let mut straight = Monitor::default();
        batches.iter().for_each(|t| straight.accumulate(1.0, &Watched { totals: t.clone() }));
        let mut sorted: Vec<f64> = batches.concat();
        sorted.sort_by(|a, b| b.total_cmp(a));
        assert_eq!(straight.largest, sorted[..LARGEST]);
        let mut shards = Monitor::default();
        for shard in batches.chunks(7) {
            let mut part = Monitor::default();
            shard.iter().for_each(|t| part.accumulate(1.0, &Watched { totals: t.clone() }));
            shards.append(part);
        }
        assert_eq!(shards, straight);
        assert!(shards.has_shape(0, 30) && !shards.has_shape(0, 29) && !shards.has_shape(1, 30));
    }

    #[test]
    fn zeros_count_as_histories_and_not_among_the_largest() {
        let mut monitor = Monitor::default();
        monitor.accumulate(0.5, &Watched { totals: vec![0.0, 2.0, 0.0, 0.0] });
        assert_eq!((monitor.histories[0].n, monitor.histories[0].mean), (4, 0.5));
        assert_eq!((monitor.largest.as_slice(), monitor.scores.as_slice()), ([2.0].as_slice(), [0.5].as_slice()));
    }

    #[test]
    fn what_a_file_must_not_claim_is_refused() {
        let histories = vec![HistoryMoments::default()];
        let good = Monitor { bin: 5, scores: vec![1.0], histories, largest: vec![2.0, 1.0] };
        assert!(good.has_shape(5, 1));
        let bad = |edit: fn(&mut Monitor)| {
            let mut m = good.clone();
            edit(&mut m);
            assert!(!m.has_shape(5, 1), "{m:?}");
        };
        bad(|m| m.scores.clear());
        bad(|m| m.histories.push(HistoryMoments::default()));
        bad(|m| m.largest.reverse());
        bad(|m| m.largest[1] = 0.0);
        bad(|m| m.largest[0] = f64::NAN);
        bad(|m| m.largest = vec![1.0; LARGEST + 1]);
        let huge = HistoryMoments { n: u64::MAX, mean: 1.0, m2: 1.0, m3: 0.0, m4: 1.0 };
        assert_eq!(huge.merged(huge).n, u64::MAX);
    }
}
