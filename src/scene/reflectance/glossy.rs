//! Metallic-roughness law: a specular part over a diffuse part that only receives what the first lets through.
//!
//! ```text
//! f        = F(h) D V  +  (1 - metallic) (1 - t) rho/pi (1 - a(mu)) (1 - a(mu')) / (1 - <a>)   [1/sr], per channel
//! F        = F0 + (F90 - F0) (1 - (v,h))^5,   F0 = D0 (1 - metallic) + rho metallic,   F90 = D90 (1 - metallic) + metallic
//! albedo   = a(mu) + (1 - metallic) (1 - t) rho (1 - a(mu))                                   directional
//! straight = (1 - metallic) t rho (1 - a(mu))                                                 goes on unscattered
//! albedo + straight = a(mu) + (1 - metallic) rho (1 - a(mu))  <=  1
//! ```
//!
//! D0, D90 and t, the share of what is under the outer surface that transmits, are those of the dielectric: 0.04, 1 and 0 where the
//! file says nothing. What is straight is no part of f: a surface with t > 0 is a veil (`scene::veils`), a thin sheet that is the same from
//! both sides; `straight` depends on mu alone, so that it is reciprocal as well. D V is in `microfacet`, the specular
//! albedo a and its mean `<a>` in `albedo`. The mix that the glTF specification
//! suggests, a diffuse part dimmed by F(h) alone, reflects up to 1.3 times the light received at grazing incidence;
//! it is replaced by this one, which is reciprocal and conserves energy. Light reflected between facets more than
//! once is not followed: a rough white metal reflects less than one, and never more.
//! At alpha below 1e-3 the specular part is a delta component of reflectance F(mu).

use super::albedo::Coefficients;
use super::lanes::LawInLanes;
use super::microfacet::{Microfacets, Pair};
use super::specular::Finish;
use super::{Scattered, fresnel_rise};
use crate::math::{DVec3, PI, frame, to_world};
use crate::photometry::Colour;
use crate::random::{Generator, around_z, cosine_hemisphere};

/// What a material is where there is no metal: its outer surface, and whether it transmits what gets through that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Specular reflectance at normal incidence.
    pub f0: Colour,
    /// Specular reflectance at grazing incidence, the same in all channels and in none below `f0`.
    pub f90: f64,
    /// Share of what is under the outer surface that lets light straight through, tinted by the base colour; the rest is matt.
    pub transmission: f64,
}

impl Dielectric {
    /// glTF's own: refractive index 1.5, opaque.
    pub const PLAIN: Dielectric = Dielectric { f0: Colour::grey(0.04), f90: 1.0, transmission: 0.0 };
}

/// A metallic-roughness material.
#[derive(Clone, Debug)]
pub struct Glossy {
    base: Colour,
    metallic: f64,
    dielectric: Dielectric,
    /// Specular reflectance at normal incidence.
    f0: Colour,
    /// Specular reflectance at grazing incidence.
    f90: f64,
    /// Reflectance of the layer under the specular one, (1 - metallic) (1 - t) rho.
    under: Colour,
    /// Transmittance of the layer under the specular one, (1 - metallic) t rho.
    clear: Colour,
    /// `under` / (pi (1 - <a>)).
    diffuse: Colour,
    finish: Finish,
    lanes: LawInLanes,
    /// Whether connections from it are spiky.
    peaked: bool,
}

impl Glossy {
    pub(super) fn new(base: Colour, metallic: f64, dielectric: Dielectric, finish: Finish) -> Self {
        let f0 = zip(base, dielectric.f0, |rho, d0| d0 * (1.0 - metallic) + rho * metallic);
        let f90 = 1.0 - (1.0 - dielectric.f90) * (1.0 - metallic);
        let dielectric_part = base * (1.0 - metallic);
        let under = dielectric_part * (1.0 - dielectric.transmission);
        let clear = dielectric_part * dielectric.transmission;
        let mean = finish.0.mean;
        // What lets less than this through is a metal as white as can be, with as little under it: 0/0 means zero.
        let diffuse = zip(under, f0, |u, f0| match 1.0 - mean.albedo(f0, f90) {
            through if through > 1e-9 => u / (PI * through),
            _ => 0.0,
        });
        let lanes = LawInLanes::new((f0, f90), diffuse, finish.0.lanes.clone());
        let mut law =
            Glossy { base, metallic, dielectric, f0, f90, under, clear, diffuse, finish, lanes, peaked: false };
        law.peaked = law.is_peaked_at(super::PEAKED_COSINE);
        law
    }

    /// The same material with another base colour.
    pub(super) fn with_base(&self, base: Colour) -> Self {
        Self::new(base, self.metallic, self.dielectric, self.finish.clone())
    }

    /// The same material of which another share transmits.
    pub(super) fn with_transmission(&self, transmission: f64) -> Self {
        let dielectric = Dielectric { transmission, ..self.dielectric };
        Self::new(self.base, self.metallic, dielectric, self.finish.clone())
    }

    /// The same material in one photometric channel.
    pub(super) fn grey(self) -> Self {
        let dielectric = Dielectric { f0: Colour::grey(self.dielectric.f0.luminance()), ..self.dielectric };
        Self::new(Colour::grey(self.base.luminance()), self.metallic, dielectric, self.finish)
    }

    /// Directional albedo of the specular part as A and B.
    fn specular(&self, mu: f64) -> Coefficients {
        self.finish.0.albedo(mu)
    }

    /// f without the delta component \[1/sr\].
    pub(super) fn evaluate(&self, normal: DVec3, w_in: DVec3, w_out: DVec3) -> Colour {
        match Pair::new(normal, w_in, w_out) {
            Some(pair) => self.finite(&pair, self.specular(pair.arriving)),
            None => Colour::BLACK,
        }
    }

    /// The same for many directions at once.
    pub(super) fn lanes(&self) -> &LawInLanes {
        &self.lanes
    }

    /// What the specular part lets through at the cosine `mu`; 0 where there is nothing under it.
    pub(super) fn through(&self, mu: f64) -> Colour {
        if self.diffuse.is_black() {
            return Colour::BLACK;
        }
        let specular = self.specular(mu);
        self.f0.map(|f0| 1.0 - specular.albedo(f0, self.f90))
    }

    /// f of a pair of directions whose specular albedo at arrival is known \[1/sr\].
    fn finite(&self, pair: &Pair, arriving: Coefficients) -> Colour {
        let specular = match self.finish.0.rough() {
            None => Colour::BLACK,
            Some(facets) => self.fresnel(pair.half) * facets.law(pair),
        };
        if self.diffuse.is_black() {
            return specular;
        }
        let leaving = self.specular(pair.leaving);
        let through = self.f0.map(|f0| (1.0 - arriving.albedo(f0, self.f90)) * (1.0 - leaving.albedo(f0, self.f90)));
        specular + self.diffuse * through
    }

    /// Schlick's factor at the cosine `c` between a direction and the facet's normal.
    fn fresnel(&self, c: f64) -> Colour {
        let s = fresnel_rise(c);
        self.f0.map(|f0| f0 * (1.0 - s) + self.f90 * s)
    }

    /// Albedo of the diffuse part under a specular albedo.
    fn diffuse_albedo(&self, specular: Coefficients) -> Colour {
        zip(self.under, self.f0, |u, f0| u * (1.0 - specular.albedo(f0, self.f90)))
    }

    /// Probability that `sample` chooses the specular part: its share of the luminous albedo.
    fn specular_share(&self, specular: Coefficients) -> f64 {
        let outer = self.f0.map(|f0| specular.albedo(f0, self.f90)).luminance();
        let under = self.diffuse_albedo(specular).luminance();
        // A black metal at normal incidence reflects nothing at all.
        if outer > 0.0 { outer / (outer + under) } else { 0.0 }
    }

    /// Density in solid angle of the finite part of `sample` \[1/sr\].
    pub(super) fn pdf(&self, normal: DVec3, w_in: DVec3, w_out: DVec3) -> f64 {
        let Some(pair) = Pair::new(normal, w_in, w_out) else { return 0.0 };
        self.density(&pair, self.specular_share(self.specular(pair.arriving)))
    }

    fn density(&self, pair: &Pair, specular_share: f64) -> f64 {
        let lobe = match self.finish.0.rough() {
            None => 0.0,
            Some(facets) => specular_share * facets.density(pair),
        };
        lobe + (1.0 - specular_share) * pair.leaving / PI
    }

    /// Draws a continuation: one uniform to choose the part, two for its direction (none for a mirror).
    pub(super) fn sample(&self, normal: DVec3, w_in: DVec3, rng: &mut Generator) -> Option<Scattered> {
        let mu = -w_in.dot(normal);
        if mu <= 0.0 {
            return None;
        }
        let albedo = self.specular(mu);
        let share = self.specular_share(albedo);
        let direction = if rng.uniform() >= share {
            to_world(normal, cosine_hemisphere(rng.uniform2()))
        } else {
            match self.finish.0.rough() {
                None => {
                    // Renormalised, so that a long chain of mirrors does not drift off the unit sphere.
                    let direction = (w_in + 2.0 * mu * normal).normalize();
                    return Some(Scattered {
                        direction,
                        factor: self.fresnel(mu) / share,
                        delta: true,
                        transmitted: false,
                    });
                }
                Some(facets) => rough_direction(facets, normal, w_in, rng)?,
            }
        };
        let pair = Pair::new(normal, w_in, direction)?;
        let density = self.density(&pair, share);
        let factor = self.finite(&pair, albedo) * (pair.leaving / density);
        (density > 0.0).then_some(Scattered { direction, factor, delta: false, transmitted: false })
    }

    /// Directional albedo of the whole law.
    pub(super) fn albedo(&self, mu: f64) -> Colour {
        let specular = self.specular(mu);
        self.f0.map(|f0| specular.albedo(f0, self.f90)) + self.diffuse_albedo(specular)
    }

    /// The share of light that goes straight on at the cosine `mu` of incidence.
    pub(super) fn straight(&self, mu: f64) -> Colour {
        let specular = self.specular(mu);
        zip(self.clear, self.f0, |clear, f0| clear * (1.0 - specular.albedo(f0, self.f90)))
    }

    /// True when some light goes straight on.
    pub(super) fn transmits(&self) -> bool {
        !self.clear.is_black()
    }

    /// Reflectance of the delta component at the cosine `mu` of incidence.
    pub(super) fn delta_reflectance(&self, mu: f64) -> Option<Colour> {
        self.has_delta().then(|| self.fresnel(mu))
    }

    pub(super) fn has_delta(&self) -> bool {
        self.finish.0.rough().is_none()
    }

    pub(super) fn is_peaked(&self) -> bool {
        self.peaked
    }

    /// pi f of the pair mirrored at the cosine `mu`, F(mu) / (4 alpha^2 mu t(mu)), is above the tolerated.
    pub(super) fn is_peaked_at(&self, mu: f64) -> bool {
        let Some(facets) = self.finish.0.rough() else { return false };
        let alpha2 = facets.alpha() * facets.alpha();
        self.fresnel(mu).luminance() > 4.0 * super::PEAK * alpha2 * mu * facets.stretched(mu)
    }

    pub(super) fn lobe_width(&self) -> f64 {
        match self.finish.0.rough() {
            None => 0.0,
            Some(facets) => facets.alpha(),
        }
    }

    /// True when f without the delta component is zero.
    pub(super) fn is_black(&self) -> bool {
        // A sheet that transmits all may have an outer surface that reflects nothing.
        (self.has_delta() || self.f90 == 0.0) && self.diffuse.is_black()
    }
}

/// A direction reflected at a visible facet; it may lie below the surface.
fn rough_direction(facets: &Microfacets, normal: DVec3, w_in: DVec3, rng: &mut Generator) -> Option<DVec3> {
    let (t, b) = frame(normal);
    let cap = facets.cap(DVec3::new(-w_in.dot(t), -w_in.dot(b), -w_in.dot(normal)));
    let u = rng.uniform2();
    let h = cap.half_vector(around_z(1.0 - u.x * (1.0 + cap.depth), u.y))?;
    Some(to_world(normal, cap.reflect(h)).normalize())
}

/// Two colours through `f`, channel by channel.
fn zip(x: Colour, y: Colour, f: impl Fn(f64, f64) -> f64) -> Colour {
    Colour(std::array::from_fn(|i| f(x.0[i], y.0[i])))
}
