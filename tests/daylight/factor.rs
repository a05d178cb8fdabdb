//! The daylight factor in the report of the job that ships.

use std::fs;
use std::path::Path;
use std::process::Command;

#[test]
fn the_report_gives_daylight_factors_of_grids_and_points() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    fs::copy(root.join("scenes/office.glb"), folder.path().join("office.glb")).unwrap();
    let text = fs::read_to_string(root.join("jobs/daylight.toml")).unwrap().replace("../scenes/", "");
    // The shipped job with a thumbnail for its picture.
    let text = text.replace("batches = 64", "batches = 16").replace("width = 192", "width = 8");
    fs::write(folder.path().join("job.toml"), text.replace("height = 192", "height = 8")).unwrap();
    let mut run = Command::new(env!("CARGO_BIN_EXE_lampyris"));
    let output = run.args(["run", "job.toml", "-o", "out"]).current_dir(folder.path()).output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{said}");
    let lines: Vec<&str> = said.lines().filter(|line| line.contains("daylight factor")).collect();
    assert!(
        lines.len() == 2 && lines[0].contains("min") && lines.iter().all(|l| l.contains("10000 lx outdoors")),
        "{said}"
    );
    let summary = fs::read(folder.path().join("out/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
    let of = |set: usize| &summary["sets"][set];
    assert!(of(0)["daylight_factor"].is_null(), "a picture has none");
    let factor = &of(1)["daylight_factor"];
    assert_eq!(factor["outdoor_lx"].as_f64().map(f64::round), Some(10000.0));
    for (what, field) in [("mean", "value"), ("mean", "standard_error"), ("mean", "ci_lower"), ("min", "ci_upper")] {
        let (found, lux) = (&factor[what][field], &of(1)["derived"][what][field]);
        let ratio = found.as_f64().unwrap() / lux.as_f64().unwrap();
        assert!((ratio / 0.01 - 1.0).abs() < 1e-9, "{what} {field}: {found} {lux}");
    }
    let desk = of(2)["daylight_factor"]["mean"]["value"].as_f64().unwrap();
    assert!((desk - 0.01 * of(2)["mean"].as_f64().unwrap()).abs() < 1e-9 && desk > 1.0 && desk < 20.0, "{desk}");
}
