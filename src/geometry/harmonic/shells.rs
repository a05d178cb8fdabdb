//! What lies certainly inside a surface, and what certainly outside.

use super::{Bounds, Series};
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
