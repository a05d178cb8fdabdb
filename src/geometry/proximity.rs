//! Whether any surface is so near a point that a geometric factor between the two can exceed a bound.
//!
//! A surface point at distance d, at height h over the tangent plane of the receiver, on a triangle whose plane passes
//! at distance p from the receiver, has G = cos cos'/d^2 = h p/d^4. The answer is conservative: "no" is a proof for
//! the whole surface, "yes" may be a false alarm. Visibility is not looked at. The distance of the nearest triangle, for
//! comparing surfaces, is found in the same way.

use super::{Geometry, Harmonic, Mesh, Plane, Sphere};
use crate::math::{DVec3, Vec3};

/// Blocks of triangles that are looked at before the answer is yes: a path from the receiver, which ends at its first point
/// where there was nothing to find, costs less than to look at more.
const PATIENCE: usize = 8;
/// What rounding makes of zero, relative to the size of what is compared.
const NIL: f64 = 1e-9;

impl Geometry {
    /// True unless no surface point above the tangent plane of `position` with the unit vector `normal` can have a
    /// geometric factor above `bound` \[1/m2\].
    pub fn may_exceed(&self, position: DVec3, normal: DVec3, bound: f64) -> bool {
        // The height above which a surface counts: nearer ones are the receiver's own, or closer than it can see.
        let floor = self.lift(position, normal).distance(position);
        self.planes.iter().any(|p| p.may_exceed(position, normal, bound))
            || self.spheres.iter().any(|s| s.may_exceed(position, normal, bound))
            || self.harmonics.iter().any(|h| h.may_exceed(position, normal, bound))
            || self.mesh.may_exceed(position, normal, bound, floor)
            || self.veils.as_ref().is_some_and(|v| v.may_exceed(position, normal, bound, floor))
    }

    /// Distance of the nearest triangle from `point`, or `limit` where none is nearer \[m\].
    pub fn distance(&self, point: DVec3, limit: f64) -> f64 {
        self.mesh.distance(point, limit)
    }

    /// Area of one side of a primitive \[m2\]; infinite for a plane.
    pub fn area(&self, primitive: u32) -> f64 {
        let (primitive, triangles) = (primitive as usize, self.triangles() as usize);
        if primitive < triangles {
            let [a, b, c] = self.triangle(primitive as u32);
            return 0.5 * (b - a).cross(c - a).length();
        }
        let other = primitive - triangles;
        if let Some(sphere) = self.spheres.get(other) {
            return 4.0 * crate::math::PI * sphere.radius * sphere.radius;
        }
        let harmonic = other.checked_sub(self.spheres.len() + self.planes.len()).and_then(|i| self.harmonics.get(i));
        harmonic.map_or(f64::INFINITY, Harmonic::area)
    }
}

impl Plane {
    fn may_exceed(&self, position: DVec3, normal: DVec3, bound: f64) -> bool {
        let height = self.height(position);
        // A parallel plane through the receiver or behind it lies nowhere above its tangent plane.
        let parallel = self.normal.cross(normal).length_squared() < NIL * NIL;
        let behind = height * self.normal.dot(normal) >= -NIL * position.abs().max_element().max(1.0);
        !(parallel && behind) && height * height * bound < 1.0
    }
}

impl Sphere {
    fn may_exceed(&self, position: DVec3, normal: DVec3, bound: f64) -> bool {
        let to_center = self.center - position;
        let distance = to_center.length() - self.radius;
        if distance.abs() <= NIL * (self.radius + to_center.length()) {
            if normal.dot(to_center) <= 0.0 {
                return false;
            }
            // Seen along the radius the factor to every other point of the inside is the same; for a receiver that is
            // tilted it grows without bound towards the rim of what lies above.
            let tilted = normal.cross(to_center).length() > NIL * self.radius;
            return tilted || 4.0 * self.radius * self.radius * bound < 1.0;
        }
        normal.dot(to_center) + self.radius > 0.0 && distance * distance * bound < 1.0
    }
}

impl Mesh {
    fn may_exceed(&self, position: DVec3, normal: DVec3, bound: f64, floor: f64) -> bool {
        let reach = 1.0 / bound.sqrt();
        let (low, high) = self.bounds();
        if self.is_empty() || position.cmplt(low - reach).any() || position.cmpgt(high + reach).any() {
            return false;
        }
        let (low, high) = half_ball(position + 0.5 * floor * normal, normal, reach + floor);
        let exceeds = |block: u32| {
            let corners =
                self.triangles[self.bvh.block(block)].iter().map(|t| t.corners.map(|c| c.as_dvec3() - position));
            corners.into_iter().any(|c| greatest_factor(&c, normal, floor) > bound)
        };
        let mut blocks = self.bvh.blocks_in(low, high);
        blocks.by_ref().take(PATIENCE).any(exceeds) || blocks.next().is_some()
    }

    fn distance(&self, point: DVec3, limit: f64) -> f64 {
        // A box a little too large for the ball, so that rounding to f32 loses nothing of it.
        let reach = limit * (1.0 + 1e-6) + 1e-6 * point.abs().max_element();
        let blocks = self.bvh.blocks_in((point - reach).as_vec3(), (point + reach).as_vec3());
        let triangles = blocks.flat_map(|block| &self.triangles[self.bvh.block(block)]);
        let distances = triangles.map(|triangle| {
            let [a, b, c] = triangle.corners.map(|corner| corner.as_dvec3() - point);
            nearest_on_triangle(a, b, c).length()
        });
        distances.fold(limit, f64::min)
    }
}

/// A box around the points within `reach` of `position` that lie above the plane through it with `normal`. Half the height
/// above which surfaces count is room enough for rounding to f32, and the surface on which a receiver stands, however
/// finely divided, lies outside the box where it runs along two axes.
fn half_ball(position: DVec3, normal: DVec3, reach: f64) -> (Vec3, Vec3) {
    // Along an axis at the angle a to the normal the half ball extends 1 forwards and sin a backwards.
    let backwards = (DVec3::ONE - normal * normal).max(DVec3::ZERO).map(f64::sqrt);
    let extent = |n: DVec3| DVec3::select(n.cmpgt(DVec3::ZERO), backwards, DVec3::ONE) * (reach * (1.0 + 1e-6));
    ((position - extent(normal)).as_vec3(), (position + extent(-normal)).as_vec3())
}

/// A number that no geometric factor between the origin with `normal` and the triangle exceeds \[1/m2\].
fn greatest_factor(corners: &[DVec3; 3], normal: DVec3, floor: f64) -> f64 {
    let [a, b, c] = *corners;
    let height = normal.dot(a).max(normal.dot(b)).max(normal.dot(c));
    if height <= floor {
        return 0.0;
    }
    let plane = (b - a).cross(c - a).normalize_or_zero().dot(a).abs();
    if plane == 0.0 {
        return 0.0;
    }
    // G = h p/d^4 with h <= d: it falls with the distance, so the nearest point decides.
    let d2 = nearest_on_triangle(a, b, c).length_squared();
    (height.min(d2.sqrt()) / d2) * (plane / d2)
}

/// The point of the triangle nearest to the origin (Ericson, Real-Time Collision Detection, 5.1.5).
fn nearest_on_triangle(a: DVec3, b: DVec3, c: DVec3) -> DVec3 {
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (-ab.dot(a), -ac.dot(a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let (d3, d4) = (-ab.dot(b), -ac.dot(b));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let (d5, d6) = (-ab.dot(c), -ac.dot(c));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let sum = va + vb + vc;
    if sum > 0.0 { a + ab * (vb / sum) + ac * (vc / sum) } else { a }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Ray;
    use crate::math::Vec3;
    use crate::random::{Domain, Stream, cosine_hemisphere, sphere};

    /// Triangles strewn in a box, and where receivers may stand.
    fn strewn(seed: u64) -> (Geometry, crate::random::Generator) {
        let mut rng = Stream::new(seed, Domain::Receiver, "strewn").generator(0);
        let mut point = || Vec3::from_array(std::array::from_fn(|_| rng.uniform() as f32));
        let triangles: Vec<[Vec3; 3]> = (0..12)
            .map(|_| {
                let at = point();
                [at, at + 0.3 * (point() - 0.5), at + 0.3 * (point() - 0.5)]
            })
            .collect();
        (Geometry::new(Mesh::new(&triangles), Vec::new(), Vec::new()), rng)
    }

    #[test]
    fn no_ray_finds_a_factor_that_was_denied() {
        let (mut denied, mut allowed) = (0, 0);
        for seed in 0..300 {
            let (geometry, mut rng) = strewn(seed);
            let position = DVec3::new(rng.uniform(), rng.uniform(), rng.uniform());
            let normal = sphere(rng.uniform2());
            let found = (0..2000).filter_map(|_| {
                let direction = crate::math::to_world(normal, cosine_hemisphere(rng.uniform2()));
                let hit = geometry.closest_hit(&Ray { origin: position, direction })?;
                Some(direction.dot(normal) * -direction.dot(hit.normal) / (hit.distance * hit.distance))
            });
            let greatest = found.fold(0.0, f64::max);
            for bound in [0.3, 1.0, 3.0, 10.0, 30.0, 100.0] {
                let answer = geometry.may_exceed(position, normal, bound);
                assert!(answer || greatest <= bound, "seed {seed}: {greatest} although {bound} was called enough");
                if answer { allowed += 1 } else { denied += 1 }
            }
        }
        assert!(denied > 300 && allowed > 300, "{denied} denied, {allowed} allowed: the test must see both");
    }

    #[test]
    fn planes_and_spheres_follow_their_closed_forms() {
        let floor = Plane::new(DVec3::ZERO, DVec3::Y);
        let at = |h: f64| DVec3::new(0.3, h, 0.1);
        // A lux-meter on the floor looking up sees nothing of it; one that looks down from 0.5 m sees up to 4.
        assert!(!floor.may_exceed(at(0.0), DVec3::Y, 1e-6));
        assert!(!floor.may_exceed(at(0.5), DVec3::Y, 1e-6));
        assert!(floor.may_exceed(at(0.5), -DVec3::Y, 3.9) && !floor.may_exceed(at(0.5), -DVec3::Y, 4.1));
        assert!(floor.may_exceed(at(0.5), DVec3::X, 3.9) && !floor.may_exceed(at(0.5), DVec3::X, 4.1));
        let ball = Sphere { center: DVec3::ZERO, radius: 2.0, inward: true };
        let inside = 1.0 / 16.0;
        assert!(ball.may_exceed(2.0 * DVec3::X, -DVec3::X, 0.99 * inside));
        assert!(!ball.may_exceed(2.0 * DVec3::X, -DVec3::X, 1.01 * inside));
        assert!(!ball.may_exceed(2.0 * DVec3::X, DVec3::X, 1e-6));
        // A tilted receiver on the sphere: cos/(2 R d), without bound towards its rim.
        assert!(ball.may_exceed(2.0 * DVec3::X, DVec3::new(-0.8, 0.6, 0.0), 1e6));
        assert!(ball.may_exceed(3.0 * DVec3::X, -DVec3::X, 0.9) && !ball.may_exceed(3.0 * DVec3::X, DVec3::X, 1e-6));
    }
}
