//! Panes: the straight segment is dimmed by the transmittance, exactly where there is nothing to sample.

use crate::assert_same_bits_on_every_path;
use crate::common::scenes::{add_quad, closed_box, lambert, omni, point, spot_camera};
use crate::common::{Case, Estimate, assert_all, compare, difference, flux};
use lampyris::math::{DVec3, cos, sin};
use lampyris::photometry::Colour;
use lampyris::scene::{Delta, Model, Pane, Reflectance, Surface};
use lampyris::validate::scenes::{UP, in_parallel_light, points};

/// A surface of clear or tinted glass.
fn glass(pane: Pane) -> Surface {
    let reflectance = Reflectance::Delta(Delta::Pane(pane));
    Surface { reflectance, double_sided: true, ..lambert(0.0, 0.0) }
}

/// A square pane of side 2 `half` in the plane y = `height`.
fn add_pane(model: &mut Model, half: f64, height: f64, pane: Pane) {
    let corner = DVec3::new(-half, height, -half);
    add_quad(model, corner, DVec3::Z * 2.0 * half, DVec3::X * 2.0 * half, glass(pane));
}

fn window() -> Pane {
    Pane::new(1.52, Colour([0.9, 0.8, 0.7]))
}

/// Unpolarised transmittance of clear glass of index n, straight from Fresnel's sines and tangents.
fn by_sines(n: f64, angle: f64, internal: f64) -> f64 {
    let inside = lampyris::math::atan2(sin(angle) / n, (1.0 - sin(angle) * sin(angle) / (n * n)).sqrt());
    let t = lampyris::math::pow(internal, 1.0 / cos(inside));
    let s = sin(angle - inside) / sin(angle + inside);
    let p = lampyris::math::tan(angle - inside) / lampyris::math::tan(angle + inside);
    let through = |r: f64| (1.0 - r * r) * (1.0 - r * r) * t / (1.0 - r * r * r * r * t * t);
    0.5 * (through(s) + through(p))
}

#[test]
fn lux_behind_a_pane_is_lux_without_it_times_its_transmittance() {
    // Meters on y = 0 along x, a lamp 2 m above, the pane between; straight below, along its diagonals, and aslant.
    let places: Vec<f64> = (0..40).map(|i| 0.1 * f64::from(i)).collect();
    let job = "[run]\nbatches = 16\nhistories_per_batch = 16\n".to_owned()
        + &omni([0.0, 2.0, 0.0], 100.0)
        + &points("p", places.iter().map(|&x| ([x, 0.0, 0.0], UP)))
        + &points("d", places.iter().map(|&x| ([x, 0.0, x], UP)));
    let mut model = Model::default();
    add_pane(&mut model, 8.0, 1.0, Pane::new(1.5, Colour::grey(0.8)));
    let estimates = Case::new(&job, model).estimates();
    let x2 = places.iter().map(|x| x * x).chain(places.iter().map(|x| 2.0 * x * x));
    for (estimate, x2) in estimates.iter().zip(x2) {
        let d2 = 4.0 + x2;
        let angle = lampyris::math::atan2(x2.sqrt(), 2.0);
        let transmittance = if x2 == 0.0 { by_sines(1.5, 1e-9, 0.8) } else { by_sines(1.5, angle, 0.8) };
        let exact = 100.0 * 2.0 / (d2 * d2.sqrt()) * transmittance;
        assert!((estimate[0].mean / exact - 1.0).abs() < 1e-5, "{x2}: {} {exact}", estimate[0].mean);
        assert_eq!(estimate[0].standard_error, 0.0);
    }
}

#[test]
fn parallel_light_and_two_panes_multiply() {
    let direction = DVec3::new(sin(0.7), -cos(0.7), 0.0);
    let job = "[run]\nbatches = 16\nhistories_per_batch = 16\n".to_owned() + &point("p", [0.0, 0.0, 0.0], UP);
    let mut model = Model::default();
    add_pane(&mut model, 8.0, 1.0, Pane::new(1.5, Colour::WHITE));
    add_pane(&mut model, 8.0, 1.5, Pane::new(1.7, Colour::grey(0.5)));
    let estimates = Case::new(&job, in_parallel_light(model, direction, 1000.0)).estimates();
    let exact = 1000.0 * cos(0.7) * by_sines(1.5, 0.7, 1.0) * by_sines(1.7, 0.7, 0.5);
    assert!((estimates[0][0].mean / exact - 1.0).abs() < 1e-9, "{} {exact}", estimates[0][0].mean);
}

#[test]
fn luminance_through_a_pane_and_mirrored_in_it() {
    // A panel of 50 cd/m2 at y = 3, one of 20 at y = -1, the pane at y = 1 between them, and eyes that look at it from below.
    let mut model = Model::default();
    add_pane(&mut model, 20.0, 1.0, window());
    add_quad(&mut model, DVec3::new(-20.0, 3.0, -20.0), DVec3::X * 40.0, DVec3::Z * 40.0, lambert(0.0, 50.0));
    add_quad(&mut model, DVec3::new(-20.0, -1.0, -20.0), DVec3::Z * 40.0, DVec3::X * 40.0, lambert(0.0, 20.0));
    let angles = [0.0, 0.6, 1.1, 1.4];
    let cameras = angles.iter().enumerate().map(|(i, &angle)| {
        let target = [sin(angle), cos(angle), 0.0];
        spot_camera(&format!("c{i}"), [0.0; 3], target, [0.0, 0.0, 1.0])
    });
    let job = "[run]\nbatches = 32768\nhistories_per_batch = 1\nsampling = \"random\"\nseed = 5\n".to_owned()
        + &cameras.collect::<String>();
    let estimates = Case::new(&job, model).estimates();
    let grey = Pane::new(1.52, Colour::grey(window_luminance()));
    let comparisons = angles.iter().zip(&estimates).map(|(&angle, estimate)| {
        let (through, mirrored) = grey.shares(cos(angle));
        compare(format!("at {angle}"), estimate[0], 50.0 * through.0[0] + 20.0 * mirrored.0[0])
    });
    assert_all(&comparisons.collect::<Vec<_>>());
}

/// What one photometric channel makes of the tint.
fn window_luminance() -> f64 {
    Colour([0.9, 0.8, 0.7]).luminance()
}

/// A room of two halves with a pane between them, a lamp in one and meters in both.
fn parted_room(estimator: &str, histories: u32) -> String {
    format!(
        "[run]\nbatches = 64\nhistories_per_batch = {histories}\nseed = 9\nchannels = \"rgb\"\n\
         [transport]\nestimator = \"{estimator}\"\n"
    ) + &point("lit", [0.6, 0.0, 0.4], UP)
        + &point("behind", [1.5, 0.0, 0.5], UP)
        + &point("corner", [1.97, 0.0, 0.5], UP)
        + &spot_camera("wall", [1.5, 0.5, 0.5], [2.0, 0.7, 0.6], UP)
}

fn parted(pane: Pane) -> Model {
    let mut model = closed_box(DVec3::new(2.0, 1.0, 1.0), &lambert(0.6, 0.0));
    add_quad(&mut model, DVec3::X, DVec3::Y, DVec3::Z, glass(pane));
    // The lamp has an extent: reverse paths never find one without by way of a mirror.
    add_quad(&mut model, DVec3::new(0.1, 0.95, 0.1), DVec3::X * 0.8, DVec3::Z * 0.8, lambert(0.0, 100.0));
    model
}

#[test]
fn estimators_agree_in_a_room_parted_by_a_pane() {
    let means = |estimator: &str, histories: u32| -> Vec<Estimate> {
        let estimates = Case::new(&parted_room(estimator, histories), parted(window())).estimates();
        estimates.into_iter().map(|set| set[0]).collect()
    };
    // What the pane mirrors is light whose last surface may be a mirror: missing in both, and found by both beyond.
    let (local, reverse) = (means("local", 2048), means("reverse", 8192));
    let names = ["wall", "lit", "behind", "corner"];
    let comparisons = names.iter().zip(local).zip(reverse).map(|((name, a), b)| difference(name, a, b));
    assert_all(&comparisons.collect::<Vec<_>>());
}

#[test]
fn flux_is_emitted_absorbed_and_nothing_else() {
    for pane in [window(), Pane::new(1.5, Colour::WHITE), Pane::new(1.0, Colour::WHITE)] {
        let case = Case::new(&parted_room("local", 256), parted(pane));
        let (_, batches) = case.batches(1..u32::MAX);
        let [emitted, absorbed, escaped, lost, met] =
            ["emitted", "absorbed", "escaped", "lost", "met_delta"].map(|name| flux(&batches, name));
        assert_eq!((escaped.mean, lost.mean), (0.0, 0.0));
        assert!((emitted.mean - absorbed.mean).abs() < 5.0 * absorbed.standard_error + 1e-9, "{absorbed:?}");
        // Glass of index 1 is not there.
        assert_eq!(met.mean == 0.0, pane == Pane::new(1.0, Colour::WHITE), "{met:?}");
    }
}

#[test]
fn a_pane_of_index_one_changes_nothing() {
    let job = parted_room("local", 256);
    let nothing = Pane::new(1.0, Colour::WHITE);
    let mut model = parted(nothing);
    model.triangles.drain(12..14);
    model.surface_of.drain(12..14);
    let (empty, parted) = (Case::new(&job, model).estimates(), Case::new(&job, parted(nothing)).estimates());
    for (a, b) in empty.iter().zip(parted) {
        assert!((a[0].mean / b[0].mean - 1.0).abs() < 1e-4, "{a:?} {b:?}");
    }
}

#[test]
fn every_path_gives_the_same_bits() {
    assert_same_bits_on_every_path(&parted_room("local", 64), &parted(window()));
}
