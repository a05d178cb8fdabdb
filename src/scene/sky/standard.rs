//! The CIE standard general sky (CIE S 011, ISO 15469): one formula, fifteen sets of five numbers.
//!
//! ```text
//! L/Lz = f(chi) phi(Z)/(f(Zs) phi(0)),   phi(Z) = 1 + a exp(b/cos Z),   f(chi) = 1 + c (exp(d chi) - exp(d pi/2)) + e cos^2 chi
//! ```
//!
//! Z is the angle to the zenith, Zs that of the sun, chi the angle to the sun. phi, the gradation, is 1 at the horizon.

use crate::math::{DVec3, PI, acos, exp};

/// a and b of the six gradations.
const GRADATIONS: [[f64; 2]; 6] = [[4.0, -0.7], [1.1, -0.8], [0.0, -1.0], [-1.0, -0.55], [-1.0, -0.32], [-1.0, -0.15]];

/// c, d and e of the six indicatrices.
const INDICATRICES: [[f64; 3]; 6] =
    [[0.0, -1.0, 0.0], [2.0, -1.5, 0.15], [5.0, -2.5, 0.3], [10.0, -3.0, 0.45], [16.0, -3.0, 0.3], [24.0, -2.8, 0.15]];

/// Gradation and indicatrix of the fifteen types, counted from 1.
const TYPES: [(usize, usize); 15] = [
    (1, 1),
    (1, 2),
    (2, 1),
    (2, 2),
    (3, 1),
    (3, 2),
    (3, 3),
    (3, 4),
    (4, 2),
    (4, 3),
    (4, 4),
    (5, 4),
    (5, 5),
    (6, 5),
    (6, 6),
];

/// A sky of the standard with the sun at its place.
#[derive(Clone, Debug)]
pub(super) struct Standard {
    gradation: [f64; 2],
    indicatrix: [f64; 3],
    sun: DVec3,
    /// f(Zs) phi(0).
    at_zenith: f64,
}

impl Standard {
    /// Type `number`, 1 ..= 15; `sun` is the unit vector towards the sun, z up.
    pub fn new(number: u8, sun: DVec3) -> Standard {
        let (gradation, indicatrix) = TYPES[usize::from(number) - 1];
        let (gradation, indicatrix) = (GRADATIONS[gradation - 1], INDICATRICES[indicatrix - 1]);
        let mut standard = Standard { gradation, indicatrix, sun, at_zenith: 1.0 };
        standard.at_zenith = standard.relative(DVec3::Z);
        standard
    }

    /// Whether the sun matters.
    pub fn depends_on_azimuth(&self) -> bool {
        let [c, _, e] = self.indicatrix;
        c != 0.0 || e != 0.0
    }

    /// Luminance over that of the zenith in the direction of the unit vector `v`, v.z >= 0.
    pub fn relative(&self, v: DVec3) -> f64 {
        let ([a, b], [c, d, e]) = (self.gradation, self.indicatrix);
        let gradation = 1.0 + a * exp(b / v.z);
        if !self.depends_on_azimuth() {
            return gradation / self.at_zenith;
        }
        let cosine = self.sun.dot(v).clamp(-1.0, 1.0);
        let indicatrix = 1.0 + c * (exp(d * acos(cosine)) - exp(0.5 * d * PI)) + e * cosine * cosine;
        gradation * indicatrix / self.at_zenith
    }
}
