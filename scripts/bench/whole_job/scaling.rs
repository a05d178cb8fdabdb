//! One worker, two workers, one worker of two threads, on the same shards; and what two processes that share nothing get
//! from this machine, below which no program can be.

use super::{myself, program, run, timed};
use lampyris::tally::statistics::median;
use std::path::Path;
use std::process::Command;

const RUNS: usize = 3;
/// Rounds of the loop that shares nothing: about as long as a shard.
const ROUNDS: u64 = 1_000_000_000;

/// Interleaved runs, medians of the ratios of wall clock and of CPU time.
pub fn bench() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let job = job(folder.path());
    let mut ratios = [const { Vec::new() }; 3];
    let mut alone = Vec::new();
    for i in 0..RUNS {
        let dir = |what: &str| planned(&job, &folder.path().join(format!("{what}-{i}")));
        let (one, two, threads) = (dir("one"), dir("two"), dir("threads"));
        let spin_one = cost(|| (0..2).for_each(|_| run(&mut myself(&["spin"]))));
        let spin_two = cost(|| together([myself(&["spin"]), myself(&["spin"])]));
        let t_one = cost(|| (0..2).for_each(|shard| run(&mut work(&one, shard, 1))));
        let t_two = cost(|| together([work(&two, 0, 1), work(&two, 1, 1)]));
        let t_threads = cost(|| (0..2).for_each(|shard| run(&mut work(&threads, shard, 2))));
        let all = [(spin_one, spin_two), (t_one, t_two), (t_one, t_threads)];
        ratios.iter_mut().zip(all).for_each(|(list, (a, b))| list.push([a[0] / b[0], b[1] / a[1]]));
        alone.push(t_one);
    }
    let [wall, cpu] = [0, 1].map(|i| median(alone.iter().map(|cost| cost[i])));
    println!("two shards by one worker of one thread: {wall:.2} s, CPU time {cpu:.2} s");
    let names = ["two processes that share nothing", "two workers", "one worker of two threads"];
    for (name, list) in names.iter().zip(&mut ratios) {
        let cpu = median(list.iter().map(|ratio| ratio[1]));
        list.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let [low, middle, high] = [0, RUNS / 2, RUNS - 1].map(|i| list[i][0]);
        println!("{name}: {middle:.2} times as fast as one, {low:.2} to {high:.2}; {cpu:.3} times its CPU time");
    }
}

/// Wall clock of `work` and CPU time of the processes that it starts and waits for \[s\].
fn cost(work: impl FnOnce()) -> [f64; 2] {
    let before = children_time();
    let (wall, ()) = timed(work);
    [wall, children_time() - before]
}

/// CPU time of the processes that this one has waited for \[s\].
fn children_time() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").expect("Linux says so");
    let (_, fields) = stat.rsplit_once(") ").expect("the name of the program stands in brackets");
    // Fields 16 and 17 of proc(5), of which two stand before the bracket, in hundredths of a second.
    fields.split(' ').skip(13).take(2).map(|ticks| ticks.parse::<f64>().expect("a number") / 100.0).sum()
}

/// The job of the room, in two shards.
fn job(folder: &Path) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let job = std::fs::read_to_string(root.join("jobs/room.toml")).expect("the job ships with the project");
    let scene = root.join("scenes/room.glb").display().to_string();
    let job = job
        .replace("../scenes/room.glb", &scene)
        .replace("\nbatches = 64", "\nbatches = 4\nsampling = \"random\"")
        .replace("\nbatches_per_shard = 16", "\nbatches_per_shard = 2");
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
