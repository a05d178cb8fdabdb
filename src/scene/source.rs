//! Light sources: flux, choice, emission of histories (docs/method.md, "Sources").
//!
//! A history chooses its source in proportion to luminous flux and leaves it with the exact distribution of its
//! emission, so every history starts with the same luminous weight: the flux of all sources together.

use super::panel::Panel;
use super::photometric_web::Luminaire;
use crate::geometry::Geometry;
use crate::math::{DVec3, PI, cbrt, cos, pow, to_world};
use crate::photometry::Colour;
use crate::random::{Generator, around_z, cosine_hemisphere, disc, sphere};

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
    fn flux(&self, radius: f64) -> Colour {
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
    /// Emitted luminance \[cd/m2\].
    pub luminance: Colour,
    /// True when the back emits as well.
    pub double_sided: bool,
}

impl Emitter {
    /// The triangle `primitive` of `geometry`.
    pub(super) fn of_triangle(geometry: &Geometry, primitive: u32, luminance: Colour, double_sided: bool) -> Self {
        let [a, b, c] = geometry.triangle(primitive);
        let across = (b - a).cross(c - a);
        let (normal, area) = (across.normalize_or_zero(), 0.5 * across.length());
        Emitter { primitive, corners: [a, b, c], normal, area, luminance, double_sided }
    }

    fn flux(&self) -> Colour {
        self.luminance * (PI * self.area * if self.double_sided { 2.0 } else { 1.0 })
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
    /// The same over the panels.
    panel_flux: Vec<f64>,
    /// Centre and radius of the sphere that parallel light must cover \[m\].
    covered: (DVec3, f64),
}

impl Sources {
    /// Joins `lights`, `emitters` and `panels` over a scene bounded by `covered`; sources without flux are left out.
    pub fn new(lights: Vec<Light>, emitters: Vec<Emitter>, panels: Vec<Panel>, covered: (DVec3, f64)) -> Self {
        let lit = |flux: Colour| flux.luminance() > 0.0;
        let lights: Vec<Light> = lights.into_iter().filter(|l| lit(l.flux(covered.1))).collect();
        let emitters: Vec<Emitter> = emitters.into_iter().filter(|e| lit(e.flux())).collect();
        let light_flux = running_sum(lights.iter().map(|l| l.flux(covered.1)));
        let emitter_flux = running_sum(emitters.iter().map(Emitter::flux));
        let panels: Vec<Panel> = panels.into_iter().filter(|p| lit(p.luminaire.flux())).collect();
        let panel_flux = running_sum(panels.iter().map(|p| p.luminaire.flux()));
        Sources { lights, emitters, panels, light_flux, emitter_flux, panel_flux, covered }
    }

    /// Number of sources.
    pub fn len(&self) -> usize {
        self.lights.len() + self.emitters.len() + self.panels.len()
    }

    /// True in the dark.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Luminous flux of all sources \[lm\].
    pub fn flux(&self) -> f64 {
        last(&self.light_flux) + last(&self.emitter_flux) + last(&self.panel_flux)
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

    /// The emitters with their numbers.
    pub fn numbered(&self) -> impl Iterator<Item = (u32, &Emitter)> {
        (0..).zip(&self.emitters)
    }

    /// Starts a history. With a single source no number is drawn for the choice.
    pub fn emit(&self, geometry: &Geometry, rng: &mut Generator) -> Emission {
        let target = if self.len() == 1 { 0.0 } else { rng.uniform() * self.flux() };
        let of_lights = last(&self.light_flux);
        let of_surfaces = of_lights + last(&self.emitter_flux);
        let none_but_lights = self.emitters.is_empty() && self.panels.is_empty();
        let (origin, direction, flux) = if target < of_lights || none_but_lights {
            self.emit_light(&self.lights[choose(&self.light_flux, target)], rng)
        } else if target < of_surfaces || self.panels.is_empty() {
            emit_triangle(&self.emitters[choose(&self.emitter_flux, target - of_lights)], geometry, rng)
        } else {
            let panel = &self.panels[choose(&self.panel_flux, target - of_surfaces)];
            let (origin, direction) = panel.emit(geometry, rng);
            (origin, direction, panel.luminaire.flux())
        };
        // flux over the probability of the choice: the colour of the source, the luminous flux of all.
        Emission { origin, direction, weight: flux * (self.flux() / flux.luminance()) }
    }

    fn emit_light(&self, light: &Light, rng: &mut Generator) -> (DVec3, DVec3, Colour) {
        let (center, radius) = self.covered;
        let u = rng.uniform2();
        let (origin, direction) = match light {
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
        };
        (origin, direction, light.flux(radius))
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

fn emit_triangle(emitter: &Emitter, geometry: &Geometry, rng: &mut Generator) -> (DVec3, DVec3, Colour) {
    let point = emitter.point(rng.uniform2());
    let back = emitter.double_sided && rng.uniform() < 0.5;
    let normal = if back { -emitter.normal } else { emitter.normal };
    let direction = to_world(normal, cosine_hemisphere(rng.uniform2()));
    (geometry.lift(point, normal), direction, emitter.flux())
}
