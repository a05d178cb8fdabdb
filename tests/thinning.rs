//! Many trajectories traced for each history that is connected: the same expectations, smaller errors.

mod common;

use common::scenes::{closed_box, cube_with_floor, lambert, point, spot_camera};
use common::{Case, Comparison, Estimate, assert_all, compare, difference};
use lampyris::math::{DVec3, PI};
use lampyris::scene::Model;
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
        let found = indirect(&(run(4096, 8, 71) + &meters()), furnace(), n..n + 1);
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
    let (thinned, plain) = (of(1024, 8, 5), of(8192, 1, 6));
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
