//! Job + scene summary -> [`Plan`] -> shards. Pure arithmetic: no threads, workers, host names, clock or files.
//!
//! Shard k holds the batches [k n, k n + n) with n = `batches_per_shard`, whatever the total and the number of
//! workers. The digest covers all that determines the content of a shard, so a checkpoint belongs to a plan exactly
//! when the digests agree; `batches`, `confidence`, `checkpoint_seconds`, `[stop]` and `[[ratio]]` stay outside and may
//! change.

mod difference;
pub mod looks;
mod size;

pub use size::{KEPT_LIMIT, MAX_SHARDS, Sizes, human};

use crate::error::Result;
use crate::job::{
    Camera, Channels, Estimator, Gonio, Grid, Job, Plane, Point, Region, Replacement, Roulette, Sampling, SetShape,
    Source, Sphere,
};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Bumped whenever the numbers of any job change.
pub const NUMERICS: u32 = 6;

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
    /// alpha of the narrowest lobe in which a surface reflects \[1\]: 0 where there is a mirror, 1 where all are matt.
    pub narrowest_lobe: f64,
    /// What was ignored or replaced, each with its effect.
    pub warnings: Vec<String>,
}

/// A job with every default resolved, its inputs known by content, and its division into shards.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
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
    /// b of the bounded kernel, one for each receiver set in job order \[1/m2\]; empty where nothing is bounded.
    pub bounds: Vec<f64>,
    /// The job, every default resolved.
    pub job: Job,
}

/// All that determines the content of a shard, in the order in which it is hashed. Input files count by content.
#[derive(Serialize)]
struct Content<'a> {
    numerics: u32,
    seed: u64,
    histories_per_batch: u64,
    thinning: u64,
    batches_per_shard: u64,
    channels: Channels,
    sampling: Sampling,
    estimator: Estimator,
    bounds: &'a [f64],
    roulette_below: Option<f64>,
    inputs: Vec<&'a str>,
    cameras: Vec<CameraContent<'a>>,
    gonios: &'a [Gonio],
    grids: &'a [Grid],
    points: &'a [Point],
    regions: Vec<RegionContent<'a>>,
    planes: &'a [Plane],
    spheres: &'a [Sphere],
    sources: &'a [Source],
    // Replacements come after it where there are any: their files are among the inputs.
}

/// A camera with its absent fields marked: its own serialisation leaves them out, and two cameras could then
/// have the same bytes.
type Vector = Option<[f64; 3]>;
type CameraContent<'a> = (&'a str, &'a Option<String>, [Vector; 3], Option<f64>, [u32; 3], &'a [[u32; 2]]);

/// The same for a region.
type RegionContent<'a> = (&'a str, &'a str, Option<[u32; 4]>, &'a Option<String>);

impl Input {
    /// The input file `name` with the content `bytes`.
    pub fn of(name: &str, bytes: &[u8]) -> Self {
        let digest = blake3::hash(bytes).to_hex().to_string();
        Input { name: name.to_owned(), digest, bytes: bytes.len() as u64 }
    }
}

impl Plan {
    /// The plan of `job`, called `name`, over the scene described by `inputs` and `scene`, its kernel without bounds
    /// yet.
    ///
    /// # Errors
    /// [`crate::error::Error::Input`] where the plan would have too many shards, keep too many batch scores, or
    /// never be looked at.
    pub fn new(name: &str, job: Job, job_file: Input, inputs: Vec<Input>, scene: SceneSummary) -> Result<Plan> {
        let program = env!("CARGO_PKG_VERSION").to_owned();
        let (name, digest, bounds) = (name.to_owned(), String::new(), Vec::new());
        let plan = Plan { program, numerics: NUMERICS, name, digest, inputs, job_file, scene, bounds, job };
        plan.check_sizes()?;
        plan.check_looks()?;
        Ok(plan.bounded(Vec::new()))
    }

    /// The same plan with the kernel bounded by `bounds`, which are only looked for where the sizes are in order.
    pub fn bounded(mut self, bounds: Vec<f64>) -> Plan {
        self.bounds = bounds;
        self.digest = self.content_digest().to_hex().to_string();
        self
    }

    /// BLAKE3 of all that determines the content of a shard.
    pub fn content_digest(&self) -> blake3::Hash {
        let Job { run, transport, cameras, grids, points, gonios, regions, planes, spheres, sources, .. } = &self.job;
        let content = Content {
            numerics: self.numerics,
            seed: run.seed,
            histories_per_batch: run.histories_per_batch,
            thinning: run.thinning,
            batches_per_shard: run.batches_per_shard,
            channels: run.channels,
            sampling: run.sampling,
            estimator: transport.estimator,
            bounds: &self.bounds,
            roulette_below: match transport.roulette_below {
                Roulette::Below(share) => Some(share),
                Roulette::Analog(_) => None,
            },
            inputs: self.inputs.iter().map(|i| i.digest.as_str()).collect(),
            cameras: cameras.iter().map(camera_content).collect(),
            gonios,
            grids,
            points,
            regions: regions.iter().map(region_content).collect(),
            planes,
            spheres,
            sources,
        };
        let mut bytes = bytes_of(&content);
        if !self.job.replacements.is_empty() {
            let replaced = |r: &'_ Replacement| (r.node.clone(), r.degree);
            bytes.extend(bytes_of(&self.job.replacements.iter().map(replaced).collect::<Vec<_>>()));
        }
        // Behind the rest, and nothing without luminaires: jobs that have none keep their digests.
        if !self.job.luminaires.is_empty() {
            bytes.extend(serde_json::to_vec(&self.job.luminaires).expect("plain data always has a JSON form"));
        }
        if !self.job.materials.is_empty() {
            bytes.extend(serde_json::to_vec(&self.job.materials).expect("plain data always has a JSON form"));
        }
        if let Some(sky) = &self.job.sky {
            bytes.extend(serde_json::to_vec(sky).expect("plain data always has a JSON form"));
        }
        if !self.job.openings.is_empty() {
            bytes.extend(serde_json::to_vec(&self.job.openings).expect("plain data always has a JSON form"));
        }
        blake3::hash(&bytes)
    }

    /// All receiver sets in the order of the tallies.
    pub fn sets(&self) -> Vec<SetShape> {
        self.job.sets()
    }

    /// Number of shards.
    pub fn shard_count(&self) -> u64 {
        self.job.run.batches.div_ceil(self.job.run.batches_per_shard)
    }

    /// The batches of shard `k`; empty beyond the last shard.
    pub fn shard(&self, k: u64) -> Range<u64> {
        let run = &self.job.run;
        let start = k.saturating_mul(run.batches_per_shard).min(run.batches);
        start..start.saturating_add(run.batches_per_shard).min(run.batches)
    }

    /// The batches of every shard, in order.
    pub fn shards(&self) -> impl Iterator<Item = Range<u64>> + '_ {
        (0..self.shard_count()).map(|k| self.shard(k))
    }
}

fn bytes_of(content: &impl Serialize) -> Vec<u8> {
    postcard::to_stdvec(content).expect("plain data of known length always has a postcard form")
}

fn camera_content(camera: &Camera) -> CameraContent<'_> {
    let Camera { name, node, eye, target, up, vertical_fov_degrees, width, height, pixel_samples, monitor } = camera;
    (name, node, [*eye, *target, *up], *vertical_fov_degrees, [*width, *height, *pixel_samples], monitor)
}

fn region_content(region: &Region) -> RegionContent<'_> {
    let Region { name, camera, rectangle, node } = region;
    (name, camera, *rectangle, node)
}

#[cfg(test)]
mod tests;
