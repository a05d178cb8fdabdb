//! Regions of a luminance map: which pixels they are, and that their number is the mean of these, batch by batch.

mod common;
#[allow(dead_code, reason = "each test binary uses its own part")]
#[path = "common/gltf_builder.rs"]
mod gltf_builder;

use common::scenes::sobolev;
use common::{Case, Estimate};
use gltf_builder::Builder;
use lampyris::farm::inputs::prepare;
use lampyris::farm::pilot::bounds;
use lampyris::farm::realization::Realization;
use lampyris::job::Job;
use lampyris::scene::{Model, Scene, gltf};
use lampyris::tally::derived::Family;
use lampyris::tally::{BatchScores, Replicates, SetTally, Tally};
use serde_json::json;

/// A floor of 2 x 2 m at height 0; at 0.5 m a table, of a top 0.75 m wide and 1.5 m deep and a shelf half as wide
/// beside it, each at its own node below `Table`, itself below `Room`. Below the floor a cellar,
/// above the eye a ceiling that throws light back.
fn furnished() -> Builder {
    let mut b = Builder::new();
    // A unit square in x and z that faces up.
    let square =
        b.mesh(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, -1.0], [0.0, 0.0, -1.0]], Some(&[0, 1, 2, 0, 2, 3]));
    b.push(
        "/materials",
        json!({ "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.5, 0.5, 1.0],
        "metallicFactor": 0.0, "roughnessFactor": 1.0 } }),
    );
    b.json["meshes"][square]["primitives"][0]["material"] = json!(0);
    b.light(json!({ "type": "point", "intensity": 10.0 }));
    b.node(json!({ "name": "Room", "children": [1, 2, 5, 6, 7] }));
    b.node(json!({ "name": "Floor", "mesh": square, "translation": [-1.0, 0.0, 1.0], "scale": [2.0, 1.0, 2.0] }));
    b.node(json!({ "name": "Table", "children": [3, 4], "translation": [0.0, 0.5, 0.0] }));
    b.node(json!({ "name": "Top", "mesh": square, "translation": [-0.75, 0.0, 0.75], "scale": [0.75, 1.0, 1.5] }));
    b.node(json!({ "name": "Shelf", "mesh": square, "translation": [0.0, 0.0, 0.75], "scale": [0.375, 1.0, 1.5] }));
    b.node(json!({ "name": "Cellar", "mesh": square, "translation": [0.0, -1.0, 0.0] }));
    b.node(json!({ "translation": [0.2, 1.4, 0.1], "extensions": { "KHR_lights_punctual": { "light": 0 } } }));
    b.node(json!({ "name": "Ceiling", "mesh": square, "translation": [-2.0, 2.5, -2.0],
        "rotation": [1.0, 0.0, 0.0, 0.0], "scale": [4.0, 1.0, 4.0] }));
    b.json["scenes"] = json!([{ "nodes": [0] }]);
    b
}

fn model(builder: &Builder) -> Model {
    gltf::load("room.glb", &builder.glb(), &mut |uri| panic!("{uri} is not wanted")).unwrap()
}

/// Straight down from 2 m: 3 x 3 m in 8 x 8 pixels at the height of the table.
const VIEW: &str = r#"
[run]
histories_per_batch = 32
batches = 16
sampling = "random"
[[camera]]
name = "view"
eye = [0, 2, 0]
target = [0, 0, 0]
up = [0, 0, -1]
vertical_fov_degrees = 90
width = 8
height = 8
pixel_samples = 16
"#;

fn region(name: &str, what: &str) -> String {
    format!("[[region]]\nname = \"{name}\"\ncamera = \"view\"\n{what}\n")
}

fn by_node(name: &str) -> String {
    region(name, &format!("node = \"{name}\""))
}

fn value(batch: &BatchScores, set: usize) -> [u64; 2] {
    [batch.sets[set].value[0].to_bits(), batch.sets[set].direct[0].to_bits()]
}

#[test]
fn a_node_is_the_pixels_that_show_it_or_what_hangs_below() {
    let regions = ["Top", "Shelf", "Table"].map(by_node).concat()
        + &region("top", "rectangle = [2, 2, 2, 4]")
        + &region("shelf", "rectangle = [4, 2, 1, 4]")
        + &region("table", "rectangle = [2, 2, 3, 4]");
    let regions = regions.replace("name = \"top\"", "name = \"a\"").replace("name = \"shelf\"", "name = \"b\"");
    let regions = regions.replace("name = \"table\"", "name = \"c\"");
    let case = Case::new(&format!("{VIEW}{regions}"), model(&furnished()));
    let (fixed, batches) = case.batches(1..u32::MAX);
    assert_eq!((fixed.len(), batches[0].sets.len()), (7, 7));
    for batch in &batches {
        for set in 1..4 {
            assert_eq!(value(batch, set), value(batch, set + 3), "set {set}");
        }
        assert!(batch.sets[1].value[0] > batch.sets[1].direct[0] && batch.sets[1].direct[0] > 0.0);
    }
}

#[test]
fn a_node_behind_a_pane_is_seen_and_so_is_the_pane() {
    // A pane over the whole picture, and a screen with holes over its right half.
    let mut b = furnished();
    let square = b.json["meshes"].as_array().unwrap().len() - 1;
    for material in [
        json!({ "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.0 },
            "extensions": { "KHR_materials_transmission": { "transmissionFactor": 1.0 } } }),
        json!({ "alphaMode": "MASK", "pbrMetallicRoughness": { "baseColorFactor": [1.0, 1.0, 1.0, 0.2] } }),
    ] {
        b.push("/materials", material);
    }
    for (material, name, [x, width, height]) in [(1, "Pane", [-2.0, 4.0, 1.0]), (2, "Holes", [0.0, 2.0, 1.1])] {
        let mut mesh = b.json["meshes"][square].clone();
        mesh["primitives"][0]["material"] = json!(material);
        let mesh = b.push("/meshes", mesh);
        b.node(json!({ "name": name, "mesh": mesh, "translation": [x, height, 2.0], "scale": [width, 1.0, 4.0] }));
    }
    b.json["scenes"] = json!([{ "nodes": [0, 8, 9] }]);
    let same = [("Table", "rectangle = [2, 2, 3, 4]"), ("Pane", "rectangle = [0, 0, 8, 8]")];
    let regions: String =
        same.iter().map(|(node, what)| by_node(node) + &region(&format!("of_{node}"), what)).collect();
    let case = Case::new(&format!("{VIEW}{regions}"), model(&b));
    for batch in &case.batches(1..u32::MAX).1 {
        assert_eq!((value(batch, 1), value(batch, 3)), (value(batch, 2), value(batch, 4)));
    }
    // A hole is nothing to see.
    let said = refusal(&b, &by_node("Holes"));
    assert!(said.contains("region[0].node = Holes"), "{said}");
}

#[test]
fn a_region_of_the_whole_picture_is_the_mean_of_the_map() {
    let whole = region("whole", "rectangle = [0, 0, 8, 8]") + &by_node("Room");
    let case = Case::new(&format!("{VIEW}{whole}"), model(&furnished()));
    let (_, batches) = case.batches(1..u32::MAX);
    let mut share = None;
    for batch in &batches {
        let map = &batch.sets[0];
        assert_eq!(batch.sets[1].value[0], map.value.iter().sum::<f64>() / 64.0);
        assert_eq!(batch.sets[1].direct[0], map.direct.iter().sum::<f64>() / 64.0);
        // Above zero: a region that light reached is not without information.
        assert!(
            batch.sets[1].peak[0] > 0.0
                && batch.sets[1].peak[0] == map.peak.iter().fold(0.0, |a: f64, &b| a.max(b)) / 64.0
        );
        // What sees nothing counts as 0 in the rectangle and is not among the pixels of the room.
        let ratio = batch.sets[1].value[0] / batch.sets[2].value[0];
        assert!((ratio - *share.get_or_insert(ratio)).abs() < 0.05 && ratio < 0.9, "{ratio}");
    }
    // Mean of the map's means, and mean of the region's: the same to rounding.
    let estimates = common::estimates(&batches);
    let mean = estimates[0].iter().map(|e| e.mean).sum::<f64>() / 64.0;
    assert!((estimates[1][0].mean / mean - 1.0).abs() < 1e-14);
    // The pixels err together: their errors in quadrature would promise far too much.
    let quadrature = estimates[0].iter().map(|e| e.standard_error * e.standard_error).sum::<f64>().sqrt() / 64.0;
    println!("error of the mean {:.2e}, in quadrature {quadrature:.2e}", estimates[1][0].standard_error);
    assert!(estimates[1][0].standard_error > 1.5 * quadrature);
}

#[test]
fn the_tally_of_a_region_has_an_error_and_no_larger_peak_than_its_pixels() {
    let whole = region("whole", "rectangle = [0, 0, 8, 8]");
    let case = Case::new(&format!("{VIEW}{whole}"), model(&furnished()));
    let (_, batches) = case.batches(1..u32::MAX);
    let mut tally = Tally::new(&case.job.sets());
    batches.iter().for_each(|b| tally.accumulate(b));
    let SetTally::Replicates(region) = &tally.sets[1] else { panic!("regions keep their batches") };
    let expected = common::estimates(&batches)[1][0];
    assert_eq!(region.estimate(0), expected);
    assert!(expected.standard_error > 0.0, "{expected:?}");
    // One history gives the region at least what it gives one pixel, shared among all of them.
    let largest = batches.iter().flat_map(|b| b.sets[0].peak.clone()).fold(0.0, f64::max);
    assert!(largest > 0.0);
    assert_eq!(region.peak, [largest / 64.0]);
}

#[test]
fn regions_change_no_number_of_other_receivers() {
    let alone = Case::new(VIEW, model(&furnished()));
    let with = Case::new(&format!("{VIEW}{}", by_node("Table")), model(&furnished()));
    let (a, b) = (alone.batches(1..u32::MAX).1, with.batches(1..u32::MAX).1);
    assert!(a.iter().zip(&b).all(|(a, b)| a.sets[0] == b.sets[0] && a.flux == b.flux));
}

/// Plans the job over the scene of `builder`; what is said when it is refused.
fn refusal(builder: &Builder, regions: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("room.glb"), builder.glb()).unwrap();
    let job = folder.path().join("job.toml");
    std::fs::write(&job, format!("scene = \"room.glb\"\n{VIEW}{regions}")).unwrap();
    prepare(&job).map(|_| ()).unwrap_err().to_string()
}

#[test]
fn nodes_that_are_not_there_twice_there_or_not_seen_are_refused() {
    let said = refusal(&furnished(), &by_node("Chair"));
    let listed = said.split_once("region[0].node = Chair: a node of the scene with a surface: ").unwrap().1;
    let mut names: Vec<&str> = listed.split(", ").collect();
    names.sort_unstable();
    assert_eq!(names, ["Ceiling", "Cellar", "Floor", "Room", "Shelf", "Table", "Top"]);
    let said = refusal(&furnished(), &(by_node("Top") + &by_node("Cellar")));
    assert!(said.contains("region[1].node = Cellar: a node that is the first surface in the centre of at"), "{said}");
    let mut twice = furnished();
    twice.set("/nodes/4/name", json!("Top"));
    let said = refusal(&twice, &by_node("Top"));
    assert!(said.contains("the name of one node: nodes[3] and nodes[4] of the scene both have it"), "{said}");
    let mut many = furnished();
    for i in 0..30 {
        let node = many.node(json!({ "name": format!("n{i}"), "mesh": 0 }));
        let children = many.json["nodes"][0]["children"].as_array_mut().unwrap();
        children.push(json!(node));
    }
    let said = refusal(&many, &by_node("Chair"));
    assert!(said.contains(", and 17 more") && said.matches(", n").count() == 13, "{said}");
}

/// Six lux-meters between Sobolev's planes, none like another.
const ROW: &str = r#"
[[grid]]
name = "row"
origin = [0, 0, 0]
u = [2.4, 0, 0]
v = [0, 0, 0.1]
normal = [0, 1, 0]
columns = 6
rows = 1
"#;

/// All batch scores of the grid, and its fixed part.
fn row(run: &str) -> (Replicates, Vec<f64>) {
    let job = Job::parse(&(sobolev(run, 0.5, 0.5, 0.7) + ROW), "test.toml").unwrap();
    let scene = Scene::new(Model::default(), &job).unwrap();
    let realization = Realization::new(&job, &scene, &bounds(&job, &scene));
    let mut scores = Replicates::new(6);
    for batch in 0..job.run.batches {
        let of = &realization.batch(batch).sets[0];
        scores.accumulate(&of.value, &of.direct);
    }
    (scores, realization.fixed_direct()[0].clone())
}

#[test]
fn mean_and_uniformity_of_a_simulated_grid_cover() {
    const REPLICATES: u64 = 500;
    let (truth, fixed) = row("[run]\nseed = 1000000\nhistories_per_batch = 4096\nbatches = 128");
    let truth = Family::new(&truth, &fixed);
    let (mean, lowest) = (truth.mean().unwrap().estimate(), truth.minimum(0.95).unwrap().value);
    let uniformity = lowest / mean.mean;
    let (mut means, mut uos, mut minima, mut widths, mut error) = (0, 0, 0, [0.0; 2], 0.0);
    for seed in 0..REPLICATES {
        let (scores, fixed) = row(&format!("[run]\nseed = {seed}\nhistories_per_batch = 16\nbatches = 32"));
        let family = Family::new(&scores, &fixed);
        let quantile = lampyris::tally::statistics::student_quantile(0.95, 32);
        let estimate: Estimate = family.mean().unwrap().estimate();
        let holds = |(low, high): (f64, f64), truth: f64| u64::from(low <= truth && truth <= high);
        let (uo, min) = (family.uniformity(0.95).unwrap(), family.minimum(0.95).unwrap());
        means += holds(estimate.interval(quantile), mean.mean);
        uos += holds((uo.low, uo.high), uniformity);
        minima += holds((min.low, min.high), lowest);
        error += estimate.standard_error / REPLICATES as f64;
        widths[0] += (uo.high - uo.low) / uniformity / REPLICATES as f64;
        widths[1] += (min.high - min.low) / lowest / REPLICATES as f64;
    }
    println!(
        "of {REPLICATES}: mean {means}, Uo = {uniformity:.4} {uos} (width {:.4}), minimum {minima} (width {:.4})",
        widths[0], widths[1]
    );
    assert!(mean.standard_error < 0.05 * error, "the truth must be known far better than the estimates");
    // 0.95 less four standard errors of a share of 500.
    let least = (0.95 * REPLICATES as f64 - 4.0 * (REPLICATES as f64 * 0.95 * 0.05).sqrt()) as u64;
    let most = (0.95 * REPLICATES as f64 + 4.0 * (REPLICATES as f64 * 0.95 * 0.05).sqrt()) as u64;
    assert!((least..=most).contains(&means), "{means}");
    assert!(uos >= least && minima >= least, "{uos} {minima}");
}
