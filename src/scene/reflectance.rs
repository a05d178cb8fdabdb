//! Laws of reflection. f = sigma/pi \[1/sr\]; directions are propagation directions of light.
//!
//! The interface is two-sided: `normal` is the surface normal on the side on which light arrives
//! (`w_in . normal < 0`), `w_out` may lie on either side of it. Every law here returns zero below the surface.

use crate::math::{DVec3, PI, to_world};
use crate::photometry::Colour;
use crate::random::{Generator, cosine_hemisphere};

/// How a surface reflects.
#[derive(Clone, Debug)]
pub enum Reflectance {
    /// The same luminance in all directions; f = rho/pi.
    Lambert(Colour),
}

/// A sampled continuation of a trajectory.
#[derive(Clone, Copy, Debug)]
pub struct Scattered {
    /// New propagation direction.
    pub direction: DVec3,
    /// f |cos| / pdf, the factor on the weight.
    pub factor: Colour,
    /// True when a delta component was chosen (a mirror).
    pub delta: bool,
}

impl Reflectance {
    /// glTF's metallic-roughness material.
    pub fn metallic_roughness(base: Colour, _metallic: f64, _roughness: f64) -> Reflectance {
        Reflectance::Lambert(base)
    }

    /// f(w_in -> w_out) \[1/sr\] without delta components.
    pub fn evaluate(&self, normal: DVec3, _w_in: DVec3, w_out: DVec3) -> Colour {
        match self {
            Reflectance::Lambert(rho) if w_out.dot(normal) > 0.0 => *rho / PI,
            Reflectance::Lambert(_) => Colour::BLACK,
        }
    }

    /// Draws a continuation; `None` when nothing is reflected.
    pub fn sample(&self, normal: DVec3, _w_in: DVec3, rng: &mut Generator) -> Option<Scattered> {
        match self {
            Reflectance::Lambert(rho) => {
                let direction = to_world(normal, cosine_hemisphere(rng.uniform2()));
                Some(Scattered { direction, factor: *rho, delta: false })
            }
        }
    }

    /// The reflectance of a Lambert surface: f is `rho/pi` whatever the directions.
    pub fn lambert(&self) -> Option<Colour> {
        match self {
            Reflectance::Lambert(rho) => Some(*rho),
        }
    }

    /// True when part of the light is reflected by a delta component, which no connection can carry.
    pub fn has_delta(&self) -> bool {
        false
    }

    /// True when nothing is reflected by the finite part: no receiver can stand here.
    pub fn is_black(&self) -> bool {
        match self {
            Reflectance::Lambert(rho) => rho.is_black(),
        }
    }

    /// The same law with every colour replaced by its luminance, for one photometric channel.
    pub fn grey(self) -> Self {
        match self {
            Reflectance::Lambert(rho) => Reflectance::Lambert(Colour::grey(rho.luminance())),
        }
    }
}
