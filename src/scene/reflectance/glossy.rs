//! Metallic-roughness law: a specular part over a diffuse part that only receives what the first lets through.
//!
//! ```text
//! f     = F(h) D V  +  (1 - metallic) rho/pi (1 - a(mu)) (1 - a(mu')) / (1 - <a>)             [1/sr], per channel
//! F     = F0 + (1 - F0) (1 - (v,h))^5,   F0 = 0.04 (1 - metallic) + rho metallic
//! total = a(mu) + (1 - metallic) rho (1 - a(mu))  <=  1                                        directional albedo
//! ```
//!
//! D V is in `microfacet`, the specular albedo a and its mean `<a>` in `albedo`. The mix that the glTF specification
//! suggests, a diffuse part dimmed by F(h) alone, reflects up to 1.3 times the light received at grazing incidence;
//! it is replaced by this one, which is reciprocal and conserves energy. Light reflected between facets more than
//! once is not followed: a rough white metal reflects less than one, and never more.
//! At alpha below [`MIRROR`] the specular part is a delta component of reflectance F(mu).

use super::albedo::{AlbedoTable, Coefficients};
use super::lanes::LawInLanes;
use super::microfacet::{Microfacets, Pair};
use super::{Scattered, fresnel_rise};
use crate::math::{DVec3, PI, frame, to_world};
use crate::photometry::Colour;
use crate::random::{Generator, around_z, cosine_hemisphere};

/// Below this alpha a surface is a mirror: its lobe would be narrower than any receiver resolves.
const MIRROR: f64 = 1e-3;
/// Reflectance of a dielectric at normal incidence (refractive index 1.5).
const DIELECTRIC: f64 = 0.04;

/// How the outer surface reflects.
#[derive(Clone, Debug)]
enum Specular {
    Mirror,
    Rough(Microfacets, AlbedoTable),
}

impl Specular {
    fn new(alpha: f64) -> Self {
        if alpha < MIRROR {
            return Specular::Mirror;
        }
        let facets = Microfacets::new(alpha);
        let table = AlbedoTable::new(&facets);
        Specular::Rough(facets, table)
    }

    /// Directional albedo as A and B.
    fn albedo(&self, mu: f64) -> Coefficients {
        match self {
            Specular::Mirror => Coefficients::mirror(mu),
            Specular::Rough(_, table) => table.at(mu),
        }
    }

    /// Cosine-weighted mean of `albedo` over the hemisphere.
    fn mean(&self) -> Coefficients {
        match self {
            Specular::Mirror => Coefficients::MIRROR_MEAN,
            Specular::Rough(_, table) => table.mean(),
        }
    }
}

/// A metallic-roughness material.
#[derive(Clone, Debug)]
pub struct Glossy {
    base: Colour,
    metallic: f64,
    /// Specular reflectance at normal incidence.
    f0: Colour,
    /// Reflectance of the layer under the specular one, (1 - metallic) rho.
    under: Colour,
    /// `under` / (pi (1 - <a>)).
    diffuse: Colour,
    specular: Specular,
    lanes: LawInLanes,
    /// Whether connections from it are spiky.
    peaked: bool,
}

impl Glossy {
    pub(super) fn new(base: Colour, metallic: f64, alpha: f64) -> Self {
        Self::assemble(base, metallic, Specular::new(alpha))
    }

    fn assemble(base: Colour, metallic: f64, specular: Specular) -> Self {
        let f0 = base.map(|rho| DIELECTRIC * (1.0 - metallic) + rho * metallic);
        let under = base * (1.0 - metallic);
        let mean = specular.mean();
        // What lets less than this through is a metal as white as can be, with as little under it: 0/0 means zero.
        let diffuse = zip(under, f0, |u, f0| match 1.0 - mean.albedo(f0) {
            through if through > 1e-9 => u / (PI * through),
            _ => 0.0,
        });
        let lanes = match &specular {
            Specular::Mirror => LawInLanes::mirror(f0, diffuse),
            Specular::Rough(facets, table) => LawInLanes::rough(f0, diffuse, facets.alpha2(), table.nodes()),
        };
        let mut law = Glossy { base, metallic, f0, under, diffuse, specular, lanes, peaked: false };
        law.peaked = law.is_peaked_at(super::PEAKED_COSINE);
        law
    }

    /// The same material in one photometric channel.
    pub(super) fn grey(self) -> Self {
        Self::assemble(Colour::grey(self.base.luminance()), self.metallic, self.specular)
    }

    /// f without the delta component \[1/sr\].
    pub(super) fn evaluate(&self, normal: DVec3, w_in: DVec3, w_out: DVec3) -> Colour {
        match Pair::new(normal, w_in, w_out) {
            Some(pair) => self.finite(&pair, self.specular.albedo(pair.arriving)),
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
        let specular = self.specular.albedo(mu);
        self.f0.map(|f0| 1.0 - specular.albedo(f0))
    }

    /// f of a pair of directions whose specular albedo at arrival is known \[1/sr\].
    fn finite(&self, pair: &Pair, arriving: Coefficients) -> Colour {
        let specular = match &self.specular {
            Specular::Mirror => Colour::BLACK,
            Specular::Rough(facets, _) => self.fresnel(pair.half) * facets.law(pair),
        };
        if self.diffuse.is_black() {
            return specular;
        }
        let leaving = self.specular.albedo(pair.leaving);
        let through = self.f0.map(|f0| (1.0 - arriving.albedo(f0)) * (1.0 - leaving.albedo(f0)));
        specular + self.diffuse * through
    }

    /// Schlick's factor at the cosine `c` between a direction and the facet's normal.
    fn fresnel(&self, c: f64) -> Colour {
        let s = fresnel_rise(c);
        self.f0.map(|f0| f0 * (1.0 - s) + s)
    }

    /// Albedo of the diffuse part under a specular albedo.
    fn diffuse_albedo(&self, specular: Coefficients) -> Colour {
        zip(self.under, self.f0, |u, f0| u * (1.0 - specular.albedo(f0)))
    }

    /// Probability that `sample` chooses the specular part: its share of the luminous albedo.
    fn specular_share(&self, specular: Coefficients) -> f64 {
        let outer = self.f0.map(|f0| specular.albedo(f0)).luminance();
        let under = self.diffuse_albedo(specular).luminance();
        // A black metal at normal incidence reflects nothing at all.
        if outer > 0.0 { outer / (outer + under) } else { 0.0 }
    }

    /// Density in solid angle of the finite part of `sample` \[1/sr\].
    pub(super) fn pdf(&self, normal: DVec3, w_in: DVec3, w_out: DVec3) -> f64 {
        let Some(pair) = Pair::new(normal, w_in, w_out) else { return 0.0 };
        self.density(&pair, self.specular_share(self.specular.albedo(pair.arriving)))
    }

    fn density(&self, pair: &Pair, specular_share: f64) -> f64 {
        let lobe = match &self.specular {
            Specular::Mirror => 0.0,
            Specular::Rough(facets, _) => specular_share * facets.density(pair),
        };
        lobe + (1.0 - specular_share) * pair.leaving / PI
    }

    /// Draws a continuation: one uniform to choose the part, two for its direction (none for a mirror).
    pub(super) fn sample(&self, normal: DVec3, w_in: DVec3, rng: &mut Generator) -> Option<Scattered> {
        let mu = -w_in.dot(normal);
        if mu <= 0.0 {
            return None;
        }
        let albedo = self.specular.albedo(mu);
        let share = self.specular_share(albedo);
        let direction = if rng.uniform() >= share {
            to_world(normal, cosine_hemisphere(rng.uniform2()))
        } else {
            match &self.specular {
                Specular::Mirror => {
                    // Renormalised, so that a long chain of mirrors does not drift off the unit sphere.
                    let direction = (w_in + 2.0 * mu * normal).normalize();
                    return Some(Scattered {
                        direction,
                        factor: self.fresnel(mu) / share,
                        delta: true,
                        transmitted: false,
                    });
                }
                Specular::Rough(facets, _) => rough_direction(facets, normal, w_in, rng)?,
            }
        };
        let pair = Pair::new(normal, w_in, direction)?;
        let density = self.density(&pair, share);
        let factor = self.finite(&pair, albedo) * (pair.leaving / density);
        (density > 0.0).then_some(Scattered { direction, factor, delta: false, transmitted: false })
    }

    /// Directional albedo of the whole law.
    pub(super) fn albedo(&self, mu: f64) -> Colour {
        let specular = self.specular.albedo(mu);
        self.f0.map(|f0| specular.albedo(f0)) + self.diffuse_albedo(specular)
    }

    /// Reflectance of the delta component at the cosine `mu` of incidence.
    pub(super) fn delta_reflectance(&self, mu: f64) -> Option<Colour> {
        self.has_delta().then(|| self.fresnel(mu))
    }

    pub(super) fn has_delta(&self) -> bool {
        matches!(self.specular, Specular::Mirror)
    }

    pub(super) fn is_peaked(&self) -> bool {
        self.peaked
    }

    /// pi f of the pair mirrored at the cosine `mu`, F(mu) / (4 alpha^2 mu t(mu)), is above the tolerated.
    pub(super) fn is_peaked_at(&self, mu: f64) -> bool {
        let Specular::Rough(facets, _) = &self.specular else { return false };
        let alpha2 = facets.alpha() * facets.alpha();
        self.fresnel(mu).luminance() > 4.0 * super::PEAK * alpha2 * mu * facets.stretched(mu)
    }

    pub(super) fn lobe_width(&self) -> f64 {
        match &self.specular {
            Specular::Mirror => 0.0,
            Specular::Rough(facets, _) => facets.alpha(),
        }
    }

    /// True when f without the delta component is zero.
    pub(super) fn is_black(&self) -> bool {
        self.has_delta() && self.diffuse.is_black()
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
