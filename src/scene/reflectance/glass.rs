//! The surface of a body of clear glass: light is mirrored or refracted by Fresnel's equations, and absorbed on its way inside.
//!
//! The front of the surface is outside, in air; bodies inside each other are not known, each surface stands between glass and air.
//! Unpolarised light at each surface anew. What is refracted carries its flux unchanged, but its luminance goes with the square of
//! the index: L/n^2 is what stays. So the ways of light and of eyes differ by n^2 at a surface, which cancels for an eye outside.

use super::Scattered;
use super::pane::face;
use crate::math::{DVec3, exp, log};
use crate::photometry::Colour;
use crate::random::Generator;

/// A body of glass.
#[derive(Clone, Debug, PartialEq)]
pub struct Glass {
    index: f64,
    /// What is absorbed inside \[1/m\].
    absorption: Colour,
}

impl Glass {
    /// Of refractive index `index`, 1 or more, that absorbs `absorption` \[1/m\].
    pub fn new(index: f64, absorption: Colour) -> Self {
        assert!(index >= 1.0 && absorption.0.iter().all(|&a| a >= 0.0), "glass of {index}, {absorption:?}");
        Glass { index, absorption }
    }

    /// Mirrored share and cosine on the other side of light at `cosine` from outside, or from inside.
    fn at(&self, outside: bool, cosine: f64) -> (f64, Option<f64>) {
        let index = if outside { self.index } else { 1.0 / self.index };
        match face(index, cosine) {
            Some(face) => (0.5 * (face.reflectances[0] + face.reflectances[1]), Some(face.inside)),
            None => (1.0, None),
        }
    }

    /// The share mirrored at `cosine` from outside.
    pub(super) fn reflectance(&self, cosine: f64) -> f64 {
        self.at(true, cosine).0
    }

    /// What is left of light that has gone `length` inside.
    pub fn left(&self, length: f64) -> Colour {
        self.absorption.map(|a| if a == 0.0 { 1.0 } else { exp(-a * length) })
    }

    /// Factor on the luminance of light that an eye ray finds beyond a surface which it enters from outside: 1/n^2.
    pub fn luminance_factor(&self, outside: bool) -> f64 {
        let squared = self.index * self.index;
        if outside { 1.0 / squared } else { squared }
    }

    /// One of the two directions, by its share of the flux; `outside` where light arrives at the front.
    pub(super) fn sample(&self, outside: bool, normal: DVec3, w_in: DVec3, rng: &mut Generator) -> Option<Scattered> {
        let cosine = -w_in.dot(normal);
        if cosine <= 0.0 {
            return None;
        }
        let (mirrored, refracted) = self.at(outside, cosine);
        let factor = Colour::WHITE;
        Some(match refracted.filter(|_| !rng.chance(mirrored)) {
            None => {
                let direction = (w_in + 2.0 * cosine * normal).normalize();
                Scattered { direction, factor, delta: true, transmitted: false }
            }
            Some(inside) => {
                let ratio = if outside { 1.0 / self.index } else { self.index };
                let direction = (w_in * ratio + normal * (ratio * cosine - inside)).normalize();
                Scattered { direction, factor, delta: true, transmitted: true }
            }
        })
    }

    pub(super) fn grey(self) -> Self {
        let after_a_metre = self.left(1.0).luminance();
        Glass { absorption: Colour::grey(-log(after_a_metre)), ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Domain, Stream};

    #[test]
    fn refraction_obeys_snell_and_turns_back() {
        let glass = Glass::new(1.5, Colour::BLACK);
        let mut rng = Stream::new(4, Domain::Trajectory, "glass").generator(0);
        for sine in [0.0, 0.3, 0.6, 0.9, 0.999] {
            let w_in = DVec3::new(sine, 0.0, -(1.0f64 - sine * sine).sqrt());
            let drawn = std::iter::repeat_with(|| glass.sample(true, DVec3::Z, w_in, &mut rng).unwrap());
            let through = drawn.take(1000).find(|s| s.transmitted).expect("most of it goes in");
            assert!((through.direction.x - sine / 1.5).abs() < 1e-12 && through.direction.z < 0.0);
            // The same surface from inside, the same share.
            let inside = -through.direction.z;
            assert!((glass.at(false, inside).0 - glass.at(true, -w_in.z).0).abs() < 1e-12);
        }
        // Beyond 41.8 degrees all is mirrored.
        assert_eq!(glass.at(false, 0.7), (1.0, None));
        assert!((glass.luminance_factor(true) * glass.luminance_factor(false) - 1.0).abs() < 1e-15);
        assert!((glass.reflectance(1.0) - 0.04).abs() < 1e-15);
    }
}
