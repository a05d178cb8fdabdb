//! Laws that reflect by delta components alone: no connection can carry their light, and no receiver stands on them.

use super::{Pane, Scattered};
use crate::math::DVec3;
use crate::photometry::Colour;

/// What reflects as a mirror and in no other way.
#[derive(Clone, Debug, PartialEq)]
pub enum Delta {
    /// A mirror of the same reflectance at every angle.
    Mirror(Colour),
    /// A pane, with the light that it does not let through straight on.
    Pane(Pane),
}

impl Delta {
    /// The share mirrored at the cosine of incidence.
    pub(super) fn reflectance(&self, cosine: f64) -> Colour {
        match self {
            Delta::Mirror(reflectance) => *reflectance,
            Delta::Pane(pane) => pane.mirrored(cosine),
        }
    }

    /// The direction mirrored; no number is drawn.
    pub(super) fn sample(&self, normal: DVec3, w_in: DVec3) -> Option<Scattered> {
        let cosine = -w_in.dot(normal);
        // Renormalised, so that a long chain of mirrors does not drift off the unit sphere.
        let direction = (w_in + 2.0 * cosine * normal).normalize();
        (cosine > 0.0).then(|| Scattered { direction, factor: self.reflectance(cosine), delta: true })
    }

    pub(super) fn grey(self) -> Self {
        match self {
            Delta::Mirror(reflectance) => Delta::Mirror(Colour::grey(reflectance.luminance())),
            Delta::Pane(pane) => Delta::Pane(pane.grey()),
        }
    }
}
