//! One worker, two workers, one worker of two threads, on the same shards; and what two processes that share nothing get
//! from this machine, below which no program can be.

use super::{myself, program, run, timed};
use lampyris::tally::statistics::median;
use std::path::Path;
use std::process::Command;

const RUNS: usize = 7;
/// Rounds of the loop that shares nothing: about as long as a shard.
const ROUNDS: u64 = 2_000_000_000;

/// Interleaved runs, medians of the times and of the ratios.
pub fn bench() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let job = job(folder.path());
    let mut speedups = [Vec::new(), Vec::new(), Vec::new(), Vec::new()];
    let mut alone = Vec::new();
    for i in 0..RUNS {
        let dir = |what: &str| planned(&job, &folder.path().join(format!("{what}-{i}")));
        let (one, two, threads) = (dir("one"), dir("two"), dir("threads"));
        let (spin_one, ()) = timed(|| (0..2).for_each(|_| run(&mut myself(&["spin"]))));
        let (spin_two, ()) = timed(|| together([myself(&["spin"]), myself(&["spin"])]));
        let (t_one, ()) = timed(|| (0..2).for_each(|shard| run(&mut work(&one, shard, 1))));
        let (t_two, ()) = timed(|| together([work(&two, 0, 1), work(&two, 1, 1)]));
        let (t_threads, ()) = timed(|| (0..2).for_each(|shard| run(&mut work(&threads, shard, 2))));
        let machine = spin_one / spin_two;
        let all = [machine, t_one / t_two, t_one / t_threads, t_one / t_two / machine];
        speedups.iter_mut().zip(all).for_each(|(list, ratio)| list.push(ratio));
        alone.push(t_one);
    }
    println!("two shards by one worker of one thread: {:.2} s", median(alone.into_iter()));
    let names =
        ["two processes that share nothing", "two workers", "one worker of two threads", "two workers over the first"];
    for (name, list) in names.iter().zip(&mut speedups) {
        list.sort_by(f64::total_cmp);
        println!("{name}: {:.3} times one, {:.3} to {:.3}", list[RUNS / 2], list[0], list[RUNS - 1]);
    }
}

/// The job of the room, in two shards.
fn job(folder: &Path) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let job = std::fs::read_to_string(root.join("jobs/room.toml")).expect("the job ships with the project");
    let scene = root.join("scenes/room.glb").display().to_string();
    let job = job
        .replace("../scenes/room.glb", &scene)
        .replace("\nbatches = 64", "\nbatches = 8\nsampling = \"random\"")
        .replace("\nbatches_per_shard = 16", "\nbatches_per_shard = 4");
    let path = folder.join("room.toml");
    std::fs::write(&path, job).expect("a job file");
    path.display().to_string()
}

/// The folder `dir`, with the plan of `job` in it.
fn planned(job: &str, dir: &Path) -> String {
    let dir = dir.display().to_string();
    run(&mut program(&["plan", job, "-o", &dir]));
    dir
}

fn work(dir: &str, shard: u64, threads: u64) -> Command {
    program(&["work", dir, "--shard", &shard.to_string(), "--threads", &threads.to_string()])
}

/// Both at the same time, until both have ended.
fn together(mut commands: [Command; 2]) {
    let children = commands.each_mut().map(|command| command.spawn().expect("the program starts"));
    children.into_iter().for_each(|mut child| assert!(child.wait().expect("it is ours").success()));
}

/// A loop in registers.
pub fn spin() {
    let mut state = 1u64;
    for round in 0..ROUNDS {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(round);
    }
    std::hint::black_box(state);
}
