//! What is written is what was counted: every file of a results folder is read back and compared with a tally made
//! by hand.

use exr::prelude::{AnyChannels, AttributeValue, FlatSamples, Image, Layer, Text};
use lampyris::farm::merge::{Merged, SetResult};
use lampyris::farm::plan::{Input, Plan, SceneSummary};
use lampyris::job::Job;
use lampyris::report;
use lampyris::tally::{FLUX_BINS, MomentBlock, Replicates};
use std::path::Path;

/// Two-sided 95 % Student quantiles for 20, 2 and 4 batches, from a printed table.
const T19: f64 = 2.093024054;
const T3: f64 = 3.182446305;

const JOB: &str = r#"
[run]
seed = 7
histories_per_batch = 10
batches = 20
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
            warnings: vec!["range ignored".into()],
        },
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
            SetResult::Moments { bins: moments(6, n, false), fixed_direct: Vec::new() },
            SetResult::Moments { bins: moments(8, n, false), fixed_direct: Vec::new() },
            SetResult::Replicates { scores: replicates(6, n), fixed_direct: fixed },
            SetResult::Replicates { scores: replicates(1, n), fixed_direct: Vec::new() },
        ],
        flux: flux(n),
        batches: n,
        missing: Vec::new(),
        seconds: 4.0,
    }
}

/// Writes the report of `merged` into a new folder.
fn written(plan: &Plan, merged: &Merged) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    report::write(plan, merged, dir.path()).unwrap();
    dir
}

type Exr = Image<Layer<AnyChannels<FlatSamples>>>;

fn read_exr(path: &Path) -> Exr {
    exr::prelude::read_first_flat_layer_from_file(path).unwrap()
}

fn channel(image: &Exr, name: &str) -> Vec<f32> {
    let list = &image.layer_data.channel_data.list;
    let channel = list.iter().find(|c| c.name.eq(name)).unwrap_or_else(|| panic!("no channel {name}"));
    match &channel.sample_data {
        FlatSamples::F32(samples) => samples.clone(),
        _ => panic!("{name} is not 32-bit float"),
    }
}

fn close(a: impl Into<f64>, b: f64) -> bool {
    let a = a.into();
    (a - b).abs() <= 1e-6 * b.abs().max(1.0) || (a.is_nan() && b.is_nan())
}

fn rows(path: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let head = reader.headers().unwrap().iter().map(str::to_owned).collect();
    let rows = reader.records().map(|r| r.unwrap().iter().map(str::to_owned).collect()).collect();
    (head, rows)
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
fn exr_channels_hold_value_error_interval_peak_and_direct() {
    let dir = written(&plan(JOB), &merged(20));
    let image = read_exr(&dir.path().join("view.exr"));
    let sorted = |i: &Exr| i.layer_data.channel_data.list.iter().map(|c| c.name.to_string()).collect::<Vec<_>>();
    assert_eq!(
        sorted(&image),
        [
            "B",
            "G",
            "R",
            "direct.Y",
            "luminance.Y",
            "luminance.ciLower",
            "luminance.ciUpper",
            "luminance.peak",
            "luminance.standardError",
            "luminance.variance"
        ]
    );
    let y = channel(&image, "luminance.Y");
    // Row 0 is on top: the first three samples of the file are bins 0, 1, 2.
    assert_eq!(y, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    for grey in ["R", "G", "B"] {
        assert_eq!(channel(&image, grey), y);
    }
    let named = ["variance", "standardError", "ciLower", "ciUpper", "peak"];
    let read = named.map(|n| channel(&image, &format!("luminance.{n}")));
    for i in 0..6 {
        let mean = (i + 1) as f64;
        let expected = [0.01, 0.1, mean - 0.1 * T19, mean + 0.1 * T19, 5.0 / ((mean - 0.25) * 200.0)];
        for (name, (channel, expected)) in named.iter().zip(read.iter().zip(expected)) {
            assert!(close(channel[i], expected), "{name} of {i}: {} instead of {expected}", channel[i]);
        }
    }
    assert!(channel(&image, "direct.Y").iter().all(|&x| x == 0.25));
}

#[test]
fn exr_header_says_what_the_numbers_are() {
    let mut result = merged(20);
    result.missing = vec![4..8, 24..32];
    let dir = written(&plan(JOB), &result);
    let image = read_exr(&dir.path().join("eye.exr"));
    let layer = &image.layer_data;
    assert_eq!((layer.size.0, layer.size.1), (4, 2));
    assert_eq!(layer.encoding.compression, exr::prelude::Compression::ZIP16);
    assert_eq!(layer.encoding.blocks, exr::image::Blocks::ScanLines);
    assert_eq!(layer.encoding.line_order, exr::prelude::LineOrder::Increasing);
    assert_eq!(layer.attributes.white_luminance, Some(1.0));
    assert_eq!(image.attributes.chromaticities.unwrap().white.0, 0.3127);
    let attribute = |name: &str| &layer.attributes.other[&Text::from(name)];
    let expected = [
        ("units", "cd/m2"),
        ("batches", "20"),
        ("historiesPerBatch", "10"),
        ("histories", "200"),
        ("seed", "7"),
        ("planDigest", "abc123"),
        ("jobDigest", "d3"),
        ("inputDigests", "d1 r?om.glb; d2 room.bin"),
        ("programVersion", "0.1.0"),
        ("complete", "false"),
        ("missingBatches", "4-8, 24-32"),
    ];
    for (name, text) in expected {
        assert_eq!(attribute(name), &AttributeValue::Text(Text::from(text)), "{name}");
    }
    assert_eq!(attribute("confidence"), &AttributeValue::F64(0.95));
}

#[test]
fn exr_colours_are_the_means_of_r_g_b() {
    let job = JOB.replace("seed = 7", "seed = 7\nchannels = \"rgb\"");
    let mut result = merged(20);
    let mut bins = moments(6, 20, true);
    bins.colour[4] = [3.0, 2.0, 1.0];
    result.sets[0] = SetResult::Moments { bins, fixed_direct: vec![0.5; 6] };
    result.sets[1] = SetResult::Moments { bins: moments(8, 20, true), fixed_direct: Vec::new() };
    let dir = written(&plan(&job), &result);
    let image = read_exr(&dir.path().join("view.exr"));
    assert_eq!(["R", "G", "B"].map(|c| channel(&image, c)[4]), [3.5, 2.5, 1.5]);
    assert_eq!(channel(&image, "luminance.Y")[4], 5.5);
    assert_eq!(channel(&image, "direct.Y")[4], 0.75);
}

#[test]
fn exr_of_one_batch_has_no_error_and_of_none_no_number() {
    for n in [0, 1] {
        let dir = written(&plan(JOB), &merged(n));
        let image = read_exr(&dir.path().join("view.exr"));
        assert!(close(channel(&image, "luminance.Y")[2], if n == 0 { f64::NAN } else { 3.0 }));
        for name in ["luminance.variance", "luminance.standardError", "luminance.ciLower", "luminance.ciUpper"] {
            assert!(channel(&image, name).iter().all(|x| x.is_nan()), "{name} of {n} batches");
        }
        assert_eq!(channel(&image, "luminance.peak")[0].is_nan(), n == 0);
    }
}

#[test]
fn exr_tells_no_information_from_exact_and_from_no_receiver() {
    let mut result = merged(20);
    let mut bins = moments(6, 20, false);
    // Never scored; known exactly; no receiver.
    for i in 0..3 {
        (bins.mean[i], bins.m2[i], bins.direct[i], bins.peak[i]) = (0.0, 0.0, 0.0, 0.0);
    }
    (bins.mean[1], bins.direct[1], bins.existed[1]) = (4.0, 4.0, 0);
    let fixed_direct = vec![0.0, 0.0, f64::NAN, 0.0, 0.0, 0.0];
    result.sets[0] = SetResult::Moments { bins, fixed_direct };
    let dir = written(&plan(JOB), &result);
    let image = read_exr(&dir.path().join("view.exr"));
    let get = |name: &str| channel(&image, name);
    assert_eq!(get("luminance.Y")[..2], [0.0, 4.0]);
    assert!(get("luminance.standardError")[0].is_nan() && get("luminance.ciUpper")[0].is_nan());
    assert_eq!((get("luminance.standardError")[1], get("luminance.ciUpper")[1]), (0.0, 4.0));
    assert!(get("luminance.peak")[1].is_nan());
    for c in &image.layer_data.channel_data.list {
        assert!(c.sample_data.value_by_flat_index(2).to_f32().is_nan(), "{}", c.name);
    }
    let set = &summary(dir.path())["sets"][0];
    assert_eq!([&set["no_information"], &set["exact"], &set["inside"]], [1, 1, 1]);
    assert_eq!(set["mean"], (0.0 + 4.0 + 4.0 + 5.0 + 6.0) / 5.0);
    assert_eq!((set["min"].as_f64(), set["max"].as_f64()), (Some(0.0), Some(6.0)));
    assert!(close(set["worst_relative_error"].as_f64().unwrap(), 0.1 / 4.0));
}

#[test]
fn grid_rows_hold_place_numbers_and_note() {
    let dir = written(&plan(JOB), &merged(4));
    let (head, rows) = rows(&dir.path().join("desk.csv"));
    let header = "index,column,row,x_m,y_m,z_m,nx,ny,nz,direct_lx,illuminance_lx,standard_error_lx,\
                  ci_lower_lx,ci_upper_lx,vov,note";
    assert_eq!(head.join(","), header);
    assert_eq!(rows.len(), 6);
    // Scores of bin 0: 2, 0, 2, 0 and 10 lx that are the same in every batch.
    let se = (4.0f64 / (4.0 * 3.0)).sqrt();
    assert_eq!(rows[0][..11], ["0", "0", "0", "0.5", "0.8", "-0.5", "0.0", "1.0", "0.0", "10.25", "11.0"]);
    let numbers: Vec<f64> = rows[0][11..15].iter().map(|x| x.parse().unwrap()).collect();
    // Of two values in turn M4/M2^2 = 1/n, so that the variance of the variance is zero.
    for (read, expected) in numbers.iter().zip([se, 11.0 - T3 * se, 11.0 + T3 * se, 0.0]) {
        assert!(close(*read, expected), "{read} instead of {expected}");
    }
    assert_eq!(numbers[0], se, "every digit is printed");
    assert_eq!(rows[0][15], "few batches");
    assert_eq!(rows[1][9..], ["NaN", "NaN", "NaN", "NaN", "NaN", "NaN", "inside"]);
    assert_eq!(rows[5][..6], ["5", "2", "1", "2.5", "0.8", "-1.5"]);
}

#[test]
fn grid_notes_say_no_information_and_incomplete() {
    let mut result = merged(20);
    let mut scores = Replicates::new(6);
    (0..20).for_each(|_| scores.accumulate(&[0.0; 6], &[0.0; 6]));
    result.sets[2] = SetResult::Replicates { scores, fixed_direct: vec![7.0; 6] };
    result.missing.push(20..24);
    let dir = written(&plan(JOB), &result);
    let (_, rows) = rows(&dir.path().join("desk.csv"));
    assert_eq!(rows[3][9..], ["7.0", "7.0", "NaN", "NaN", "NaN", "NaN", "no information; incomplete"]);
    let dir = written(&plan(JOB), &merged(0));
    let (_, rows) = self::rows(&dir.path().join("desk.csv"));
    assert_eq!(rows[0][9..], ["NaN", "NaN", "NaN", "NaN", "NaN", "NaN", "no information; few batches"]);
    assert_eq!(rows[1][15], "inside");
    let dir = written(&plan(JOB), &merged(1));
    let (_, rows) = self::rows(&dir.path().join("desk.csv"));
    assert_eq!(rows[0][9..], ["10.25", "12.0", "NaN", "NaN", "NaN", "NaN", "few batches"]);
}

#[test]
fn grid_kept_as_moments_has_no_variance_of_variance() {
    let job = JOB.replace("rows = 2\n", "rows = 2\nkeep_batches = false\n");
    let mut result = merged(20);
    result.sets[2] = SetResult::Moments { bins: moments(6, 20, false), fixed_direct: vec![1.0; 6] };
    let dir = written(&plan(&job), &result);
    let (_, rows) = rows(&dir.path().join("desk.csv"));
    assert_eq!([&rows[0][9], &rows[0][10], &rows[0][14], &rows[0][15]], ["1.25", "2.0", "NaN", ""]);
}

#[test]
fn points_share_one_table_with_their_names() {
    let dir = written(&plan(JOB), &merged(20));
    let (head, rows) = rows(&dir.path().join("points.csv"));
    assert_eq!(head[..4], ["name", "index", "column", "row"]);
    assert_eq!(rows.len(), 1);
    let place = ["meter", "0", "0", "0", "0.1", "0.2", "0.3", "0.0", "0.6000000000000001", "0.8", "0.25", "1.0"];
    assert_eq!(rows[0][..12], place);
    assert_eq!(rows[0][16], "");
}

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

#[test]
fn text_summary_is_short_and_names_what_matters() {
    let mut result = merged(4);
    result.missing.push(4..20);
    let text = report::text_summary(&plan(JOB), &result);
    println!("{text}");
    for part in ["small: 4 batches of 10 histories, seed 7 (incomplete)", "view", "median error", "emitted 12.0000"] {
        assert!(text.contains(part), "{part} is not in\n{text}");
    }
    for warning in ["range ignored", "incomplete: batches 4-20", "few batches: 4", "25.000 % of the emitted flux"] {
        assert!(text.contains(&format!("warning: {warning}")), "{warning} is not in\n{text}");
    }
}
