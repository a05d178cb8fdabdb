//! Sobolev's problem, paper (6)-(8): an omni between two infinite Lambert planes 1 m apart. In illuminance and in
//! luminance, as totals and order by order.

use super::experiment::{Experiment, estimates, flux};
use super::reference::{SOBOLEV, SOBOLEV_ORDERS, number, rows};
use super::scenes::{PLAIN, UP, point, points, run, sobolev, spot_camera};
use super::{Case, Comparison, Theme};
use crate::error::Result;
use crate::math::PI;
use crate::scene::Model;

const THEME: Theme = Theme("Sobolev's problem");

/// Height of the lamp \[m\] and reflectances of a published case.
pub struct Parameters {
    /// A letter.
    pub name: &'static str,
    /// Height of the lamp above plane 1 \[m\].
    pub h1: f64,
    /// Reflectance of plane 1.
    pub rho1: f64,
    /// Reflectance of plane 2.
    pub rho2: f64,
}

/// The published cases.
pub const CASES: [Parameters; 4] = [
    Parameters { name: "A", h1: 0.5, rho1: 0.5, rho2: 0.5 },
    Parameters { name: "B", h1: 0.3, rho1: 0.9, rho2: 0.8 },
    Parameters { name: "C", h1: 0.7, rho1: 0.2, rho2: 0.6 },
    Parameters { name: "D", h1: 0.5, rho1: 0.9, rho2: 0.8 },
];

/// The cases, in order.
pub(super) fn cases() -> Vec<Case> {
    let total = |name, checks, which: usize, histories| {
        let reference = "paper (7) by quadrature of 15 digits, table; L = rho E / pi";
        THEME.case(name, checks, reference, move || totals(&CASES[which], histories))
    };
    let order = |name, checks, which: usize| {
        let reference = "Hankel transform of paper (7) order by order, table";
        THEME.case(name, checks, reference, move || orders(&CASES[which]))
    };
    vec![
        total("sobolev/A", "h 0.5 and 0.5, rho 0.5 and 0.5: E and L of both planes", 0, 2048),
        total("sobolev/B", "h 0.3 and 0.7, rho 0.9 and 0.8: E and L of both planes", 1, 2048),
        total("sobolev/C", "h 0.7 and 0.3, rho 0.2 and 0.6: E and L of both planes", 2, 2048),
        total("sobolev/D", "h 0.5 and 0.5, rho 0.9 and 0.8: E and L of both planes", 3, 2048),
        order("sobolev/orders-A", "each number of reflections by itself, plain estimate", 0),
        order("sobolev/orders-B", "each number of reflections by itself, plain estimate", 1),
    ]
}

fn totals(case: &Parameters, histories: u32) -> Result<Vec<Comparison>> {
    let Parameters { name, h1, rho1, rho2 } = *case;
    let all_rows = rows(SOBOLEV);
    let rows: Vec<_> = all_rows.iter().filter(|r| r["case"] == name && number(r, "r") <= 5.0).collect();
    let seen = |r: f64| r == 0.5 || r == 2.0;
    let mut job = sobolev(&run(histories, 64), h1, rho1, rho2);
    for (i, row) in rows.iter().enumerate() {
        let r = number(row, "r");
        job += &point(&format!("e1_{i}"), [r, 0.0, 0.0], UP);
        job += &point(&format!("e2_{i}"), [0.0, 1.0, -r], [0.0, -1.0, 0.0]);
        if seen(r) {
            job += &spot_camera(&format!("l1_{i}"), [r, 0.9, 0.0], [r, 0.0, 0.0], [1.0, 0.0, 0.0]);
            job += &spot_camera(&format!("l2_{i}"), [r, 0.1, 0.0], [r, 1.0, 0.0], [1.0, 0.0, 0.0]);
        }
    }
    let experiment = Experiment::new(&job, Model::default())?;
    let found = experiment.values();
    // Cameras come first in the order of the sets, whatever the order in the file.
    let (luminances, illuminances) = found.split_at(experiment.job.cameras.len());
    let mut luminances = luminances.iter();
    let mut all = Vec::new();
    for (row, pair) in rows.iter().zip(illuminances.chunks(2)) {
        let at = |what: &str| format!("{what}, r = {} m", row["r"]);
        let exact = [number(row, "E1"), number(row, "E2")];
        all.push(Comparison::new(at("E1"), "lx", pair[0], exact[0]));
        all.push(Comparison::new(at("E2"), "lx", pair[1], exact[1]));
        if seen(number(row, "r")) {
            let sides = [("L1", rho1 * exact[0] / PI), ("L2", rho2 * exact[1] / PI)];
            all.extend(
                sides
                    .into_iter()
                    .zip(&mut luminances)
                    .map(|((l, exact), e)| Comparison::new(at(l), "cd/m2", *e, exact)),
            );
        }
    }
    Ok(all)
}

/// Radii of the comparisons order by order \[m\].
const RADII: [f64; 4] = [0.0, 0.5, 1.0, 2.0];

fn orders(case: &Parameters) -> Result<Vec<Comparison>> {
    let planes = sobolev(&(run(8192, 40) + PLAIN), case.h1, case.rho1, case.rho2);
    let job = planes + &points("e", RADII.map(|r| ([r, 0.0, 0.0], UP)));
    let experiment = Experiment::new(&job, Model::default())?;
    let table = rows(SOBOLEV_ORDERS);
    let of_plane_1 = table.iter().filter(|row| row["case"] == case.name && row["plane"] == "1");
    let mut all = Vec::new();
    for order in 1..=4 {
        let (_, batches) = experiment.batches(order..order + 1);
        let found = estimates(&batches);
        for row in of_plane_1.clone().filter(|row| row["order"] == order.to_string()) {
            let Some(i) = RADII.iter().position(|&r| r == number(row, "r")) else { continue };
            let name = format!("order {order}, r = {} m", row["r"]);
            all.push(Comparison::new(name, "lx", found[i][0], number(row, "E_order")));
        }
        if order == 1 {
            // All light ends in one of the planes.
            all.push(Comparison::new("absorbed by both planes", "lm", flux(&batches, "absorbed"), 4.0 * PI));
        }
    }
    Ok(all)
}
