//! From a place beside a crossing onto it, where a line certainly falls through the surface and once.
//!
//! From a place on the line with value, slope and second derivative of F to the zero of the parabola that they make, s away, F is off by
//! |F'''| s^3/6 at most, and what is left of the way by that over the slope. The samples lead to where that counts less than their own
//! errors. There one sum of the series with its second derivatives is mostly enough: the parabola leads on to rounding, and the radius and
//! the gradient follow from those derivatives at the angle a, sin a <= s/|x|, from there,
//!
//! ```text
//! |r      - (r + (g,w) + w'Hw/2)|  <=  M3 a^3/6                w the way on the sphere, of length a
//! |grad r - P (g + H w)|           <=  M3 a^2/2                P the rotation along it
//! ```
//!
//! where a^3 is nothing where a^2 is little. Where it is not, as at a grazing line, the next sum begins nearer.

use super::bounds::hessian;
use super::samples::{Turn, way};
use super::{Bend, Crossing, Fall, ROUNDING, Slope, Star, height, normal_and_area};
use crate::math::DVec3;

/// Looks at the samples, at most.
const LOOKS: usize = 4;
/// Sums of the series, at most.
const SUMS: usize = 6;
/// What the gradient may be off, in units of the radius.
const NORMAL: f64 = 1e-9;

impl Star {
    /// The crossing of the line from `o` along the unit vector `d` that `fall` comes to.
    pub(super) fn landing(&self, o: DVec3, d: DVec3, fall: &Fall) -> Option<Crossing> {
        let from = (o + fall.from * d).length();
        let [_, third] = fall.around.of_lines((1.0 - self.samples.reach()) * from, fall.side);
        let off = |step: f64| third * step.abs() * step * step / 6.0;
        let mut at = self.guess(o, d, fall, off);
        for _ in 0..SUMS {
            let x = o + at * d;
            let bend = self.series.bend(x.normalize());
            let here = height(x, d, &bend);
            let along = here.along.times(fall.side);
            if along.first.is_nan() || along.first >= 0.0 {
                return None;
            }
            let step = along.root();
            at += step;
            let length = x.length();
            let angle = step / length;
            let of_gradient = 0.5 * fall.around.third * angle * angle;
            if off(step) <= ROUNDING * self.bounds.high && of_gradient <= NORMAL * length {
                return Some(crossing_beside(here.direction, &bend, o + at * d, at));
            }
        }
        None
    }

    /// How far along the line it is by the samples; a step ends so far `off`.
    fn guess(&self, o: DVec3, d: DVec3, fall: &Fall, off: impl Fn(f64) -> f64) -> f64 {
        let (mut at, mut along) = (fall.from, fall.along);
        for _ in 1..LOOKS {
            let step = along.root();
            if off(step) <= fall.errors.value {
                break;
            }
            at += step;
            along = self.samples.height(o + at * d, d).along.times(fall.side);
        }
        at + along.root()
    }
}

/// The crossing `at` so far along its line, at `x` near the direction `n` where the series has the derivatives `bend`.
fn crossing_beside(n: DVec3, bend: &Bend, x: DVec3, at: f64) -> Crossing {
    let there = x.normalize();
    let (w, _) = way(n, there);
    let (slope, bent) = (bend.slope(n), hessian(bend, n) * w);
    let value = slope.value + w.dot(slope.gradient + 0.5 * bent);
    let gradient = Turn::new(n, there).on(slope.gradient + bent);
    let (normal, _) = normal_and_area(&Slope { value, gradient }, there);
    Crossing { distance: at, position: value * there, normal }
}
