//! Many trajectories traced for each history that is connected: the same expectations, smaller errors.

mod common;

use common::scenes::{closed_box, cube_with_floor, lambert, point, spot_camera};
use common::{Case, Comparison, Estimate, assert_all, compare, difference};
use lampyris::math::{DVec3, PI};
use lampyris::photometry::Colour;
use lampyris::random::{Domain, Stream};
use lampyris::scene::Model;
use lampyris::transport::connection::{Connectors, Link};
use lampyris::transport::pool::Pool;
use lampyris::transport::receiver::{Receiver, Response};
use lampyris::transport::trajectory::{Vertex, trace};
use std::ops::Range;

const ALL: Range<u32> = 0..u32::MAX;

fn run(histories: u32, thinning: u32, seed: u32) -> String {
    format!("[run]\nhistories_per_batch = {histories}\nthinning = {thinning}\nbatches = 64\nseed = {seed}\n")
}

fn meters() -> String {
    let meter = |mm: u32| point(&format!("mm{mm}"), [f64::from(mm) * 1e-3, 0.0, 0.4], [0.0, 1.0, 0.0]);
    [500, 100, 10, 1].map(meter).concat()
}

/// What histories and continuations give the first bin of every set, direct light left out.
fn indirect(job: &str, model: Model, orders: Range<u32>) -> Vec<Estimate> {
    let (_, batches) = Case::new(job, model).batches(orders);
    let of = |set: usize| Estimate::from_scores(batches.iter().map(|b| b.sets[set].value[0] - b.sets[set].direct[0]));
    (0..batches[0].sets.len()).map(of).collect()
}

#[test]
fn every_order_of_a_furnace_is_a_power_of_the_reflectance() {
    let furnace = || closed_box(DVec3::ONE, &lambert(0.5, 1.0 / PI));
    let order = |n: u32| -> Vec<Comparison> {
        let found = indirect(&(run(1024, 8, 71) + &meters()), furnace(), n..n + 1);
        let name = |i| format!("order {n}, meter {i}");
        found.iter().enumerate().map(|(i, e)| compare(name(i), *e, 1.0 / f64::from(1 << n))).collect()
    };
    assert_all(&(1..=3).flat_map(order).collect::<Vec<_>>());
}

#[test]
fn a_cavity_with_a_peaked_floor_in_colour_is_as_without() {
    let receivers = meters() + &spot_camera("floor", [0.5, 0.6, 0.4], [0.3, 0.0, 0.4], [0.0, 0.0, 1.0]);
    let of = |histories, thinning, seed| {
        let run = run(histories, thinning, seed) + "channels = \"rgb\"\n";
        indirect(&(run + &receivers), cube_with_floor(0.3, 0.9, 1.0), ALL)
    };
    let (thinned, plain) = (of(512, 8, 5), of(4096, 1, 6));
    let all = thinned.iter().zip(&plain).enumerate();
    assert_all(&all.map(|(i, (a, b))| difference(format!("receiver {i}"), *a, *b)).collect::<Vec<_>>());
}

#[test]
fn the_error_falls_although_no_more_is_connected() {
    let job = |thinning| run(512, thinning, 9) + &point("middle", [0.5, 0.0, 0.4], [0.0, 1.0, 0.0]);
    let model = || closed_box(DVec3::ONE, &lambert(0.5, 1.0 / PI));
    let [plain, thinned] = [1, 16].map(|thinning| indirect(&job(thinning), model(), ALL)[0].standard_error);
    assert!(thinned < 0.6 * plain, "{thinned} with thinning, {plain} without");
}

/// Lux-meters in a corner of the floor: some vertices are near, some behind them, some far.
fn meters_in_a_corner() -> Vec<Receiver> {
    let at = |i: usize| DVec3::new(0.02 + 0.06 * (i % 4) as f64, 0.0, 0.02 + 0.06 * (i / 4) as f64);
    (0..16).map(|i| Receiver { position: at(i), normal: DVec3::Y, response: Response::Cosine }).collect()
}

#[test]
fn what_a_tile_chooses_gives_on_average_what_all_vertices_give() {
    const CHOICES: u64 = 400;
    let case = Case::new(&(run(64, 1, 1) + &meters()), cube_with_floor(0.4, 0.5, 0.8));
    let (scene, transport) = (&case.scene, &case.job.transport);
    let mut vertices: Vec<Vertex> = Vec::new();
    for i in 0..512 {
        trace(scene, transport, &mut Stream::new(3, Domain::Trajectory, "").generator(i), &mut vertices);
    }
    let receivers = meters_in_a_corner();
    let links: Vec<Link> = (0..)
        .zip(&receivers)
        .map(|(owner, &receiver)| Link { owner, receiver, start: Colour::BLACK, watched: false })
        .collect();
    let pool = Pool::new(scene, &vertices);
    let mut all = Connectors::default();
    all.push(scene, &vertices);
    let truth = common::connect(scene, &all, 30.0, &receivers);
    let found: Vec<Vec<f64>> = (0..CHOICES)
        .map(|i| {
            let start = Stream::new(4, Domain::Choice, "corner").generator(i).uniform();
            let chosen = pool.choose(&links, (200, 8), 30.0, start);
            assert_eq!(chosen.histories(), 8);
            common::connect(scene, &chosen, 30.0, &receivers).iter().map(|c| c.sum.luminance()).collect()
        })
        .collect();
    let compared = |i: usize| {
        let estimate = Estimate::from_scores(found.iter().map(|of| of[i]));
        compare(format!("meter {i}"), estimate, truth[i].sum.luminance())
    };
    assert_all(&(0..receivers.len()).map(compared).collect::<Vec<_>>());
}

#[test]
fn a_pool_gives_what_it_has_whatever_is_wanted_of_it() {
    let case = Case::new(&(run(64, 1, 1) + &meters()), cube_with_floor(0.4, 0.5, 0.8));
    let mut vertices: Vec<Vertex> = Vec::new();
    trace(&case.scene, &case.job.transport, &mut Stream::new(3, Domain::Trajectory, "").generator(0), &mut vertices);
    let link = |receiver| Link { owner: 0, receiver, start: Colour::BLACK, watched: false };
    let one = [link(meters_in_a_corner()[5])];
    let chosen = |vertices: &[Vertex], wanted, bound| {
        let chosen = Pool::new(&case.scene, vertices).choose(&one, (wanted, 4), bound, 0.5);
        (chosen.histories(), chosen.vertices())
    };
    assert_eq!(chosen(&[], 10, 30.0), (4, 0), "none");
    let (histories, one_or_none) = chosen(&vertices, 0, 30.0);
    assert!(histories == 4 && one_or_none <= 1, "{one_or_none} of none wanted");
    for bound in [30.0, f64::INFINITY] {
        let (histories, all) = chosen(&vertices, 100 * vertices.len(), bound);
        assert_eq!((histories, all), (4, vertices.len()), "more than there are: each counts as often as it is chosen");
    }
}
