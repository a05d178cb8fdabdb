//! Daylight: the sky by formula and by quadrature, through openings, by all estimators; analytic area sources.

#[path = "../common/mod.rs"]
mod common;

mod light;
mod rooms;
mod skies;
mod sources;

use lampyris::math::{DVec3, PI};
use lampyris::scene::{Model, Surface};
use lampyris::validate::scenes::{add_quad, add_quad_with_hole, box_walls};

/// A room of 4 x 3 x 5 m with the insides of its walls like `surface`, and a hole in the wall z = 0 or in the ceiling.
pub fn room(hole: Hole, surface: &Surface) -> Model {
    let mut model = Model::default();
    for (i, [origin, u, v]) in box_walls(DVec3::new(4.0, 3.0, 5.0)).into_iter().enumerate() {
        match (i, hole) {
            (4, Hole::Facade) => {
                add_quad_with_hole(&mut model, [origin, u, v], [0.25, 0.75], [1.0 / 3.0, 0.8], surface)
            }
            (3, Hole::Roof) => add_quad_with_hole(&mut model, [origin, u, v], [0.25, 0.5], [0.4, 0.6], surface),
            _ => add_quad(&mut model, origin, u, v, surface.clone()),
        }
    }
    model
}

/// Where the room is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hole {
    /// x 1 .. 3, y 1 .. 2.4 in the plane z = 0.
    Facade,
    /// x 1 .. 2, z 2 .. 3 in the plane y = 3.
    Roof,
}

impl Hole {
    /// Corner and edges.
    pub fn rectangle(self) -> [DVec3; 3] {
        match self {
            Hole::Facade => [DVec3::new(1.0, 1.0, 0.0), DVec3::X * 2.0, DVec3::Y * 1.4],
            Hole::Roof => [DVec3::new(1.0, 3.0, 2.0), DVec3::X, DVec3::Z],
        }
    }

    /// As `[[opening]]`.
    pub fn opening(self) -> String {
        let [origin, u, v] = self.rectangle();
        let corners = [origin, origin + u, origin + u + v, origin + v].map(|p| p.to_array());
        format!("[[opening]]\ncorners = {corners:?}\n")
    }
}

/// Illuminance at `point` through a rectangle, by the luminance that comes from beyond it along each unit vector: midpoints.
pub fn through([origin, u, v]: [DVec3; 3], point: DVec3, normal: DVec3, luminance: impl Fn(DVec3) -> f64) -> f64 {
    let steps = 400;
    let (across, n) = (u.cross(v), f64::from(steps));
    let mut sum = 0.0;
    for i in 0..steps {
        for j in 0..steps {
            let y = origin + (f64::from(i) + 0.5) / n * u + (f64::from(j) + 0.5) / n * v;
            let way = y - point;
            let (d2, w) = (way.length_squared(), way.normalize());
            sum += luminance(w) * w.dot(normal).max(0.0) * across.dot(w).abs() / (d2 * n * n);
        }
    }
    sum
}

/// A sky of `model` scaled by the luminance of its zenith, and what else its table says.
pub fn sky(model: &str, zenith: f64, more: &str) -> String {
    format!("[sky]\nmodel = {model}\nzenith_luminance = {zenith}\n{more}")
}

/// 0 .. 1 on the unit circle.
pub fn turn(share: f64) -> (f64, f64) {
    lampyris::math::sin_cos(2.0 * PI * share)
}
