//! From batch scores to estimates, intervals and figures of merit (docs/method.md, "Statistics").

use super::student::tail_quantile;

/// The number with its error: mean of batch scores and standard error of that mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Number of batches.
    pub n: u64,
    /// Mean of the batch scores; NaN for n = 0.
    pub mean: f64,
    /// Standard error of the mean, sqrt(M2 / (n (n-1))); NaN below n = 2 and without information.
    pub standard_error: f64,
}

impl Estimate {
    /// From `n`, the mean and the central sum of squares M2.
    pub fn from_moments(n: u64, mean: f64, m2: f64) -> Self {
        let (mean, standard_error) = match n {
            0 => (f64::NAN, f64::NAN),
            1 => (mean, f64::NAN),
            _ => (mean, (m2 / (n as f64 * (n - 1) as f64)).sqrt()),
        };
        Estimate { n, mean, standard_error }
    }

    /// From every batch's score, in batch order.
    pub fn from_scores(scores: impl Iterator<Item = f64>) -> Self {
        let (mut n, mut mean, mut m2) = (0u64, 0.0, 0.0);
        for score in scores {
            n += 1;
            let d = score - mean;
            mean += d / n as f64;
            m2 += d * (score - mean);
        }
        Estimate::from_moments(n, mean, m2)
    }

    /// The same estimate with the constant `offset` added: a part known without error.
    pub fn shifted(self, offset: f64) -> Self {
        Estimate { mean: self.mean + offset, ..self }
    }

    /// The estimate of bin `bin` of which this is the random part: `fixed` is the part without error, one entry a bin,
    /// NaN where there is no receiver, or empty for zero everywhere. None without a receiver.
    pub fn with_fixed(self, fixed: &[f64], bin: usize) -> Option<Self> {
        let offset = fixed.get(bin).copied().unwrap_or(0.0);
        (!offset.is_nan()).then(|| self.shifted(offset))
    }

    /// The same estimate with the error NaN unless `informed`.
    pub fn or_no_error(self, informed: bool) -> Self {
        if informed { self } else { Estimate { standard_error: f64::NAN, ..self } }
    }

    /// Standard error over the size of the mean.
    pub fn relative_error(self) -> f64 {
        self.standard_error / self.mean.abs()
    }

    /// The interval `mean -+ quantile x standard error`, not clamped at 0.
    pub fn interval(self, quantile: f64) -> (f64, f64) {
        let half = quantile * self.standard_error;
        (self.mean - half, self.mean + half)
    }
}

/// Two-sided Student quantile t for `n` batches: |T| <= t with probability `confidence`, n - 1 degrees of freedom.
/// NaN below n = 2.
pub fn student_quantile(confidence: f64, n: u64) -> f64 {
    tail_quantile(0.5 * (1.0 - confidence), n)
}

/// Variance of the variance of batch scores, M4/M2^2 - 1/n, equation (11.2); NaN where M2 = 0.
pub fn variance_of_variance(scores: impl Iterator<Item = f64> + Clone) -> f64 {
    let Estimate { n, mean, .. } = Estimate::from_scores(scores.clone());
    let (m2, m4) = scores.fold((0.0, 0.0), |(m2, m4), x| {
        let d2 = (x - mean) * (x - mean);
        (m2 + d2, m4 + d2 * d2)
    });
    if m2 == 0.0 { f64::NAN } else { m4 / (m2 * m2) - 1.0 / n as f64 }
}

/// Figure of merit 1/(R^2 T) \[1/s\] of a relative error R reached in T seconds.
pub fn figure_of_merit(relative_error: f64, seconds: f64) -> f64 {
    1.0 / (relative_error * relative_error * seconds)
}

/// Numbers up to which [`select`] keeps them all.
const FEW: u64 = 1 << 16;
/// Bits of a number that [`select`] decides at a time.
const DIGIT: u32 = 16;

/// The number with `rank`, from 0, in ascending order among the `count` numbers that `pass` gives, the same ones every time.
/// Memory does not grow with them: of many, each pass decides sixteen bits.
///
/// # Errors
/// Those of `pass`.
pub fn select<E>(rank: u64, count: u64, mut pass: impl FnMut(&mut dyn FnMut(f64)) -> Result<(), E>) -> Result<f64, E> {
    assert!(rank < count, "rank {rank} of {count} numbers");
    if count <= FEW {
        let mut all = Vec::with_capacity(count as usize);
        pass(&mut |x| all.push(x))?;
        return Ok(*all.select_nth_unstable_by(rank as usize, f64::total_cmp).1);
    }
    let (mut rank, mut known) = (rank, 0u64);
    for shift in (0..u64::BITS).step_by(DIGIT as usize).rev() {
        let mut counts = vec![0u64; 1 << DIGIT];
        pass(&mut |x| {
            let key = key(x);
            if key.checked_shr(shift + DIGIT).unwrap_or(0) == known {
                counts[(key >> shift) as usize & ((1 << DIGIT) - 1)] += 1;
            }
        })?;
        let mut digit = 0;
        while rank >= counts[digit] {
            rank -= counts[digit];
            digit += 1;
        }
        known = known << DIGIT | digit as u64;
    }
    Ok(f64::from_bits(if known >> 63 == 1 { known & !(1 << 63) } else { !known }))
}

/// An integer in the order of `f64::total_cmp`.
fn key(x: f64) -> u64 {
    let bits = x.to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

/// Median of the finite values; NaN without any.
pub fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut finite: Vec<f64> = values.filter(|x| x.is_finite()).collect();
    if finite.is_empty() {
        return f64::NAN;
    }
    let middle = finite.len() / 2;
    *finite.select_nth_unstable_by(middle, f64::total_cmp).1
}
