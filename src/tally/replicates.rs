//! Every batch's score of every bin: moments of any order, and later the jackknife, come from these.

use super::statistics::Estimate;
use serde::{Deserialize, Serialize};

/// Batch scores row by row: entry `batch * bins + bin`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Replicates {
    /// Number of bins.
    pub bins: u64,
    /// Scores, batch by batch.
    pub value: Vec<f64>,
    /// The sampled direct part of each score.
    pub direct: Vec<f64>,
}

impl Replicates {
    /// No batches yet of `bins` bins.
    pub fn new(bins: usize) -> Self {
        Replicates { bins: bins as u64, value: Vec::new(), direct: Vec::new() }
    }

    /// Takes in the scores of one batch.
    pub fn accumulate(&mut self, value: &[f64], direct: &[f64]) {
        assert!(value.len() as u64 == self.bins && direct.len() == value.len(), "scores of another shape");
        self.value.extend_from_slice(value);
        self.direct.extend_from_slice(direct);
    }

    /// True when this holds `batches` whole batches of `bins` bins, as one read from a file must.
    pub fn has_shape(&self, bins: usize, batches: u64) -> bool {
        let entries = (bins as u64).checked_mul(batches);
        self.bins == bins as u64 && entries == Some(self.value.len() as u64) && self.direct.len() == self.value.len()
    }

    /// Appends the batches of the next shard.
    pub fn append(&mut self, mut next: Replicates) {
        assert_eq!(self.bins, next.bins, "replicates of another shape");
        self.value.append(&mut next.value);
        self.direct.append(&mut next.direct);
    }

    /// Number of batches.
    pub fn batches(&self) -> u64 {
        (self.value.len() as u64).checked_div(self.bins).unwrap_or(0)
    }

    /// The scores of one bin, batch by batch.
    pub fn scores(&self, bin: usize) -> impl Iterator<Item = f64> + Clone + '_ {
        self.value.iter().skip(bin).step_by(self.bins as usize).copied()
    }

    /// Mean of the sampled direct part of one bin.
    pub fn direct_mean(&self, bin: usize) -> f64 {
        Estimate::from_scores(self.direct.iter().skip(bin).step_by(self.bins as usize).copied()).mean
    }

    /// The estimate of one bin. A bin that never scored has no information: its error is NaN, never 0.
    pub fn estimate(&self, bin: usize) -> Estimate {
        let mut estimate = Estimate::from_scores(self.scores(bin));
        if self.scores(bin).all(|x| x == 0.0) {
            estimate.standard_error = f64::NAN;
        }
        estimate
    }
}
