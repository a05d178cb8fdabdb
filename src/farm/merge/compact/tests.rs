//! The algebra: whatever the order and grouping of copies, prefixes and compactions, the bits are those of one folder.

use super::*;
use crate::farm::checkpoint::{Judged, Reader, read_header};
use crate::farm::merge::goal::Stopped;
use crate::farm::merge::{Merged, goal_reached, merge};
use crate::farm::status::status;
use crate::farm::testing::{JOB, fixed_direct, plan_of, save, save_tally, tally};
use crate::random::{Domain, Generator, Stream};

fn folder(plan: &Plan) -> (tempfile::TempDir, Folder) {
    let temp = tempfile::tempdir().unwrap();
    let folder = Folder::new(temp.path());
    folder.establish(plan, &[]).unwrap();
    (temp, folder)
}

fn merged(folders: &[Folder]) -> Merged {
    merge(folders, folders[0].root()).unwrap().1
}

fn refusal<T: std::fmt::Debug>(result: Result<T>) -> String {
    match result {
        Err(e @ Error::Refused { .. }) => e.to_string(),
        other => panic!("not refused: {other:?}"),
    }
}

/// Five shards of four batches, the last one of three.
fn nineteen() -> Plan {
    plan_of(&JOB.replace("batches = 10", "batches = 19")).unwrap()
}

fn length(plan: &Plan, shard: u64) -> u64 {
    let range = plan.shard(shard);
    range.end - range.start
}

/// Copies `from` over `to` unless a longer one stands there: what a careful user does.
fn copy(from: &Folder, to: &Folder, plan: &Plan, shard: u64) {
    let batches = |f: &Folder| read_header(&f.shard_path(shard), plan, shard).unwrap().map_or(0, |h| h.batches());
    if batches(from) >= batches(to) {
        std::fs::copy(from.shard_path(shard), to.shard_path(shard)).unwrap();
    }
}

#[test]
fn any_order_grouping_prefixes_and_compactions_give_the_same_bits() {
    let plan = nineteen();
    // Every prefix of every shard, each in a folder of its own length.
    let sources: Vec<_> = (1..=4).map(|n| (n, folder(&plan))).collect();
    for (n, (_, folder)) in &sources {
        (0..5).for_each(|k| assert!(save(folder, &plan, k, (*n).min(length(&plan, k))).unwrap()));
    }
    let straight = merged(std::slice::from_ref(&sources[3].1.1));
    assert_eq!((straight.batches, straight.missing.len()), (19, 0));
    let mut draw = Stream::new(20, Domain::Receiver, "algebra").generator(0);
    let (mut compactions, mut longest) = (0, 0);
    for _ in 0..60 {
        let count = 1 + draw.below(4);
        let places: Vec<_> = (0..count).map(|_| folder(&plan)).collect();
        let any = |draw: &mut Generator| &places[draw.below(count) as usize].1;
        // Prefixes and copies anywhere, and every whole shard somewhere; somebody compacts in between.
        for step in 0..14 {
            let shard = u64::from(draw.below(5));
            copy(&sources[draw.below(4) as usize].1.1, any(&mut draw), &plan, shard);
            if step % 5 == 4 {
                compact(any(&mut draw), 0).unwrap();
            }
        }
        (0..5).for_each(|shard| copy(&sources[3].1.1, any(&mut draw), &plan, shard));
        for (_, folder) in places.iter().filter(|_| draw.uniform() < 0.5) {
            let compacted = compact(folder, 0).unwrap();
            compactions += usize::from(compacted.shards > 0);
            longest = longest.max(compacted.shards);
        }
        let mut folders: Vec<Folder> = places.iter().map(|(_, folder)| folder.clone()).collect();
        for i in (1..folders.len()).rev() {
            folders.swap(i, draw.below(i as u32 + 1) as usize);
        }
        assert!(merged(&folders) == straight);
    }
    assert!(compactions >= 20 && longest == 4, "{compactions} {longest}");
}

#[test]
fn a_compaction_grows_and_is_the_same_whatever_the_steps() {
    let plan = nineteen();
    let (_a, steps) = folder(&plan);
    let (_b, once) = folder(&plan);
    assert_eq!(compact(&steps, 7).unwrap(), Compacted { shards: 0, files: 0 });
    for shard in 0..5 {
        let n = length(&plan, shard);
        assert!(save(&steps, &plan, shard, n - 1).unwrap() && save(&once, &plan, shard, n).unwrap());
        assert_eq!(compact(&steps, 7).unwrap().shards, shard, "not before it is whole");
        assert!(save(&steps, &plan, shard, n).unwrap());
        // The last shard is short: another plan may go on with it, so it stays by itself.
        let files = usize::from(shard < 4);
        assert_eq!(compact(&steps, 7).unwrap(), Compacted { shards: (shard + 1).min(4), files });
        assert_eq!(steps.checkpoints().unwrap().len(), 1 - files);
    }
    assert_eq!(compact(&once, 7).unwrap(), Compacted { shards: 4, files: 4 });
    let bytes = |f: &Folder| std::fs::read(f.compaction_path()).unwrap();
    assert_eq!(bytes(&steps), bytes(&once));
    let left: Vec<_> =
        std::fs::read_dir(steps.root().join("shards")).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left.len(), 4, "two files with their locks: {left:?}");
    let seen = status(&steps).unwrap();
    assert_eq!((seen.batches, seen.shards_done, seen.shards.len()), (19, 5, 5));
    assert!(seen.shards.iter().all(|s| s.host == "test" && s.seconds == 1.5));
    // Longer plans go on from it.
    let (longer, _) = (steps.extend(22).unwrap(), assert!(status(&steps).unwrap().refused.is_empty()));
    assert!(save(&steps, &longer, 4, 4).unwrap() && save(&steps, &longer, 5, 2).unwrap());
    let (_c, straight) = folder(&longer);
    (0..6).for_each(|k| assert!(save(&straight, &longer, k, length(&longer, k)).unwrap()));
    assert!(merged(&[steps]) == merged(&[straight]));
}

#[test]
fn passes_over_a_map_that_does_not_fit_change_nothing() {
    let plan = nineteen();
    let (_temp, folder) = folder(&plan);
    (0..5).for_each(|k| assert!(save(&folder, &plan, k, length(&plan, k)).unwrap()));
    let files = choose(&plan, std::slice::from_ref(&folder)).unwrap();
    let all: Vec<usize> = (0..plan.sets().len()).collect();
    let folded = |memory| {
        let mut fold = Fold::within(&plan, all.clone(), folder.root(), memory).unwrap();
        files.chunks(2).for_each(|some| fold.take(some).unwrap());
        fold.result()
    };
    let straight = merged(std::slice::from_ref(&folder));
    // A block a pass, two, all.
    for memory in [1, 4096 * 72, 2 * 4096 * 72, 1 << 30] {
        assert!(folded(memory) == straight, "{memory}");
    }
}

#[test]
fn contradictions_are_named() {
    let plan = nineteen();
    let (_a, one) = folder(&plan);
    let (_b, other) = folder(&plan);
    (0..3).for_each(|k| assert!(save(&one, &plan, k, 4).unwrap()));
    save(&other, &plan, 0, 4).unwrap();
    let wrong = tally(&plan, 3, 4);
    save_tally(&other, &plan, 1, &wrong, &fixed_direct(&plan)).unwrap();
    let shard_1 = other.shard_path(1);
    let both = [one.clone(), other.clone()];
    compact(&one, 0).unwrap();
    let said = refusal(merge(&both, one.root()));
    assert!(said.contains("batch 0 of shard 1 is another than in") && said.contains(&shard_1.display().to_string()));
    // Two compactions that contradict each other.
    compact(&other, 0).unwrap();
    let said = refusal(merge(&both, one.root()));
    assert!(said.contains("batch 4 of the compaction is another than in"), "{said}");
    // A shard by the name of a compaction, and the other way round.
    save(&one, &plan, 3, 4).unwrap();
    std::fs::copy(one.shard_path(3), one.compaction_path()).unwrap();
    assert!(refusal(compact(&one, 0)).contains("holds shard 3, not the first shards together"));
    std::fs::copy(other.compaction_path(), one.shard_path(3)).unwrap();
    std::fs::remove_file(one.compaction_path()).unwrap();
    assert!(refusal(merge(&[one], other.root())).contains("holds the first shards together, not shard 3"));
}

#[test]
fn a_compaction_that_does_not_begin_at_the_beginning_or_is_foreign_is_refused() {
    let plan = nineteen();
    let (_temp, folder) = folder(&plan);
    (0..3).for_each(|k| assert!(save(&folder, &plan, k, 4).unwrap()));
    compact(&folder, 0).unwrap();
    let reader = Reader::open_compaction(&folder.compaction_path(), &plan).unwrap().unwrap();
    let header = reader.header().clone();
    assert_eq!((header.batches(), header.looks.len(), header.runs.len()), (12, 0, 3));
    assert_eq!(header.seconds(), 4.5);
    let other = plan_of(&JOB.replace("batches = 10", "batches = 19").replace("seed = 7", "seed = 8")).unwrap();
    let (_other, foreign) = self::folder(&other);
    std::fs::copy(folder.compaction_path(), foreign.compaction_path()).unwrap();
    assert!(refusal(merge(&[foreign], folder.root())).contains("of another plan: digest"));
    // Beyond the plan: the plan has been shortened, or the file comes from a longer one.
    let short = plan_of(&JOB.replace("batches = 10", "batches = 8")).unwrap();
    let (_short, shorter) = self::folder(&short);
    std::fs::copy(folder.compaction_path(), shorter.compaction_path()).unwrap();
    let said = refusal(merge(&[shorter], folder.root()));
    assert!(said.contains("compacted.ckpt: refused: goes on to batch 12, the plan ends at 8"), "{said}");
}

/// The plan with a goal for the lux-meter; looks are at 16, 24, 36, ... batches of 4 a shard.
fn aiming(half_width: f64) -> Plan {
    let stop =
        format!("[stop]\nrelative_half_width = {half_width}\nreceivers = [\"meter\"]\nmax_batches = 60\n[[camera]]");
    plan_of(&JOB.replace("batches = 10\n", "").replacen("[[camera]]", &stop, 1)).unwrap()
}

/// What the looks see of the lux-meter.
fn widths() -> Vec<f64> {
    let plan = aiming(1e-9);
    let (_temp, folder) = folder(&plan);
    (0..10).for_each(|k| assert!(save(&folder, &plan, k, 4).unwrap()));
    merged(&[folder]).looks.iter().map(|look| look.relative_half_width).collect()
}

#[test]
fn a_compaction_keeps_what_its_looks_saw_and_never_passes_the_one_that_decides() {
    let widths = widths();
    assert!(widths.len() == 3 && widths[0] > 1.05 * widths[1] && widths[1] > 1.05 * widths[2], "{widths:?}");
    let plan = aiming(widths[1]);
    let (_a, folder) = folder(&plan);
    (0..10).for_each(|k| assert!(save(&folder, &plan, k, 4).unwrap()));
    let straight = merged(std::slice::from_ref(&folder));
    assert_eq!(straight.stopped, Some(Stopped::GoalReached { batches: 24 }));
    // All ten shards are whole, and six are taken: there the goal is reached.
    assert_eq!(compact(&folder, 0).unwrap(), Compacted { shards: 6, files: 6 });
    let folders = [folder.clone()];
    assert!(merged(&folders) == straight);
    assert_eq!(goal_reached(&folders).unwrap(), Some(24));
    let header = Reader::open_compaction(&folder.compaction_path(), &plan).unwrap().unwrap().header().clone();
    let seen: Vec<_> = header
        .looks
        .iter()
        .map(|Judged { batches, relative_half_width, .. }| (*batches, *relative_half_width))
        .collect();
    assert_eq!(seen, [(16, widths[0]), (24, widths[1])]);
    // A tighter goal goes on from it.
    let (_b, whole) = self::folder(&aiming(widths[2]));
    (0..10).for_each(|k| assert!(save(&whole, &plan, k, 4).unwrap()));
    folder.establish(&aiming(widths[2]), &[]).unwrap();
    assert!(merged(&folders) == merged(&[whole]));
    // One that an earlier look had reached has lost what it would show, and so has another question.
    folder.establish(&aiming(widths[0]), &[]).unwrap();
    let said = refusal(merge(&folders, folder.root()));
    assert!(said.contains("the goal is reached at 16 batches, inside what has been compacted"), "{said}");
    let mut other = aiming(widths[2]);
    other.job.stop.as_mut().unwrap().share = 0.5;
    folder.establish(&other, &[]).unwrap();
    let said = refusal(goal_reached(&folders));
    assert!(said.contains("compacted beyond the look at 16 batches, under another [stop] or confidence"), "{said}");
}
