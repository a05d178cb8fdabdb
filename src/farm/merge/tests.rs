use super::*;
use crate::farm::testing::{JOB, fixed_direct, plan, plan_of, save, save_tally, scores, tally};
use crate::random::{Domain, Stream};
use crate::tally::{HistoryMoments, Tally};

/// Folders holding the plan and the checkpoints (shard, batches) of each list.
fn folders(plan: &Plan, lists: &[&[(u64, u64)]]) -> (tempfile::TempDir, Vec<Folder>) {
    let temp = tempfile::tempdir().unwrap();
    let mut folders = Vec::new();
    for (i, list) in lists.iter().enumerate() {
        let folder = Folder::new(&temp.path().join(i.to_string()));
        folder.establish(plan, &[]).unwrap();
        list.iter().for_each(|&(shard, n)| assert!(save(&folder, plan, shard, n).unwrap()));
        folders.push(folder);
    }
    (temp, folders)
}

fn merged(folders: &[Folder]) -> Merged {
    merge(folders).unwrap().1
}

fn refusal(folders: &[Folder]) -> String {
    match merge(folders) {
        Err(e @ Error::Refused { .. }) => e.to_string(),
        other => panic!("not refused: {other:?}"),
    }
}

const ALL: &[(u64, u64)] = &[(0, 4), (1, 4), (2, 2)];

#[test]
fn the_merge_is_the_fold_over_shards_and_agrees_with_one_pass() {
    let plan = plan();
    let (_temp, folders) = folders(&plan, &[ALL]);
    let result = merged(&folders);
    assert_eq!((result.batches, result.missing.len(), result.seconds), (10, 0, 4.5));
    let mut direct = Tally::new(&plan.sets());
    (0..10).for_each(|index| direct.accumulate(&scores(&plan, index)));
    for (set, one_pass) in result.sets.iter().zip(&direct.sets) {
        match (set, one_pass) {
            (SetResult::Moments { bins, .. }, crate::tally::SetTally::Moments(m)) => {
                let close = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(x, y)| (x - y).abs() <= 1e-13);
                assert!(close(&bins.mean, &m.bins.mean) && close(&bins.m2, &m.bins.m2));
                assert!(close(&bins.direct, &m.bins.direct) && bins.peak == m.bins.peak);
                assert!(bins.existed == m.bins.existed && bins.colour.len() == m.bins.colour.len());
            }
            (SetResult::Replicates { scores, fixed_direct }, crate::tally::SetTally::Replicates(r)) => {
                assert_eq!(scores, r);
                assert!(fixed_direct.iter().all(|&x| x == 0.5));
            }
            other => panic!("{other:?}"),
        }
    }
    assert_eq!((result.flux, result.monitors), (direct.flux, direct.monitors));
}

#[test]
fn power_sums_of_watched_histories_do_not_depend_on_the_shards() {
    // Shards of 4 batches and one shard of all: other random numbers would be another plan, so the tallies are made
    // by hand from the same scores.
    let plan = plan();
    let (_temp, folders) = folders(&plan, &[ALL]);
    let merged = merged(&folders).monitors[3][0].clone();
    let mut totals: Vec<f64> = (0..10).flat_map(|b| scores(&plan, b).sets[3].watched[0].totals.clone()).collect();
    let whole = HistoryMoments::of(&totals);
    let sum = merged.histories.iter().fold(HistoryMoments::default(), |sum, next| sum.merged(*next));
    assert_eq!(sum.n, 640);
    for (a, b) in [(sum.mean, whole.mean), (sum.m2, whole.m2), (sum.m3, whole.m3), (sum.m4, whole.m4)] {
        assert!((a - b).abs() <= 1e-12 * b.abs(), "{a} {b}");
    }
    totals.sort_by(|a, b| b.total_cmp(a));
    assert_eq!(merged.largest, totals[..200]);
    let of_batch = |b| scores(&plan, b).sets[3].value[0];
    assert_eq!(merged.scores, (0..10).map(of_batch).collect::<Vec<_>>());
}

#[test]
fn any_grouping_order_and_duplication_gives_the_same_bits() {
    let plan = plan();
    let (_whole, one) = folders(&plan, &[ALL]);
    let whole = merged(&one);
    let parts: &[&[(u64, u64)]] = &[&[(2, 2), (0, 1)], &[(0, 4), (1, 3)], &[(1, 4)], &[(0, 3), (2, 1)]];
    let (_temp, mut parts) = folders(&plan, parts);
    let mut draw = Stream::new(20, Domain::Receiver, "orders").generator(0);
    for _ in 0..20 {
        for i in (1..parts.len()).rev() {
            parts.swap(i, draw.below(i as u32 + 1) as usize);
        }
        assert_eq!(merged(&parts), whole);
    }
}

#[test]
fn missing_batches_are_listed() {
    let plan = plan();
    let (_temp, some) = folders(&plan, &[&[(0, 3), (2, 1)]]);
    let result = merged(&some);
    assert_eq!((result.batches, result.missing), (4, vec![3..8, 9..10]));
    let (_temp, none) = folders(&plan, &[&[]]);
    assert!(refusal(&none).contains("no checkpoint yet"));
}

#[test]
fn contradicting_prefixes_are_both_named() {
    let plan = plan();
    let (_temp, folders) = folders(&plan, &[&[(0, 3)], &[]]);
    save_tally(&folders[1], &plan, 0, &tally(&plan, 1, 4), &fixed_direct(&plan)).unwrap();
    let reason = refusal(&folders);
    assert!(reason.contains("batch 0 of the shard is another"), "{reason}");
    for folder in &folders {
        assert!(reason.contains(&format!("{}: refused", folder.shard_path(0).display())), "{reason}");
    }
}

#[test]
fn other_direct_light_is_refused() {
    let plan = plan();
    let (_temp, folders) = folders(&plan, &[&[(0, 4)]]);
    let mut fixed = fixed_direct(&plan);
    fixed[3][0] = f64::from_bits(0.5f64.to_bits() + 1);
    save_tally(&folders[0], &plan, 1, &tally(&plan, 1, 4), &fixed).unwrap();
    assert!(refusal(&folders).contains("its direct light is another than in"));
}

#[test]
fn damaged_foreign_and_misnamed_files_are_named_and_kept() {
    let plan = plan();
    let (_temp, folders) = folders(&plan, &[ALL]);
    let other = plan_of(&JOB.replace("seed = 7", "seed = 8")).unwrap();
    let paths: Vec<_> = (0..3).map(|k| folders[0].shard_path(k)).collect();
    std::fs::remove_file(&paths[0]).unwrap();
    save(&folders[0], &other, 0, 2).unwrap();
    let mut bytes = std::fs::read(&paths[1]).unwrap();
    bytes[40] ^= 4;
    std::fs::write(&paths[1], &bytes).unwrap();
    let reason = refusal(&folders);
    assert!(reason.contains("shard-000000.ckpt: refused: of another plan"), "{reason}");
    assert!(reason.contains("shard-000001.ckpt: refused: damaged: wrong checksum of the header"), "{reason}");
    assert_eq!(std::fs::read(&paths[1]).unwrap(), bytes);
    let copy = paths[2].with_file_name("shard-000002 (copy).ckpt");
    std::fs::copy(&paths[2], &copy).unwrap();
    assert!(refusal(&folders).contains("not the name of a shard"));
}

#[test]
fn damage_in_a_section_is_refused() {
    let plan = plan();
    let (_temp, folders) = folders(&plan, &[ALL]);
    let path = folders[0].shard_path(1);
    let mut bytes = std::fs::read(&path).unwrap();
    let at = bytes.len() / 2;
    bytes[at] ^= 1;
    std::fs::write(&path, &bytes).unwrap();
    let reason = refusal(&folders);
    assert!(reason.contains("shard-000001.ckpt: refused: damaged: wrong checksum of Moments"), "{reason}");
}

#[test]
fn folders_of_an_extended_plan_merge_into_the_longest() {
    let (short, long) = (plan(), plan_of(&JOB.replace("batches = 10", "batches = 12")).unwrap());
    let (_a, mut both) = folders(&short, &[ALL]);
    let (_b, extended) = folders(&long, &[&[(2, 4)]]);
    both.extend(extended);
    for _ in 0..2 {
        let (plan, result) = merge(&both).unwrap();
        assert_eq!((plan.job.run.batches, result.batches, result.missing.len()), (12, 12, 0));
        both.reverse();
    }
    // A checkpoint that goes beyond every plan here cannot be cut back.
    std::fs::copy(both[1].shard_path(2), both[0].shard_path(2)).unwrap();
    let reason = refusal(&both[..1]);
    assert!(reason.contains("goes on to batch 12, the plan ends at 10"), "{reason}");
}

#[test]
fn folders_of_different_plans_are_refused_with_the_difference() {
    let (_a, mut both) = folders(&plan(), &[ALL]);
    let other = plan_of(&JOB.replace("seed = 7", "seed = 8")).unwrap();
    let (_b, foreign) = folders(&other, &[ALL]);
    both.extend(foreign);
    assert!(refusal(&both).contains("run.seed: 7 in the plan, 8 now"));
}
