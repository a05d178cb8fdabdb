//! Sobolev's problem, paper (6)-(8): an omni between two infinite Lambert planes, in illuminance and in luminance,
//! as totals, order by order, and in the standard deviation of one trajectory.

mod common;

use common::scenes::{point, sobolev, spot_camera};
use common::{Case, assert_all, compare, number, table};
use lampyris::math::PI;
use lampyris::scene::Model;

const RUN: &str = "[run]\nhistories_per_batch = 16384\nbatches = 64\nseed = 11";

/// Heights and reflectances of the published cases.
fn case(name: &str) -> (f64, f64, f64) {
    match name {
        "A" => (0.5, 0.5, 0.5),
        "B" => (0.3, 0.9, 0.8),
        "C" => (0.7, 0.2, 0.6),
        other => panic!("case {other}"),
    }
}

fn totals(name: &str) {
    let (h1, rho1, rho2) = case(name);
    let rows: Vec<_> = table("sobolev_tables.csv");
    let rows: Vec<_> = rows.iter().filter(|r| r["case"] == name && number(r, "r") <= 5.0).collect();
    let mut job = sobolev(RUN, h1, rho1, rho2);
    for (i, row) in rows.iter().enumerate() {
        let r = number(row, "r");
        // Cameras come first in the order of the sets, whatever the order in the file.
        job += &spot_camera(&format!("l1_{i}"), [r, 0.9, 0.0], [r, 0.0, 0.0], [1.0, 0.0, 0.0]);
        job += &spot_camera(&format!("l2_{i}"), [r, 0.1, 0.0], [r, 1.0, 0.0], [1.0, 0.0, 0.0]);
        job += &point(&format!("e1_{i}"), [r, 0.0, 0.0], [0.0, 1.0, 0.0]);
        job += &point(&format!("e2_{i}"), [0.0, 1.0, -r], [0.0, -1.0, 0.0]);
    }
    let case = Case::new(&job, Model::default());
    let estimates = case.estimates();
    let mut all = Vec::new();
    for (i, row) in rows.iter().enumerate() {
        let (e1, e2) = (number(row, "E1"), number(row, "E2"));
        let at = |what: &str| format!("{name} {what} r = {}", row["r"]);
        let meters = 2 * rows.len();
        all.push(compare(at("L1"), estimates[2 * i][0], rho1 * e1 / PI));
        all.push(compare(at("L2"), estimates[2 * i + 1][0], rho2 * e2 / PI));
        all.push(compare(at("E1"), estimates[meters + 2 * i][0], e1));
        all.push(compare(at("E2"), estimates[meters + 2 * i + 1][0], e2));
    }
    assert_all(&all);
}

#[test]
fn totals_of_case_a() {
    totals("A");
}

#[test]
fn totals_of_case_b() {
    totals("B");
}

#[test]
fn totals_of_case_c() {
    totals("C");
}

fn orders(name: &str) {
    let (h1, rho1, rho2) = case(name);
    let rows = table("sobolev_orders.csv");
    let radii = [0.0, 0.5, 1.0, 2.0];
    let mut job = sobolev("[run]\nhistories_per_batch = 16384\nbatches = 64\nseed = 12", h1, rho1, rho2);
    for (i, r) in radii.iter().enumerate() {
        job += &point(&format!("e{i}"), [*r, 0.0, 0.0], [0.0, 1.0, 0.0]);
    }
    let case = Case::new(&job, Model::default());
    let mut all = Vec::new();
    let mut summed = [0.0; 4];
    for order in 1..=4u32 {
        let estimates = case.estimates_of_orders(order..order + 1);
        for (i, &r) in radii.iter().enumerate() {
            let is_it = |row: &&std::collections::HashMap<String, String>| {
                row["case"] == name
                    && row["plane"] == "1"
                    && number(row, "r") == r
                    && number(row, "order") == f64::from(order)
            };
            let reference = number(rows.iter().find(is_it).unwrap(), "E_order");
            all.push(compare(format!("{name} order {order} r = {r}"), estimates[i][0], reference));
            summed[i] += estimates[i][0].mean;
        }
    }
    assert_all(&all);
    // The filter takes nothing away: the orders sum to the unfiltered score.
    for (i, together) in case.estimates_of_orders(1..5).iter().enumerate() {
        let relative = summed[i] / together[0].mean - 1.0;
        assert!(relative.abs() < 1e-6, "orders 1 .. 4 sum to {} of {}", summed[i], together[0].mean);
    }
}

#[test]
fn orders_of_case_a() {
    orders("A");
}

#[test]
fn orders_of_case_b() {
    orders("B");
}

fn standard_deviations(name: &str, estimator: &str, roulette: &str) {
    let (h1, rho1, rho2) = case(name);
    let run = format!(
        "[run]\nsampling = \"random\"\nhistories_per_batch = 1\nbatches = {}\nseed = 13\n[transport]\nroulette_below = {roulette}",
        1 << 17
    );
    let mut job = sobolev(&run, h1, rho1, rho2);
    for r in 0..4 {
        job += &point(&format!("e{r}"), [f64::from(r), 0.0, 0.0], [0.0, 1.0, 0.0]);
    }
    let case = Case::new(&job, Model::default());
    let estimates = case.estimates();
    for row in table("sobolev_le_sd.csv").iter().filter(|r| r["case"] == name && r["estimator"] == estimator) {
        let estimate = estimates[number(row, "r") as usize][0];
        let deviation = estimate.standard_error * (estimate.n as f64).sqrt();
        let ratio = deviation / number(row, "sd_one_trajectory_lx");
        assert!((ratio - 1.0).abs() <= 0.05, "{name} {estimator} r = {}: {ratio}", row["r"]);
    }
}

#[test]
fn standard_deviation_of_one_trajectory_with_weights() {
    standard_deviations("A", "weights", "1e-3");
    standard_deviations("B", "weights", "1e-3");
}

#[test]
fn standard_deviation_of_one_trajectory_with_analog_absorption() {
    standard_deviations("A", "analog_absorption", "\"analog\"");
    standard_deviations("B", "analog_absorption", "\"analog\"");
}
