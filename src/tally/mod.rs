//! What is counted: the scores of one batch, and the tallies that take them in.
//!
//! A batch fills one [`Scores`] for each receiver set; [`Tally::accumulate`] takes them in, once, and `n` grows by
//! one. The batch is the only unit of the variance: squares are taken of batch scores and of nothing smaller.
//! A tally is an ordered left fold, so equal batches in equal order give equal bits. It does not know what
//! quantity it counts nor where its bins lie.
//!
//! **No information.** A bin whose receiver existed in some batch and that no history of any batch ever reached
//! ([`informed`]) has the error NaN, never 0 and never that of its direct part alone: nobody knows what the histories
//! that were not drawn would have brought, and an interval stands for the whole value. So a lux-meter in the light of
//! an area lamp that no reflected light reached has a value and no interval. A bin whose receiver never existed (a
//! pixel in which nothing reflects) has, on the other hand, nothing to wait for: its interval is that of its direct
//! light. The rule is the same for maps, grids, points, regions and the flux balance.

pub mod derived;
pub mod health;
mod moments;
mod monitor;
mod replicates;
pub mod statistics;
mod student;

pub use moments::{MomentBlock, Moments};
pub use monitor::{HistoryMoments, LARGEST, Monitor, Watched};
pub use replicates::{EveryBatch, Replicates};

use crate::job::{Kept, SetShape};

/// Names of the bins of the flux balance, in the order in which a batch scores them \[lm\].
pub const FLUX_BINS: [&str; 5] = ["emitted", "absorbed", "escaped", "lost", "met_delta"];

/// What one batch adds to the bins of one receiver set, already divided by its histories.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scores {
    /// Total of the part that differs from batch to batch: connections and sampled direct light.
    pub value: Vec<f64>,
    /// Sampled direct part of `value`.
    pub direct: Vec<f64>,
    /// R, G, B of `value`; empty where the set keeps no colour.
    pub colour: Vec<[f64; 3]>,
    /// The largest total of a single history, direct light left out.
    pub peak: Vec<f64>,
    /// The part of `value` by ways that no bound holds: light that a mirror sent beside an edge, and about what narrow lobes
    /// reflect of lights without extent. For the health of the result alone.
    pub caustic: Vec<f64>,
    /// Whether the receiver of the bin existed: a surface that reflects was hit.
    pub existed: Vec<bool>,
    /// Single histories of the monitored bins, in their order.
    pub watched: Vec<Watched>,
}

impl Scores {
    /// Zero scores for the bins of `shape`.
    pub fn zero(shape: &SetShape) -> Self {
        let bins = shape.bins();
        let colour = matches!(shape.kept, Kept::Moments { colour: true });
        Scores {
            value: vec![0.0; bins],
            direct: vec![0.0; bins],
            colour: vec![[0.0; 3]; if colour { bins } else { 0 }],
            peak: vec![0.0; bins],
            caustic: vec![0.0; bins],
            existed: vec![false; bins],
            watched: vec![Watched::default(); shape.monitored.len()],
        }
    }

    /// Feeds every bit of these scores to `hasher`.
    fn digest_into(&self, hasher: &mut blake3::Hasher) {
        let numbers = [&self.value[..], &self.direct, self.colour.as_flattened(), &self.peak, &self.caustic];
        let watched = self.watched.iter().map(|w| &w.totals[..]);
        numbers.into_iter().chain(watched).for_each(|numbers| feed(hasher, numbers));
        let existed: Vec<u8> = self.existed.iter().map(|&e| u8::from(e)).collect();
        hasher.update(&existed);
    }
}

/// Feeds every bit of `numbers` to `hasher`, many at a time: it is several times as fast on runs of kilobytes.
fn feed(hasher: &mut blake3::Hasher, numbers: &[f64]) {
    let mut bytes = [[0; 8]; 2048];
    for some in numbers.chunks(bytes.len()) {
        bytes.iter_mut().zip(some).for_each(|(to, x)| *to = x.to_le_bytes());
        hasher.update(bytes[..some.len()].as_flattened());
    }
}

/// False for a bin of which nothing is known: its receiver `existed` in some batch, and the `peak`, the largest total
/// of a single history, is zero.
pub fn informed(existed: u64, peak: f64) -> bool {
    existed == 0 || peak != 0.0
}

/// All that one batch adds: a [`Scores`] for each receiver set in job order, and the flux balance.
#[derive(Clone, Debug, PartialEq)]
pub struct BatchScores {
    /// One for each receiver set.
    pub sets: Vec<Scores>,
    /// In the order of [`FLUX_BINS`] \[lm\].
    pub flux: [f64; FLUX_BINS.len()],
}

impl BatchScores {
    /// The 16-byte digest by which a checkpoint remembers this batch.
    pub fn digest(&self) -> [u8; 16] {
        let mut hasher = blake3::Hasher::new();
        self.sets.iter().for_each(|s| s.digest_into(&mut hasher));
        for x in self.flux {
            hasher.update(&x.to_bits().to_le_bytes());
        }
        hasher.finalize().as_bytes()[..16].try_into().expect("a hash is longer than 16 bytes")
    }
}

/// The tally of one receiver set.
#[derive(Clone, Debug, PartialEq)]
pub enum SetTally {
    /// Moments of batch scores, for maps.
    Moments(Moments),
    /// Every batch's score, for grids, points and regions.
    Replicates(Replicates),
}

impl SetTally {
    /// An empty tally for `shape`.
    pub fn new(shape: &SetShape) -> Self {
        match shape.kept {
            Kept::Moments { colour } => SetTally::Moments(Moments::new(shape.bins(), colour)),
            Kept::EveryBatch => SetTally::Replicates(Replicates::new(shape.bins())),
        }
    }

    fn accumulate(&mut self, scores: &Scores) {
        match self {
            SetTally::Moments(m) => m.accumulate(scores),
            SetTally::Replicates(r) => r.accumulate_scores(scores),
        }
    }
}

/// The tallies of all receiver sets and of the flux balance, over the batches of one shard.
#[derive(Clone, Debug, PartialEq)]
pub struct Tally {
    /// One for each receiver set in job order.
    pub sets: Vec<SetTally>,
    /// For each receiver set its monitored bins, in their order.
    pub monitors: Vec<Vec<Monitor>>,
    /// The flux balance: every batch, bins as in [`FLUX_BINS`].
    pub flux: Replicates,
    /// Digest of each batch, in order.
    pub digests: Vec<[u8; 16]>,
}

impl Tally {
    /// An empty tally for the receiver sets `shapes`.
    pub fn new(shapes: &[SetShape]) -> Self {
        Tally {
            sets: shapes.iter().map(SetTally::new).collect(),
            monitors: shapes.iter().map(Monitor::of_set).collect(),
            flux: Replicates::new(FLUX_BINS.len()),
            digests: Vec::new(),
        }
    }

    /// Number of batches taken in.
    pub fn batches(&self) -> u64 {
        self.digests.len() as u64
    }

    /// Takes in the scores of the next batch.
    pub fn accumulate(&mut self, scores: &BatchScores) {
        assert_eq!(self.sets.len(), scores.sets.len(), "scores of another job");
        for (tally, scores) in self.sets.iter_mut().zip(&scores.sets) {
            tally.accumulate(scores);
        }
        for (monitors, scores) in self.monitors.iter_mut().zip(&scores.sets) {
            assert_eq!(monitors.len(), scores.watched.len(), "histories of another job");
            let watched = monitors.iter_mut().zip(&scores.watched);
            watched.for_each(|(monitor, watched)| monitor.accumulate(scores.value[monitor.bin as usize], watched));
        }
        self.flux.accumulate(&scores.flux, &[0.0; FLUX_BINS.len()]);
        self.digests.push(scores.digest());
    }
}

#[cfg(test)]
mod tests {
    use super::statistics::Estimate;
    use super::*;
    use crate::job::ReceiverKind;

    /// The estimate of one bin after 20 batches of (value, direct, peak, existed), kept as moments and batch by batch.
    fn both(batch: impl Fn(u32) -> (f64, f64, f64, bool)) -> [Estimate; 2] {
        [Kept::Moments { colour: false }, Kept::EveryBatch].map(|kept| {
            let (width, height) = (1, 1);
            let shape =
                SetShape { name: "x".into(), kind: ReceiverKind::Grid, width, height, kept, monitored: Vec::new() };
            let mut tally = Tally::new(std::slice::from_ref(&shape));
            for index in 0..20 {
                let mut s = Scores::zero(&shape);
                (s.value[0], s.direct[0], s.peak[0], s.existed[0]) = batch(index);
                tally.accumulate(&BatchScores { sets: vec![s], flux: [0.0; 5] });
            }
            match &tally.sets[0] {
                SetTally::Moments(m) => m.bins.estimate(0, m.n),
                SetTally::Replicates(r) => r.estimate(0),
            }
        })
    }

    fn direct(index: u32) -> f64 {
        10.0 + f64::from(index % 2)
    }

    #[test]
    fn direct_light_alone_gives_no_interval_where_reflected_light_could_come() {
        // An area lamp lights the receiver, a little differently in each batch; no history reached it.
        for e in both(|i| (direct(i), direct(i), 0.0, true)) {
            assert!((e.mean - 10.5).abs() < 1e-14 && e.standard_error.is_nan(), "{e:?}");
        }
        // One history in one batch reached it: there is something to be known, and it is in the scores.
        for e in
            both(|i| (direct(i) + if i == 7 { 0.01 } else { 0.0 }, direct(i), if i == 7 { 0.64 } else { 0.0 }, true))
        {
            assert!((e.standard_error - (5.0f64 / (20.0 * 19.0)).sqrt()).abs() < 1e-3, "{e:?}");
        }
    }

    #[test]
    fn without_a_receiver_direct_light_is_all_and_has_its_interval() {
        for e in both(|i| (direct(i), direct(i), 0.0, false)) {
            assert!((e.standard_error - (5.0f64 / (20.0 * 19.0)).sqrt()).abs() < 1e-14, "{e:?}");
        }
        for e in both(|_| (0.0, 0.0, 0.0, false)) {
            assert_eq!((e.mean, e.standard_error), (0.0, 0.0));
        }
        for e in both(|_| (0.0, 0.0, 0.0, true)) {
            assert!(e.mean == 0.0 && e.standard_error.is_nan());
        }
    }

    #[test]
    fn the_digest_of_a_batch_covers_single_histories() {
        let shape = SetShape {
            name: "x".into(),
            kind: ReceiverKind::Point,
            width: 1,
            height: 1,
            kept: Kept::EveryBatch,
            monitored: vec![0],
        };
        let digest = |totals: [f64; 2]| {
            let mut s = Scores::zero(&shape);
            s.watched[0].totals = totals.to_vec();
            BatchScores { sets: vec![s], flux: [0.0; 5] }.digest()
        };
        assert_ne!(digest([1.0, 2.0]), digest([2.0, 1.0]));
        assert_eq!(digest([1.0, 2.0]), digest([1.0, 2.0]));
    }
}
