use super::goal::relative_half_width;
use super::*;
use crate::farm::checkpoint::{BLOCK, Content, read_header};
use crate::farm::testing::{JOB, fixed_direct, plan, plan_of, save, save_tally, scores, tally};
use crate::tally::statistics::{Estimate, student_quantile};
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

fn merged_in(folders: &[Folder]) -> Result<(Plan, Merged)> {
    merge(folders, folders[0].root())
}

fn merged(folders: &[Folder]) -> Merged {
    merged_in(folders).unwrap().1
}

fn refusal(folders: &[Folder]) -> String {
    match merged_in(folders) {
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
                let bins = bins.whole().unwrap();
                let close = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(x, y)| (x - y).abs() <= 1e-13);
                assert!(close(&bins.mean, &m.bins.mean) && close(&bins.m2, &m.bins.m2));
                assert!(close(&bins.direct, &m.bins.direct) && bins.peak == m.bins.peak);
                assert!(bins.existed == m.bins.existed && bins.colour.len() == m.bins.colour.len());
            }
            (SetResult::Replicates { scores, fixed_direct }, crate::tally::SetTally::Replicates(r)) => {
                assert_eq!(&scores.whole().unwrap(), r);
                assert!(fixed_direct.iter().all(|&x| x == 0.5));
            }
            other => panic!("{other:?}"),
        }
    }
    assert_eq!((result.flux.whole().unwrap(), result.monitors), (direct.flux, direct.monitors));
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
        let (plan, result) = merged_in(&both).unwrap();
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

/// The job with the goal `half_width` of the sets `receivers`; looks are at 16, 24, 36, 56 batches of 4 a shard.
fn aiming(half_width: f64, receivers: &str, max_batches: u64) -> Plan {
    let stop = format!(
        "[stop]\nrelative_half_width = {half_width}\nreceivers = {receivers}\nshare = 0.9\n\
         max_batches = {max_batches}\n[[camera]]"
    );
    plan_of(&JOB.replace("batches = 10\n", "").replacen("[[camera]]", &stop, 1)).unwrap()
}

/// The shards `shards`, each complete.
fn whole(shards: Range<u64>) -> Vec<(u64, u64)> {
    shards.map(|k| (k, 4)).collect()
}

/// h of the lux-meter after the first `n` batches: its scores, and 0.5 lx that are the same in every batch.
fn width_of_meter(plan: &Plan, n: u64) -> f64 {
    let set = plan.sets().len() - 1;
    let estimate = Estimate::from_scores((0..n).map(|i| scores(plan, i).sets[set].value[0]));
    student_quantile(0.95, n) * estimate.standard_error / (estimate.mean + 0.5)
}

#[test]
fn the_goal_ends_the_fold_at_the_first_look_that_reaches_it() {
    let widths = [16, 24, 36].map(|n| width_of_meter(&plan(), n));
    assert!(widths[0] > 1.05 * widths[1] && widths[1] > 1.05 * widths[2], "{widths:?}");
    let plan = aiming(widths[1], r#"["meter"]"#, 60);
    // Ten shards are done: four of them beyond the look that decides.
    let (_temp, folders) = folders(&plan, &[&whole(0..10)]);
    let result = merged(&folders);
    assert_eq!(result.stopped, Some(Stopped::GoalReached { batches: 24 }));
    assert_eq!((result.batches, result.missing.len(), result.seconds), (24, 0, 6.0 * 1.5));
    let seen: Vec<_> = result.looks.iter().map(|l| (l.batches, l.relative_half_width, l.set.as_str())).collect();
    assert_eq!(seen, [(16, widths[0], "meter"), (24, widths[1], "meter")]);
    assert_eq!(goal_reached(&folders).unwrap(), Some(24));

    // The same numbers as those of a job of 24 batches without a goal.
    let fixed = plan_of(&JOB.replace("batches = 10", "batches = 24")).unwrap();
    let (_temp, six) = self::folders(&fixed, &[&whole(0..6)]);
    let straight = merged(&six);
    assert_eq!((straight.stopped, straight.looks.len()), (None, 0));
    assert!(result.sets == straight.sets && result.flux == straight.flux);
}

#[test]
fn a_look_is_judged_only_with_every_shard_before_it() {
    let plan = aiming(width_of_meter(&plan(), 24), r#"["meter"]"#, 40);
    let see = |lists: &[&[(u64, u64)]]| {
        let (_temp, folders) = folders(&plan, lists);
        let m = merged(&folders);
        let reached = matches!(m.stopped, Some(Stopped::GoalReached { .. }));
        assert_eq!(goal_reached(&folders).unwrap().is_some(), reached);
        (m.stopped, m.looks.len(), m.batches, m.missing)
    };
    let done = (Some(Stopped::GoalReached { batches: 24 }), 2, 24, Vec::new());
    // In several folders, as copies, prefixes and with more than is needed.
    assert_eq!(see(&[&[(0, 4), (3, 4), (4, 4)], &[(1, 4), (2, 4), (5, 4), (0, 2)], &[(7, 3)]]), done);
    assert_eq!(see(&[&whole(0..10)]), done);
    // One batch short of the look, whatever lies beyond.
    let short = see(&[&whole(0..5), &[(5, 3)], &whole(6..9)]);
    assert_eq!(short, (None, 1, 35, vec![23..24, 36..40]));
    // Without an early shard no look can be judged, and what there is, is merged.
    assert_eq!(see(&[&whole(1..9)]), (None, 0, 32, vec![0..4, 36..40]));
    assert_eq!(see(&[&whole(0..2), &whole(3..9)]), (None, 0, 32, vec![8..12, 36..40]));
}

#[test]
fn the_decision_reads_the_sets_of_the_goal_and_the_batches_before_the_look() {
    let plan = aiming(width_of_meter(&plan(), 16), r#"["meter"]"#, 40);
    let (_temp, folders) = folders(&plan, &[&whole(0..7)]);
    let spoil = |shard: u64, at: fn(usize) -> usize| {
        let path = folders[0].shard_path(shard);
        let mut bytes = std::fs::read(&path).unwrap();
        let at = at(bytes.len());
        bytes[at] ^= 1;
        std::fs::write(path, bytes).unwrap();
    };
    // Beyond the look; and before it in the moments of the floor, which fill the middle of the file.
    spoil(6, |length| length - 1);
    assert_eq!(merged(&folders).batches, 16);
    spoil(1, |length| length / 2);
    assert_eq!(goal_reached(&folders).unwrap(), Some(16));
    assert!(refusal(&folders).contains("shard-000001.ckpt: refused: damaged: wrong checksum of Moments"));
}

/// Changes a byte of every section in the checkpoint of `shard` that holds something of the set number `of`.
fn spoil_set(folder: &Folder, plan: &Plan, shard: u64, of: u32) {
    let path = folder.shard_path(shard);
    let sections = read_header(&path, plan, shard).unwrap().unwrap().sections;
    let mut bytes = std::fs::read(&path).unwrap();
    let start = bytes.len() as u64 - sections.iter().map(|s| s.bytes).sum::<u64>();
    for section in sections {
        match section.content {
            Content::Moments { set, .. }
            | Content::Scores { set, .. }
            | Content::Extremes { set }
            | Content::FixedDirect { set }
            | Content::Monitors { set }
                if set == of =>
            {
                bytes[(start + section.offset) as usize] ^= 1;
            }
            _ => {}
        }
    }
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn the_decision_reads_nothing_of_other_sets() {
    let plan = aiming(0.9, r#"["desk"]"#, 40);
    let (_temp, folders) = folders(&plan, &[&whole(0..4)]);
    for (number, set) in plan.sets().iter().enumerate().filter(|(_, set)| set.name != "desk") {
        spoil_set(&folders[0], &plan, number as u64, number as u32);
        assert_eq!(goal_reached(&folders).unwrap(), Some(16), "{}", set.name);
        assert!(refusal(&folders).contains("damaged: wrong checksum"), "{}", set.name);
    }
    spoil_set(&folders[0], &plan, 2, 2);
    assert!(goal_reached(&folders).unwrap_err().to_string().contains("wrong checksum of"), "the set of the goal");
}

#[test]
fn the_limit_is_not_a_look() {
    let at = |n: u64| width_of_meter(&plan(), n);
    // 30 batches would do, but nobody looks there.
    assert!(at(30) < 0.98 * at(24));
    let (_temp, dirs) = folders(&aiming(0.99 * at(24), r#"["meter"]"#, 30), &[&whole(0..7), &[(7, 2)]]);
    let limited = merged(&dirs);
    assert_eq!((limited.stopped, limited.looks.len()), (Some(Stopped::Limit), 2));
    assert_eq!((limited.batches, limited.missing.len()), (30, 0));
    // A limit where a look falls is one.
    let (_temp, dirs) = folders(&aiming(at(24), r#"["meter"]"#, 24), &[&whole(0..6)]);
    assert_eq!(merged(&dirs).stopped, Some(Stopped::GoalReached { batches: 24 }));
}

#[test]
fn every_set_by_itself_must_have_its_share() {
    let (_temp, dirs) = folders(&aiming(1e-6, "[]", 16), &[&whole(0..4)]);
    let (plan, result) = merged_in(&dirs).unwrap();
    let quantile = student_quantile(0.95, 16);
    let mut widest: (f64, &str) = (0.0, "");
    let shapes = plan.sets();
    for (shape, set) in shapes.iter().zip(&result.sets) {
        let (random, fixed): (Vec<Estimate>, &Vec<f64>) = match set {
            SetResult::Moments { bins, fixed_direct } => {
                let bins = bins.whole().unwrap();
                ((0..bins.len()).map(|i| bins.estimate(i, 16)).collect(), fixed_direct)
            }
            SetResult::Replicates { scores, fixed_direct } => {
                let scores = scores.whole().unwrap();
                ((0..shape.bins()).map(|i| scores.estimate(i)).collect(), fixed_direct)
            }
        };
        let offset = fixed.first().copied().unwrap_or(0.0);
        let mut widths: Vec<f64> = random.iter().map(|e| relative_half_width(e.shifted(offset), quantile)).collect();
        widths.sort_by(f64::total_cmp);
        let width = widths[(0.9 * widths.len() as f64).ceil() as usize - 1];
        if width > widest.0 {
            widest = (width, &shape.name);
        }
    }
    let look = &result.looks[0];
    assert_eq!((look.relative_half_width, look.set.as_str()), widest);
    // The floor has more bins than a block: its share is taken over all of them.
    assert!(shapes.iter().any(|s| s.bins() > BLOCK));
}

#[test]
fn folders_with_other_goals_are_refused_unless_one_goes_on_longer() {
    let (wide, tight) = (aiming(0.5, "[]", 40), aiming(0.001, "[]", 40));
    let longer = aiming(0.001, "[]", 44);
    let (_a, mut dirs) = folders(&wide, &[&whole(0..6)]);
    let (_b, others) = folders(&tight, &[&whole(0..6)]);
    let (_c, long) = folders(&longer, &[&whole(0..1)]);
    dirs.extend(others);
    for _ in 0..2 {
        let reason = refusal(&dirs);
        assert!(reason.contains("plan.toml: refused: another [stop] than in a folder before it"), "{reason}");
        assert!(goal_reached(&dirs).is_err());
        dirs.reverse();
    }
    dirs.extend(long);
    for _ in 0..3 {
        let (plan, result) = merged_in(&dirs).unwrap();
        assert_eq!((plan.job.run.batches, result.stopped, result.looks.len()), (44, None, 2));
        dirs.rotate_left(1);
    }
}

#[test]
fn folders_that_ask_for_other_intervals_or_ratios_are_refused() {
    let ratio = "[[ratio]]\nname = \"r\"\nnumerator = \"desk\"\ndenominator = \"meter\"\n[[source]]";
    let sure = ("seed = 7", "seed = 7\nconfidence = 0.99");
    let cases: [(&[(&str, &str)], &str); 3] = [
        (&[sure], "another run.confidence than in a folder before it: plan the job on both folders first"),
        (&[("[[source]]", ratio)], "another [[ratio]] than"),
        (&[sure, ("[[source]]", ratio)], "another run.confidence and [[ratio]] than"),
    ];
    for (changes, said) in cases {
        let text = changes.iter().fold(JOB.to_owned(), |text, (from, to)| text.replacen(from, to, 1));
        let (_a, mut both) = folders(&plan(), &[ALL]);
        let (_b, other) = folders(&plan_of(&text).unwrap(), &[ALL]);
        both.extend(other);
        for _ in 0..2 {
            let reason = refusal(&both);
            assert!(reason.contains(said) && reason.contains(&both[1].plan_path().display().to_string()), "{reason}");
            both.reverse();
        }
        // The same job on both: what was computed before counts, and the order is free.
        both[0].establish(&plan_of(&text).unwrap(), &[]).unwrap();
        both[1].establish(&plan_of(&text).unwrap(), &[]).unwrap();
        let forth = merged_in(&both).unwrap();
        both.reverse();
        assert_eq!(merged_in(&both).unwrap(), forth);
    }
}
