//! What a series and its derivatives along great circles certainly do not exceed.
//!
//! The coefficients alone bound the j-th derivative by sum k^j |c_k|: each degree is a trigonometric polynomial along a great circle
//! (Bernstein), and no more than |c_k| itself (addition theorem). That is never too little and mostly far too much.
//!
//! Samples say more. Along a great circle the components of the gradient and of the second derivatives, in a frame that goes with it, are
//! trigonometric polynomials of degree N too. One that has its greatest magnitude M at 0 is at least M cos(N a) at the angle a <= pi/N
//! (M. Riesz). So a sample at most h from the place of the maximum is at least M cos(N h), and no more than samples/cos(N h) is
//! anywhere. The third derivative is at most N times the second (Bernstein).

use super::regions::Shape;
use super::series::{Bend, Series};
use crate::math::{DMat3, DVec3, cos, frame};

/// What sums may round.
const ROUNDING: f64 = 1e-12;

/// What r and its derivatives along any great circle, by the angle, do not exceed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// r is nowhere less.
    pub low: f64,
    /// r is nowhere more.
    pub high: f64,
    /// Magnitude of the gradient.
    pub first: f64,
    /// Magnitude of the second derivative.
    pub second: f64,
    /// Magnitude of the third derivative.
    pub third: f64,
}

impl Bounds {
    /// By the coefficients alone.
    pub fn of_coefficients(series: &Series) -> Bounds {
        let norms = series.norms();
        let sum = |of: fn(f64) -> f64| norms.iter().enumerate().skip(1).map(|(k, c)| of(k as f64) * c).sum::<f64>();
        let (middle, around) = (series.mean(), sum(|_| 1.0));
        Bounds {
            low: middle - around,
            high: middle + around,
            first: sum(|k| (0.5 * k * (k + 1.0)).sqrt()),
            second: sum(|k| k * k),
            third: sum(|k| k * k * k),
        }
    }
}

/// The bounds of `series` by its coefficients and by samples, directions at most `h` apart from any other, whichever say less.
pub(super) fn sup(series: &Series, samples: &[Shape], h: f64) -> Bounds {
    let rough = Bounds::of_coefficients(series);
    let degree = series.degree() as f64;
    let share = cos((degree * h).min(2.0));
    if share <= 0.0 {
        return rough;
    }
    let (mut low, mut high, mut first, mut second) = (f64::INFINITY, f64::NEG_INFINITY, 0f64, 0f64);
    for shape in samples {
        (low, high) = (low.min(shape.value), high.max(shape.value));
        (first, second) = (first.max(shape.first), second.max(shape.second));
    }
    let whole = |sampled: f64, rough: f64| (sampled / share * (1.0 + ROUNDING)).min(rough);
    let second = whole(second, rough.second);
    // h^2/2 of the second derivative at the angle h from a place where the first vanishes.
    let slack = 0.5 * h * h * second;
    Bounds {
        low: rough.low.max(low - slack),
        high: rough.high.min(high + slack),
        first: whole(first, rough.first),
        second,
        third: rough.third.min(degree * second),
    }
}

/// The covariant second derivatives on the sphere in the direction `n`: a matrix that knows nothing of `n` itself.
pub(super) fn hessian(bend: &Bend, n: DVec3) -> DMat3 {
    let outer = DMat3::from_cols(n * n.x, n * n.y, n * n.z);
    let across = DMat3::IDENTITY - outer;
    across * bend.hessian * across - bend.g.dot(n) * across
}

/// The greatest and the least second derivative along a great circle through `n`: the eigenvalues of a matrix of two rows.
pub(super) fn bends(bend: &Bend, n: DVec3) -> (f64, f64) {
    let (e, f) = frame(n);
    let lift = bend.g.dot(n);
    let along = |a: DVec3, b: DVec3| a.dot(bend.hessian * b);
    let (p, q, r) = (along(e, e) - lift, along(f, f) - lift, along(e, f));
    let (middle, half) = (0.5 * (p + q), 0.5 * (p - q));
    let apart = (half * half + r * r).sqrt();
    (middle + apart, middle - apart)
}
