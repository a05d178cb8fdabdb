//! Scenes of the tests: those of the battery.

pub use lampyris::validate::scenes::{add_quad, closed_box, lambert, point, sobolev, spot_camera};
