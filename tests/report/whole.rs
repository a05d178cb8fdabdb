//! The summary, for machines and for eyes.

use super::*;

#[test]
fn summary_holds_sets_balance_and_digest() {
    let dir = written(&plan(JOB), &merged(20));
    let s = summary(dir.path());
    assert_eq!([&s["name"], &s["plan_digest"], &s["inputs"][1]["digest"]], ["small", "abc123", "d2"]);
    assert_eq!([&s["batches"], &s["histories"], &s["seed"]], [20, 200, 7]);
    assert_eq!((s["complete"].as_bool(), s["confidence"].as_f64()), (Some(true), Some(0.95)));
    let names: Vec<_> = s["sets"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["view", "eye", "desk", "meter"]);
    let view = &s["sets"][0];
    assert_eq!([&view["kind"], &view["unit"]], ["camera", "cd/m2"]);
    assert_eq!((view["mean"].as_f64(), view["bins"].as_u64()), (Some(3.5), Some(6)));
    let squares: f64 = (1..=6).map(|m| (0.1 / f64::from(m)) * (0.1 / f64::from(m))).sum();
    assert!(close(view["figure_of_merit"].as_f64().unwrap(), 1.0 / (squares / 6.0 * 4.0)));
    assert!(close(view["worst_relative_error"].as_f64().unwrap(), 0.1));
    let desk = &s["sets"][2];
    assert_eq!([&desk["inside"], &desk["bins"]], [1, 6]);
    assert_eq!(desk["max"], 11.0);

    let flux = &s["flux_lm"];
    assert_eq!((flux["emitted"]["mean"].as_f64(), flux["met_delta_share"].as_f64()), (Some(12.0), Some(0.25)));
    assert!(close(flux["difference"]["mean"].as_f64().unwrap(), 0.0));
    let se = (20.0f64 / (20.0 * 19.0)).sqrt();
    assert!(close(flux["difference"]["standard_error"].as_f64().unwrap(), se));
    assert!(close(flux["difference"]["ci_upper"].as_f64().unwrap(), se * T19));
    assert!(flux["lost"]["standard_error"].is_null(), "never scored: no information");
    assert!(flux["met_delta_meaning"].as_str().unwrap().starts_with("25.000 %"));
    assert_eq!(s["timings"]["histories_per_second"], 50.0);
    assert_eq!(s["warnings"][0], "range ignored");
    assert_eq!(s["results_digest"].as_str().unwrap().len(), 64);
}

#[test]
fn summary_of_nothing_is_null_not_a_crash() {
    let dir = written(&plan(JOB), &merged(0));
    let s = summary(dir.path());
    assert!(s["sets"][0]["mean"].is_null() && s["flux_lm"]["emitted"]["mean"].is_null());
    assert!(s["warnings"].as_array().unwrap().iter().any(|w| w.as_str().unwrap().starts_with("few batches: 0")));
}

#[test]
fn digest_follows_numbers_and_not_the_clock() {
    let digest = |m: &Merged| summary(written(&plan(JOB), m).path())["results_digest"].clone();
    let first = digest(&merged(20));
    let mut slow = merged(20);
    slow.seconds = 400.0;
    assert_eq!(digest(&slow), first);
    let mut other = merged(20);
    let mut bins = moments(8, 20, false);
    bins.mean[7] = f64::from_bits(bins.mean[7].to_bits() + 1);
    other.sets[1] = SetResult::Moments { bins: bins.into(), fixed_direct: Vec::new() };
    assert_ne!(digest(&other), first);
    let mut other = merged(20);
    let mut flux = other.flux.whole().unwrap();
    flux.value[1] += 1e-12;
    other.flux = flux.into();
    assert_ne!(digest(&other), first);
}

#[test]
fn text_summary_is_short_and_names_what_matters() {
    let mut result = merged(4);
    result.missing.push(4..20);
    let text = super::text(&plan(JOB), &result);
    println!("{text}");
    for part in ["small: 4 batches of 10 histories, seed 7 (incomplete)", "view", "median error", "emitted 12.0000"] {
        assert!(text.contains(part), "{part} is not in\n{text}");
    }
    for warning in ["range ignored", "incomplete: batches 4-19", "few batches: 4", "25.000 % of the emitted flux"] {
        assert!(text.contains(&format!("warning: {warning}")), "{warning} is not in\n{text}");
    }
}

/// The job with a goal: 1 % at 90 % of the bins of two sets.
fn aiming(limit: u64) -> Plan {
    let stop = format!(
        "[stop]\nrelative_half_width = 0.01\nreceivers = [\"desk\", \"meter\"]\nshare = 0.9\n\
         max_batches = {limit}\n[[camera]]"
    );
    let mut plan = plan(&JOB.replace("batches = 20\n", "").replacen("[[camera]]", &stop, 1));
    plan.scene.warnings.clear();
    plan
}

#[test]
fn what_ended_a_run_with_a_goal_is_said() {
    let look = |batches: u64, relative_half_width: f64, reached: bool| {
        let set = "desk".to_owned();
        Look { batches, relative_half_width, set, reached }
    };
    let mut result = merged(96);
    result.looks = vec![look(32, f64::INFINITY, false), look(64, 0.0156789, false), look(96, 0.0099, true)];
    result.stopped = Some(Stopped::GoalReached { batches: 96 });
    let s = summary(written(&aiming(1000), &result).path());
    let by = &s["stopped_by"];
    assert_eq!((&by["what"], &by["batches"], &by["look"]), (&"goal".into(), &96.into(), &3.into()));
    assert_eq!(
        (&by["relative_half_width"], &by["share"], &by["max_batches"]),
        (&0.01.into(), &0.9.into(), &1000.into())
    );
    assert!(by["looks"][0]["relative_half_width"].is_null(), "no information is no number");
    assert_eq!((&by["looks"][1]["batches"], &by["looks"][1]["set"]), (&64.into(), &"desk".into()));
    let text = super::text(&aiming(1000), &result);
    let line = "\nstopped at 96 batches (look 3): the 95 % interval of desk, meter is within 1 % in 90 % of the bins\n";
    assert!(text.contains(line) && !text.contains("limit"), "{text}");

    result.looks.pop();
    result.stopped = Some(Stopped::Limit);
    let text = super::text(&aiming(96), &result);
    assert!(text.contains("\nnot stopped by its goal: 96 of at most 96 batches\n"), "{text}");
    let warning = "warning: the limit of 96 batches came before the goal that the 95 % interval of desk, meter is within \
                   1 % in 90 % of the bins; at the last look, 64 batches, desk stood at 1.57 %\n";
    assert!(text.contains(warning), "{text}");
    result.looks.pop();
    let text = super::text(&aiming(96), &result);
    assert!(text.contains("; at the last look, 32 batches, too many bins of desk had no information\n"), "{text}");

    result.stopped = None;
    result.missing.push(96..1000);
    let (text, plan) = (super::text(&aiming(1000), &result), aiming(1000));
    assert!(text.contains("96 of at most 1000 batches") && !text.contains("limit"), "{text}");
    assert_eq!(summary(written(&plan, &result).path())["stopped_by"]["what"], "nothing");
    assert!(summary(written(&self::plan(JOB), &merged(20)).path())["stopped_by"].is_null(), "no goal");
}
