//! Infinite plane, exact in f64: no truncation bias in analytic scenes.

use super::{Hit, Ray, hit};
use crate::math::{DVec3, Vec3};

/// Infinite plane; the front is the side of the normal.
#[derive(Clone, Debug)]
pub struct Plane {
    point: DVec3,
    pub(super) normal: DVec3,
}

impl Plane {
    /// The plane through `point` \[m\] with `normal`, of any length.
    pub fn new(point: DVec3, normal: DVec3) -> Self {
        Plane { point, normal: normal.normalize() }
    }

    /// Signed distance of `p`, positive in front \[m\].
    pub(super) fn height(&self, p: DVec3) -> f64 {
        self.normal.dot(p - self.point)
    }

    pub(super) fn hit(&self, ray: &Ray) -> Option<Hit> {
        let distance = -self.height(ray.origin) / self.normal.dot(ray.direction);
        // A parallel ray gives an infinite or undefined distance: no hit.
        if !(distance > 0.0 && distance.is_finite()) {
            return None;
        }
        let near = ray.origin + distance * ray.direction;
        let position = near - self.height(near) * self.normal;
        Some(hit(ray, distance, position, self.normal))
    }

    /// True when the segment crosses the plane.
    pub(super) fn blocks(&self, a: Vec3, b: Vec3) -> bool {
        let (a, b) = (self.height(a.as_dvec3()), self.height(b.as_dvec3()));
        (a < 0.0 && b > 0.0) || (a > 0.0 && b < 0.0)
    }
}
