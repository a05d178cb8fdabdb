//! Opal: light on both sides, found alike by every estimator.

use crate::common::scenes::{add_quad, box_walls, closed_box, lambert, omni, point, spot_camera};
use crate::common::{Case, Estimate, assert_all, compare, difference, flux};
use lampyris::geometry::simd::Path;
use lampyris::math::DVec3;
use lampyris::photometry::Colour;
use lampyris::scene::{Delta, Model, Pane, Reflectance, Surface};
use lampyris::validate::Experiment;
use lampyris::validate::scenes::UP;

fn opal(rho: f64, tau: f64) -> Surface {
    let reflectance = Reflectance::opal(Colour::grey(rho), Colour::grey(tau));
    Surface { reflectance, double_sided: true, ..lambert(0.0, 0.0) }
}

/// Adds a box of `surface` with a corner at `origin`.
fn add_box(model: &mut Model, origin: DVec3, size: DVec3, surface: &Surface) {
    for [corner, u, v] in box_walls(size) {
        add_quad(model, origin + corner, u, v, surface.clone());
    }
}

#[test]
fn a_cover_lets_out_what_its_reflections_leave() {
    // All light comes back to the inside of a convex cover until it goes through: Phi tau/(1 - rho).
    let job = "[run]\nbatches = 64\nhistories_per_batch = 4096\nseed = 3\n".to_owned()
        + &omni([0.4, 0.5, 0.6], 10.0)
        + &point("far", [3.0, 0.0, 0.0], UP);
    let case = Case::new(&job, closed_box(DVec3::ONE, &opal(0.5, 0.3)));
    let (_, batches) = case.batches(1..u32::MAX);
    let emitted = flux(&batches, "emitted").mean;
    let escaped = compare("escaped", flux(&batches, "escaped"), emitted * 0.3 / 0.5);
    assert_all(&[escaped, compare("absorbed", flux(&batches, "absorbed"), emitted * 0.2 / 0.5)]);
}

#[test]
fn a_sheet_in_an_even_room_is_as_bright_as_the_room() {
    // Walls of 1 cd/m2 that reflect a half: 2 cd/m2 everywhere, and on a sheet that absorbs nothing.
    let mut model = closed_box(DVec3::ONE, &lambert(0.5, 1.0));
    add_quad(&mut model, DVec3::new(0.2, 0.5, 0.2), DVec3::X * 0.6, DVec3::Z * 0.6, opal(0.3, 0.7));
    let job = "[run]\nbatches = 64\nhistories_per_batch = 1024\nseed = 4\n".to_owned()
        + &spot_camera("above", [0.3, 0.9, 0.5], [0.5, 0.5, 0.5], [1.0, 0.0, 0.0])
        + &spot_camera("below", [0.3, 0.1, 0.5], [0.5, 0.5, 0.5], [1.0, 0.0, 0.0])
        + &spot_camera("wall", [0.5, 0.9, 0.5], [1.0, 0.4, 0.5], UP)
        + &point("meter", [0.5, 0.45, 0.5], UP);
    let values = Case::new(&job, model).values();
    let pi = lampyris::math::PI;
    let wanted = [("above", 2.0), ("below", 2.0), ("wall", 2.0), ("meter", 2.0 * pi)];
    let all: Vec<_> = wanted.iter().zip(values).map(|((name, exact), found)| compare(name, found, *exact)).collect();
    assert_all(&all);
}

/// A luminaire: a bright panel in an opal box that hangs in a room with a pane in front.
fn luminaire() -> Model {
    let mut model = closed_box(DVec3::new(2.0, 1.0, 1.0), &lambert(0.5, 0.0));
    add_box(&mut model, DVec3::new(0.3, 0.4, 0.3), DVec3::splat(0.4), &opal(0.4, 0.5));
    add_quad(&mut model, DVec3::new(0.32, 0.6, 0.32), DVec3::X * 0.36, DVec3::Z * 0.36, lambert(0.5, 300.0));
    let pane = Reflectance::Delta(Delta::Pane(Pane::new(1.5, Colour::grey(0.9))));
    let glass = Surface { reflectance: pane, double_sided: true, ..lambert(0.0, 0.0) };
    add_quad(&mut model, DVec3::X, DVec3::Y, DVec3::Z, glass);
    let gloss = Reflectance::phong(Colour::grey(0.3), Colour::grey(0.4), 10.0);
    model.surfaces[2] = Surface { reflectance: gloss, ..lambert(0.0, 0.0) };
    model
}

fn job(estimator: &str, histories: u32) -> String {
    format!(
        "[run]\nbatches = 64\nhistories_per_batch = {histories}\nseed = 6\n[transport]\nestimator = \"{estimator}\"\n"
    ) + &spot_camera("cover", [0.5, 0.1, 0.5], [0.5, 0.4, 0.52], [1.0, 0.0, 0.0])
        + &spot_camera("floor", [0.9, 0.5, 0.5], [0.7, 0.0, 0.5], [1.0, 0.0, 0.0])
}

#[test]
fn estimators_agree_under_an_opal_luminaire() {
    let means = |estimator: &str, histories: u32| -> Vec<Estimate> {
        Case::new(&job(estimator, histories), luminaire()).values()
    };
    let (local, reverse) = (means("local", 512), means("reverse", 8192));
    let names = ["cover", "floor"];
    let all = names.iter().zip(local).zip(reverse).map(|((name, a), b)| difference(name, a, b));
    assert_all(&all.collect::<Vec<_>>());
}

#[test]
fn every_path_and_any_threads_give_the_same_bits() {
    let scores = |path: Path, threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut case = Experiment::new(&job("local", 32), luminaire()).unwrap();
            case.scene.geometry = std::mem::take(&mut case.scene.geometry).with_path(path);
            let (_, batches) = case.batches(1..u32::MAX);
            let bits = batches.iter().flat_map(|b| b.sets.iter().flat_map(|s| s.value.iter().map(|v| v.to_bits())));
            bits.collect::<Vec<_>>()
        })
    };
    let plain = scores(Path::Scalar, 1);
    for path in Path::ALL.into_iter().filter(|p| p.is_available()) {
        assert_eq!(scores(path, 2), plain, "{path:?}");
    }
}
