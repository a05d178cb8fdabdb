//! Directions uniform in the solid angle of a triangle: direct light stays bounded at contact with an emitter.

use crate::math::{DVec2, DVec3, PI, atan2, sin_cos};

/// A triangle as seen from a point.
pub struct SphericalTriangle {
    /// Unit directions to the corners.
    a: DVec3,
    b: DVec3,
    c: DVec3,
    /// Solid angle \[sr\].
    pub solid_angle: f64,
}

impl SphericalTriangle {
    /// The triangle with `corners` seen from `point`.
    pub fn new(corners: &[DVec3; 3], point: DVec3) -> Self {
        let [a, b, c] = corners.map(|p| (p - point).normalize_or_zero());
        // Van Oosterom and Strackee: accurate for small triangles, where sums of angles cancel.
        let volume = a.dot(b.cross(c)).abs();
        let solid_angle = 2.0 * atan2(volume, 1.0 + a.dot(b) + b.dot(c) + c.dot(a));
        SphericalTriangle { a, b, c, solid_angle }
    }

    /// The direction for a point of the unit square, uniform in solid angle (Arvo 1995, letters as there).
    pub fn sample(&self, random: DVec2) -> DVec3 {
        let (a, b, c) = (self.a, self.b, self.c);
        let alpha = angle_between(a.cross(b), a.cross(c));
        let beta = angle_between(b.cross(c), b.cross(a));
        let gamma = angle_between(c.cross(a), c.cross(b));
        let (sin_alpha, cos_alpha) = sin_cos(alpha);
        // The sub-triangle with the share random.x of the area ends on the edge from a to c.
        let (s, t) = sin_cos(random.x * (alpha + beta + gamma - PI) - alpha);
        let u = t - cos_alpha;
        let v = s + sin_alpha * a.dot(b);
        let denominator = (v * s + u * t) * sin_alpha;
        let numerator = (v * t - u * s) * cos_alpha - v;
        let q = if denominator == 0.0 { a.dot(c) } else { (numerator / denominator).clamp(-1.0, 1.0) };
        let end = along(a, c, q);
        along(b, end, 1.0 - random.y * (1.0 - end.dot(b)))
    }
}

/// The unit vector with cosine `z` to the unit vector `n`, turned from `n` towards `v`.
fn along(n: DVec3, v: DVec3, z: f64) -> DVec3 {
    z * n + ((1.0 - z) * (1.0 + z)).max(0.0).sqrt() * (v - v.dot(n) * n).normalize_or_zero()
}

/// Angle between two vectors of any length \[rad\].
fn angle_between(v: DVec3, w: DVec3) -> f64 {
    atan2(v.cross(w).length(), v.dot(w))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Domain, Stream};

    #[test]
    fn octant_has_its_solid_angle_and_centroid() {
        let triangle = SphericalTriangle::new(&[2.0 * DVec3::X, 3.0 * DVec3::Y, DVec3::Z], DVec3::ZERO);
        assert!((triangle.solid_angle - PI / 2.0).abs() < 1e-14);
        let mut rng = Stream::new(1, Domain::Receiver, "octant").generator(0);
        let n = 20000;
        let sum: DVec3 = (0..n).map(|_| triangle.sample(rng.uniform2())).sum();
        // The mean direction over an octant is 1/2 along each axis, with a standard deviation of 0.29 a sample.
        let error = (sum / f64::from(n) - DVec3::splat(0.5)).abs().max_element();
        assert!(error < 5.0 * 0.29 / f64::from(n).sqrt(), "{error}");
    }
}
