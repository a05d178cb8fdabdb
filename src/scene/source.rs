//! Light sources: emissive triangles, and the choice among all sources; emission of histories (docs/method.md, "Sources").
//!
//! A history chooses its source in proportion to luminous flux and leaves it with the exact distribution of its
//! emission, so every history starts with the same luminous weight: the flux of all sources together.

use super::body::Body;
use super::light::Light;
use super::panel::Panel;
use super::textures::{Glow, Place};
use crate::geometry::Geometry;
use crate::math::{DVec3, PI, to_world};
use crate::photometry::Colour;
use crate::random::{Generator, cosine_hemisphere};

/// An emissive triangle: a Lambert area light.
#[derive(Clone, Debug)]
pub struct Emitter {
    /// The triangle.
    pub primitive: u32,
    /// Corners \[m\].
    pub corners: [DVec3; 3],
    /// Unit normal of the front.
    pub normal: DVec3,
    /// Area \[m2\].
    pub area: f64,
    /// Emitted luminance \[cd/m2\]; where it varies about its mean, by which the emitter is chosen.
    pub luminance: Colour,
    /// True when the back emits as well.
    pub double_sided: bool,
    /// How it varies.
    glow: Option<Box<Glow>>,
}

impl Emitter {
    /// The triangle `primitive` of `geometry`.
    pub(super) fn of_triangle(geometry: &Geometry, primitive: u32, luminance: Colour, double_sided: bool) -> Self {
        let [a, b, c] = geometry.triangle(primitive);
        let across = (b - a).cross(c - a);
        let (normal, area) = (across.normalize_or_zero(), 0.5 * across.length());
        Emitter { primitive, corners: [a, b, c], normal, area, luminance, double_sided, glow: None }
    }

    /// The same, one of `count`, with a luminance that varies.
    pub(super) fn glowing(self, glow: Glow, count: usize) -> Self {
        Emitter { luminance: glow.mean(count), glow: Some(Box::new(glow)), ..self }
    }

    /// Luminance emitted at `position` \[cd/m2\].
    pub fn luminance_at(&self, position: DVec3) -> Colour {
        match &self.glow {
            None => self.luminance,
            Some(glow) => glow.at(Place::new(self.primitive, self.corners, position).weights),
        }
    }

    /// Flux by which it is chosen \[lm\].
    fn flux(&self) -> Colour {
        self.flux_of(self.luminance)
    }

    /// Flux with `luminance` all over \[lm\].
    fn flux_of(&self, luminance: Colour) -> Colour {
        luminance * (PI * self.area * if self.double_sided { 2.0 } else { 1.0 })
    }

    /// Square of the length of its longest edge \[m2\].
    pub fn longest_edge_squared(&self) -> f64 {
        let [a, b, c] = self.corners;
        a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a))
    }

    /// The point with barycentric coordinates uniform in area.
    pub fn point(&self, u: crate::math::DVec2) -> DVec3 {
        let [a, b, c] = self.corners;
        let s = u.x.sqrt();
        a * (1.0 - s) + b * (s * (1.0 - u.y)) + c * (s * u.y)
    }
}

/// A history at its start.
#[derive(Clone, Copy, Debug)]
pub struct Emission {
    /// Where the first ray starts \[m\].
    pub origin: DVec3,
    /// Its direction.
    pub direction: DVec3,
    /// W_1, the flux weight with which it arrives at the first vertex \[lm\].
    pub weight: Colour,
}

/// All sources, with the choice in proportion to flux.
#[derive(Clone, Debug, Default)]
pub struct Sources {
    /// Lights without extent.
    pub lights: Vec<Light>,
    /// Emissive triangles, in the order of their primitives.
    pub emitters: Vec<Emitter>,
    /// Luminaires with extent, in the order of their primitives.
    pub panels: Vec<Panel>,
    /// Running sum of luminous flux over the lights \[lm\].
    light_flux: Vec<f64>,
    /// The same over the emitters, from zero: beside a lamp of 10^12 lm a panel of 1 lm keeps its digits.
    emitter_flux: Vec<f64>,
    /// Star-shaped objects that emit.
    pub bodies: Vec<Body>,
    /// Running sum of luminous flux over the bodies \[lm\].
    body_flux: Vec<f64>,
    /// The same over the panels.
    panel_flux: Vec<f64>,
    /// Centre and radius of the sphere that parallel light must cover \[m\].
    covered: (DVec3, f64),
}

impl Sources {
    /// Joins `lights`, `emitters`, `panels` and `bodies` over a scene bounded by `covered`; sources without flux are left out.
    pub fn new(
        lights: Vec<Light>,
        emitters: Vec<Emitter>,
        panels: Vec<Panel>,
        bodies: Vec<Body>,
        covered: (DVec3, f64),
    ) -> Self {
        let lit = |flux: Colour| flux.luminance() > 0.0;
        let lights: Vec<Light> = lights.into_iter().filter(|l| lit(l.flux(covered.1))).collect();
        let emitters: Vec<Emitter> = emitters.into_iter().filter(|e| lit(e.flux())).collect();
        let light_flux = running_sum(lights.iter().map(|l| l.flux(covered.1)));
        let emitter_flux = running_sum(emitters.iter().map(Emitter::flux));
        let panels: Vec<Panel> = panels.into_iter().filter(|p| lit(p.luminaire.flux())).collect();
        let panel_flux = running_sum(panels.iter().map(|p| p.luminaire.flux()));
        let bodies: Vec<Body> = bodies.into_iter().filter(|b| lit(b.flux())).collect();
        let body_flux = running_sum(bodies.iter().map(Body::flux));
        Sources { lights, emitters, panels, bodies, light_flux, emitter_flux, panel_flux, body_flux, covered }
    }

    /// Number of sources.
    pub fn len(&self) -> usize {
        self.lights.len() + self.emitters.len() + self.panels.len() + self.bodies.len()
    }

    /// True in the dark.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Luminous flux of all sources \[lm\].
    pub fn flux(&self) -> f64 {
        last(&self.light_flux) + last(&self.emitter_flux) + last(&self.panel_flux) + last(&self.body_flux)
    }

    /// Chooses a face of a panel by `u` in [0, 1), the panel in proportion to flux and the face to area: the two, and their
    /// probability.
    pub fn choose_face(&self, u: f64) -> (&Panel, &Emitter, f64) {
        let all = last(&self.panel_flux);
        let number = choose(&self.panel_flux, u * all);
        let panel = &self.panels[number];
        let own = panel.luminaire.flux().luminance();
        let mut left = ((u * all - (self.panel_flux[number] - own)) / own).clamp(0.0, 1.0) * panel.area;
        let reached = |face: &&Emitter| {
            left -= face.area;
            left < 0.0
        };
        let face = panel.faces.iter().find(reached).unwrap_or(&panel.faces[panel.faces.len() - 1]);
        (panel, face, self.face_probability(panel, face))
    }

    /// The panel of which the triangle `primitive` is a face, and the face.
    pub fn panel_face(&self, primitive: u32) -> Option<(&Panel, &Emitter)> {
        let number = self.panels.partition_point(|panel| panel.faces[0].primitive <= primitive).checked_sub(1)?;
        let panel = &self.panels[number];
        let face = panel.faces.get((primitive - panel.faces[0].primitive) as usize)?;
        Some((panel, face))
    }

    /// Probability with which [`Sources::choose_face`] chooses `face` of `panel`.
    pub fn face_probability(&self, panel: &Panel, face: &Emitter) -> f64 {
        panel.luminaire.flux().luminance() / last(&self.panel_flux) * face.area / panel.area
    }

    /// Chooses an emitter in proportion to flux by `u` in [0, 1): the emitter and its probability.
    pub fn choose_emitter(&self, u: f64) -> (&Emitter, f64) {
        let (number, probability) = self.choose_number(u);
        (&self.emitters[number], probability)
    }

    /// The same, the emitter by its number.
    pub fn choose_number(&self, u: f64) -> (usize, f64) {
        let all = last(&self.emitter_flux);
        let number = choose(&self.emitter_flux, u * all);
        (number, self.emitters[number].flux().luminance() / all)
    }

    /// The emitter that is the triangle `primitive`, with its probability in [`Sources::choose_emitter`].
    pub fn emitter(&self, primitive: u32) -> Option<(&Emitter, f64)> {
        let index = self.emitters.binary_search_by_key(&primitive, |e| e.primitive).ok()?;
        let emitter = &self.emitters[index];
        Some((emitter, emitter.flux().luminance() / last(&self.emitter_flux)))
    }

    /// Chooses a body in proportion to flux by `u` in [0, 1): the body and its probability.
    pub fn choose_body(&self, u: f64) -> (&Body, f64) {
        let all = last(&self.body_flux);
        let body = &self.bodies[choose(&self.body_flux, u * all)];
        (body, body.flux().luminance() / all)
    }

    /// The body that is the surface `primitive`, with its probability in [`Sources::choose_body`].
    pub fn body(&self, primitive: u32) -> Option<(&Body, f64)> {
        let body = self.bodies.iter().find(|body| body.primitive == primitive)?;
        Some((body, body.flux().luminance() / last(&self.body_flux)))
    }

    /// The emitters with their numbers.
    pub fn numbered(&self) -> impl Iterator<Item = (u32, &Emitter)> {
        (0..).zip(&self.emitters)
    }

    /// Starts a history. With a single source no number is drawn for the choice.
    pub fn emit(&self, geometry: &Geometry, rng: &mut Generator) -> Emission {
        let mut target = if self.len() == 1 { 0.0 } else { rng.uniform() * self.flux() };
        let kinds = [&self.light_flux, &self.emitter_flux, &self.panel_flux, &self.body_flux];
        // Rounding may leave a rest behind the last source.
        let mut chosen = kinds.iter().rposition(|sums| !sums.is_empty()).expect("histories start where there is light");
        for (kind, sums) in kinds.iter().enumerate().take(chosen) {
            if target < last(sums) {
                chosen = kind;
                break;
            }
            target -= last(sums);
        }
        let number = choose(kinds[chosen], target);
        let ((origin, direction), flux) = match chosen {
            0 => {
                let light = &self.lights[number];
                (light.start(self.covered, rng.uniform2()), light.flux(self.covered.1))
            }
            1 => return self.emit_triangle(&self.emitters[number], geometry, rng),
            2 => (self.panels[number].emit(geometry, rng), self.panels[number].luminaire.flux()),
            _ => (self.bodies[number].emit(geometry, rng), self.bodies[number].flux()),
        };
        // flux over the probability of the choice: the colour of the source, the luminous flux of all.
        Emission { origin, direction, weight: flux * (self.flux() / flux.luminance()) }
    }

    /// Starts a history at a point of `emitter`, uniform in area, with the luminance of that point.
    fn emit_triangle(&self, emitter: &Emitter, geometry: &Geometry, rng: &mut Generator) -> Emission {
        let point = emitter.point(rng.uniform2());
        let back = emitter.double_sided && rng.uniform() < 0.5;
        let normal = if back { -emitter.normal } else { emitter.normal };
        let direction = to_world(normal, cosine_hemisphere(rng.uniform2()));
        let weight = emitter.flux_of(emitter.luminance_at(point)) * (self.flux() / emitter.flux().luminance());
        Emission { origin: geometry.lift(point, normal), direction, weight }
    }
}

fn running_sum(fluxes: impl Iterator<Item = Colour>) -> Vec<f64> {
    let add = |sum: &mut f64, flux: Colour| {
        *sum += flux.luminance();
        Some(*sum)
    };
    fluxes.scan(0.0, add).collect()
}

fn last(sums: &[f64]) -> f64 {
    sums.last().copied().unwrap_or(0.0)
}

/// Index of the source in whose share of the running sum `target` lies.
fn choose(sums: &[f64], target: f64) -> usize {
    sums.partition_point(|&sum| sum <= target).min(sums.len() - 1)
}
