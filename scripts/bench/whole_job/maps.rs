//! A job of one map of 1 megapixel with made-up scores: what checkpoints and merging cost does not depend on how the
//! numbers came about.

use lampyris::farm::checkpoint::{Run, Snapshot};
use lampyris::farm::plan::{Input, Plan, SceneSummary};
use lampyris::job::Job;
use lampyris::random::{Domain, Stream};
use lampyris::tally::{BatchScores, Scores, Tally};
use std::sync::LazyLock;

/// Edge of the map \[pixels\].
pub const SIDE: usize = 1024;
/// Of the one map: none.
static NO_FIXED_DIRECT: [Vec<f64>; 1] = [Vec::new()];
static RUNS: LazyLock<[Run; 1]> = LazyLock::new(|| {
    [Run { batches: OF_SHARD, host: "bench".to_owned(), instructions: "scalar".to_owned(), seconds: 60.0 }]
});
/// Batches in each shard.
pub const OF_SHARD: u64 = 4;

/// The plan of `shards` shards; `channels` as in the job.
pub fn plan(channels: &str, shards: u64) -> Plan {
    let batches = shards * OF_SHARD;
    let text = format!(
        "[run]\nsampling = \"random\"\nbatches = {batches}\nbatches_per_shard = {OF_SHARD}\nchannels = \"{channels}\"\n\
         [[camera]]\nname = \"view\"\neye = [0.0, 1.0, 3.0]\ntarget = [0.0, 1.0, 0.0]\nvertical_fov_degrees = 40.0\n\
         width = {SIDE}\nheight = {SIDE}\n[[source]]\nkind = \"omni\"\nposition = [0.0, 2.0, 0.0]\nintensity = 100.0\n"
    );
    let job = Job::parse(&text, "bench").expect("the job is right");
    let scene =
        SceneSummary { triangles: 0, sources: 1, flux_lm: 1.0, bytes: 0, narrowest_lobe: 1.0, warnings: Vec::new() };
    let plan = Plan::new("bench", job, Input::of("bench", text.as_bytes()), Vec::new(), scene);
    let plan = plan.expect("the plan is within its limits");
    let bounds = vec![1.0; plan.sets().len()];
    plan.bounded(bounds)
}

/// Scores of the batch number `index`.
pub fn scores(plan: &Plan, index: u64) -> BatchScores {
    let of_set = |shape| {
        let mut s = Scores::zero(shape);
        let mut g = Stream::new(1, Domain::Receiver, "bench").generator(index);
        for i in 0..shape.bins() {
            s.value[i] = g.uniform();
            (s.direct[i], s.peak[i]) = (0.1 * s.value[i], s.value[i] * s.value[i]);
            (s.caustic[i], s.existed[i]) = (0.0, s.value[i] < 0.99);
        }
        s.colour.iter_mut().zip(&s.value).for_each(|(c, &v)| *c = [v, 0.9 * v, 0.8 * v]);
        s
    };
    BatchScores { sets: plan.sets().iter().map(of_set).collect(), flux: [1.0, 0.75, 0.25, 0.0, 0.0] }
}

/// The tally of one shard's batches.
pub fn tally(plan: &Plan, shard: u64) -> Tally {
    let mut tally = Tally::new(&plan.sets());
    (0..OF_SHARD).for_each(|i| tally.accumulate(&scores(plan, shard * OF_SHARD + i)));
    tally
}

/// What is written of `tally` as `shard`.
pub fn snapshot<'a>(plan: &'a Plan, shard: u64, tally: &'a Tally) -> Snapshot<'a> {
    Snapshot { plan, shard, tally, fixed_direct: &NO_FIXED_DIRECT, runs: &*RUNS, written: 0, relative_error: 0.1 }
}
