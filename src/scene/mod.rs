//! What is there: geometry, the surfaces on it, the sources of light.
//!
//! A [`Model`] is what a file or a job says, in its own coordinates and in f64; [`Scene::new`] re-centres it,
//! builds the acceleration structure, turns emissive triangles into area lights and prepares the choice of a
//! source in proportion to flux. A scene does not know receivers, seeds or files.

mod area;
mod beam;
mod body;
mod choice;
mod closed;
mod environment;
pub mod gltf;
mod light;
mod light_tree;
mod luminaires;
mod luminous_mesh;
mod materials;
mod model;
mod nodes;
mod opening;
mod outlook;
mod panel;
pub mod photometric_web;
mod reflectance;
mod replace;
mod road_table;
mod sky;
mod source;
pub mod textures;
mod veils;

pub use beam::Beam;
pub use body::{Body, BodyPoint, in_cone};
pub use choice::Choice;
pub use environment::Environment;
pub use light::Light;
pub use light_tree::{Chosen, LightTree};
pub use model::{CameraNode, Model, Replaced, Surface};
pub use nodes::{Node, Nodes};
pub use opening::{Aim, Opening};
pub use outlook::Outlook;
pub use panel::{Extended, Panel};
pub use reflectance::{
    Delta, Dielectric, Finish, Glass, LawInLanes, Pane, Reflectance, Scattered, Tabulated, Tint, Tints,
    weight_over_tolerated, weights_over_tolerated,
};
pub use road_table::law_of_road;
pub use sky::Sky;
pub use source::{Emission, Emitter, Sources};
pub use veils::Meeting;

use self::photometric_web::Luminaire;
use self::textures::{Place, Textures};
use crate::error::{Error, Result};
use crate::geometry::{Build, Geometry, Hit, Plane, Sphere};
use crate::job::{self, Channels, Job};
use crate::math::DVec3;
use crate::photometry::Colour;
use std::borrow::Cow;

/// Largest luminous flux of a scene \[lm\]: the Sun on a country, and far from what f32 can hold.
const MAX_FLUX: f64 = 1e15;

/// A model ready for transport, in re-centred coordinates.
pub struct Scene {
    /// Where surfaces are.
    pub geometry: Geometry,
    /// All light sources.
    pub sources: Sources,
    /// Cameras of the scene file.
    pub cameras: Vec<CameraNode>,
    /// Nodes of the scene file, and which surface hangs at which.
    pub nodes: Nodes,
    /// What was ignored or replaced, each with its effect.
    pub warnings: Vec<String>,
    /// Added to a position of the job or of the file it gives the position in the scene \[m\].
    offset: DVec3,
    surfaces: Vec<Surface>,
    textures: Textures,
    surface_of: Vec<u32>,
    has_peaks: bool,
    narrowest_lobe: f64,
    reflects: bool,
}

impl Scene {
    /// Joins `model` (the scene file) with the planes, spheres and sources of `job`.
    ///
    /// # Errors
    /// [`Error::Input`] for a scene without light, or parallel light over infinite planes.
    pub fn new(model: Model, job: &Job) -> Result<Scene> {
        Scene::built(model, job, Build::Thorough)
    }

    /// The same with more or less care for the speed of what follows.
    ///
    /// # Errors
    /// As [`Scene::new`].
    pub fn built(mut model: Model, job: &Job, build: Build) -> Result<Scene> {
        let of_panels = model.triangles.len();
        let alone = model.is_empty() && job.adds_one_source();
        job.sources.iter().try_for_each(|source| model.add_area_source(source))?;
        let offset = -model::middle(&model, &job.spheres);
        let paint = |c: Colour| match job.run.channels {
            Channels::Luminance => Colour::grey(c.luminance()),
            Channels::Rgb => c,
        };
        let corners = model.triangles.iter().map(|t| t.map(|v| (model.positions[v as usize] + offset).as_vec3()));
        let corners: Vec<_> = corners.collect();
        let mut surfaces: Vec<Surface> = model.surfaces.into_iter().map(|s| painted(s, job.run.channels)).collect();
        let mut surface_of = model.surface_of;
        closed::refuse_open_glass(&surfaces, &surface_of, &corners, offset)?;
        let is_veil =
            |(triangle, &s): (u32, &u32)| surfaces[s as usize].is_veil() || model.textures.is_veil(s, triangle);
        let veils: Vec<bool> = (0..).zip(&surface_of).map(is_veil).collect();
        if let Some(veil) = model.replacements.iter().find(|r| surfaces[r.surface as usize].is_veil()) {
            let name = &surfaces[veil.surface as usize].name;
            return Err(Error::input(
                "scene",
                "[[replace]]",
                name,
                "a material that lets no light straight through: panes and sheets are triangles",
            ));
        }
        let harmonics = model.replacements.iter().map(|r| r.harmonic.clone().moved(offset)).collect();
        let geometry = Geometry::veiled(&corners, &veils, build)
            .with_quadrics(spheres(job, offset), planes(job, offset))
            .with_harmonics(harmonics);
        let shares = job.spheres.iter().map(|s| s.reflectance).chain(job.planes.iter().map(|p| p.reflectance));
        for share in shares {
            surface_of.push(surfaces.len() as u32);
            surfaces.push(analytic_surface(share));
        }
        let mut nodes = model.nodes;
        nodes.of_replacements = (surface_of.len() as u32, model.replacements.iter().filter_map(|r| r.node).collect());
        surface_of.extend(model.replacements.iter().map(|r| r.surface));
        let textures = model.textures.prepared(job.run.channels == Channels::Luminance);
        let emitters = emitters(&geometry, &surfaces, &surface_of, &textures);
        let sky = job.sky.as_ref().map(Sky::of_job);
        let sun = sky.iter().filter_map(|sky| sky.sun.clone());
        let lights = model.lights.into_iter().chain(job.sources.iter().filter_map(Light::of_job)).chain(sun);
        let lights: Vec<Light> = lights.map(|l| l.moved(offset).recoloured(paint)).collect();
        refuse_endless_flux(&geometry, &lights, sky.is_some())?;
        let covered = environment::covered(&geometry, job, offset);
        let environment = Environment::new(sky, &lights, (&job.openings, offset), &geometry, covered);
        let given = lights.len();
        let panels = panels(&geometry, of_panels, model.extended, |l| l.moved(offset).recoloured(paint));
        let bodies = bodies(&geometry, &surfaces, &surface_of);
        let mut sources = Sources::new(lights, emitters, panels, bodies, &geometry, covered);
        if let Some(environment) = environment {
            sources = sources.under(environment);
        }
        let mut warnings = model.warnings;
        if sources.environment.is_none() && !job.openings.is_empty() {
            warnings.push("each [[opening]] ignored: there is neither a sky nor parallel light".to_owned());
        }
        if sources.lights.len() < given {
            let dark = given - sources.lights.len();
            warnings
                .push(format!("{dark} of {given} lights without flux ignored: dark, no cone, or nothing to shine on"));
        }
        if job.sky.as_ref().is_some_and(|sky| sky.daylight_factor) && sources.len() > 1 {
            let others = sources.len() - 1;
            warnings
                .push(format!("daylight factors contain the light of {others} other sources, those of the scene file"));
        }
        if sources.is_empty() {
            return Err(Error::input("scene", "sources", "none", "at least one light or emissive surface"));
        }
        let flux = sources.flux();
        if flux.is_nan() || flux > MAX_FLUX {
            let allowed = format!("at most {MAX_FLUX:e} lm from all sources together");
            return Err(Error::input("scene", "luminous flux", flux, allowed));
        }
        let cameras = model.cameras.into_iter().map(|c| CameraNode { eye: c.eye + offset, ..c }).collect();
        let used = || surface_of.iter().map(|&s| &surfaces[s as usize].reflectance);
        let extremes: Vec<Reflectance> = textures.extremes(|s| &surfaces[s].reflectance).collect();
        let has_peaks = used().chain(&extremes).any(Reflectance::is_peaked);
        let narrowest_lobe = used().chain(&extremes).map(Reflectance::lobe_width).fold(1.0, f64::min);
        // A flat source and a ball never light themselves.
        let reflects = !alone && used().chain(&extremes).any(|r| !r.is_black());
        Ok(Scene {
            geometry,
            sources,
            cameras,
            nodes,
            warnings,
            offset,
            surfaces,
            textures,
            surface_of,
            has_peaks,
            narrowest_lobe,
            reflects,
        })
    }

    /// A position of the job in the coordinates of the scene \[m\].
    pub fn place(&self, position: [f64; 3]) -> DVec3 {
        DVec3::from(position) + self.offset
    }

    /// The camera node called `name`.
    pub fn camera(&self, name: &str) -> Option<&CameraNode> {
        self.cameras.iter().find(|c| c.name == name)
    }

    /// The surface of a primitive.
    pub fn surface(&self, primitive: u32) -> &Surface {
        &self.surfaces[self.surface_of[primitive as usize] as usize]
    }

    /// The surfaces that something in the scene has.
    pub fn used_surfaces(&self) -> impl Iterator<Item = &Surface> {
        let mut used = vec![false; self.surfaces.len()];
        self.surface_of.iter().for_each(|&s| used[s as usize] = true);
        self.surfaces.iter().zip(used).filter(|(_, used)| *used).map(|(surface, _)| surface)
    }

    /// The law of reflection of a primitive at `position` \[m\].
    pub fn reflectance(&self, primitive: u32, position: DVec3) -> Cow<'_, Reflectance> {
        let uniform = &self.surface(primitive).reflectance;
        match self.textures.of(self.surface_of[primitive as usize], primitive) {
            None => Cow::Borrowed(uniform),
            Some(textured) => {
                let place = Place::new(primitive, self.geometry.triangle(primitive), position);
                Cow::Owned(self.textures.law(textured, uniform, place))
            }
        }
    }

    /// Luminance that a surface emits where `hit`, towards the unit vector `w` \[cd/m2\]; of its lit side.
    pub fn emitted(&self, hit: &Hit, w: DVec3) -> Colour {
        if let Some((_, panel, _)) = self.sources.panel_face(hit.primitive) {
            return panel.luminance(w);
        }
        let mean = self.surface(hit.primitive).emission;
        if mean.is_black() || !self.textures.varies(self.surface_of[hit.primitive as usize], hit.primitive) {
            return mean;
        }
        // Of triangles without light in their part of the texture there is no emitter.
        self.sources
            .emitter(hit.primitive)
            .map_or(Colour::BLACK, |number| self.sources.emitters[number].luminance_at(hit.position))
    }

    /// Where daylight enters; none without daylight.
    pub fn openings(&self) -> &[Opening] {
        self.sources.environment.as_ref().map_or(&[], |environment| &environment.openings)
    }

    /// Luminance of what lies beyond all surfaces in the direction of the unit vector `w` \[cd/m2\].
    pub fn beyond(&self, w: DVec3) -> Colour {
        self.sources.sky().map_or(Colour::BLACK, |sky| sky.luminance(w))
    }

    /// Number of primitives: triangles, spheres, planes.
    pub fn primitives(&self) -> u32 {
        self.surface_of.len() as u32
    }

    /// True when the side on which `hit` was met absorbs all light.
    pub fn absorbs(&self, hit: &Hit) -> bool {
        !hit.front && !self.surface(hit.primitive).double_sided
    }

    /// True when some surface reflects light that connections can carry.
    pub fn reflects(&self) -> bool {
        self.reflects
    }

    /// True when some surface reflects in a peaked lobe.
    pub fn has_peaks(&self) -> bool {
        self.has_peaks
    }

    /// alpha of the narrowest lobe in which a surface reflects \[1\]: 0 where there is a mirror, 1 where all are matt.
    pub fn narrowest_lobe(&self) -> f64 {
        self.narrowest_lobe
    }

    /// Number of triangles.
    pub fn triangles(&self) -> u64 {
        self.geometry.triangles()
    }

    /// Memory of geometry and surfaces \[bytes\].
    pub fn bytes(&self) -> u64 {
        let surfaces = self.surfaces.len() * size_of::<Surface>() + 4 * self.surface_of.len();
        self.geometry.bytes()
            + self.nodes.bytes()
            + self.textures.bytes()
            + (surfaces + self.sources.emitters.len() * (size_of::<Emitter>() + 8)) as u64
    }
}

fn painted(surface: Surface, channels: Channels) -> Surface {
    match channels {
        Channels::Rgb => surface,
        Channels::Luminance => Surface {
            reflectance: surface.reflectance.grey(),
            emission: Colour::grey(surface.emission.luminance()),
            ..surface
        },
    }
}

fn analytic_surface(reflectance: f64) -> Surface {
    Surface {
        name: String::new(),
        reflectance: Reflectance::Lambert(Colour::grey(reflectance)),
        double_sided: false,
        emission: Colour::BLACK,
    }
}

fn spheres(job: &Job, offset: DVec3) -> Vec<Sphere> {
    let sphere = |s: &job::Sphere| Sphere {
        center: DVec3::from(s.center) + offset,
        radius: s.radius,
        inward: s.facing == job::Facing::Inward,
    };
    job.spheres.iter().map(sphere).collect()
}

fn planes(job: &Job, offset: DVec3) -> Vec<Plane> {
    job.planes.iter().map(|p| Plane::new(DVec3::from(p.point) + offset, p.normal.into())).collect()
}

/// The area lights: one for each triangle of an emissive surface.
fn emitters(geometry: &Geometry, surfaces: &[Surface], surface_of: &[u32], textures: &Textures) -> Vec<Emitter> {
    let surface = |primitive: u32| &surfaces[surface_of[primitive as usize] as usize];
    let lit = |primitive: &u32| !surface(*primitive).emission.is_black();
    let varying = |primitive: &u32| textures.varies(surface_of[*primitive as usize], *primitive);
    let all: Vec<u32> = (0..geometry.triangles() as u32).filter(lit).collect();
    let glowing = all.iter().filter(|primitive| varying(primitive)).count();
    let emitter = |primitive: u32| {
        let Surface { emission, double_sided, .. } = *surface(primitive);
        let emitter = Emitter::of_triangle(geometry, primitive, emission, double_sided);
        match textures.glow(surface_of[primitive as usize], primitive) {
            Some(glow) => emitter.glowing(glow, glowing),
            None => emitter,
        }
    };
    all.into_iter().map(emitter).collect()
}

/// The star-shaped objects that emit: the last of all surfaces.
fn bodies(geometry: &Geometry, surfaces: &[Surface], surface_of: &[u32]) -> Vec<Body> {
    let first = surface_of.len() - geometry.harmonics().len();
    let body = |(object, &surface): (usize, &u32)| {
        let surface = &surfaces[surface as usize];
        let lit = !surface.emission.is_black();
        lit.then(|| Body::new(geometry, object, (first + object) as u32, surface))
    };
    surface_of[first..].iter().enumerate().filter_map(body).collect()
}

/// The luminaires with extent, whose faces are the last of the first `triangles`, each `adapted` to the scene.
fn panels(
    geometry: &Geometry,
    triangles: usize,
    all: Vec<Extended>,
    adapted: impl Fn(Luminaire) -> Luminaire,
) -> Vec<Panel> {
    let mut first = triangles - all.iter().map(|extended| extended.faces.len()).sum::<usize>();
    let panel = |extended: Extended| {
        let (from, count) = (first as u32, extended.faces.len());
        first += count;
        Panel::new(Extended { luminaire: adapted(extended.luminaire), ..extended }, geometry, from)
    };
    all.into_iter().map(panel).collect()
}

fn refuse_endless_flux(geometry: &Geometry, lights: &[Light], sky: bool) -> Result<()> {
    let refused = |field: &str, value: &str, allowed: &str| Err(Error::input("scene", field, value, allowed));
    if sky && geometry.is_unbounded() {
        return refused("plane", "infinite", "no [[plane]] together with a [sky], whose light on it has no bound");
    }
    if sky && geometry.bounding_sphere().1 == 0.0 {
        return refused("sky", "nothing below it", "a [sky] over a scene with at least one bounded surface");
    }
    let parallel = lights.iter().any(|l| matches!(l, Light::Directional { .. }));
    if parallel && geometry.is_unbounded() {
        return refused("plane", "infinite", "no [[plane]] together with a directional light");
    }
    Ok(())
}
