//! Regions, ratios, and what a summary says of a whole grid.

use super::*;

/// Two-sided 99 % Student quantile for 20 batches, from a printed table: 95 % for five points together.
const T19_OF_FIVE: f64 = 2.860934606;

const PARTS: &str = r#"
[[region]]
name = "left"
camera = "view"
rectangle = [0, 0, 1, 2]
[[region]]
name = "lamp"
camera = "view"
rectangle = [2, 1, 1, 1]
[[ratio]]
name = "left_over_desk"
numerator = "left"
denominator = "desk"
[[ratio]]
name = "left_over_lamp"
numerator = "left"
denominator = "lamp"
[[ratio]]
name = "itself"
numerator = "desk"
denominator = "desk"
"#;

/// The usual results, with the region `left` of mean 4 and scores one above and below in turn, and `lamp` that never
/// scored.
fn with_regions(n: u64) -> (Plan, Merged) {
    let mut result = merged(n);
    let (mut left, mut lamp) = (Replicates::new(1), Replicates::new(1));
    for batch in 0..n {
        left.accumulate(&[if batch % 2 == 0 { 5.0 } else { 3.0 }], &[0.5]);
        lamp.accumulate(&[0.0], &[0.0]);
    }
    result.sets.push(SetResult::Replicates { scores: left.into(), fixed_direct: Vec::new() });
    result.sets.push(SetResult::Replicates { scores: lamp.into(), fixed_direct: Vec::new() });
    result.monitors.resize(result.sets.len(), Vec::new());
    (plan(&format!("{JOB}{PARTS}")), result)
}

fn number(value: &serde_json::Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

#[test]
fn a_summary_says_mean_minimum_and_uniformity_of_a_grid_with_their_intervals() {
    let dir = written(&plan(JOB), &merged(20));
    let s = summary(dir.path());
    let desk = &s["sets"][2]["derived"];
    // Points of 11, 3, 4, 5, 6 lx, each one above and below in turn; all move together.
    assert_eq!((desk["points"].as_u64(), number(&desk["mean"]["value"])), (Some(5), 5.8));
    let se = (20.0f64 / (20.0 * 19.0)).sqrt();
    assert!(close(number(&desk["family_quantile"]), T19_OF_FIVE));
    assert!(close(number(&desk["mean"]["standard_error"]), se), "what is shared does not average out");
    assert!(close(number(&desk["mean"]["ci_upper"]), 5.8 + T19 * se));
    let min = &desk["min"];
    assert!(close(number(&min["value"]), 3.0) && min["standard_error"].is_null());
    assert!(close(number(&min["ci_lower"]), 3.0 - T19_OF_FIVE * se), "{min}");
    assert!(close(number(&min["ci_upper"]), 3.0 + T19_OF_FIVE * se), "{min}");
    let uo = &desk["uniformity"];
    assert!(close(number(&uo["value"]), 3.0 / 5.8));
    // d(E/mean) of a shared shift x is (1/mean - E/mean^2) x, up to the second order.
    let slope = 1.0 / 5.8 - 3.0 / (5.8 * 5.8);
    let half = 0.5 * (number(&uo["ci_upper"]) - number(&uo["ci_lower"]));
    assert!((half / (T19_OF_FIVE * slope * se) - 1.0).abs() < 0.01, "{uo}");
    for part in [&desk["mean"], min, uo] {
        assert!(part["how"].as_str().unwrap().len() > 20 && part["note"].is_null(), "{part}");
    }
    assert!(s["sets"][0]["derived"].is_null() && s["sets"][3]["derived"].is_null());
}

#[test]
fn grids_have_intervals_for_every_point_together() {
    let dir = written(&plan(JOB), &merged(20));
    let mut reader = csv::Reader::from_path(dir.path().join("desk.csv")).unwrap();
    let head = reader.headers().unwrap().clone();
    let place = |name: &str| head.iter().position(|h| h == name).unwrap();
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    let get = |row: usize, name: &str| rows[row][place(name)].parse::<f64>().unwrap();
    for row in [0, 2, 5] {
        let (value, se) = (get(row, "illuminance_lx"), get(row, "standard_error_lx"));
        assert!(close(get(row, "family_lower_lx"), value - T19_OF_FIVE * se));
        assert!(close(get(row, "family_upper_lx"), value + T19_OF_FIVE * se));
    }
    assert!(get(1, "family_lower_lx").is_nan(), "no receiver");
    // Intervals of every point need no batches, moments will do.
    let job = JOB.replace("rows = 2\n", "rows = 2\nkeep_batches = false\n");
    let mut result = merged(20);
    result.sets[2] = SetResult::Moments { bins: moments(6, 20, false).into(), fixed_direct: Vec::new() };
    let dir = written(&plan(&job), &result);
    let mut reader = csv::Reader::from_path(dir.path().join("desk.csv")).unwrap();
    let row = reader.records().next().unwrap().unwrap();
    assert!(row[place("family_upper_lx")].parse::<f64>().unwrap() > 1.0 + T19_OF_FIVE * 0.1);
    assert!(summary(dir.path())["sets"][2]["derived"].is_null());
}

#[test]
fn regions_have_a_table_and_an_interval_in_the_summary() {
    let (plan, result) = with_regions(20);
    let dir = written(&plan, &result);
    let text = std::fs::read_to_string(dir.path().join("regions.csv")).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let head = "name,camera,direct_cd_m2,luminance_cd_m2,standard_error_cd_m2,ci_lower_cd_m2,ci_upper_cd_m2,vov,note";
    assert_eq!((lines[0], lines.len()), (head, 3));
    let se = (20.0f64 / (20.0 * 19.0)).sqrt();
    let numbers: Vec<f64> = lines[1].split(',').filter_map(|x| x.parse().ok()).collect();
    assert!(lines[1].starts_with("left,view,0.5,") && lines[1].ends_with(','), "{}", lines[1]);
    for (read, expected) in numbers.iter().zip([0.5, 4.0, se, 4.0 - T19 * se, 4.0 + T19 * se, 0.0]) {
        assert!(close(*read, expected), "{read} instead of {expected}");
    }
    assert_eq!(lines[2], "lamp,view,0.0,0.0,NaN,NaN,NaN,NaN,no information");
    assert!(!dir.path().join("left.exr").exists() && !dir.path().join("left.csv").exists());
    let s = summary(dir.path());
    let left = &s["sets"][4];
    assert_eq!([&left["kind"], &left["unit"], &left["name"]], ["region", "cd/m2", "left"]);
    assert!(close(number(&left["interval"]["ci_lower"]), 4.0 - T19 * se));
    assert_eq!(s["sets"][5]["interval"]["note"], "no information");
}

#[test]
fn ratios_have_a_value_and_an_interval_or_say_why_not() {
    let (plan, result) = with_regions(20);
    let s = summary(written(&plan, &result).path());
    let [first, none, one] = [&s["ratios"][0], &s["ratios"][1], &s["ratios"][2]];
    assert_eq!([&first["name"], &first["numerator"], &first["denominator"]], ["left_over_desk", "left", "desk"]);
    assert!(close(number(&first["value"]), 4.0 / 5.8));
    // Both move by one in the same batches.
    let expected = (1.0 / 5.8 - 4.0 / (5.8 * 5.8)) * (20.0f64 / (20.0 * 19.0)).sqrt();
    assert!((number(&first["standard_error"]) / expected - 1.0).abs() < 0.01, "{first}");
    assert!(none["standard_error"].is_null() && none["note"] == "no information", "{none}");
    assert_eq!((number(&one["value"]), number(&one["standard_error"])), (1.0, 0.0));
    let (plan, result) = with_regions(1);
    let s = summary(written(&plan, &result).path());
    assert_eq!(s["ratios"][0]["note"], "an interval needs two batches");
}

#[test]
fn the_terminal_shows_a_line_for_each_grid_region_and_ratio() {
    let (plan, result) = with_regions(20);
    let text = super::text(&plan, &result);
    for line in [
        "  derived, intervals at 95 %:",
        "    desk: mean 5.800 +- 0.48 lx, min 3.000 (2.344 .. 3.656) lx, Uo 0.5172 (",
        "    left: mean 4.000 +- 0.48 cd/m2",
        "    lamp: mean 0 cd/m2 (no interval: no information)",
        "    left_over_desk: left / desk = 0.6897 +- 0.0",
        "    itself: desk / desk = 1.000 +- 0",
    ] {
        assert!(text.lines().any(|l| l.starts_with(line)), "{line}\n{text}");
    }
    let table = text.split("derived").next().unwrap();
    assert!(table.contains("meter") && !table.contains("left"), "a region has a line of its own: {text}");
}

#[test]
fn what_is_derived_has_the_marks_of_what_it_is_derived_from() {
    let (plan, result) = with_regions(10);
    let s = summary(written(&plan, &result).path());
    let desk = &s["sets"][2]["derived"];
    for quantity in [&desk["mean"], &desk["min"], &desk["uniformity"], &s["sets"][4]["interval"], &s["ratios"][0]] {
        assert_eq!(quantity["marks"][0], "few batches", "{quantity}");
    }
    assert!(text(&plan, &result).contains(" cd/m2 [marked: few batches"));
    // Half of the mean of the desk may come by a caustic: its interval is marked, and the ratio over it.
    let (mut plan, mut result) = with_regions(20);
    plan.scene.narrowest_lobe = 0.0;
    let SetResult::Replicates { scores, .. } = &mut result.sets[2] else { panic!("the desk keeps its batches") };
    let mut lit = scores.whole().unwrap();
    lit.caustic[0] = 15.0;
    *scores = lit.into();
    let s = summary(written(&plan, &result).path());
    let desk = &s["sets"][2]["derived"];
    let marks = |quantity: &serde_json::Value| quantity["marks"].to_string();
    for marked in [&desk["mean"], &desk["uniformity"], &s["ratios"][0], &s["ratios"][2]] {
        assert!(marks(marked).contains("caustic"), "{marked}");
    }
    assert!(!marks(&s["sets"][4]["interval"]).contains("caustic"), "the region has none");
}

#[test]
fn nothing_known_is_null_and_no_crash() {
    for n in [0, 1] {
        let (plan, result) = with_regions(n);
        let dir = written(&plan, &result);
        let desk = &summary(dir.path())["sets"][2]["derived"];
        for part in ["mean", "min", "uniformity"] {
            assert!(desk[part]["ci_lower"].is_null(), "{part} of {n} batches: {desk}");
            assert_eq!(desk[part]["note"], "an interval needs two batches");
        }
        assert!(text(&plan, &result).contains("(no interval: an interval needs two batches)"));
    }
}
