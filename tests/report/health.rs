//! Marks of intervals that should not be trusted, in every file, and the label of plain estimates.

use super::*;
use lampyris::math::pow;

/// A result of 64 batches whose map has bins with each mark a map can have.
fn suspicious() -> Merged {
    let mut result = merged(64);
    let mut bins = moments(6, 64, false);
    // Bin 0: relative error and peak; 1: peak; 2: no history reached it; 3: no receiver.
    bins.m2[0] = 0.05 * (64 * 63) as f64;
    (bins.mean[0], bins.peak[0], bins.peak[1], bins.peak[2]) = (1.0, 100.0, 100.0, 0.0);
    let fixed_direct = vec![0.0, 0.0, 0.0, f64::NAN, 0.0, 0.0];
    result.sets[0] = SetResult::Moments { bins: bins.into(), fixed_direct };
    result
}

fn warnings(dir: &Path) -> Vec<String> {
    let all = summary(dir)["warnings"].clone();
    all.as_array().unwrap().iter().map(|w| w.as_str().unwrap().to_owned()).collect()
}

#[test]
fn maps_hold_the_code_of_the_marks() {
    let dir = written(&plan(JOB), &suspicious());
    let image = exr::prelude::read_first_flat_layer_from_file(dir.path().join("view.exr")).unwrap();
    let list = &image.layer_data.channel_data.list;
    let health = list.iter().find(|c| c.name.eq("luminance.health")).unwrap();
    let code = |i| health.sample_data.value_by_flat_index(i).to_f32();
    assert_eq!([0, 1, 2, 4, 5].map(code), [12.0, 8.0, 1.0, 0.0, 0.0]);
    assert!(code(3).is_nan(), "no receiver");
}

#[test]
fn caustic_light_is_marked_where_it_could_spoil_the_interval() {
    let codes = |narrowest_lobe: f64| {
        let mut plan = plan(JOB);
        plan.scene.narrowest_lobe = narrowest_lobe;
        let mut result = merged(64);
        let mut bins = moments(6, 64, false);
        // Standard errors are 0.1: a tenth of the half-width is 0.02.
        (bins.caustic[0], bins.caustic[1]) = (0.019, 0.021);
        result.sets[0] = SetResult::Moments { bins: bins.into(), fixed_direct: Vec::new() };
        let dir = written(&plan, &result);
        summary(dir.path())["sets"][0]["marks"]["caustic"].as_u64().unwrap()
    };
    let histories = 64.0 * plan(JOB).job.run.histories_per_batch as f64;
    let known = (30.0 / histories).sqrt();
    assert_eq!([0.0, 0.99 * known, 1.01 * known].map(codes), [1, 1, 0], "a mirror, a narrow lobe, a wider one");
}

#[test]
fn marks_are_counted_and_said_in_a_line() {
    let dir = written(&plan(JOB), &suspicious());
    let view = &summary(dir.path())["sets"][0];
    assert_eq!([&view["unhealthy"], &view["inside"], &view["no_information"]], [3, 1, 1]);
    let marks =
        [("peak", 2), ("relative_error", 1), ("no_information", 1), ("few_batches", 0), ("tail", 0), ("vov", 0)];
    for (mark, count) in marks {
        assert_eq!(view["marks"][mark], count, "{mark}");
    }
    let line = "view: 3 of 5 intervals should not be trusted (1 no information, 1 relative error, 2 peak)";
    assert!(warnings(dir.path()).iter().any(|w| w == line), "{:?}", warnings(dir.path()));
    assert!(text(&plan(JOB), &suspicious()).contains(&format!("warning: {line}")));
    assert!(!warnings(dir.path()).iter().any(|w| w.starts_with("eye:")), "all is well there");
}

#[test]
fn a_variance_that_is_uncertain_is_noted_from_50_batches_on() {
    let note = |n: u64| {
        let mut result = merged(n);
        let mut scores = Replicates::new(6);
        // One batch of many is far off: VOV near 1.
        (0..n).for_each(|b| scores.accumulate(&[if b == 3 { 11.0 } else { 10.0 }; 6], &[0.25; 6]));
        result.sets[2] = SetResult::Replicates { scores: scores.into(), fixed_direct: Vec::new() };
        let dir = written(&plan(JOB), &result);
        let mut reader = csv::Reader::from_path(dir.path().join("desk.csv")).unwrap();
        reader.records().next().unwrap().unwrap()[17].to_owned()
    };
    assert_eq!([note(49), note(50)], ["", "vov"]);
}

#[test]
fn monitored_receivers_are_reported_one_by_one() {
    let dir = written(&plan(JOB), &merged(20));
    let meter = &summary(dir.path())["monitored"][0];
    assert_eq!([&meter["set"], &meter["marks"][0]], ["meter", "relative error"]);
    assert_eq!([&meter["column"], &meter["row"]], [0, 0]);
    assert_eq!(meter["largest"], 4.0);
    assert_eq!(meter["checks"].as_object().unwrap().len(), 10);
    // Scores 2 and 0 in turn: R sqrt(n) is the same at every snapshot, R itself is large.
    let check = |name: &str| meter["checks"][name].as_str().unwrap();
    assert_eq!(["error_small", "error_rate", "vov_small"].map(check), ["failed", "passed", "passed"]);
    let snapshots = meter["snapshots"].as_array().unwrap();
    assert_eq!(
        snapshots.iter().map(|s| s["batches"].as_u64().unwrap()).collect::<Vec<_>>(),
        (10..=20).collect::<Vec<_>>()
    );
    let last = snapshots.last().unwrap();
    let error = (20.0f64 / (20.0 * 19.0)).sqrt();
    assert!(close(last["mean"].as_f64().unwrap(), 1.0) && close(last["relative_error"].as_f64().unwrap(), error));
    let merit = last["figure_of_merit_per_history"].as_f64().unwrap();
    assert!((merit * error * error * 200.0 - 1.0).abs() < 1e-12);
    assert_eq!((&last["vov"], &last["histories"]), (&meter["vov"], &serde_json::json!(200)));
}

#[test]
fn a_slow_tail_of_a_lux_meter_is_marked_everywhere() {
    let mut result = merged(64);
    let mut steep = replicates(1, 64);
    steep.value.iter_mut().for_each(|v| *v = 1.0 + 0.01 * *v);
    result.sets[3] = SetResult::Replicates { scores: steep.into(), fixed_direct: Vec::new() };
    // Survival t^(-3/2): the totals of an edge pixel in the plain estimate.
    // Two dozen histories make up the variance: enough for the tail to matter, too many for a mark of their own.
    let mut monitor = Monitor::new(0);
    for batch in 0..64 {
        let totals = (0..10).map(|i| if i == 0 && batch % 3 == 0 { 5.0 } else { 1.0 }).collect();
        monitor.accumulate(1.0, &Watched { totals });
    }
    monitor.largest = (0..200).map(|i| pow((f64::from(i) + 0.5) / 200.0, -2.0 / 3.0)).collect();
    result.monitors[3] = vec![monitor];
    let dir = written(&plan(JOB), &result);
    let meter = &summary(dir.path())["monitored"][0];
    assert!((meter["slope"].as_f64().unwrap() - 2.5).abs() < 0.3, "{}", meter["slope"]);
    assert_eq!(meter["checks"]["tail_steep"], "failed");
    let text = std::fs::read_to_string(dir.path().join("points.csv")).unwrap();
    assert!(text.trim_end().ends_with(",tail"), "{text}");
    let lines = warnings(dir.path());
    assert!(lines.iter().any(|l| l == "points: 1 of 1 intervals should not be trusted (1 tail)"), "{lines:?}");
    let own =
        lines.iter().find(|l| l.starts_with("meter: its interval should not be trusted (tail; slope of the tail 2."));
    assert!(own.is_some_and(|l| l.contains("failed: ") && l.contains("tail_steep")), "{lines:?}");
}

#[test]
fn the_digest_of_the_results_covers_the_monitors() {
    let digest = |m: &Merged| summary(written(&plan(JOB), m).path())["results_digest"].clone();
    let mut other = merged(20);
    other.monitors[3][0].largest[0] += 1e-9;
    assert_ne!(digest(&other), digest(&merged(20)));
}

#[test]
fn a_plain_estimate_is_labelled_in_every_file() {
    let job = JOB.replace("[[gonio]]", "[transport]\nbounded = false\n[[gonio]]");
    let dir = written(&plan(&job), &merged(20));
    let label = "plain local estimate: intervals near edges do not hold";
    assert_eq!(summary(dir.path())["estimate"], label);
    assert!(warnings(dir.path()).iter().any(|w| w == label));
    let image = exr::prelude::read_first_flat_layer_from_file(dir.path().join("view.exr")).unwrap();
    let attribute = &image.layer_data.attributes.other[&exr::prelude::Text::from("estimate")];
    assert_eq!(attribute, &exr::prelude::AttributeValue::Text(exr::prelude::Text::from(label)));
    let text = std::fs::read_to_string(dir.path().join("desk.csv")).unwrap();
    let notes: Vec<&str> = text.lines().skip(1).map(|row| row.rsplit(',').next().unwrap()).collect();
    assert_eq!((notes[0], notes[1]), ("plain", "inside"));
    let job = JOB.replace("[[gonio]]", "[transport]\nestimator = \"reverse\"\n[[gonio]]");
    assert_eq!(summary(written(&plan(&job), &merged(20)).path())["estimate"], "reverse");
}
