//! Shared by the benches: scenes that ship with the project, and CPU time.
#![allow(dead_code, reason = "each bench uses its own part")]

use lampyris::farm::realization::Realization;
use lampyris::job::Job;
use lampyris::scene::{Model, Scene, gltf};
use lampyris::tally::statistics::Estimate;
use nix::time::{ClockId, clock_gettime};
use std::time::Duration;

/// The model of `scenes/{name}.glb`.
pub fn load(name: &str) -> Model {
    let path = format!("{}/scenes/{name}.glb", env!("CARGO_MANIFEST_DIR"));
    let bytes = std::fs::read(path).expect("the scene ships with the project");
    gltf::load(name, &bytes, &mut |uri| panic!("{uri}: the scene is one file")).expect("the scene is right")
}

/// The job given as TOML, in the scene that it makes of `model`.
pub fn prepare(toml: &str, model: Model) -> (Job, Scene) {
    let job = Job::parse(toml, "bench").expect("the job is right");
    let scene = Scene::new(model, &job).expect("the scene is right");
    (job, scene)
}

/// CPU time of this thread: whoever else uses the machine does not count.
pub fn thread_time() -> Duration {
    clock_gettime(ClockId::CLOCK_THREAD_CPUTIME_ID).expect("Linux has this clock").into()
}

/// What the batches of a job cost, and how exact they make the bins of its first receiver set.
pub struct Reached {
    /// CPU time \[s\].
    pub seconds: f64,
    /// CPU time of a history and bin \[s\].
    pub of_a_bin: f64,
    /// Root of the mean squared relative standard error of the bins \[1\].
    pub relative_error: f64,
    /// The largest of them \[1\].
    pub worst: f64,
}

/// Computes all batches of `job` on this thread.
pub fn reach(realization: &Realization, job: &Job) -> Reached {
    let start = thread_time();
    let scores: Vec<_> = (0..job.run.batches).map(|i| realization.batch(i)).collect();
    let seconds = (thread_time() - start).as_secs_f64();
    let bins = scores[0].sets[0].value.len();
    let fixed = &realization.fixed_direct()[0];
    let error = |bin: usize| {
        let estimate = Estimate::from_scores(scores.iter().map(|s| s.sets[0].value[bin]));
        Some(estimate.with_fixed(fixed, bin)?.relative_error()).filter(|r| r.is_finite())
    };
    let errors: Vec<f64> = (0..bins).filter_map(error).collect();
    let mean_square = errors.iter().map(|r| r * r).sum::<f64>() / errors.len() as f64;
    let histories = job.run.histories_per_batch * job.run.batches;
    Reached {
        seconds,
        of_a_bin: seconds / (histories * bins as u64) as f64,
        relative_error: mean_square.sqrt(),
        worst: errors.iter().fold(0.0, |a, &b| f64::max(a, b)),
    }
}
