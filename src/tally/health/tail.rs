//! How fast the density of single history totals falls off: the slope of its tail.
//!
//! The largest totals, less the smallest of them, are fitted by maximum likelihood with the generalised Pareto density
//!
//! ```text
//! f(x) = (1/a) (1 + k x/a)^(-1/k - 1),        slope = 1/k + 1                                            (11.4)
//! ```
//!
//! A density that falls as x^-s has the slope s: the variance is finite for s > 3, the mean for s > 2. With
//! t = k/a the best k for given t is the mean of ln(1 + t x), so one number remains to be searched for.

use crate::math::{exp, log, log1p};
use crate::tally::statistics::median;

/// Slopes above this one are not told apart: exponential and bounded tails have this slope.
pub const STEEPEST: f64 = 10.0;
/// Fewer excesses than this are not fitted.
const FEWEST: usize = 25;

/// Where ln(t x median) is searched, and how finely at first: k between 1/9 and 17 at the median.
const SEARCH: (f64, f64, u32) = (-6.0, 12.0, 72);
/// Steps of the search by golden section: 0.62^30 of a step is left.
const REFINEMENTS: u32 = 30;

/// Slope of the tail of which `largest` are the largest totals, at most [`STEEPEST`]; None when too few are known.
pub fn tail_slope(largest: &[f64]) -> Option<f64> {
    let threshold = largest.iter().copied().fold(f64::INFINITY, f64::min);
    // What equals the threshold says nothing about the shape, and an excess of zero has no finite likelihood.
    let excesses: Vec<f64> = largest.iter().map(|x| x - threshold).filter(|&x| x > 0.0).collect();
    if largest.len() < FEWEST || largest.iter().any(|x| !x.is_finite()) {
        return None;
    }
    if excesses.len() < FEWEST {
        // A few values that come again and again: the largest of them is a bound.
        return Some(STEEPEST);
    }
    let scale = median(excesses.iter().copied());
    let excesses: Vec<f64> = excesses.iter().map(|x| x / scale).collect();
    let k = best_shape(&excesses);
    Some(if k * (STEEPEST - 1.0) > 1.0 { 1.0 / k + 1.0 } else { STEEPEST })
}

/// Maximum likelihood estimate of k, of excesses whose median is 1.
fn best_shape(excesses: &[f64]) -> f64 {
    let cost = |u: f64| {
        let t = exp(u);
        let k = shape(excesses, t);
        // Minus the logarithm of the likelihood per excess, less 1: ln a + k with a = k/t.
        log(k / t) + k
    };
    let (first, last, steps) = SEARCH;
    let step = (last - first) / f64::from(steps);
    let scanned = (0..=steps).map(|i| first + f64::from(i) * step);
    let best = scanned.min_by(|a, b| cost(*a).total_cmp(&cost(*b))).expect("the scan is not empty");
    shape(excesses, exp(golden_section(cost, best - step, best + step)))
}

/// The best k for a given t: the mean of ln(1 + t x).
fn shape(excesses: &[f64], t: f64) -> f64 {
    excesses.iter().map(|x| log1p(t * x)).sum::<f64>() / excesses.len() as f64
}

/// Where `cost`, with one minimum between `low` and `high`, is least.
fn golden_section(cost: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    for _ in 0..REFINEMENTS {
        let width = golden * (high - low);
        let (left, right) = (high - width, low + width);
        if cost(left) < cost(right) {
            high = right;
        } else {
            low = left;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::pow;
    use crate::random::{Domain, Stream};

    /// The 200 largest of 10^4 draws, for each of 50 samples, and the slope of each sample.
    fn slopes(draw: impl Fn(f64) -> f64) -> Vec<f64> {
        let stream = Stream::new(11, Domain::Receiver, "tail");
        let sample = |i| {
            let mut g = stream.generator(i);
            let mut x: Vec<f64> = (0..10_000).map(|_| draw(1.0 - g.uniform())).collect();
            x.sort_by(|a, b| b.total_cmp(a));
            tail_slope(&x[..200]).unwrap()
        };
        (0..50).map(sample).collect()
    }

    fn mean(x: &[f64]) -> f64 {
        x.iter().sum::<f64>() / x.len() as f64
    }

    #[test]
    fn power_laws_have_their_own_slope() {
        // Survival t^(-3/2), an edge pixel: density t^(-5/2). One fit scatters by (1 + k)/(k^2 sqrt(200)) = 0.27.
        let edge = slopes(|u| pow(u, -2.0 / 3.0));
        assert!((mean(&edge) - 2.5).abs() < 0.15, "{}", mean(&edge));
        assert!(edge.iter().filter(|&&s| s < 3.0).count() >= 45, "{edge:?}");
        // Survival t^-1, no mean at all.
        let wilder = slopes(|u| 1.0 / u);
        assert!((mean(&wilder) - 2.0).abs() < 0.1, "{}", mean(&wilder));
    }

    #[test]
    fn tails_with_all_moments_are_steep() {
        let exponential = slopes(|u| -log(u));
        assert!(exponential.iter().all(|&s| s > 4.0), "{exponential:?}");
        assert!(mean(&exponential) > 9.0, "{}", mean(&exponential));
        assert_eq!(slopes(|u| u), [STEEPEST; 50], "a bounded density");
    }

    #[test]
    fn the_unit_does_not_matter() {
        let x: Vec<f64> = (0..200).map(|i| pow((f64::from(i) + 0.5) / 200.0, -0.5)).collect();
        let slope = tail_slope(&x).unwrap();
        for unit in [1e-12, 1e12] {
            let scaled: Vec<f64> = x.iter().map(|v| v * unit).collect();
            assert!((tail_slope(&scaled).unwrap() - slope).abs() < 1e-6);
        }
        assert!((slope - 3.0).abs() < 0.2, "{slope}");
    }

    #[test]
    fn too_few_or_no_numbers_give_no_slope() {
        assert_eq!(tail_slope(&[]), None);
        assert_eq!(tail_slope(&[1.0; 24]), None);
        assert_eq!(tail_slope(&[1.0; 200]), Some(STEEPEST), "one value only is a bound");
        let mut x = vec![1.0; 100];
        x[3] = f64::INFINITY;
        assert_eq!(tail_slope(&x), None);
    }
}
