//! Precision as the goal: the same batches and bits for any number of workers, kills, copies and changes of the goal,
//! namely those of a job planned for just these batches.
//!
//! Shards have 5 batches, so looks are at 20, 30, 45 batches.

use crate::bits::{Bits, summary};
use crate::place::{Place, Tree, batches, checkpoint};
use crate::process::{draws, expect, lampyris, run_quietly, sleep_until_drawn, start, work};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

const TYPED: &str = "batches = 28\n";
/// All of these must be known; the rest of the job is computed with them.
const WANTED: &str = r#"["table_height", "floor"]"#;

/// A straight run up to a limit of 45 batches with a goal out of reach, by one worker.
struct Limited {
    tree: Tree,
    bits: Bits,
    summary: Value,
}

fn limited() -> &'static Limited {
    static LIMITED: OnceLock<Limited> = OnceLock::new();
    LIMITED.get_or_init(|| {
        let place = Place::new();
        let dir = place.path("limited");
        let said = expect(0, &mut run_quietly(&aiming(&place, 1e-6, 45), &dir, 1));
        assert!(said.contains("not stopped by its goal: 45 of at most 45 batches"), "{said}");
        assert!(said.contains("warning: the limit of 45 batches came before the goal that"), "{said}");
        Limited { tree: Tree::of(&dir), bits: Bits::of(&dir), summary: summary(&dir) }
    })
}

/// h at the three looks, not less: JSON is read back to the last bit or the one before.
fn widths() -> [f64; 3] {
    let look = |i: usize| limited().summary["stopped_by"]["looks"][i]["relative_half_width"].as_f64().unwrap();
    std::array::from_fn(|i| look(i) * (1.0 + 1e-12))
}

/// The job with a goal: `half_width` for every second bin.
fn aiming(place: &Place, half_width: f64, max_batches: u64) -> PathBuf {
    let goal = format!(
        "[stop]\nrelative_half_width = {half_width}\nreceivers = {WANTED}\nshare = 0.5\nmax_batches = {max_batches}\n"
    );
    let job = place.edited_job("aiming.toml", TYPED, "");
    let text = fs::read_to_string(&job).unwrap();
    fs::write(&job, text.replacen("[[camera]]", &format!("{goal}[[camera]]"), 1)).unwrap();
    job
}

/// The bits of a run planned for `batches`, without a goal.
fn planned_for(place: &Place, batches: u64) -> Bits {
    let job = place.edited_job("fixed.toml", TYPED, &format!("batches = {batches}\n"));
    let dir = place.path(&format!("fixed-{batches}"));
    expect(0, &mut run_quietly(&job, &dir, 1));
    Bits::of(&dir)
}

/// The bits after 30 batches: those at which the goal of most tests is reached.
fn thirty() -> &'static Bits {
    static THIRTY: OnceLock<Bits> = OnceLock::new();
    THIRTY.get_or_init(|| planned_for(&Place::new(), 30))
}

/// A goal that the second look reaches and the first does not.
fn second() -> f64 {
    let [first, second, third] = widths();
    assert!(1.0 > first && first > second && second > third, "{:?}", widths());
    second
}

#[track_caller]
fn assert_stopped_at_thirty(dir: &Path) {
    Bits::of(dir).assert_same(thirty());
    let s = summary(dir);
    assert_eq!((&s["complete"], &s["batches"], &s["missing_batches"]), (&json!(true), &json!(30), &json!([])));
    let by = &s["stopped_by"];
    assert_eq!((&by["what"], &by["batches"], &by["look"]), (&json!("goal"), &json!(30), &json!(2)));
    assert_eq!(by["looks"].as_array().unwrap()[..], limited().summary["stopped_by"]["looks"].as_array().unwrap()[..2]);
}

#[test]
fn one_two_and_five_workers_stop_at_the_same_batch_with_the_bits_of_a_run_planned_so() {
    let place = Place::new();
    let job = aiming(&place, second(), 1000);
    for workers in [1, 2, 5] {
        let dir = place.path(&format!("by-{workers}"));
        let said = expect(0, &mut run_quietly(&job, &dir, workers));
        assert!(
            said.contains("stopped at 30 batches (look 2): the 95 % interval of table_height, floor is within"),
            "{said}"
        );
        assert!(said.contains("% in 50 % of the bins\n") && !said.contains("incomplete"), "{said}");
        assert_stopped_at_thirty(&dir);
        // Nobody went on for long.
        assert!((0..30).map(|k| batches(&dir, k)).sum::<u64>() < 30 + 5 * (workers as u64 + 1));
        let before = Tree::of(&dir.join("shards"));
        let said = expect(0, &mut run_quietly(&job, &dir, workers));
        assert!(said.contains("nothing was left to do"), "{said}");
        before.assert_unchanged(&dir.join("shards"), "done before");
        assert_stopped_at_thirty(&dir);
        let said = expect(0, lampyris(&["status"]).arg(&dir));
        assert!(said.contains("\ngoal reached at 30 batches: done\n") && !said.contains(" s left"), "{said}");
        let shown: Value = serde_json::from_str(&expect(0, lampyris(&["status", "--json"]).arg(&dir))).unwrap();
        assert_eq!((&shown["goal"]["verdict"], &shown["eta_seconds"]), (&json!({"reached_at": 30}), &Value::Null));
    }
}

#[test]
fn submissions_go_from_look_to_look_and_end_with_the_goal() {
    let place = Place::new();
    let dir = place.plan(&aiming(&place, second(), 45), "dir");
    let submitted = || {
        let mut submit = lampyris(&["submit", "--engine", "slurm", "--dry-run"]);
        let said = expect(0, submit.arg(&dir).env("PATH", ""));
        said.lines().find(|line| line.contains("sbatch --array=") && !line.starts_with('#')).map(str::to_owned)
    };
    let put = |shards: std::ops::Range<u64>| {
        for shard in shards {
            fs::create_dir_all(dir.join("shards")).unwrap();
            fs::write(dir.join(checkpoint(shard)), &limited().tree.0[&checkpoint(shard)]).unwrap();
        }
    };
    let arrays = |said: Option<String>| said.map(|line| line.split(' ').nth(1).unwrap().to_owned());
    assert_eq!(arrays(submitted()).as_deref(), Some("--array=0-3"), "the first look is at 20 batches");
    put(0..3);
    assert_eq!(arrays(submitted()).as_deref(), Some("--array=3"));
    put(3..4);
    assert_eq!(arrays(submitted()).as_deref(), Some("--array=4-5"), "not reached: on to the look at 30");
    put(4..6);
    assert_eq!(arrays(submitted()), None, "reached");
    let said = expect(0, lampyris(&["submit", "--engine", "slurm", "--dry-run"]).arg(&dir).env("PATH", ""));
    assert!(said.starts_with("nothing to submit: no shard is missing"), "{said}");
    expect(0, lampyris(&["merge"]).arg(&dir));
    assert_stopped_at_thirty(&dir);
}

#[test]
fn kills_change_neither_the_look_nor_a_bit() {
    const HITS: usize = 6;
    let place = Place::new();
    let job = aiming(&place, second(), 1000);
    let mut draw = draws("goal");
    let (mut hits, mut round) = (0, 0);
    for _ in 0..200 {
        let dir = place.path(&round.to_string());
        let mut run = start(&mut run_quietly(&job, &dir, 2));
        sleep_until_drawn(&mut draw, 700);
        run.kill().unwrap();
        match run.wait().unwrap().code() {
            None => hits += 1,
            Some(code) => {
                assert_eq!(code, 0);
                assert_stopped_at_thirty(&dir);
                round += 1;
            }
        }
        if hits >= HITS {
            break;
        }
    }
    assert!(hits >= HITS, "only {hits} kills hit a live run");
    let dir = place.path(&round.to_string());
    expect(0, &mut run_quietly(&job, &dir, 2));
    assert_stopped_at_thirty(&dir);
    println!("{hits} kills hit; folder {round}");
}

#[test]
fn a_worker_that_ran_ahead_changes_nothing() {
    let place = Place::new();
    let dir = place.plan(&aiming(&place, second(), 45), "dir");
    // The last shard first; then all of them, in an order no coordinator would take.
    for shard in (0..9).rev() {
        expect(0, &mut work(&dir, shard));
        let code = if shard == 0 { 0 } else { 3 };
        let said = expect(code, lampyris(&["merge"]).arg(&dir));
        assert_eq!(said.contains("incomplete: batches 0-"), shard > 0, "{said}");
    }
    assert_stopped_at_thirty(&dir);
    assert_eq!(batches(&dir, 8), 5);
}

#[test]
fn folders_with_parts_of_the_shards_decide_together() {
    let place = Place::new();
    let job = aiming(&place, second(), 45);
    let [a, b] = ["a", "b"].map(|name| place.plan(&job, name));
    let put = |dir: &Path, shard: u64| {
        fs::create_dir_all(dir.join("shards")).unwrap();
        fs::write(dir.join(checkpoint(shard)), &limited().tree.0[&checkpoint(shard)]).unwrap();
    };
    [0, 2, 4, 7].iter().for_each(|&shard| put(&a, shard));
    [1, 3, 4].iter().for_each(|&shard| put(&b, shard));
    let merge = |folders: &[&Path], name: &str, code: i32| {
        let out = place.path(name);
        let said = expect(code, lampyris(&["merge"]).args(folders).arg("-o").arg(&out));
        (out, said)
    };
    // Four shards are a look, at which the goal is not reached; the sixth is missing.
    let (out, said) = merge(&[&a, &b], "some", 3);
    assert!(said.contains("incomplete: batches 25-34, 40-44 are missing"), "{said}");
    assert_eq!(summary(&out)["stopped_by"]["looks"].as_array().unwrap().len(), 1);
    let said = expect(0, lampyris(&["status"]).arg(&a));
    assert!(said.contains("\nnext look at 20 batches\n"), "{said}");
    put(&b, 5);
    for (folders, name) in [([&*a, &*b], "ab"), ([&*b, &*a], "ba")] {
        assert_stopped_at_thirty(&merge(&folders, name, 0).0);
    }
    // One of them alone lacks early shards: what there is, is merged, and nothing decided.
    let (out, said) = merge(&[&b], "alone", 3);
    assert!(said.contains("incomplete: batches 0-4, 10-14, 30-44 are missing"), "{said}");
    let by = &summary(&out)["stopped_by"];
    assert_eq!((&by["what"], &by["looks"]), (&json!("nothing"), &json!([])));
}

#[test]
fn a_goal_may_change_and_a_limit_rise() {
    let place = Place::new();
    let dir = place.path("dir");
    let [first, _, third] = widths();
    let stop = |half_width: f64, limit: u64| {
        let said = expect(0, &mut run_quietly(&aiming(&place, half_width, limit), &dir, 2));
        (summary(&dir)["batches"].as_u64().unwrap(), said.contains("nothing was left to do"))
    };
    assert_eq!(stop(second(), 35), (30, false));
    assert_stopped_at_thirty(&dir);
    // Tighter: it goes on, here to its limit, which is no look.
    assert_eq!(stop(third, 35), (35, false));
    assert_eq!(summary(&dir)["stopped_by"]["what"], "limit");
    let said = expect(0, lampyris(&["status"]).arg(&dir));
    assert!(said.contains("\ngoal not reached at 30 batches, no look left before the limit\n"), "{said}");
    // A higher limit, which is a look.
    assert_eq!(stop(third, 45), (45, false));
    assert_eq!(summary(&dir)["stopped_by"]["look"], 3);
    Bits::of(&dir).assert_same(&limited().bits);
    // Looser: fewer batches are used, nothing is computed.
    let before = Tree::of(&dir.join("shards"));
    assert_eq!(stop(first, 45), (20, true));
    Bits::of(&dir).assert_same(&planned_for(&place, 20));
    assert_eq!(stop(second(), 45), (30, true));
    assert_stopped_at_thirty(&dir);
    before.assert_unchanged(&dir.join("shards"), "a looser goal");
    // And none at all: every batch counts.
    let job = place.edited_job("fixed.toml", TYPED, "batches = 45\n");
    expect(0, &mut run_quietly(&job, &dir, 2));
    assert_eq!(summary(&dir)["stopped_by"], Value::Null);
    Bits::of(&dir).assert_same(&limited().bits);
}
