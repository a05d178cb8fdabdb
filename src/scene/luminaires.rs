//! The lights of a job, hung into the scene.

use super::photometric_web::{Luminaire, Photometry, Placement, Shape};
use super::{Extended, Light, Model, Reflectance, Surface};
use crate::error::{Error, Result};
use crate::job;
use crate::math::{DMat3, DMat4, DVec3, PI};
use crate::photometry::Colour;

/// Scaled to a flux farther from its own than this, a web is mentioned.
const TOLERATED: f64 = 0.02;

impl Light {
    /// A source of a job; `None` for one that is a surface.
    pub(super) fn of_job(source: &job::Source) -> Option<Light> {
        let radians = |degrees: f64| degrees * PI / 180.0;
        Some(match *source {
            job::Source::Omni { position, intensity } => {
                Light::Omni { position: position.into(), intensity: Colour::grey(intensity) }
            }
            job::Source::Spot { position, direction, intensity, inner_degrees, outer_degrees } => Light::Spot {
                position: position.into(),
                direction: DVec3::from(direction).normalize(),
                intensity: Colour::grey(intensity),
                inner: radians(inner_degrees),
                outer: radians(outer_degrees),
            },
            job::Source::CosPower { position, direction, intensity, exponent } => Light::CosPower {
                position: position.into(),
                direction: DVec3::from(direction).normalize(),
                intensity: Colour::grey(intensity),
                exponent,
            },
            job::Source::Rectangle { .. } | job::Source::Disc { .. } | job::Source::Sphere { .. } => return None,
        })
    }
}

impl Model {
    /// Hangs the `luminaire` with the web of `photometry`. `job` is the name of the job file, `at` the entry that asks for it.
    ///
    /// # Errors
    /// [`Error::Input`] where there is not one node of its name, its directions or the node's transform leave none, or the mesh that
    /// shall shine is none that can.
    pub fn hang(&mut self, (job, at): (&str, &str), luminaire: &job::Luminaire, photometry: &Photometry) -> Result<()> {
        let world = match &luminaire.node {
            Some(name) => self.only_node(job, at, name)?,
            None => DMat4::IDENTITY,
        };
        let mesh = luminaire.mesh.as_ref().map(|name| self.take_mesh((job, at), name)).transpose()?;
        let position = match &mesh {
            Some(mesh) if luminaire.position.is_none() => mesh.middle,
            _ => world.transform_point3(luminaire.position.unwrap_or_default().into()),
        };
        let frame = DMat3::from_mat4(world);
        let placement =
            Placement::new(position, frame, luminaire.aim.into(), luminaire.c0.into()).ok_or_else(|| {
                let value = format!("{:?} with aim {:?}", luminaire.c0, luminaire.aim);
                Error::input(
                    job,
                    format!("{at}.c0"),
                    value,
                    "directions that are not parallel, and a node that flattens none",
                )
            })?;
        let own = photometry.flux();
        let scale = luminaire.flux.map_or(1.0, |flux| flux / own);
        for warning in &photometry.warnings {
            self.warn(format!("luminaire {}: {warning}", luminaire.file));
        }
        if (scale - 1.0).abs() > TOLERATED {
            let flux = own * scale;
            self.warn(format!("luminaire {}: its web of {own:.1} lm is scaled to {flux:.1} lm", luminaire.file));
        }
        let factor = Colour::grey(scale * luminaire.multiplier * luminaire.dimming);
        let light = Luminaire::new(photometry, &placement, factor);
        if let Some(mesh) = mesh {
            self.add_faces(Extended::of_mesh(light, mesh));
        } else if let Some(extended) = self.opened((job, at), luminaire, photometry, (&light, &placement))? {
            self.add_faces(extended);
        } else {
            self.lights.push(Light::Luminaire(light));
        }
        Ok(())
    }

    /// `light` with the opening of its file; `None` where a point shines.
    fn opened(
        &mut self,
        (job, at): (&str, &str),
        luminaire: &job::Luminaire,
        photometry: &Photometry,
        (light, placement): (&Luminaire, &Placement),
    ) -> Result<Option<Extended>> {
        if luminaire.extent == job::Extent::Point {
            return Ok(None);
        }
        let extended = Extended::new(light.clone(), &photometry.opening, placement);
        if extended.is_none() && luminaire.extent == job::Extent::Opening {
            let allowed = "point: its file gives no luminous opening with an area";
            return Err(Error::input(job, format!("{at}.extent"), "opening", allowed));
        }
        // A file that gives none means a point; one that gives a line, or signs of no edition, means something else.
        if extended.is_none() && photometry.opening.shape != Shape::Point {
            let file = &luminaire.file;
            self.warn(format!("luminaire {file}: its luminous opening has no area that is known: a point shines"));
        }
        Ok(extended)
    }

    /// Adds a luminaire with extent, whose faces absorb what meets them.
    fn add_faces(&mut self, extended: Extended) {
        let surface = self.surfaces.len() as u32;
        for face in &extended.faces {
            let first = self.positions.len() as u32;
            self.positions.extend(face);
            self.triangles.push([first, first + 1, first + 2]);
            self.surface_of.push(surface);
        }
        let reflectance = Reflectance::Lambert(Colour::BLACK);
        let (name, double_sided) = ("luminous opening".to_owned(), extended.flat);
        self.surfaces.push(Surface { name, reflectance, double_sided, emission: Colour::BLACK });
        self.extended.push(extended);
    }

    /// From the coordinates of the one node called `name` to those of the world.
    fn only_node(&self, job: &str, at: &str, name: &str) -> Result<DMat4> {
        let names: Vec<&str> = self.nodes.list.iter().filter_map(|node| node.name.as_deref()).collect();
        let place = self.nodes.only(name, ("a node of the scene", &names));
        let place = place.map_err(|allowed| Error::input(job, format!("{at}.node"), name, allowed))?;
        Ok(self.nodes.list[place].world)
    }

    /// Adds a warning that is not there yet: many luminaires share a file.
    pub(super) fn warn(&mut self, warning: String) {
        if !self.warnings.contains(&warning) {
            self.warnings.push(warning);
        }
    }
}
