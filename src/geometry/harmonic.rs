//! Star-shaped objects: |x| = r(x/|x|) around their centre, r a series of spherical harmonics.
//!
//! The surface is exact, and so is its normal n, proportional to r n0 - grad r in the direction n0: nothing is ever made of
//! triangles but what only rules out or in, beforehand, what needs no look at the series.
//!
//! ```text
//! F(t) = |o + t d| - r((o + t d)/|o + t d|):  positive outside, negative inside, 0 on the surface
//! F'   = c - (grad r, d)/|x|,                                  c = (x,d)/|x|
//! F''  = (1 - c^2)/|x| - (w'Hw - 2 c (g,w) - (1 - c^2)(g,n))/|x|^2,  w = d - c n,  n = x/|x|
//! -(M2/2 + sqrt(M2^2/4 + M1^2))/R^2 <= F'' <= the same positive + 1/R,      where |x| >= R
//! |F'''| <= (M3 + 2.31 M2 + 2 M1)/R^3 + 1.16/R^2
//! ```
//!
//! with M1, M2, M3 the bounds of the derivatives of r along great circles: along a line the angle a has a' = s/|x|,
//! a'' = -2 s c/|x|^2 (so s^2 M2 + 2 s c M1 bounds what r adds to F''), a''' = -2 (s^3 - 3 s c^2)/|x|^3, s^2 = 1 - c^2, and
//! s^2 c <= 0.385. So where the parabola or the cubic that starts with these derivatives and falls below F by its bound stays
//! positive there is no surface: steps to its zero pass none, and near a crossing they converge on it faster than Newton's.
//! From inside -F is taken.

pub(in crate::geometry) mod beside;
mod between;
mod bounds;
mod cage;
pub mod file;
mod hull;
mod landing;
mod lattice;
mod outline;
mod placed;
mod projection;
mod regions;
mod rise;
mod roots;
mod samples;
mod series;
mod shells;
mod steps;

pub use bounds::Bounds;
pub(in crate::geometry) use outline::Prospect;
pub use placed::Harmonic;
pub use projection::{basis, projection};
pub use series::{Bend, MAX_DEGREE, Series, Slope};

use crate::error::{Error, Result};
use crate::math::{DVec3, PI};
use bounds::bends;
use hull::Hull;
use regions::Steepness;
use roots::Wave;
use samples::{Guess, Samples};
use std::sync::Arc;
use steps::{Taylor, safe_step};

/// What the sum of a series and its comparison with |x| round, in units of its largest radius.
const ROUNDING: f64 = 1e-14;
/// Steps after which a line is asked for its exact roots: one that runs along the surface may need thousands.
const MANY_STEPS: usize = 64;
/// Squared distance from the centre, in units of the least radius, below which a line has no angle to speak of, and meets the surface so
/// steeply that steps lead there.
const STEEP: f64 = 1e-8;
/// Guard against a line of that kind whose steps are lost in rounding.
const MOST_STEPS: usize = 1 << 16;

/// A series as a surface, in its own coordinates.
#[derive(Clone, Debug)]
pub struct Star {
    series: Series,
    bounds: Bounds,
    samples: Arc<Samples>,
    /// What all of the surface lies within, where that is known.
    hull: Option<Arc<Hull>>,
}

/// Where a line crosses a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// How far along the line, in units of its direction.
    pub distance: f64,
    /// The point, on the surface.
    pub position: DVec3,
    /// Outward unit normal.
    pub normal: DVec3,
}

/// F along a line, times `side`, by the samples, from a place on where it is not negative.
struct Fall<'a> {
    from: f64,
    side: f64,
    along: Taylor,
    errors: Taylor,
    around: &'a Steepness,
}

/// What a march along a line comes to, where that is not its end.
enum Met<R> {
    /// A place from which on what is certain was enough.
    Settled(R),
    /// A crossing, to rounding.
    Reached(f64, Height),
    /// One of which only the distance is known.
    Root(f64),
}

/// F and its derivatives along a line, and where.
struct Height {
    along: Taylor,
    slope: Slope,
    direction: DVec3,
}

impl Star {
    /// The surface of `series`.
    ///
    /// # Errors
    /// [`Error::Input`] unless every radius is certainly positive.
    pub fn new(series: Series) -> Result<Star> {
        let samples = Samples::new(&series);
        let bounds = samples.bounds();
        if bounds.low <= 0.0 {
            let allowed = "a radius above 0 in every direction, by the bounds of its derivatives too";
            return Err(Error::input("series", "least radius", bounds.low, allowed));
        }
        Ok(Star { series, bounds, samples: Arc::new(samples), hull: None })
    }

    /// The series.
    pub fn series(&self) -> &Series {
        &self.series
    }

    /// No radius is less than the first, none more than the second.
    pub fn radii(&self) -> (f64, f64) {
        (self.bounds.low, self.bounds.high)
    }

    /// True for points inside.
    pub fn contains(&self, p: DVec3) -> bool {
        let length = p.length();
        length < self.bounds.low || (length < self.bounds.high && length < self.series.value(p / length))
    }

    /// Outward unit normal in the direction of the unit vector `n0`, and the area of the surface for each unit of solid angle there.
    pub fn normal_and_area(&self, n0: DVec3) -> (DVec3, f64) {
        normal_and_area(&self.series.slope(n0), n0)
    }

    /// The first crossing of the line from `o` along the unit vector `d`, at most `limit` away.
    pub fn first_crossing(&self, o: DVec3, d: DVec3, limit: f64) -> Option<Crossing> {
        match self.march(o, d, limit, |fall, _| self.landing(o, d, fall))? {
            // Rounding may put it beyond the ball, whose end is no limit.
            Met::Settled(crossing) => (crossing.distance <= limit).then_some(crossing),
            Met::Reached(distance, height) => {
                let (normal, _) = normal_and_area(&height.slope, height.direction);
                Some(Crossing { distance, position: height.slope.value * height.direction, normal })
            }
            Met::Root(distance) => Some(self.crossing(o, d, distance)),
        }
    }

    /// True where there is one; where it is need not be known.
    pub(super) fn is_crossed(&self, o: DVec3, d: DVec3, limit: f64) -> bool {
        self.march(o, d, limit, |fall, way| (fall.from + way <= limit).then_some(())).is_some()
    }

    /// Goes along a line by steps that pass no crossing, to the first, at most `limit` away. Where F certainly crosses 0 within some way, `settle` is
    /// asked whether that is enough.
    fn march<R>(&self, o: DVec3, d: DVec3, limit: f64, settle: impl Fn(&Fall, f64) -> Option<R>) -> Option<Met<R>> {
        let nearest = -o.dot(d);
        let across2 = (o + nearest * d).length_squared();
        let (low, high) = self.radii();
        let reach2 = high * high - across2;
        if reach2 < 0.0 {
            return None;
        }
        let mut at = (nearest - reach2.sqrt()).max(0.0);
        let end = limit.min(nearest + reach2.sqrt());
        // The line inside the ball that lies within the surface; empty where it misses that.
        let half_core = (low * low - across2).max(0.0).sqrt();
        let core = nearest - half_core..nearest + half_core;
        let floor = ROUNDING * high;
        let least = low.max(across2.sqrt());
        // A step to the end, and beyond the last place that is looked at.
        let enough = |at: f64| (end - at) * (1.0 + ROUNDING) + floor;
        let within = |x: DVec3, at: f64| least.max(x.length() - enough(at));
        // Entering the ball around the surface is being outside; else the first look tells.
        let mut side = if at > 0.0 { 1.0 } else { 0.0 };
        for taken in 0..MOST_STEPS {
            if at > end {
                return None;
            }
            if taken >= MANY_STEPS && across2 > STEEP * low * low {
                let root = Wave::new(&self.series, o, d, side).first(at, end)?;
                return (root <= limit).then_some(Met::Root(root));
            }
            if side <= 0.0 && at > core.start && at < core.end {
                (side, at) = (-1.0, core.end);
                continue;
            }
            let x = o + at * d;
            let Guess { along: guess, errors, upward, around } = self.samples.height(x, d);
            let guessed = if side == 0.0 { guess.value.signum() } else { side };
            let step = |along: &Taylor, side: f64| {
                // What holds around here, and where that is not far enough what holds everywhere.
                let (far, enough) = (self.samples.reach() * x.length(), enough(at));
                let step = safe_step(along, around.of_lines(x.length() - far, side), enough.min(far));
                let ends = step < far || enough <= far;
                if ends { step } else { step.max(safe_step(along, self.derivatives(within(x, at), side), enough)) }
            };
            // From inside the bounds hold outside the core only, beyond which all is known.
            let beyond = |next: f64, side: f64| if side < 0.0 && at < core.start { next.min(core.end) } else { next };
            let is_certain = guessed * guess.value > 2.0 * errors.value;
            side = if is_certain { guessed } else { side };
            let fall = Fall { from: at, side, along: guess.times(side), errors, around };
            if side != 0.0
                && let Some(settled) = self.certain_fall(x, &fall).and_then(|way| settle(&fall, way))
            {
                return Some(Met::Settled(settled));
            }
            if is_certain {
                at = beyond(at + step(&fall.along.less(errors), side), side);
                if side > 0.0 && guess.first > 0.0 && self.is_left(o + at * d, d, upward) {
                    return None;
                }
                continue;
            }
            let here = self.height(x, d);
            if side == 0.0 {
                side = if here.along.value < 0.0 { -1.0 } else { 1.0 };
                if here.along.value.abs() <= floor && here.along.first * side < 0.0 {
                    // Starting on the surface and going through it.
                    side = -side;
                }
            }
            let along = here.along.times(side);
            let next = beyond(at + step(&along, side), side);
            if along.value <= floor && (along.first <= 0.0 || along.value < -floor) || next <= at {
                return Some(Met::Reached(at, here));
            }
            at = next;
        }
        // Lost in rounding, as no line is known to be: better blocked than leaking.
        Some(Met::Root(at.min(end)))
    }

    /// True where the line from `x` along `d` certainly rises above all of the surface, as a plane across `upward` tells.
    fn is_left(&self, x: DVec3, d: DVec3, upward: DVec3) -> bool {
        upward.dot(d) > 0.0 && self.hull.as_ref().is_some_and(|hull| upward.dot(x) > hull.support(upward))
    }

    /// The way within which F, or -F, crosses 0 from a place `x` on a line: where it certainly does, once, without having turned.
    fn certain_fall(&self, x: DVec3, fall: &Fall) -> Option<f64> {
        let Fall { along, errors, around, side, .. } = fall;
        let (length, reach) = (x.length(), self.samples.reach());
        let (value, steep) = (along.value.max(0.0) + errors.value, -along.first - errors.first);
        // Twice as far as the zero of the tangent.
        let way = 2.0 * value / steep;
        if steep <= 0.0 || way > reach * length {
            return None;
        }
        let [_, third] = around.of_lines((1.0 - reach) * length, *side);
        // What bounds the slope is convex: where it is below 0 at the end too, its mean is below -steep/2, and F is below 0 there.
        let bend = along.second + errors.second;
        (way * (bend + 0.5 * third * way) < steep).then_some(way)
    }

    /// The crossing of the line from `o` along `d` that is at the distance `at`.
    fn crossing(&self, o: DVec3, d: DVec3, at: f64) -> Crossing {
        let direction = (o + at * d).normalize();
        let slope = self.series.slope(direction);
        let (normal, _) = normal_and_area(&slope, direction);
        Crossing { distance: at, position: slope.value * direction, normal }
    }

    /// Bounds of the second and third derivatives of F, or of -F where `side` is negative, where |x| is at least `least`: of how far
    /// the second falls, of how far the third goes either way.
    fn derivatives(&self, least: f64, side: f64) -> [f64; 2] {
        let Bounds { first, second, third, .. } = self.bounds;
        Steepness { first, second, third }.of_lines(least, side)
    }

    fn height(&self, x: DVec3, d: DVec3) -> Height {
        height(x, d, &self.series.bend(x.normalize()))
    }

    /// Volume, by a rule that is exact for r^3.
    pub fn volume(&self) -> f64 {
        self.over_the_sphere(|_, n0| {
            let r = self.series.value(n0);
            r * r * r / 3.0
        })
    }

    /// Area of the surface, to the accuracy of a rule for four times the degree.
    pub fn area(&self) -> f64 {
        self.over_the_sphere(|series, n0| normal_and_area(&series.slope(n0), n0).1)
    }

    /// int f dw.
    fn over_the_sphere(&self, f: impl Fn(&Series, DVec3) -> f64) -> f64 {
        let values = |directions: &[DVec3]| Ok(directions.iter().map(|&n0| f(&self.series, n0)).collect::<Vec<f64>>());
        let mean = projection(0, 2 * self.series.degree() + 16, values);
        4.0 * PI * mean.map_or(f64::NAN, |mean| mean.value(DVec3::Z))
    }
}

/// F and its derivatives at `x` along the unit vector `d`, where the series has the derivatives `bend`.
fn height(x: DVec3, d: DVec3, bend: &Bend) -> Height {
    let length = x.length();
    let direction = x / length;
    let slope = bend.slope(direction);
    let c = direction.dot(d);
    let w = d - c * direction;
    let across = 1.0 - c * c;
    let turned = w.dot(bend.hessian * w) - 2.0 * c * bend.g.dot(w) - across * bend.g.dot(direction);
    let along = Taylor {
        value: length - slope.value,
        first: c - slope.gradient.dot(d) / length,
        second: (across - turned / length) / length,
    };
    Height { along, slope, direction }
}

fn normal_and_area(slope: &Slope, n0: DVec3) -> (DVec3, f64) {
    let across = slope.value * n0 - slope.gradient;
    (across.normalize(), slope.value * across.length())
}

#[cfg(test)]
mod tests;
