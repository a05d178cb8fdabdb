//! Golden numbers: the digest of the results of one small job, whole, as a real process computes it.
//!
//! When this test fails after a change that was meant to change numbers, raise `NUMERICS` in `src/farm/plan/mod.rs`,
//! so that checkpoints of before are foreign to the new program, and then store the new digests here. When it fails
//! otherwise, the change is not what it was meant to be.

use lampyris::farm::plan::NUMERICS;
use std::fs;
use std::path::Path;
use std::process::Command;

/// NUMERICS, digest of the plan, digest of the results of `tests/exactness/job.toml`.
const GOLDEN: (u32, &str, &str) = (
    6,
    "8aa360b10609986967bf314a189ca262b39c0f033e29e2c228c20efd7dc48237",
    "7345188fd7ee3aa55999c5e57e33a05d9d06b3c4e60c81ea09e91cf4883f324b",
);

#[test]
fn the_numbers_of_the_small_job_are_the_stored_ones() {
    let (numerics, plan, results) = GOLDEN;
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    fs::copy(root.join("scenes/blender_room.glb"), at("room.glb")).unwrap();
    fs::copy(root.join("tests/exactness/job.toml"), at("job.toml")).unwrap();
    let mut run = Command::new(env!("CARGO_BIN_EXE_lampyris"));
    run.args(["run", "-q", "job.toml", "-o", "out"]).current_dir(folder.path()).env_remove("LAMPYRIS_FAULT");
    assert!(run.status().unwrap().success());
    let summary: serde_json::Value = serde_json::from_slice(&fs::read(at("out/summary.json")).unwrap()).unwrap();
    let now = (NUMERICS, summary["plan_digest"].as_str().unwrap(), summary["results_digest"].as_str().unwrap());
    assert!(
        now.1 == plan || now.0 != numerics,
        "the small job, its scene or the content of a plan has changed: store the new digests {now:?}"
    );
    assert!(now.2 == results || now.0 != numerics, "other numbers under the same NUMERICS: raise it; now {now:?}");
    assert_eq!(now, GOLDEN, "NUMERICS has changed: store the new digests");
}
