//! Two meshes that rays ask first: one certainly inside a surface, one certainly outside.
//!
//! The meshes have their corners on rays from the centre through a lattice, at the radius of the surface times a factor. For a
//! triangle with its corners on the surface let q(y) = r(y/|y|)/|y| at its points y. Along a line in its plane the second
//! derivative of q is at most (M2 + 3 M1 + 2 R)/|y|^3, so q stays within what a grid of samples says, widened by that times L^2/6
//! with L the longest edge between samples (the error of linear interpolation). Corners moved out by the greatest q of all
//! triangles that share them make triangles outside the surface: the plane through corners s_i p_i meets the direction
//! of sum l_i p_i at 1/sum(l_i/s_i) >= min s_i. Those moved in by the least q lie inside.

use super::Star;
use super::bounds::Bounds;
use super::lattice::Lattice;
use super::regions::Steepness;
use crate::math::DVec3;
use rayon::prelude::*;

/// Samples along an edge of the cube, at most.
const SAMPLES: usize = 256;
/// Samples along an edge of a triangle, at most: beyond, triangles are coarser than what lies between samples.
const PARTS: usize = 16;

/// Corners of triangles inside and outside of a surface, in its own coordinates.
pub(super) struct Shells {
    /// No point of these is outside; empty where none could be found.
    pub(super) inner: Vec<[DVec3; 3]>,
    /// No point of these is inside.
    pub(super) outer: Vec<[DVec3; 3]>,
    /// The numbers of the corners of each triangle, the same for both.
    pub(super) numbers: Vec<[usize; 3]>,
    /// No point of `outer` is farther from the centre than so many times the radius of the surface in its direction.
    pub(super) reach: f64,
}

impl Shells {
    /// The shells of `star` with so many `cells` along an edge of the cube, farther from it by the share `margin` than they need be.
    pub(super) fn new(star: &Star, cells: usize, margin: f64) -> Shells {
        let lattice = Lattice::new(cells);
        let points: Vec<[usize; 3]> = lattice.points().collect();
        let number = |p: [usize; 3]| points.binary_search(&p).expect("a point of the lattice");
        let corners: Vec<DVec3> =
            points.iter().map(|&p| lattice.direction(p)).map(|n| star.series.value(n) * n).collect();
        let triangles: Vec<[usize; 3]> = triangles(&lattice).map(|t| t.map(number)).collect();
        let bounds: Vec<(f64, f64)> = triangles
            .par_iter()
            .map(|t| quotients(star, &t.map(|i| corners[i]), (SAMPLES / cells).min(PARTS)))
            .collect();
        let mut factors = vec![(f64::INFINITY, 0f64); corners.len()];
        for (triangle, &(low, high)) in triangles.iter().zip(&bounds) {
            for &i in triangle {
                factors[i] = (factors[i].0.min(low), factors[i].1.max(high));
            }
        }
        let moved = |factor: &dyn Fn(usize) -> f64| -> Vec<[DVec3; 3]> {
            triangles.iter().map(|t| t.map(|i| factor(i) * corners[i])).collect()
        };
        let is_inside = margin < 1.0 && factors.iter().all(|f| f.0 > 0.0);
        let inner = if is_inside { moved(&|i| factors[i].0 * (1.0 - margin)) } else { Vec::new() };
        // Between corners with factors up to the greatest, q is at least the least.
        let (least, most) = factors.iter().fold((f64::INFINITY, 0f64), |(l, h), f| (l.min(f.0), h.max(f.1)));
        let reach = if least > 0.0 { most * (1.0 + margin) / least * (1.0 + margin) } else { f64::INFINITY };
        let outer = moved(&|i| factors[i].1 * (1.0 + margin));
        Shells { inner, outer, numbers: triangles, reach }
    }
}

impl Star {
    /// Bounds of its derivatives in all directions of a triangle.
    fn steepness(&self, corners: &[DVec3; 3]) -> Steepness {
        let middle = corners.iter().map(|c| c.normalize()).sum::<DVec3>().normalize();
        // A chord is no shorter than the sine of its angle; the corners are the farthest.
        let far = corners.iter().map(|c| c.normalize().distance(middle)).fold(0.0, f64::max);
        let Bounds { first, second, third, .. } = self.bounds;
        if far < self.samples.reach() { *self.samples.around(middle) } else { Steepness { first, second, third } }
    }
}

/// Two triangles for each cell of the faces of the cube, their fronts outward.
fn triangles(lattice: &Lattice) -> impl Iterator<Item = [[usize; 3]; 3]> {
    let n = lattice.cells();
    (0..6).flat_map(move |face| {
        let cells = (0..n).flat_map(move |u| (0..n).map(move |v| (u, v)));
        cells.flat_map(move |(u, v)| {
            let corner = |du: usize, dv: usize| lattice.on_face([face, u + du, v + dv]);
            let turned = [corner(0, 1), corner(1, 0)];
            let [first, third] = if face % 2 == 0 { turned } else { [turned[1], turned[0]] };
            [[corner(0, 0), first, corner(1, 1)], [corner(0, 0), corner(1, 1), third]]
        })
    })
}

/// Bounds of q over a triangle with its corners on the surface, by so many `parts` of its edges.
fn quotients(star: &Star, corners: &[DVec3; 3], parts: usize) -> (f64, f64) {
    let [a, b, c] = *corners;
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    let plane = (b - a).cross(c - a).normalize_or_zero().dot(a).abs();
    let nearest = plane.max(a.length().min(b.length()).min(c.length()) - longest);
    let Steepness { first, second, .. } = star.steepness(corners);
    let bend = (second + 3.0 * first + 2.0 * star.bounds.high) / (nearest * nearest * nearest);
    let edge = longest / parts as f64;
    let slack = bend * edge * edge / 6.0;
    let (mut low, mut high) = (f64::INFINITY, 0f64);
    for i in 0..=parts {
        for j in 0..=parts - i {
            let [u, v] = [i, j].map(|x| x as f64 / parts as f64);
            let y = a + u * (b - a) + v * (c - a);
            let length = y.length();
            let (value, error) = star.samples.value(y / length);
            (low, high) = (low.min((value - error) / length), high.max((value + error) / length));
        }
    }
    (low - slack, high + slack)
}
