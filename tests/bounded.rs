//! The bounded kernel with its continuation against closed forms, the plain local estimate and reverse estimation: near
//! edges, order by order, in colour, in open scenes, under peaked reflectances and behind mirrors.

mod common;

use common::scenes::{
    PLAIN, add_quad, closed_box, cube_with_floor, cube_with_mirrors, integrating_sphere, lambert, omni, point,
    spot_camera,
};
use common::{Case, Comparison, Estimate, assert_all, compare, difference};
use lampyris::geometry::visibility::Scratch;
use lampyris::math::{DVec3, PI, atan2};
use lampyris::photometry::Colour;
use lampyris::scene::{Light, Model, Reflectance, Surface};
use lampyris::tally::BatchScores;
use lampyris::transport::neighbours::Neighbours;
use lampyris::transport::receiver::{Receiver, Response};
use std::ops::Range;

const ALL: Range<u32> = 0..u32::MAX;

fn run(histories: u32, batches: u32) -> String {
    format!("[run]\nhistories_per_batch = {histories}\nbatches = {batches}\nseed = 71\n")
}

fn plain(job: &str) -> String {
    job.to_owned() + PLAIN
}

/// What histories and continuations give the first bin of every set, direct light at the receiver left out.
fn indirect(case: &Case, orders: Range<u32>) -> Vec<Estimate> {
    let (_, batches) = case.batches(orders);
    let of = |set: usize| Estimate::from_scores(batches.iter().map(|b| b.sets[set].value[0] - b.sets[set].direct[0]));
    (0..batches[0].sets.len()).map(of).collect()
}

/// The estimates `a` against the references `b` of the same quantities, which have errors of their own.
fn differences(name: &str, a: &[Estimate], b: &[Estimate]) -> Vec<Comparison> {
    a.iter().zip(b).enumerate().map(|(i, (a, b))| difference(format!("{name} {i}"), *a, *b)).collect()
}

/// Variance of the batch scores.
fn variance(e: &Estimate) -> f64 {
    e.standard_error * e.standard_error * e.n as f64
}

/// Lux-meters on the floor of a unit cube at 10 cm, 1 cm and 1 mm from a wall.
fn meters_at_the_edge() -> String {
    let meter = |mm: u32| point(&format!("mm{mm}"), [f64::from(mm) * 1e-3, 0.0, 0.4], [0.0, 1.0, 0.0]);
    [100, 10, 1].map(meter).concat()
}

/// One pixel half on the floor of a unit cube, half on its wall x = 0.
fn edge_pixel() -> String {
    spot_camera("edge", [0.6, 0.6, 0.4], [0.0, 0.0, 0.4], [0.0, 1.0, 0.0])
}

#[test]
fn a_white_furnace_is_uniform_up_to_its_edges_and_across_them() {
    let case = Case::new(
        &(run(2048, 64) + &meters_at_the_edge() + &edge_pixel()),
        closed_box(DVec3::ONE, &lambert(0.5, 1.0 / PI)),
    );
    let found = indirect(&case, ALL);
    let mut all: Vec<_> = (1..4).map(|i| compare(format!("meter {i}"), found[i], 1.0)).collect();
    // Cameras come first; L = M/pi without emission and what is reflected once.
    all.push(compare("edge pixel", found[0], 0.5 / PI));
    assert_all(&all);
}

#[test]
fn every_order_of_reflection_in_a_furnace_is_a_power_of_the_reflectance() {
    let case = Case::new(&(run(4096, 64) + &meters_at_the_edge()), closed_box(DVec3::ONE, &lambert(0.5, 1.0 / PI)));
    let order = |n: u32| {
        let found = indirect(&case, n..n + 1);
        (0..3)
            .map(move |i| compare(format!("order {n}, meter {i}"), found[i], 1.0 / f64::from(1 << n)))
            .collect::<Vec<_>>()
    };
    assert_all(&(1..=3).flat_map(order).collect::<Vec<_>>());
}

#[test]
fn each_channel_of_a_coloured_furnace_has_its_own_value_at_an_edge() {
    let rho = [0.5, 0.25, 0.7];
    let wall = Surface { reflectance: Reflectance::Lambert(Colour(rho)), ..lambert(0.0, 1.0 / PI) };
    let job = run(2048, 64) + "channels = \"rgb\"\n" + &edge_pixel();
    let (_, batches) = Case::new(&job, closed_box(DVec3::ONE, &wall)).batches(ALL);
    let channel = |c: usize| Estimate::from_scores(batches.iter().map(|b| b.sets[0].colour[0][c]));
    let all: Vec<_> =
        (0..3).map(|c| compare(format!("channel {c}"), channel(c), 1.0 / (PI * (1.0 - rho[c])))).collect();
    assert_all(&all);
}

#[test]
fn an_open_corner_has_the_form_factor_of_its_wall() {
    // The sun lights a wall of 1 x 1 m evenly, and a black floor before it: one reflection, and most light escapes.
    let mut model = Model::default();
    let (rho, across) = (0.5, 1000.0);
    add_quad(&mut model, DVec3::ZERO, DVec3::Y, DVec3::Z, lambert(rho, 0.0));
    add_quad(&mut model, DVec3::ZERO, DVec3::Z, DVec3::X, lambert(0.0, 0.0));
    let direction = DVec3::new(-1.0, -1.0, 0.0).normalize();
    model.lights.push(Light::Directional { direction, illuminance: Colour::grey(across) });
    let places = [("far", 0.2), ("near", 0.02), ("nearest", 0.002)];
    let meters = places.map(|(name, s)| point(name, [s, 0.0, 0.5], [0.0, 1.0, 0.0])).concat();
    let case = Case::new(&(run(4096, 64) + &meters), model);
    assert!(case.bounds.iter().all(|b| b.is_finite()), "every meter has a bound of its own: {:?}", case.bounds);
    let factor = |s: f64| {
        let far = (1.0 + s * s).sqrt();
        (atan2(0.5, s) - s / far * atan2(0.5, far)) / PI
    };
    let found = indirect(&case, ALL);
    let wall = rho * across * 0.5f64.sqrt();
    let all: Vec<_> = places.into_iter().zip(found).map(|((name, s), e)| compare(name, e, wall * factor(s))).collect();
    assert_all(&all);
}

#[test]
fn in_an_integrating_sphere_nothing_is_bounded_and_no_bit_changes() {
    let scene = integrating_sphere(0.5)
        + &omni([0.4, 0.0, 0.0], 100.0)
        + &point("pole", [0.0, 1.0, 0.0], [0.0, -1.0, 0.0])
        + &spot_camera("seen", [0.0, 0.1, 0.0], [0.6, 0.0, 0.8], [0.0, 1.0, 0.0]);
    let scores = |job: &str| {
        let (_, batches) = Case::new(job, Model::default()).batches(ALL);
        batches.iter().flat_map(|b| [0, 1].map(|set| b.sets[set].value[0].to_bits())).collect::<Vec<_>>()
    };
    let job = run(64, 16) + &scene;
    assert_eq!(scores(&job), scores(&plain(&job)));
}

/// A closed unit cube with a dielectric floor of `roughness`, whose ceiling emits `luminance`.
fn cube_with_peaked_floor(roughness: f64, luminance: f64) -> Model {
    let model = cube_with_floor(roughness, 0.0, luminance);
    assert!(model.surfaces[2].reflectance.is_peaked());
    model
}

/// The peaked floor seen by an eye, and a lux-meter on the wall beside it.
fn peaked_receivers() -> String {
    spot_camera("floor", [0.4, 0.9, 0.4], [0.5, 0.0, 0.6], [1.0, 0.0, 0.0])
        + &spot_camera("flat", [0.2, 0.3, 0.4], [0.6, 0.0, 0.5], [0.0, 1.0, 0.0])
        + &point("wall", [0.0, 0.1, 0.4], [1.0, 0.0, 0.0])
}

/// Bounded local and reverse estimation of the same receivers.
fn bounded_and_reverse(model: &Model, receivers: &str, local: (u32, u32), reverse: (u32, u32)) -> [Vec<Estimate>; 2] {
    let reverse = run(reverse.0, reverse.1) + receivers + "[transport]\nestimator = \"reverse\"\n";
    [run(local.0, local.1) + receivers, reverse].map(|job| Case::new(&job, model.clone()).values())
}

#[test]
fn a_peaked_floor_under_an_area_light_is_as_reverse_paths_find_it() {
    let mut all = Vec::new();
    for roughness in [0.05, 0.1] {
        let model = cube_with_peaked_floor(roughness, 20.0);
        let [local, reverse] = bounded_and_reverse(&model, &peaked_receivers(), (1024, 64), (2048, 64));
        all.extend(differences(&format!("roughness {roughness}, receiver"), &local, &reverse));
    }
    assert_all(&all);
}

#[test]
fn a_floor_that_is_peaked_towards_grazing_alone_is_as_reverse_paths_find_it() {
    let model = cube_with_peaked_floor(0.25, 20.0);
    let law = &model.surfaces[2].reflectance;
    assert!(!law.is_peaked_at(1.0) && law.is_peaked_at(0.17));
    let receivers = spot_camera("flat", [0.1, 0.12, 0.4], [0.78, 0.0, 0.5], [0.0, 1.0, 0.0])
        + &point("wall", [0.0, 0.05, 0.4], [1.0, 0.0, 0.0]);
    let [local, reverse] = bounded_and_reverse(&model, &receivers, (1024, 64), (4096, 64));
    assert_all(&differences("receiver", &local, &reverse));
    let job = run(64, 128) + &receivers;
    let [bounded, plain] = [job.clone(), plain(&job)].map(|job| indirect(&Case::new(&job, model.clone()), ALL));
    for set in [0, 1] {
        let gain = variance(&plain[set]) / variance(&bounded[set]);
        assert!(gain > 4.0, "receiver {set}: the variance falls {gain} times");
    }
}

#[test]
fn a_peaked_floor_under_a_lamp_is_as_reverse_paths_find_it() {
    let model = cube_with_peaked_floor(0.1, 0.0);
    let receivers = omni([0.5, 0.7, 0.5], 10.0) + &peaked_receivers();
    let [local, reverse] = bounded_and_reverse(&model, &receivers, (4096, 64), (8192, 64));
    assert_all(&differences("receiver", &local, &reverse));
}

#[test]
fn the_image_of_a_lamp_in_a_narrow_lobe_is_told() {
    let caustic = |roughness: f64, luminance: f64, source: &str| {
        let job = run(256, 16) + source + &peaked_receivers();
        let case = Case::new(&job, cube_with_peaked_floor(roughness, luminance));
        let batches = case.batches(ALL).1;
        let mean = |set: usize| Estimate::from_scores(batches.iter().map(|b| b.sets[set].caustic[0])).mean;
        let reflected = indirect(&case, ALL);
        [0, 1, 2].map(|set| mean(set) / reflected[set].mean)
    };
    let lamp = omni([0.5, 0.7, 0.5], 10.0);
    for share in [caustic(0.05, 0.0, &lamp), caustic(0.1, 0.0, &lamp)] {
        // The wall sees the floor, which the lamp lights straight; the floor sees itself over the walls only.
        assert!((0.05..0.5).contains(&share[2]), "{share:?}");
        assert!(share[..2].iter().all(|s| (0.0..share[2]).contains(s) && *s > 0.0), "{share:?}");
    }
    // Light that has an extent is found by the lobe, whatever its width.
    assert_eq!(caustic(0.1, 20.0, ""), [0.0; 3]);
}

#[test]
fn reverse_paths_tell_the_same_of_the_image_of_a_lamp() {
    let model = cube_with_peaked_floor(0.1, 0.0);
    let receivers = omni([0.5, 0.7, 0.5], 10.0) + &point("wall", [0.0, 0.1, 0.4], [1.0, 0.0, 0.0]);
    // With nothing carried by connections the paths of both are the same, and so is the light at their points.
    let job = |estimator: &str| run(2048, 64) + &receivers + &format!("[transport]\nestimator = \"{estimator}\"\n");
    let told = |estimator: &str| {
        let mut case = Case::new(&job(estimator), model.clone());
        case.bound_all(1e-12);
        let batches = case.batches(ALL).1;
        Estimate::from_scores(batches.iter().map(|b| b.sets[0].caustic[0]))
    };
    assert_all(&differences("caustic", &[told("local")], &[told("reverse")]));
}

#[test]
fn the_bound_takes_the_spikes_of_peaks_and_edges_away() {
    let job = run(256, 256) + &omni([0.5, 0.7, 0.5], 10.0) + &peaked_receivers() + &edge_pixel();
    let model = cube_with_peaked_floor(0.05, 0.0);
    let [bounded, plain] = [job.clone(), plain(&job)].map(|job| indirect(&Case::new(&job, model.clone()), ALL));
    for (set, least) in [(0, 10.0), (1, 10.0), (2, 10.0)] {
        let gain = variance(&plain[set]) / variance(&bounded[set]);
        assert!(gain > least, "receiver {set}: the variance falls {gain} times");
    }
}

#[test]
fn light_that_comes_over_mirrors_is_neither_lost_nor_counted_twice() {
    // Meters beside the corner of the polished floor and the matt wall x = 1.
    let model = cube_with_mirrors(0.0);
    let job = run(128, 1024)
        + &omni([0.4, 0.6, 0.5], 10.0)
        + &point("wall", [1.0, 0.15, 0.4], [-1.0, 0.0, 0.0])
        + &point("floor", [0.85, 0.0, 0.4], [0.0, 1.0, 0.0])
        + &point("air", [0.8, 0.4, 0.4], [1.0, 0.0, 0.3])
        + &spot_camera("polished", [0.5, 0.7, 0.5], [0.85, 0.0, 0.6], [1.0, 0.0, 0.0])
            .replace("samples = 1", "samples = 16");
    let [bounded, plain] = [job.clone(), plain(&job)].map(|job| Case::new(&job, model.clone()).batches(ALL).1);
    // Batch by batch both have the same histories and positions: what they share cancels.
    let compared = |set: usize| {
        let scores = |batches: &[BatchScores]| batches.iter().map(|b| b.sets[set].value[0]).collect::<Vec<_>>();
        let (bounded, plain) = (scores(&bounded), scores(&plain));
        let reference = Estimate::from_scores(plain.iter().copied()).mean;
        let difference = Estimate::from_scores(bounded.iter().zip(&plain).map(|(a, b)| a - b));
        // Two estimates, not one.
        assert!(difference.standard_error > 1e-5 * reference, "receiver {set}: {difference:?}");
        compare(format!("receiver {set}"), difference.shifted(reference), reference)
    };
    assert_all(&(0..4).map(compared).collect::<Vec<_>>());
}

/// A lux-meter of the unit cube, in re-centred coordinates.
fn meter(position: [f64; 3], normal: DVec3) -> Receiver {
    Receiver { position: DVec3::from(position) - 0.5, normal, response: Response::Cosine }
}

#[test]
fn a_point_found_by_one_receiver_counts_at_all_that_see_it_as_near() {
    let job = run(64, 16) + &meters_at_the_edge();
    let case = Case::new(&job, closed_box(DVec3::ONE, &lambert(0.5, 1.0 / PI)));
    let y = meter([0.0, 0.1, 0.4], DVec3::X);
    let floor = |x: f64, z: f64| meter([x, 0.0, z], DVec3::Y);
    // Below the floor, farther away than the bound reaches, and one that looks in vain for light.
    let black = Response::reflectance(&case.scene, (0, DVec3::ZERO, DVec3::Y), DVec3::Y, Colour::BLACK, 0.0);
    let others =
        [meter([0.1, 0.0, 0.4], DVec3::NEG_Y), floor(0.9, 0.9), Receiver { response: black, ..floor(0.1, 0.42) }];
    let near = [floor(0.1, 0.4), floor(0.02, 0.45), floor(0.2, 0.3)];
    let bound = 1.0;
    let factor = |r: &Receiver| {
        let way = y.position - r.position;
        way.dot(r.normal) * -way.dot(y.normal) / (way.length_squared() * way.length_squared())
    };
    let weights = |receivers: &[Receiver]| {
        let neighbours = Neighbours::new(&case.scene, receivers.iter(), bound);
        neighbours.weights(&case.scene, &y, 0, &mut Scratch::default()).map(|w| w.luminance())
    };
    let close = |a: f64, b: f64| (a - b).abs() < 1e-12 * b;
    let alone = weights(&near[..1]);
    assert!(close(alone[0], PI * (1.0 - bound / factor(&near[0]))), "{alone:?}");
    let all = weights(&[&near[..], &others].concat());
    let density: f64 = near.iter().map(factor).sum();
    for (weight, receiver) in all.iter().zip(&near) {
        assert!(factor(receiver) > bound && close(*weight, PI * (factor(receiver) - bound) / density), "{all:?}");
    }
    assert!(all[3..].iter().all(|&w| w == 0.0), "{all:?}");
}

#[test]
fn many_neighbours_beside_a_wall_have_the_means_of_reverse_paths() {
    let grid = "[[grid]]\nname = \"strip\"\norigin = [0.001, 0.0, 0.3]\nu = [0.1, 0.0, 0.0]\nv = [0.0, 0.0, 0.3]\n\
                normal = [0.0, 1.0, 0.0]\ncolumns = 8\nrows = 8\n";
    let model = closed_box(DVec3::ONE, &lambert(0.6, 1.0 / PI));
    let of_grid = |job: &str| {
        let (_, batches) = Case::new(job, model.clone()).batches(ALL);
        let bin = |i: usize| Estimate::from_scores(batches.iter().map(|b| b.sets[0].value[i]));
        [0, 3, 7, 36, 63].map(bin)
    };
    let local = of_grid(&(run(1024, 64) + grid));
    let reverse = of_grid(&(run(1024, 64) + grid + "[transport]\nestimator = \"reverse\"\n"));
    assert_all(&differences("bin", &local, &reverse));
}

#[test]
fn the_variance_beside_a_wall_falls_as_the_number_of_histories() {
    let variance_of = |histories: u32| {
        let job = run(histories, 256).replace("seed", "sampling = \"random\"\nseed")
            + &omni([0.5, 0.7, 0.5], 10.0)
            + &point("near", [0.003, 0.0, 0.4], [0.0, 1.0, 0.0]);
        variance(&indirect(&Case::new(&job, closed_box(DVec3::ONE, &lambert(0.5, 0.0))), ALL)[0])
    };
    let gain = variance_of(32) / variance_of(512);
    // F with 255 and 255 degrees of freedom lies within a factor 1.9 with probability 1 - 1e-6.
    assert!((16.0 / 1.9..16.0 * 1.9).contains(&gain), "16 times the histories: the variance falls {gain} times");
}
