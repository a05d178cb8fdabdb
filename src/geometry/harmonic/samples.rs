//! A series at the points of a lattice, with its derivatives, and what that says of all places between: with certainty, and thirty times
//! faster than the sum of the series.
//!
//! Let v be a point of the lattice, w = n - (n,v) v the way from it to a direction n, a the angle between them, and P the rotation
//! that takes v to n. With a bound M3 of all third derivatives around v (`regions`), in a frame that goes with it along the great circle,
//!
//! ```text
//! |r(n)      - (r + a (g,w/|w|) + a^2 w'Hw/(2 |w|^2))|  <=  M3 a^3/6
//! |grad r(n) - P (g + a H w/|w|)|                       <=  M3 a^2/2
//! |H(n)      - P H P'|                                  <=  M3 a          with r, g, H of v
//! ```

use super::Bounds;
use super::bounds::sup;
use super::lattice::Lattice;
use super::regions::{Regions, Shape, Steepness, carried};
use super::series::{Bend, Series};
use super::steps::Taylor;
use crate::math::{DMat3, DVec3};
use rayon::prelude::*;

/// Cells along an edge of the cube come in so many.
const CELLS: usize = 48;
/// Degrees for which these are enough: N a = 0.19 at most.
const DEGREES: usize = 8;
/// Times that, at most.
const MOST: usize = 4;
/// Rounds of points whose derivatives are found together.
const TOGETHER: usize = 1024;
/// What f32 rounds, and the expansion of an angle, of the largest values and slopes.
const HALF_ULP: f64 = 6.2e-8;
/// The same of derivatives, several of which count.
const ROUNDING: f64 = 4e-7;

/// A series at the points of a lattice.
#[derive(Clone, Debug)]
pub(super) struct Samples {
    lattice: Lattice,
    /// Face by face, u by u.
    all: Vec<Sample>,
    bounds: Bounds,
    regions: Regions,
}

/// Value, gradient and covariant second derivatives in a direction.
#[derive(Clone, Copy, Debug, Default)]
struct Sample {
    value: f32,
    gradient: [f32; 3],
    /// xx, yy, zz, yz, xz, xy.
    hessian: [f32; 6],
}

impl Samples {
    /// The samples of `series`.
    pub(super) fn new(series: &Series) -> Samples {
        let lattice = Lattice::new(CELLS * series.degree().div_ceil(DEGREES).clamp(1, MOST));
        let (all, shapes) = known(series, &lattice);
        let bounds = sup(series, &shapes, lattice.reach());
        let degree = series.degree();
        let whole = Steepness { first: bounds.first, second: bounds.second, third: degree as f64 * bounds.second };
        let regions = Regions::new(&lattice, &shapes, degree, whole);
        let bounds = Bounds { third: bounds.third.min(regions.third()), ..bounds };
        Samples { all, lattice, bounds, regions }
    }

    /// Bounds of the series and its derivatives.
    pub(super) fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The sine of the angle as far as which what is said around a direction holds.
    pub(super) fn reach(&self) -> f64 {
        self.regions.reach()
    }

    /// What holds around the direction `n`, as far as `reach`.
    pub(super) fn around(&self, n: DVec3) -> &Steepness {
        self.regions.around(self.lattice.beside(n))
    }

    /// Memory \[bytes\].
    pub(super) fn bytes(&self) -> u64 {
        size_of_val(&self.all[..]) as u64 + self.regions.bytes()
    }

    /// r in the direction of `n`, and how wrong it may be.
    pub(super) fn value(&self, n: DVec3) -> (f64, f64) {
        let Near { sample, v, around } = self.beside(n);
        let (w, angle) = way(v, n);
        let (gradient, hessian) = sample.derivatives();
        (f64::from(sample.value) + w.dot(gradient + 0.5 * (hessian * w)), self.error_of_value(around, angle))
    }

    /// F and its derivatives at `x`, along the unit vector `d`.
    pub(super) fn height(&self, x: DVec3, d: DVec3) -> Guess<'_> {
        // Of x, which is there sooner than n: what it leads to may be far away in memory.
        let Near { sample, v, around } = self.beside(x);
        let length = x.length();
        let n = x / length;
        let (w, angle) = way(v, n);
        let (gradient, hessian) = sample.derivatives();
        let bent = hessian * w;
        let value = f64::from(sample.value) + w.dot(gradient + 0.5 * bent);

        let c = n.dot(d);
        let turn = Turn::new(v, n);
        let gradient = turn.on(gradient + bent);
        let across = turn.back(d - c * n);
        let slope = gradient.dot(d);
        let bend = across.dot(hessian * across);
        let sine_squared = 1.0 - c * c;
        let along = Taylor {
            value: length - value,
            first: c - slope / length,
            second: (sine_squared - (bend - 2.0 * c * slope) / length) / length,
        };
        Guess { along, errors: self.errors(around, angle, length), upward: n - gradient / length, around }
    }

    /// The shape of the surface in the direction `n`.
    pub(super) fn look(&self, n: DVec3) -> Look<'_> {
        let Near { sample, v, around } = self.beside(n);
        let (w, angle) = way(v, n);
        let (gradient, hessian) = sample.derivatives();
        let bent = hessian * w;
        let slope = gradient + bent;
        Look {
            value: f64::from(sample.value) + w.dot(gradient + 0.5 * bent),
            gradient: Turn::new(v, n).on(slope),
            hessian: carried(v, n, hessian),
            errors: self.errors(around, angle, 1.0),
            around,
        }
    }

    /// How wrong F and its derivatives may be at the angle `angle` from a sample, `length` from the centre.
    fn errors(&self, around: &Steepness, angle: f64, length: f64) -> Taylor {
        let Bounds { first, second, .. } = self.bounds;
        let of_slope = 0.5 * around.third * angle * angle + ROUNDING * (first + second);
        Taylor {
            value: self.error_of_value(around, angle),
            first: of_slope / length,
            second: (around.third * angle + ROUNDING * second + 2.0 * of_slope) / (length * length),
        }
    }

    fn error_of_value(&self, around: &Steepness, angle: f64) -> f64 {
        around.third * angle * angle * angle / 6.0 + HALF_ULP * (self.bounds.high + self.bounds.first)
    }

    /// A sample beside the direction of `n`.
    fn beside(&self, n: DVec3) -> Near<'_> {
        let at = self.lattice.beside(n);
        let (sample, around) = (&self.all[self.lattice.number(at)], self.regions.around(at));
        Near { sample, v: self.lattice.direction(self.lattice.on_face(at)), around }
    }
}

/// A sample, its direction, and what holds around it.
struct Near<'a> {
    sample: &'a Sample,
    v: DVec3,
    around: &'a Steepness,
}

/// What samples say of F in a place.
pub(super) struct Guess<'a> {
    /// It and its derivatives along a line.
    pub(super) along: Taylor,
    /// How wrong each may be.
    pub(super) errors: Taylor,
    /// Its gradient in space.
    pub(super) upward: DVec3,
    /// What holds around there.
    pub(super) around: &'a Steepness,
}

/// What samples say of a series in a direction.
pub(super) struct Look<'a> {
    pub(super) value: f64,
    /// On the sphere.
    pub(super) gradient: DVec3,
    /// On the sphere.
    pub(super) hessian: DMat3,
    /// How wrong each may be, the second times what a unit vector across makes of it at the distance 1.
    pub(super) errors: Taylor,
    pub(super) around: &'a Steepness,
}

/// What `series` is at the points of `lattice`, face by face.
fn known(series: &Series, lattice: &Lattice) -> (Vec<Sample>, Vec<Shape>) {
    let points = lattice.number([6, 0, 0]);
    let (mut samples, mut shapes) = (vec![Sample::default(); points], vec![Shape::default(); points]);
    let rounds: Vec<[usize; 3]> = lattice.rounds().collect();
    let of_round = |&one: &[usize; 3]| {
        let points = lattice.round(one);
        let directions = points.map(|point| lattice.direction(point));
        let bends = series.round(&directions);
        let known = |i: usize| {
            let shape = Shape::new(directions[i], &bends[i]);
            (points[i], Sample::new(&bends[i], &shape), shape)
        };
        [0, 1, 2, 3, 4, 5, 6, 7].map(known)
    };
    // What is known of few at a time needs little memory, and that again and again.
    for some in rounds.chunks(TOGETHER) {
        let known: Vec<_> = some.par_iter().map(of_round).collect();
        for (point, sample, shape) in known.iter().flatten() {
            for at in lattice.faces(*point).map(|at| lattice.number(at)) {
                (samples[at], shapes[at]) = (*sample, *shape);
            }
        }
    }
    (samples, shapes)
}

impl Sample {
    /// Of a place with the derivatives `bend`, as `shape` has them on the sphere.
    fn new(bend: &Bend, shape: &Shape) -> Sample {
        let single = |x: f64| x as f32;
        let [x, y, z] = shape.hessian.to_cols_array_2d();
        Sample {
            value: single(bend.value),
            gradient: bend.slope(shape.direction).gradient.to_array().map(single),
            hessian: [x[0], y[1], z[2], y[2], x[2], x[1]].map(single),
        }
    }

    fn derivatives(&self) -> (DVec3, DMat3) {
        let [xx, yy, zz, yz, xz, xy] = self.hessian.map(f64::from);
        let hessian = DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]);
        (DVec3::from_array(self.gradient.map(f64::from)), hessian)
    }
}

/// The rotation along the great circle from one direction to another.
pub(super) struct Turn {
    from: DVec3,
    to: DVec3,
    sum: DVec3,
    share: f64,
}

impl Turn {
    pub(super) fn new(from: DVec3, to: DVec3) -> Turn {
        Turn { from, to, sum: from + to, share: 1.0 / (1.0 + from.dot(to)) }
    }

    /// What is `across` the first direction, turned to the second.
    pub(super) fn on(&self, across: DVec3) -> DVec3 {
        across - across.dot(self.to) * self.share * self.sum
    }

    /// What is `across` the second direction, turned back to the first.
    fn back(&self, across: DVec3) -> DVec3 {
        across - across.dot(self.from) * self.share * self.sum
    }
}

/// The way on the sphere from `v` to `n` near by, as long as the angle, and no less than that.
pub(super) fn way(v: DVec3, n: DVec3) -> (DVec3, f64) {
    let w = n - n.dot(v) * v;
    let sine2 = w.length_squared();
    // The angle over its sine.
    (w * (1.0 + sine2 / 6.0), sine2.sqrt() * (1.0 + sine2))
}
