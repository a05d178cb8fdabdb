//! Area sources of a job: rectangle, disc and sphere, near and far, seen, and reflecting.

use crate::common::{Case, Comparison, assert_all, compare, flux};
use lampyris::math::{DVec3, PI, acos, atan2, cos, sin_cos};
use lampyris::scene::Model;
use lampyris::validate::closed_forms::parallel_corner;
use lampyris::validate::scenes::{add_quad, closed_box, lambert, omni, point, points, run, spot_camera};

const UP: [f64; 3] = [0.0, 1.0, 0.0];

fn source(kind: &str, position: [f64; 3], what: &str) -> String {
    format!("[[source]]\nkind = \"{kind}\"\nposition = {position:?}\n{what}")
}

/// Far from everything that could reflect or hide.
fn alone(job: &str) -> Case {
    let mut model = Model::default();
    add_quad(&mut model, DVec3::new(-1.0, -9.0, -1.0), DVec3::Z, DVec3::X, lambert(0.0, 0.0));
    Case::new(&(run(4096, 32) + job), model)
}

fn each(job: &str, expected: &[(&str, f64)]) -> Vec<Comparison> {
    let values = alone(job).values();
    assert_eq!(values.len(), expected.len());
    values.into_iter().zip(expected).map(|(found, (name, expected))| compare(name, found, *expected)).collect()
}

#[test]
fn a_disc_of_100_lm_is_a_point_from_afar_and_not_from_nearby() {
    let radius = 0.1;
    let disc = source("disc", [0.0; 3], &format!("direction = [0, -1, 0]\nradius = {radius}\nflux = 100\n"));
    let luminance = 100.0 / (PI * PI * radius * radius);
    let below = |h: f64| ([0.0, -h, 0.0], UP);
    let job =
        disc + &points("p", [below(1.0), below(0.1), below(5.0)]) + &point("above", [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]);
    let near = |h: f64| PI * luminance * radius * radius / (radius * radius + h * h);
    let small = source("disc", [0.0; 3], "direction = [0, -1, 0]\nradius = 0.001\nflux = 100\n");
    let job_of_small = small + &points("p", [below(1.0)]);
    let mut all = each(&job, &[("1 m", near(1.0)), ("0.1 m", near(0.1)), ("5 m", near(5.0)), ("behind", 0.0)]);
    all.extend(each(&job_of_small, &[("as a point", 100.0 / PI / (1.0 + 1e-6))]));
    assert!((100.0 / PI - 31.83).abs() < 0.01);
    // Beside its axis: the closed form of a parallel disc.
    let (x, h): (f64, f64) = (0.3, 0.2);
    let a = x * x + h * h;
    let r2 = radius * radius;
    let beside = 0.5 * PI * luminance * (1.0 - (a - r2) / ((a + r2) * (a + r2) - 4.0 * r2 * x * x).sqrt());
    let disc =
        source("disc", [0.0; 3], &format!("direction = [0, -1, 0]\nradius = {radius}\nluminance = {luminance}\n"));
    all.extend(each(&(disc + &points("p", [([x, -h, 0.0], UP)])), &[("beside", beside)]));
    assert_all(&all.into_iter().map(|c| c.within(1e-5)).collect::<Vec<_>>());
}

#[test]
fn a_rectangle_has_its_view_factor_on_each_side_that_shines() {
    let what = "direction = [0, -1, 0]\nalong = [2, 5, 0]\nsize = [2.0, 1.0]\n";
    let meters = point("below", [1.0, 0.0, 0.5], UP) + &point("above", [1.0, 4.0, 0.5], [0.0, -1.0, 0.0]);
    let corner = PI * 1000.0 * parallel_corner(2.0, 1.0, 2.0);
    let one = source("rectangle", [0.0, 2.0, 0.0], &format!("{what}luminance = 1000\n"));
    let two = source("rectangle", [0.0, 2.0, 0.0], &format!("{what}flux = {}\ntwo_sided = true\n", 4000.0 * PI));
    let mut all = each(&(one + &meters), &[("below", corner), ("behind", 0.0)]);
    all.extend(each(&(two + &meters), &[("below, two sides", corner), ("above, two sides", corner)]));
    assert_all(&all);
}

#[test]
fn a_sphere_lights_as_from_its_middle_and_is_seen_with_its_luminance() {
    let (radius, luminance) = (0.5, 2000.0);
    let sphere = source("sphere", [0.0, 2.0, 0.0], &format!("radius = {radius}\nluminance = {luminance}\n"));
    let at = |d: f64| PI * luminance * (radius / d) * (radius / d);
    let job = sphere
        + &spot_camera("seen", [1.0, 0.0, 1.0], [0.1, 1.9, 0.0], UP)
        + &point("far", [0.0, -8.0, 0.0], UP)
        + &point("near", [0.0, 1.4, 0.0], UP)
        + &point("aslant", [0.0, 0.0, 0.0], [0.6, 0.8, 0.0]);
    let mut all = each(&job, &[("seen", luminance), ("far", at(10.0)), ("near", at(0.6)), ("aslant", 0.8 * at(2.0))]);
    // Its flux, and half of what meets it absorbed, in a closed black room with a lamp.
    let lamp = omni([0.2, 0.2, 0.2], 1.0);
    let what = "radius = 0.2\nflux = 50\nreflectance = 0.5\n";
    let job = run(4096, 32) + &lamp + &source("sphere", [0.5; 3], what) + &point("p", [0.1; 3], UP);
    let (_, batches) = Case::new(&job, closed_box(DVec3::ONE, &lambert(0.0, 0.0))).batches(0..u32::MAX);
    all.push(compare("emitted", flux(&batches, "emitted"), 50.0 + 4.0 * PI));
    all.push(compare("absorbed", flux(&batches, "absorbed"), 50.0 + 4.0 * PI));
    // Nothing is random here: what is left is that light is looked for from points lifted by some hundredths of a millimetre.
    assert_all(&all.into_iter().map(|c| c.within(1e-4)).collect::<Vec<_>>());
}

/// Illuminance by a sphere of luminance 1 whose middle lies at the angle with this cosine from the normal, its radius over its distance
/// `sine`; it may be partly below the horizon.
fn by_sphere(sine: f64, cosine: f64) -> f64 {
    if cosine >= sine {
        return PI * sine * sine * cosine;
    }
    let across = (1.0 - cosine * cosine).sqrt();
    let x = (1.0 / (sine * sine) - 1.0).sqrt();
    let y = -x * cosine / across;
    let root = (1.0 - y * y).sqrt();
    (cosine * acos(y) - x * across * root) * sine * sine + atan2(across * root, x)
}

#[test]
fn an_unobstructed_sphere_is_exact_at_any_distance_and_across_the_horizon() {
    let (radius, luminance) = (0.5, 2000.0);
    let sphere = source("sphere", [0.0, 2.0, 0.0], &format!("radius = {radius}\nluminance = {luminance}\n"));
    // Below its middle at this distance, the normal this angle from the way there.
    let places =
        [(0.501, 0.0), (0.6, 60.0), (0.6, 120.0), (2.0, 0.0), (2.0, 80.0), (2.0, 97.0), (20.0, 45.0), (20.0, 91.0)];
    let meter = |(d, degrees): (f64, f64)| {
        let (sin, cos) = sin_cos(degrees * PI / 180.0);
        ([0.0, 2.0 - d, 0.0], [sin, cos, 0.0])
    };
    let job = run(32, 16) + &sphere + &points("p", places.map(meter));
    let mut model = Model::default();
    add_quad(&mut model, DVec3::new(-1.0, -29.0, -1.0), DVec3::Z, DVec3::X, lambert(0.0, 0.0));
    for ((d, degrees), found) in places.into_iter().zip(Case::new(&job, model).values()) {
        let exact = luminance * by_sphere(radius / d, cos(degrees * PI / 180.0));
        assert!((found.mean - exact).abs() < 1e-3 * exact, "{d} m, {degrees} degrees: {} lx, not {exact}", found.mean);
        assert!(found.standard_error < 1e-4 * exact, "{d} m, {degrees} degrees: {} of {exact}", found.standard_error);
    }
}

#[test]
fn a_source_alone_that_reflects_has_an_interval() {
    for (kind, shape) in [("sphere", ""), ("disc", "direction = [0, -1, 0]\n")] {
        let what = format!("{shape}radius = 0.1\nluminance = 1000\nreflectance = 0.5\n");
        let job = run(32, 16) + &source(kind, [0.0, 1.0, 0.0], &what) + &point("p", [0.0; 3], UP);
        let found = Case::new(&job, Model::default()).values()[0];
        let across = 1000.0 * PI * if kind == "sphere" { 0.01 } else { 0.01 / 1.01 };
        assert!(
            (found.mean - across).abs() < 1e-3 * across && found.standard_error < 1e-3 * across,
            "{kind}: {found:?}"
        );
    }
}

#[test]
fn what_shines_is_black_unless_it_says_otherwise() {
    // A lamp before a lit and a dark half of a camera: only the reflectance makes the difference.
    let seen = |reflectance: f64| {
        let what = format!(
            "direction = [0, 0, 1]\nalong = [1, 0, 0]\nsize = [1, 1]\nluminance = 3\nreflectance = {reflectance}\n"
        );
        let camera = spot_camera("c", [0.0, 0.0, 2.0], [0.1, 0.1, 0.0], UP);
        alone(&(source("rectangle", [0.0; 3], &what) + &omni([0.1, 0.1, 1.0], 10.0) + &camera)).values()[0]
    };
    assert_all(&[compare("black", seen(0.0), 3.0), compare("grey", seen(0.5), 3.0 + 0.5 * 10.0 / PI).within(1e-4)]);
}
