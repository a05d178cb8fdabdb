//! kill -9 inside the replacement of a checkpoint, at every step of it, by the fault hook.

use crate::bits::Bits;
use crate::place::{Place, SHARDS, Tree, assert_shards, batches, batches_of, straight};
use crate::process::{expect, run_quietly, work};
use lampyris::farm::durable::Step;
use nix::sys::signal::Signal;
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;

/// Works on `shard` until the fault kills the worker at `step` of its first replacement.
#[track_caller]
pub fn die_at(dir: &Path, shard: u64, step: Step) {
    let fault = format!("{}:1", step.name());
    let output = work(dir, shard).env("LAMPYRIS_FAULT", &fault).output().unwrap();
    assert_eq!(output.status.signal(), Some(Signal::SIGKILL as i32), "{fault}: {}", output.status);
}

/// True when the new file stands in its place after a death at `step`.
fn replaced(step: Step) -> bool {
    matches!(step, Step::AfterRename | Step::AfterFolderSync)
}

/// Files being written that a dead worker has left.
fn leftovers(dir: &Path) -> usize {
    let names = fs::read_dir(dir.join("shards")).unwrap().map(|e| e.unwrap().file_name());
    names.filter(|n| n.to_string_lossy().ends_with(".tmp")).count()
}

#[test]
fn a_death_at_any_step_of_the_first_checkpoint_is_resumed() {
    let place = Place::new();
    let dir = place.planned("dir");
    for (shard, step) in (0..SHARDS).zip(Step::ALL) {
        die_at(&dir, shard, step);
        assert_eq!(batches(&dir, shard) > 0, replaced(step), "{step:?}");
        // The file beside is there until the rename, and nobody takes it for a checkpoint.
        assert_eq!(leftovers(&dir), (shard as usize + 1).min(4), "{step:?}");
    }
    place.finish(&dir);
    assert_shards(&dir, 0..SHARDS);
    assert_eq!(leftovers(&dir), 0);
}

#[test]
fn a_death_at_any_step_of_replacing_a_checkpoint_is_resumed() {
    const OLD: u64 = 2;
    let place = Place::new();
    // A plan of two batches, done, then extended: the checkpoint of shard 0 has two of its five batches.
    let short = place.edited_job("short.toml", "batches = 28", &format!("batches = {OLD}"));
    expect(0, &mut work(&place.plan(&short, "dir"), 0));
    let begun = Tree::of(&place.planned("dir"));
    for step in Step::ALL {
        let dir = place.path(step.name());
        begun.restore(&dir);
        assert_eq!(batches(&dir, 0), OLD);
        die_at(&dir, 0, step);
        assert_eq!(batches(&dir, 0) > OLD, replaced(step), "{step:?}");
        assert_eq!(leftovers(&dir), usize::from(!replaced(step)), "{step:?}");
        expect(0, &mut work(&dir, 0));
        assert_shards(&dir, [0]);
        assert_eq!(leftovers(&dir), 0, "{step:?}");
    }
}

#[test]
fn a_run_whose_workers_all_die_after_every_checkpoint_still_ends() {
    let place = Place::new();
    let dir = place.path("dir");
    let mut run = run_quietly(&place.path("job.toml"), &dir, 2);
    expect(0, run.env("LAMPYRIS_FAULT", "after-rename:1"));
    Bits::of(&dir).assert_same(&straight().bits);
}

#[test]
fn a_shard_that_fails_three_times_without_progress_stops_the_run() {
    let place = Place::new();
    let dir = place.path("dir");
    let mut run = run_quietly(&place.path("job.toml"), &dir, 1);
    let said = expect(1, run.env("LAMPYRIS_FAULT", "after-create:1"));
    assert!(said.contains("shard 0: was ended by signal 9 three times without progress"), "{said}");
    assert!((0..SHARDS).all(|k| batches(&dir, k) == 0));
    // What had been done is kept, and nothing but the fault stood in the way.
    expect(0, &mut work(&dir, 1));
    expect(1, run.env("LAMPYRIS_FAULT", "before-rename:1"));
    assert_eq!(batches(&dir, 1), batches_of(1));
    place.finish(&dir);
}
