//! Every batch's score of every bin: moments of any order and the jackknife come from these.

use super::statistics::Estimate;
use super::{Scores, informed};
use serde::{Deserialize, Serialize};
use std::io;

/// The batch scores of a set some bins at a time, so that they need not fit into memory together.
pub trait EveryBatch {
    /// Number of bins.
    fn bins(&self) -> usize;

    /// Number of batches.
    fn batches(&self) -> u64;

    /// Gives all bins in order to `take`, some together: the number of the first of them, and their scores.
    ///
    /// # Errors
    /// Those of reading what is kept in a file.
    fn each(&self, take: &mut dyn FnMut(usize, &Replicates)) -> io::Result<()>;
}

/// Batch scores row by row: entry `batch * bins + bin`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Replicates {
    /// Number of bins.
    pub bins: u64,
    /// Scores, batch by batch.
    pub value: Vec<f64>,
    /// The sampled direct part of each score.
    pub direct: Vec<f64>,
    /// Largest total of a single history, one entry a bin.
    pub peak: Vec<f64>,
    /// Largest caustic light of a batch, one entry a bin, see [`Scores::caustic`].
    pub caustic: Vec<f64>,
    /// Batches in which the receiver of the bin existed, one entry a bin.
    pub existed: Vec<u64>,
}

impl Replicates {
    /// No batches yet of `bins` bins.
    pub fn new(bins: usize) -> Self {
        let (value, direct) = (Vec::new(), Vec::new());
        let (peak, caustic) = (vec![0.0; bins], vec![0.0; bins]);
        Replicates { bins: bins as u64, value, direct, peak, caustic, existed: vec![0; bins] }
    }

    /// Takes in a batch of numbers whose single histories are not known: what the batch adds to its direct
    /// part stands for one.
    pub fn accumulate(&mut self, value: &[f64], direct: &[f64]) {
        let peak: Vec<f64> = value.iter().zip(direct).map(|(v, d)| (v - d).abs()).collect();
        self.take(value, direct, [&peak, &vec![0.0; value.len()]], &vec![true; value.len()]);
    }

    /// Takes in the scores of one batch.
    pub fn accumulate_scores(&mut self, scores: &Scores) {
        self.take(&scores.value, &scores.direct, [&scores.peak, &scores.caustic], &scores.existed);
    }

    fn take(&mut self, value: &[f64], direct: &[f64], [peak, caustic]: [&[f64]; 2], existed: &[bool]) {
        let lengths = [value.len(), direct.len(), peak.len(), caustic.len(), existed.len()];
        assert!(lengths.iter().all(|&n| n as u64 == self.bins), "scores of another shape");
        self.value.extend_from_slice(value);
        self.direct.extend_from_slice(direct);
        for i in 0..value.len() {
            self.peak[i] = self.peak[i].max(peak[i]);
            self.caustic[i] = self.caustic[i].max(caustic[i]);
            self.existed[i] += u64::from(existed[i]);
        }
    }

    /// True when this holds `batches` whole batches of `bins` bins, as one read from a file must.
    pub fn has_shape(&self, bins: usize, batches: u64) -> bool {
        let entries = (bins as u64).checked_mul(batches);
        self.bins == bins as u64
            && entries == Some(self.value.len() as u64)
            && self.direct.len() == self.value.len()
            && self.peak.len() == bins
            && self.caustic.len() == bins
            && self.existed.len() == bins
    }

    /// Appends the batches of the next shard.
    pub fn append(&mut self, mut next: Replicates) {
        assert_eq!(self.bins, next.bins, "replicates of another shape");
        self.value.append(&mut next.value);
        self.direct.append(&mut next.direct);
        for i in 0..self.peak.len() {
            self.peak[i] = self.peak[i].max(next.peak[i]);
            self.caustic[i] = self.caustic[i].max(next.caustic[i]);
            // Saturating: a count from a file is not ours to trust.
            self.existed[i] = self.existed[i].saturating_add(next.existed[i]);
        }
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

    /// The estimate of one bin; its error is NaN without information, see [`informed`].
    pub fn estimate(&self, bin: usize) -> Estimate {
        Estimate::from_scores(self.scores(bin)).or_no_error(self.informed(bin))
    }

    /// Whether anything is known about the error of one bin, see [`informed`].
    pub fn informed(&self, bin: usize) -> bool {
        informed(self.existed[bin], self.peak[bin])
    }
}

impl EveryBatch for Replicates {
    fn bins(&self) -> usize {
        self.bins as usize
    }

    fn batches(&self) -> u64 {
        Replicates::batches(self)
    }

    fn each(&self, take: &mut dyn FnMut(usize, &Replicates)) -> io::Result<()> {
        take(0, self);
        Ok(())
    }
}
