//! Where f32, cancellation or an empty tally could lie: far cameras, lamps of very different flux, contact with an
//! emitter, far spheres, bins that never scored, goniometer texels across the horizon.

mod common;

use common::scenes::{add_quad, closed_box, lambert, omni, point, spot_camera};
use common::{Case, assert_all, compare};
use lampyris::job::SetShape;
use lampyris::math::{DVec3, PI};
use lampyris::scene::Model;
use lampyris::tally::{SetTally, Tally};

fn run(histories: u32, batches: u32) -> String {
    format!("[run]\nhistories_per_batch = {histories}\nbatches = {batches}\nseed = 71\n")
}

/// Tallies of all batches of `case`.
fn tally(case: &Case) -> (Vec<SetShape>, Tally) {
    let shapes = case.job.sets();
    let mut tally = Tally::new(&shapes);
    case.batches(0..u32::MAX).1.iter().for_each(|b| tally.accumulate(b));
    (shapes, tally)
}

#[test]
fn far_cameras_see_every_triangle() {
    // A tilted floor of many triangles, framed from 1 m to 1000 km above: no ray may slip between box and triangle.
    let mut model = Model::default();
    let tilt = DVec3::new(1.0, 0.3, 0.0).normalize();
    for i in 0..40 {
        for j in 0..40 {
            let origin = tilt * (f64::from(i) - 20.0) + DVec3::Z * (f64::from(j) - 20.0);
            add_quad(&mut model, origin, DVec3::Z, tilt, lambert(0.5, 1.0));
        }
    }
    for height in [1e2, 1e4, 1e6] {
        let degrees = 2.0 * 180.0 / PI * lampyris::math::atan2(8.0, height);
        let job = run(1, 16)
            + &format!(
                "[[camera]]\nname = \"c\"\neye = [0, {height:?}, 0]\ntarget = [0, 0, 0]\nup = [0, 0, 1]\n\
                 vertical_fov_degrees = {degrees:?}\nwidth = 128\nheight = 128\npixel_samples = 1\n"
            );
        let (_, batches) = Case::new(&job, model.clone()).batches(0..1);
        let dark = batches[0].sets[0].direct.iter().filter(|l| **l < 0.9).count();
        assert_eq!(dark, 0, "{dark} of 16384 pixels see through the floor from {height} m");
    }
}

#[test]
fn a_small_panel_beside_a_huge_lamp_keeps_its_light() {
    // The lamp is below the floor, which absorbs it.
    let panel = |lamp: &str| {
        let mut model = Model::default();
        add_quad(&mut model, DVec3::new(-5.0, 0.0, -5.0), DVec3::Z * 10.0, DVec3::X * 10.0, lambert(0.0, 0.0));
        add_quad(&mut model, DVec3::new(0.0, 1.0, 0.0), DVec3::X * 0.1, DVec3::Z * 0.1, lambert(0.0, 0.08));
        let job = run(64, 32) + lamp + &point("e", [0.0, 0.1, 0.0], [0.0, 1.0, 0.0]);
        Case::new(&job, model).estimates()[0][0].mean
    };
    let (alone, beside) = (panel(""), panel(&omni([0.0, -3.0, 0.0], 1e12)));
    assert!(alone > 0.0 && (beside / alone - 1.0).abs() < 1e-9, "{beside} against {alone}");
}

#[test]
fn contact_with_an_emitting_wall() {
    // In the corner of an endless emitting wall half of the sky is lit: E = pi L / 2, at any distance.
    let mut model = Model::default();
    add_quad(&mut model, DVec3::new(0.0, 0.0, -500.0), DVec3::Y * 1000.0, DVec3::Z * 1000.0, lambert(0.0, 100.0));
    let distances = [1e-6, 1e-3, 0.1];
    let points = distances.iter().enumerate().map(|(i, x)| point(&format!("p{i}"), [*x, 0.0, 0.0], [0.0, 1.0, 0.0]));
    let estimates = Case::new(&(run(8192, 64) + &points.collect::<String>()), model).estimates();
    let all = distances.iter().enumerate().map(|(i, x)| compare(format!("{x} m"), estimates[i][0], 50.0 * PI));
    for c in all {
        // The wall ends at 500 m: 0.1 % at most.
        let near = (c.estimate.mean - c.reference).abs() < 5.0 * c.estimate.standard_error + 1e-3 * c.reference;
        assert!(near && c.estimate.relative_error() < 0.005, "{}: {:?}", c.name, c.estimate);
    }
}

#[test]
fn a_far_integrating_sphere_is_as_exact_as_a_near_one() {
    let far = 9e5;
    let job = run(256, 32)
        + &omni([far, 0.4, far], 100.0)
        + &format!("[[sphere]]\ncenter = [{far:?}, 0, {far:?}]\nradius = 1\nfacing = \"inward\"\nreflectance = 0.5\n")
        + &point("e", [far, 1.0, far], [0.0, -1.0, 0.0]);
    assert_all(&[compare("E", Case::new(&job, Model::default()).estimates()[0][0], 377.777_777_778)]);
}

#[test]
fn pixels_that_no_reflected_light_reached_have_no_error_bar() {
    // One emissive quad alone: its reflected light is unknown, and 1000 +- 0 would be a lie.
    let mut model = Model::default();
    add_quad(&mut model, DVec3::new(-1.0, 0.0, -1.0), DVec3::Z * 2.0, DVec3::X * 2.0, lambert(0.5, 1000.0));
    let job = run(16, 32)
        + &spot_camera("seen", [0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
        + &spot_camera("sky", [0.0, 1.0, 0.0], [0.0, 2.0, 0.0], [1.0, 0.0, 0.0]);
    let (_, tally) = tally(&Case::new(&job, model));
    let estimate = |set: usize| match &tally.sets[set] {
        SetTally::Moments(m) => m.bins.estimate(0, m.n),
        SetTally::Replicates(_) => panic!("a camera keeps moments"),
    };
    assert!(estimate(0).mean == 1000.0 && estimate(0).standard_error.is_nan(), "{:?}", estimate(0));
    assert!(estimate(1).mean == 0.0 && estimate(1).standard_error == 0.0, "{:?}", estimate(1));
}

#[test]
fn goniometer_texels_across_the_horizon_show_what_lies_above() {
    // A white furnace has L = M0 / (pi (1 - rho)) in every direction above the surface.
    let rho = 0.5;
    let job = run(256, 256)
        + "[[gonio]]\nname = \"up\"\nposition = [0.4, 0, 0.6]\nnormal = [0, 1, 0]\nsurface = true\nwidth = 4\nheight = 5\n\
           [[gonio]]\nname = \"side\"\nposition = [0, 0.4, 0.6]\nnormal = [1, 0, 0]\nsurface = true\nwidth = 3\nheight = 1\n";
    let case = Case::new(&job, closed_box(DVec3::ONE, &lambert(rho, 1.0 / PI)));
    let (fixed, batches) = case.batches(0..u32::MAX);
    let estimates = common::estimates(&batches);
    let mut all = Vec::new();
    let mut below = [0, 0];
    for set in 0..2 {
        for (bin, estimate) in estimates[set].iter().enumerate() {
            if fixed[set][bin].is_nan() {
                below[set] += 1;
            } else {
                all.push(compare(format!("set {set} bin {bin}"), *estimate, 1.0 / (PI * (1.0 - rho))));
            }
        }
    }
    // Upwards rows 0 to 2 of 5 are seen, row 2 in part; to the side one texel of three lies wholly behind the wall,
    // one wholly before it, and one half and half.
    assert_eq!(below, [8, 1]);
    assert_all(&all);
}
