//! The job file: what is asked. TOML -> [`Job`], every default filled in, every value a user typed checked.
//!
//! Lengths are metres in the axes of glTF (+Y up), angles degrees where the name says so. Paths are relative to
//! the job file. Unknown keys are refused. A [`Job`] is plain data: reading it opens one file and nothing else.

mod check;
mod form;
mod lights;
mod material;
mod receivers;
mod replacement;
mod sky;

pub use lights::{Extent, Luminaire, Source};
pub use material::{Material, Share};
pub use receivers::{Camera, Gonio, Grid, Kept, Point, ReceiverKind, Region, SetShape, View};
pub use replacement::{Degree, DegreeWord, Replacement};
pub use sky::{NamedSky, Opening, Sky, SkyModel, Sun};

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// One simulation as its user describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Job {
    /// The glTF scene, relative to the job file; optional when sources or luminaires are given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<String>,
    /// How much is computed, with which seed.
    #[serde(default)]
    pub run: Run,
    /// How trajectories end.
    #[serde(default)]
    pub transport: Transport,
    /// Luminance maps.
    #[serde(default, rename = "camera", skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<Camera>,
    /// Illuminance grids.
    #[serde(default, rename = "grid", skip_serializing_if = "Vec::is_empty")]
    pub grids: Vec<Grid>,
    /// Single lux-meters.
    #[serde(default, rename = "point", skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<Point>,
    /// Spatial-angular luminance distributions.
    #[serde(default, rename = "gonio", skip_serializing_if = "Vec::is_empty")]
    pub gonios: Vec<Gonio>,
    /// Parts of luminance maps of which the mean luminance is wanted.
    #[serde(default, rename = "region", skip_serializing_if = "Vec::is_empty")]
    pub regions: Vec<Region>,
    /// Ratios of means.
    #[serde(default, rename = "ratio", skip_serializing_if = "Vec::is_empty")]
    pub ratios: Vec<Ratio>,
    /// Precision as the goal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stop: Option<Stop>,
    /// Infinite one-sided Lambert planes.
    #[serde(default, rename = "plane", skip_serializing_if = "Vec::is_empty")]
    pub planes: Vec<Plane>,
    /// Analytic Lambert spheres.
    #[serde(default, rename = "sphere", skip_serializing_if = "Vec::is_empty")]
    pub spheres: Vec<Sphere>,
    /// Series of spherical harmonics in the place of meshes.
    #[serde(default, rename = "replace", skip_serializing_if = "Vec::is_empty")]
    pub replacements: Vec<Replacement>,
    /// Laws of reflection in the place of those of the scene file.
    #[serde(default, rename = "material", skip_serializing_if = "Vec::is_empty")]
    pub materials: Vec<Material>,
    /// Light sources beside those of the scene file.
    #[serde(default, rename = "source", skip_serializing_if = "Vec::is_empty")]
    pub sources: Vec<Source>,
    /// Photometric webs at their places.
    #[serde(default, rename = "luminaire", skip_serializing_if = "Vec::is_empty")]
    pub luminaires: Vec<Luminaire>,
    /// Daylight.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sky: Option<Sky>,
    /// Where daylight enters: they guide the drawing of directions, and change no mean.
    #[serde(default, rename = "opening", skip_serializing_if = "Vec::is_empty")]
    pub openings: Vec<Opening>,
}

/// Default histories of a batch in a job with maps.
const HISTORIES_OF_MAPS: u64 = 64;
/// The same in a job of lux-meters alone.
const HISTORIES_OF_METERS: u64 = 1024;
/// Bins to which a history is connected for each trajectory traced for it, by default: chosen by measured figure of merit
/// (docs/benchmarks.md).
const BINS_OF_A_TRAJECTORY: u64 = 128;
/// Greatest thinning by default.
const MOST_THINNING: u64 = 64;
/// Trajectories of a batch, at most, by default.
const TRAJECTORIES: u64 = 1 << 16;

/// `[run]`: seed, division of work and confidence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Run {
    /// Seed of every random number, 0 ..= 2^63-1.
    pub seed: u64,
    /// Histories of one batch; a batch is one realization, the unit of the variance. Left out: 64 with cameras or
    /// goniometers, whose pixels need many positions, and so many batches; else 1024, because a quasi-random set gains
    /// with its size (docs/benchmarks.md).
    pub histories_per_batch: u64,
    /// Trajectories traced for each history that is connected: of their vertices so many are chosen, by their flux and
    /// place, as one trajectory has on average. Left out: by the number of bins.
    pub thinning: u64,
    /// Number of batches of the whole job; with `[stop]` its `max_batches`, and not to be typed.
    pub batches: u64,
    /// Shard k holds the batches [k n, k n + n).
    pub batches_per_shard: u64,
    /// How the histories of a batch are drawn. Left out: quasi-random, but random for the paths of reverse estimation,
    /// which draw no point of a set.
    pub sampling: Sampling,
    /// Confidence of the intervals, between 0 and 1.
    pub confidence: f64,
    /// One photometric channel, or linear Rec.709.
    pub channels: Channels,
    /// Longest time between two checkpoints \[s\].
    pub checkpoint_seconds: f64,
}

impl Default for Run {
    fn default() -> Self {
        Run {
            seed: 1,
            histories_per_batch: HISTORIES_OF_METERS,
            thinning: 1,
            batches: 256,
            batches_per_shard: 32,
            sampling: Sampling::Rqmc,
            confidence: 0.95,
            channels: Channels::Luminance,
            checkpoint_seconds: 30.0,
        }
    }
}

/// Vertices kept for each that a tile of receivers is connected to, at most: chosen by measured figure of merit
/// (docs/benchmarks.md).
const MOST_KEPT: u64 = 8;
/// Histories whose vertices are kept to choose from, at most, so that they do not fill the memory.
const MOST_HISTORIES: u64 = 1 << 17;

impl Run {
    /// Trajectories traced in a batch.
    pub fn trajectories_per_batch(&self) -> u64 {
        self.histories_per_batch * self.thinning
    }

    /// Vertices that are kept for each that a tile of receivers is connected to, of which it chooses its own; 1 where it has no choice.
    pub fn vertices_kept(&self) -> u64 {
        self.thinning.min(MOST_KEPT).min(MOST_HISTORIES / self.histories_per_batch.max(1)).max(1)
    }
}

/// How the histories of a batch are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Sampling {
    /// A batch is one Owen-scrambled Sobol set of 2^m histories, scrambled independently of every other batch.
    Rqmc,
    /// Independent histories.
    Random,
}

/// What a weight is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Channels {
    /// One photometric channel: exact for grey reflectances only.
    Luminance,
    /// Linear Rec.709 red, green, blue, each its own weight on the same trajectory.
    Rgb,
}

/// `[transport]`: what is estimated how, and how trajectories end. There is no depth cut.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Transport {
    /// The rule that turns histories into numbers.
    pub estimator: Estimator,
    /// Bounded kernel with receiver-side continuation; false for the plain local estimate, whose error bars do not
    /// hold near edges. Of the local estimator only.
    pub bounded: bool,
    /// Survival probability min(1, W_n / (roulette_below W_1)), or "analog": the reflectance itself.
    pub roulette_below: Roulette,
}

impl Default for Transport {
    fn default() -> Self {
        Transport { estimator: Estimator::Local, bounded: true, roulette_below: Roulette::Below(0.05) }
    }
}

/// The rule that turns histories into numbers. All estimate the same quantities; light that a mirror sends straight to a
/// receiver is missing from the first two and counted by the third.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Estimator {
    /// Trajectories from the sources, connected to every receiver: the method of this program.
    Local,
    /// Paths from the receivers that find the light: a cross-check that shares geometry and reflectance only.
    Reverse,
    /// Trajectories counted where they cross the cells of a grid: the illumination map that the paper argues against.
    DirectSimulation,
}

/// `[stop]`: the run ends at the first look at which the precision asked for is reached.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stop {
    /// Half the width of the interval at `run.confidence` over the mean.
    pub relative_half_width: f64,
    /// Names of the receiver sets that must reach it; empty for all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub receivers: Vec<String>,
    /// Share of the bins of each set that must reach it, above 0 and at most 1.
    #[serde(default = "whole")]
    pub share: f64,
    /// The most batches of the job: a limit, not a look.
    pub max_batches: u64,
}

/// `[[ratio]]`: ratio of two means, with an interval that respects their correlation. Only read from the results.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ratio {
    /// Name of the ratio.
    pub name: String,
    /// A grid that keeps its batches (its mean), a point or a region.
    pub numerator: String,
    /// The same.
    pub denominator: String,
}

/// Unbiased Russian roulette.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a number above 0, at most 1, or \"analog\"")]
pub enum Roulette {
    /// Weights below this share of the first weight are played for.
    Below(f64),
    /// Analog absorption: survival probability = reflectance from the first vertex on.
    Analog(Analog),
}

/// The word "analog".
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Analog {
    /// The only word allowed.
    Analog,
}

/// `[[plane]]`: infinite Lambert plane, reflecting on the side of its normal, absorbing on the other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plane {
    /// A point of the plane \[m\].
    pub point: [f64; 3],
    /// Normal on the reflecting side; need not be a unit vector.
    pub normal: [f64; 3],
    /// Lambert reflectance, 0 ..= 1.
    pub reflectance: f64,
}

/// `[[sphere]]`: analytic Lambert sphere, reflecting on one side, absorbing on the other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sphere {
    /// Centre \[m\].
    pub center: [f64; 3],
    /// Radius \[m\].
    pub radius: f64,
    /// Reflecting side.
    #[serde(default)]
    pub facing: Facing,
    /// Lambert reflectance, 0 ..= 1.
    pub reflectance: f64,
}

/// Reflecting side of a sphere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Facing {
    /// The inside reflects: an integrating sphere.
    Inward,
    /// The outside reflects.
    #[default]
    Outward,
}

impl Job {
    /// Reads and checks the job file at `path`.
    ///
    /// # Errors
    /// [`Error::Input`] naming the field, its value and the allowed range; [`Error::Io`].
    pub fn read(path: &Path) -> Result<Job> {
        let text = std::fs::read_to_string(path).map_err(Error::io(path))?;
        Job::parse(&text, &path.display().to_string())
    }

    /// Checks the text of a job file; `file` is its name in errors.
    ///
    /// # Errors
    /// [`Error::Input`] naming the field, its value and the allowed range.
    pub fn parse(text: &str, file: &str) -> Result<Job> {
        // Some editors begin a file with a mark of its encoding.
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut job = form::job(text, file)?;
        let typed = Typed::of(text);
        if let Some(stop) = &job.stop {
            check::check_typed_batches(typed.batches, stop, file)?;
            job.run.batches = stop.max_batches;
        }
        if typed.histories_per_batch.is_none() && job.has_maps() {
            job.run.histories_per_batch = HISTORIES_OF_MAPS;
        }
        if typed.thinning.is_none() && job.transport.estimator == Estimator::Local {
            job.run.thinning = job.thinning();
        }
        if typed.sampling.is_none() && job.transport.estimator == Estimator::Reverse {
            job.run.sampling = Sampling::Random;
        }
        check::check(&job, file)?;
        Ok(job)
    }

    /// True when the kernel of the local estimate is bounded.
    pub fn is_bounded(&self) -> bool {
        self.transport.estimator == Estimator::Local && self.transport.bounded
    }

    /// The thinning of a job that does not say: tracing shall cost less than connecting, and memory be kept.
    fn thinning(&self) -> u64 {
        let regions = self.regions.len();
        let sets = self.sets();
        let bins = sets[..sets.len() - regions].iter().map(|s| s.bins() as u64).fold(0, u64::saturating_add);
        let most = (TRAJECTORIES / self.run.histories_per_batch.max(1)).clamp(1, MOST_THINNING);
        1 << (bins / BINS_OF_A_TRAJECTORY).clamp(1, most).ilog2()
    }

    /// The field that says how many batches the job has at most.
    pub fn batches_field(&self) -> &'static str {
        if self.stop.is_some() { "stop.max_batches" } else { "run.batches" }
    }

    /// True with cameras or goniometers among the receivers.
    fn has_maps(&self) -> bool {
        !(self.cameras.is_empty() && self.gonios.is_empty())
    }

    /// All receiver sets in the order of the tallies: cameras, gonios, grids, points, regions.
    pub fn sets(&self) -> Vec<SetShape> {
        let cameras = self.cameras.iter().map(|c| c.shape(self.run.channels));
        let gonios = self.gonios.iter().map(|g| g.shape(self.run.channels));
        let grids = self.grids.iter().map(|g| g.shape());
        let points = self.points.iter().map(|p| p.shape());
        let regions = self.regions.iter().map(|r| r.shape());
        cameras.chain(gonios).chain(grids).chain(points).chain(regions).collect()
    }
}

/// What stands in `[run]` of the job file: a default is not what somebody typed.
#[derive(Default, Deserialize)]
struct Typed {
    batches: Option<u64>,
    histories_per_batch: Option<u64>,
    thinning: Option<u64>,
    sampling: Option<Sampling>,
}

impl Typed {
    fn of(text: &str) -> Self {
        #[derive(Deserialize)]
        struct File {
            run: Option<Typed>,
        }
        toml::from_str::<File>(text).ok().and_then(|file| file.run).unwrap_or_default()
    }
}

fn whole() -> f64 {
    1.0
}
