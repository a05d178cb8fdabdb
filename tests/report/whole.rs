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
    let SetResult::Moments { bins, .. } = &mut other.sets[1] else { panic!("eye keeps moments") };
    bins.mean[7] = f64::from_bits(bins.mean[7].to_bits() + 1);
    assert_ne!(digest(&other), first);
    let mut other = merged(20);
    other.flux.value[1] += 1e-12;
    assert_ne!(digest(&other), first);
}

#[test]
fn text_summary_is_short_and_names_what_matters() {
    let mut result = merged(4);
    result.missing.push(4..20);
    let text = report::text_summary(&plan(JOB), &result);
    println!("{text}");
    for part in ["small: 4 batches of 10 histories, seed 7 (incomplete)", "view", "median error", "emitted 12.0000"] {
        assert!(text.contains(part), "{part} is not in\n{text}");
    }
    for warning in ["range ignored", "incomplete: batches 4-19", "few batches: 4", "25.000 % of the emitted flux"] {
        assert!(text.contains(&format!("warning: {warning}")), "{warning} is not in\n{text}");
    }
}
