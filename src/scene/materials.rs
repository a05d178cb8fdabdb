//! The materials of a job, in the place of those of the scene file.

use super::reflectance::Tabulated;
use super::{Delta, Glass, Model, Pane, Reflectance, Surface};
use crate::error::{Error, Result};
use crate::job::{self, Share};
use crate::math::log;
use crate::photometry::Colour;

impl Model {
    /// Gives the surfaces of the material that `material` names, or of the node and all below it, its law. `job` is the name of the job
    /// file, `at` the entry that asks for it, `table` the law of a tabulated one.
    ///
    /// # Errors
    /// [`Error::Input`] where nothing has the name, where a pane is clearer than glass can be, or where glass would emit.
    pub fn paint(
        &mut self,
        (job, at): (&str, &str),
        material: &job::Material,
        table: Option<&Tabulated>,
    ) -> Result<()> {
        let law = law((job, at), material, table)?;
        let both = law.sides().is_some() || matches!(law, Reflectance::Delta(Delta::Pane(_) | Delta::Glass(_)));
        for number in self.surfaces_called((job, at), material.name())? {
            let surface = &mut self.surfaces[number];
            let one_sided = matches!(law, Reflectance::Delta(_)) || !surface.double_sided;
            if both && one_sided && !surface.emission.is_black() {
                let allowed = "glass on what does not emit, opal on what does not or emits on both sides";
                return Err(Error::input(job, format!("{at}.name"), material.name(), allowed));
            }
            surface.reflectance = law.clone();
            self.textures.make_uniform(number);
            surface.double_sided |= both;
        }
        Ok(())
    }

    /// The surfaces of the material called `name`, or new ones for the triangles at or below a node of this name.
    fn surfaces_called(&mut self, (job, at): (&str, &str), name: &str) -> Result<Vec<usize>> {
        let called: Vec<usize> = (0..self.surfaces.len()).filter(|&s| self.surfaces[s].name == name).collect();
        if !called.is_empty() {
            return Ok(called);
        }
        let mut known: Vec<&str> = self.surfaces.iter().map(|s| s.name.as_str()).collect();
        known.extend(self.nodes.names_with_surface());
        let place = self.nodes.only(name, ("a material of the scene, or a node with a surface", &known));
        let place = place.map_err(|allowed| Error::input(job, format!("{at}.name"), name, allowed))?;
        let below = self.nodes.at_or_below(place);
        let of_triangles = self.surface_of.iter_mut().zip(&self.nodes.of_triangle);
        let of_objects = self.replacements.iter_mut().filter_map(|r| Some((&mut r.surface, r.node.as_ref()?)));
        let mut made: Vec<(u32, usize)> = Vec::new();
        for (surface, _) in of_triangles.chain(of_objects).filter(|(_, node)| below[**node as usize]) {
            let known = made.iter().find(|(old, _)| old == surface).map(|&(_, new)| new);
            let new = known.unwrap_or_else(|| {
                let copy = Surface { name: name.to_owned(), ..self.surfaces[*surface as usize].clone() };
                self.surfaces.push(copy);
                self.textures.copy(*surface as usize, self.surfaces.len() - 1);
                made.push((*surface, self.surfaces.len() - 1));
                self.surfaces.len() - 1
            });
            *surface = new as u32;
        }
        match made.is_empty() {
            true => Err(Error::input(job, format!("{at}.name"), name, "a node that shows a mesh")),
            false => Ok(made.into_iter().map(|(_, new)| new).collect()),
        }
    }
}

fn law((job, at): (&str, &str), material: &job::Material, table: Option<&Tabulated>) -> Result<Reflectance> {
    let colour = |share: &Share| Colour(share.channels());
    Ok(match material {
        job::Material::Lambert { reflectance, .. } => Reflectance::Lambert(colour(reflectance)),
        job::Material::Mirror { reflectance, .. } => Reflectance::Delta(Delta::Mirror(colour(reflectance))),
        job::Material::Phong { diffuse, specular, exponent, .. } => {
            Reflectance::phong(colour(diffuse), colour(specular), *exponent)
        }
        job::Material::Opal { reflectance, transmittance, .. } => {
            Reflectance::opal(colour(reflectance), colour(transmittance))
        }
        job::Material::Pane { ior, transmittance, .. } => {
            let pane = match transmittance {
                Some(share) => Pane::of_transmittance(*ior, colour(share)).ok_or_else(|| {
                    let allowed = format!("at most {:.6}, that of clear glass of ior {ior}", Pane::clearest(*ior));
                    Error::input(job, format!("{at}.transmittance"), share, allowed)
                })?,
                None => Pane::new(*ior, Colour::WHITE),
            };
            Reflectance::Delta(Delta::Pane(pane))
        }
        job::Material::Glass { ior, transmittance_per_metre, .. } => {
            let absorption = colour(transmittance_per_metre).map(|t| -log(t));
            Reflectance::Delta(Delta::Glass(Glass::new(*ior, absorption)))
        }
        job::Material::Tabulated { .. } => Reflectance::tabulated(table.expect("its file was read").clone()),
    })
}
