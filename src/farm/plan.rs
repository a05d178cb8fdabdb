//! Job + scene summary -> [`Plan`] -> shards. Pure arithmetic: no threads, workers, host names, clock or files.

use crate::job::Job;
use serde::{Deserialize, Serialize};

/// Bumped whenever the numbers of any job change.
pub const NUMERICS: u32 = 1;

/// An input file, known by its content.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Input {
    /// As the job or the scene file calls it.
    pub name: String,
    /// BLAKE3 of its bytes, hexadecimal.
    pub digest: String,
    /// Size \[bytes\].
    pub bytes: u64,
}

/// What a scene is made of, for the reader of a plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneSummary {
    /// Number of triangles.
    pub triangles: u64,
    /// Number of light sources, each emissive triangle one.
    pub sources: u64,
    /// Luminous flux of all sources \[lm\].
    pub flux_lm: f64,
    /// Memory of geometry and acceleration structure \[bytes\].
    pub bytes: u64,
    /// What was ignored or replaced, each with its effect.
    pub warnings: Vec<String>,
}

/// A job with every default resolved, its inputs known by content, and its division into shards.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Program version that made the plan.
    pub program: String,
    /// [`NUMERICS`] of that program.
    pub numerics: u32,
    /// Name of the job: the stem of its file name.
    pub name: String,
    /// BLAKE3 of all that determines the content of a shard, hexadecimal; not of batches, confidence,
    /// checkpoint_seconds.
    pub digest: String,
    /// The scene's input files; the first is the scene itself.
    pub inputs: Vec<Input>,
    /// The job file's own bytes, kept beside the inputs.
    pub job_file: Input,
    /// What the scene is made of.
    pub scene: SceneSummary,
    /// The job, every default resolved.
    pub job: Job,
}
