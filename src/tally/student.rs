//! Student's quantile, also far out in a tail: what intervals need that are to hold for many bins at once.
//!
//! The inverse in `statrs` is made for tails of everyday size: it is told 1 - tail, which forgets small tails, stops at
//! an absolute accuracy, and does not return for very many degrees of freedom. Here the tail probability itself, which
//! is exact, is inverted by bisection, and from [`MANY`] degrees of freedom on t is expanded about the normal quantile z
//! (Cornish and Fisher; Abramowitz and Stegun 26.7.5), with f degrees of freedom
//!
//! ```text
//! t = z + (z^3 + z)/(4 f) + (5 z^5 + 16 z^3 + 3 z)/(96 f^2) + (3 z^7 + 19 z^5 + 17 z^3 - 15 z)/(384 f^3)
//! ```

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// Degrees of freedom from which on the expansion is exact to eleven digits, for tails down to 1e-28.
const MANY: f64 = 1e4;

/// The quantile of Student's t with n - 1 degrees of freedom that is exceeded with probability `tail`, above 0 and at
/// most 1/2; infinite for `tail` = 0, NaN below n = 2. Rounded to ten significant digits: the last bits of the C
/// library's logarithms differ between machines.
pub(super) fn tail_quantile(tail: f64, n: u64) -> f64 {
    if n < 2 || tail.is_nan() {
        return f64::NAN;
    }
    if tail <= 0.0 {
        return f64::INFINITY;
    }
    let freedom = (n - 1) as f64;
    let quantile = if freedom < MANY { bisected(tail, freedom) } else { expanded(tail, freedom) };
    format!("{quantile:.9e}").parse().expect("a printed number reads back")
}

fn bisected(tail: f64, freedom: f64) -> f64 {
    let student = StudentsT::new(0.0, 1.0, freedom).expect("scale and freedom are positive");
    let beyond = |t: f64| student.sf(t) <= tail;
    let mut high = 1.0;
    while high < f64::MAX.sqrt() && !beyond(high) {
        high *= 2.0;
    }
    let mut low = if high == 1.0 { 0.0 } else { 0.5 * high };
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return high;
        }
        *if beyond(middle) { &mut high } else { &mut low } = middle;
    }
}

fn expanded(tail: f64, freedom: f64) -> f64 {
    let normal = Normal::new(0.0, 1.0).expect("a standard deviation of 1 is one");
    let z = -normal.inverse_cdf(tail);
    let (f, s) = (freedom, z * z);
    let first = (s + 1.0) / 4.0;
    let second = ((5.0 * s + 16.0) * s + 3.0) / 96.0;
    let third = (((3.0 * s + 19.0) * s + 17.0) * s - 15.0) / 384.0;
    z * (1.0 + (first + (second + third / f) / f) / f)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{PI, tan};

    fn close(a: f64, b: f64) -> bool {
        (a / b - 1.0).abs() < 2e-9
    }

    #[test]
    fn one_and_two_degrees_of_freedom_have_closed_forms() {
        for tail in [0.4, 0.025, 1e-4, 2.5e-8, 1e-14, 1e-28] {
            assert!(close(tail_quantile(tail, 2), 1.0 / tan(PI * tail)), "{tail}: {}", tail_quantile(tail, 2));
            let two = (1.0 - 2.0 * tail) * (0.5 / (tail * (1.0 - tail))).sqrt();
            assert!(close(tail_quantile(tail, 3), two), "{tail}: {}", tail_quantile(tail, 3));
        }
    }

    #[test]
    fn everyday_tails_agree_with_the_inverse_of_statrs() {
        for n in [2, 5, 16, 32, 256, 5000] {
            let student = StudentsT::new(0.0, 1.0, (n - 1) as f64).unwrap();
            for tail in [0.25, 0.025, 0.005] {
                let (quantile, theirs) = (tail_quantile(tail, n), student.inverse_cdf(1.0 - tail));
                assert!(close(quantile, theirs), "{n} {tail}: {quantile} {theirs}");
            }
        }
    }

    #[test]
    fn the_largest_confidence_below_one_has_a_finite_quantile() {
        // 1 - confidence = 2^-53: with two degrees of freedom t = sqrt(2^53), all but 1 in 2^53.
        let (confidence, t) = (0.9999999999999999, f64::from(1 << 26) * 2f64.sqrt());
        assert!(close(crate::tally::statistics::student_quantile(confidence, 3), t));
    }

    #[test]
    fn the_expansion_meets_the_bisection() {
        for tail in [0.025, 1e-4, 2.5e-8, 1e-14, 1e-28] {
            let (a, b) = (bisected(tail, MANY), expanded(tail, MANY));
            assert!((a / b - 1.0).abs() < 1e-10, "{tail}: {a} {b}");
        }
    }

    #[test]
    fn extremes_return() {
        assert!(tail_quantile(0.025, 1).is_nan() && tail_quantile(f64::NAN, 9).is_nan());
        assert_eq!(tail_quantile(0.0, 9), f64::INFINITY);
        assert!((tail_quantile(0.025, 1 << 40) - 1.959963985).abs() < 1e-9);
        assert!(tail_quantile(1e-300, 2) > 1e100, "no end of the doubling");
    }
}
