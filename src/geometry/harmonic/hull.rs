//! Planes that a whole surface lies under: its support function h(n) = max (n,x), never less than it is.
//!
//! h is convex and grows in proportion to n. On the face of a cube where n = s (1, u, v), between lines u_0 <= u <= u_1 and v_0 <= v <= v_1 of a square
//! lattice, n is s times the sum of w_ij (1, u_i, v_j) with the weights of bilinear interpolation, which are not negative; so
//!
//! ```text
//! h(n) <= s sum w_ij h((1, u_i, v_j))
//! ```

use crate::math::{DMat3, DVec3};
use rayon::prelude::*;
use std::collections::HashSet;

/// Cells of the lattice along an edge of the cube: h is too great by some thousandth of the radius.
const CELLS: usize = 32;
/// Lines of a face.
const LINES: usize = CELLS + 1;
/// Corners that are looked at together, or passed over.
const TOGETHER: usize = 32;
/// What is added for rounding, in units of |n| times the greatest distance.
const ROUNDING: f64 = 1e-12;
/// What the square of a radius is widened by for the rounding of transforms and products.
const WIDENED: f64 = 1.0 + 1e-9;

/// The support function of a surface, from above.
#[derive(Debug)]
pub(super) struct Hull {
    /// Of the points of the lattice, face by face, u by u.
    support: Vec<f64>,
}

/// Corners that stand together, and a ball around them.
struct Cluster<'a> {
    corners: &'a [DVec3],
    middle: DVec3,
    radius: f64,
}

impl Hull {
    /// That of what is within the `triangles`.
    pub(super) fn new(triangles: &[[DVec3; 3]]) -> Hull {
        let mut known = HashSet::new();
        let mut corners: Vec<DVec3> = triangles.iter().flatten().copied().collect();
        corners.retain(|c| known.insert(c.to_array().map(f64::to_bits)));
        let greatest = corners.iter().map(|c| c.length()).fold(0.0, f64::max);
        let clusters: Vec<Cluster> = corners.chunks(TOGETHER).map(Cluster::new).collect();
        let of = |k: usize| {
            let n = point(k / (LINES * LINES), [k / LINES % LINES, k % LINES]);
            highest(&clusters, n) + ROUNDING * n.length() * greatest
        };
        Hull { support: (0..6 * LINES * LINES).into_par_iter().map(of).collect() }
    }

    /// Memory \[bytes\].
    pub(super) fn bytes(&self) -> u64 {
        size_of_val(&self.support[..]) as u64
    }

    /// True where a plane certainly stands between the surface, which `to_world` places, and all ways from `apex` to a box, of which the middle and half the
    /// extents are given, both seen from the centre. No plane nearer to the centre than the first of these `radii`
    /// does, all farther than the second do: that tells most, and much sooner.
    pub(super) fn is_apart(
        &self,
        (to_world, radii): (&DMat3, (f64, f64)),
        apex: DVec3,
        (middle, half): (DVec3, DVec3),
    ) -> bool {
        let way = middle - apex;
        let length2 = way.length_squared().max(f64::MIN_POSITIVE);
        // Across the nearest point of the way to the middle.
        let share = (-apex.dot(way) / length2).clamp(0.0, 1.0);
        let n = apex + share * way;
        let beyond = |n: DVec3| [n.dot(apex), n.dot(middle) - n.abs().dot(half)];
        // Turned until apex and box are as far beyond it, where the box is nearer.
        let [of_apex, of_box] = beyond(n);
        let gained = (length2 - way.abs().dot(half)).max(f64::MIN_POSITIVE);
        let n = n + ((of_apex - of_box) / gained).clamp(0.0, 1.0) * way;
        let [of_apex, of_box] = beyond(n);
        let height = of_apex.min(of_box);
        let is_above = |radius: f64| height * height > radius * radius * WIDENED * n.length_squared();
        height > 0.0 && is_above(radii.0) && (is_above(radii.1) || height > self.support(to_world.transpose() * n))
    }

    /// No point of the surface has a greater product with `n`.
    pub(super) fn support(&self, n: DVec3) -> f64 {
        let size = n.abs().to_array();
        let axis = if size[0] >= size[1] && size[0] >= size[2] { 0 } else { usize::from(size[1] < size[2]) + 1 };
        let line = |k: usize| {
            let place = (0.5 + 0.5 * n[(axis + k) % 3] / size[axis]) * CELLS as f64;
            let first = (place as usize).min(CELLS - 1);
            (first, place - first as f64)
        };
        let [(i, u), (j, v)] = [line(1), line(2)];
        let first = ((2 * axis + usize::from(n[axis] > 0.0)) * LINES + i) * LINES + j;
        let along = |at: usize| self.support[at] * (1.0 - v) + self.support[at + 1] * v;
        size[axis] * (along(first) * (1.0 - u) + along(first + LINES) * u)
    }
}

/// The point number (u, v) of the `face` number 2 axis + (1 where the axis counts up).
fn point(face: usize, [u, v]: [usize; 2]) -> DVec3 {
    let axis = face / 2;
    let place = |i: usize| 2.0 * i as f64 / CELLS as f64 - 1.0;
    let mut n = DVec3::ZERO;
    n[axis] = if face % 2 == 1 { 1.0 } else { -1.0 };
    (n[(axis + 1) % 3], n[(axis + 2) % 3]) = (place(u), place(v));
    n
}

/// The greatest product of a corner with `n`.
fn highest(clusters: &[Cluster], n: DVec3) -> f64 {
    let length = n.length();
    let start = clusters.iter().map(|c| n.dot(c.middle) - length * c.radius).fold(f64::NEG_INFINITY, f64::max);
    clusters.iter().fold(start, |highest, cluster| match n.dot(cluster.middle) + length * cluster.radius > highest {
        true => cluster.corners.iter().map(|&c| n.dot(c)).fold(highest, f64::max),
        false => highest,
    })
}

impl<'a> Cluster<'a> {
    fn new(corners: &'a [DVec3]) -> Self {
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let radius = corners.iter().map(|c| c.distance(middle)).fold(0.0, f64::max);
        Cluster { corners, middle, radius }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Domain, Stream, sphere};

    #[test]
    fn no_corner_is_above_a_supporting_plane_and_one_is_hardly_below() {
        let mut rng = Stream::new(5, Domain::Receiver, "hull").generator(0);
        let mut corner = || DVec3::new(1.0, 0.6, 1.4) * sphere(rng.uniform2()) * (1.0 + 0.2 * rng.uniform());
        let triangles: Vec<[DVec3; 3]> = (0..2000).map(|_| [corner(), corner(), corner()]).collect();
        let hull = Hull::new(&triangles);
        for _ in 0..2000 {
            let n = sphere(rng.uniform2()) * (0.1 + rng.uniform());
            let exact = triangles.iter().flatten().map(|&c| n.dot(c)).fold(0.0, f64::max);
            let (support, length) = (hull.support(n), n.length());
            // Between lines 1/16 apart: of corners up to 1.7 away, and some 0.1 apart.
            assert!(support >= exact && support < exact + 0.01 * length, "{n}: {support}, {exact}");
        }
        for axis in [DVec3::X, -DVec3::Y, DVec3::Z, DVec3::ONE, DVec3::new(-1.0, 1.0, 0.0)] {
            let exact = triangles.iter().flatten().map(|&c| axis.dot(c)).fold(0.0, f64::max);
            assert!((hull.support(axis) - exact).abs() < 1e-11, "{axis}");
        }
    }

    #[test]
    fn ways_beyond_a_plane_pass_a_ball() {
        let mut rng = Stream::new(5, Domain::Receiver, "apart").generator(0);
        let triangles: Vec<[DVec3; 3]> = (0..3000).map(|_| [(); 3].map(|()| sphere(rng.uniform2()))).collect();
        let hull = Hull::new(&triangles);
        let (mut apart, mut clear) = (0, 0);
        for _ in 0..4000 {
            let mut place = || sphere(rng.uniform2()) * (1.1 + 2.0 * rng.uniform());
            let (apex, middle) = (place(), place());
            let half = 0.2 * DVec3::new(rng.uniform(), rng.uniform(), rng.uniform());
            let corner =
                |k: u32| middle + half * DVec3::from([0, 1, 2].map(|axis| f64::from(k >> axis & 1) * 2.0 - 1.0));
            let nearest = |to: DVec3| {
                let way = to - apex;
                (apex + way * (-apex.dot(way) / way.length_squared()).clamp(0.0, 1.0)).length()
            };
            let nearest = (0..8).map(|k| nearest(corner(k))).fold(f64::INFINITY, f64::min);
            let [is_apart, by_support] = [(0.9, 1.0), (0.0, f64::INFINITY)]
                .map(|radii| hull.is_apart((&DMat3::IDENTITY, radii), apex, (middle, half)));
            // Of corners some hundredths apart.
            assert!(!(is_apart || by_support) || nearest > 0.99, "{apex} {middle} {half}: {nearest}");
            assert!(is_apart || !by_support, "{apex} {middle} {half}");
            (apart, clear) = (apart + usize::from(by_support), clear + usize::from(nearest > 1.0));
        }
        // One plane through both ends does not part all that could be.
        assert!(apart <= clear && 10 * apart > 8 * clear, "{apart} of {clear}");
    }
}
