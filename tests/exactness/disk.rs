//! Disks that are full, folders that nobody may write into or that are gone, clocks that are wrong.

use crate::place::{JOB, Place, Tree, assert_shards, batches, checkpoint, computed, plan_in};
use crate::process::{expect, lampyris, start, wait_for, work};
use lampyris::farm::checkpoint::{Reader, Snapshot, write};
use std::fs;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// `command` in a shell that lets no file grow beyond `blocks` of 512 bytes, as if the disk were full there.
fn limited(blocks: u64, command: &Command) -> Output {
    let script = format!("ulimit -f {blocks}; trap '' XFSZ; exec \"$@\"");
    let mut limited = Command::new("sh");
    limited.args(["-c", &script, "sh"]).arg(command.get_program()).args(command.get_args());
    limited.env_remove("SLURM_ARRAY_TASK_ID").env_remove("LAMPYRIS_FAULT").stdin(Stdio::null()).output().unwrap()
}

fn refused(output: &Output, code: i32, words: &[&str]) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{}: {said}", output.status);
    assert!(words.iter().all(|word| said.contains(word)), "{words:?}\n{said}");
}

#[test]
fn a_full_disk_ends_a_worker_and_the_old_checkpoint_stays() {
    let place = Place::new();
    let short = place.edited_job("short.toml", "batches = 28", "batches = 2");
    let dir = place.plan(&short, "dir");
    expect(0, &mut work(&dir, 0));
    expect(0, lampyris(&["extend", "--batches", "28"]).arg(&dir));
    let mut before = Tree::of(&dir);
    let size = fs::metadata(dir.join(checkpoint(0))).unwrap().len();
    let full = limited(size / 512 / 2, &work(&dir, 0));
    refused(&full, 1, &["shard-000000.ckpt", "File too large"]);
    // That it was tried is remembered, there was room for that; nothing else is new.
    let attempts = Path::new("attempts/shard-000000.jsonl");
    let tried = fs::read(dir.join(attempts)).unwrap();
    let known = before.0.insert(attempts.to_owned(), tried.clone()).unwrap();
    assert!(tried.starts_with(&known) && tried.len() > known.len());
    before.assert_unchanged(&dir, "a full disk");
    // Results, too, are whole or not there; the plan as well.
    expect(0, &mut work(&dir, 0));
    let full = limited(1, lampyris(&["merge"]).arg(&dir));
    refused(&full, 1, &["File too large"]);
    assert!(!dir.join("summary.json").exists() && !dir.join("view.exr").exists());
    let full = limited(1, lampyris(&["compact"]).arg(&dir));
    refused(&full, 1, &["compacted.ckpt", "File too large"]);
    let full = limited(1, lampyris(&["extend", "--batches", "40"]).arg(&dir));
    refused(&full, 1, &["plan.toml", "File too large"]);
    assert_eq!(plan_in(&dir).job.run.batches, 28);
    assert_shards(&dir, [0]);
    place.finish(&dir);
}

/// `command` as somebody who may not write where others may only read: nobody, where this is root.
fn as_nobody(place: &Place, command: &Command) -> Output {
    let program = place.path("lampyris");
    if !program.exists() {
        fs::copy(command.get_program(), &program).unwrap();
        fs::set_permissions(place.path(""), PermissionsExt::from_mode(0o755)).unwrap();
    }
    let mut own = Command::new(program);
    own.args(command.get_args()).stdin(Stdio::null());
    own.env_remove("SLURM_ARRAY_TASK_ID").env_remove("LAMPYRIS_FAULT");
    if fs::metadata(place.path("")).unwrap().uid() == 0 {
        own.uid(65534).gid(65534);
    }
    own.output().unwrap()
}

fn allow_writing(dir: &Path, allowed: bool) {
    let mode = if allowed { 0o755 } else { 0o555 };
    for dir in [dir.join("shards"), dir.join("attempts"), dir.to_owned()] {
        fs::set_permissions(dir, PermissionsExt::from_mode(mode)).unwrap();
    }
}

#[test]
fn a_folder_that_is_read_only_is_read_and_named() {
    let place = Place::new();
    let dir = place.path("dir");
    computed().restore(&dir);
    fs::remove_file(dir.join(checkpoint(3))).unwrap();
    fs::remove_file(dir.join("attempts/shard-000003.jsonl")).unwrap();
    allow_writing(&dir, false);
    let before = Tree::of(&dir);
    refused(&as_nobody(&place, &work(&dir, 3)), 1, &["attempts/shard-000003.jsonl", "Permission denied"]);
    refused(&as_nobody(&place, lampyris(&["merge"]).arg(&dir)), 1, &["dir", "Permission denied"]);
    refused(&as_nobody(&place, lampyris(&["extend", "--batches", "40"]).arg(&dir)), 1, &["Permission denied"]);
    assert_eq!(as_nobody(&place, lampyris(&["status"]).arg(&dir)).status.code(), Some(0));
    let audited = as_nobody(&place, lampyris(&["audit"]).arg(&dir));
    assert_eq!(audited.status.code(), Some(0), "{audited:?}");
    before.assert_unchanged(&dir, "read only");
    allow_writing(&dir, true);
    place.finish(&dir);
}

#[test]
fn a_worker_whose_folder_is_removed_ends_and_does_not_make_it_again() {
    let place = Place::new();
    let long = JOB.replacen("batches = 28", "batches = 4000", 1).replacen("_per_shard = 5", "_per_shard = 4000", 1);
    fs::write(place.path("long.toml"), long).unwrap();
    let dir = place.plan(&place.path("long.toml"), "dir");
    let mut worker = start(&mut work(&dir, 0));
    wait_for("a checkpoint", || (batches(&dir, 0) > 0).then_some(()));
    // Renamed first: a worker may be writing just now.
    fs::rename(&dir, place.path("gone")).unwrap();
    assert_eq!(worker.wait().unwrap().code(), Some(1));
    assert!(!dir.exists());
}

#[test]
fn a_checkpoint_from_the_future_is_as_good_as_any() {
    let place = Place::new();
    let dir = place.path("dir");
    computed().restore(&dir);
    let plan = plan_in(&dir);
    let path = dir.join(checkpoint(1));
    let reader = Reader::open(&path, &plan, 1).unwrap().unwrap();
    let (tally, runs) = (reader.tally().unwrap(), reader.header().runs.clone());
    let fixed: Vec<Vec<f64>> = (0..plan.sets().len()).map(|set| reader.fixed_direct(set).unwrap()).collect();
    let (tally, fixed_direct, runs) = (&tally, &fixed[..], &runs[..]);
    let future = Snapshot { plan: &plan, shard: 1, tally, fixed_direct, runs, written: u64::MAX, relative_error: 0.1 };
    assert!(write(&path, &future).unwrap());
    let said = expect(0, lampyris(&["status", "--json"]).arg(&dir));
    let status: serde_json::Value = serde_json::from_str(&said).unwrap();
    assert_eq!((status["shards"][1]["age_seconds"].as_u64(), status["batches"].as_u64()), (Some(0), Some(28)));
    place.finish(&dir);
}
