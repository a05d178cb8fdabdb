//! Merging: any order and grouping of copies, prefixes and duplicates; unfinished runs.

use crate::bits::{Bits, attribute, summary};
use crate::place::{Place, SHARDS, Tree, batches, batches_of, checkpoint, computed, straight};
use crate::process::{draws, expect, lampyris, sleep_until_drawn, start, work};
use lampyris::random::Generator;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// States of shards, each as long as it was when somebody stopped it.
type Prefixes = Vec<(u64, Vec<u8>)>;

fn take(dir: &Path, shard: u64) -> (u64, Vec<u8>) {
    (shard, fs::read(dir.join(checkpoint(shard))).unwrap())
}

/// Prefixes from interrupted work: shard 0 with two batches, one of one batch, and what kills leave of the others.
fn interrupted(place: &Place) -> Prefixes {
    let mut prefixes = Prefixes::new();
    for n in [2, 1] {
        let short = place.edited_job("short.toml", "batches = 28", &format!("batches = {n}"));
        let dir = place.plan(&short, &format!("first-{n}"));
        expect(0, &mut work(&dir, 0));
        prefixes.push(take(&dir, 0));
    }
    let dir = place.planned("killed");
    let mut draw = draws("prefixes");
    for shard in 1..SHARDS {
        // The fault leaves a first checkpoint for certain; a kill somewhat later may leave a longer one.
        work(&dir, shard).env("LAMPYRIS_FAULT", "after-rename:1").output().unwrap();
        prefixes.push(take(&dir, shard));
        let mut worker = start(&mut work(&dir, shard));
        sleep_until_drawn(&mut draw, 300);
        worker.kill().unwrap();
        worker.wait().unwrap();
        prefixes.push(take(&dir, shard));
    }
    prefixes
}

/// Folders of one plan, to be filled with checkpoints.
fn empty_folders(place: &Place, round: usize, count: u32) -> Vec<PathBuf> {
    let mut plan = computed();
    plan.0.retain(|path, _| path == Path::new("plan.toml"));
    let folders = (0..count).map(|i| place.path(&format!("round-{round}/{i}")));
    folders.inspect(|dir| plan.restore(dir)).collect()
}

fn put(dir: &Path, shard: u64, bytes: &[u8]) {
    fs::create_dir_all(dir.join("shards")).unwrap();
    fs::write(dir.join(checkpoint(shard)), bytes).unwrap();
}

fn shuffle<T>(list: &mut [T], draw: &mut Generator) {
    for i in (1..list.len()).rev() {
        list.swap(i, draw.below(i as u32 + 1) as usize);
    }
}

fn merge(folders: &[PathBuf], out: &Path, code: i32) -> String {
    expect(code, lampyris(&["merge"]).args(folders).arg("-o").arg(out))
}

#[test]
fn twenty_orders_and_groupings_of_copies_and_prefixes_merge_into_the_same_bits() {
    let place = Place::new();
    let prefixes = interrupted(&place);
    let whole = computed();
    let shorter = prefixes.iter().filter(|(k, bytes)| bytes.len() < whole.0[&checkpoint(*k)].len()).count();
    assert!(shorter >= 2, "the prefixes of shard 0 at least are shorter than their shard");
    let mut draw = draws("merging");
    for round in 0..20 {
        let count = 2 + draw.below(4);
        let mut folders = empty_folders(&place, round, count);
        // Later copies replace earlier ones of the same folder: prefixes first, then duplicates, then every whole shard.
        for (shard, bytes) in &prefixes {
            put(&folders[draw.below(count) as usize], *shard, bytes);
        }
        let duplicates: Vec<u64> = (0..4).map(|_| u64::from(draw.below(SHARDS as u32))).collect();
        for shard in duplicates.into_iter().chain(0..SHARDS) {
            put(&folders[draw.below(count) as usize], shard, &whole.0[&checkpoint(shard)]);
        }
        shuffle(&mut folders, &mut draw);
        let before: Vec<Tree> = folders.iter().map(|dir| Tree::of(dir)).collect();
        let out = place.path(&format!("out-{round}"));
        merge(&folders, &out, 0);
        Bits::of(&out).assert_same(&straight().bits);
        folders.iter().zip(before).for_each(|(dir, tree)| tree.assert_unchanged(dir, "a merged folder"));
    }
}

#[test]
fn an_unfinished_run_is_merged_marked_and_listed() {
    let place = Place::new();
    let whole = computed();
    let short = place.edited_job("short.toml", "batches = 28", "batches = 2");
    let first = place.plan(&short, "first");
    expect(0, &mut work(&first, 0));
    // Batches 0 and 1 of shard 0, shards 1 and 4: missing are 2-4, 10-19 and 25-27.
    let mut folders = empty_folders(&place, 0, 2);
    put(&folders[0], 0, &take(&first, 0).1);
    put(&folders[0], 4, &whole.0[&checkpoint(4)]);
    put(&folders[1], 1, &whole.0[&checkpoint(1)]);
    let mut bits = Vec::new();
    for name in ["one-way", "the-other"] {
        let out = place.path(name);
        let said = merge(&folders, &out, 3);
        assert!(said.contains("incomplete: batches 2-4, 10-19, 25-27 are missing\n"), "{said}");
        let summary = summary(&out);
        assert_eq!((&summary["complete"], &summary["batches"]), (&false.into(), &12.into()));
        assert_eq!(summary["missing_batches"], serde_json::json!([[2, 5], [10, 20], [25, 28]]));
        for map in ["view", "eye", "wall"] {
            assert_eq!(attribute(&out, map, "complete"), "false");
            assert_eq!(attribute(&out, map, "missingBatches"), "2-4, 10-19, 25-27");
            assert_eq!(attribute(&out, map, "batches"), "12");
        }
        bits.push(Bits::of(&out));
        folders.reverse();
    }
    bits[0].assert_same(&bits[1]);
    assert!(bits[0].tables.values().all(|table| table.contains("incomplete")));
    assert_ne!(bits[0].digest, straight().bits.digest);
    // The same, finished in the first folder: whole.
    let finished = place.path("finished");
    Tree(whole.0.into_iter().filter(|(path, _)| !path.starts_with("shards")).collect()).restore(&finished);
    for dir in &folders {
        fs::create_dir_all(finished.join("shards")).unwrap();
        for (shard, bytes) in checkpoints(dir) {
            put(&finished, shard, &bytes);
        }
    }
    place.finish(&finished);
    assert_eq!(attribute(&finished, "view", "complete"), "true");
    assert!((0..SHARDS).all(|k| batches(&finished, k) == batches_of(k)));
}

fn checkpoints(dir: &Path) -> BTreeMap<u64, Vec<u8>> {
    (0..SHARDS).filter_map(|k| Some((k, fs::read(dir.join(checkpoint(k))).ok()?))).collect()
}

#[test]
fn a_folder_moved_away_from_its_scene_needs_nothing_else() {
    let (place, elsewhere) = (Place::new(), Place::new());
    let planned = place.planned("dir");
    let moved = elsewhere.path("moved");
    Tree::of(&planned).restore(&moved);
    for gone in ["room.glb", "job.toml"] {
        fs::remove_file(place.path(gone)).unwrap();
        fs::remove_file(elsewhere.path(gone)).unwrap();
    }
    fs::remove_dir_all(planned).unwrap();
    // From a working directory that has nothing to do with it; half of it here, half on yet another machine.
    let other = elsewhere.path("other");
    Tree::of(&moved).restore(&other);
    for shard in 0..SHARDS {
        let dir = if shard % 2 == 0 { &moved } else { &other };
        expect(0, work(dir, shard).current_dir("/"));
    }
    let out = elsewhere.path("out");
    merge(&[other, moved], &out, 0);
    Bits::of(&out).assert_same(&straight().bits);
}
