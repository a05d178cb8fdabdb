//! A whole job by the real binary, from the job file to the pictures: `cargo bench --bench whole_job`.
//!
//! The room of `jobs/room.toml` with fewer batches, by one worker process of as many threads as there are cores, and by
//! two that share them; wall clock, medians of interleaved runs.

use lampyris::job::Job;
use lampyris::tally::statistics::median;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

const RUNS: usize = 3;

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let room = std::fs::read_to_string(root.join("jobs/room.toml")).expect("the job ships with the project");
    let scene = root.join("scenes/room.glb").display().to_string();
    let job = room
        .replace("../scenes/room.glb", &scene)
        .replace("\nbatches = 64", "\nbatches = 8\nsampling = \"random\"")
        .replace("\nbatches_per_shard = 16", "\nbatches_per_shard = 4");
    let parsed = Job::parse(&job, "room.toml").expect("the job is right");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("room.toml");
    std::fs::write(&path, job).expect("a job file");
    let mut seconds = [Vec::new(), Vec::new()];
    for run in 0..RUNS {
        for workers in [1, 2] {
            let out = folder.path().join(format!("out-{run}-{workers}"));
            let start = Instant::now();
            let status = Command::new(env!("CARGO_BIN_EXE_lampyris"))
                .args(["run", "-q", "-w", &workers.to_string(), "-o"])
                .arg(&out)
                .arg(&path)
                .stdout(std::process::Stdio::null())
                .status();
            assert!(status.expect("the program starts").success());
            seconds[workers - 1].push(start.elapsed().as_secs_f64());
        }
    }
    let [one, two] = seconds.map(|runs| median(runs.into_iter()));
    let [batches, histories] = [parsed.run.batches, parsed.run.histories_per_batch];
    let ratio = one / two;
    println!(
        "room, {batches} batches of {histories} histories: 1 worker process on all cores {one:.2} s, 2 sharing them \
         {two:.2} s, ratio {ratio:.2}"
    );
}
