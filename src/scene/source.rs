//! Light sources: emissive triangles, and the choice among all sources; emission of histories (docs/method.md, "Sources").
//!
//! A history chooses its source in proportion to luminous flux and leaves it with the exact distribution of its
//! emission, so every history starts with the same luminous weight: the flux of all sources together.

use super::beam::Beam;
use super::body::Body;
use super::choice::Choice;
use super::environment::Environment;
use super::light::Light;
use super::light_tree::LightTree;
use super::panel::Panel;
use super::sky::Sky;
use super::textures::{Glow, Place};
use crate::geometry::Geometry;
use crate::math::{DVec3, PI, to_world};
use crate::photometry::Colour;
use crate::random::{Generator, cosine_hemisphere};

/// Of so many emitters, or fewer, receivers share points.
const FEW_EMITTERS: usize = 64;

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
    pub(super) fn flux(&self) -> Colour {
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
    /// How much more often than in proportion to flux it is drawn, at most 1: small for what comes beside the openings of daylight.
    pub emphasis: f64,
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
    /// The choice of a light in proportion to luminous flux \[lm\].
    light_flux: Choice,
    /// The same of an emitter, on its own: beside a lamp of 10^12 lm a panel of 1 lm keeps its digits.
    emitter_flux: Choice,
    /// Star-shaped objects that emit.
    pub bodies: Vec<Body>,
    /// The same of a body.
    body_flux: Choice,
    /// The same of a panel.
    panel_flux: Choice,
    /// Bounds of the lights; none of parallel light.
    beams: Vec<Option<Beam>>,
    /// The choice of an emitter, a panel or a body for a receiver.
    trees: [LightTree; 3],
    /// Light from outside, where there is a sky or an opening; parallel light then starts from there.
    pub environment: Option<Environment>,
    /// The choice among the ways of drawing light from outside \[lm\].
    environment_flux: Choice,
    /// Centre and radius of the sphere that parallel light must cover \[m\].
    covered: (DVec3, f64),
}

impl Sources {
    /// Joins `lights`, `emitters`, `panels` and `bodies` over what is in `geometry`, in the sphere `covered`; sources without flux are left out.
    pub fn new(
        lights: Vec<Light>,
        emitters: Vec<Emitter>,
        panels: Vec<Panel>,
        bodies: Vec<Body>,
        geometry: &Geometry,
        covered: (DVec3, f64),
    ) -> Self {
        let lit = |flux: Colour| flux.luminance() > 0.0;
        let lights: Vec<Light> = lights.into_iter().filter(|l| lit(l.flux(covered.1))).collect();
        let emitters: Vec<Emitter> = emitters.into_iter().filter(|e| lit(e.flux())).collect();
        let light_flux = Choice::by_flux(lights.iter().map(|l| l.flux(covered.1)));
        let emitter_flux = Choice::by_flux(emitters.iter().map(Emitter::flux));
        let panels: Vec<Panel> = panels.into_iter().filter(|p| lit(p.luminaire.flux())).collect();
        let panel_flux = Choice::by_flux(panels.iter().map(|p| p.luminaire.flux()));
        let bodies: Vec<Body> = bodies.into_iter().filter(|b| lit(b.flux())).collect();
        let body_flux = Choice::by_flux(bodies.iter().map(Body::flux));
        let beams = lights.iter().map(Beam::of_light).collect();
        let middles: Vec<DVec3> = emitters.iter().map(|e| e.corners.iter().sum::<DVec3>() / 3.0).collect();
        let of_emitters = LightTree::new(&middles, &emitter_flux, |i| Beam::of_emitter(&emitters[i]));
        let middles: Vec<DVec3> = panels.iter().map(|p| p.luminaire.position).collect();
        let of_panels = LightTree::new(&middles, &panel_flux, |i| Beam::of_panel(&panels[i]));
        let balls: Vec<(DVec3, f64)> = bodies.iter().map(|b| b.ball(geometry)).collect();
        let middles: Vec<DVec3> = balls.iter().map(|(center, _)| *center).collect();
        let of_bodies = LightTree::new(&middles, &body_flux, |i| Beam::of_body(&bodies[i], balls[i]));
        Sources {
            lights,
            emitters,
            panels,
            light_flux,
            emitter_flux,
            bodies,
            body_flux,
            panel_flux,
            beams,
            trees: [of_emitters, of_panels, of_bodies],
            covered,
            environment: None,
            environment_flux: Choice::default(),
        }
    }

    /// The same sources and the light from outside.
    pub(super) fn under(mut self, environment: Environment) -> Self {
        let own = |light: &Light| match light {
            Light::Directional { .. } => Colour::BLACK,
            _ => light.flux(self.covered.1),
        };
        self.light_flux = Choice::by_flux(self.lights.iter().map(own));
        self.environment_flux = Choice::new(environment.fluxes().collect());
        self.environment = Some(environment);
        self
    }

    /// The sky, if there is one.
    pub fn sky(&self) -> Option<&Sky> {
        self.environment.as_ref()?.sky.as_ref()
    }

    /// Number of sources.
    pub fn len(&self) -> usize {
        let sky = usize::from(self.sky().is_some());
        self.lights.len() + self.emitters.len() + self.panels.len() + self.bodies.len() + sky
    }

    /// True in the dark.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Luminous flux of all sources \[lm\]; of those outside what falls on the scene and around it.
    pub fn flux(&self) -> f64 {
        let Some(environment) = &self.environment else { return self.started() };
        let parallel = self.lights.iter().filter(|light| matches!(light, Light::Directional { .. }));
        let outside: Colour = parallel.map(|light| light.flux(self.covered.1)).sum();
        self.started() - self.environment_flux.all() + outside.luminance() + environment.sky_flux()
    }

    /// Luminous weight with which a history starts, its mean where light comes from outside \[lm\]: the flux of all sources, but
    /// with openings only about what comes through them.
    pub fn started(&self) -> f64 {
        let inside = self.light_flux.all() + self.emitter_flux.all() + self.panel_flux.all() + self.body_flux.all();
        inside + self.environment_flux.all()
    }

    /// Bounds of the lights, `None` of parallel light.
    pub fn beams(&self) -> &[Option<Beam>] {
        &self.beams
    }

    /// The choice of a light in proportion to flux.
    pub fn lights_by_flux(&self) -> &Choice {
        &self.light_flux
    }

    /// The choice of an emitter for a receiver.
    pub fn emitter_tree(&self) -> &LightTree {
        &self.trees[0]
    }

    /// The choice of a panel for a receiver.
    pub fn panel_tree(&self) -> &LightTree {
        &self.trees[1]
    }

    /// The choice of a body for a receiver.
    pub fn body_tree(&self) -> &LightTree {
        &self.trees[2]
    }

    /// True where there are emitters, and so few that points of them serve all receivers.
    pub fn shares_points(&self) -> bool {
        (1..=FEW_EMITTERS).contains(&self.emitters.len())
    }

    /// The panel of which the triangle `primitive` is a face: its number, it, and the face.
    pub fn panel_face(&self, primitive: u32) -> Option<(usize, &Panel, &Emitter)> {
        let number = self.panel_with(primitive)?;
        let panel = &self.panels[number];
        let face = panel.faces.get((primitive - panel.faces[0].primitive) as usize)?;
        Some((number, panel, face))
    }

    /// Number of the last panel whose faces begin at `primitive` or before.
    fn panel_with(&self, primitive: u32) -> Option<usize> {
        self.panels.partition_point(|panel| panel.faces[0].primitive <= primitive).checked_sub(1)
    }

    /// Chooses an emitter in proportion to flux by `u` in [0, 1): its number and probability.
    pub fn choose_emitter(&self, u: f64) -> (usize, f64) {
        let number = self.emitter_flux.choose(u);
        (number, self.emitter_flux.probability(number))
    }

    /// The number of the emitter that is the triangle `primitive`.
    pub fn emitter(&self, primitive: u32) -> Option<usize> {
        self.emitters.binary_search_by_key(&primitive, |e| e.primitive).ok()
    }

    /// The number of the body that is the surface `primitive`.
    pub fn body(&self, primitive: u32) -> Option<usize> {
        self.bodies.iter().position(|body| body.primitive == primitive)
    }

    /// Starts a history. With a single source no number is drawn for the choice.
    pub fn emit(&self, geometry: &Geometry, rng: &mut Generator) -> Emission {
        let kinds = [&self.light_flux, &self.emitter_flux, &self.panel_flux, &self.body_flux, &self.environment_flux];
        let started = self.started();
        let alone = kinds.iter().map(|choice| choice.len()).sum::<usize>() == 1;
        let mut target = if alone { 0.0 } else { rng.uniform() * started };
        // Rounding may leave a rest behind the last source.
        let mut chosen = kinds.iter().rposition(|kind| !kind.is_empty()).expect("histories start where there is light");
        for (kind, fluxes) in kinds.iter().enumerate().take(chosen) {
            if target < fluxes.all() {
                chosen = kind;
                break;
            }
            target -= fluxes.all();
        }
        let number = kinds[chosen].at(target);
        let ((origin, direction), flux) = match chosen {
            0 => {
                let light = &self.lights[number];
                (light.start(self.covered, rng.uniform2()), light.flux(self.covered.1))
            }
            1 => return self.emit_triangle(&self.emitters[number], geometry, rng),
            2 => (self.panels[number].emit(geometry, rng), self.panels[number].luminaire.flux()),
            4 => {
                let outside = self.environment.as_ref().expect("ways to draw its light belong to an environment");
                return outside.emit(number, started, rng);
            }
            _ => (self.bodies[number].emit(geometry, rng), self.bodies[number].flux()),
        };
        // flux over the probability of the choice: the colour of the source, the luminous flux of all.
        Emission { origin, direction, weight: flux * (started / flux.luminance()), emphasis: 1.0 }
    }

    /// Starts a history at a point of `emitter`, uniform in area, with the luminance of that point.
    fn emit_triangle(&self, emitter: &Emitter, geometry: &Geometry, rng: &mut Generator) -> Emission {
        let point = emitter.point(rng.uniform2());
        let back = emitter.double_sided && rng.uniform() < 0.5;
        let normal = if back { -emitter.normal } else { emitter.normal };
        let direction = to_world(normal, cosine_hemisphere(rng.uniform2()));
        let weight = emitter.flux_of(emitter.luminance_at(point)) * (self.started() / emitter.flux().luminance());
        Emission { origin: geometry.lift(point, normal), direction, weight, emphasis: 1.0 }
    }
}
