//! What a whole job costs around its kernel: `cargo bench --bench whole_job [-- PART...]`.
//!
//! | part | what |
//! |---|---|
//! | `start` | from the start of `lampyris run` to the first batch in a checkpoint, and where that time goes |
//! | `checkpoints` | one checkpoint of a map of 1 megapixel, by step |
//! | `merge` | reading 2 to 128 shards of such a map: speed and peak memory |
//! | `scaling` | one worker, two workers, one worker of two threads, and what the machine itself gives |
//! | `memory` | state per bin and per triangle, and the element map that direct simulation would need |
//!
//! Times are wall clock, in brackets CPU time: on a machine that others use the first says little by itself. Without a part all
//! are run. Everything lies in a temporary folder (5.5 GB for `merge`).

mod checkpoints;
mod large;
mod maps;
mod memory;
mod merging;
mod scaling;
mod start;

use lampyris::tally::statistics::median;
use nix::time::{ClockId, clock_gettime};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| word != "--bench").collect();
    // Peak memory belongs to a process, so some measurements are made in one of their own.
    if let [part, folder] = &words[..]
        && part == "merge-here"
    {
        return merging::here(Path::new(folder));
    }
    if words == ["spin"] {
        return scaling::spin();
    }
    let wanted = |part: &str| words.is_empty() || words.iter().any(|word| word == part);
    let parts: [(&str, fn()); 5] = [
        ("start", start::bench),
        ("checkpoints", checkpoints::bench),
        ("merge", merging::bench),
        ("scaling", scaling::bench),
        ("memory", memory::bench),
    ];
    parts.iter().filter(|(part, _)| wanted(part)).for_each(|(part, bench)| {
        println!("\n== {part}");
        bench();
    });
}

/// The program with `arguments`, silent.
fn program(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lampyris"));
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null());
    command
}

/// This bench itself, in a process of its own, with `arguments`.
fn myself(arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::current_exe().expect("this program has a path"));
    command.args(arguments);
    command
}

/// Runs `command` and demands that it succeed.
fn run(command: &mut Command) {
    assert!(command.status().expect("the program starts").success(), "{command:?}");
}

/// Wall clock and CPU time.
struct Milliseconds {
    wall: f64,
    cpu: f64,
}

impl std::fmt::Display for Milliseconds {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{:.0} ({:.0})", self.wall, self.cpu)
    }
}

/// Wall clock of `work` \[s\], and what it made.
fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = Instant::now();
    let made = work();
    (start.elapsed().as_secs_f64(), made)
}

/// Median wall clock of `runs` times `work`, and median CPU time \[ms\].
fn median_of(runs: usize, mut work: impl FnMut()) -> Milliseconds {
    let both: Vec<[f64; 2]> = (0..runs).map(|_| timed(|| cpu_timed(&mut work).0)).map(|(w, c)| [w, c]).collect();
    let [wall, cpu] = [0, 1].map(|i| 1e3 * median(both.iter().map(|run| run[i])));
    Milliseconds { wall, cpu }
}

/// CPU time of this process so far, all threads \[s\]: whoever else uses the machine does not count.
fn process_time() -> f64 {
    let now = clock_gettime(ClockId::CLOCK_PROCESS_CPUTIME_ID).expect("Linux has this clock");
    Duration::from(now).as_secs_f64()
}

/// CPU time of `work` \[s\], and what it made.
fn cpu_timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = process_time();
    let made = work();
    (process_time() - start, made)
}

/// Peak memory of this process \[bytes\].
fn peak_memory() -> u64 {
    let text = std::fs::read_to_string("/proc/self/status").expect("Linux says so");
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:")).expect("Linux says so");
    let kib: u64 = line.trim().trim_end_matches(" kB").parse().expect("a number");
    kib * 1024
}
