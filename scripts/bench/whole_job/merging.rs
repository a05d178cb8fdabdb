//! Merging 2 to 128 shards of a map of 1 megapixel: speed of reading, and peak memory.

use super::maps::{plan, snapshot, tally};
use super::{cpu_timed, median_of, myself, peak_memory, run, timed};
use lampyris::farm::checkpoint::write;
use lampyris::farm::folder::Folder;
use lampyris::farm::merge::merge;
use lampyris::tally::statistics::median;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const RUNS: usize = 3;

/// Every number of shards, with the files in memory and, once, from the disk; then the files of results.
pub fn bench() {
    for shards in [2, 8, 32, 128] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let bytes = fill(folder.path(), shards);
        let warm: Vec<[f64; 3]> = (0..RUNS).map(|_| in_a_process(folder.path())).collect();
        let mut cold = Vec::new();
        let mut disk = Vec::new();
        for _ in 0..RUNS {
            forget(folder.path());
            cold.push(in_a_process(folder.path())[0]);
            forget(folder.path());
            disk.push(timed(|| copy_to_nowhere(folder.path())).0);
        }
        let [seconds, cpu, memory] = [0, 1, 2].map(|i| median(warm.iter().map(|run| run[i])));
        let speed = |seconds: f64| format!("{seconds:.2} s = {:.2} GB/s", bytes as f64 / seconds / 1e9);
        let [cold, disk] = [cold, disk].map(|runs| speed(median(runs.into_iter())));
        println!(
            "{shards} shards, {:.2} GB: from memory {} (CPU time {}); from the disk {cold}, where reading alone takes \
             {disk}; peak memory {:.0} MB",
            bytes as f64 / 1e9,
            speed(seconds),
            speed(cpu),
            memory / 1e6
        );
    }
    results();
}

/// Writes `shards` checkpoints; their size \[bytes\].
fn fill(root: &Path, shards: u64) -> u64 {
    let plan = plan("luminance", shards);
    let folder = Folder::new(root);
    folder.establish(&plan, &[]).expect("the disk has room");
    // The numbers may repeat, the number of the shard and the digests may not: two tallies serve all.
    let tallies = [0, 1].map(|shard| tally(&plan, shard));
    for shard in 0..shards {
        let written = write(&folder.shard_path(shard), &snapshot(&plan, shard, &tallies[shard as usize % 2]));
        assert!(written.expect("the disk has room"));
    }
    files(root).iter().map(|path| path.metadata().expect("it was written").len()).sum()
}

fn files(root: &Path) -> Vec<PathBuf> {
    let found = Folder::new(root).checkpoints().expect("the folder can be read");
    found.into_iter().map(|(_, path)| path).collect()
}

/// Seconds, CPU seconds and peak memory \[bytes\] of merging in a process of its own.
fn in_a_process(root: &Path) -> [f64; 3] {
    let output = myself(&["merge-here", &root.display().to_string()]).output().expect("the program starts");
    let text = String::from_utf8(output.stdout).expect("numbers are text");
    let numbers: Vec<f64> = text.split_whitespace().map(|n| n.parse().expect("a number")).collect();
    [numbers[0], numbers[1], numbers[2]]
}

/// Merges the folder `root` and prints seconds, CPU seconds and peak memory.
pub fn here(root: &Path) {
    let (seconds, (cpu, merged)) =
        timed(|| cpu_timed(|| merge(&[Folder::new(root)], root).expect("the shards are whole")));
    println!("{seconds} {cpu} {}", peak_memory());
    drop(merged);
}

/// Asks the system to drop the checkpoints from its cache.
fn forget(root: &Path) {
    for path in files(root) {
        run(Command::new("dd")
            .arg(format!("if={}", path.display()))
            .args(["iflag=nocache", "count=0"])
            .stderr(Stdio::null()));
    }
}

/// Reads every checkpoint and does nothing with it.
fn copy_to_nowhere(root: &Path) {
    for path in files(root) {
        let input = std::fs::File::open(path).expect("it was written");
        run(Command::new("dd").args(["of=/dev/null", "bs=1M"]).stdin(input).stderr(Stdio::null()));
    }
}

/// Writing the results of a map of 1 megapixel.
fn results() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fill(folder.path(), 2);
    let (plan, merged) = merge(&[Folder::new(folder.path())], folder.path()).expect("the shards are whole");
    let out = folder.path().join("results");
    let write = || drop(lampyris::report::write(&plan, &merged, &out).expect("the disk has room"));
    println!("files of results (EXR of 11 channels, PNG, summary): {} ms", median_of(RUNS, write));
}
