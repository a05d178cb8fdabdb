//! Shared by the benches: scenes that ship with the project, and CPU time.
#![allow(dead_code, reason = "each bench uses its own part")]

use lampyris::job::Job;
use lampyris::scene::{Model, Scene, gltf};
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
