//! What the derivatives of a series do not exceed around a place: far less than anywhere, mostly.
//!
//! Let a_ij be the ways from the middle of a cell of the lattice to its corners, and H(a) the second derivatives there, carried to the
//! middle along great circles. They are H + D(a) + E(a,a)/2 + R with D(a) = sum of a_k D_k the third derivatives,
//! |E(a,a)| <= M4 |a|^2 and |R| <= M5 |a|^3/6, M4 = N M3, M5 = N M4 (Bernstein). So with the sides u = (a_10 + a_11 - a_00 - a_01)/2, v likewise,
//!
//! ```text
//! D(u) = (H_10 + H_11 - H_00 - H_01)/2  +-  M4 |a| s + M5 |a|^3/3,      s = |a_10 + a_01|, |a_00 + a_11|, the greater
//! ```
//!
//! and D of any direction is a combination of both. The greatest magnitude of D(w)(w,w), w a unit vector, is then known in the middle of each
//! cell; and nowhere, by M. Riesz as in `bounds`, more than the greatest in a middle over cos(N |a|). Other components of D exceed it by 2/3 M1 at
//! most: exchanging two derivatives on a unit sphere adds no more than the gradient, and in two of three places. M3 bounds all of them.
//!
//! A place x lies among the middles of the cells around a point q of the lattice, at the ways b_i from x: with weights that are not
//! negative, sum l_i b_i = 0. Along each, D(w)(w,w) with w carried along is a sum of waves of up to N turns, whose second derivative is at
//! most N^2 M3 (Bernstein). So D(w)(w,w) at x is the mean of those in the middles up to sum l_i |b_i|^2 N^2 M3/2, where
//! sum l_i |b_i|^2 <= sum l_i |b_i - o|^2 for any o, and with that of q no more than |a|^2: what a cell and those beside it show in their middles
//! is exceeded by (N |a|)^2 M3/2 at most, |a| the greatest distance from a middle to a corner in all of the lattice.
//!
//! Cells stand together in regions; what holds around a region is the most of it and of those up to [`RINGS`] beside it. Lines of the
//! lattice with the angle d between them are nowhere on a face nearer than asin(sin d/sqrt(2)).

use super::lattice::Lattice;
use super::series::Bend;
use super::{bends, bounds::hessian};
use crate::math::{DMat3, DVec3, PI, cos, sin};
use rayon::prelude::*;

/// Cells along the edge of a region.
const CELLS: usize = 4;
/// Regions that count around each.
const RINGS: usize = 4;
/// Of these, what is certain where the cell of a direction is known to one beside it, and those beside a cell count for it.
const CERTAIN: f64 = RINGS as f64 - 3.0 / CELLS as f64;
/// The least share of the angle between two lines of the lattice that they are apart.
const APART: f64 = 0.7;
/// Times M1, what components of the third derivatives exceed the greatest along a great circle by.
const MIXED: f64 = 2.0 / 3.0;
/// What is added for rounding.
const ROUNDING: f64 = 1.0 + 1e-6;

/// Bounds of the first three derivatives along great circles, by the angle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Steepness {
    pub(super) first: f64,
    pub(super) second: f64,
    pub(super) third: f64,
}

impl Steepness {
    /// Bounds of the second and third derivatives of F along lines, or of -F where `side` is negative, where |x| is at least `least`: of how
    /// far the second falls, of how far the third goes either way.
    pub(super) fn of_lines(&self, least: f64, side: f64) -> [f64; 2] {
        let Steepness { first, second, third } = *self;
        let square = least * least;
        // |x| itself only bends up.
        let of_length = if side < 0.0 { 1.0 / least } else { 0.0 };
        let of_second = (0.5 * second + (0.25 * second * second + first * first).sqrt()) / square + of_length;
        [of_second, (third + 2.31 * second + 2.0 * first) / (square * least) + 1.16 / square]
    }

    fn max(self, other: Steepness) -> Steepness {
        Steepness {
            first: self.first.max(other.first),
            second: self.second.max(other.second),
            third: self.third.max(other.third),
        }
    }
}

/// Bounds around each region of a lattice.
#[derive(Clone, Debug)]
pub(super) struct Regions {
    /// Regions along an edge of the cube.
    edge: usize,
    /// Face by face, u by u.
    around: Vec<Steepness>,
    /// M3.
    third: f64,
    /// The sine of the angle as far as which they hold around a direction.
    reach: f64,
}

impl Regions {
    /// The regions of `lattice`, at whose points a series of `degree` has the `shapes`, face by face; `whole` is what its derivatives do not
    /// exceed anywhere.
    pub(super) fn new(lattice: &Lattice, shapes: &[Shape], degree: usize, whole: Steepness) -> Regions {
        let (cells, edge) = (lattice.cells(), lattice.cells() / CELLS);
        let cell = |k: usize| {
            let (face, u, v) = (k / (cells * cells), k / cells % cells, k % cells);
            let corner = |i: usize, j: usize| &shapes[lattice.number([face, u + i, v + j])];
            Cell::new([corner(0, 0), corner(0, 1), corner(1, 0), corner(1, 1)])
        };
        let all: Vec<Cell> = (0..6 * cells * cells).into_par_iter().map(cell).collect();
        let size = all.iter().map(|cell| cell.size).fold(0.0, f64::max);
        let third = third_of_all(&all, size, degree as f64, whole);
        let whole = Steepness { third, ..whole };
        let mut own = vec![Steepness::default(); 6 * edge * edge];
        for (k, cell) in all.iter().enumerate() {
            let (face, u, v) = (k / (cells * cells), k / cells % cells / CELLS, k % cells / CELLS);
            let region = &mut own[(face * edge + u) * edge + v];
            *region = region.max(cell.steepness(size, degree as f64, whole));
        }
        let angle = APART * CERTAIN * 0.5 * PI / edge as f64;
        Regions { edge, around: spread(edge, own), third, reach: sin(angle) }
    }

    /// What the derivatives do not exceed anywhere within the angle whose sine is `reach` of a direction, beside which the point [face, u, v] of
    /// their lattice lies.
    pub(super) fn around(&self, [face, u, v]: [usize; 3]) -> &Steepness {
        let of = |i: usize| (i / CELLS).min(self.edge - 1);
        &self.around[(face * self.edge + of(u)) * self.edge + of(v)]
    }

    /// M3.
    pub(super) fn third(&self) -> f64 {
        self.third
    }

    /// The sine of the angle as far as which bounds hold around a direction.
    pub(super) fn reach(&self) -> f64 {
        self.reach
    }

    /// Memory \[bytes\].
    pub(super) fn bytes(&self) -> u64 {
        size_of_val(&self.around[..]) as u64
    }
}

/// A series in the direction of a point of a lattice.
#[derive(Clone, Copy, Default)]
pub(super) struct Shape {
    pub(super) direction: DVec3,
    pub(super) value: f64,
    /// Magnitude of the gradient.
    pub(super) first: f64,
    /// The greatest magnitude of a second derivative.
    pub(super) second: f64,
    /// The second derivatives on the sphere.
    pub(super) hessian: DMat3,
}

impl Shape {
    /// The series with the derivatives `bend` in the direction `n`.
    pub(super) fn new(n: DVec3, bend: &Bend) -> Shape {
        let (most, least) = bends(bend, n);
        let (first, second) = (bend.slope(n).gradient.length(), most.max(-least));
        Shape { direction: n, value: bend.value, first, second, hessian: hessian(bend, n) }
    }
}

/// What a cell shows.
struct Cell {
    /// Greatest magnitudes at the corners.
    first: f64,
    second: f64,
    /// That of D(w)(w,w) in the middle, without its error.
    third: f64,
    /// How much an error of D(u) and D(v) counts in that.
    weight: f64,
    /// No point of it is farther from a corner, or from the middle, and by so much less that ways on the sphere may be taken for those in a plane.
    size: f64,
    /// s.
    skew: f64,
}

impl Cell {
    /// The cell with the corners 00, 01, 10, 11.
    fn new(corners: [&Shape; 4]) -> Cell {
        let middle = corners.iter().map(|c| c.direction).sum::<DVec3>().normalize();
        let carried = corners.map(|c| carried(c.direction, middle, c.hessian));
        let [a, b, c, d] = corners.map(|c| way(middle, c.direction));
        let (u, v) = (0.5 * (c + d - a - b), 0.5 * (b + d - a - c));
        let along_u = (carried[2] + carried[3] - carried[0] - carried[1]) * 0.5;
        let along_v = (carried[1] + carried[3] - carried[0] - carried[2]) * 0.5;
        // w = (p.w) u + (q.w) v for w across the middle.
        let (p, q) = (v.cross(middle) / u.dot(v.cross(middle)), u.cross(middle) / v.dot(u.cross(middle)));
        let of = |w: DVec3| p.dot(w) * w.dot(along_u * w) + q.dot(w) * w.dot(along_v * w);
        let far = corners.iter().map(|c| middle.distance(c.direction)).fold(0.0, f64::max);
        Cell {
            first: corners.iter().map(|c| c.first).fold(0.0, f64::max),
            second: corners.iter().map(|c| c.second).fold(0.0, f64::max),
            third: greatest_of_cubic(middle, of),
            weight: p.length() + q.length(),
            size: 1.01 * far,
            skew: (a + d).length().max((b + c).length()),
        }
    }

    /// How wrong `third` may be, in units of M3.
    fn error(&self, degree: f64) -> f64 {
        let wide = degree * self.size;
        self.weight * (wide * self.skew + wide * wide * self.size / 3.0)
    }

    /// What holds in a cell where it does for this one and those beside it, none of which is greater than `size`.
    fn steepness(&self, size: f64, degree: f64, whole: Steepness) -> Steepness {
        let first = (self.first + size * whole.second).min(whole.first);
        let wide = degree * size;
        let between = 0.5 * ROUNDING * wide * wide;
        let third = self.third + (self.error(degree) + between) * whole.third + MIXED * first;
        let third = third.min(whole.third);
        let second = (self.second + size * third).min(whole.second);
        Steepness { first: (self.first + size * second).min(whole.first), second, third }
    }
}

/// M3 by what all cells show, of which none is greater than `size`: at most that of `rough`.
fn third_of_all(all: &[Cell], size: f64, degree: f64, rough: Steepness) -> f64 {
    let sampled = all.iter().map(|cell| cell.third).fold(0.0, f64::max);
    let error = all.iter().map(|cell| cell.error(degree)).fold(0.0, f64::max);
    let share = cos((degree * size).min(2.0)) - error;
    // The error is in units of M3 and not of the greatest D(w)(w,w).
    let whole = (ROUNDING * sampled + error * MIXED * rough.first) / share + MIXED * rough.first;
    if share > 0.0 { whole.min(rough.third) } else { rough.third }
}

/// No magnitude of the cubic form `of` on the unit circle across `middle` is greater: it is a sum of waves of one and of three turns.
fn greatest_of_cubic(middle: DVec3, of: impl Fn(DVec3) -> f64) -> f64 {
    let (e, f) = crate::math::frame(middle);
    let half = 0.5f64.sqrt();
    // of(e) = A + C, of(f) = B - D; both halves: (A + B - C + D) sqrt(1/2), (A - B - C - D) sqrt(1/2).
    let (at_e, at_f) = (of(e), of(f));
    let (plus, minus) = (of((e + f) * half) / half, of((e - f) * half) / half);
    let (even, odd) = (0.5 * (plus + minus), 0.5 * (plus - minus));
    let (a, c) = (0.5 * (at_e + even), 0.5 * (at_e - even));
    let (b, d) = (0.5 * (odd + at_f), 0.5 * (odd - at_f));
    (a * a + b * b).sqrt() + (c * c + d * d).sqrt()
}

/// The way on the sphere from `v` to `n` near by, as long as the angle.
fn way(v: DVec3, n: DVec3) -> DVec3 {
    let w = n - n.dot(v) * v;
    let sine2 = w.length_squared();
    // The angle over its sine.
    w * (1.0 + sine2 / 6.0 + 0.075 * sine2 * sine2)
}

/// The tensor `h` across the direction `from`, turned with it to `to` along the great circle.
pub(super) fn carried(from: DVec3, to: DVec3, h: DMat3) -> DMat3 {
    let sum = from + to;
    let share = 1.0 / (1.0 + from.dot(to));
    let across = h * to * share;
    let outer = |a: DVec3, b: DVec3| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
    h - outer(sum, across) - outer(across, sum) + outer(sum, sum) * (to.dot(across) * share)
}

/// For each region the most of itself and of those up to [`RINGS`] beside it, across the edges of faces too: by way of the corners that they share.
fn spread(edge: usize, mut regions: Vec<Steepness>) -> Vec<Steepness> {
    let lattice = Lattice::new(edge);
    let points: Vec<[usize; 3]> = lattice.points().collect();
    let corners = |k: usize| {
        let (face, u, v) = (k / (edge * edge), k / edge % edge, k % edge);
        [(0, 0), (0, 1), (1, 0), (1, 1)]
            .map(|(i, j)| points.binary_search(&lattice.on_face([face, u + i, v + j])).expect("a point of the lattice"))
    };
    let corners: Vec<[usize; 4]> = (0..regions.len()).map(corners).collect();
    for _ in 0..RINGS {
        let mut at = vec![Steepness::default(); points.len()];
        for (region, corners) in regions.iter().zip(&corners) {
            corners.iter().for_each(|&corner| at[corner] = at[corner].max(*region));
        }
        for (region, corners) in regions.iter_mut().zip(&corners) {
            *region = corners.iter().fold(*region, |most, &corner| most.max(at[corner]));
        }
    }
    regions
}
