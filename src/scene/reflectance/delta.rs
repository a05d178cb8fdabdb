//! Laws that reflect by delta components alone: no connection can carry their light, and no receiver stands on them.

use super::{Glass, Pane, Scattered};
use crate::math::DVec3;
use crate::photometry::Colour;
use crate::random::Generator;

/// What reflects as a mirror and in no other way.
#[derive(Clone, Debug, PartialEq)]
pub enum Delta {
    /// A mirror of the same reflectance at every angle.
    Mirror(Colour),
    /// A pane, with the light that it does not let through straight on.
    Pane(Pane),
    /// The surface of a body of glass.
    Glass(Glass),
}

impl Delta {
    /// The share mirrored at the cosine of incidence.
    pub(super) fn reflectance(&self, cosine: f64) -> Colour {
        match self {
            Delta::Mirror(reflectance) => *reflectance,
            Delta::Pane(pane) => pane.mirrored(cosine),
            Delta::Glass(glass) => Colour::grey(glass.reflectance(cosine)),
        }
    }

    /// The direction mirrored, for which no number is drawn; of light that arrives on the `front` of glass, or its back, one of two.
    pub(super) fn sample(&self, front: bool, normal: DVec3, w_in: DVec3, rng: &mut Generator) -> Option<Scattered> {
        if let Delta::Glass(glass) = self {
            return glass.sample(front, normal, w_in, rng);
        }
        let cosine = -w_in.dot(normal);
        // Renormalised, so that a long chain of mirrors does not drift off the unit sphere.
        let direction = (w_in + 2.0 * cosine * normal).normalize();
        (cosine > 0.0).then(|| Scattered {
            direction,
            factor: self.reflectance(cosine),
            delta: true,
            transmitted: false,
        })
    }

    pub(super) fn grey(self) -> Self {
        match self {
            Delta::Mirror(reflectance) => Delta::Mirror(Colour::grey(reflectance.luminance())),
            Delta::Pane(pane) => Delta::Pane(pane.grey()),
            Delta::Glass(glass) => Delta::Glass(glass.grey()),
        }
    }
}
