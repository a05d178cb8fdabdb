//! Lights without extent: their flux, what of it arrives, and in which directions it leaves.

use super::photometric_web::Luminaire;
use crate::math::{DVec2, DVec3, PI, cbrt, cos, pow, to_world};
use crate::photometry::Colour;
use crate::random::{around_z, disc, sphere};

/// A light without extent, as a file or a job gives it.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// The same intensity \[cd\] in all directions.
    Omni {
        /// Position \[m\].
        position: DVec3,
        /// Luminous intensity \[cd\].
        intensity: Colour,
    },
    /// KHR_lights_punctual spot: falloff between the two cones as in its implementation note.
    Spot {
        /// Position \[m\].
        position: DVec3,
        /// Unit vector along the axis.
        direction: DVec3,
        /// Luminous intensity on the axis \[cd\].
        intensity: Colour,
        /// Half angle inside which the intensity is full \[rad\].
        inner: f64,
        /// Half angle outside which it is zero \[rad\].
        outer: f64,
    },
    /// Intensity times a power of the cosine to the axis, in the hemisphere around it.
    CosPower {
        /// Position \[m\].
        position: DVec3,
        /// Unit vector along the axis.
        direction: DVec3,
        /// Luminous intensity on the axis \[cd\].
        intensity: Colour,
        /// The power.
        exponent: f64,
    },
    /// The photometric web of a file.
    Luminaire(Luminaire),
    /// Parallel light.
    Directional {
        /// Unit vector of propagation.
        direction: DVec3,
        /// Illuminance on a plane across it \[lx\].
        illuminance: Colour,
    },
}

impl Light {
    /// The same light with its position moved by `offset`.
    pub(super) fn moved(self, offset: DVec3) -> Self {
        match self {
            Light::Omni { position, intensity } => Light::Omni { position: position + offset, intensity },
            Light::Spot { position, direction, intensity, inner, outer } => {
                Light::Spot { position: position + offset, direction, intensity, inner, outer }
            }
            Light::CosPower { position, direction, intensity, exponent } => {
                Light::CosPower { position: position + offset, direction, intensity, exponent }
            }
            Light::Luminaire(luminaire) => Light::Luminaire(luminaire.moved(offset)),
            directional @ Light::Directional { .. } => directional,
        }
    }

    /// The same light with its colour through `f`.
    pub(super) fn recoloured(mut self, f: impl Fn(Colour) -> Colour) -> Self {
        match &mut self {
            Light::Omni { intensity: colour, .. }
            | Light::Spot { intensity: colour, .. }
            | Light::CosPower { intensity: colour, .. }
            | Light::Directional { illuminance: colour, .. } => *colour = f(*colour),
            Light::Luminaire(luminaire) => *luminaire = luminaire.clone().recoloured(f),
        }
        self
    }

    /// Flux that enters the scene \[lm\]; of parallel light, through a disc of `radius` \[m\].
    pub(super) fn flux(&self, radius: f64) -> Colour {
        match self {
            Light::Omni { intensity, .. } => *intensity * (4.0 * PI),
            Light::Spot { intensity, inner, outer, .. } => *intensity * Falloff::new(*inner, *outer).solid_angle(),
            Light::CosPower { intensity, exponent, .. } => *intensity * (2.0 * PI / (exponent + 1.0)),
            Light::Luminaire(luminaire) => luminaire.flux(),
            Light::Directional { illuminance, .. } => *illuminance * (PI * radius * radius),
        }
    }

    /// Light that arrives unobstructed at `point`: the point it comes from, `None` from infinity; its propagation
    /// direction; and the illuminance across that direction \[lx\].
    pub fn at(&self, point: DVec3) -> (Option<DVec3>, DVec3, Colour) {
        let from = |position: DVec3, intensity: Colour| {
            let way = point - position;
            (Some(position), way.normalize(), intensity / way.length_squared())
        };
        match self {
            Light::Omni { position, intensity } => from(*position, *intensity),
            Light::Spot { position, direction, intensity, inner, outer } => {
                let cosine = direction.dot((point - *position).normalize());
                from(*position, *intensity * Falloff::new(*inner, *outer).at(cosine))
            }
            Light::CosPower { position, direction, intensity, exponent } => {
                let cosine = direction.dot((point - *position).normalize());
                from(*position, *intensity * if cosine > 0.0 { pow(cosine, *exponent) } else { 0.0 })
            }
            Light::Luminaire(luminaire) => from(luminaire.position, luminaire.intensity(point - luminaire.position)),
            Light::Directional { direction, illuminance } => (None, *direction, *illuminance),
        }
    }

    /// Where a history starts that `u` draws, and its direction; parallel light covers the sphere with this centre and radius.
    pub(super) fn start(&self, (center, radius): (DVec3, f64), u: DVec2) -> (DVec3, DVec3) {
        match self {
            Light::Omni { position, .. } => (*position, sphere(u)),
            Light::Spot { position, direction, inner, outer, .. } => {
                let cosine = Falloff::new(*inner, *outer).sample(u.x);
                (*position, to_world(*direction, around_z(cosine, u.y)))
            }
            Light::CosPower { position, direction, exponent, .. } => {
                let cosine = pow(1.0 - u.x, 1.0 / (exponent + 1.0));
                (*position, to_world(*direction, around_z(cosine, u.y)))
            }
            Light::Luminaire(luminaire) => (luminaire.position, luminaire.sample(u)),
            Light::Directional { direction, .. } => {
                let across = disc(u) * radius;
                let start = DVec3::new(across.x, across.y, -2.0 * radius);
                (center + to_world(*direction, start), *direction)
            }
        }
    }
}

/// Falloff of a spot, (scale (cos - cos_outer))^2 clamped to 1 (implementation note of KHR_lights_punctual).
struct Falloff {
    cos_outer: f64,
    scale: f64,
}

impl Falloff {
    fn new(inner: f64, outer: f64) -> Self {
        let cos_outer = cos(outer);
        Falloff { cos_outer, scale: 1.0 / (cos(inner) - cos_outer).max(0.001) }
    }

    fn at(&self, cosine: f64) -> f64 {
        let a = ((cosine - self.cos_outer) * self.scale).clamp(0.0, 1.0);
        a * a
    }

    /// Cosine from which on the intensity is full.
    fn cos_full(&self) -> f64 {
        (self.cos_outer + 1.0 / self.scale).min(1.0)
    }

    /// Integrals over azimuth and cosine of the ramp and of the full cone \[sr\].
    fn parts(&self) -> (f64, f64) {
        let ramp = self.cos_full() - self.cos_outer;
        (2.0 * PI * self.scale * self.scale * ramp * ramp * ramp / 3.0, 2.0 * PI * (1.0 - self.cos_full()))
    }

    /// Flux over axial intensity \[sr\]: the quadrature of the falloff, in closed form.
    fn solid_angle(&self) -> f64 {
        let (ramp, full) = self.parts();
        ramp + full
    }

    /// Cosine with density proportional to the falloff.
    fn sample(&self, u: f64) -> f64 {
        let (ramp, full) = self.parts();
        let v = u * (ramp + full);
        if v < ramp {
            self.cos_outer + (self.cos_full() - self.cos_outer) * cbrt(v / ramp)
        } else {
            1.0 - (v - ramp) / (2.0 * PI)
        }
    }
}
