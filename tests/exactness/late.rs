//! Network file systems that show late what another machine has written, or less of it than there is.

use crate::place::{Place, checkpoint, computed};
use crate::process::{expect, lampyris, work};
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

/// Time in which a merge has looked into the folder at least once.
const A_WHILE: Duration = Duration::from_millis(1500);

/// Takes the checkpoint of shard 1 in `dir` away and cuts that of shard 2; the whole ones.
fn hide(dir: &Path) -> [(std::path::PathBuf, Vec<u8>); 2] {
    let whole = [1, 2].map(|k| (dir.join(checkpoint(k)), fs::read(dir.join(checkpoint(k))).unwrap()));
    fs::remove_file(&whole[0].0).unwrap();
    fs::write(&whole[1].0, &whole[1].1[..whole[1].1.len() / 2]).unwrap();
    whole
}

#[test]
fn a_merge_waits_for_checkpoints_that_appear_late_or_read_short() {
    let place = Place::new();
    let dir = place.path("dir");
    computed().restore(&dir);
    let whole = hide(&dir);
    let mut merge = lampyris(&["merge", "--wait", "60"]);
    let mut merge = merge.arg(&dir).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    for (path, bytes) in whole {
        std::thread::sleep(A_WHILE);
        assert!(merge.try_wait().unwrap().is_none(), "it did not wait");
        fs::write(path, bytes).unwrap();
    }
    assert_eq!(merge.wait().unwrap().code(), Some(0));
    place.finish(&dir);
}

#[test]
fn what_never_comes_is_told_when_the_time_is_over() {
    let place = Place::new();
    let dir = place.path("dir");
    computed().restore(&dir);
    let [_, (short, bytes)] = hide(&dir);
    let said = expect(2, lampyris(&["merge", "--wait", "1"]).arg(&dir));
    assert!(said.contains("shard-000002.ckpt") && said.contains("truncated"), "{said}");
    fs::write(short, bytes).unwrap();
    expect(3, lampyris(&["merge", "--wait", "1"]).arg(&dir));
}

#[test]
fn a_task_of_slurm_waits_for_a_plan_that_its_node_does_not_see_yet() {
    let place = Place::new();
    let dir = place.planned("dir");
    let (plan, text) = (dir.join("plan.toml"), fs::read(dir.join("plan.toml")).unwrap());
    fs::remove_file(&plan).unwrap();
    let mut task = work(&dir, 0);
    task.env("SLURM_ARRAY_JOB_ID", "12").env("SLURM_ARRAY_TASK_ID", "0").env("PATH", "");
    let mut task = task.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    std::thread::sleep(A_WHILE);
    assert!(task.try_wait().unwrap().is_none(), "it did not wait");
    fs::write(&plan, text).unwrap();
    assert_eq!(task.wait().unwrap().code(), Some(0));
    assert!(dir.join(checkpoint(0)).exists());
    // Started by hand, a worker says at once what is missing.
    fs::remove_file(&plan).unwrap();
    expect(2, &mut work(&dir, 1));
}
