//! An estimate beside its reference, and the verdict on it.
//!
//! A comparison holds when |mean - reference| <= t se + tolerance |reference| *and* se <= 0.5 % of the reference: a
//! huge error bar must not pass. t is the Student quantile at which a right program fails anywhere in the whole family
//! of comparisons with probability 1e-6 (Bonferroni: comparisons of one scene share their histories).

use crate::tally::statistics::{Estimate, student_quantile};

/// Probability that a right program fails, over all comparisons judged together.
const FAMILY_WISE: f64 = 1e-6;
/// Largest standard error of a passing estimate, relative to the reference.
const WORST_ERROR: f64 = 0.005;
/// What f32 coordinates may cost, relative to the reference.
const ROUNDING: f64 = 2e-6;
/// Confidence of the intervals shown.
const CONFIDENCE: f64 = 0.95;

/// One estimate beside the value it must have.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Which quantity, where.
    pub name: String,
    /// Unit of estimate and reference.
    pub unit: &'static str,
    /// What the program found.
    pub estimate: Estimate,
    /// What it must find.
    pub reference: f64,
    /// Accuracy of the reference and of coordinates, relative.
    pub tolerance: f64,
}

impl Comparison {
    /// `estimate` against a `reference` that is exact.
    pub fn new(name: impl ToString, unit: &'static str, estimate: Estimate, reference: f64) -> Self {
        Comparison { name: name.to_string(), unit, estimate, reference, tolerance: ROUNDING }
    }

    /// The same with a reference that is known to the relative accuracy `tolerance` only.
    pub fn within(self, tolerance: f64) -> Self {
        Comparison { tolerance, ..self }
    }

    /// Distance from the reference in standard errors; `None` for values that are the same in every batch.
    pub fn z(&self) -> Option<f64> {
        let Estimate { mean, standard_error, .. } = self.estimate;
        (standard_error != 0.0).then(|| (mean - self.reference) / standard_error)
    }

    /// The interval at 95 %.
    pub fn interval(&self) -> (f64, f64) {
        self.estimate.interval(student_quantile(CONFIDENCE, self.estimate.n))
    }

    /// True when the interval at 95 % holds the reference.
    pub fn covers(&self) -> bool {
        let (low, high) = self.interval();
        let slack = self.tolerance * self.reference.abs();
        low - slack <= self.reference && self.reference <= high + slack
    }

    /// What is wrong with it as one of `comparisons`: too far off, or its error bar too wide.
    pub fn failure(&self, comparisons: usize) -> Option<String> {
        let Estimate { n, mean, standard_error } = self.estimate;
        let quantile = student_quantile(1.0 - FAMILY_WISE / comparisons as f64, n);
        let size = self.reference.abs();
        let near = (mean - self.reference).abs() <= quantile * standard_error + self.tolerance * size;
        let narrow = standard_error <= WORST_ERROR * size;
        (!(near && narrow)).then(|| {
            let share = 100.0 * standard_error / size;
            let z = (mean - self.reference) / standard_error;
            let Comparison { name, reference, .. } = self;
            format!("{name}: {mean} against {reference}: z = {z:.2} (limit {quantile:.2}), error {share:.3} %")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(mean: f64, standard_error: f64) -> Comparison {
        Comparison::new("E", "lx", Estimate { n: 32, mean, standard_error }, 100.0)
    }

    #[test]
    fn near_and_narrow_holds() {
        assert_eq!(of(101.0, 0.3).failure(100), None);
        assert_eq!(of(100.0001, 0.0).failure(100), None);
    }

    #[test]
    fn far_or_wide_or_nan_fails() {
        assert!(of(103.0, 0.3).failure(100).is_some());
        assert!(of(100.0, 0.6).failure(100).is_some());
        assert!(of(100.01, 0.0).failure(100).is_some());
        assert!(of(f64::NAN, 0.3).failure(100).is_some());
        assert!(of(100.0, f64::NAN).failure(100).is_some());
    }

    #[test]
    fn the_limit_grows_with_the_family_and_the_tolerance() {
        // Student quantiles with 31 degrees of freedom: 6.1 for one comparison at 1e-6, 7.2 for 100.
        assert!(of(100.0 + 6.5 * 0.3, 0.3).failure(1).is_some());
        assert_eq!(of(100.0 + 6.5 * 0.3, 0.3).failure(100), None);
        assert_eq!(of(100.01, 0.0).within(2e-4).failure(1), None);
    }

    #[test]
    fn the_interval_covers_what_it_should() {
        assert!(of(100.5, 0.3).covers() && !of(100.7, 0.3).covers());
        assert_eq!(of(100.0, 0.0).z(), None);
    }
}
