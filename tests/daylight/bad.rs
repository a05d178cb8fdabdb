//! What is refused of skies, openings and area sources, and how.

use crate::common::scenes::add_quad;
use lampyris::job::Job;
use lampyris::math::DVec3;
use lampyris::scene::{Model, Scene};
use lampyris::validate::scenes::{lambert, omni, plane, point};

const UP: [f64; 3] = [0.0, 1.0, 0.0];

fn parsed(text: &str) -> Result<Job, String> {
    Job::parse(&(text.to_owned() + &point("p", [0.0; 3], UP)), "bad.toml").map_err(|e| e.to_string())
}

#[track_caller]
fn refused(text: &str, words: &[&str]) {
    let said = parsed(text).map(|_| ()).unwrap_err();
    assert!(words.iter().all(|word| said.contains(word)), "{said}");
}

#[test]
fn skies_out_of_range_are_refused_by_field_value_and_what_is_allowed() {
    let sky = |rest: &str| format!("[sky]\nmodel = \"overcast\"\nzenith_luminance = 1000\n{rest}");
    assert!(parsed(&sky("")).is_ok());
    refused("[sky]\nmodel = 1\n", &["sky", "(neither)", "either zenith_luminance or horizontal_illuminance"]);
    refused(&sky("horizontal_illuminance = 1\n"), &["sky", "(both)"]);
    refused("[sky]\nmodel = 16\nzenith_luminance = 1\n", &["sky.model", "16", "1 .. 15"]);
    refused("[sky]\nmodel = 12\nzenith_luminance = 1\n", &["sky.sun", "missing"]);
    refused("[sky]\nmodel = \"clear\"\nzenith_luminance = 1\n", &["sky.model"]);
    refused(&sky("north = [0, 2, 0]\n"), &["sky.north", "not parallel to up"]);
    refused(&sky("ground_reflectance = 1.1\n"), &["sky.ground_reflectance", "1.1", "0 .. 1"]);
    refused("[sky]\nmodel = 5\nzenith_luminance = nan\n", &["sky.zenith_luminance", "above 0"]);
    let sun = |elevation: f64, lux: f64| {
        sky(&format!("[sky.sun]\nazimuth_degrees = 0\nelevation_degrees = {elevation}\nilluminance = {lux}\n"))
    };
    assert!(parsed(&sun(45.0, 1e5)).is_ok());
    refused(&sun(-1.0, 1e5), &["sky.sun.elevation_degrees", "-1", "0 .. 90"]);
    refused(&sun(45.0, -1.0), &["sky.sun.illuminance", "-1"]);
    let factor = "daylight_factor = true\n";
    assert!(parsed(&sky(factor)).is_ok());
    refused(&sun(45.0, 1.0).replace("[sky.sun]", &format!("{factor}[sky.sun]")), &["sky.daylight_factor", "sky alone"]);
    refused(&(sky(factor) + &omni([0.0; 3], 1.0)), &["sky.daylight_factor", "sky alone"]);
}

#[test]
fn openings_that_are_no_flat_convex_polygons_are_refused() {
    let opening =
        |corners: &str| format!("[sky]\nmodel = 5\nzenith_luminance = 1\n[[opening]]\ncorners = [{corners}]\n");
    assert!(parsed(&opening("[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]")).is_ok());
    for wrong in [
        "[0, 0, 0], [1, 0, 0]",
        "[0, 0, 0], [1, 0, 0], [2, 0, 0]",
        "[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0]",
        "[0, 0, 0], [1, 0, 0], [1, 1, 0.5], [0, 1, 0]",
        "[0, 0, 0], [2, 0, 0], [0.5, 0.5, 0], [0, 2, 0]",
        // A star: every corner turns the same way, but twice around.
        "[0, 1, 0], [0.59, -0.81, 0], [-0.95, 0.31, 0], [0.95, 0.31, 0], [-0.59, -0.81, 0]",
        "[0, 0, 0], [1e7, 0, 0], [0, 1, 0]",
        // Closed with its first corner, and listed twice.
        "[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 1e-13, 0]",
        "[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]",
    ] {
        refused(&opening(wrong), &["opening[0].corners"]);
    }
}

#[test]
fn area_sources_out_of_range_are_refused() {
    let source = |kind: &str, rest: &str| format!("[[source]]\nkind = \"{kind}\"\nposition = [0, 0, 0]\n{rest}");
    let rest = "direction = [0, 1, 0]\nalong = [1, 0, 0]\nsize = [1, 1]\n";
    assert!(parsed(&source("rectangle", &format!("{rest}flux = 1\n"))).is_ok());
    refused(&source("rectangle", rest), &["source[0]", "either luminance or flux"]);
    refused(&source("rectangle", &format!("{rest}flux = 1\nluminance = 1\n")), &["source[0]", "(both)"]);
    refused(&source("rectangle", &format!("{rest}flux = -1\n")), &["source[0].flux", "-1"]);
    refused(&source("rectangle", &format!("{rest}flux = 1\n").replace("[1, 0, 0]", "[0, 3, 0]")), &["source[0].along"]);
    refused(&source("disc", "direction = [0, 1, 0]\nradius = 0\nflux = 1\n"), &["source[0].radius", "1e-6 .. 1e6 m"]);
    refused(&source("disc", "direction = [0, 0, 0]\nradius = 1\nflux = 1\n"), &["source[0].direction"]);
    refused(&source("sphere", "radius = 1\nflux = 1\nreflectance = 2\n"), &["source[0].reflectance", "2"]);
    refused(&source("sphere", "radius = 1\nflux = 1\nintensity = 2\n"), &["intensity"]);
}

#[test]
fn a_sky_needs_a_scene_with_an_end_and_openings_need_daylight() {
    let sky = "[sky]\nmodel = 5\nzenith_luminance = 1\n";
    let built = |text: &str, model: Model| Scene::new(model, &parsed(text).unwrap());
    let said = |text: &str| built(text, Model::default()).err().unwrap().to_string();
    assert!(said(&(sky.to_owned() + &plane([0.0; 3], UP, 0.5))).contains("no [[plane]] together with a [sky]"));
    assert!(said(sky).contains("at least one bounded surface"));
    let mut quad = Model::default();
    add_quad(&mut quad, DVec3::ZERO, DVec3::X, DVec3::Y, lambert(0.5, 0.0));
    let mut lit = quad.clone();
    add_quad(&mut lit, DVec3::Z, DVec3::X, DVec3::Y, lambert(0.5, 1.0));
    let lit = built(&(sky.to_owned() + "daylight_factor = true\n"), lit).unwrap();
    assert!(lit.warnings.iter().any(|w| w.contains("2 other sources")), "{:?}", lit.warnings);
    let opening = "[[opening]]\ncorners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\n";
    let idle = built(&(opening.to_owned() + &omni([0.0, 0.0, 1.0], 1.0)), quad).unwrap();
    assert!(idle.warnings.iter().any(|w| w.contains("[[opening]] ignored")), "{:?}", idle.warnings);
}
