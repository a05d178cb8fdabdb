//! Many lights: some of them are asked, the mean is that of all, and the bits do not depend on who computes them.

mod common;

use common::scenes::{PLAIN, add_quad, closed_box, lambert, omni};
use common::{Case, Comparison, Estimate, assert_all, compare, difference, failures};
use lampyris::geometry::Ray;
use lampyris::job::{Job, Transport};
use lampyris::math::{DMat3, DVec3, PI, cos, sin_cos};
use lampyris::photometry::Colour;
use lampyris::random::{Domain, Generator, Stream, sphere};
use lampyris::scene::photometric_web::{Luminaire, Photometry, Placement};
use lampyris::scene::{Light, Model, Reflectance, Surface};
use lampyris::transport::direct::{from_emitters, from_lights};
use lampyris::transport::lamps::{all, ask};
use lampyris::transport::receiver::{Receiver, Response};
use lampyris::transport::reverse::path;
use lampyris::transport::shared::of_lights;
use lampyris::validate::closed_forms::polygon;
use lampyris::validate::scenes::{UP, points};
use std::fs;
use std::process::Command;

/// An asymmetric downlight of 100 lm with a rectangular opening.
const WEB: &str = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 7 3 1 2 0.1 0.2 0\n1 1 20\n0 15 30 45 60 75 90\n0 45 90\n\
                   300 310 330 300 200 80 0\n300 305 310 270 160 50 0\n300 300 290 230 120 30 0\n";
/// A hall of 12 x 3 x 8 m; lights of all kinds hang in it.
const HALL: DVec3 = DVec3::new(12.0, 3.0, 8.0);

fn random(name: &str) -> Generator {
    Stream::new(7, Domain::Receiver, name).generator(0)
}

/// A place below the ceiling for light `i` of `count`.
fn place(i: u32, count: u32) -> DVec3 {
    let golden = 0.618_033_988_749_895 * f64::from(i);
    DVec3::new(
        HALL.x * (f64::from(i) + 0.5) / f64::from(count),
        2.2 + 0.6 * (golden * 3.0).fract(),
        HALL.z * golden.fract(),
    )
}

fn luminaire(position: DVec3, aim: DVec3, factor: f64) -> Luminaire {
    let web = Photometry::parse("web", WEB.as_bytes()).unwrap();
    let placement = Placement::new(position, DMat3::IDENTITY, aim, DVec3::X).unwrap();
    Luminaire::new(&web, &placement, Colour::grey(factor))
}

/// Light `i` of `count`: a spot, narrow or wide, an omni, a cosine or a web, of unlike strength and askew.
fn light(i: u32, count: u32) -> Light {
    let position = place(i, count);
    let (sin, cos) = sin_cos(f64::from(i));
    let direction = DVec3::new(0.6 * sin, -1.0, 0.6 * cos).normalize();
    let intensity = Colour::grey(f64::from(1 + i % 7));
    match i % 5 {
        0 => Light::Spot { position, direction, intensity: intensity * 10.0, inner: 0.1, outer: 0.25 },
        1 => Light::Spot { position, direction, intensity, inner: 0.6, outer: 1.4 },
        2 => Light::Omni { position, intensity },
        3 => Light::CosPower { position, direction, intensity, exponent: 3.0 },
        _ => Light::Luminaire(luminaire(position, direction, 0.02)),
    }
}

/// The hall with `count` lights, parallel light through its ceiling shut out, and two screens.
fn hall(count: u32, reflectance: f64) -> Model {
    let mut model = closed_box(HALL, &lambert(reflectance, 0.0));
    for x in [4.0, 8.0] {
        let mut screen = lambert(reflectance, 0.0);
        screen.double_sided = true;
        add_quad(&mut model, DVec3::new(x, 0.0, 3.0), DVec3::Y * 3.0, DVec3::Z, screen);
    }
    model.lights.extend((0..count).map(|i| light(i, count)));
    model
}

fn meter(position: DVec3, normal: DVec3) -> Receiver {
    Receiver { position, normal, response: Response::Cosine }
}

/// Receivers within a metre: on the floor, and where `mixed` in all directions.
fn tile(case: &Case, mixed: bool) -> Vec<Receiver> {
    let mut rng = random("tile");
    let one = |_| {
        let u = rng.uniform2();
        let position = case.scene.place([5.0 + u.x, 0.0 + if mixed { 1.5 * rng.uniform() } else { 0.0 }, 3.5 + u.y]);
        meter(position, if mixed { sphere(rng.uniform2()) } else { DVec3::Y })
    };
    (0..48).map(one).collect()
}

/// What `rounds` choices of `wanted` lights give each receiver, their weights through `weigh`, beside what all of them give.
fn asked_often(
    case: &Case,
    receivers: &[Receiver],
    wanted: u64,
    rounds: u32,
    weigh: fn(f64) -> f64,
) -> Vec<Comparison> {
    let mut rng = random("asked");
    let mut scores: Vec<Vec<f64>> = vec![Vec::new(); receivers.len()];
    for _ in 0..rounds {
        let asked: Vec<_> =
            ask(&case.scene, receivers, wanted, &mut rng).into_iter().map(|(i, w)| (i, weigh(w))).collect();
        let light = of_lights(&case.scene, receivers, &asked);
        scores.iter_mut().zip(light).for_each(|(scores, light)| scores.push(light.luminance()));
    }
    let exact = receivers.iter().map(|receiver| from_lights(&case.scene, receiver).luminance());
    let compared = exact.zip(scores).filter(|(exact, _)| *exact > 0.0).enumerate();
    compared.map(|(i, (exact, scores))| compare(i, Estimate::from_scores(scores.into_iter()), exact)).collect()
}

#[test]
fn the_mean_of_those_asked_is_what_all_give() {
    for mixed in [false, true] {
        let mut model = hall(300, 0.5);
        model.lights.push(Light::Directional { direction: DVec3::NEG_Y, illuminance: Colour::grey(5.0) });
        let case = Case::new(&points("p", [([1.0; 3], UP)]), model);
        let receivers = tile(&case, mixed);
        let all = asked_often(&case, &receivers, 24, 10_000, |weight| weight);
        assert!(all.len() >= 44, "{}", all.len());
        let brightest = all.iter().map(|c| c.reference).fold(0.0, f64::max);
        let (bright, dim): (Vec<_>, Vec<_>) = all.into_iter().partition(|c| c.reference > 0.5 * brightest);
        assert!(bright.len() >= 12, "{}", bright.len());
        assert_all(&bright);
        // Of those that look away from most lights the error may be a larger share of what they get.
        dim.iter().for_each(|c| assert!(c.z().is_some_and(|z| z.abs() < 6.0), "{}: z = {:?}", c.name, c.z()));
        // An estimate that forgets the probabilities is found out.
        let wrong = asked_often(&case, &receivers, 24, 1000, |_| 1.0);
        assert!(failures(&wrong).len() > wrong.len() / 2);
    }
}

#[test]
fn few_lights_and_as_many_as_are_wanted_are_all_asked_and_nothing_is_drawn() {
    for (count, wanted) in [(16, 4), (40, 40), (40, 1000)] {
        let case = Case::new(&points("p", [([1.0; 3], UP)]), hall(count, 0.5));
        let mut rng = random("few");
        assert_eq!(ask(&case.scene, &tile(&case, false), wanted, &mut rng), all(&case.scene));
        assert_eq!(rng.uniform(), random("few").uniform());
    }
    let case = Case::new(&points("p", [([1.0; 3], UP)]), hall(40, 0.5));
    assert!(ask(&case.scene, &tile(&case, false), 8, &mut random("some")).len() < 12);
}

/// Rectangles that emit, some on both sides, with their corners.
fn rectangles(model: &mut Model, count: u32) -> Vec<([DVec3; 4], f64, bool)> {
    let rectangle = |i: u32| {
        // In one plane but for a hair, so that from below none hides another, and away from the walls.
        let origin = DVec3::new(0.5 + 0.85 * place(i, count).x, 2.5, 0.2 + 0.9 * place(i, count).z);
        let (sin, cos) = sin_cos(f64::from(i));
        let (u, v) = (DVec3::new(0.2 * cos, 0.02 * sin, 0.2 * sin), DVec3::new(-0.1 * sin, 0.01, 0.1 * cos));
        let (luminance, both) = (f64::from(100 * (1 + i % 5)), i.is_multiple_of(3));
        let mut surface = lambert(0.0, luminance);
        surface.double_sided = both;
        add_quad(model, origin, u, v, surface);
        ([origin, origin + u, origin + u + v, origin + v], luminance, both)
    };
    (0..count).map(rectangle).collect()
}

/// The web of a Lambert surface of 1 m2 and 1 cd/m2 that looks down, every degree; its opening has 0.2 x 0.1 m.
fn lambert_web() -> Photometry {
    let list = |of: fn(u32) -> f64| (0..=90).map(|degree| format!("{}\n", of(degree))).collect::<String>();
    let (angles, cosines) = (list(f64::from), list(|degree| cos(f64::from(degree) * PI / 180.0)));
    let text = format!("IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 91 1 1 2 0.1 0.2 0\n1 1 20\n{angles}0\n{cosines}");
    Photometry::parse("web", text.as_bytes()).unwrap()
}

/// Luminaires that are Lambert rectangles, with their corners and luminance.
fn lambert_luminaires(model: &mut Model, count: u32) -> Vec<([DVec3; 4], f64)> {
    let web = lambert_web();
    let hang = |i: u32| {
        let (center, factor) = (DVec3::new(0.5 + 0.85 * place(i, count).x, 2.5, 7.75), f64::from(1 + i % 4));
        let entry = format!(
            "[[luminaire]]\nfile = \"web\"\nposition = {:?}\nextent = \"opening\"\nmultiplier = {factor}\n{}",
            center.to_array(),
            points("p", [([1.0; 3], UP)])
        );
        let job = Job::parse(&format!("scene = \"in memory\"\n{entry}"), "in memory").unwrap();
        model.hang(("in memory", "luminaire"), &job.luminaires[0], &web).unwrap();
        let (u, v) = (DVec3::X * 0.1, DVec3::Z * 0.05);
        ([center - u - v, center + u - v, center + u + v, center - u + v], factor / 0.02)
    };
    (0..count).map(hang).collect()
}

#[test]
fn many_lights_with_extent_sum_up_to_their_closed_forms() {
    // Black, so that nothing is reflected; the luminaires hang beside the rectangles.
    let mut model = closed_box(HALL, &lambert(0.0, 0.0));
    let mut all = rectangles(&mut model, 150);
    let luminaires = lambert_luminaires(&mut model, 40);
    all.extend(luminaires.into_iter().map(|(corners, luminance)| (corners, luminance, true)));
    let places = [([6.0, 0.5, 4.0], UP), ([0.5, 1.0, 0.5], UP), ([11.0, 0.5, 4.0], [-1.0, 0.0, 0.0])];
    let exact = |position: [f64; 3], normal: [f64; 3]| -> f64 {
        let (at, normal) = (DVec3::from(position), DVec3::from(normal));
        let of = |(corners, luminance, both): &([DVec3; 4], f64, bool)| {
            let front = (corners[1] - corners[0]).cross(corners[3] - corners[0]).dot(at - corners[0]) > 0.0;
            if front || *both { polygon(*luminance, at, normal, corners) } else { 0.0 }
        };
        all.iter().map(of).sum()
    };
    let run = "[run]\nhistories_per_batch = 256\nbatches = 64\nseed = 3\n";
    let case = Case::new(&(run.to_owned() + &points("p", places)), model);
    assert!(!case.scene.sources.shares_points());
    let shadows = 2e-3;
    let found = case.values();
    let compared = places.iter().zip(&found).enumerate();
    let all = compared.map(|(i, (&(p, n), e))| compare(i, *e, exact(p, n)).within(shadows));
    assert_all(&all.collect::<Vec<_>>());
}

#[test]
fn a_glossy_floor_sees_many_area_lights_as_paths_find_them() {
    let mut model = closed_box(HALL, &lambert(0.5, 0.0));
    let reflectance = Reflectance::metallic_roughness(Colour::grey(0.8), 1.0, 0.3);
    // closed_box adds the floor as its third quad.
    model.surfaces[2] = Surface { reflectance, ..lambert(0.0, 0.0) };
    rectangles(&mut model, 150);
    let case = Case::new(&points("p", [([1.0; 3], UP)]), model);
    let scene = &case.scene;
    let receiver = |x: f64| {
        let (from, to_eye) = (scene.place([x, 1.0, 4.0]), DVec3::new(-0.8, 0.6, 0.0));
        let hit = scene.geometry.closest_hit(&Ray { origin: from, direction: DVec3::NEG_Y }).unwrap();
        let response =
            Response::reflectance(scene, (hit.primitive, hit.position, hit.normal), to_eye, Colour::WHITE, 0.0);
        assert!(response.is_peaked());
        Receiver { position: hit.position, normal: hit.normal, response }
    };
    let mut rng = random("glossy");
    let of = |one: &mut dyn FnMut() -> f64, batches: u32, size: u32| {
        let batch = |_| (0..size).map(|_| one()).sum::<f64>() / f64::from(size);
        Estimate::from_scores((0..batches).map(batch).collect::<Vec<_>>().into_iter())
    };
    for (i, x) in [5.0, 5.6].into_iter().enumerate() {
        let receiver = receiver(x);
        let chosen = of(&mut || from_emitters(scene, &receiver, 64, &mut rng).luminance(), 1000, 1);
        let job = Transport::default();
        let met = of(&mut || path(scene, &job, &receiver, &mut rng).direct.luminance(), 400, 500);
        let both = difference(i, chosen, met);
        assert!(both.z().is_some_and(|z| z.abs() < 6.0), "{both:?}");
        assert!(both.estimate.standard_error < 0.02 * both.reference, "{both:?}");
    }
}

/// Pixels and lux-meters of the hall with many lights, its floor near walls included.
fn whole_job(run: &str) -> String {
    let camera = "[[camera]]\nname = \"view\"\neye = [0.5, 1.5, 0.5]\ntarget = [8.0, 0.5, 2.0]\nup = [0, 1, 0]\n\
                  vertical_fov_degrees = 0.1\nwidth = 3\nheight = 2\n";
    format!("[run]\n{run}{camera}") + &points("p", [([6.0, 0.0, 0.05], UP), ([11.0, 1.0, 4.0], [-1.0, 0.0, 0.0])])
}

#[test]
fn pictures_and_meters_are_those_of_paths_that_ask_every_light() {
    let values = |run: &str| -> Vec<Estimate> {
        let found = Case::new(&whole_job(run), hall(24, 0.5)).estimates();
        found.into_iter().flatten().collect()
    };
    let local = values("histories_per_batch = 64\nbatches = 256\nseed = 1\n");
    let reverse = values("histories_per_batch = 256\nbatches = 32\nseed = 2\n[transport]\nestimator = \"reverse\"\n");
    for (i, (a, b)) in local.iter().zip(&reverse).enumerate() {
        let error = (a.standard_error * a.standard_error + b.standard_error * b.standard_error).sqrt();
        // Eight comparisons at a family-wise 1e-6, Student's t with some 60 degrees.
        assert!((a.mean - b.mean).abs() < 6.5 * error, "{i}: {} against {}, error {error}", a.mean, b.mean);
        assert!(error < 0.02 * b.mean, "{i}: {} and {} of {}", a.standard_error, b.standard_error, b.mean);
    }
}

#[test]
fn threads_change_no_bit() {
    let run = "histories_per_batch = 64\nbatches = 16\nseed = 1\n";
    let scores = |threads: usize| {
        let mut model = hall(100, 0.5);
        rectangles(&mut model, 40);
        lambert_luminaires(&mut model, 20);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let case = Case::new(&whole_job(run), model);
            assert!(!case.scene.sources.shares_points());
            let (fixed, batches) = case.batches(0..u32::MAX);
            let values = batches.iter().flat_map(|b| b.sets.iter().flat_map(|s| s.value.iter().chain(&s.direct)));
            values.chain(fixed.iter().flatten()).map(|x| x.to_bits()).collect::<Vec<u64>>()
        })
    };
    let one = scores(1);
    assert!(one.len() > 16);
    assert_eq!(one, scores(2));
}

#[test]
fn workers_change_no_bit() {
    let plane = "[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 1, 0]\nreflectance = 0.5\n";
    let lamps: String = (0..50).map(|i| omni(place(i, 50).to_array(), 2.0 * PI)).collect();
    let run = "histories_per_batch = 64\nbatches = 16\nbatches_per_shard = 4\n";
    let digest = |workers: &str| {
        let at = tempfile::tempdir().unwrap();
        fs::write(at.path().join("job.toml"), whole_job(run) + PLAIN + plane + &lamps).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_lampyris"));
        command.args(["run", "-q", "job.toml", "-o", "out", "-w", workers]).current_dir(at.path());
        let out = command.output().unwrap();
        assert!(out.status.success(), "{out:?}");
        let text = fs::read(at.path().join("out/summary.json")).unwrap();
        serde_json::from_slice::<serde_json::Value>(&text).unwrap()["results_digest"].as_str().unwrap().to_owned()
    };
    assert_eq!(digest("1"), digest("2"));
}
