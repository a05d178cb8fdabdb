//! What is counted: the scores of one batch, and the tallies that take them in.
//!
//! A batch fills one [`Scores`] for each receiver set; [`Tally::accumulate`] takes them in, once, and `n` grows by
//! one. The batch is the only unit of the variance: squares are taken of batch scores and of nothing smaller.
//! A tally is an ordered left fold, so equal batches in equal order give equal bits. It does not know what
//! quantity it counts nor where its bins lie.

pub mod derived;
mod moments;
mod monitor;
mod replicates;
pub mod statistics;
mod student;

pub use moments::{MomentBlock, Moments};
pub use monitor::Watched;
pub use replicates::Replicates;

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
            existed: vec![false; bins],
            watched: vec![Watched::default(); shape.monitored.len()],
        }
    }

    /// Feeds every bit of these scores to `hasher`.
    fn digest_into(&self, hasher: &mut blake3::Hasher) {
        let mut feed = |x: &f64| {
            hasher.update(&x.to_bits().to_le_bytes());
        };
        self.value.iter().for_each(&mut feed);
        self.direct.iter().for_each(&mut feed);
        self.colour.iter().flatten().for_each(&mut feed);
        self.peak.iter().for_each(&mut feed);
        self.existed.iter().for_each(|&e| {
            hasher.update(&[u8::from(e)]);
        });
    }
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
    /// Every batch's score, for grids and points.
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
            SetTally::Replicates(r) => r.accumulate(&scores.value, &scores.direct),
        }
    }
}

/// The tallies of all receiver sets and of the flux balance, over the batches of one shard.
#[derive(Clone, Debug, PartialEq)]
pub struct Tally {
    /// One for each receiver set in job order.
    pub sets: Vec<SetTally>,
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
        self.flux.accumulate(&scores.flux, &[0.0; FLUX_BINS.len()]);
        self.digests.push(scores.digest());
    }
}
