//! Plans, scores and tallies for the tests of this folder.

use super::checkpoint::{Run, Snapshot, write};
use super::folder::Folder;
use super::plan::{Input, Plan, SceneSummary};
use crate::error::Result;
use crate::job::Job;
use crate::random::{Domain, Stream};
use crate::tally::{BatchScores, Scores, Tally};

/// A job with a map of more than one block, a small map, a kept grid and a point.
pub const JOB: &str = r#"
[run]
seed = 7
sampling = "random"
batches = 10
batches_per_shard = 4
channels = "rgb"
[[camera]]
name = "view"
eye = [0.0, 1.0, 3.0]
target = [0.0, 1.0, 0.0]
vertical_fov_degrees = 40.0
width = 5
height = 3
[[grid]]
name = "floor"
origin = [0.0, 0.0, 0.0]
u = [1.0, 0.0, 0.0]
v = [0.0, 0.0, -1.0]
normal = [0.0, 1.0, 0.0]
columns = 65
rows = 64
keep_batches = false
[[grid]]
name = "desk"
origin = [0.0, 0.8, 0.0]
u = [1.0, 0.0, 0.0]
v = [0.0, 0.0, -1.0]
normal = [0.0, 1.0, 0.0]
columns = 2
rows = 2
[[point]]
name = "meter"
position = [0.0, 0.8, 0.0]
normal = [0.0, 1.0, 0.0]
[[source]]
kind = "omni"
position = [0.0, 2.0, 0.0]
intensity = 100.0
"#;

/// The plan of the job `text` without a scene file.
pub fn plan_of(text: &str) -> Result<Plan> {
    let scene =
        SceneSummary { triangles: 0, sources: 1, flux_lm: 1.0, bytes: 0, narrowest_lobe: 1.0, warnings: Vec::new() };
    let job = Job::parse(text, "test.toml")?;
    let bounds = vec![1.0; if job.is_bounded() { job.sets().len() } else { 0 }];
    let plan = Plan::new("test", job, Input::of("test.toml", text.as_bytes()), Vec::new(), scene)?;
    Ok(plan.bounded(bounds))
}

/// The plan of [`JOB`].
pub fn plan() -> Plan {
    plan_of(JOB).unwrap()
}

/// Scores that depend on the plan's seed and the index of the batch only.
pub fn scores(plan: &Plan, index: u64) -> BatchScores {
    let mut sets = Vec::new();
    for shape in plan.sets() {
        let mut g = Stream::new(plan.job.run.seed, Domain::Receiver, &shape.name).generator(index);
        let mut s = Scores::zero(&shape);
        for i in 0..shape.bins() {
            s.value[i] = g.uniform();
            s.direct[i] = 0.1 * s.value[i];
            s.peak[i] = g.uniform();
            s.caustic[i] = g.uniform();
            s.existed[i] = g.uniform() < 0.9;
        }
        s.colour.iter_mut().for_each(|c| *c = [g.uniform(), g.uniform(), g.uniform()]);
        s.watched.iter_mut().for_each(|w| w.totals = (0..64).map(|_| (g.uniform() - 0.5).max(0.0)).collect());
        sets.push(s);
    }
    BatchScores { sets, flux: [1.0, 0.75, 0.25, 0.0, index as f64] }
}

/// The tally of the first `n` batches of `shard`.
pub fn tally(plan: &Plan, shard: u64, n: u64) -> Tally {
    let mut tally = Tally::new(&plan.sets());
    let start = shard * plan.job.run.batches_per_shard;
    (start..start + n).for_each(|index| tally.accumulate(&scores(plan, index)));
    tally
}

/// Direct light of every set: none on the maps, some elsewhere.
pub fn fixed_direct(plan: &Plan) -> Vec<Vec<f64>> {
    let of = |bins: usize| if bins > 4 { Vec::new() } else { vec![0.5; bins] };
    plan.sets().iter().map(|s| of(s.bins())).collect()
}

/// Writes the checkpoint of the first `n` batches of `shard`.
pub fn save(folder: &Folder, plan: &Plan, shard: u64, n: u64) -> Result<bool> {
    save_tally(folder, plan, shard, &tally(plan, shard, n), &fixed_direct(plan))
}

/// Writes a checkpoint of anything.
pub fn save_tally(folder: &Folder, plan: &Plan, shard: u64, tally: &Tally, fixed: &[Vec<f64>]) -> Result<bool> {
    let path = folder.shard_path(shard);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    let snapshot = Snapshot {
        plan,
        shard,
        tally,
        fixed_direct: fixed,
        runs: &[Run { batches: tally.batches(), host: "test".into(), instructions: "scalar".into(), seconds: 1.5 }],
        written: 1_700_000_000,
        relative_error: 0.25,
    };
    write(&path, &snapshot)
}
