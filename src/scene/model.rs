//! What a scene file and a job say is there, before it is made ready for transport.

use super::textures::Textures;
use super::{Extended, Light, Nodes, Reflectance};
use crate::geometry::Harmonic;
use crate::job;
use crate::math::DVec3;
use crate::photometry::Colour;

/// A material: how a surface reflects and what it emits.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Name in the file it came from.
    pub name: String,
    /// Law of reflection; of a surface that varies, that of its means: [`super::Scene::reflectance`] has the law at a place.
    pub reflectance: Reflectance,
    /// True when the back reflects and emits like the front; else the back absorbs.
    pub double_sided: bool,
    /// Emitted luminance \[cd/m2\], the same in all directions; its mean where a texture varies it.
    pub emission: Colour,
}

/// A camera of the scene file.
#[derive(Clone, Debug)]
pub struct CameraNode {
    /// Name of the node.
    pub name: String,
    /// Position \[m\].
    pub eye: DVec3,
    /// Unit vector to the right of the picture.
    pub right: DVec3,
    /// Unit vector up in the picture.
    pub up: DVec3,
    /// Vertical field of view \[rad\].
    pub yfov: f64,
    /// Width over height, where the file says so.
    pub aspect: Option<f64>,
}

/// What a scene file says, in the file's coordinates.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Vertices in world coordinates \[m\].
    pub positions: Vec<DVec3>,
    /// Corners of each triangle, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Surface of each triangle, an index into `surfaces`.
    pub surface_of: Vec<u32>,
    /// Materials.
    pub surfaces: Vec<Surface>,
    /// What of them varies from place to place.
    pub textures: Textures,
    /// The nodes at which the triangles hang.
    pub nodes: Nodes,
    /// Lights without extent.
    pub lights: Vec<Light>,
    /// Luminaires with extent, whose faces are the last of the triangles, in this order; those of area sources come after them.
    pub extended: Vec<Extended>,
    /// Cameras.
    pub cameras: Vec<CameraNode>,
    /// Star-shaped objects in the place of meshes.
    pub replacements: Vec<Replaced>,
    /// What was ignored or replaced, each with its effect.
    pub warnings: Vec<String>,
}

impl Model {
    /// True where nothing shines and nothing is there.
    pub(super) fn is_empty(&self) -> bool {
        self.triangles.is_empty() && self.replacements.is_empty() && self.lights.is_empty()
    }
}

/// A star-shaped object, mostly in the place of the mesh of a node.
#[derive(Clone, Debug)]
pub struct Replaced {
    /// The object, in world coordinates.
    pub harmonic: Harmonic,
    /// Its surface, an index into `surfaces`.
    pub surface: u32,
    /// The node, a place in the list of nodes; those without one come last.
    pub node: Option<u32>,
}

/// Middle of the box around all bounded geometry; the origin without any.
pub(super) fn middle(model: &Model, spheres: &[job::Sphere]) -> DVec3 {
    let boxes = model.replacements.iter().map(|r| r.harmonic.bounds()).flat_map(|(low, high)| [low, high]);
    let poles = spheres.iter().flat_map(|s| [DVec3::from(s.center) - s.radius, DVec3::from(s.center) + s.radius]);
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = model
        .positions
        .iter()
        .copied()
        .chain(poles)
        .chain(boxes)
        .fold(empty, |(low, high), p| (low.min(p), high.max(p)));
    if low.x <= high.x { 0.5 * (low + high) } else { DVec3::ZERO }
}
