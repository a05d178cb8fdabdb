//! Receivers: a point, a normal and a response, whatever measures there.
//!
//! A lux-meter's response is 1 (its cosine stands in the geometric factor); the response of a point seen by an eye
//! is f(r; u -> l), times what mirrors on the way to the eye leave of it. Pixels, goniometer directions and grid
//! points differ in nothing else.

use crate::geometry::{Hit, Ray};
use crate::math::{DVec3, PI, to_world};
use crate::photometry::Colour;
use crate::random::{Generator, cosine_hemisphere};
use crate::scene::{Delta, Reflectance, Scene, weight_over_tolerated};

/// Mirrors that an eye ray follows before it is given up; facing perfect mirrors would be followed for ever.
const MAX_MIRRORS: u32 = 256;

/// A point (and direction) where the quantity is wanted.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// Position \[m\].
    pub position: DVec3,
    /// Unit normal; only light from its side counts.
    pub normal: DVec3,
    /// What arriving light is worth.
    pub response: Response,
}

impl Receiver {
    /// The receiver of light that arrives on the other side, where the surface sends it through.
    pub fn behind(&self, scene: &Scene) -> Option<Receiver> {
        let Response::Reflectance { primitive, .. } = self.response else { return None };
        let (_, tau) = scene.surface(primitive).reflectance.sides()?;
        (!tau.is_black()).then_some(Receiver { normal: -self.normal, ..*self })
    }

    /// This receiver or that behind it, where there is one: one of the two by chance, and its weight over the probability.
    pub fn on_one_side(self, scene: &Scene, rng: &mut Generator) -> Receiver {
        let Some(behind) = self.behind(scene) else { return self };
        let shares = [self, behind].map(|r| r.response.side(scene, r.normal).unwrap_or(Colour::BLACK).luminance());
        let here = shares[0] / (shares[0] + shares[1]);
        let (chosen, probability) = if rng.chance(here) { (self, here) } else { (behind, 1.0 - here) };
        chosen.weighted(1.0 / probability)
    }

    /// The same receiver, of which all light counts `factor` times.
    pub fn weighted(mut self, factor: f64) -> Receiver {
        if let Response::Reflectance { attenuation, .. } = &mut self.response {
            *attenuation *= factor;
        }
        self
    }
}

/// What light that arrives at a receiver is worth.
#[derive(Clone, Copy, Debug)]
pub enum Response {
    /// Illuminance: 1.
    Cosine,
    /// Luminance towards an eye: f(r; u -> l) times `attenuation` \[1/sr\].
    Reflectance {
        /// The surface seen.
        primitive: u32,
        /// Where on it \[m\].
        position: DVec3,
        /// l, from the receiver to the eye or the last mirror.
        to_eye: DVec3,
        /// What the mirrors on the way to the eye reflect, over the probability of having followed them.
        attenuation: Colour,
        /// Of a point that continues another receiver: b/(G s) of the step between them. Connections to the other carry
        /// the share min(1, carried/s) of light with the peak s here, see [`super::continuation`]. Else 0 \[1\].
        carried: f64,
        /// Whether the law has a narrow lobe towards l: connections to it alone would be spiky.
        peaked: bool,
    },
}

impl Response {
    /// Luminance of `primitive` at `position` with `normal` towards the eye, with the attenuation and the carried share given.
    pub fn reflectance(
        scene: &Scene,
        (primitive, position, normal): (u32, DVec3, DVec3),
        to_eye: DVec3,
        attenuation: Colour,
        carried: f64,
    ) -> Self {
        let peaked = scene.reflectance(primitive, position).is_peaked_at(to_eye.dot(normal));
        Response::Reflectance { primitive, position, to_eye, attenuation, carried, peaked }
    }

    /// The response at a receiver with `normal` where it does not depend on the direction of arrival: of lux-meters, Lambert and opal
    /// surfaces.
    pub fn constant(&self, scene: &Scene, normal: DVec3) -> Option<Colour> {
        match self {
            Response::Cosine => Some(Colour::WHITE),
            Response::Reflectance { primitive, position, attenuation, carried, .. } => {
                let rho = self.side(scene, normal).or_else(|| scene.reflectance(*primitive, *position).lambert())?;
                Some(rho * *attenuation * (left(*carried, 1.0) / PI))
            }
        }
    }

    /// On a surface that sends light to both sides, what it sends to the eye of the light that arrives on the side of `normal`: it
    /// reflects towards an eye on this side, and transmits towards one on the other.
    pub fn side(&self, scene: &Scene, normal: DVec3) -> Option<Colour> {
        let Response::Reflectance { primitive, to_eye, .. } = self else { return None };
        let (rho, tau) = scene.surface(*primitive).reflectance.sides()?;
        Some(if to_eye.dot(normal) > 0.0 { rho } else { tau })
    }

    /// The response to light with propagation direction `w_in` at a receiver with `normal`.
    pub fn to(&self, scene: &Scene, normal: DVec3, w_in: DVec3) -> Colour {
        self.with_peak(scene, normal, w_in).0
    }

    /// The same, and how peaked it is there: 1 for lux-meters and for every response that is not peaked.
    pub fn with_peak(&self, scene: &Scene, normal: DVec3, w_in: DVec3) -> (Colour, f64) {
        match self {
            Response::Cosine => (Colour::WHITE, 1.0),
            Response::Reflectance { primitive, position, to_eye, attenuation, carried, peaked } => {
                let reflectance = scene.reflectance(*primitive, *position);
                let f = reflectance.evaluate(normal, w_in, *to_eye);
                let peak = if *peaked { weight_over_tolerated(f) } else { 1.0 };
                (f * *attenuation * left(*carried, reflectance.peak(f)), peak)
            }
        }
    }

    /// The response of a matt surface that reflects as much of the light propagating along `w_in`, all of it carried.
    pub fn as_if_matt(&self, scene: &Scene, normal: DVec3, w_in: DVec3) -> Colour {
        match self {
            Response::Cosine => Colour::WHITE,
            Response::Reflectance { primitive, position, attenuation, .. } => {
                scene.reflectance(*primitive, *position).albedo(-w_in.dot(normal)) * *attenuation / PI
            }
        }
    }

    /// True when connections to a receiver with this response are spiky.
    pub fn is_peaked(&self) -> bool {
        matches!(self, Response::Reflectance { peaked: true, .. })
    }

    /// Draws a direction out of a receiver with `normal`: the direction v, and response x cosine / density of light that
    /// arrives against it. `None` where nothing or a delta component was drawn.
    pub fn sample(&self, scene: &Scene, normal: DVec3, rng: &mut Generator) -> Option<(DVec3, Colour)> {
        match self {
            Response::Cosine => Some((to_world(normal, cosine_hemisphere(rng.uniform2())), Colour::grey(PI))),
            Response::Reflectance { primitive, position, to_eye, attenuation, carried, .. } => {
                if let Some(colour) = self.side(scene, normal) {
                    let direction = to_world(normal, cosine_hemisphere(rng.uniform2()));
                    return Some((direction, colour * *attenuation * left(*carried, 1.0)));
                }
                let reflectance = scene.reflectance(*primitive, *position);
                // Laws are reciprocal: light sent back from the eye leaves in the directions that the eye receives.
                let scattered = reflectance.sample(normal, -*to_eye, rng).filter(|s| !s.delta)?;
                let peak = match reflectance.is_peaked() {
                    true => reflectance.peak(reflectance.evaluate(normal, -scattered.direction, *to_eye)),
                    false => 1.0,
                };
                Some((scattered.direction, scattered.factor * *attenuation * left(*carried, peak)))
            }
        }
    }

    /// Density with which [`Response::sample`] draws the direction against `w_in` \[1/sr\].
    pub fn pdf(&self, scene: &Scene, normal: DVec3, w_in: DVec3) -> f64 {
        match self {
            Response::Cosine => (-w_in.dot(normal)).max(0.0) / PI,
            Response::Reflectance { primitive, position, to_eye, .. } => {
                scene.reflectance(*primitive, *position).pdf(normal, -*to_eye, -w_in)
            }
        }
    }
}

/// What connections that carry the share `carried`/`peak` leave to a continuation.
fn left(carried: f64, peak: f64) -> f64 {
    1.0 - (carried / peak).min(1.0)
}

/// What an eye ray meets.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// L0: emission of the surfaces seen, behind mirrors too \[cd/m2\].
    pub emitted: Colour,
    /// The reflecting surface point where luminance is wanted.
    pub receiver: Option<Receiver>,
    /// The same point for light that arrives on its other side and is sent through it.
    pub behind: Option<Receiver>,
}

impl Seen {
    /// Nothing.
    pub const NOTHING: Seen = Seen { emitted: Colour::BLACK, receiver: None, behind: None };
}

/// Follows an eye ray over mirrors to the first point with a finite law of reflection.
pub fn look(scene: &Scene, ray: &Ray, rng: &mut Generator) -> Seen {
    match scene.geometry.closest_hit(ray) {
        Some(hit) => look_at(scene, hit, ray.direction, rng),
        None => Seen { emitted: scene.beyond(ray.direction), ..Seen::NOTHING },
    }
}

/// The same for an eye ray with `direction` that has met `hit`.
///
/// Veils are looked through. At a surface that has both a mirror and a finite part one of them is drawn, in proportion to their reflectance.
pub fn look_at(scene: &Scene, mut hit: Hit, mut direction: DVec3, rng: &mut Generator) -> Seen {
    let mut seen = Seen::NOTHING;
    let mut attenuation = Colour::WHITE;
    for _ in 0..MAX_MIRRORS {
        let (met, share) = scene.met_from(hit, direction, true, rng);
        let Some(met) = met else {
            seen.emitted += attenuation * share * scene.beyond(direction);
            break;
        };
        (hit, attenuation) = (met, attenuation * share);
        if scene.absorbs(&hit) {
            break;
        }
        let reflectance = scene.reflectance(hit.primitive, hit.position);
        seen.emitted += attenuation * scene.emitted(&hit, -direction);
        if matches!(*reflectance, Reflectance::Delta(Delta::Glass(_))) {
            let Some(scattered) = scene.scatter_eye_ray(&hit, direction, rng) else { break };
            (attenuation, direction) = (attenuation * scattered.factor, scattered.direction);
            match scene.geometry.closest_hit(&scene.leaving(&hit, &scattered)) {
                Some(next) => hit = next,
                None => {
                    seen.emitted += attenuation * scene.beyond(direction);
                    break;
                }
            }
            continue;
        }
        let cosine = -direction.dot(hit.normal);
        let mirror = reflectance.delta_reflectance(cosine);
        let follow = mirror.map_or(0.0, |f| follow_probability(&reflectance, f, cosine));
        // Without a choice no number is drawn.
        let stops = follow == 0.0 || (follow < 1.0 && rng.uniform() >= follow);
        if stops {
            seen.receiver = receiver(scene, &hit, direction, attenuation / (1.0 - follow));
            seen.behind = seen.receiver.as_ref().and_then(|r| r.behind(scene));
            break;
        }
        attenuation = attenuation * mirror.unwrap_or(Colour::BLACK) / follow;
        direction = (direction + 2.0 * cosine * hit.normal).normalize();
        let origin = scene.geometry.lift(hit.position, hit.normal);
        match scene.geometry.closest_hit(&Ray { origin, direction }) {
            Some(next) => hit = next,
            None => {
                seen.emitted += attenuation * scene.beyond(direction);
                break;
            }
        }
    }
    seen
}

/// The receiver at `hit`, if the surface there reflects.
fn receiver(scene: &Scene, hit: &Hit, direction: DVec3, attenuation: Colour) -> Option<Receiver> {
    let (primitive, to_eye) = (hit.primitive, -direction);
    let response = Response::reflectance(scene, (primitive, hit.position, hit.normal), to_eye, attenuation, 0.0);
    let reflects = !scene.reflectance(hit.primitive, hit.position).is_black();
    reflects.then_some(Receiver { position: hit.position, normal: hit.normal, response })
}

/// Probability of following the mirror with reflectance `f` rather than stopping at the finite part.
fn follow_probability(reflectance: &Reflectance, f: Colour, cosine: f64) -> f64 {
    if reflectance.is_black() {
        return 1.0;
    }
    let (mirror, all) = (f.luminance(), reflectance.albedo(cosine).luminance());
    // Neither branch may become so rare that its weight grows without bound.
    if all > 0.0 { (mirror / all).clamp(0.1, 0.9) } else { 0.5 }
}
