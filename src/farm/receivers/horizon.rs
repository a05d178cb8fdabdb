//! Where the bins of directions lie that leave a surface point: above its horizon, below it, or across.
//!
//! A bin is searched for both sides only where its centre is near the horizon: two directions of one bin are nowhere
//! farther apart than its sides are long together.

use super::ReceiverSet;
use crate::math::{DVec2, DVec3, PI, sin};
use crate::transport::eye::{Eye, Gaze, map_direction};

/// Where a bin of directions lies that leave a surface point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sight {
    Above,
    /// Across the horizon: its mean is the mean over what lies above.
    Across,
    Below,
}

/// Positions along each side of a bin at which it is looked whether it lies above the horizon.
const PROBES: u32 = 33;

impl ReceiverSet {
    /// Where bin `i` of the directions lies that leave a surface point with the unit `normal`, which `eye` looks at.
    pub(super) fn sight(&self, eye: &Eye, normal: DVec3, i: usize) -> Sight {
        self.sight_by_centre(normal, i).unwrap_or_else(|| self.probe(eye, i))
    }

    /// The same from the centre of the bin alone; `None` where it is too near the horizon to tell.
    pub(super) fn sight_by_centre(&self, normal: DVec3, i: usize) -> Option<Sight> {
        let reach = PI / f64::from(self.shape.height) + 2.0 * PI / f64::from(self.shape.width);
        let cosine = map_direction(self.film(i, 1, 0, DVec2::splat(0.5))).dot(normal);
        let clear = reach < 0.5 * PI && cosine.abs() > sin(reach);
        clear.then_some(if cosine > 0.0 { Sight::Above } else { Sight::Below })
    }

    /// The same by looking at many directions of the bin.
    pub(super) fn probe(&self, eye: &Eye, i: usize) -> Sight {
        let side = |k: u32| f64::from(k) / f64::from(PROBES - 1);
        let places = (0..PROBES).flat_map(|x| (0..PROBES).map(move |y| DVec2::new(side(x), side(y))));
        let above = places.filter(|&p| !matches!(eye.gaze(self.film(i, 1, 0, p)), Gaze::Nowhere)).count() as u32;
        match above {
            0 => Sight::Below,
            all if all == PROBES * PROBES => Sight::Above,
            _ => Sight::Across,
        }
    }
}
