//! Which segments from a point just outside a surface are certain to meet it nowhere: those above a cosine with the normal there.
//!
//! ```text
//! near:  F(t) >= t (G c + F2 t/2 - M3' t^2/6) > 0  up to t = T   where c > T (-F2/2 + M3' T/6)/G
//! far:   a surface point whose height over the tangent plane is z at the distance t is met by a ray with c = z/t
//! ```
//!
//! with c the cosine, G = |grad F| at the point, F2 the least second derivative of F there in any direction and M3' the bound of the third.
//! The surface is a lattice of cells. A point of a cell is a convex combination of its corners but for the sagitta of two great
//! circles, d^2/8 S each, where d is the angle of an edge and S = sqrt((M2 + R)^2 + (2 M1)^2) bounds the second derivative of r(n) n by the
//! angle. So a point at the distance t lies no higher than its highest corner and the sagittas, and within the diagonal of its cell of
//! it: the corner v needs
//!
//! ```text
//! c >= min((z + sagitta)/(|v - p| - diagonal),  what "near" needs for T = |v - p| + diagonal)
//! ```
//!
//! and the greatest need of all corners is enough. Corners stand sixteen by sixteen in a tree of balls whose needs, with the radius for sagitta
//! and diagonal, are no less than those of what they hold.

use super::bounds::Bounds;
use super::samples::{self, Samples};
use super::series::Bend;
use super::{Star, bends};
use crate::geometry::simd::{Isa, Kernel, Path, Vector};
use crate::math::{DVec3, PI};

/// Children of a node: the lanes of a vector.
const WIDE: usize = 16;
/// Nodes below each other, above the corners.
const LEVELS: usize = 3;
/// Cells along the edge of a node of the last level: its corners fill a vector.
const CELLS: usize = 3;
/// Cells along the edge of a node of the first level.
const CELLS_OF_FIRST: usize = CELLS * 4 * 4;
const _: () = assert!(CELLS_OF_FIRST == samples::CELLS, "whole nodes on every lattice of samples");
/// How far "near" may go, as a share of the distance from the centre.
const NEAR: f64 = 0.25;
/// What f32 rounds, in units of the largest radius.
const ROUNDING: f64 = 1e-6;
/// What is added to a cosine for rounding.
const MARGIN: f64 = 1e-5;

/// Directions from a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::geometry) struct Cone {
    /// The unit vector in the middle.
    pub(in crate::geometry) axis: DVec3,
    /// Directions whose cosine with it is greater are in the cone; none where this is 1 or more.
    pub(in crate::geometry) cosine: f64,
}

impl Cone {
    /// True when it holds the direction `d`, of any length.
    pub(in crate::geometry) fn holds(&self, d: DVec3) -> bool {
        let along = self.axis.dot(d);
        along > 0.0 && along * along > self.cosine * self.cosine * d.length_squared()
    }
}

/// Sixteen balls.
#[derive(Clone, Debug)]
struct Balls {
    centers: [[f32; WIDE]; 3],
    radii: [f32; WIDE],
}

/// Corners of a few cells.
#[derive(Clone, Debug)]
struct Corners {
    positions: [[f32; WIDE]; 3],
    /// No point of a cell is farther from a corner of it.
    diagonal: f32,
}

/// A surface as corners of cells in a tree of balls, in its own coordinates.
#[derive(Clone, Debug)]
pub(super) struct Horizon {
    /// Children of the nodes of each level, the roots in the first.
    levels: [Vec<Balls>; LEVELS],
    corners: Vec<Corners>,
    sagitta: f32,
    path: Path,
}

impl Horizon {
    /// The surface of `star`.
    pub(super) fn new(star: &Star) -> Horizon {
        let cells = star.samples.cells();
        let edge = cells / CELLS_OF_FIRST;
        let Bounds { high, first, second, .. } = star.bounds;
        let angle = 0.5 * PI / cells as f64;
        let bend = ((second + high) * (second + high) + 4.0 * first * first).sqrt();
        let sagitta = 0.25 * angle * angle * bend + ROUNDING * high;
        let firsts: Vec<(usize, usize, usize)> =
            (0..6).flat_map(|face| (0..edge).flat_map(move |u| (0..edge).map(move |v| (face, u, v)))).collect();
        let corners: Vec<Corners> = firsts.iter().flat_map(|&first| corners(&star.samples, first, sagitta)).collect();
        let balls: Vec<Ball> = corners.iter().map(|corners| corners.ball(sagitta)).collect();
        let third = rows(&balls);
        let second = rows(&third.iter().map(Balls::ball).collect::<Vec<_>>());
        let first = rows(&second.iter().map(Balls::ball).collect::<Vec<_>>());
        Horizon { levels: [first, second, third], corners, sagitta: sagitta as f32, path: star.series.path() }
    }

    /// Memory \[bytes\].
    pub(super) fn bytes(&self) -> u64 {
        (self.levels.iter().map(|level| size_of_val(&level[..])).sum::<usize>() + size_of_val(&self.corners[..])) as u64
    }

    /// Directions from `p` outside, where `star` has the derivatives `bend`, that meet it nowhere.
    pub(super) fn cone(&self, star: &Star, p: DVec3, bend: &Bend) -> Cone {
        let length = p.length();
        let n = p / length;
        let gradient = bend.slope(n).gradient / length;
        let (steep, bent) = (gradient.length(), bends(bend, n).0 / length);
        let whole = (1.0 + steep * steep).sqrt();
        // F'' = a s^2 + 2 b s c in the angle to n, at least: the lesser eigenvalue.
        let (a, b) = ((1.0 - bent) / length, steep / length);
        let second = 0.5 * a - (0.25 * a * a + b * b).sqrt();
        let [_, third] = star.derivatives(star.bounds.low.max((1.0 - NEAR) * length), 1.0);
        let axis = (n - gradient) / whole;
        let near = [-0.5 * second / whole, third / (6.0 * whole), NEAR * length];
        let single = |v: f64| v as f32;
        let ask = Ask {
            surface: self,
            p: p.to_array().map(single),
            axis: axis.to_array().map(single),
            near: near.map(single),
        };
        Cone { axis, cosine: f64::from(self.path.run(ask)) + MARGIN }
    }
}

/// The corners of the cells of a node of the first level, as they follow each other in the tree.
fn corners(samples: &Samples, (face, u, v): (usize, usize, usize), sagitta: f64) -> Vec<Corners> {
    let side = CELLS_OF_FIRST + 1;
    let at = |i: usize, j: usize| samples.corner(face, u * CELLS_OF_FIRST + i, v * CELLS_OF_FIRST + j);
    let all: Vec<DVec3> = (0..side * side).map(|k| at(k / side, k % side)).collect();
    let few = |(i, j): (usize, usize)| {
        let at = |k: usize, l: usize| all[(i * CELLS + k) * side + j * CELLS + l];
        let mut few = Corners { positions: [[0.0; WIDE]; 3], diagonal: 0.0 };
        for lane in 0..WIDE {
            let corner = at(lane / 4, lane % 4).to_array();
            (0..3).for_each(|axis| few.positions[axis][lane] = corner[axis] as f32);
        }
        let across = |k: usize, l: usize| at(k, l).distance(at(k + 1, l + 1)).max(at(k + 1, l).distance(at(k, l + 1)));
        let longest = (0..CELLS * CELLS).map(|cell| across(cell / CELLS, cell % CELLS)).fold(0.0, f64::max);
        // The sides are shorter than the longer diagonal but in cells that are very skew.
        let side = |k: usize, l: usize| at(k, l).distance(at(k + 1, l)).max(at(k, l).distance(at(k, l + 1)));
        let longest = (0..CELLS * CELLS).map(|cell| side(cell / CELLS, cell % CELLS)).fold(longest, f64::max);
        few.diagonal = (longest + 2.0 * sagitta) as f32;
        few
    };
    in_tree_order().map(few).collect()
}

/// The nodes of the last level in one of the first, children of a node side by side.
fn in_tree_order() -> impl Iterator<Item = (usize, usize)> {
    (0..WIDE).flat_map(|outer| (0..WIDE).map(move |inner| (outer / 4 * 4 + inner / 4, outer % 4 * 4 + inner % 4)))
}

/// A ball around corners.
#[derive(Clone, Copy)]
struct Ball {
    center: DVec3,
    radius: f64,
}

/// The ball around `balls`.
fn around(balls: &[Ball]) -> Ball {
    let low = balls.iter().fold(DVec3::INFINITY, |low, b| low.min(b.center));
    let high = balls.iter().fold(DVec3::NEG_INFINITY, |high, b| high.max(b.center));
    let center = 0.5 * (low + high);
    let radius = balls.iter().map(|b| b.center.distance(center) + b.radius).fold(0.0, f64::max);
    Ball { center, radius }
}

fn lane(positions: &[[f32; WIDE]; 3], lane: usize) -> DVec3 {
    DVec3::from_array(positions.map(|axis| f64::from(axis[lane])))
}

impl Corners {
    fn ball(&self, sagitta: f64) -> Ball {
        let radius = f64::from(self.diagonal).max(sagitta);
        let all: Vec<Ball> = (0..WIDE).map(|i| Ball { center: lane(&self.positions, i), radius }).collect();
        around(&all)
    }
}

impl Balls {
    fn ball(&self) -> Ball {
        let ball = |i: usize| Ball { center: lane(&self.centers, i), radius: f64::from(self.radii[i]) };
        around(&(0..WIDE).map(ball).collect::<Vec<_>>())
    }
}

/// Sixteen by sixteen; the last are repeated.
fn rows(balls: &[Ball]) -> Vec<Balls> {
    let row = |balls: &[Ball]| {
        let mut row = Balls { centers: [[0.0; WIDE]; 3], radii: [0.0; WIDE] };
        for i in 0..WIDE {
            let ball = balls[i.min(balls.len() - 1)];
            let center = ball.center.to_array();
            (0..3).for_each(|axis| row.centers[axis][i] = center[axis] as f32);
            row.radii[i] = (ball.radius * (1.0 + ROUNDING)) as f32;
        }
        row
    };
    balls.chunks(WIDE).map(row).collect()
}

/// The greatest need of a point of view. No fused operation: all paths give the same.
struct Ask<'a> {
    surface: &'a Horizon,
    p: [f32; 3],
    axis: [f32; 3],
    /// Of "near": T (first + second T), up to the third.
    near: [f32; 3],
}

impl Kernel for Ask<'_> {
    type Output = f32;

    #[inline(always)]
    fn run<I: Isa>(self) -> f32 {
        let Horizon { levels: [first, second, third], corners, sagitta, .. } = self.surface;
        let mut most = 0f32;
        for (i, row) in first.iter().enumerate() {
            let needs = self.of_balls::<I>(row);
            for a in 0..WIDE {
                let i = i * WIDE + a;
                if needs[a] <= most || i >= second.len() {
                    continue;
                }
                let needs = self.of_balls::<I>(&second[i]);
                for b in 0..WIDE {
                    if needs[b] <= most {
                        continue;
                    }
                    let i = i * WIDE + b;
                    let needs = self.of_balls::<I>(&third[i]);
                    for c in 0..WIDE {
                        if needs[c] > most {
                            let few = &corners[i * WIDE + c];
                            let [height, size] = [*sagitta, few.diagonal].map(I::Sixteen::splat);
                            most = greatest(most, &self.needs::<I>(&few.positions, height, size));
                        }
                    }
                }
            }
        }
        most
    }
}

#[inline(always)]
fn greatest(mut most: f32, of: &[f32; WIDE]) -> f32 {
    for x in of {
        most = if *x > most { *x } else { most };
    }
    most
}

impl Ask<'_> {
    #[inline(always)]
    fn of_balls<I: Isa>(&self, balls: &Balls) -> [f32; WIDE] {
        let radii = I::Sixteen::load(&balls.radii);
        self.needs::<I>(&balls.centers, radii, radii)
    }

    /// What the corners `at` need, where the surface rises above them by `height`, and is within `size` of them.
    #[inline(always)]
    fn needs<I: Isa>(&self, at: &[[f32; WIDE]; 3], height: I::Sixteen, size: I::Sixteen) -> [f32; WIDE] {
        let splat = I::Sixteen::splat;
        let x = I::Sixteen::load(&at[0]).sub(splat(self.p[0]));
        let y = I::Sixteen::load(&at[1]).sub(splat(self.p[1]));
        let z = I::Sixteen::load(&at[2]).sub(splat(self.p[2]));
        let up = x.mul(splat(self.axis[0])).add(y.mul(splat(self.axis[1]))).add(z.mul(splat(self.axis[2])));
        let distance = x.mul(x).add(y.mul(y)).add(z.mul(z)).sqrt();
        let up = up.add(height).max(splat(0.0));
        // 1 where it may be anywhere.
        let far = up.div(distance.sub(size).max(up).max(splat(f32::MIN_POSITIVE)));
        let reach = distance.add(size);
        let near = reach.mul(splat(self.near[0]).add(reach.mul(splat(self.near[1]))));
        // Beyond its reach "near" says nothing.
        let near = near.max(reach.sub(splat(self.near[2])).mul(splat(f32::MAX)));
        let mut needs = [0.0; WIDE];
        far.min(near).store(&mut needs);
        needs
    }
}
