//! Processes: starting, watching through /proc, stopping.

use lampyris::random::{Domain, Generator, Stream};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Whoever waits longer than this waits in vain.
const PATIENCE: Duration = Duration::from_secs(60);

/// `lampyris` with `args`, its environment that of the test without what would steer it.
pub fn lampyris(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lampyris"));
    command.args(args).stdin(Stdio::null());
    command
        .env_remove("SLURM_ARRAY_TASK_ID")
        .env_remove("SLURM_ARRAY_JOB_ID")
        .env_remove("LAMPYRIS_FAULT")
        .env_remove("GLIBC_TUNABLES")
        .env_remove("LAMPYRIS_SIMD");
    command
}

/// `lampyris run` without progress.
pub fn run_quietly(job: &Path, dir: &Path, workers: usize) -> Command {
    let mut command = lampyris(&["run", "-q", "-w", &workers.to_string()]);
    command.arg(job).arg("-o").arg(dir);
    command
}

/// `lampyris work` with one thread.
pub fn work(dir: &Path, shard: u64) -> Command {
    let mut command = lampyris(&["work", "--threads", "1", "--shard", &shard.to_string()]);
    command.arg(dir);
    command
}

/// Runs `command`, expects exit code `code`, and returns what was said on both streams.
#[track_caller]
pub fn expect(code: i32, command: &mut Command) -> String {
    let output = command.output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap() + &String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(code), "{command:?}: {}: {said}", output.status);
    assert!(!said.contains("panicked"), "{command:?}: {said}");
    said
}

/// Starts `command` without listening to it.
pub fn start(command: &mut Command) -> Child {
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

pub fn pid(child: &Child) -> i32 {
    child.id().try_into().unwrap()
}

/// Sends a signal to a process that this test started, or that one of its processes started, and that is not reaped.
pub fn send(pid: i32, signal: Signal) {
    kill(Pid::from_raw(pid), signal).unwrap();
}

/// Waits until `done` says something.
#[track_caller]
pub fn wait_for<T>(what: &str, mut done: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(result) = done() {
            return result;
        }
        assert!(begun.elapsed() < PATIENCE, "waited in vain: {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// What /proc says of a process.
#[derive(Clone, Copy, Debug)]
pub struct Stat {
    /// R, S, D, T, Z, ...
    pub state: char,
    /// Status as `waitpid` will return it, once the process is a zombie.
    pub wait_status: i32,
    /// Time of a processor that it has had [1/100 s].
    pub ticks: u64,
}

/// None once it is reaped.
pub fn stat(pid: i32) -> Option<Stat> {
    let text = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The name stands in brackets and may hold anything.
    let fields: Vec<&str> = text.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = fields[11].parse::<u64>().ok()? + fields[12].parse::<u64>().ok()?;
    Some(Stat { state: fields[0].chars().next()?, wait_status: fields[49].parse().ok()?, ticks })
}

/// True while it runs: neither a zombie nor gone.
pub fn alive(pid: i32) -> bool {
    stat(pid).is_some_and(|s| !matches!(s.state, 'Z' | 'X'))
}

/// The live workers among the children of `coordinator`.
pub fn workers_of(coordinator: i32) -> Vec<i32> {
    let Ok(threads) = fs::read_dir(format!("/proc/{coordinator}/task")) else { return Vec::new() };
    let children = threads.flatten().filter_map(|thread| fs::read_to_string(thread.path().join("children")).ok());
    let pids: Vec<i32> =
        children.flat_map(|c| c.split_whitespace().map(|p| p.parse().unwrap()).collect::<Vec<_>>()).collect();
    pids.into_iter().filter(|&p| is_worker(p) && alive(p)).collect()
}

fn is_worker(pid: i32) -> bool {
    let line = fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
    line.split(|&b| b == 0).nth(1) == Some(b"work")
}

/// True once `pid` has its own handlers for SIGTERM and SIGINT, so that these ask it to stop.
pub fn listens(pid: i32) -> bool {
    let text = fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let caught = text.lines().find_map(|l| l.strip_prefix("SigCgt:")).unwrap_or("0");
    let mask = u64::from_str_radix(caught.trim(), 16).unwrap();
    [Signal::SIGTERM, Signal::SIGINT].iter().all(|&s| mask & (1 << (s as u32 - 1)) != 0)
}

/// The draws of one test, from the recorded seed of all.
pub fn draws(test: &str) -> Generator {
    const SEED: u64 = 20_260;
    Stream::new(SEED, Domain::Receiver, test).generator(0)
}

/// An instant drawn between now and `longest_ms` later; waits until then.
pub fn sleep_until_drawn(draw: &mut Generator, longest_ms: u32) {
    std::thread::sleep(Duration::from_micros(u64::from(draw.below(1000 * longest_ms))));
}
