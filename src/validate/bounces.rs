//! One reflection: off an infinite floor, a wall, a square in parallel light, and beside an edge, where the kernel of
//! local estimation is weakly singular. Light is reflected once because nothing else is there to reflect it.

use super::closed_forms::{parallel_corner, perpendicular_corner};
use super::experiment::{Experiment, estimates, flux};
use super::reference::analytic;
use super::scenes::{PLAIN, UP, add_quad, in_parallel_light, lambert, omni, plane, point, points, run};
use super::{Case, Comparison, Theme};
use crate::error::Result;
use crate::math::DVec3;
use crate::scene::Model;

const THEME: Theme = Theme("One reflection");

/// The cases, in order.
pub(super) fn cases() -> Vec<Case> {
    vec![
        THEME.case("bounce/floor", "off an infinite floor", "I rho int exp(-hk) kappa(kH) J0(kr) k dk, table", floor),
        THEME.case("bounce/wall", "off a wall to the floor and to the wall opposite", "quadrature, table", wall),
        THEME.case(
            "bounce/parallel-light",
            "off a square in parallel light",
            "configuration factor times rho E",
            square,
        ),
        THEME.case(
            "bounce/edge",
            "floor 1 m, 10 cm and 1 cm from a lit wall strip",
            "configuration factor of a perpendicular rectangle times rho E",
            edge,
        ),
        THEME.case("bounce/edge-plain", "the same 10 cm from the edge by the plain estimate", "the same", edge_plain),
    ]
}

fn floor() -> Result<Vec<Comparison>> {
    let meters = points("r", (0..3).map(|r| ([f64::from(r), 1.5, 0.0], [0.0, -1.0, 0.0])));
    let job = run(8192, 32) + &omni(UP, 100.0) + &plane([0.0; 3], UP, 0.5) + &meters;
    let found = Experiment::new(&job, Model::default())?.estimates_of_orders(1..u32::MAX);
    let compare = |r: usize| {
        let parameters = format!("I=100;source height 1;receiver plane at 1.5 facing down;rho=0.5;r={r}");
        let exact = analytic("one_bounce_infinite_plane", &parameters, "E_bounce_lx");
        Comparison::new(format!("r = {r} m"), "lx", found[r][0], exact)
    };
    Ok((0..3).map(compare).collect())
}

fn wall() -> Result<Vec<Comparison>> {
    // The table has z up; here its (x, y, z) is (x, z, -y).
    let axes = |p: [f64; 3]| [p[0], p[2], -p[1]];
    let mut model = Model::default();
    add_quad(&mut model, DVec3::ZERO, DVec3::NEG_Z * 4.0, DVec3::Y * 3.0, lambert(0.6, 0.0));
    let places = [
        ("P=(1.0, 2.0, 0.0) floor", axes([1.0, 2.0, 0.0]), UP),
        ("P=(0.5, 1.0, 0.0) floor", axes([0.5, 1.0, 0.0]), UP),
        ("P=(3.0, 2.0, 1.5) opposite wall", axes([3.0, 2.0, 1.5]), [-1.0, 0.0, 0.0]),
    ];
    let meters = points("p", places.map(|(_, position, normal)| (position, normal)));
    let job = run(8192, 32) + &omni(axes([2.0, 1.0, 1.5]), 100.0) + &meters;
    let found = Experiment::new(&job, model)?.estimates_of_orders(1..u32::MAX);
    let compare = |(i, (name, ..)): (usize, &(&str, _, _))| {
        let parameters = format!("wall x=0 4x3 rho=0.6;I=100 at (2,1,1.5);{name}");
        let exact = analytic("one_bounce_wall", &parameters, "E_bounce_lx");
        Comparison::new(name, "lx", found[i][0], exact)
    };
    Ok(places.iter().enumerate().map(compare).collect())
}

fn square() -> Result<Vec<Comparison>> {
    // Parallel light at 60 degrees on a square of side 1, sensed above its corner.
    let mut model = Model::default();
    add_quad(&mut model, DVec3::ZERO, DVec3::Z, DVec3::X, lambert(0.5, 0.0));
    let direction = DVec3::new(0.75f64.sqrt(), -0.5, 0.0);
    let job = run(16384, 32) + &point("above", UP, [0.0, -1.0, 0.0]);
    let (_, batches) = Experiment::new(&job, in_parallel_light(model, direction, 1000.0))?.batches(1..u32::MAX);
    let exact = 0.5 * 500.0 * parallel_corner(1.0, 1.0, 1.0);
    Ok(vec![
        Comparison::new("1 m above a corner", "lx", estimates(&batches)[0][0], exact),
        Comparison::new("absorbed by the square", "lm", flux(&batches, "absorbed"), 0.5 * 500.0),
    ])
}

/// Floor at `distance` \[m\] before the middle of a lit wall strip of height 1 m that ends at +-`half`.
fn strip(half: f64, distance: f64, job: &str) -> Result<Comparison> {
    let mut model = Model::default();
    add_quad(&mut model, DVec3::new(0.0, 0.0, -half), DVec3::Y, DVec3::Z * 2.0 * half, lambert(0.5, 0.0));
    let job = job.to_owned() + &point("p", [distance, 0.0, 0.0], UP);
    let found = Experiment::new(&job, in_parallel_light(model, DVec3::NEG_X, 1000.0))?.estimates_of_orders(1..u32::MAX);
    let exact = 2.0 * 0.5 * 1000.0 * perpendicular_corner(half, 1.0, distance);
    Ok(Comparison::new(format!("strip of {} m, {distance} m before it", 2.0 * half), "lx", found[0][0], exact))
}

fn edge() -> Result<Vec<Comparison>> {
    Ok(vec![strip(3.0, 1.0, &run(16384, 64))?, strip(3.0, 0.1, &run(16384, 64))?, strip(3.0, 0.01, &run(16384, 64))?])
}

fn edge_plain() -> Result<Vec<Comparison>> {
    Ok(vec![strip(1.0, 0.1, &(run(16384, 64) + PLAIN))?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_endless_strip_is_that_of_the_table() {
        for s in [0.01, 0.1, 1.0] {
            let parameters = format!("infinite wall strip height 1, E_wall=1000, rho=0.5; floor distance s={s}");
            let table = analytic("corner_strip_one_bounce", &parameters, "E_bounce_lx");
            let endless = 2.0 * 500.0 * perpendicular_corner(1e9, 1.0, s);
            assert!((endless / table - 1.0).abs() < 1e-8, "{s}: {endless} against {table}");
        }
        // An endless strip fills the angle to its upper edge.
        assert!((perpendicular_corner(1e9, 1.0, 1e-9) - 0.25).abs() < 1e-8);
    }
}
