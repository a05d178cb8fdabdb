//! `lampyris extend`: more batches for a folder, whatever state it is in.

use crate::bits::{Bits, summary};
use crate::place::{JOB, Place, SHARDS, Tree, assert_shards, batches, plan_in, straight};
use crate::process::{expect, lampyris, run_quietly};
use std::fs;
use std::path::Path;

fn extend(code: i32, dir: &Path, batches: u64) -> String {
    expect(code, lampyris(&["extend"]).arg(dir).args(["--batches", &batches.to_string()]))
}

#[test]
fn an_extended_folder_gives_the_bits_of_a_job_planned_so() {
    let place = Place::new();
    let short = place.edited_job("short.toml", "batches = 28", "batches = 13");
    let dir = place.path("dir");
    expect(0, &mut run_quietly(&short, &dir, 2));
    assert_eq!((batches(&dir, 2), summary(&dir)["batches"].as_u64()), (3, Some(13)));
    let before = Tree::of(&dir.join("shards"));
    let said = extend(0, &dir, 28);
    assert!(said.contains("28 batches, 6 shards in "), "{said}");
    before.assert_unchanged(&dir.join("shards"), "checkpoints stay");
    // What is there is still what it was, and merges as unfinished.
    let said = expect(3, lampyris(&["merge"]).arg(&dir));
    assert!(said.contains("incomplete: batches 13-27 are missing"), "{said}");
    // The folder goes on by itself; the job file of 13 batches would be a step back.
    let said = expect(2, &mut run_quietly(&short, &dir, 2));
    assert!(said.contains("run.batches: 28 in the plan, 13 now"), "{said}");
    expect(0, lampyris(&["run", "-q", "-w", "2"]).arg(&dir));
    Bits::of(&dir).assert_same(&straight().bits);
    assert_shards(&dir, 0..SHARDS);
    // As many again changes nothing, fewer are refused.
    let plan = fs::read(dir.join("plan.toml")).unwrap();
    extend(0, &dir, 28);
    let said = extend(2, &dir, 27);
    assert!(said.contains("--batches = 27: at least 28, the batches planned"), "{said}");
    let said = extend(2, &dir, 1 << 33);
    assert!(said.contains("run.batches"), "{said}");
    assert_eq!(fs::read(dir.join("plan.toml")).unwrap(), plan);
}

#[test]
fn a_job_stopped_by_its_goal_stays_stopped() {
    let place = Place::new();
    let goal = "[stop]\nrelative_half_width = 0.9\nreceivers = [\"table\"]\nmax_batches = 40\n\n[[camera]]";
    let text = JOB.replacen("batches = 28\n", "", 1).replacen("[[camera]]", goal, 1);
    fs::write(place.path("goal.toml"), &text).unwrap();
    let dir = place.path("dir");
    expect(0, &mut run_quietly(&place.path("goal.toml"), &dir, 2));
    assert_eq!(summary(&dir)["stopped_by"]["what"], "goal");
    let (bits, shards) = (Bits::of(&dir), Tree::of(&dir.join("shards")));
    extend(0, &dir, 60);
    assert_eq!(plan_in(&dir).job.stop.unwrap().max_batches, 60);
    let said = expect(0, lampyris(&["run", "-q"]).arg(&dir));
    assert!(said.contains("nothing was left to do"), "{said}");
    Bits::of(&dir).assert_same(&bits);
    shards.assert_unchanged(&dir.join("shards"), "stopped");
}
