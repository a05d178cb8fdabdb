//! Running again: on what is done, on a changed job, with more batches, with one receiver set more.

use crate::bits::{Bits, summary};
use crate::place::{JOB, Place, SHARDS, Tree, assert_shards, batches, straight};
use crate::process::{expect, run_quietly};
use std::fs;
use std::path::Path;

/// A place whose folder `dir` holds all checkpoints and results of the straight run.
fn finished() -> (Place, std::path::PathBuf) {
    let place = Place::new();
    let dir = place.path("dir");
    straight().tree.restore(&dir);
    (place, dir)
}

fn refused(job: &Path, dir: &Path, fragment: &str) {
    let before = Tree::of(dir);
    let said = expect(2, &mut run_quietly(job, dir, 2));
    assert!(said.contains("plan.toml: refused: the job is no longer the one planned here"), "{said}");
    assert!(said.contains(fragment), "expected {fragment}\nsaid {said}");
    before.assert_unchanged(dir, fragment);
}

#[test]
fn a_finished_run_says_that_all_is_done() {
    let (place, dir) = finished();
    let before = Tree::of(&dir.join("shards"));
    for _ in 0..2 {
        let said = expect(0, &mut run_quietly(&place.path("job.toml"), &dir, 2));
        assert!(said.contains("all 28 batches were done before"), "{said}");
        before.assert_unchanged(&dir.join("shards"), "done before");
        Bits::of(&dir).assert_same(&straight().bits);
    }
}

#[test]
fn a_changed_job_or_scene_is_refused_naming_what_differs() {
    let (place, dir) = finished();
    let edits = [
        ("seed = 20", "seed = 21", "run.seed: 20 in the plan, 21 now"),
        ("width = 24", "width = 25", "camera[0].width: 24 in the plan, 25 now"),
        ("histories_per_batch = 8", "histories_per_batch = 9", "run.histories_per_batch: 8 in the plan, 9 now"),
        ("sampling = \"random\"", "sampling = \"rqmc\"", "run.sampling: \"random\" in the plan, \"rqmc\" now"),
        ("batches_per_shard = 5", "batches_per_shard = 6", "run.batches_per_shard: 5 in the plan, 6 now"),
        ("keep_batches = false", "keep_batches = true", "grid[1].keep_batches: false in the plan, true now"),
        ("batches = 28", "batches = 27", "run.batches: 28 in the plan, 27 now (more batches extend the work"),
    ];
    for (from, to, fragment) in edits {
        refused(&place.edited_job("job.toml", from, to), &dir, fragment);
    }
    fs::write(place.path("job.toml"), JOB).unwrap();
    let mut scene = fs::read(place.path("room.glb")).unwrap();
    let lamp = b"\"intensity\":63.66";
    let at = scene.windows(lamp.len()).position(|w| w == lamp).expect("the floor lamp has 63.66 cd");
    scene[at + lamp.len() - 1] = b'7';
    fs::write(place.path("room.glb"), scene).unwrap();
    refused(&place.path("job.toml"), &dir, "input \"room.glb\": its content has changed");
}

#[test]
fn more_batches_extend_a_run_to_the_bits_of_one_planned_so() {
    let place = Place::new();
    let dir = place.path("dir");
    for batches in [3, 13] {
        // 13 batches end in the middle of shard 2.
        let short = place.edited_job("short.toml", "batches = 28", &format!("batches = {batches}"));
        expect(0, &mut run_quietly(&short, &dir, 2));
        assert_eq!(summary(&dir)["batches"], batches);
        assert_ne!(Bits::of(&dir).digest, straight().bits.digest);
    }
    assert_eq!((batches(&dir, 1), batches(&dir, 2), batches(&dir, 3)), (5, 3, 0));
    place.finish(&dir);
    assert_shards(&dir, 0..SHARDS);
}

#[test]
fn confidence_and_checkpoint_seconds_may_change() {
    let (place, dir) = finished();
    let before = Tree::of(&dir.join("shards"));
    let job = place.edited_job("job.toml", "checkpoint_seconds = 0.1", "checkpoint_seconds = 5\nconfidence = 0.99");
    let said = expect(0, &mut run_quietly(&job, &dir, 1));
    assert!(said.contains("all 28 batches were done before"), "{said}");
    assert_eq!(summary(&dir)["confidence"], 0.99);
    // Wider intervals around the same means.
    let (wide, plain) = (Bits::of(&dir), &straight().bits);
    for channel in ["Y", "standardError", "peak"] {
        assert_eq!(
            wide.channels[&format!("view.luminance.{channel}")],
            plain.channels[&format!("view.luminance.{channel}")]
        );
    }
    assert_ne!(wide.channels["view.luminance.ciUpper"], plain.channels["view.luminance.ciUpper"]);
    // And back.
    fs::write(place.path("job.toml"), JOB).unwrap();
    place.finish(&dir);
    before.assert_unchanged(&dir.join("shards"), "done before");
}

#[test]
fn another_receiver_set_changes_no_number_of_the_others() {
    const MORE: &str = r#"
[[camera]]
name = "close"
node = "camera_detail"
width = 8
height = 6
[[grid]]
name = "shelf"
origin = [1.0, 1.0, -1.0]
u = [1.0, 0.0, 0.0]
v = [0.0, 1.0, 0.0]
normal = [0.0, 0.0, 1.0]
columns = 3
rows = 2
[[camera]]
name = "view""#;
    let place = Place::new();
    let dir = place.path("dir");
    let job = place.edited_job("job.toml", "\n[[camera]]\nname = \"view\"", MORE);
    expect(0, &mut run_quietly(&job, &dir, 2));
    let bits = Bits::of(&dir);
    bits.assert_same_receivers(&straight().bits);
    assert_ne!(bits.digest, straight().bits.digest, "the digest covers the new receivers");
    assert!(dir.join("close.exr").exists() && dir.join("shelf.csv").exists());
}
