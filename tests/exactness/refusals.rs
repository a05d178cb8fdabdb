//! Checkpoints, plans and inputs that are not what they should be: refused by name, exit code 2, nothing changed.

use crate::place::{Place, Tree, batches_of, checkpoint, computed, header, plan_in, straight};
use crate::process::{expect, lampyris, run_quietly, work};
use lampyris::farm::checkpoint::{Reader, Run, Snapshot, VERSION, write};
use std::fs;
use std::path::{Path, PathBuf};

/// The shard whose file is tampered with.
const SHARD: u64 = 1;

/// All that reads the file of [`SHARD`], refused with `fragment` and the name of the file; `status` reads its header
/// only, so it sees `in_header` damage alone.
#[track_caller]
fn refused(place: &Place, dir: &Path, fragment: &str, in_header: bool) {
    let before = Tree::of(dir);
    let named = format!("{}: refused: ", dir.join(checkpoint(SHARD)).display());
    let mut merge = lampyris(&["merge"]);
    let mut status = lampyris(&["status"]);
    let commands = [&mut work(dir, SHARD), &mut run_quietly(&place.path("job.toml"), dir, 2), merge.arg(dir)];
    for command in commands {
        let said = expect(2, command);
        assert!(said.contains(&named) && said.contains(fragment), "expected {fragment}\nsaid {said}");
        before.assert_unchanged(dir, fragment);
    }
    let said = expect(if in_header { 2 } else { 0 }, status.arg(dir));
    assert_eq!(said.contains(&named) && said.contains(fragment), in_header, "{said}");
    before.assert_unchanged(dir, fragment);
}

/// A place with all checkpoints in `dir`, and the bytes of the one to tamper with.
fn computed_place() -> (Place, PathBuf, Vec<u8>) {
    let place = Place::new();
    let dir = place.path("dir");
    computed().restore(&dir);
    let bytes = fs::read(dir.join(checkpoint(SHARD))).unwrap();
    (place, dir, bytes)
}

#[test]
fn damaged_checkpoints_are_refused() {
    let (place, dir, whole) = computed_place();
    let path = dir.join(checkpoint(SHARD));
    let header_length = u32::from_le_bytes(whole[12..16].try_into().unwrap()) as usize;
    let base = 16 + header_length + 16;
    for (length, fragment) in [
        (0, "damaged: empty"),
        (7, "not a checkpoint of lampyris"),
        (base / 2, "damaged: truncated"),
        (base, "damaged: truncated"),
        (whole.len() - 1, "damaged: truncated"),
    ] {
        fs::write(&path, &whole[..length]).unwrap();
        refused(&place, &dir, fragment, true);
    }
    fs::write(&path, [&whole[..], b"\n"].concat()).unwrap();
    refused(&place, &dir, "damaged: 1 trailing bytes", true);
    let newer = (VERSION + 1).to_le_bytes();
    fs::write(&path, [&whole[..8], &newer, &whole[12..]].concat()).unwrap();
    let said = format!("format version {} is newer; this program reads version {VERSION}", VERSION + 1);
    refused(&place, &dir, &said, true);
    let flips = [
        (3, "not a checkpoint of lampyris"),
        (16, "damaged: wrong checksum of the header"),
        (16 + header_length / 2, "damaged: wrong checksum of the header"),
        (base - 1, "damaged: wrong checksum of the header"),
    ];
    for (at, fragment) in flips {
        fs::write(&path, flipped(&whole, at)).unwrap();
        refused(&place, &dir, fragment, true);
    }
}

fn flipped(bytes: &[u8], at: usize) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    bytes[at] ^= 1 << (at % 8);
    bytes
}

#[test]
fn a_flipped_bit_in_any_section_is_refused() {
    let (place, dir, whole) = computed_place();
    let sections = header(&dir, SHARD).unwrap().sections;
    let base = whole.len() as u64 - sections.iter().map(|s| s.bytes).sum::<u64>();
    for section in sections {
        let at = base + section.offset + section.bytes / 2;
        fs::write(dir.join(checkpoint(SHARD)), flipped(&whole, at as usize)).unwrap();
        refused(&place, &dir, &format!("damaged: wrong checksum of {:?}", section.content), false);
    }
}

#[test]
fn foreign_and_misplaced_checkpoints_are_refused() {
    let (place, dir, _) = computed_place();
    let path = dir.join(checkpoint(SHARD));
    // Another plan: one lux-meter, so that it is quick.
    let text = "scene = \"room.glb\"\n[run]\nbatches = 16\nbatches_per_shard = 5\n\
                [[point]]\nname = \"table\"\nposition = [3.8, 0.8, -2.45]\nnormal = [0.0, 1.0, 0.0]\n";
    fs::write(place.path("foreign.toml"), text).unwrap();
    let foreign = place.plan(&place.path("foreign.toml"), "foreign");
    expect(0, &mut work(&foreign, SHARD));
    fs::copy(foreign.join(checkpoint(SHARD)), &path).unwrap();
    refused(&place, &dir, "of another plan: digest ", true);
    let said = expect(2, lampyris(&["merge"]).args([&dir, &foreign]));
    assert!(said.contains("another plan than that of the first folder"), "{said}");
    fs::copy(dir.join(checkpoint(2)), &path).unwrap();
    refused(&place, &dir, "holds shard 2, not 1", true);
}

/// Writes a prefix of [`SHARD`] into `to` with every checksum right, but another digest of the batch number `batch`:
/// what a machine that computes differently would write.
fn write_diverging(from: &Path, to: &Path, batch: usize) {
    let plan = plan_in(from);
    let reader = Reader::open(&from.join(checkpoint(SHARD)), &plan, SHARD).unwrap().unwrap();
    let mut tally = reader.tally().unwrap();
    tally.digests[batch][0] ^= 1;
    let fixed: Vec<Vec<f64>> = (0..plan.sets().len()).map(|set| reader.fixed_direct(set).unwrap()).collect();
    let snapshot = Snapshot {
        plan: &plan,
        shard: SHARD,
        tally: &tally,
        fixed_direct: &fixed,
        runs: &[Run {
            batches: tally.batches(),
            host: "elsewhere".into(),
            instructions: "scalar".into(),
            seconds: 1.0,
        }],
        written: 0,
        relative_error: 0.1,
    };
    fs::create_dir_all(to.join("shards")).unwrap();
    assert!(write(&to.join(checkpoint(SHARD)), &snapshot).unwrap());
}

#[test]
fn diverging_prefixes_are_both_named() {
    let (place, dir, _) = computed_place();
    let other = place.path("other");
    Tree(computed().0.into_iter().filter(|(path, _)| !path.starts_with("shards")).collect()).restore(&other);
    write_diverging(&dir, &other, 3);
    assert_eq!(header(&other, SHARD).unwrap().batches(), batches_of(SHARD));
    let trees = [Tree::of(&dir), Tree::of(&other)];
    for folders in [[&dir, &other], [&other, &dir]] {
        let out = place.path("out");
        let said = expect(2, lampyris(&["merge"]).args(folders).arg("-o").arg(&out));
        for path in [dir.join(checkpoint(SHARD)), other.join(checkpoint(SHARD))] {
            assert!(said.contains(&format!("{}: refused: batch 3 of the shard is another", path.display())), "{said}");
        }
        assert!(!out.join("summary.json").exists());
        trees[0].assert_unchanged(&dir, "merged");
        trees[1].assert_unchanged(&other, "merged");
    }
}

#[test]
fn an_edited_plan_is_refused() {
    let (place, dir, _) = computed_place();
    let path = dir.join("plan.toml");
    let text = fs::read_to_string(&path).unwrap();
    for (from, to, fragment) in [
        ("seed = 20", "seed = 21", "edited or damaged: its digest is not that of its content"),
        ("width = 24", "width = 80", "edited or damaged: its digest is not that of its content"),
        ("numerics = ", "numerics = 9", "NUMERICS 9"),
        ("batches = 28", "batches = 0", "run.batches = 0: 1 .. "),
        ("[job.run]", "[job.run", "not a plan"),
    ] {
        assert!(text.contains(from), "{from}");
        fs::write(&path, text.replacen(from, to, 1)).unwrap();
        let before = Tree::of(&dir);
        let mut merge = lampyris(&["merge"]);
        let mut status = lampyris(&["status"]);
        let commands = [
            &mut work(&dir, SHARD),
            &mut run_quietly(&place.path("job.toml"), &dir, 2),
            merge.arg(&dir),
            status.arg(&dir),
        ];
        for command in commands {
            let said = expect(2, command);
            assert!(said.contains("plan.toml") && said.contains(fragment), "expected {fragment}\nsaid {said}");
            before.assert_unchanged(&dir, to);
        }
    }
}

#[test]
fn a_modified_copy_of_an_input_is_refused_and_run_repairs_it() {
    let (place, dir, _) = computed_place();
    fs::remove_file(dir.join(checkpoint(5))).unwrap();
    let input = plan_in(&dir).inputs[0].clone();
    let path = dir.join("inputs").join(format!("{}.glb", input.digest));
    let good = fs::read(&path).unwrap();
    fs::write(&path, flipped(&good, good.len() / 2)).unwrap();
    let before = Tree::of(&dir);
    let said = expect(2, &mut work(&dir, 5));
    let reason = format!("{}: refused: damaged: not the bytes of \"room.glb\" any more", path.display());
    assert!(said.contains(&reason), "{said}");
    before.assert_unchanged(&dir, "input");
    // `run` has the original, of the right digest.
    place.finish(&dir);
    assert_eq!(fs::read(&path).unwrap(), good);
    assert!(straight().tree.0.contains_key(path.strip_prefix(&dir).unwrap()));
}
