//! What a job says of series of spherical harmonics.

use serde::{Deserialize, Serialize};

/// `[[replace]]`: a series of spherical harmonics in the place of the mesh of a node, with its transform and material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Replacement {
    /// Name of the node.
    pub node: String,
    /// The file of the series, relative to the job file.
    pub harmonic: String,
    /// Degree up to which the series is summed; left out: all of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub degree: Option<Degree>,
    /// With `degree = "auto"`: what is left out displaces the surface by so much at most, in pixels of every camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error_pixels: Option<f64>,
}

/// Degree of a series.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a whole number, or \"auto\"")]
pub enum Degree {
    /// This one.
    Number(u32),
    /// By name.
    Word(DegreeWord),
}

/// A degree that is not typed as a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DegreeWord {
    /// As far as the pictures show; the plan has the number.
    Auto,
}
