//! Direct light at a receiver, never from particle hits: E_0, and with a reflectance as response K L0.
//!
//! Lights without extent are exact. Area lights are sampled: an emitter chosen in proportion to flux (the choice
//! stratified over the samples), then a direction uniform in its solid angle, which stays bounded at contact. Where
//! the response is peaked, directions drawn from it look for the emitters as well, and the two are weighed by the
//! balance heuristic (Veach and Guibas 1995): each where its density is the higher.

use super::lamps::{Asked, all, some_by_flux};
use super::receiver::Receiver;
use super::spherical_triangle::SphericalTriangle;
use crate::geometry::{Hit, Ray};
use crate::math::{DVec2, DVec3};
use crate::photometry::Colour;
use crate::random::{Generator, evenly};
use crate::scene::{Chosen, Emitter, LightTree, Outlook, Panel, Scene};

/// From this distance in lengths of its longest edge on, a triangle is sampled by area: the geometric factor then
/// varies less than threefold over it, and the solid angle of a tiny triangle need not be computed.
const FAR: f64 = 3.0;

/// Area-light samples of one receiver and batch: proportional to the histories, so that no share of the variance
/// stays when the histories grow.
pub fn emitter_samples(histories: u64) -> u64 {
    (histories / 4).max(1)
}

/// Light from point, spot and directional lights, times the response \[lx or cd/m2\].
pub fn from_lights(scene: &Scene, receiver: &Receiver) -> Colour {
    light_by_light(scene, receiver, &all(scene), |w_in| receiver.response.to(scene, receiver.normal, w_in))
}

/// The same with the response of a matt surface that reflects as much: without the peaks of a narrow lobe. Of many lights some
/// are asked.
pub fn from_lights_as_if_matt(scene: &Scene, receiver: &Receiver, rng: &mut Generator) -> Colour {
    let asked = some_by_flux(scene, rng);
    light_by_light(scene, receiver, &asked, |w_in| receiver.response.as_if_matt(scene, receiver.normal, w_in))
}

fn light_by_light(scene: &Scene, receiver: &Receiver, asked: &[Asked], response: impl Fn(DVec3) -> Colour) -> Colour {
    let lifted = scene.geometry.lift(receiver.position, receiver.normal);
    let mut sum = Colour::BLACK;
    for &(number, weight) in asked {
        let light = &scene.sources.lights[number];
        let (from, w_in, across) = light.at(receiver.position);
        let cosine = -receiver.normal.dot(w_in);
        // At the lamp itself the cosine is NaN, which is not above zero: no light instead of no number.
        if cosine > 0.0 && !across.is_black() {
            let through = match from {
                Some(position) => scene.transmittance(lifted.as_vec3(), position.as_vec3()),
                None => from_afar(scene, &Ray { origin: lifted, direction: -w_in }),
            };
            if !through.is_black() {
                sum += across * through * (weight * cosine) * response(w_in);
            }
        }
    }
    sum
}

/// The share of parallel light against `ray` that gets to its origin, a lifted point.
pub(super) fn from_afar(scene: &Scene, ray: &Ray) -> Colour {
    match scene.straight(ray, f64::INFINITY) {
        (None, share) => share,
        (Some(_), _) => Colour::BLACK,
    }
}

/// Unbiased estimate of the light from emissive triangles by `samples` samples, times the response \[lx or cd/m2\].
pub fn from_emitters(scene: &Scene, receiver: &Receiver, samples: u64, rng: &mut Generator) -> Colour {
    let emitters = &scene.sources.emitters;
    let draw = |from: DVec3, chosen: &Chosen, random: DVec2, rng: &mut Generator| {
        let sight = Sight::new(&emitters[chosen.number], chosen.probability, from);
        sight.map_or(Colour::BLACK, |sight| sample_emitter(scene, receiver, &sight, random, rng))
    };
    let seen = |from: DVec3, hit: &Hit, w_in: DVec3| {
        let number = scene.sources.emitter(hit.primitive)?;
        Some((number, Sight::new(&emitters[number], 1.0, from)?.of_hit(hit, w_in)))
    };
    sampled(scene, receiver, scene.sources.emitter_tree(), (samples, rng), draw, seen)
}

/// The same of luminaires with extent.
pub fn from_panels(scene: &Scene, receiver: &Receiver, samples: u64, rng: &mut Generator) -> Colour {
    let draw = |from: DVec3, chosen: &Chosen, random: DVec2, rng: &mut Generator| {
        let panel = &scene.sources.panels[chosen.number];
        let face = panel.choose_face(from, chosen.within);
        let sight = face.and_then(|(face, probability)| Sight::new(face, chosen.probability * probability, from));
        sight.map_or(Colour::BLACK, |sight| sample_emitter(scene, receiver, &sight.of(panel), random, rng))
    };
    let seen = |from: DVec3, hit: &Hit, w_in: DVec3| {
        let (number, panel, face) = scene.sources.panel_face(hit.primitive)?;
        let sight = Sight::new(face, panel.probability(face, from), from)?;
        Some((number, sight.of(panel).of_hit(hit, w_in)))
    };
    sampled(scene, receiver, scene.sources.panel_tree(), (samples, rng), draw, seen)
}

/// The mean of so many samples of the light of the sources of `tree`. `draw` gets the lifted point, where visibility starts (it and what is
/// drawn must agree on which side of an emitter that is), the source chosen, and a point of the unit square, even over the samples;
/// a peaked response looks as well for the sources that `seen` knows: their number, and luminance and density as if that were chosen,
/// see [`sample_response`].
pub(super) fn sampled(
    scene: &Scene,
    receiver: &Receiver,
    tree: &LightTree,
    (samples, rng): (u64, &mut Generator),
    draw: impl Fn(DVec3, &Chosen, DVec2, &mut Generator) -> Colour,
    seen: impl Fn(DVec3, &Hit, DVec3) -> Option<(usize, (Colour, f64))>,
) -> Colour {
    let from = scene.geometry.lift(receiver.position, receiver.normal);
    let outlook = Outlook::of_point(from, receiver.normal);
    if !tree.gives_light(&outlook) {
        return Colour::BLACK;
    }
    let mut sum = Colour::BLACK;
    let jitter: Vec<f64> = (0..samples).map(|_| rng.uniform()).collect();
    let shift = rng.uniform2();
    for (k, chosen) in (0..).zip(tree.choose(&outlook, &jitter)) {
        sum += draw(from, &chosen, evenly(shift, k), rng);
    }
    if receiver.response.is_peaked() {
        let seen = |hit: &Hit, w_in: DVec3| {
            let (number, (luminance, density)) = seen(from, hit, w_in)?;
            Some((luminance, density * tree.probability(&outlook, number)))
        };
        for _ in 0..samples {
            sum += sample_response(scene, receiver, from, rng, seen);
        }
    }
    sum / samples as f64
}

/// The same from the emitters with the numbers `some` alone, for a receiver whose response is not peaked.
pub fn from_some_emitters(
    scene: &Scene,
    receiver: &Receiver,
    some: &[u32],
    samples: u64,
    rng: &mut Generator,
) -> Colour {
    let lifted = scene.geometry.lift(receiver.position, receiver.normal);
    let mut sum = Colour::BLACK;
    for &number in some {
        let emitter = &scene.sources.emitters[number as usize];
        if let Some(sight) = Sight::new(emitter, 1.0, lifted) {
            let shift = rng.uniform2();
            let sample = |k| sample_emitter(scene, receiver, &sight, evenly(shift, k), rng);
            sum += (0..samples).map(sample).sum::<Colour>();
        }
    }
    sum / samples as f64
}

/// One sample of the light from the emitter in sight.
fn sample_emitter(scene: &Scene, receiver: &Receiver, sight: &Sight, random: DVec2, rng: &mut Generator) -> Colour {
    let Some(point) = sight.sample(random, rng) else { return Colour::BLACK };
    let w_in = (sight.from - point).normalize();
    let cosine = -receiver.normal.dot(w_in);
    let target = scene.geometry.lift(point, sight.normal).as_vec3();
    let through = if cosine > 0.0 { scene.transmittance(sight.from.as_vec3(), target) } else { Colour::BLACK };
    if through.is_black() {
        return Colour::BLACK;
    }
    let both = sight.density(point) + density_of_response(scene, receiver, w_in);
    sight.luminance(point, w_in) * through * (cosine / both) * receiver.response.to(scene, receiver.normal, w_in)
}

/// One sample of the light that emitters send where the peaked response looks: those of which `seen` knows, from the hit and the
/// propagation direction, the luminance and the density with which they are drawn otherwise.
fn sample_response(
    scene: &Scene,
    receiver: &Receiver,
    from: DVec3,
    rng: &mut Generator,
    seen: impl Fn(&Hit, DVec3) -> Option<(Colour, f64)>,
) -> Colour {
    let Some((direction, weight)) = receiver.response.sample(scene, receiver.normal, rng) else {
        return Colour::BLACK;
    };
    let (hit, share) = scene.straight(&Ray { origin: from, direction }, f64::INFINITY);
    let Some((luminance, drawn)) = hit.and_then(|hit| seen(&hit, -direction)) else { return Colour::BLACK };
    let density = density_of_response(scene, receiver, -direction);
    luminance * share * weight * (density / (density + drawn))
}

/// Density of directions drawn from the response, 0 where it is not peaked and none are drawn \[1/sr\].
pub(super) fn density_of_response(scene: &Scene, receiver: &Receiver, w_in: DVec3) -> f64 {
    let peaked = receiver.response.is_peaked();
    if peaked { receiver.response.pdf(scene, receiver.normal, w_in) } else { 0.0 }
}

/// An emitter seen from a point on its lit side.
struct Sight<'a> {
    emitter: &'a Emitter,
    /// The luminaire of which it is a face, if it is one.
    panel: Option<&'a Panel>,
    /// Probability of its choice.
    probability: f64,
    from: DVec3,
    /// Unit normal on the side of the point.
    normal: DVec3,
    /// None from afar, where the emitter is sampled by area.
    triangle: Option<SphericalTriangle>,
}

impl<'a> Sight<'a> {
    /// `emitter` seen from the point `from`; `None` where its side there is dark.
    fn new(emitter: &'a Emitter, probability: f64, from: DVec3) -> Option<Self> {
        let [a, b, c] = emitter.corners;
        let side = emitter.normal.dot(from - a);
        if side == 0.0 || (side < 0.0 && !emitter.double_sided) {
            return None;
        }
        let far = ((a + b + c) / 3.0 - from).length_squared() > FAR * FAR * emitter.longest_edge_squared();
        let triangle = (!far).then(|| SphericalTriangle::new(&emitter.corners, from));
        Some(Sight { emitter, panel: None, probability, from, normal: emitter.normal * side.signum(), triangle })
    }

    /// The same as a face of `panel`.
    fn of(self, panel: &'a Panel) -> Self {
        Sight { panel: Some(panel), ..self }
    }

    /// Luminance of light from `point` with the propagation direction `w_in` \[cd/m2\].
    fn luminance(&self, point: DVec3, w_in: DVec3) -> Colour {
        self.panel.map_or_else(|| self.emitter.luminance_at(point), |panel| panel.luminance(w_in))
    }

    /// Luminance of light with the propagation direction `w_in` from where a ray met it, and the density with which that is drawn.
    fn of_hit(&self, hit: &Hit, w_in: DVec3) -> (Colour, f64) {
        (self.luminance(hit.position, w_in), self.density(hit.position))
    }

    /// A point of the emitter. The luminance of a luminaire grows without bound where it is seen edge-on and still shines: by area
    /// that is bounded, by solid angle contact is, so half of the points are drawn in each of the two ways.
    fn sample(&self, random: DVec2, rng: &mut Generator) -> Option<DVec3> {
        let by_area = self.triangle.is_none() || (self.panel.is_some() && rng.uniform() < 0.5);
        let Some(triangle) = self.triangle.as_ref().filter(|_| !by_area) else {
            return Some(self.emitter.point(random));
        };
        let direction = triangle.sample(random);
        let distance = self.normal.dot(self.emitter.corners[0] - self.from) / self.normal.dot(direction);
        (distance > 0.0 && distance.is_finite()).then(|| self.from + distance * direction)
    }

    /// Density in solid angle with which `point` is drawn, the choice of the emitter included \[1/sr\].
    fn density(&self, point: DVec3) -> f64 {
        // What the area would be as a solid angle, were all of it where the point is.
        let by_area = || {
            let way = self.from - point;
            let d2 = way.length_squared();
            self.emitter.area * self.normal.dot(way) / (d2 * d2.sqrt())
        };
        match (&self.triangle, self.panel) {
            (Some(triangle), None) => self.probability / triangle.solid_angle,
            (Some(triangle), Some(_)) => 0.5 * self.probability * (1.0 / triangle.solid_angle + 1.0 / by_area()),
            (None, _) => self.probability / by_area(),
        }
    }
}
