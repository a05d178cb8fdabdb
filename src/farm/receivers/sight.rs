//! What a camera sees in the centres of its pixels: fixed, and the same for every batch.

use super::camera_eye;
use crate::job::Camera;
use crate::math::DVec2;
use crate::scene::Scene;
use crate::transport::eye::{Eye, Gaze};
use smallvec::{SmallVec, smallvec};

/// A camera of a checked job, placed in a scene.
pub struct CentreSight<'a> {
    scene: &'a Scene,
    eye: Eye,
    width: u32,
    height: u32,
}

impl<'a> CentreSight<'a> {
    /// The sight of `camera`; its node, where it has one, is in `scene`.
    pub fn new(scene: &'a Scene, camera: &Camera) -> Self {
        CentreSight { scene, eye: camera_eye(scene, camera), width: camera.width, height: camera.height }
    }

    /// Number of pixels.
    pub fn pixels(&self) -> u32 {
        self.width * self.height
    }

    /// The surfaces seen straight along the ray through the centre of `pixel`: the first that lets nothing through, a mirror included, and
    /// the panes and veils before it.
    pub fn surfaces(&self, pixel: u32) -> SmallVec<[u32; 2]> {
        let (column, row) = (f64::from(pixel % self.width), f64::from(pixel / self.width));
        let film = DVec2::new((column + 0.5) / f64::from(self.width), (row + 0.5) / f64::from(self.height));
        match self.eye.gaze(film) {
            Gaze::Along(ray) => self.scene.seen_along(&ray),
            Gaze::At(hit, _) => smallvec![hit.primitive],
            Gaze::Nowhere => SmallVec::new(),
        }
    }
}
