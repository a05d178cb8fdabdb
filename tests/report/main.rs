//! What is written is what was counted: every file of a results folder is read back and compared with a tally made
//! by hand.

mod derived;
mod health;
mod maps;
mod tables;
mod whole;

use lampyris::farm::merge::goal::{Look, Stopped};
use lampyris::farm::merge::{Merged, SetResult};
use lampyris::farm::plan::{Input, Plan, SceneSummary};
use lampyris::job::Job;
use lampyris::report;
use lampyris::tally::{FLUX_BINS, MomentBlock, Monitor, Replicates, Watched};
use std::path::Path;

/// Two-sided 95 % Student quantile for 20 batches, from a printed table.
const T19: f64 = 2.093024054;
/// The same for 4 batches.
const T3: f64 = 3.182446305;

const JOB: &str = r#"
[run]
seed = 7
histories_per_batch = 10
batches = 20
sampling = "random"
[[camera]]
name = "view"
eye = [0.0, 0.0, 0.0]
target = [0.0, 0.0, -1.0]
vertical_fov_degrees = 60.0
width = 3
height = 2
[[gonio]]
name = "eye"
position = [0.0, 1.0, 0.0]
width = 4
height = 2
[[grid]]
name = "desk"
origin = [0.0, 0.8, 0.0]
u = [3.0, 0.0, 0.0]
v = [0.0, 0.0, -2.0]
normal = [0.0, 2.0, 0.0]
columns = 3
rows = 2
[[point]]
name = "meter"
position = [0.1, 0.2, 0.3]
normal = [0.0, 3.0, 4.0]
[[source]]
kind = "omni"
position = [0.0, 2.0, 0.0]
intensity = 1.0
"#;

fn plan(job: &str) -> Plan {
    let input = |name: &str, digest: &str| Input { name: name.into(), digest: digest.into(), bytes: 1 };
    Plan {
        program: "0.1.0".into(),
        numerics: 1,
        name: "small".into(),
        digest: "abc123".into(),
        inputs: vec![input("röom.glb", "d1"), input("room.bin", "d2")],
        job_file: input("small.toml", "d3"),
        scene: SceneSummary {
            triangles: 0,
            sources: 1,
            flux_lm: 12.0,
            bytes: 0,
            narrowest_lobe: 1.0,
            warnings: vec!["range ignored".into()],
        },
        bounds: Vec::new(),
        job: Job::parse(job, "small.toml").unwrap(),
    }
}

/// Moments of `bins` bins: means 1, 2, 3, ..., each with standard error 0.1 over `n` batches.
fn moments(bins: usize, n: u64, colour: bool) -> MomentBlock {
    let mut block = MomentBlock::new(bins, colour);
    for i in 0..bins {
        block.mean[i] = (i + 1) as f64;
        block.m2[i] = 0.01 * (n * n.saturating_sub(1)) as f64;
        block.direct[i] = 0.25;
        block.peak[i] = 5.0;
        block.existed[i] = n;
    }
    block
}

/// Batch scores of `bins` bins: bin i has the mean i + 1 and scores one above and one below it, in turn; a quarter
/// of it is direct.
fn replicates(bins: usize, n: u64) -> Replicates {
    let mut scores = Replicates::new(bins);
    for batch in 0..n {
        let sign = if batch % 2 == 0 { 1.0 } else { -1.0 };
        let value: Vec<f64> = (0..bins).map(|i| (i + 1) as f64 + sign).collect();
        scores.accumulate(&value, &vec![0.25; bins]);
    }
    scores
}

/// The lux-meter, watched: ten histories a batch that make up its score.
fn monitor(n: u64) -> Monitor {
    let mut monitor = Monitor::new(0);
    for batch in 0..n {
        let score = if batch % 2 == 0 { 2.0 } else { 0.0 };
        monitor.accumulate(score, &Watched { totals: (0..10).map(|i| score * f64::from(i) / 4.5).collect() });
    }
    monitor
}

/// 12 lm emitted in every batch, 9 and 11 absorbed in turn, 2 escaped, nothing lost, 3 that met a mirror.
fn flux(n: u64) -> Replicates {
    let mut flux = Replicates::new(FLUX_BINS.len());
    for batch in 0..n {
        let absorbed = if batch % 2 == 0 { 9.0 } else { 11.0 };
        flux.accumulate(&[12.0, absorbed, 2.0, 0.0, 3.0], &[0.0; 5]);
    }
    flux
}

fn merged(n: u64) -> Merged {
    let fixed = vec![10.0, f64::NAN, 0.0, 0.0, 0.0, 0.0];
    Merged {
        sets: vec![
            SetResult::Moments { bins: moments(6, n, false).into(), fixed_direct: Vec::new() },
            SetResult::Moments { bins: moments(8, n, false).into(), fixed_direct: Vec::new() },
            SetResult::Replicates { scores: replicates(6, n).into(), fixed_direct: fixed },
            SetResult::Replicates { scores: replicates(1, n).into(), fixed_direct: Vec::new() },
        ],
        monitors: vec![Vec::new(), Vec::new(), Vec::new(), vec![monitor(n)]],
        flux: flux(n).into(),
        batches: n,
        missing: Vec::new(),
        stopped: None,
        looks: Vec::new(),
        seconds: 4.0,
        instructions: vec!["avx2".into()],
    }
}

/// Writes the report of `merged` into a new folder.
fn written(plan: &Plan, merged: &Merged) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    report::write(plan, merged, dir.path()).unwrap();
    dir
}

/// The summary as a terminal shows it.
fn text(plan: &Plan, merged: &Merged) -> String {
    let dir = tempfile::tempdir().unwrap();
    report::write(plan, merged, dir.path()).unwrap()
}

fn close(a: impl Into<f64>, b: f64) -> bool {
    let a = a.into();
    (a - b).abs() <= 1e-6 * b.abs().max(1.0) || (a.is_nan() && b.is_nan())
}

fn summary(dir: &Path) -> serde_json::Value {
    serde_json::from_str(&std::fs::read_to_string(dir.join("summary.json")).unwrap()).unwrap()
}

fn read_png(path: &Path) -> ([u32; 2], Vec<u8>) {
    let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut rgb).unwrap();
    assert_eq!(info.color_type, png::ColorType::Rgb);
    ([info.width, info.height], rgb)
}

#[test]
fn a_folder_holds_these_files_and_no_leftovers() {
    let dir = written(&plan(JOB), &merged(20));
    let mut names: Vec<String> =
        std::fs::read_dir(&dir).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    let expected = ["desk.csv", "desk.png", "eye.exr", "eye.png", "points.csv", "summary.json", "view.exr", "view.png"];
    assert_eq!(names, expected);
    // Written again, every file is replaced.
    report::write(&plan(JOB), &merged(20), dir.path()).unwrap();
    assert_eq!(std::fs::read_dir(&dir).unwrap().count(), expected.len());
}

#[test]
fn pictures_show_each_bin_in_the_colour_of_its_scale() {
    let dir = written(&plan(JOB), &merged(20));
    let ([width, height], rgb) = read_png(&dir.path().join("desk.png"));
    assert!((600..1500).contains(&width) && (350..600).contains(&height), "{width} x {height}");
    let pixel = |x: u32, y: u32| {
        let at = ((y * width + x) * 3) as usize;
        [rgb[at], rgb[at + 1], rgb[at + 2]]
    };
    // Cells of 1 x 1 m, 133 pixels each, on a linear scale from 0 to 12 lx.
    let cell = |column: u32, row: u32| {
        pixel(report::MAP_ORIGIN[0] + column * 133 + 60, report::MAP_ORIGIN[1] + row * 133 + 60)
    };
    let inferno = |value: f64| colorous::INFERNO.eval_continuous(value / 12.0).as_array();
    assert_eq!(cell(0, 0), inferno(11.0));
    assert_eq!(cell(1, 0), [160; 3], "a point inside a solid is grey");
    assert_eq!([cell(2, 0), cell(0, 1), cell(2, 1)], [3.0, 4.0, 6.0].map(inferno));
    assert_eq!(pixel(0, 0), [255; 3]);
    // The frame lies just outside.
    assert_eq!(pixel(report::MAP_ORIGIN[0] - 1, report::MAP_ORIGIN[1] + 5), [0; 3]);
    assert_eq!(pixel(report::MAP_ORIGIN[0] + 3 * 133, report::MAP_ORIGIN[1] + 5), [0; 3]);
}
