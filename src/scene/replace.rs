//! Series of spherical harmonics in the place of meshes: the same scene with and without.

use super::{Model, Replaced};
use crate::error::{Error, Result};
use crate::geometry::Harmonic;
use crate::geometry::harmonic::Star;
use crate::geometry::harmonic::file::File;
use crate::math::DMat3;

impl Model {
    /// Puts the object of `file` in the place of the mesh of the node called `node`, with its transform and material; the mesh is gone. `job` is
    /// the name of the job file, `at` the field that asks for it.
    ///
    /// # Errors
    /// [`Error::Input`] where there is not one such node with a mesh of one material, or its transform flattens.
    pub fn replace(&mut self, (job, at): (&str, &str), node: &str, file: File) -> Result<()> {
        let bad = |value: &str, allowed: String| Error::input(job, format!("{at}.node"), value, allowed);
        let place = self.nodes.only_with_surface(node).map_err(|allowed| bad(node, allowed))?;
        let is_its = |t: &usize| self.nodes.of_triangle[*t] as usize == place;
        let mut surfaces: Vec<u32> = (0..self.triangles.len()).filter(is_its).map(|t| self.surface_of[t]).collect();
        surfaces.dedup();
        let &[surface] = &surfaces[..] else {
            return Err(bad(
                node,
                format!("a node that shows a mesh of one material itself, not of {}", surfaces.len()),
            ));
        };
        let world = self.nodes.list[place].world;
        let harmonic =
            Harmonic::new(Star::new(file.series)?, world.transform_point3(file.center), DMat3::from_mat4(world))?;
        self.remove_triangles_of(place);
        self.replacements.push(Replaced { harmonic, surface, node: Some(place as u32) });
        Ok(())
    }

    fn remove_triangles_of(&mut self, place: usize) {
        let kept: Vec<bool> = self.nodes.of_triangle.iter().map(|&of| of as usize != place).collect();
        let mut flags = kept.iter().cycle();
        let mut keep = || *flags.next().expect("it goes round for ever");
        self.triangles.retain(|_| keep());
        self.surface_of.retain(|_| keep());
        self.nodes.of_triangle.retain(|_| keep());
        self.textures.charts.retain(&kept);
        self.drop_unused_vertices();
    }

    /// Removes vertices that no triangle uses, so that they do not count for the extent of the scene.
    pub(super) fn drop_unused_vertices(&mut self) {
        let mut used = vec![false; self.positions.len()];
        self.triangles.iter().flatten().for_each(|&corner| used[corner as usize] = true);
        let mut next = 0;
        let mut renumbered = vec![0; used.len()];
        for (new, &kept) in renumbered.iter_mut().zip(&used) {
            *new = next;
            next += u32::from(kept);
        }
        self.triangles.iter_mut().flatten().for_each(|corner| *corner = renumbered[*corner as usize]);
        let mut kept = used.iter();
        self.positions.retain(|_| kept.next().copied().unwrap_or(false));
    }
}
