//! Light sources: flux, emission, direct light (docs/method.md, "Sources").

use crate::math::DVec3;
use crate::photometry::Colour;

/// A light without extent, as a file or a job gives it.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// The same intensity \[cd\] in all directions.
    Omni {
        /// Position \[m\].
        position: DVec3,
        /// Luminous intensity \[cd\].
        intensity: Colour,
    },
    /// KHR_lights_punctual spot: falloff between the two cones as in its implementation note.
    Spot {
        /// Position \[m\].
        position: DVec3,
        /// Unit vector along the axis.
        direction: DVec3,
        /// Luminous intensity on the axis \[cd\].
        intensity: Colour,
        /// Half angle inside which the intensity is full \[rad\].
        inner: f64,
        /// Half angle outside which it is zero \[rad\].
        outer: f64,
    },
    /// Parallel light.
    Directional {
        /// Unit vector of propagation.
        direction: DVec3,
        /// Illuminance on a plane across it \[lx\].
        illuminance: Colour,
    },
}

/// All sources, area lights among them, with the choice in proportion to flux.
#[derive(Clone, Debug, Default)]
pub struct Sources {}
