//! Number, mean and central sum of squares of batch scores for each bin of a map.
//!
//! Central sums lose no digits where raw sums of squares would (a mean 10^4 times the standard deviation costs raw
//! sums half their digits), and merge exactly as written in docs/method.md, equation (11.1).

use super::statistics::Estimate;
use super::{Scores, informed};
use serde::{Deserialize, Serialize};

/// Columns of a run of bins: the unit in which maps are stored and merged.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MomentBlock {
    /// Mean of the batch scores.
    pub mean: Vec<f64>,
    /// Sum of the squared deviations of the batch scores from their mean.
    pub m2: Vec<f64>,
    /// Mean of the sampled direct part.
    pub direct: Vec<f64>,
    /// Largest total of a single history.
    pub peak: Vec<f64>,
    /// Largest caustic light of a batch, see [`Scores::caustic`].
    pub caustic: Vec<f64>,
    /// Batches in which the receiver of the bin existed.
    pub existed: Vec<u64>,
    /// Means of R, G, B; empty where no colour is kept.
    pub colour: Vec<[f64; 3]>,
}

/// The moments of a whole map.
#[derive(Clone, Debug, PartialEq)]
pub struct Moments {
    /// Number of batches, the same for every bin.
    pub n: u64,
    /// All bins.
    pub bins: MomentBlock,
}

impl MomentBlock {
    /// Zero moments of `bins` bins.
    pub fn new(bins: usize, colour: bool) -> Self {
        MomentBlock {
            mean: vec![0.0; bins],
            m2: vec![0.0; bins],
            direct: vec![0.0; bins],
            peak: vec![0.0; bins],
            caustic: vec![0.0; bins],
            existed: vec![0; bins],
            colour: vec![[0.0; 3]; if colour { bins } else { 0 }],
        }
    }

    /// Number of bins.
    pub fn len(&self) -> usize {
        self.mean.len()
    }

    /// True without bins.
    pub fn is_empty(&self) -> bool {
        self.mean.is_empty()
    }

    /// True when all columns have `bins` entries, as those of a block read from a file must.
    pub fn has_shape(&self, bins: usize, colour: bool) -> bool {
        let f64s = [&self.mean, &self.m2, &self.direct, &self.peak, &self.caustic];
        f64s.iter().all(|c| c.len() == bins)
            && self.existed.len() == bins
            && self.colour.len() == if colour { bins } else { 0 }
    }

    /// A copy of the bins `range`.
    pub fn slice(&self, range: std::ops::Range<usize>) -> Self {
        let colour = if self.colour.is_empty() { Vec::new() } else { self.colour[range.clone()].to_vec() };
        MomentBlock {
            mean: self.mean[range.clone()].to_vec(),
            m2: self.m2[range.clone()].to_vec(),
            direct: self.direct[range.clone()].to_vec(),
            peak: self.peak[range.clone()].to_vec(),
            caustic: self.caustic[range.clone()].to_vec(),
            existed: self.existed[range].to_vec(),
            colour,
        }
    }

    /// Appends the bins of `other`.
    pub fn append(&mut self, mut other: MomentBlock) {
        self.mean.append(&mut other.mean);
        self.m2.append(&mut other.m2);
        self.direct.append(&mut other.direct);
        self.peak.append(&mut other.peak);
        self.caustic.append(&mut other.caustic);
        self.existed.append(&mut other.existed);
        self.colour.append(&mut other.colour);
    }

    /// Merges `other`, of `n_b` batches, into these moments of `n_a` batches; equation (11.1).
    pub fn merge(&mut self, n_a: u64, other: &MomentBlock, n_b: u64) {
        assert!(self.len() == other.len() && self.colour.len() == other.colour.len(), "blocks of another shape");
        if n_b == 0 {
            return;
        }
        let (a, b) = (n_a as f64, n_b as f64);
        let n = a + b;
        let mean = |x: f64, y: f64| x + (y - x) * b / n;
        // Column by column, so that the compiler takes several bins at a time.
        for ((m2, &more), (x, y)) in self.m2.iter_mut().zip(&other.m2).zip(self.mean.iter().zip(&other.mean)) {
            let d = y - x;
            *m2 = *m2 + more + d * d * a * b / n;
        }
        self.mean.iter_mut().zip(&other.mean).for_each(|(x, &y)| *x = mean(*x, y));
        self.direct.iter_mut().zip(&other.direct).for_each(|(x, &y)| *x = mean(*x, y));
        self.peak.iter_mut().zip(&other.peak).for_each(|(x, &y)| *x = x.max(y));
        self.caustic.iter_mut().zip(&other.caustic).for_each(|(x, &y)| *x = x.max(y));
        // Saturating: a count from a file is not ours to trust.
        self.existed.iter_mut().zip(&other.existed).for_each(|(x, &y)| *x = x.saturating_add(y));
        for (x, y) in self.colour.iter_mut().zip(&other.colour) {
            *x = std::array::from_fn(|c| mean(x[c], y[c]));
        }
    }

    /// The estimate of bin `i` over `n` batches; its error is NaN without information, see [`informed`].
    pub fn estimate(&self, i: usize, n: u64) -> Estimate {
        Estimate::from_moments(n, self.mean[i], self.m2[i]).or_no_error(informed(self.existed[i], self.peak[i]))
    }
}

impl Moments {
    /// No batches yet of `bins` bins.
    pub fn new(bins: usize, colour: bool) -> Self {
        Moments { n: 0, bins: MomentBlock::new(bins, colour) }
    }

    /// Takes in the scores of one batch.
    pub fn accumulate(&mut self, scores: &Scores) {
        assert_eq!(self.bins.len(), scores.value.len(), "scores of another shape");
        self.n += 1;
        let n = self.n as f64;
        let b = &mut self.bins;
        for (i, &score) in scores.value.iter().enumerate() {
            let d = score - b.mean[i];
            b.mean[i] += d / n;
            b.m2[i] += d * (score - b.mean[i]);
            b.direct[i] += (scores.direct[i] - b.direct[i]) / n;
            b.peak[i] = b.peak[i].max(scores.peak[i]);
            b.caustic[i] = b.caustic[i].max(scores.caustic[i]);
            b.existed[i] += u64::from(scores.existed[i]);
        }
        for (mean, score) in b.colour.iter_mut().zip(&scores.colour) {
            *mean = std::array::from_fn(|c| mean[c] + (score[c] - mean[c]) / n);
        }
    }
}
