//! kill -9 at drawn instants: workers started by hand, workers of a run, the coordinator itself.

use crate::place::{Place, SHARDS, assert_shards, batches, batches_of};
use crate::process::{
    alive, draws, expect, pid, run_quietly, send, sleep_until_drawn, start, stat, wait_for, work, workers_of,
};
use lampyris::random::Generator;
use nix::sys::signal::Signal;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::Child;

const SIGKILL: i32 = Signal::SIGKILL as i32;
/// Nobody needs more attempts than this for the hits asked for: an instant near zero always hits.
const ATTEMPTS: usize = 400;

#[test]
fn workers_killed_at_drawn_instants_resume_to_the_same_bits() {
    const HITS: usize = 20;
    let place = Place::new();
    let mut draw = draws("workers");
    let (mut hits, mut after_progress, mut round) = (0, 0, 0);
    let mut dir = place.planned("0");
    for _ in 0..ATTEMPTS {
        if hits >= HITS {
            break;
        }
        let Some(shard) = (0..SHARDS).find(|&k| batches(&dir, k) < batches_of(k)) else {
            place.finish(&dir);
            round += 1;
            dir = place.planned(&round.to_string());
            continue;
        };
        let had = batches(&dir, shard);
        let mut worker = start(&mut work(&dir, shard));
        sleep_until_drawn(&mut draw, 400);
        worker.kill().unwrap();
        let status = worker.wait().unwrap();
        if status.signal() == Some(SIGKILL) {
            hits += 1;
            after_progress += usize::from(had > 0);
        } else {
            assert_eq!(status.code(), Some(0), "shard {shard}");
        }
        // Whatever stands there is whole and no shorter than before.
        assert!(batches(&dir, shard) >= had);
    }
    assert!(hits >= HITS, "only {hits} kills hit a live worker");
    place.finish(&dir);
    assert_shards(&dir, 0..SHARDS);
    println!("{hits} kills hit, {after_progress} of them a worker that had resumed; folder {round}");
}

/// Kills a worker of `coordinator` with certainty: the coordinator is held meanwhile, so that it can neither reap the
/// worker nor start another, and the zombie's status shows of what it died. False when there is no worker to kill.
fn kill_a_worker(coordinator: &Child, draw: &mut Generator) -> bool {
    let boss = pid(coordinator);
    send(boss, Signal::SIGSTOP);
    let state = wait_for("the coordinator is held", || stat(boss).map(|s| s.state).filter(|s| "TZ".contains(*s)));
    let workers = if state == 'T' { workers_of(boss) } else { Vec::new() };
    let hit = !workers.is_empty() && {
        let victim = workers[draw.below(workers.len() as u32) as usize];
        send(victim, Signal::SIGKILL);
        let end = || stat(victim).filter(|s| s.state == 'Z');
        // A worker that came to its own end just before is not a hit.
        wait_for("the worker is dead", end).wait_status == SIGKILL
    };
    send(boss, Signal::SIGCONT);
    hit
}

#[test]
fn killed_workers_of_a_run_are_restarted_to_the_same_bits() {
    const HITS: usize = 16;
    let place = Place::new();
    let job = place.path("job.toml");
    let mut draw = draws("run");
    let (mut hits, mut round, mut gave_up) = (0, 0, 0);
    let mut dir = place.path("0");
    let mut run = start(&mut run_quietly(&job, &dir, 2));
    for _ in 0..ATTEMPTS {
        if hits >= HITS {
            break;
        }
        sleep_until_drawn(&mut draw, 250);
        let Some(status) = run.try_wait().unwrap() else {
            hits += usize::from(kill_a_worker(&run, &mut draw));
            continue;
        };
        match status.code() {
            Some(0) => {
                place.finish(&dir);
                round += 1;
                dir = place.path(&round.to_string());
            }
            // Three deaths of one shard without a checkpoint in between: the run stops, and can be started again.
            Some(1) => gave_up += 1,
            other => panic!("{other:?}: {status}"),
        }
        run = start(&mut run_quietly(&job, &dir, 2));
    }
    assert!(hits >= HITS, "only {hits} kills hit a live worker");
    let code = run.wait().unwrap().code();
    assert!(matches!(code, Some(0 | 1)), "{code:?}");
    place.finish(&dir);
    assert_shards(&dir, 0..SHARDS);
    println!("{hits} kills hit, {gave_up} runs gave up; folder {round}");
}

/// Starts a run, kills the coordinator at a drawn instant after its first worker has started; its workers then.
fn kill_the_coordinator(place: &Place, dir: &Path, draw: &mut Generator) -> Option<Vec<i32>> {
    let mut run = start(&mut run_quietly(&place.path("job.toml"), dir, 2));
    let boss = pid(&run);
    wait_for("a first worker", || (!workers_of(boss).is_empty() || !alive(boss)).then_some(()));
    sleep_until_drawn(draw, 300);
    let workers = workers_of(boss);
    run.kill().unwrap();
    (run.wait().unwrap().signal() == Some(SIGKILL)).then_some(workers)
}

#[test]
fn a_killed_coordinator_takes_its_workers_along_and_the_next_run_goes_on() {
    const HITS: usize = 4;
    let place = Place::new();
    let mut draw = draws("coordinator");
    let (mut hits, mut round) = (0, 0);
    let mut dir = place.path("0");
    for _ in 0..ATTEMPTS {
        if hits >= HITS {
            break;
        }
        match kill_the_coordinator(&place, &dir, &mut draw) {
            Some(orphans) => {
                hits += 1;
                // Every second time the next run does not wait for the orphans to end: they share shards for a moment.
                if hits % 2 == 0 {
                    wait_for("the orphans end", || (!orphans.iter().any(|&p| alive(p))).then_some(()));
                }
            }
            None => {
                round += 1;
                dir = place.path(&round.to_string());
            }
        }
    }
    assert!(hits >= HITS, "only {hits} kills hit a live coordinator");
    let said = expect(0, &mut run_quietly(&place.path("job.toml"), &dir, 2));
    assert!(said.contains("results in "), "{said}");
    place.finish(&dir);
    assert_shards(&dir, 0..SHARDS);
}
