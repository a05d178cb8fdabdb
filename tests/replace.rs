//! `[[replace]]` in a real process: the scene of Figure 2 with its head as a series.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

/// The job of Figure 2, small, with `replace` in the place of what it says there.
fn folder(replace: &str) -> TempDir {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    for name in ["figure2.glb", "head.harmonic"] {
        fs::copy(root.join("scenes").join(name), folder.path().join(name)).unwrap();
    }
    let job = "scene = \"figure2.glb\"\n[run]\nhistories_per_batch = 4\nbatches = 16\nbatches_per_shard = 4\n[[camera]]\n\
               name = \"view\"\nnode = \"camera\"\nwidth = 16\nheight = 16\npixel_samples = 1\n";
    fs::write(folder.path().join("job.toml"), format!("{job}{replace}")).unwrap();
    folder
}

fn lampyris(folder: &TempDir, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lampyris")).args(args).current_dir(folder.path()).output().unwrap()
}

fn refusal(replace: &str) -> String {
    let out = lampyris(&folder(replace), &["plan", "job.toml", "-o", "out"]);
    assert_eq!(out.status.code(), Some(2), "{out:?}");
    String::from_utf8(out.stderr).unwrap()
}

const HEAD: &str = "[[replace]]\nnode = \"Head\"\nharmonic = \"head.harmonic\"\n";

#[test]
fn workers_do_not_change_the_bits() {
    let digest = |workers: &str| {
        let folder = folder(HEAD);
        let out = lampyris(&folder, &["run", "-q", "job.toml", "-o", "out", "-w", workers]);
        assert!(out.status.success(), "{out:?}");
        let summary = fs::read(folder.path().join("out/summary.json")).unwrap();
        let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
        summary["results_digest"].as_str().unwrap().to_owned()
    };
    assert_eq!(digest("1"), digest("2"));
}

#[test]
fn a_planned_folder_needs_no_other_file() {
    let folder = folder(HEAD);
    assert!(lampyris(&folder, &["plan", "job.toml", "-o", "out"]).status.success());
    for name in ["head.harmonic", "figure2.glb", "job.toml"] {
        fs::remove_file(folder.path().join(name)).unwrap();
    }
    let out = lampyris(&folder, &["work", "out", "--shard", "0"]);
    assert!(out.status.success(), "{out:?}");
}

#[test]
fn the_plan_fixes_a_degree_left_to_the_pictures() {
    let planned = |error: &str| -> i64 {
        let folder = folder(&format!("{HEAD}degree = \"auto\"\n{error}"));
        let out = lampyris(&folder, &["plan", "job.toml", "-o", "out"]);
        assert!(out.status.success(), "{out:?}");
        let plan: toml::Table = fs::read_to_string(folder.path().join("out/plan.toml")).unwrap().parse().unwrap();
        plan["job"]["replace"][0]["degree"].as_integer().unwrap()
    };
    // 16 pixels a side show little of a head; a hundredth of the error needs more of it.
    let (coarse, fine) = (planned(""), planned("error_pixels = 0.0025\n"));
    assert!(coarse < fine && fine <= 32, "{coarse} {fine}");
}

#[test]
fn what_cannot_be_replaced_is_refused_by_name() {
    for (replace, expected) in [
        ("[[replace]]\nnode = \"Hat\"\nharmonic = \"head.harmonic\"\n", "Head"),
        ("[[replace]]\nnode = \"Head\"\nharmonic = \"hat.harmonic\"\n", "replace[0].harmonic"),
        ("[[replace]]\nnode = \"Head\"\nharmonic = \"figure2.glb\"\n", "header"),
        (&format!("{HEAD}degree = 129\n"), "replace[0].degree"),
        (&format!("{HEAD}error_pixels = 1.0\n"), "replace[0].error_pixels"),
        (&format!("{HEAD}{HEAD}"), "each node once"),
    ] {
        let message = refusal(replace);
        assert!(message.contains(expected), "{replace}: {message}");
    }
}

#[test]
fn another_degree_is_another_plan() {
    let folder = folder(HEAD);
    assert!(lampyris(&folder, &["plan", "job.toml", "-o", "out"]).status.success());
    let job = fs::read_to_string(folder.path().join("job.toml")).unwrap();
    fs::write(folder.path().join("job.toml"), job + "degree = 8\n").unwrap();
    let out = lampyris(&folder, &["plan", "job.toml", "-o", "out"]);
    let said = String::from_utf8(out.stderr).unwrap();
    assert_eq!(out.status.code(), Some(2), "{said}");
    assert!(said.contains("replace[0].degree: (none) in the plan, 8 now"), "{said}");
}
