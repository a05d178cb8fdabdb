//! Figure of merit of the receiver sets of jobs, one thread:
//! `cargo bench --bench merit -- [--histories N] [--thinning N] [--batches N] [--positions N] JOB.toml ...`. Prints a markdown table.
//!
//! FOM = 1 / (mean squared relative error of the bins x CPU seconds), the error from the batches; medians of three seeds. The
//! sizes of batches and the constants of the remedies were chosen with it, on the jobs of `peers`.

mod common;

use common::{Reached, reach};
use lampyris::farm::pilot::bounds;
use lampyris::farm::realization::Realization;
use lampyris::job::Job;
use lampyris::scene::{Model, Scene, gltf};
use lampyris::tally::statistics::{figure_of_merit, median};
use std::path::Path;

const SEEDS: u64 = 3;

/// What the command line puts in the place of what a job says.
#[derive(Default)]
struct Asked {
    histories: Option<u64>,
    batches: Option<u64>,
    thinning: Option<u64>,
    positions: Option<u32>,
}

fn main() {
    let mut asked = Asked::default();
    let mut jobs = Vec::new();
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    while let Some(argument) = arguments.next() {
        let mut number = || arguments.next().and_then(|n| n.parse().ok()).expect("a number after the option");
        match argument.as_str() {
            "--histories" => asked.histories = Some(number()),
            "--batches" => asked.batches = Some(number()),
            "--thinning" => asked.thinning = Some(number()),
            "--positions" => asked.positions = Some(number() as u32),
            _ => jobs.push(argument),
        }
    }
    println!(
        "| job | histories, thinning, batches | us a history and bin | error | worst bin | FOM [1/s] |\n|---|---|---|---|---|---|"
    );
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    pool.install(|| jobs.iter().for_each(|path| measure(Path::new(path), &asked)));
}

fn measure(path: &Path, asked: &Asked) {
    let text = std::fs::read_to_string(path).expect("a job file");
    let mut job = Job::parse(&text, &path.to_string_lossy()).expect("the job is right");
    job.run.histories_per_batch = asked.histories.unwrap_or(job.run.histories_per_batch);
    job.run.thinning = asked.thinning.unwrap_or(job.run.thinning);
    job.run.batches = asked.batches.unwrap_or(job.run.batches);
    for camera in &mut job.cameras {
        camera.pixel_samples = asked.positions.unwrap_or(camera.pixel_samples);
    }
    let scene = job.scene.as_ref().expect("a scene in glTF");
    let bytes = std::fs::read(path.with_file_name(scene)).expect("the scene is where the job says");
    let model =
        gltf::load("scene", &bytes, &mut |uri| panic!("{uri}: the scene is one file")).expect("the scene is right");
    let runs: Vec<[f64; 4]> = (1..=SEEDS).map(|seed| run(&model, &mut job, seed)).collect();
    let of = |k: usize| median(runs.iter().map(|r| r[k]));
    println!(
        "| {} | {}, {}, {} | {:.4} | {:.3} % | {:.2} % | {:.0} |",
        path.file_stem().unwrap_or_default().to_string_lossy(),
        job.run.histories_per_batch,
        job.run.thinning,
        job.run.batches,
        1e6 * of(0),
        100.0 * of(1),
        100.0 * of(2),
        of(3),
    );
}

/// Seconds of a history and bin, relative error, the worst of a bin, figure of merit of the first receiver set.
fn run(model: &Model, job: &mut Job, seed: u64) -> [f64; 4] {
    job.run.seed = seed;
    let scene = Scene::new(model.clone(), job).expect("the scene is right");
    let realization = Realization::new(job, &scene, &bounds(job, &scene));
    let Reached { seconds, of_a_bin, relative_error, worst } = reach(&realization, job);
    [of_a_bin, relative_error, worst, figure_of_merit(relative_error, seconds)]
}
