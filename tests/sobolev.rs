//! Sobolev's problem, paper (6)-(8): the cases of the battery, and what it does not look at: that orders sum to totals,
//! and the standard deviation of one trajectory.

mod common;

use common::battery::assert_theme;
use common::scenes::{point, sobolev};
use common::{Case, number, table};
use lampyris::scene::Model;
use lampyris::validate::sobolev::CASES;

#[test]
fn totals_and_orders() {
    assert_theme("sobolev/");
}

/// The case called `name` with lux-meters on plane 1 at r = 0, 1, 2, 3 m.
fn plane_1(run: &str, name: &str) -> Case {
    let case = CASES.iter().find(|c| c.name == name).unwrap();
    let mut job = sobolev(run, case.h1, case.rho1, case.rho2);
    for r in 0..4 {
        job += &point(&format!("e{r}"), [f64::from(r), 0.0, 0.0], [0.0, 1.0, 0.0]);
    }
    Case::new(&job, Model::default())
}

#[test]
fn orders_sum_to_the_unfiltered_score() {
    let run = "[run]\nhistories_per_batch = 1024\nbatches = 16\n[transport]\nbounded = false\n";
    let case = plane_1(run, "B");
    let of_order: Vec<_> = (1..5).map(|order| case.estimates_of_orders(order..order + 1)).collect();
    for (i, together) in case.estimates_of_orders(1..5).iter().enumerate() {
        let sum: f64 = of_order.iter().map(|e| e[i][0].mean).sum();
        assert!((sum / together[0].mean - 1.0).abs() < 1e-6, "orders 1 .. 4 sum to {sum} of {}", together[0].mean);
    }
}

fn standard_deviations(name: &str, estimator: &str, roulette: &str) {
    let run = format!(
        "[run]\nhistories_per_batch = 1\nbatches = {}\nseed = 13\nsampling = \"random\"\n\
         [transport]\nbounded = false\nroulette_below = {roulette}",
        1 << 17
    );
    let case = plane_1(&run, name);
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
