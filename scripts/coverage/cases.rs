//! Small cases of every kind of receiver, light and interval, with batches of 32 or 64 histories.
//!
//! Truths are closed forms where there are any; else the mean of [`LONG`] runs of other seeds, whose own error is twenty
//! times smaller than that of one run.

use super::count::{Counted, Quantity, count};
use super::edge::{cube, sampled};
use super::replicate::{Kind, Replicate};
use lampyris::error::{Error, Result};
use lampyris::math::{DVec3, PI, cos, sin};
use lampyris::photometry::Colour;
use lampyris::scene::{Model, Reflectance, Surface, gltf};
use lampyris::tally::statistics::Estimate;
use lampyris::validate::closed_forms::ulbricht;
use lampyris::validate::experiment::Experiment;
use lampyris::validate::scenes::{UP, closed_box, integrating_sphere, lambert, omni, point, sobolev, spot_camera};
use rayon::prelude::*;
use std::path::Path;

/// Runs that make a truth, and the seed before the first of them.
const LONG: u64 = 400;
const OTHER_SEEDS: u64 = 1 << 40;
/// E on Sobolev's plane 1, case A, r = 1 (src/validate/reference/sobolev_tables.csv) \[lx\].
const SOBOLEV_A_1: f64 = 0.653442317194389;

/// All cases, printed as they come.
pub fn run(replicates: u64, mut done: impl FnMut(&[Counted])) -> Result<Vec<Counted>> {
    type Case = fn(u64) -> Result<Vec<Counted>>;
    let cases: [Case; 21] = [
        |n| sobolev_a("rqmc", n),
        |n| sobolev_a("random", n),
        ulbricht_sphere,
        |n| lamp_in_cube("rqmc", 32, 32, true, n),
        |n| lamp_in_cube("random", 32, 32, false, n),
        |n| lamp_in_cube("thinned", 32, 32, true, n),
        |n| lamp_in_cube("rqmc", 16, 32, false, n),
        |n| lamp_in_cube("random", 64, 32, false, n),
        furnace_grid,
        furnace_neighbours,
        cornell,
        |n| glossy_floor(0.1, Lamp::Ceiling, 32, n),
        |n| glossy_floor(0.1, Lamp::Point, 32, n),
        |n| glossy_floor(0.3, Lamp::Point, 32, n),
        |n| glossy_floor(0.3, Lamp::Point, 128, n),
        |n| varnished_floor(0.25, Lamp::Point, n),
        |n| varnished_floor(0.25, Lamp::Ceiling, n),
        mirror_beside_an_edge,
        stopped_sobolev,
        |n| stopped_edge(true, n),
        |n| stopped_edge(false, n),
    ];
    let mut all = Vec::new();
    for case in cases {
        let counted = case(replicates)?;
        done(&counted);
        all.extend(counted);
    }
    Ok(all)
}

pub(super) fn tables(sampling: &str, batches: u32, histories: u32) -> String {
    let sampling = sampled(sampling);
    format!("[run]\nhistories_per_batch = {histories}\nbatches = {batches}\n{sampling}")
}

fn exact(name: &str, kind: Kind, truth: f64) -> Quantity {
    Quantity { name: name.to_owned(), kind, truth: vec![truth], truth_error: 0.0 }
}

/// The quantities with truths from long runs of `experiment`.
pub(super) fn measured(experiment: &Experiment, wanted: &[(&str, Kind)]) -> Vec<Quantity> {
    let runs: Vec<Replicate> =
        (1..=LONG).into_par_iter().map(|i| Replicate::new(experiment, OTHER_SEEDS + i)).collect();
    let means = |kind: &Kind| -> Vec<Estimate> {
        let values: Vec<Vec<f64>> = runs.iter().map(|r| r.read(kind).intervals.iter().map(|i| i.0).collect()).collect();
        (0..values[0].len()).map(|i| Estimate::from_scores(values.iter().map(|v| v[i]))).collect()
    };
    let quantity = |(name, kind): &(&str, Kind)| {
        let (truth, truth_error) = match *kind {
            Kind::Ratio(a, b) => {
                let mean = |set| means(&Kind::Total(set, 0))[0].mean;
                (vec![mean(a) / mean(b)], means(kind)[0].standard_error)
            }
            Kind::Minimum(set) | Kind::Uniformity(set) => {
                let bins = means(&Kind::Together(set));
                let least = bins.iter().map(|e| e.mean).fold(f64::INFINITY, f64::min);
                let mean = bins.iter().map(|e| e.mean).sum::<f64>() / bins.len() as f64;
                (vec![if matches!(kind, Kind::Minimum(_)) { least } else { least / mean }], 0.0)
            }
            _ => {
                let found = means(kind);
                (found.iter().map(|e| e.mean).collect(), found[0].standard_error)
            }
        };
        Quantity { name: (*name).to_owned(), kind: kind.clone(), truth, truth_error }
    };
    wanted.iter().map(quantity).collect()
}

fn sobolev_a(sampling: &str, n: u64) -> Result<Vec<Counted>> {
    let job = sobolev(&tables(sampling, 32, 64), 0.5, 0.5, 0.5) + &point("e", [1.0, 0.0, 0.0], UP);
    let experiment = Experiment::new(&job, Model::default())?;
    Ok(count(
        &format!("Sobolev A, {sampling}"),
        &experiment,
        vec![exact("E, r = 1", Kind::Total(0, 0), SOBOLEV_A_1)],
        n,
    ))
}

fn ulbricht_sphere(n: u64) -> Result<Vec<Counted>> {
    let (s, c) = (sin(PI / 3.0), cos(PI / 3.0));
    let job = tables("rqmc", 32, 32)
        + &omni([0.0, 0.4, 0.0], 100.0)
        + &integrating_sphere(0.5)
        + &point("e", [s, c, 0.0], [-s, -c, 0.0])
        + &spot_camera("l", [0.1, 0.0, 0.2], [s, c, 0.0], [0.0, 0.0, 1.0]);
    let truth = ulbricht(100.0, 0.4, 0.5, PI / 3.0);
    let quantities = vec![
        exact("E, 60 degrees", Kind::Total(1, 0), truth),
        exact("L, 60 degrees", Kind::Total(0, 0), 0.5 * truth / PI),
    ];
    Ok(count("Ulbricht sphere, rqmc", &Experiment::new(&job, Model::default())?, quantities, n))
}

/// A unit cube of reflectance 0.5 with a lamp of 100 cd beside its middle; with `grids` also a grid and a region.
fn lamp_in_cube(sampling: &str, batches: u32, histories: u32, grids: bool, n: u64) -> Result<Vec<Counted>> {
    let mut job = tables(sampling, batches, histories)
        + &omni([0.4, 0.6, 0.5], 100.0)
        + &camera("edge", [0.4, 0.5, 0.5], [0.0, 0.0, 0.5], 8.0, if grids { [3, 2] } else { [1, 1] })
        + &point("near", [0.005, 0.0, 0.5], UP)
        + &point("middle", [0.5, 0.0, 0.5], UP);
    let mut wanted = vec![
        ("E 5 mm from a wall", Kind::Total(1 + usize::from(grids), 0)),
        ("ratio to E in the middle", Kind::Ratio(1 + usize::from(grids), 2 + usize::from(grids))),
    ];
    if grids {
        job += "[[region]]\nname = \"across\"\ncamera = \"edge\"\nrectangle = [0, 0, 3, 2]\n";
        job += &grid(3);
        wanted.extend([
            ("pixel across an edge", Kind::Total(0, 1)),
            ("region across an edge", Kind::Total(4, 0)),
            ("mean of 9 points", Kind::Mean(1)),
            ("least of 9 points", Kind::Minimum(1)),
            ("Uo of 9 points", Kind::Uniformity(1)),
            ("all 9 points at once", Kind::Together(1)),
        ]);
    } else {
        wanted.push(("pixel across an edge", Kind::Total(0, 0)));
    }
    let experiment = Experiment::new(&job, closed_box(DVec3::ONE, &lambert(0.5, 0.0)))?;
    let quantities = measured(&experiment, &wanted);
    Ok(count(&format!("lamp in a cube, {sampling}, {batches} x {histories}"), &experiment, quantities, n))
}

/// A camera of which all pixels are monitored.
pub(super) fn camera(name: &str, eye: [f64; 3], target: [f64; 3], degrees: f64, [width, height]: [u32; 2]) -> String {
    let pixels: Vec<[u32; 2]> = (0..width * height).map(|i| [i % width, i / width]).collect();
    format!(
        "[[camera]]\nname = \"{name}\"\neye = {eye:?}\ntarget = {target:?}\nup = [0, 0, 1]\n\
         vertical_fov_degrees = {degrees}\nwidth = {width}\nheight = {height}\nmonitor = {pixels:?}\n"
    )
}

/// `side` x `side` points of the floor of a unit cube.
fn grid(side: u32) -> String {
    format!(
        "[[grid]]\nname = \"floor\"\norigin = [0, 0, 0]\nu = [1, 0, 0]\nv = [0, 0, 1]\nnormal = [0, 1, 0]\n\
         columns = {side}\nrows = {side}\n"
    )
}

/// Points that tie: the hardest case for the least of several.
fn furnace_grid(n: u64) -> Result<Vec<Counted>> {
    let job = tables("rqmc", 32, 32) + &grid(3);
    let experiment = Experiment::new(&job, closed_box(DVec3::ONE, &lambert(0.5, 1.0 / PI)))?;
    let together = Quantity {
        name: "all 9 points at once".into(),
        kind: Kind::Together(0),
        truth: vec![2.0; 9],
        truth_error: 0.0,
    };
    let quantities = vec![
        exact("mean of 9 equal points", Kind::Mean(0), 2.0),
        exact("least of 9 equal points", Kind::Minimum(0), 2.0),
        exact("Uo of 9 equal points", Kind::Uniformity(0), 1.0),
        together,
    ];
    Ok(count("furnace, rqmc", &experiment, quantities, n))
}

/// The same for a grid whose points are near a wall, and so many that they share what they find there.
fn furnace_neighbours(n: u64) -> Result<Vec<Counted>> {
    let grid = "[[grid]]\nname = \"grid\"\norigin = [0.0, 0.0, 0.3]\nu = [0.08, 0.0, 0.0]\nv = [0.0, 0.0, 0.2]\n\
                normal = [0.0, 1.0, 0.0]\ncolumns = 8\nrows = 8\n";
    let job = tables("rqmc", 32, 32) + grid;
    let experiment = Experiment::new(&job, closed_box(DVec3::ONE, &lambert(0.5, 1.0 / PI)))?;
    let together = Quantity {
        name: "all 64 points at once".into(),
        kind: Kind::Together(0),
        truth: vec![2.0; 64],
        truth_error: 0.0,
    };
    let quantities = vec![
        exact("5 mm from the wall", Kind::Total(0, 0), 2.0),
        exact("75 mm from the wall", Kind::Total(0, 7), 2.0),
        exact("mean of 64 equal points", Kind::Mean(0), 2.0),
        exact("Uo of 64 equal points", Kind::Uniformity(0), 1.0),
        together,
    ];
    Ok(count("furnace beside a wall, neighbours, rqmc", &experiment, quantities, n))
}

/// The Cornell box with its panel.
fn cornell(n: u64) -> Result<Vec<Counted>> {
    let job = tables("rqmc", 32, 32)
        + "[[grid]]\nname = \"floor\"\norigin = [0, 0, 0]\nu = [0.556, 0, 0]\nv = [0, 0, -0.5592]\n\
           normal = [0, 1, 0]\ncolumns = 1\nrows = 2\n"
        + &point("block", [0.37, 0.17, -0.169], UP)
        + &point("near", [0.005, 0.1, -0.3], UP);
    let experiment = Experiment::new(&job, load("cornell")?)?;
    let wanted = [
        ("E on the short block", Kind::Total(1, 0)),
        ("E 5 mm from a wall", Kind::Total(2, 0)),
        ("mean of 2 points", Kind::Mean(0)),
        ("ratio of the two points", Kind::Ratio(1, 2)),
    ];
    let quantities = measured(&experiment, &wanted);
    Ok(count("Cornell box, area light, rqmc", &experiment, quantities, n))
}

/// The model in `scenes/{name}.glb`.
pub fn load(name: &str) -> Result<Model> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.glb"));
    let bytes = std::fs::read(&path).map_err(Error::io(&path))?;
    gltf::load(name, &bytes, &mut |uri| panic!("{uri}: the scenes here are single files"))
}

/// What lights a cube with a glossy floor.
#[derive(Clone, Copy)]
enum Lamp {
    /// A point of 100 cd: its image in the floor is a caustic as narrow as the lobe of the floor.
    Point,
    /// The whole ceiling.
    Ceiling,
}

/// A half metallic floor, seen in luminance at a slant, in 32 batches of `histories`.
fn glossy_floor(roughness: f64, lamp: Lamp, histories: u32, n: u64) -> Result<Vec<Counted>> {
    let law = Reflectance::metallic_roughness(Colour::grey(0.8), 0.5, roughness);
    let name = format!("glossy floor, roughness {roughness}, {}, rqmc, 32 x {histories}", lamp.name());
    floor_case(&name, law, lamp, [[0.9, 0.3, 0.5], [0.3, 0.0, 0.45]], histories, n)
}

/// A dielectric whose lobe is no peak at normal incidence, seen 80 degrees from it, where it is one.
fn varnished_floor(roughness: f64, lamp: Lamp, n: u64) -> Result<Vec<Counted>> {
    let law = Reflectance::metallic_roughness(Colour::grey(0.6), 0.0, roughness);
    let name = format!("varnished floor at 80 degrees, roughness {roughness}, {}, rqmc, 32 x 32", lamp.name());
    floor_case(&name, law, lamp, [[0.95, 0.12, 0.5], [0.27, 0.0, 0.45]], 32, n)
}

/// A cube with a floor of its own, of which a pixel and a region are seen, and a lux-meter low on a wall.
fn floor_case(
    name: &str,
    reflectance: Reflectance,
    lamp: Lamp,
    [eye, target]: [[f64; 3]; 2],
    histories: u32,
    n: u64,
) -> Result<Vec<Counted>> {
    let mut model = closed_box(DVec3::ONE, &lambert(0.5, 0.0));
    // closed_box adds the floor, y = 0, as its third quad, and the ceiling as its fourth.
    model.surfaces[2] = Surface { name: "floor".into(), reflectance, ..lambert(0.0, 0.0) };
    let source = match lamp {
        Lamp::Point => omni([0.4, 0.6, 0.5], 100.0),
        Lamp::Ceiling => {
            model.surfaces[3] = lambert(0.5, 100.0);
            String::new()
        }
    };
    let job = tables("rqmc", 32, histories)
        + &source
        + &camera("floor", eye, target, 10.0, [2, 1])
        + "[[region]]\nname = \"both\"\ncamera = \"floor\"\nrectangle = [0, 0, 2, 1]\n"
        + &point("wall", [0.0, 0.05, 0.5], [1.0, 0.0, 0.0]);
    let experiment = Experiment::new(&job, model)?;
    let wanted = [
        ("L of a pixel", Kind::Total(0, 0)),
        ("region of 2 pixels", Kind::Total(2, 0)),
        ("E on a wall", Kind::Total(1, 0)),
    ];
    let quantities = measured(&experiment, &wanted);
    Ok(count(name, &experiment, quantities, n))
}

impl Lamp {
    fn name(self) -> &'static str {
        match self {
            Lamp::Point => "point lamp",
            Lamp::Ceiling => "area light",
        }
    }
}

/// A cube with a mirror for a wall, and an edge that the mirror lights: that part of the light has no bound.
fn mirror_beside_an_edge(n: u64) -> Result<Vec<Counted>> {
    let mut model = closed_box(DVec3::ONE, &lambert(0.5, 0.0));
    // closed_box adds the wall x = 0 as its first quad.
    let reflectance = Reflectance::metallic_roughness(Colour::grey(0.9), 1.0, 0.0);
    model.surfaces[0] = Surface { name: "mirror".into(), reflectance, ..lambert(0.0, 0.0) };
    let job = tables("rqmc", 32, 32)
        + &omni([0.4, 0.6, 0.5], 100.0)
        + &camera("edge", [0.6, 0.5, 0.5], [1.0, 0.0, 0.5], 8.0, [1, 1])
        + &point("near", [0.995, 0.0, 0.5], UP)
        + &point("middle", [0.5, 0.0, 0.5], UP);
    let experiment = Experiment::new(&job, model)?;
    let wanted = [
        ("E 5 mm from a wall", Kind::Total(1, 0)),
        ("E in the middle", Kind::Total(2, 0)),
        ("pixel across an edge", Kind::Total(0, 0)),
    ];
    let quantities = measured(&experiment, &wanted);
    Ok(count("mirror beside an edge, rqmc", &experiment, quantities, n))
}

fn stop(relative_half_width: f64, sampling: &str) -> String {
    format!(
        "[run]\nhistories_per_batch = 64\nbatches_per_shard = 8\nsampling = \"{sampling}\"\n\
         [stop]\nrelative_half_width = {relative_half_width}\nmax_batches = 256\n"
    )
}

fn stopped_sobolev(n: u64) -> Result<Vec<Counted>> {
    let job = sobolev(&stop(0.035, "random"), 0.5, 0.5, 0.5) + &point("e", [1.0, 0.0, 0.0], UP);
    let experiment = Experiment::new(&job, Model::default())?;
    let quantities = vec![exact("E, r = 1", Kind::Total(0, 0), SOBOLEV_A_1)];
    Ok(count("stopped at 3.5 %, Sobolev A, random", &experiment, quantities, n))
}

fn stopped_edge(bounded: bool, n: u64) -> Result<Vec<Counted>> {
    let job = format!("{}receivers = [\"p0\"]\n[transport]\nbounded = {bounded}\n", stop(0.06, "rqmc"));
    let kernel = if bounded { "bounded" } else { "plain" };
    let quantities = vec![exact("E, s = 0.01", Kind::Total(1, 0), 2.0)];
    Ok(count(&format!("stopped at 6 %, edge, {kernel}, rqmc"), &cube(&job, &[0.01])?, quantities, n))
}
