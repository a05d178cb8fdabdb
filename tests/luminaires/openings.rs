//! Luminaires with their openings: the right lux near by and far off, and the right luminance in the eye.

use crate::gltf_builder::Builder;
use crate::meshes::boxed_mesh;
use crate::scenes::{SOMEWHERE, UP, assert_near, boxed, compare_both_ends, luminaire, lux, planned};
use crate::{bytes, photometry};
use lampyris::farm::plan::Plan;
use lampyris::farm::realization::Realization;
use lampyris::geometry::Ray;
use lampyris::math::{DVec3, PI};
use lampyris::random::{Domain, Generator, Stream, sphere};
use lampyris::scene::Scene;
use lampyris::transport::direct::from_panels;
use lampyris::transport::receiver::{Receiver, Response, look};
use lampyris::validate::scenes::{point, spot_camera};
use serde_json::json;

pub const SHAPES: [&str; 8] = [
    "rectangle",
    "disc",
    "box",
    "cylinder_upright",
    "cylinder_along_c0",
    "cylinder_across_c0",
    "sphere",
    "disc_upright",
];

fn random(name: &str) -> Generator {
    Stream::new(19, Domain::Trajectory, name).generator(0)
}

/// A luminaire at the origin with its opening, aim and C0 askew.
fn askew(file: &str) -> Scene {
    let job =
        luminaire(file, "position = [0, 0, 0]\naim = [0.3, -1.0, 0.2]\nc0 = [1.0, 0.0, 0.5]\nextent = \"opening\"");
    planned(&job, &[]).unwrap_or_else(|e| panic!("{e}")).0
}

/// Mean of `samples` estimates of the illuminance, and the standard error of the mean \[lx\].
pub fn sampled(samples: u32, mut estimate: impl FnMut() -> f64) -> (f64, f64) {
    let scores: Vec<f64> = (0..samples).map(|_| estimate()).collect();
    let n = f64::from(samples);
    let mean = scores.iter().sum::<f64>() / n;
    let square = scores.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (n - 1.0);
    (mean, (square / n).sqrt())
}

fn meter(scene: &Scene, position: [f64; 3], normal: [f64; 3]) -> Receiver {
    Receiver { position: scene.place(position), normal: DVec3::from(normal).normalize(), response: Response::Cosine }
}

#[test]
fn a_lambertian_disc_is_exact_near_by_and_a_point_far_off() {
    let at = |extent: &str| {
        planned(&luminaire("lambert_100lm.ies", &format!("position = [0.0, 0.0, 0.0]\nextent = \"{extent}\"")), &[])
            .unwrap()
            .0
    };
    let (disc, point) = (at("opening"), at("point"));
    assert_near(disc.sources.flux(), 100.0, 2e-5);
    let mut rng = random("disc");
    let radius = 0.1;
    for distance in [0.02, 0.1, 0.3, 1.0, 5.0] {
        // E = M r^2/(r^2 + d^2), M = flux over area.
        let exact = 100.0 / PI / (radius * radius + distance * distance);
        let receiver = meter(&disc, [0.0, -distance, 0.0], UP);
        let (mean, error) = sampled(1024, || from_panels(&disc, &receiver, 64, &mut rng).luminance());
        assert!((mean - exact).abs() < 5.0 * error + 1e-4 * exact, "{distance} m: {mean} +- {error} lx, not {exact}");
        assert!(error < 5e-3 * exact, "{distance} m: {error} of {exact}");
        let as_point = lux(&point, [0.0, -distance, 0.0], UP);
        assert_near(as_point, 100.0 / PI / (distance * distance), 1e-9);
    }
    // 1591.5 lx at 0.1 m where the point has twice as much; 31.8 lx and 1 % less at 1 m.
    assert_near(lux(&point, [0.0, -0.1, 0.0], UP) / (100.0 / PI / 0.02), 2.0, 1e-9);
}

/// Area of a shape of the test files as seen along `w`, given in the axes length, width, aim \[m2\].
pub fn shown(shape: &str, [x, y, z]: [f64; 3]) -> f64 {
    let across = |a: f64, b: f64| (a * a + b * b).sqrt();
    match shape {
        "rectangle" => 0.6 * 0.3 * z.abs(),
        "disc" => PI * 0.1 * 0.15 * z.abs(),
        "box" => 0.4 * 0.2 * z.abs() + 0.4 * 0.1 * y.abs() + 0.2 * 0.1 * x.abs(),
        "cylinder_upright" => PI * 0.01 * z.abs() + 0.2 * 0.3 * across(x, y),
        "cylinder_along_c0" => PI * 0.0025 * x.abs() + 0.1 * 0.6 * across(y, z),
        "cylinder_across_c0" => PI * 0.0025 * y.abs() + 0.1 * 0.6 * across(x, z),
        "sphere" => PI * 0.0225,
        "disc_upright" => PI * 0.15 * 0.1 * x.abs(),
        other => panic!("{other}"),
    }
}

#[test]
fn the_eye_sees_intensity_over_shown_area_in_twenty_directions() {
    let aim = DVec3::new(0.3, -1.0, 0.2).normalize();
    let c0 = DVec3::new(1.0, 0.0, 0.5);
    let c0 = (c0 - c0.dot(aim) * aim).normalize();
    let axes = [c0, c0.cross(aim), aim];
    for shape in SHAPES {
        let file = format!("opening_{shape}.ies");
        let (scene, web) = (askew(&file), photometry(&file).web);
        let mut rng = random(shape);
        let mut worst: f64 = 0.0;
        for _ in 0..20 {
            let w = sphere(rng.uniform2());
            let local = axes.map(|axis| axis.dot(w));
            let t = lampyris::math::acos(local[2].clamp(-1.0, 1.0));
            let intensity = web.intensity(t, lampyris::math::atan2(local[1], local[0]));
            // From afar, towards a point near the middle of the opening.
            let eye = scene.place([0.0; 3]) + 3.0 * w + DVec3::splat(1e-3);
            let seen = look(&scene, &Ray { origin: eye, direction: -w }, &mut rng).emitted.luminance();
            let expected = intensity / shown(shape, local);
            worst = worst.max((seen / expected - 1.0).abs());
        }
        // Flat faces instead of round ones; f32 corners.
        let tolerance = match shape {
            "sphere" => 5e-3,
            "rectangle" | "box" => 1e-5,
            _ => 2e-3,
        };
        assert!(worst < tolerance, "{shape}: luminance off by {worst}");
    }
}

/// The lamp `full.ies` whose file gives an opening of this width, length and height; `extent` is a line of its job, or none.
fn sized(size: &str, extent: &str) -> lampyris::error::Result<(Scene, Plan)> {
    let text = String::from_utf8(bytes("full.ies")).unwrap();
    let text = text.replace("1 -1 1 13 13 1 2 0 0 0", &format!("1 -1 1 13 13 1 2 {size}"));
    let job = luminaire("sized.ies", &format!("position = [0, 0, 0]\n{extent}"));
    planned(&job, &[("sized.ies", text.into_bytes())])
}

#[test]
fn an_opening_without_an_area_is_refused_and_shines_as_a_point() {
    // A point, a line, and signs that no edition has.
    for size in ["0 0 0", "0 1.2 0", "0 -1 -2", "1 1 -1"] {
        let refusal = sized(size, "extent = \"opening\"").err().unwrap().to_string();
        assert!(refusal.contains("no luminous opening with an area"), "{size}: {refusal}");
        assert!(sized(size, "extent = \"point\"").is_ok(), "{size}");
    }
    // A box without depth has two sides.
    let scene = sized("0 1.2 0.3", "extent = \"opening\"").unwrap().0;
    let receiver = meter(&scene, [0.0, 0.0, 2.0], [0.0, 0.0, -1.0]);
    let lit = from_panels(&scene, &receiver, 64, &mut random("flat")).luminance();
    assert!(lit > 10.0, "{lit} lx");
}

#[test]
fn far_off_an_opening_lights_as_a_point() {
    for shape in SHAPES {
        let scene = askew(&format!("opening_{shape}.ies"));
        let point = luminaire("full.ies", "position = [0, 0, 0]\naim = [0.3, -1.0, 0.2]\nc0 = [1.0, 0.0, 0.5]");
        let point = planned(&point, &[]).unwrap().0;
        let mut rng = random(shape);
        for position in [[0.0, -20.0, 3.0], [15.0, -10.0, -8.0], [4.0, 18.0, 6.0]] {
            let normal = position.map(|x: f64| -x);
            let receiver = meter(&scene, position, normal);
            let (mean, error) = sampled(128, || from_panels(&scene, &receiver, 64, &mut rng).luminance());
            let expected = lux(&point, position, normal);
            assert!(
                (mean - expected).abs() < 5.0 * error + 1e-3 * expected,
                "{shape}: {mean} +- {error}, not {expected}"
            );
            assert!(error < 8e-3 * expected, "{shape}: {error} of {expected}");
        }
    }
}

#[test]
fn the_lux_on_the_walls_of_a_closed_box_sum_up_to_the_flux_of_an_opening_and_of_a_mesh() {
    let size = [3.0, 2.0, 4.0];
    let of_file = |shape| (shape, boxed(&photometry(&format!("opening_{shape}.ies")), "opening", 0.0, SOMEWHERE));
    let of_mesh = ("mesh", boxed_mesh(&photometry("full.ies"), 0.0, SOMEWHERE));
    for (shape, experiment) in SHAPES.map(of_file).into_iter().chain([of_mesh]) {
        let mut rng = random(shape);
        // A random place on a random wall, in proportion to area: the sum is the mean times the whole area.
        let areas: Vec<f64> = (0..6).map(|k| size[(k / 2 + 1) % 3] * size[(k / 2 + 2) % 3]).collect();
        let all: f64 = areas.iter().sum();
        let (mean, error) = sampled(8_000, || {
            let mut left = rng.uniform() * all;
            let wall = areas.iter().position(|area| {
                left -= area;
                left < 0.0
            });
            let wall = wall.unwrap_or(5);
            let (axis, side) = (wall / 2, (wall % 2) as f64);
            let mut position = [0, 1, 2].map(|k| rng.uniform() * size[k]);
            position[axis] = side * size[axis];
            let mut normal = [0.0; 3];
            normal[axis] = 1.0 - 2.0 * side;
            all * from_panels(&experiment.scene, &meter(&experiment.scene, position, normal), 1, &mut rng).luminance()
        });
        let flux = experiment.scene.sources.flux();
        assert!((mean - flux).abs() < 5.0 * error, "{shape}: {mean} +- {error} lm, not {flux}");
        assert!(error < 0.03 * flux, "{shape}: {error} of {flux}");
    }
}

#[test]
fn light_of_an_opening_and_of_a_mesh_is_the_same_from_both_ends() {
    // Reverse paths find the opening by hitting it, and see its luminance; histories leave it; receivers sample it. A flat one
    // that shines along its plane is so bright there that paths would take long: it gets the light of a Lambert surface.
    for (shape, light) in [("rectangle", "lambert_100lm.ies"), ("box", "full.ies"), ("sphere", "full.ies")] {
        let mut web = photometry(light);
        web.opening = photometry(&format!("opening_{shape}.ies")).opening;
        // So large that paths find it, and that nothing near it is near a point.
        let opening = &mut web.opening;
        [&mut opening.length, &mut opening.width, &mut opening.height].into_iter().for_each(|x| *x *= 4.0);
        compare_both_ends(shape, 2048, |job| boxed(&web, "opening", 0.6, job));
    }
    compare_both_ends("mesh", 2048, |job| boxed_mesh(&photometry("full.ies"), 0.6, job));
}

/// The job of one lamp among matt surfaces, near enough to an opening that it is no point, and what it gives: bits of every score.
fn bits(file: &str, extent: &str) -> (Vec<u64>, Vec<String>) {
    let extent = if extent.is_empty() { String::new() } else { format!("extent = \"{extent}\"\n") };
    let job = "[run]\nhistories_per_batch = 16\nbatches = 16\n[[plane]]\npoint = [0, -1, 0]\nnormal = [0, 1, 0]\nreflectance = 0.5\n"
        .to_owned()
        + &luminaire(file, &format!("position = [0.0, 0.0, 0.0]\naim = [0.3, -1.0, 0.2]\n{extent}"))
        + &point("near", [0.3, -0.6, 0.2], UP)
        + &spot_camera("eye", [0.9, 0.9, 0.8], [0.0; 3], [0.3, 0.5, 0.8]);
    let (scene, plan) = planned(&job, &[]).unwrap_or_else(|e| panic!("{e}"));
    let scores = Realization::new(&plan.job, &scene, &plan.bounds).batch(0);
    let bits = scores.sets.iter().flat_map(|set| set.value.iter().map(|x| x.to_bits())).collect();
    (bits, plan.scene.warnings)
}

#[test]
fn left_out_the_extent_is_the_opening_of_the_file_and_else_a_point() {
    let opened = SHAPES.map(|shape| format!("opening_{shape}.ies"));
    let opened = opened.iter().map(String::as_str).chain(["symmetry_4.ldt", "absolute.ldt"]);
    for (file, meant) in
        opened.map(|file| (file, "opening")).chain([("full.ies", "point"), ("symmetry_0.ldt", "point")])
    {
        let (left_out, said) = (bits(file, ""), bits(file, meant));
        assert!(left_out.0.iter().any(|&b| f64::from_bits(b) > 0.0), "{file}");
        assert_eq!(left_out, said, "{file}");
        assert_eq!(left_out, bits(file, "file"), "{file}");
        // A point is another light than an opening: the two do not agree by chance.
        assert_eq!(left_out.0 == bits(file, "point").0, meant == "point", "{file}");
    }
}

#[test]
fn where_the_opening_of_the_file_has_no_area_a_point_shines_and_is_mentioned() {
    for (size, mentioned) in [("0 0 0", false), ("0 1.2 0", true), ("0 -1 -2", true), ("1 1 -1", true)] {
        let (scene, plan) = sized(size, "").unwrap();
        assert_eq!((scene.sources.lights.len(), scene.sources.panels.len()), (1, 0), "{size}");
        let said = plan.scene.warnings.iter().any(|w| w.contains("sized.ies: its luminous opening has no area"));
        assert_eq!(said, mentioned, "{size}: {:?}", plan.scene.warnings);
        assert!(
            !sized(size, "extent = \"point\"").unwrap().1.scene.warnings.iter().any(|w| w.contains("no area")),
            "{size}"
        );
    }
}

#[test]
fn an_opening_in_the_plane_of_a_surface_is_mentioned() {
    let mut builder = Builder::new();
    let ceiling = [[-3.0, 2.5, -2.0], [3.0, 2.5, -2.0], [0.0, 2.5, 4.0]];
    let mesh = builder.mesh(&ceiling, None);
    builder.node(json!({ "name": "ceiling", "mesh": mesh }));
    let [flush, cut] = ["lies in the plane of a surface", "is cut by a surface"];
    let mentioned = |file: &str, more: &str, what: &str| {
        let job = format!("scene = \"s.glb\"\n{}", luminaire(file, more));
        let plan = planned(&job, &[("s.glb", builder.glb())]).unwrap_or_else(|e| panic!("{e}")).1;
        let said = |w: &String| w.contains("at [0.300, 2.") && w.contains(what);
        plan.scene.warnings.iter().any(said)
    };
    for (file, more, expected) in [
        ("opening_rectangle.ies", "position = [0.3, 2.5, -0.2]", true),
        ("opening_disc.ies", "position = [0.3, 2.5, -0.2]\naim = [0, 1, 0]", true),
        ("opening_disc.ies", "position = [0.3, 2.499, -0.2]", false),
        ("opening_disc.ies", "position = [0.3, 2.501, -0.2]", false),
        // Through the ceiling, not in its plane; and what has no opening, or sides.
        ("opening_disc_upright.ies", "position = [0.3, 2.5, -0.2]", false),
        ("opening_disc.ies", "position = [0.3, 2.5, -0.2]\nextent = \"point\"", false),
    ] {
        assert_eq!(mentioned(file, more, flush), expected, "{file} {more}");
        assert!(!mentioned(file, more, cut), "{file} {more}");
    }
    for file in ["opening_box.ies", "opening_sphere.ies", "opening_cylinder_upright.ies"] {
        for (y, expected) in [(2.5, [false, true]), (2.2, [false; 2]), (2.9, [false; 2])] {
            let more = format!("position = [0.3, {y:.3}, -0.2]");
            assert_eq!([flush, cut].map(|what| mentioned(file, &more, what)), expected, "{file} {more}");
        }
    }
}

#[test]
fn a_point_has_no_opening() {
    let job = luminaire("full.ies", "position = [0, 0, 0]\nextent = \"opening\"");
    let error = planned(&job, &[]).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("luminaire[0].extent = opening: point: its file gives no luminous opening"), "{error}");
}
