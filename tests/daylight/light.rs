//! Light that starts in the sky: a furnace, the flux balance, what cameras see.

use crate::common::scenes::mirror;
use crate::common::{Case, assert_all, compare, difference, flux};
use crate::{Hole, room, sky};
use lampyris::math::{DVec3, PI};
use lampyris::scene::{Model, Surface};
use lampyris::validate::scenes::{add_quad, lambert, point, run, spot_camera};

/// Three white quads that make a corner, seen from both sides.
fn corner(reflectance: f64) -> Model {
    let mut model = Model::default();
    let white = Surface { double_sided: true, ..lambert(reflectance, 0.0) };
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    for (u, v) in [(x, z), (y, x), (z, y)] {
        add_quad(&mut model, DVec3::ZERO, u, v, white.clone());
    }
    model
}

/// Whatever reflects all light cannot be told from the same luminance all around.
#[test]
fn white_surfaces_vanish_in_an_even_environment() {
    let meters = point("floor", [0.3, 0.0, 0.4], [0.0, 1.0, 0.0])
        + &point("air", [0.6, 0.5, 0.5], [-1.0, 0.3, -0.5])
        + &spot_camera("wall", [0.6, 0.5, 0.8], [0.3, 0.4, 0.0], [0.0, 1.0, 0.0])
        + &spot_camera("outside", [-0.6, -0.5, -0.8], [0.3, 0.0, 0.4], [0.0, 0.0, 1.0]);
    let even = sky("\"uniform\"", 100.0, "ground_reflectance = 1.0\n");
    // One opening that most light passes, one nowhere near the scene: neither may change anything.
    let near = "[[opening]]\ncorners = [[0.9, 0, 0], [0, 0.9, 0], [0, 0, 0.9]]\n";
    let far = "[[opening]]\ncorners = [[5, 0, 0], [5, 1, 0], [5, 1, 3]]\n";
    let mut all = Vec::new();
    for openings in [String::new(), near.to_owned() + far] {
        let case = Case::new(&(run(16384, 64) + &even + &openings + &meters), corner(1.0));
        for (shape, found) in case.job.sets().iter().zip(case.values()) {
            let expected = if shape.name == "floor" || shape.name == "air" { 100.0 * PI } else { 100.0 };
            all.push(compare(format!("{} {}", shape.name, openings.len()), found, expected));
        }
    }
    assert_all(&all);
}

#[test]
fn emitted_flux_is_that_of_the_disc_around_the_scene() {
    let sun = "ground_reflectance = 0.4\n[sky.sun]\nazimuth_degrees = 20\nelevation_degrees = 50\nilluminance = 500\n";
    let job = run(4096, 32) + &sky("\"uniform\"", 100.0, sun) + &point("p", [0.3, 0.2, 0.4], [0.0, 1.0, 0.0]);
    let case = Case::new(&job, corner(0.5));
    // The ball around the unit cube.
    let disc = PI * 0.75;
    let height = lampyris::math::sin(50.0 * PI / 180.0);
    let ground = 0.4 * (100.0 * PI + 500.0 * height) / PI;
    let expected = disc * (2.0 * PI * (100.0 + ground) + 500.0);
    assert!((case.scene.sources.flux() / expected - 1.0).abs() < 1e-6);
    let (_, batches) = case.batches(0..u32::MAX);
    assert_all(&[compare("emitted", flux(&batches, "emitted"), expected)]);
    assert_eq!(flux(&batches, "lost").mean, 0.0);
}

#[test]
fn cameras_see_the_sky_through_windows_and_over_mirrors() {
    let eye = [2.0, 1.5, 4.0];
    let up = [0.0, 1.0, 0.0];
    let mut model = room(Hole::Facade, &lambert(0.5, 0.0));
    // A mirror on the back wall, its front towards the window.
    add_quad(&mut model, DVec3::new(1.0, 0.5, 4.99), DVec3::Y * 2.0, DVec3::X * 2.0, mirror(0.9));
    let straight = [2.1, 1.9, 0.0];
    let over = [2.08, 1.65, 4.99];
    let job = run(8, 16)
        + &sky("\"overcast\"", 900.0, "ground_reflectance = 0.3\n")
        + &spot_camera("straight", eye, straight, up)
        + &spot_camera("low", eye, [1.9, 1.1, 0.0], up)
        + &spot_camera("over", [2.0, 1.6, 4.0], over, up);
    let case = Case::new(&job, model);
    let luminance = |w: DVec3| if w.y < 0.0 { 0.3 * 900.0 * 7.0 / 9.0 } else { 300.0 * (1.0 + 2.0 * w.y) };
    let way = |a: [f64; 3], b: [f64; 3]| (DVec3::from(b) - DVec3::from(a)).normalize();
    let reflected = way([2.0, 1.6, 4.0], over) * DVec3::new(1.0, 1.0, -1.0);
    let values = case.values();
    let all = [
        compare("straight", values[0], luminance(way(eye, straight))).within(1e-4),
        compare("low", values[1], luminance(way(eye, [1.9, 1.1, 0.0]))).within(1e-4),
        compare("over a mirror", values[2], 0.9 * luminance(reflected)).within(1e-3),
    ];
    assert_all(&all);
}

/// A polished floor: the peaked response looks at the sky as well.
#[test]
fn glossy_surfaces_reflect_the_sky_as_reverse_paths_find_it() {
    let mut model = Model::default();
    for (i, (roughness, metallic)) in [(0.15, 1.0), (0.3, 0.0), (0.6, 1.0)].into_iter().enumerate() {
        let base = lampyris::photometry::Colour::grey(0.7);
        let reflectance = lampyris::scene::Reflectance::metallic_roughness(base, metallic, roughness);
        let origin = DVec3::X * (1.5 * i as f64);
        add_quad(&mut model, origin, DVec3::Z, DVec3::X, Surface { reflectance, ..lambert(0.0, 0.0) });
    }
    let camera = |i: i32| {
        let x = 1.5 * f64::from(i) + 0.5;
        spot_camera(&format!("c{i}"), [x, 1.0, 2.0], [x, 0.0, 0.5], [0.0, 1.0, 0.0])
    };
    let sun = "[sky.sun]\nazimuth_degrees = 0\nelevation_degrees = 40\n";
    let job = sky("12", 1000.0, sun)
        + &camera(0)
        + &camera(1)
        + &camera(2)
        + "[[opening]]\ncorners = [[0, 2, -1], [4, 2, -1], [4, 3, -1], [0, 3, -1]]\n";
    let of = |estimator: &str, histories| {
        let run = format!("{}[transport]\nestimator = \"{estimator}\"\n", run(histories, 64));
        Case::new(&(run + &job), model.clone()).values()
    };
    let pairs = of("local", 4096).into_iter().zip(of("reverse", 8192)).enumerate();
    assert_all(&pairs.map(|(i, (a, b))| difference(format!("camera {i}"), a, b)).collect::<Vec<_>>());
}
