//! `lampyris compact`: the first shards in one file, while workers run and after.

use crate::bits::Bits;
use crate::place::{Place, SHARDS, Tree, batches_of, checkpoint, computed, straight};
use crate::process::{expect, lampyris, run_quietly, start, work};
use std::path::Path;

fn compact(dir: &Path) -> String {
    expect(0, lampyris(&["compact"]).arg(dir))
}

#[test]
fn compacted_shards_are_done_for_everybody() {
    let place = Place::new();
    let dir = place.planned("dir");
    assert!(compact(&dir).contains("nothing to compact"));
    for shard in [0, 1, 3] {
        expect(0, &mut work(&dir, shard));
    }
    let said = compact(&dir);
    assert!(said.contains("shards 0 .. 1 are in one file, 2 files removed"), "{said}");
    assert!(!dir.join(checkpoint(0)).exists() && dir.join(checkpoint(3)).exists());
    let status = expect(0, lampyris(&["status"]).arg(&dir));
    let batches: u64 = [0, 1, 3].map(batches_of).iter().sum();
    assert!(status.contains(&format!("{batches} of 28 batches, 3 of 6 shards done")), "{status}");
    let said = expect(0, &mut work(&dir, 1));
    assert!(said.contains("shard 1: done") && !dir.join(checkpoint(1)).exists(), "{said}");
    // A folder of somebody else with copies of what was compacted here, and with the rest.
    let other = place.path("other");
    computed().restore(&other);
    for order in [[&dir, &other], [&other, &dir]] {
        let out = place.path("out");
        expect(0, lampyris(&["merge"]).args(order).arg("-o").arg(&out));
        Bits::of(&out).assert_same(&straight().bits);
    }
    place.finish(&dir);
    let said = compact(&dir);
    // The last shard is short, so that it can be extended.
    assert!(said.contains(&format!("shards 0 .. {} are in one file, 3 files removed", SHARDS - 2)), "{said}");
    place.finish(&dir);
}

#[test]
fn compacting_while_workers_run_changes_nothing() {
    let place = Place::new();
    let dir = place.path("dir");
    let mut run = start(&mut run_quietly(&place.path("job.toml"), &dir, 2));
    let mut rounds = 0;
    while run.try_wait().unwrap().is_none() {
        if dir.join("plan.toml").exists() {
            compact(&dir);
            rounds += 1;
        }
    }
    assert!(rounds > 3, "{rounds} compactions beside the run");
    assert_eq!(run.wait().unwrap().code(), Some(0));
    Bits::of(&dir).assert_same(&straight().bits);
    compact(&dir);
    let left = Tree::of(&dir.join("shards")).0.into_keys().filter(|p| p.to_string_lossy().ends_with(".ckpt"));
    assert_eq!(left.count(), 2, "the compaction and the short last shard");
    place.finish(&dir);
}

#[test]
fn workers_and_runs_compact_whenever_enough_has_come_together() {
    let place = Place::new();
    let dir = place.planned("dir");
    expect(0, work(&dir, 0).args(["--compact", "2"]));
    assert!(dir.join(checkpoint(0)).exists(), "one is too few");
    expect(0, &mut work(&dir, 2));
    expect(0, work(&dir, 1).args(["--compact", "2"]));
    assert!((0..3).all(|shard| !dir.join(checkpoint(shard)).exists()), "all that is whole from the first on is taken");
    expect(0, run_quietly(&place.path("job.toml"), &dir, 2).args(["--compact", "2"]));
    assert!((3..5).all(|shard| !dir.join(checkpoint(shard)).exists()));
    place.finish(&dir);
    // What cannot be compacted harms no shard.
    let dir = place.planned("broken");
    expect(0, &mut work(&dir, 0));
    std::fs::write(dir.join(checkpoint(4)), "no checkpoint").unwrap();
    let said = expect(0, work(&dir, 1).args(["--compact", "2"]));
    assert!(
        said.contains("not compacted: ") && said.contains("shard-000004.ckpt") && said.contains("shard 1: done"),
        "{said}"
    );
}
