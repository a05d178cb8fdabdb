//! Eye rays of cameras and goniometers: a bin of the map and a position in it -> a ray.

use crate::geometry::{Hit, Ray};
use crate::job::{self, View};
use crate::math::{DVec2, DVec3, PI, sin_cos, tan};
use crate::scene::{CameraNode, Scene};

/// Cosine below which a direction lies on the horizon of a surface point: what rounding makes of zero.
const HORIZON: f64 = 1e-12;

/// What looks: turns film positions into rays.
#[derive(Clone, Debug)]
pub enum Eye {
    /// Perspective camera; a pixel is the uniform mean over its area in the film plane.
    Camera {
        /// Position \[m\].
        eye: DVec3,
        /// Half the width of the film at distance 1, to the right.
        right: DVec3,
        /// Half the height of the film at distance 1, up.
        up: DVec3,
        /// Unit vector along the axis.
        forward: DVec3,
    },
    /// Free point that looks in all directions; latitude-longitude, a texel is its solid-angle mean.
    Sphere {
        /// Position \[m\].
        position: DVec3,
    },
    /// Surface point seen from all directions of its hemisphere.
    Surface {
        /// The point, its normal on the side of the viewers.
        point: Hit,
    },
}

/// What an eye asks for at one position of its film.
#[derive(Clone, Copy, Debug)]
pub enum Gaze {
    /// Follow this ray.
    Along(Ray),
    /// Look at this surface point in this propagation direction of the eye ray.
    At(Hit, DVec3),
    /// There is nothing to see: below the horizon of a surface point.
    Nowhere,
}

impl Eye {
    /// A camera from a node of the scene, for a picture of `aspect` = width / height.
    pub fn from_node(node: &CameraNode, aspect: f64) -> Self {
        Eye::camera(node.eye, node.right, node.up, node.right.cross(node.up) * -1.0, node.yfov, aspect)
    }

    /// A camera typed into the job.
    pub fn from_view(scene: &Scene, view: &View, aspect: f64) -> Self {
        let eye = scene.place(view.eye);
        let forward = (scene.place(view.target) - eye).normalize();
        let right = forward.cross(view.up.into()).normalize();
        Eye::camera(eye, right, right.cross(forward), forward, view.vertical_fov_degrees * PI / 180.0, aspect)
    }

    fn camera(eye: DVec3, right: DVec3, up: DVec3, forward: DVec3, yfov: f64, aspect: f64) -> Self {
        let half = tan(0.5 * yfov);
        Eye::Camera { eye, right: right * (half * aspect), up: up * half, forward }
    }

    /// A goniometer of the job; with `surface = true` the first surface met from 1 mm above the point, within 2 mm.
    /// `None` when there is none that reflects.
    pub fn from_gonio(scene: &Scene, gonio: &job::Gonio) -> Option<Self> {
        let position = scene.place(gonio.position);
        let Some(normal) = gonio.normal else {
            return Some(Eye::Sphere { position });
        };
        let normal = DVec3::from(normal).normalize();
        let ray = Ray { origin: position + 1e-3 * normal, direction: -normal };
        let hit = scene.geometry.closest_hit(&ray).filter(|h| h.distance <= 2e-3 && !scene.absorbs(h))?;
        Some(Eye::Surface { point: hit })
    }

    /// The gaze at the film position (x, y) in the unit square, (0, 0) top left.
    pub fn gaze(&self, film: DVec2) -> Gaze {
        match *self {
            Eye::Camera { eye, right, up, forward } => {
                let direction = forward + right * (2.0 * film.x - 1.0) + up * (1.0 - 2.0 * film.y);
                Gaze::Along(Ray { origin: eye, direction: direction.normalize() })
            }
            Eye::Sphere { position } => Gaze::Along(Ray { origin: position, direction: map_direction(film) }),
            Eye::Surface { point } => match map_direction(film) {
                to_eye if to_eye.dot(point.normal) > HORIZON => Gaze::At(point, -to_eye),
                _ => Gaze::Nowhere,
            },
        }
    }
}

/// Direction of a map position: row 0 is +Y, the centre looks along -Z, +X lies to its right. Rows are equal steps
/// of latitude; `film.y` inside a row must be drawn uniform in its cosine, see [`latitude`].
pub fn map_direction(film: DVec2) -> DVec3 {
    let (sin_polar, cos_polar) = sin_cos(PI * film.y);
    let (sin, cos) = sin_cos(2.0 * PI * (film.x - 0.5));
    DVec3::new(sin_polar * sin, cos_polar, -sin_polar * cos)
}

/// The position in the unit interval of map rows that lies at the share `v` of the solid angle between the rows
/// `top` and `bottom`, both in the unit interval.
pub fn latitude(top: f64, bottom: f64, v: f64) -> f64 {
    let (a, b) = (crate::math::cos(PI * top), crate::math::cos(PI * bottom));
    crate::math::acos((a + (b - a) * v).clamp(-1.0, 1.0)) / PI
}
