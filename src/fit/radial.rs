//! r(n): how far a mesh is from its centre in the direction n, by rays.
//!
//! Which face a ray meets is found in f32; where it meets it comes from the plane of that face in f64.

use super::solid::{Face, Solid};
use crate::error::{Error, Result};
use crate::geometry::{Geometry, Hit, Mesh, Ray};
use crate::math::DVec3;

/// Rays that are sent together.
const TOGETHER: usize = 4096;
/// How far f32 and f64 may be apart, in diagonals: more is another face near an edge, of which the plane says nothing.
const APART: f64 = 1e-5;

/// A mesh around its centre, for rays.
pub struct Radial {
    /// The mesh, its centre in the origin.
    pub geometry: Geometry,
    /// Its faces, about the centre.
    pub faces: Vec<Face>,
    diagonal: f64,
    /// The file it came from.
    name: String,
}

/// The mesh in a direction.
#[derive(Clone, Copy, Debug)]
pub struct Met {
    /// Distance from the centre \[m\].
    pub radius: f64,
    /// Outward unit normal of the face.
    pub normal: DVec3,
}

impl Radial {
    /// `solid`, from the file `name`, seen from `center`.
    pub fn new(name: &str, solid: &Solid, center: DVec3) -> Radial {
        let moved = |face: &Face| Face { corners: face.corners.map(|corner| corner - center), ..*face };
        let faces: Vec<Face> = solid.faces.iter().map(moved).collect();
        let triangles: Vec<_> = faces.iter().map(|face| face.corners.map(|corner| corner.as_vec3())).collect();
        let geometry = Geometry::new(Mesh::new(&triangles), Vec::new(), Vec::new());
        Radial { geometry, faces, diagonal: solid.diagonal, name: name.to_owned() }
    }

    /// r in each of `directions` \[m\].
    ///
    /// # Errors
    /// [`Error::Input`] where a ray from the centre meets nothing.
    pub fn radii(&self, directions: &[DVec3]) -> Result<Vec<f64>> {
        let (mut radii, mut hits) = (Vec::with_capacity(directions.len()), vec![None; TOGETHER]);
        for some in directions.chunks(TOGETHER) {
            let rays: Vec<Ray> = some.iter().map(|&direction| Ray { origin: DVec3::ZERO, direction }).collect();
            let hits = &mut hits[..rays.len()];
            self.geometry.closest_hits(&rays, hits);
            for (&direction, hit) in some.iter().zip(hits) {
                let met = hit.map(|hit| self.met(direction, &hit));
                radii.push(met.ok_or_else(|| self.missed(direction))?.radius);
            }
        }
        Ok(radii)
    }

    /// The mesh in one direction; `None` where a ray slips through.
    pub fn along(&self, direction: DVec3) -> Option<Met> {
        let hit = self.geometry.closest_hit(&Ray { origin: DVec3::ZERO, direction })?;
        Some(self.met(direction, &hit))
    }

    fn met(&self, direction: DVec3, hit: &Hit) -> Met {
        let face = &self.faces[hit.primitive as usize];
        let radius = face.margin(DVec3::ZERO) / face.normal.dot(direction);
        let close = (radius - hit.distance).abs() <= APART * self.diagonal;
        Met { radius: if close { radius } else { hit.distance }, normal: face.normal }
    }

    fn missed(&self, direction: DVec3) -> Error {
        let allowed = "a mesh that every ray from the centre meets, in f32 too";
        Error::input(&self.name, "direction without surface", direction, allowed)
    }
}
