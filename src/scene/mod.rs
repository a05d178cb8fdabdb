//! What is there: geometry, the surfaces on it, the sources of light.
//!
//! A [`Model`] is what a file or a job says, in its own coordinates and in f64; [`Scene::new`] re-centres it,
//! builds the acceleration structure, turns emissive triangles into area lights and prepares the choice of a
//! source in proportion to flux. A scene does not know receivers, seeds or files.

pub mod gltf;
mod reflectance;
mod source;

pub use reflectance::{Reflectance, Scattered};
pub use source::{Light, Sources};

use crate::math::DVec3;
use crate::photometry::Colour;

/// A material: how a surface reflects and what it emits.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Name in the file it came from.
    pub name: String,
    /// Law of reflection.
    pub reflectance: Reflectance,
    /// True when the back reflects and emits like the front; else the back absorbs.
    pub double_sided: bool,
    /// Emitted luminance \[cd/m2\], the same in all directions.
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
    /// Point, spot and directional lights.
    pub lights: Vec<Light>,
    /// Cameras.
    pub cameras: Vec<CameraNode>,
    /// What was ignored or replaced, each with its effect.
    pub warnings: Vec<String>,
}

/// A model ready for transport.
pub struct Scene {}

impl Scene {
    /// Joins `model` (the scene file) with the planes, spheres and sources of `job`.
    ///
    /// # Errors
    /// [`crate::error::Error::Input`] for a scene without light, or parallel light over infinite planes.
    pub fn new(model: Model, job: &crate::job::Job) -> crate::error::Result<Scene> {
        let _ = (model, job);
        Ok(Scene {})
    }
}
