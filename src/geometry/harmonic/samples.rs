//! A series at the points of a lattice, with its derivatives, and what that says of all places between: with certainty, and thirty times
//! faster than the sum of the series.
//!
//! Let v be a point of the lattice, w = n - (n,v) v the way from it to a direction n, a the angle between them, and P the rotation
//! that takes v to n. In a frame that goes with it along the great circle the second derivatives H are trigonometric polynomials of degree N and
//! at most M2, so none changes faster than M3 = N M2 (Bernstein), and
//!
//! ```text
//! |r(n)      - (r + a (g,w/|w|) + a^2 w'Hw/(2 |w|^2))|  <=  M3 a^3/6
//! |grad r(n) - P (g + a H w/|w|)|                       <=  M3 a^2/2
//! |H(n)      - P H P'|                                  <=  M3 a          with r, g, H of v
//! ```

use super::Bounds;
use super::bounds::{hessian, sup};
use super::lattice::Lattice;
use super::series::Series;
use super::steps::Taylor;
use crate::math::{DMat3, DVec3};
use rayon::prelude::*;

/// Cells along an edge of the cube come in so many.
pub(super) const CELLS: usize = 48;
/// Degrees for which these are enough: N a = 0.19 at most.
const DEGREES: usize = 8;
/// Times that, at most.
const MOST: usize = 4;
/// What f32 rounds, and the expansion of an angle, of the largest numbers of their kind.
const ROUNDING: f64 = 4e-7;

/// A series at the points of a lattice.
#[derive(Clone, Debug)]
pub(super) struct Samples {
    lattice: Lattice,
    /// Face by face, u by u.
    all: Vec<Sample>,
    bounds: Bounds,
    /// M3.
    third: f64,
}

/// Value, gradient and covariant second derivatives in a direction.
#[derive(Clone, Copy, Debug)]
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
        let side = lattice.cells() + 1;
        let at = |k: usize| {
            let n = lattice.direction(lattice.on_face([k / (side * side), k / side % side, k % side]));
            (n, series.bend(n))
        };
        let bends: Vec<_> = (0..6 * side * side).into_par_iter().map(at).collect();
        let bounds = sup(series, &bends, lattice.reach());
        let single = |x: f64| x as f32;
        let sample = |(n, bend): &(DVec3, super::Bend)| {
            let [x, y, z] = hessian(bend, *n).to_cols_array_2d();
            Sample {
                value: single(bend.value),
                gradient: bend.slope(*n).gradient.to_array().map(single),
                hessian: [x[0], y[1], z[2], y[2], x[2], x[1]].map(single),
            }
        };
        let third = series.degree() as f64 * bounds.second;
        Samples { all: bends.iter().map(sample).collect(), lattice, bounds, third }
    }

    /// Bounds of the series and its derivatives.
    pub(super) fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Cells along an edge of the cube.
    pub(super) fn cells(&self) -> usize {
        self.lattice.cells()
    }

    /// The point of the surface in the direction of the point (u, v) of a face of the lattice.
    pub(super) fn corner(&self, face: usize, u: usize, v: usize) -> DVec3 {
        let side = self.lattice.cells() + 1;
        let value = f64::from(self.all[(face * side + u) * side + v].value);
        value * self.lattice.direction(self.lattice.on_face([face, u, v]))
    }

    /// Memory \[bytes\].
    pub(super) fn bytes(&self) -> u64 {
        size_of_val(&self.all[..]) as u64
    }

    /// r in the direction of `n`, and how wrong it may be.
    pub(super) fn value(&self, n: DVec3) -> (f64, f64) {
        let (sample, v) = self.beside(n);
        let (w, angle) = way(v, n);
        let (gradient, hessian) = sample.derivatives();
        (f64::from(sample.value) + w.dot(gradient + 0.5 * (hessian * w)), self.error_of_value(angle))
    }

    /// F and its derivatives at `x` along the unit vector `d`, and how wrong each may be.
    pub(super) fn height(&self, x: DVec3, d: DVec3) -> (Taylor, Taylor) {
        let length = x.length();
        let n = x / length;
        let (sample, v) = self.beside(n);
        let (w, angle) = way(v, n);
        let (gradient, hessian) = sample.derivatives();
        let bent = hessian * w;
        let value = f64::from(sample.value) + w.dot(gradient + 0.5 * bent);

        let c = n.dot(d);
        let across = d - c * n;
        let turned = across - across.dot(v) / (1.0 + n.dot(v)) * (v + n);
        let slope = (gradient + bent).dot(turned);
        let bend = turned.dot(hessian * turned);
        let sine_squared = 1.0 - c * c;
        let height = Taylor {
            value: length - value,
            first: c - slope / length,
            second: (sine_squared - (bend - 2.0 * c * slope) / length) / length,
        };
        let Bounds { first, second, .. } = self.bounds;
        let of_slope = 0.5 * self.third * angle * angle + ROUNDING * (first + second);
        let errors = Taylor {
            value: self.error_of_value(angle),
            first: of_slope / length,
            second: (self.third * angle + ROUNDING * second + 2.0 * of_slope) / (length * length),
        };
        (height, errors)
    }

    fn error_of_value(&self, angle: f64) -> f64 {
        self.third * angle * angle * angle / 6.0 + ROUNDING * (self.bounds.high + self.bounds.first)
    }

    /// A sample beside the direction `n`, and its direction.
    fn beside(&self, n: DVec3) -> (&Sample, DVec3) {
        let [face, u, v] = self.lattice.beside(n);
        let side = self.lattice.cells() + 1;
        (&self.all[(face * side + u) * side + v], self.lattice.direction(self.lattice.on_face([face, u, v])))
    }
}

impl Sample {
    fn derivatives(&self) -> (DVec3, DMat3) {
        let [xx, yy, zz, yz, xz, xy] = self.hessian.map(f64::from);
        let hessian = DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]);
        (DVec3::from_array(self.gradient.map(f64::from)), hessian)
    }
}

/// The way on the sphere from `v` to `n` near by, as long as the angle, and no less than that.
fn way(v: DVec3, n: DVec3) -> (DVec3, f64) {
    let w = n - n.dot(v) * v;
    let sine2 = w.length_squared();
    // The angle over its sine.
    (w * (1.0 + sine2 / 6.0), sine2.sqrt() * (1.0 + sine2))
}
