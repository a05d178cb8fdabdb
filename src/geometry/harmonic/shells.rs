//! What lies certainly inside a surface, and what certainly outside: radii, and two meshes that rays ask first.
//!
//! The meshes have their corners on rays from the centre through a lattice, at the radius of the surface times a factor. For a
//! triangle with its corners on the surface let q(y) = r(y/|y|)/|y| at its points y. Along a line in its plane the second
//! derivative of q is at most (M2 + 3 M1 + 2 R)/|y|^3, so q stays within what a grid of samples says, widened by that times L^2/6
//! with L the longest edge between samples (the error of linear interpolation). Corners moved out by the greatest q of all
//! triangles that share them make triangles outside the surface: the plane through corners s_i p_i meets the direction
//! of sum l_i p_i at 1/sum(l_i/s_i) >= min s_i. Those moved in by the least q lie inside.

use super::{Bounds, Series, Star};
use crate::math::{DVec3, PI, tan};

/// Share of the mean radius by which the bounds of the radii may be too far.
const LOOSENESS: f64 = 0.01;
/// Cells along an edge of the cube, at most.
const FINEST: usize = 96;

/// The direction of a point on the surface of a cube with corners (0,0,0) and (n,n,n), lines of equal angles on its faces.
pub(super) fn direction([i, j, k]: [usize; 3], n: usize) -> DVec3 {
    let axis = |i: usize| match i {
        0 => -1.0,
        i if i == n => 1.0,
        i => tan((2.0 * i as f64 / n as f64 - 1.0) * 0.25 * PI),
    };
    DVec3::new(axis(i), axis(j), axis(k)).normalize()
}

/// The points with whole coordinates on the surface of that cube.
pub(super) fn lattice(n: usize) -> impl Iterator<Item = [usize; 3]> {
    let all = (0..=n).flat_map(move |i| (0..=n).flat_map(move |j| (0..=n).map(move |k| [i, j, k])));
    all.filter(move |p| p.iter().any(|&i| i == 0 || i == n))
}

/// Bounds of the radii: those of the points of a lattice, widened by what a second derivative can do between them, which is h^2/2 of
/// it at the angle h from a place where the first vanishes.
pub(super) fn radii(series: &Series, bounds: &Bounds) -> (f64, f64) {
    let mean = 0.5 * (bounds.low + bounds.high);
    // No cell has a half diagonal over h = sqrt(2) pi/(4 n).
    let slack = |n: usize| {
        let h = 0.25 * PI * 2f64.sqrt() / n as f64;
        0.5 * h * h * bounds.second
    };
    let n = (4..FINEST).step_by(4).find(|&n| slack(n) <= LOOSENESS * mean).unwrap_or(FINEST);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for point in lattice(n) {
        let value = series.value(direction(point, n));
        (low, high) = (low.min(value), high.max(value));
    }
    ((low - slack(n)).max(bounds.low), (high + slack(n)).min(bounds.high))
}

/// Cells of the meshes along an edge of the cube.
const CELLS: usize = 24;
/// Parts of an edge between samples of a triangle.
const PARTS: usize = 8;

/// Corners of triangles inside and outside of a surface, in its own coordinates.
pub(super) struct Shells {
    /// No point of these is outside; empty where none could be found.
    pub(super) inner: Vec<[DVec3; 3]>,
    /// No point of these is inside.
    pub(super) outer: Vec<[DVec3; 3]>,
    /// No point of `outer` is farther from the centre than so many times the radius of the surface in its direction.
    pub(super) reach: f64,
}

impl Shells {
    /// The shells of `star`, farther from it by the share `margin` than they need be.
    pub(super) fn new(star: &Star, margin: f64) -> Shells {
        let points: Vec<[usize; 3]> = lattice(CELLS).collect();
        let number = |p: [usize; 3]| points.binary_search(&p).expect("a point of the lattice");
        let corners: Vec<DVec3> =
            points.iter().map(|&p| direction(p, CELLS)).map(|n| star.series.value(n) * n).collect();
        let triangles: Vec<[usize; 3]> = triangles().map(|t| t.map(number)).collect();
        let mut factors = vec![(f64::INFINITY, 0f64); corners.len()];
        for triangle in &triangles {
            let (low, high) = quotients(star, &triangle.map(|i| corners[i]));
            for &i in triangle {
                factors[i] = (factors[i].0.min(low), factors[i].1.max(high));
            }
        }
        let moved = |factor: &dyn Fn(usize) -> f64| -> Vec<[DVec3; 3]> {
            triangles.iter().map(|t| t.map(|i| factor(i) * corners[i])).collect()
        };
        let is_inside = factors.iter().all(|f| f.0 > 0.0);
        let inner = if is_inside { moved(&|i| factors[i].0 * (1.0 - margin)) } else { Vec::new() };
        // Between corners with factors up to the greatest, q is at least the least.
        let (least, most) = factors.iter().fold((f64::INFINITY, 0f64), |(l, h), f| (l.min(f.0), h.max(f.1)));
        let reach = if least > 0.0 { most * (1.0 + margin) / least * (1.0 + margin) } else { f64::INFINITY };
        Shells { inner, outer: moved(&|i| factors[i].1 * (1.0 + margin)), reach }
    }
}

/// Two triangles for each cell of the faces of the cube, their fronts outward.
fn triangles() -> impl Iterator<Item = [[usize; 3]; 3]> {
    let cells = (0..CELLS).flat_map(|u| (0..CELLS).map(move |v| (u, v)));
    let faces = (0..3).flat_map(|axis| [(axis, 0), (axis, CELLS)]);
    faces.flat_map(move |(axis, end)| {
        cells.clone().flat_map(move |(u, v)| {
            let corner = |du: usize, dv: usize| {
                let mut at = [end; 3];
                (at[(axis + 1) % 3], at[(axis + 2) % 3]) = (u + du, v + dv);
                at
            };
            let (first, third) = if end == 0 { (corner(0, 1), corner(1, 0)) } else { (corner(1, 0), corner(0, 1)) };
            [[corner(0, 0), first, corner(1, 1)], [corner(0, 0), corner(1, 1), third]]
        })
    })
}

/// Bounds of q over a triangle with its corners on the surface.
fn quotients(star: &Star, corners: &[DVec3; 3]) -> (f64, f64) {
    let [a, b, c] = *corners;
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    let plane = (b - a).cross(c - a).normalize_or_zero().dot(a).abs();
    let nearest = plane.max(a.length().min(b.length()).min(c.length()) - longest);
    let Bounds { first, second, .. } = star.bounds;
    let bend = (second + 3.0 * first + 2.0 * star.radii.1) / (nearest * nearest * nearest);
    let edge = longest / PARTS as f64;
    let slack = bend * edge * edge / 6.0;
    let (mut low, mut high) = (f64::INFINITY, 0f64);
    for i in 0..=PARTS {
        for j in 0..=PARTS - i {
            let [u, v] = [i, j].map(|x| x as f64 / PARTS as f64);
            let y = a + u * (b - a) + v * (c - a);
            let length = y.length();
            let q = star.series.value(y / length) / length;
            (low, high) = (low.min(q), high.max(q));
        }
    }
    (low - slack, high + slack)
}
