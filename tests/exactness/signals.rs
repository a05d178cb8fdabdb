//! SIGTERM and SIGINT: checkpoint, exit 75, and on to the same bits.

use crate::place::{Place, SHARDS, assert_shards, batches, batches_of};
use crate::process::{
    alive, draws, listens, pid, run_quietly, send, sleep_until_drawn, start, wait_for, work, workers_of,
};
use nix::sys::signal::Signal;

const STOPPED: i32 = 75;
const ATTEMPTS: u32 = 400;

/// Stops workers by `signal` until three have stopped with batches that only the signal made them write down.
fn stop_workers(signal: Signal, name: &str) {
    const STOPS: usize = 3;
    let place = Place::new();
    let mut draw = draws(name);
    let (mut stops, mut round) = (0, 0);
    let mut dir = place.planned("0");
    for attempt in 0..ATTEMPTS {
        if stops >= STOPS {
            break;
        }
        let Some(shard) = (0..SHARDS).find(|&k| batches(&dir, k) < batches_of(k)) else {
            round += 1;
            dir = place.planned(&round.to_string());
            continue;
        };
        let mut worker = start(&mut work(&dir, shard));
        wait_for("handlers", || (listens(pid(&worker)) || !alive(pid(&worker))).then_some(()));
        // Mostly before a checkpoint is due, so that what is written is written for the signal; later if it helps.
        sleep_until_drawn(&mut draw, 150 + 10 * attempt);
        let had = batches(&dir, shard);
        send(pid(&worker), signal);
        match worker.wait().unwrap().code() {
            Some(STOPPED) => stops += usize::from(batches(&dir, shard) > had),
            Some(0) => assert_eq!(batches(&dir, shard), batches_of(shard)),
            other => panic!("{signal}: {other:?}"),
        }
    }
    assert!(stops >= STOPS, "only {stops} workers stopped with a checkpoint");
    place.finish(&dir);
    assert_shards(&dir, 0..SHARDS);
}

/// Stops runs by `signal` until two have stopped.
fn stop_runs(signal: Signal, name: &str) {
    const STOPS: usize = 2;
    let place = Place::new();
    let mut draw = draws(name);
    let (mut stops, mut round) = (0, 0);
    let mut dir = place.path("0");
    for _ in 0..ATTEMPTS {
        if stops >= STOPS {
            break;
        }
        let run = run_quietly(&place.path("job.toml"), &dir, 2)
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        let boss = pid(&run);
        wait_for("a first worker", || (!workers_of(boss).is_empty() || !alive(boss)).then_some(()));
        sleep_until_drawn(&mut draw, 300);
        let workers = workers_of(boss);
        send(boss, signal);
        let output = run.wait_with_output().unwrap();
        // Nobody is left behind.
        assert!(!workers.iter().any(|&p| alive(p)), "{signal}: a worker outlives its run");
        match output.status.code() {
            Some(STOPPED) => {
                let said = String::from_utf8(output.stdout).unwrap();
                assert!(said.contains("stopped; run the same command again to go on in "), "{said}");
                assert!(!dir.join("summary.json").exists());
                stops += 1;
            }
            Some(0) => {
                round += 1;
                dir = place.path(&round.to_string());
            }
            other => panic!("{signal}: {other:?}: {}", String::from_utf8_lossy(&output.stderr)),
        }
    }
    assert!(stops >= STOPS, "only {stops} runs stopped");
    place.finish(&dir);
}

#[test]
fn sigterm_stops_a_worker_after_a_checkpoint() {
    stop_workers(Signal::SIGTERM, "work SIGTERM");
}

#[test]
fn sigint_stops_a_worker_after_a_checkpoint() {
    stop_workers(Signal::SIGINT, "work SIGINT");
}

#[test]
fn sigterm_stops_a_run_after_checkpoints() {
    stop_runs(Signal::SIGTERM, "run SIGTERM");
}

#[test]
fn sigint_stops_a_run_after_checkpoints() {
    stop_runs(Signal::SIGINT, "run SIGINT");
}
