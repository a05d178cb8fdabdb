//! The three estimators against each other and against exact values: they share geometry and reflectances, and nothing
//! of how the light is found.

mod common;

use common::scenes::{add_quad, closed_box, lambert, point, sobolev, spot_camera};
use common::{Case, Comparison, Estimate, assert_all, compare, estimates, flux, number, table};
use lampyris::farm::realization::Realization;
use lampyris::math::{DVec3, PI};
use lampyris::photometry::Colour;
use lampyris::scene::{Model, Reflectance, Surface};
use lampyris::tally::BatchScores;

/// The run of one estimator: the plain local estimate, or `reverse` or `direct_simulation`.
fn run(estimator: &str, histories: u32, batches: u32) -> String {
    format!(
        "[run]\nhistories_per_batch = {histories}\nbatches = {batches}\nseed = 61\n\
         [transport]\nbounded = false\nestimator = \"{estimator}\"\n"
    )
}

fn omni(position: [f64; 3], intensity: f64) -> String {
    format!("[[source]]\nkind = \"omni\"\nposition = {position:?}\nintensity = {intensity}\n")
}

/// The estimate `a` against the reference `b` that has an error of its own.
fn difference(name: String, a: Estimate, b: Estimate) -> Comparison {
    let standard_error = (a.standard_error * a.standard_error + b.standard_error * b.standard_error).sqrt();
    compare(name, Estimate { standard_error, ..a }, b.mean)
}

/// Local against reverse estimation of every bin that `job` asks for in `model`, with the histories of a batch each.
fn local_against_reverse(model: &Model, job: &str, [local, reverse]: [u32; 2]) -> Vec<Comparison> {
    let all = |estimator: &str, histories| Case::new(&(run(estimator, histories, 64) + job), model.clone());
    let (local, reverse) = (all("local", local), all("reverse", reverse));
    let names = local.job.sets().into_iter().map(|s| s.name);
    let pairs = names.zip(local.estimates().into_iter().zip(reverse.estimates()));
    let of_set = |(name, (a, b)): (String, (Vec<Estimate>, Vec<Estimate>))| {
        a.into_iter().zip(b).enumerate().map(|(i, (a, b))| difference(format!("{name}[{i}]"), a, b)).collect::<Vec<_>>()
    };
    pairs.flat_map(of_set).collect()
}

/// A room of 6 x 3 x 4 m with a square column, its walls of different reflectance.
fn room() -> Model {
    let mut model = closed_box(DVec3::new(6.0, 3.0, 4.0), &lambert(0.5, 0.0));
    // closed_box adds floor and ceiling as its third and fourth quads.
    model.surfaces[2] = lambert(0.3, 0.0);
    model.surfaces[3] = lambert(0.7, 0.0);
    let (x, y, z) = (DVec3::X * 0.4, DVec3::Y * 3.0, DVec3::Z * 0.4);
    let corner = DVec3::new(3.8, 0.0, 2.4);
    for (origin, u, v) in [(corner, z, y), (corner + x, y, z), (corner, y, x), (corner + z, x, y)] {
        add_quad(&mut model, origin, u, v, lambert(0.5, 0.0));
    }
    model
}

/// Points and cameras in the air and on surfaces of the room, in the light of the lamp and in the column's shadow.
fn room_receivers() -> String {
    point("desk", [1.5, 0.8, 1.0], [0.0, 1.0, 0.0])
        + &point("shadow", [5.3, 0.8, 3.2], [0.0, 1.0, 0.0])
        + &point("tilted", [4.5, 1.6, 1.0], [-1.0, 2.0, 0.5])
        + &spot_camera("wall", [2.0, 1.5, 2.0], [6.0, 1.2, 1.1], [0.0, 1.0, 0.0])
        + &spot_camera("floor", [1.0, 1.5, 1.0], [2.2, 0.0, 3.0], [0.0, 1.0, 0.0])
}

#[test]
fn local_and_reverse_agree_in_a_room_with_a_column() {
    let job = omni([2.5, 2.4, 1.6], 80.0) + &room_receivers();
    assert_all(&local_against_reverse(&room(), &job, [4096, 2048]));
}

#[test]
fn local_and_reverse_agree_under_an_area_light() {
    // A Cornell-like box: coloured walls, a panel hanging under the ceiling that is seen, lit from behind, and lights.
    let mut model = closed_box(DVec3::new(0.556, 0.549, 0.559), &lambert(0.73, 0.0));
    let coloured = |rgb| Surface { reflectance: Reflectance::Lambert(Colour(rgb)), ..lambert(0.0, 0.0) };
    model.surfaces[0] = coloured([0.57, 0.04, 0.04]);
    model.surfaces[1] = coloured([0.11, 0.44, 0.09]);
    add_quad(&mut model, DVec3::new(0.18, 0.5, 0.18), DVec3::X * 0.2, DVec3::Z * 0.2, lambert(0.4, 500.0));
    let job = point("floor", [0.15, 0.0, 0.2], [0.0, 1.0, 0.0])
        + &point("air", [0.3, 0.2, 0.4], [1.0, 0.2, 0.3])
        + &spot_camera("panel", [0.3, 0.1, 0.1], [0.25, 0.5, 0.25], [0.0, 0.0, 1.0])
        + &spot_camera("red", [0.4, 0.2, 0.3], [0.0, 0.3, 0.25], [0.0, 1.0, 0.0])
        + &"[[camera]]\nname = \"edge\"\neye = [0.28, 0.27, 0.05]\ntarget = [0.28, 0.4, 0.3]\n\
            vertical_fov_degrees = 30\nwidth = 2\nheight = 2\npixel_samples = 4\n";
    let coloured = |estimator: &str, histories| {
        let run = run(estimator, histories, 64).replace("[transport]", "channels = \"rgb\"\n[transport]");
        Case::new(&(run + &job), model.clone())
    };
    let (local, reverse) = (coloured("local", 8192), coloured("reverse", 8192));
    let (a, b) = (local.batches(0..u32::MAX), reverse.batches(0..u32::MAX));
    let mut all = Vec::new();
    for (set, shape) in local.job.sets().iter().enumerate() {
        for bin in 0..shape.bins() {
            let channels = a.1[0].sets[set].colour.len().min(1) * 3;
            let name = |what: &str| format!("{}[{bin}] {what}", shape.name);
            let (x, y) = (estimates(&a.1)[set][bin], estimates(&b.1)[set][bin]);
            let fixed = |f: &[Vec<f64>]| f[set].get(bin).copied().unwrap_or(0.0);
            all.push(difference(name("luminance"), x.shifted(fixed(&a.0)), y.shifted(fixed(&b.0))));
            let channel = |batches: &[BatchScores], c: usize| {
                Estimate::from_scores(batches.iter().map(|b| b.sets[set].colour[bin][c]))
            };
            all.extend((0..channels).map(|c| difference(name(["r", "g", "b"][c]), channel(&a.1, c), channel(&b.1, c))));
        }
    }
    assert_all(&all);
}

#[test]
fn local_and_reverse_agree_between_open_planes() {
    let cameras = spot_camera("plane1", [0.2, 0.6, 0.0], [0.9, 0.0, 0.3], [0.0, 1.0, 0.0])
        + &spot_camera("plane2", [0.2, 0.4, 0.0], [0.5, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let meters = point("e1", [0.5, 0.0, 0.0], [0.0, 1.0, 0.0]) + &point("air", [0.4, 0.6, 0.3], [1.0, -0.5, 0.0]);
    let job = sobolev("", 0.3, 0.9, 0.8) + &cameras + &meters;
    assert_all(&local_against_reverse(&Model::default(), &job, [16384, 8192]));
}

/// Ulbricht's sphere, R = 1 m: E = E_0 + rho Phi / (4 pi R^2 (1 - rho)), whatever the place of the lamp.
fn ulbricht(estimator: &str) -> (Vec<Estimate>, [f64; 3]) {
    let sphere = "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nfacing = \"inward\"\nreflectance = 0.5\n";
    let job = run(estimator, 4096, 64)
        + sphere
        + &omni([0.4, 0.0, 0.0], 100.0)
        + &point("g0", [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0])
        + &point("g180", [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0])
        + &spot_camera("wall", [0.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let estimates = Case::new(&job, Model::default()).estimates();
    let (near, far) = (377.777777777778, 151.020408163265);
    // Cameras come first in the order of the sets.
    (estimates.into_iter().map(|set| set[0]).collect(), [0.5 * far / PI, near, far])
}

#[test]
fn both_give_the_exact_values_of_an_integrating_sphere() {
    let mut all = Vec::new();
    for estimator in ["local", "reverse"] {
        let (estimates, exact) = ulbricht(estimator);
        let pairs = estimates.into_iter().zip(exact).enumerate();
        all.extend(pairs.map(|(i, (e, exact))| compare(format!("{estimator} {i}"), e, exact)));
    }
    assert_all(&all);
}

#[test]
fn reverse_gives_the_exact_values_of_a_white_furnace() {
    // M0 = 1 lm/m2 and rho = 0.5 everywhere: E = 2 lx and L = 2/pi cd/m2 at every place and in every direction.
    let job = run("reverse", 4096, 64)
        + &point("wall", [0.003, 0.5, 0.0], [0.0, 0.0, 1.0])
        + &point("air", [0.5, 0.5, 0.5], [1.0, 2.0, 3.0])
        + &spot_camera("seen", [0.2, 0.8, 0.2], [0.8, 0.0, 0.8], [0.0, 1.0, 0.0])
        + "[[gonio]]\nname = \"around\"\nposition = [0.3, 0.6, 0.4]\nwidth = 4\nheight = 2\n"
        + "[[gonio]]\nname = \"leaving\"\nposition = [0.5, 0.0, 0.5]\nsurface = true\nnormal = [0, 1, 0]\n\
           width = 3\nheight = 3\n";
    let case = Case::new(&job, closed_box(DVec3::ONE, &lambert(0.5, 1.0 / PI)));
    let mut all = Vec::new();
    for (shape, set) in case.job.sets().iter().zip(case.estimates()) {
        let exact = if shape.name == "wall" || shape.name == "air" { 2.0 } else { 2.0 / PI };
        // NaN: below the horizon.
        let seen = set.into_iter().enumerate().filter(|(_, e)| !e.mean.is_nan());
        all.extend(seen.map(|(i, e)| compare(format!("{}[{i}]", shape.name), e, exact)));
    }
    assert!(all.len() >= 2 + 1 + 8 + 6, "{}", all.len());
    assert_all(&all);
}

#[test]
fn reverse_gives_the_exact_values_of_sobolevs_problem() {
    let rows = table("sobolev_tables.csv");
    let rows: Vec<_> = rows.iter().filter(|r| r["case"] == "A" && number(r, "r") <= 2.0).collect();
    let mut job = sobolev(&run("reverse", 16384, 64), 0.5, 0.5, 0.5);
    for (i, row) in rows.iter().enumerate() {
        job += &point(&format!("e{i}"), [number(row, "r"), 0.0, 0.0], [0.0, 1.0, 0.0]);
    }
    let estimates = Case::new(&job, Model::default()).estimates();
    let at = |(i, row): (usize, &&_)| compare(format!("E1[{i}]"), estimates[i][0], number(row, "E1"));
    assert_all(&rows.iter().enumerate().map(at).collect::<Vec<_>>());
}

/// A closed cube of Lambert walls with a GGX floor.
fn cube_with_glossy_floor(roughness: f64, metallic: f64) -> Model {
    let mut model = closed_box(DVec3::ONE, &lambert(0.6, 0.0));
    let reflectance = Reflectance::metallic_roughness(Colour::grey(0.6), metallic, roughness);
    model.surfaces[2] = Surface { reflectance, ..lambert(0.0, 0.0) };
    model.surfaces[3] = lambert(0.6, 20.0);
    model
}
