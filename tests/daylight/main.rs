//! Daylight: the sky by formula and by quadrature, through openings, by all estimators; analytic area sources.

#[path = "../common/mod.rs"]
mod common;

mod bad;
mod factor;
mod glazing;
mod light;
mod rooms;
mod skies;
mod sources;

use lampyris::math::{DVec3, PI};
use lampyris::scene::{Model, Surface};
use lampyris::validate::daylight::{self, opening};

/// A room of 4 x 3 x 5 m with the insides of its walls like `surface`, and a hole in the wall z = 0 or in the ceiling.
pub fn room(hole: Hole, surface: &Surface) -> Model {
    match hole {
        Hole::Facade => daylight::room(4, [0.25, 0.75], [1.0 / 3.0, 0.8], surface),
        Hole::Roof => daylight::room(3, [0.25, 0.5], [0.4, 0.6], surface),
    }
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
        opening(self.rectangle())
    }
}

#[test]
fn the_battery() {
    common::battery::assert_theme("daylight/");
}

/// A sky of `model` scaled by the luminance of its zenith, and what else its table says.
pub fn sky(model: &str, zenith: f64, more: &str) -> String {
    format!("[sky]\nmodel = {model}\nzenith_luminance = {zenith}\n{more}")
}

/// 0 .. 1 on the unit circle.
pub fn turn(share: f64) -> (f64, f64) {
    lampyris::math::sin_cos(2.0 * PI * share)
}
