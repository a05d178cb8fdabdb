//! Analytic sphere, exact in f64.

use super::{Hit, Ray, hit};
use crate::math::{DVec3, Vec3};

/// A sphere; the front is outside, or inside where `inward`.
#[derive(Clone, Debug)]
pub struct Sphere {
    /// Centre \[m\].
    pub center: DVec3,
    /// Radius \[m\].
    pub radius: f64,
    /// True when the inside is the front.
    pub inward: bool,
}

impl Sphere {
    pub(super) fn hit(&self, ray: &Ray) -> Option<Hit> {
        let from_center = ray.origin - self.center;
        let b = from_center.dot(ray.direction);
        // Distance of the line from the centre first: no cancellation for far origins.
        let across = from_center - b * ray.direction;
        let discriminant = self.radius * self.radius - across.length_squared();
        if discriminant < 0.0 {
            return None;
        }
        let half_chord = discriminant.sqrt();
        let distance = [-b - half_chord, -b + half_chord].into_iter().find(|&t| t > 0.0)?;
        let outward = (from_center + distance * ray.direction).normalize();
        let normal = if self.inward { -outward } else { outward };
        Some(hit(ray, distance, self.center + self.radius * outward, normal))
    }

    /// True inside.
    pub(super) fn contains(&self, p: DVec3) -> bool {
        (p - self.center).length_squared() < self.radius * self.radius
    }

    /// True when the segment crosses the surface: some of it, but not all of it, lies inside, or both ends lie
    /// outside and the middle does not.
    pub(super) fn blocks(&self, a: Vec3, b: Vec3) -> bool {
        let (a, b) = (a.as_dvec3() - self.center, b.as_dvec3() - self.center);
        let r2 = self.radius * self.radius;
        let inside = |p: DVec3| p.length_squared() < r2;
        if inside(a) || inside(b) {
            return inside(a) != inside(b);
        }
        let d = b - a;
        let t = (-a.dot(d) / d.length_squared()).clamp(0.0, 1.0);
        inside(a + t * d)
    }
}
