//! A cube lit from its middle: many reflections, seen point by point from the middle of a wall to beside its edge.

use super::closed_forms::inverse_square;
use super::experiment::Experiment;
use super::reference::analytic;
use super::scenes::{PLAIN, UP, closed_box, lambert, omni, points, run};
use super::{Case, Comparison, Theme};
use crate::error::Result;
use crate::math::DVec3;

const THEME: Theme = Theme("Cube lit from its middle");
/// Accuracy of the indirect part of the table, and near corners.
const TABLE: [f64; 2] = [2e-4, 1e-3];

/// The cases, in order.
pub(super) fn cases() -> Vec<Case> {
    let case = |name, checks, rho, places, transport| {
        let reference = "direct: I h / d^3; indirect: collocation, about 1e-4, table";
        THEME.case(name, checks, reference, move || walls(rho, places, transport))
    };
    vec![
        case("cube/rho-0.5", "points of a wall, to 1 cm from an edge and a corner", 0.5, &PLACES[..], ""),
        case("cube/rho-0.8", "the same in a brighter cube", 0.8, &PLACES[..], ""),
        case("cube/plain", "points far from edges, plain estimate", 0.5, &PLACES[..4], PLAIN),
    ]
}

/// Points of the wall, u and v from a corner \[m\].
const PLACES: [(f64, f64); 6] = [(0.5, 0.5), (0.25, 0.5), (0.25, 0.25), (0.1, 0.1), (0.01, 0.5), (0.01, 0.01)];

fn walls(rho: f64, places: &[(f64, f64)], transport: &str) -> Result<Vec<Comparison>> {
    let meters = points("p", places.iter().map(|&(u, v)| ([u, 0.0, v], UP)));
    let job = run(8192, 32) + transport + &omni([0.5; 3], 100.0) + &meters;
    let experiment = Experiment::new(&job, closed_box(DVec3::ONE, &lambert(rho, 0.0)))?;
    let indirect = experiment.estimates_of_orders(1..u32::MAX);
    let direct = experiment.direct();
    let mut all = Vec::new();
    for (i, (u, v)) in places.iter().enumerate() {
        let foot = ((u - 0.5) * (u - 0.5) + (v - 0.5) * (v - 0.5f64)).sqrt();
        let parameters = format!("unit cube;I=100 centre;rho={rho};wall point u={u} v={v}");
        let table = analytic("cube_central_source", &parameters, "E_indirect_lx_about_1e-4_rel");
        let at = |what: &str| format!("{what}, ({u}, {v}), rho = {rho}");
        all.push(Comparison::new(at("direct"), "lx", direct[i], inverse_square(100.0, 0.5, foot)[0]));
        all.push(Comparison::new(at("indirect"), "lx", indirect[i][0], table).within(TABLE[usize::from(*v == 0.01)]));
    }
    Ok(all)
}
