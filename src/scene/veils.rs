//! Surfaces that let light through straight on: what is left of it, and where it is met.
//!
//! Light that goes straight through a veil stays on its segment: visibility becomes a transmittance, and no vertex, no
//! reflection and no delta scatterer is counted. What is not let through is *met*: the surface's law of reflection has it. With c the share
//! that the surface covers there (alpha; 1 without), s what its law lets straight through at the angle of incidence:
//!
//! ```text
//! through = 1 - c + c s
//! met     = c          sheets: albedo + s <= 1, the law is a share of all light that the surface has
//! met     = 1 - through    panes (c = 1) and opaque laws (s = 0): the law is a share of what is met
//! ```

use super::textures::{Coverage, Place};
use super::{Delta, Reflectance, Scattered, Scene, Surface};
use crate::geometry::{Hit, Ray};
use crate::math::{DVec3, Vec3};
use crate::photometry::Colour;
use crate::random::Generator;
use smallvec::SmallVec;

/// Guard against rays that never end among veils.
const MAX_VEILS: u32 = 1 << 16;

/// What becomes of light, or of an eye ray, at a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Meeting {
    /// It goes straight on, with this share of its weight.
    Through(Colour),
    /// The surface's law of reflection decides, with this share of its weight.
    Met(Colour),
}

impl Surface {
    /// True when its law lets light through straight on.
    pub fn is_veil(&self) -> bool {
        self.reflectance.is_veil()
    }
}

impl Scene {
    /// The share of light that goes straight on through the surface `primitive` \[1\].
    pub fn let_through(&self, primitive: u32, position: DVec3, cosine: f64) -> Colour {
        let covered = self.covered(primitive, position);
        let surface = &self.surfaces[self.surface_of[primitive as usize] as usize];
        if !surface.is_veil() {
            return Colour::grey(1.0 - covered);
        }
        // The law of the place is made for a veil alone: this is asked at every crossing.
        Colour::grey(1.0 - covered) + self.reflectance(primitive, position).straight(cosine) * covered
    }

    /// The share of light that meets the surface `primitive` at all, where alpha is less than one \[1\].
    fn covered(&self, primitive: u32, position: DVec3) -> f64 {
        match self.textures.of(self.surface_of[primitive as usize], primitive) {
            Some(textured) if textured.coverage != Coverage::Whole => {
                self.textures.covered(textured, Place::new(primitive, self.geometry.triangle(primitive), position))
            }
            _ => 1.0,
        }
    }

    /// True where light may go straight on through the surface `primitive`.
    fn is_veil(&self, primitive: u32) -> bool {
        let surface = self.surface_of[primitive as usize];
        self.surfaces[surface as usize].is_veil() || self.textures.is_veil(surface, primitive)
    }

    /// The share of light that gets straight from one lifted point to another: 0 where a surface blocks, 1 where nothing is between.
    pub fn transmittance(&self, a: Vec3, b: Vec3) -> Colour {
        if self.geometry.visible(a, b) { self.veiled(a, b) } else { Colour::BLACK }
    }

    /// The same of the veils alone.
    pub fn veiled(&self, a: Vec3, b: Vec3) -> Colour {
        let mut share = Colour::WHITE;
        self.geometry.veils_between(a, b, |c| share = share * self.let_through(c.primitive, c.position, c.cosine));
        share
    }

    /// The first surface along `ray` that lets nothing through, where it is at most `limit` away \[m\], and the share of light that goes
    /// straight from the one to the other.
    pub fn straight(&self, ray: &Ray, limit: f64) -> (Option<Hit>, Colour) {
        let (mut ray, mut share, mut gone) = (*ray, Colour::WHITE, 0.0);
        for _ in 0..MAX_VEILS {
            let Some(hit) = self.geometry.closest_hit_within(&ray, limit - gone) else { return (None, share) };
            let here = Hit { distance: gone + hit.distance, ..hit };
            let cosine = -ray.direction.dot(hit.normal);
            if !self.is_veil(hit.primitive) {
                return (Some(here), share);
            }
            let through = self.let_through(hit.primitive, hit.position, cosine);
            if through.is_black() {
                return (Some(here), share);
            }
            share = share * through;
            gone = here.distance;
            ray = self.onward(&hit, ray.direction);
        }
        (None, Colour::BLACK)
    }

    /// The surfaces seen straight along `ray`: the first that lets nothing through there, and the veils before it where they are no holes.
    pub fn seen_along(&self, ray: &Ray) -> SmallVec<[u32; 2]> {
        let (mut ray, mut seen) = (*ray, SmallVec::new());
        for _ in 0..MAX_VEILS {
            let Some(hit) = self.geometry.closest_hit(&ray) else { break };
            let through = match self.is_veil(hit.primitive) {
                true => self.let_through(hit.primitive, hit.position, -ray.direction.dot(hit.normal)),
                false => Colour::BLACK,
            };
            if through != Colour::WHITE {
                seen.push(hit.primitive);
            }
            if through.is_black() {
                break;
            }
            ray = self.onward(&hit, ray.direction);
        }
        seen
    }

    /// The ray that goes on along `direction` behind the surface that it met at `hit`.
    pub fn onward(&self, hit: &Hit, direction: DVec3) -> Ray {
        Ray { origin: self.geometry.lift(hit.position, -hit.normal), direction }
    }

    /// Draws how light along `direction` goes on at `hit`, where it is met; inside glass it has become less on its way there.
    pub fn scatter(&self, hit: &Hit, direction: DVec3, rng: &mut Generator) -> Option<Scattered> {
        let reflectance = self.reflectance(hit.primitive, hit.position);
        let scattered = reflectance.sample_from(hit.front, hit.normal, direction, rng)?;
        match &*reflectance {
            Reflectance::Delta(Delta::Glass(glass)) if !hit.front => {
                Some(Scattered { factor: scattered.factor * glass.left(hit.distance), ..scattered })
            }
            _ => Some(scattered),
        }
    }

    /// The same for an eye ray: what luminance is found beyond counts with the square of the index less or more.
    pub fn scatter_eye_ray(&self, hit: &Hit, direction: DVec3, rng: &mut Generator) -> Option<Scattered> {
        let scattered = self.scatter(hit, direction, rng)?;
        match &self.surface(hit.primitive).reflectance {
            Reflectance::Delta(Delta::Glass(glass)) if scattered.transmitted => {
                Some(Scattered { factor: scattered.factor * glass.luminance_factor(hit.front), ..scattered })
            }
            _ => Some(scattered),
        }
    }

    /// The ray of light that was scattered at `hit`.
    pub fn leaving(&self, hit: &Hit, scattered: &Scattered) -> Ray {
        let side = if scattered.transmitted { -hit.normal } else { hit.normal };
        Ray { origin: self.geometry.lift(hit.position, side), direction: scattered.direction }
    }

    /// Chooses whether light along `direction` goes on behind `hit` or is met there; without a choice no number is drawn. With `mirrors`
    /// what a pane mirrors is wanted; without it is not followed, and all that gets through goes on.
    pub fn meet(&self, hit: &Hit, direction: DVec3, mirrors: bool, rng: &mut Generator) -> Meeting {
        if !self.is_veil(hit.primitive) {
            return Meeting::Met(Colour::WHITE);
        }
        let cosine = -direction.dot(hit.normal);
        let through = self.let_through(hit.primitive, hit.position, cosine);
        let rest = Colour::WHITE + through * -1.0;
        let reflectance = self.reflectance(hit.primitive, hit.position);
        let met = match reflectance.is_sheet() {
            true => Colour::grey(self.covered(hit.primitive, hit.position)),
            false => rest,
        };
        // What is met counts as much as it reflects; of an opaque law under a coverage, where connections start from it, all of it.
        let is_black = reflectance.is_black();
        let kept = match is_black || reflectance.is_sheet() {
            true if is_black && !mirrors => 0.0,
            true => (met * reflectance.albedo(cosine)).luminance(),
            false => rest.luminance(),
        };
        let passed = through.luminance();
        if passed == 0.0 {
            return Meeting::Met(met);
        }
        let probability = passed / (passed + kept);
        if kept == 0.0 || rng.chance(probability) {
            Meeting::Through(through / if kept == 0.0 { 1.0 } else { probability })
        } else {
            Meeting::Met(met / (1.0 - probability))
        }
    }

    /// From `hit` straight on along `direction` to where it is met: by chance where a surface reflects what it does not let
    /// through, `mirrors` as in [`Scene::meet`]. The share of weight that gets there.
    pub fn met_from(&self, hit: Hit, direction: DVec3, mirrors: bool, rng: &mut Generator) -> (Option<Hit>, Colour) {
        let (mut hit, mut share) = (hit, Colour::WHITE);
        for _ in 0..MAX_VEILS {
            match self.meet(&hit, direction, mirrors, rng) {
                Meeting::Met(met) => return (Some(hit), share * met),
                Meeting::Through(through) => share = share * through,
            }
            match self.geometry.closest_hit(&self.onward(&hit, direction)) {
                Some(next) => hit = next,
                None => return (None, share),
            }
        }
        (None, Colour::BLACK)
    }
}
