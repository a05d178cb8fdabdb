//! Modified Phong law (Lafortune and Willems 1994): a lobe about the mirrored direction over a Lambert part.
//!
//! ```text
//! f = rho_d/pi + rho_s (n + 2)/(2 pi) cos^n(alpha),      alpha the angle between w_out and w_in mirrored      [1/sr]
//! ```
//!
//! It is reciprocal. The lobe alone would reflect rho_s at normal incidence, and less where the surface cuts it off: the share
//! A(mu) is a table of the integral. With rho_d + rho_s at most 1 no light is made.

use super::{Scattered, above};
use crate::math::{DVec3, PI, acos, pow, to_world};
use crate::photometry::Colour;
use crate::random::{Generator, around_z, cosine_hemisphere};

/// Intervals of the table of A, at mu = t^4.
const INTERVALS: usize = 128;
/// Points of the midpoint rule over the lobe.
const POINTS: usize = 512;

/// A Phong material.
#[derive(Clone, Debug)]
pub struct Phong {
    diffuse: Colour,
    specular: Colour,
    exponent: f64,
    /// A at the nodes.
    shares: Vec<f64>,
}

impl Phong {
    /// With the reflectances of the Lambert part and of the lobe, together at most 1, and the exponent of the lobe, 0 or more.
    pub(super) fn new(diffuse: Colour, specular: Colour, exponent: f64) -> Self {
        let node = |i: usize| {
            let t = i as f64 / INTERVALS as f64;
            share(exponent, t * t * t * t)
        };
        Phong { diffuse, specular, exponent, shares: (0..=INTERVALS).map(node).collect() }
    }

    pub(super) fn evaluate(&self, normal: DVec3, w_in: DVec3, w_out: DVec3) -> Colour {
        if !above(normal, w_in, w_out) {
            return Colour::BLACK;
        }
        let lobe = (self.exponent + 2.0) / (2.0 * PI) * pow(off_mirror(normal, w_in, w_out), self.exponent);
        self.diffuse / PI + self.specular * lobe
    }

    pub(super) fn pdf(&self, normal: DVec3, w_in: DVec3, w_out: DVec3) -> f64 {
        if !above(normal, w_in, w_out) {
            return 0.0;
        }
        let lobe = (self.exponent + 1.0) / (2.0 * PI) * pow(off_mirror(normal, w_in, w_out), self.exponent);
        let specular = self.specular_share(-w_in.dot(normal));
        specular * lobe + (1.0 - specular) * w_out.dot(normal) / PI
    }

    /// One uniform to choose the part, two for the direction; `None` where the lobe is cut off.
    pub(super) fn sample(&self, normal: DVec3, w_in: DVec3, rng: &mut Generator) -> Option<Scattered> {
        let mu = -w_in.dot(normal);
        let lobe = rng.uniform() < self.specular_share(mu);
        let u = rng.uniform2();
        let direction = if lobe {
            let mirrored = (w_in + 2.0 * mu * normal).normalize();
            to_world(mirrored, around_z(pow(1.0 - u.x, 1.0 / (self.exponent + 1.0)), u.y)).normalize()
        } else {
            to_world(normal, cosine_hemisphere(u))
        };
        let density = self.pdf(normal, w_in, direction);
        let factor = self.evaluate(normal, w_in, direction) * (direction.dot(normal) / density);
        (density > 0.0).then_some(Scattered { direction, factor, delta: false, transmitted: false })
    }

    /// Directional albedo.
    pub(super) fn albedo(&self, mu: f64) -> Colour {
        self.diffuse + self.specular * self.lobe_albedo(mu)
    }

    fn lobe_albedo(&self, mu: f64) -> f64 {
        let t = mu.clamp(0.0, 1.0).sqrt().sqrt() * INTERVALS as f64;
        let i = (t as usize).min(INTERVALS - 1);
        self.shares[i] + (self.shares[i + 1] - self.shares[i]) * (t - i as f64)
    }

    /// Probability that `sample` chooses the lobe: its share of the luminous albedo.
    fn specular_share(&self, mu: f64) -> f64 {
        let lobe = self.specular.luminance() * self.lobe_albedo(mu);
        let all = lobe + self.diffuse.luminance();
        if all > 0.0 { lobe / all } else { 0.0 }
    }

    /// pi f in the mirrored direction.
    pub(super) fn summit(&self) -> f64 {
        self.diffuse.luminance() + self.specular.luminance() * 0.5 * (self.exponent + 2.0)
    }

    pub(super) fn is_black(&self) -> bool {
        self.diffuse.is_black() && self.specular.is_black()
    }

    pub(super) fn grey(self) -> Self {
        let (diffuse, specular) = (Colour::grey(self.diffuse.luminance()), Colour::grey(self.specular.luminance()));
        Phong { diffuse, specular, ..self }
    }
}

/// Cosine between `w_out` and `w_in` mirrored, 0 where it is negative.
fn off_mirror(normal: DVec3, w_in: DVec3, w_out: DVec3) -> f64 {
    (w_in.dot(w_out) - 2.0 * (w_in.dot(normal) * w_out.dot(normal))).clamp(0.0, 1.0)
}

/// A(mu): the mean over a lobe drawn with density (n + 1)/(2 pi) c^n of (n + 2)/(n + 1) (N, w)_+. Over the azimuth it is known.
fn share(exponent: f64, mu: f64) -> f64 {
    let across = (1.0 - mu * mu).sqrt();
    let mean = |k: usize| {
        let c = pow((k as f64 + 0.5) / POINTS as f64, 1.0 / (exponent + 1.0));
        let (a, b) = (c * mu, (1.0 - c * c).sqrt() * across);
        if a >= b {
            return a;
        }
        let end = acos(-a / b);
        (a * end + (b * b - a * a).sqrt()) / PI
    };
    let share = (exponent + 2.0) / (exponent + 1.0) * (0..POINTS).map(mean).sum::<f64>() / POINTS as f64;
    // 1 at normal incidence, but for what the rule makes of it.
    share.min(1.0)
}
