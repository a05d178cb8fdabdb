//! Finite laws that depend on both directions and are evaluated one pair at a time.

use super::phong::Phong;
use super::tabulated::Tabulated;
use super::{PEAK, Scattered};
use crate::math::DVec3;
use crate::photometry::Colour;
use crate::random::Generator;

/// A law that is neither Lambert's nor metallic-roughness.
#[derive(Clone, Debug)]
pub enum Directional {
    /// Modified Phong.
    Phong(Phong),
    /// Measured pair by pair.
    Tabulated(Tabulated),
}

impl Directional {
    pub(super) fn evaluate(&self, normal: DVec3, w_in: DVec3, w_out: DVec3) -> Colour {
        match self {
            Directional::Phong(law) => law.evaluate(normal, w_in, w_out),
            Directional::Tabulated(law) => law.evaluate(normal, w_in, w_out),
        }
    }

    pub(super) fn sample(&self, normal: DVec3, w_in: DVec3, rng: &mut Generator) -> Option<Scattered> {
        match self {
            Directional::Phong(law) => law.sample(normal, w_in, rng),
            Directional::Tabulated(law) => law.sample(normal, w_in, rng),
        }
    }

    pub(super) fn pdf(&self, normal: DVec3, w_in: DVec3, w_out: DVec3) -> f64 {
        match self {
            Directional::Phong(law) => law.pdf(normal, w_in, w_out),
            Directional::Tabulated(law) => law.pdf(normal, w_in, w_out),
        }
    }

    pub(super) fn albedo(&self, cosine: f64) -> Colour {
        match self {
            Directional::Phong(law) => law.albedo(cosine),
            Directional::Tabulated(law) => law.albedo(cosine),
        }
    }

    pub(super) fn is_black(&self) -> bool {
        match self {
            Directional::Phong(law) => law.is_black(),
            Directional::Tabulated(law) => law.is_black(),
        }
    }

    pub(super) fn grey(self) -> Self {
        match self {
            Directional::Phong(law) => Directional::Phong(law.grey()),
            Directional::Tabulated(law) => Directional::Tabulated(law.grey()),
        }
    }

    /// The greatest pi f.
    fn summit(&self) -> f64 {
        match self {
            Directional::Phong(law) => law.summit(),
            Directional::Tabulated(law) => law.summit(),
        }
    }

    pub(super) fn is_peaked(&self) -> bool {
        self.summit() > PEAK
    }

    /// alpha of the microfacets with this summit, 1/(4 alpha^2).
    pub(super) fn lobe_width(&self) -> f64 {
        (0.25 / self.summit().max(0.25)).sqrt()
    }
}

/// f of 16 pairs of unit vectors away from the surface; arrays by axis or channel, and lane \[1/sr\]. Plain code in f64, so the
/// bits do not depend on the instructions of the caller.
#[inline(never)]
pub(super) fn one_by_one<const C: usize>(
    law: &Directional,
    normal: &[[f32; 16]; 3],
    one: &[[f32; 16]; 3],
    other: &[[f32; 16]; 3],
) -> [[f32; 16]; C] {
    let at = |all: &[[f32; 16]; 3], lane: usize| DVec3::from(all.map(|axis| f64::from(axis[lane])));
    let mut values = [[0.0; 16]; C];
    for lane in 0..16 {
        let f = law.evaluate(at(normal, lane), -at(one, lane), at(other, lane));
        for (values, f) in values.iter_mut().zip(f.0) {
            values[lane] = f as f32;
        }
    }
    values
}
