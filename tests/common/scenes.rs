//! Scenes of the tests: those of the battery.
#![allow(unused_imports, reason = "each test binary uses its own part")]

pub use lampyris::validate::scenes::{add_quad, closed_box, lambert, point, sobolev, spot_camera};
