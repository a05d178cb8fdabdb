//! Closed cavities: Ulbricht's sphere, the white furnace, mean illuminances, the balance of flux. What enters must be
//! absorbed, whatever the shape.

use super::closed_forms::{cavity, ulbricht};
use super::experiment::{Experiment, flux};
use super::form_factors::{mean_of_meters, wall_meters};
use super::scenes::{
    PLAIN, UP, add_polygon, box_walls, closed_box, enclosure, integrating_sphere, lambert, omni, point, run,
    spot_camera,
};
use super::{Case, Comparison, Theme};
use crate::error::Result;
use crate::math::{DVec3, PI, sin_cos};
use crate::scene::Model;
use crate::tally::statistics::Estimate;

const THEME: Theme = Theme("Closed cavities");

/// The cases, in order.
pub(super) fn cases() -> Vec<Case> {
    vec![
        THEME.case(
            "cavity/ulbricht-sphere",
            "even indirect light, illuminance and luminance",
            "E_0 + rho Phi / (4 pi R^2 (1 - rho)), L = rho E / pi",
            ulbricht_sphere,
        ),
        THEME.case(
            "cavity/furnace",
            "walls that emit 1 lm/m2: the same luminance everywhere",
            "1 / (1 - rho)",
            furnace,
        ),
        THEME.case("cavity/furnace-orders", "each number of reflections by itself, plain estimate", "rho^n", orders),
        THEME.case("cavity/mean-illuminance", "mean indirect light of the walls", "rho Phi / (S (1 - rho))", means),
        THEME.case("cavity/flux-balance", "absorbed, escaped and lost light", "the flux of the sources", balances),
    ]
}

fn ulbricht_sphere() -> Result<Vec<Comparison>> {
    let degrees = [0.0, 60.0, 120.0, 180.0];
    let mut all = Vec::new();
    for rho in [0.5, 0.9] {
        let mut job = run(512, 32) + &omni([0.0, 0.4, 0.0], 100.0) + &integrating_sphere(rho);
        for (i, angle) in degrees.iter().enumerate() {
            let (sin, cos) = sin_cos(angle * PI / 180.0);
            job += &point(&format!("e{i}"), [sin, cos, 0.0], [-sin, -cos, 0.0]);
            job += &spot_camera(&format!("l{i}"), [0.1, 0.0, 0.2], [sin, cos, 0.0], [0.0, 0.0, 1.0]);
        }
        // Cameras come first in the order of the sets, whatever the order in the file.
        let found = Experiment::new(&job, Model::default())?.values();
        for (i, angle) in degrees.iter().enumerate() {
            let exact = ulbricht(100.0, 0.4, rho, angle * PI / 180.0);
            let at = |what: &str| format!("{what}, rho = {rho}, {angle} degrees");
            all.push(Comparison::new(at("E"), "lx", found[4 + i], exact));
            all.push(Comparison::new(at("L"), "cd/m2", found[i], rho * exact / PI));
        }
    }
    Ok(all)
}

/// A tetrahedron with the origin and the ends of the axes as corners, its insides the fronts.
fn tetrahedron(rho: f64) -> Model {
    let (o, x, y, z) = (DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z);
    let mut model = Model::default();
    for face in [[o, x, y], [o, y, z], [o, z, x], [x, z, y]] {
        add_polygon(&mut model, &face, lambert(rho, 1.0 / PI));
    }
    model
}

/// A box whose walls emit 1 lm/m2, one of them seen by a camera, and a lux-meter on its floor, after the tables of `run`.
fn box_of_light(run: &str, rho: f64) -> Result<Experiment> {
    let meter = point("e", [0.4, 0.0, 0.9], UP);
    let camera = spot_camera("l", [0.5, 1.0, 1.5], [1.0, 1.1, 1.2], UP);
    let walls = closed_box(DVec3::new(1.0, 2.0, 3.0), &lambert(rho, 1.0 / PI));
    Experiment::new(&format!("{run}{meter}{camera}"), walls)
}

fn furnace() -> Result<Vec<Comparison>> {
    let mut all = Vec::new();
    for rho in [0.3, 0.5, 0.8] {
        let found = box_of_light(&run(1024, 32), rho)?.values();
        let exact = cavity(1.0, 1.0, rho);
        all.push(Comparison::new(format!("L in a box, rho = {rho}"), "cd/m2", found[0], exact / PI));
        all.push(Comparison::new(format!("E in a box, rho = {rho}"), "lx", found[1], exact));
    }
    let job = run(1024, 32) + &point("e", [0.25, 0.0, 0.25], UP);
    let found = Experiment::new(&job, tetrahedron(0.5))?.values();
    all.push(Comparison::new("E in a tetrahedron, rho = 0.5", "lx", found[0], cavity(1.0, 1.0, 0.5)));
    Ok(all)
}

fn orders() -> Result<Vec<Comparison>> {
    let rho = 0.5;
    let experiment = box_of_light(&(run(8192, 64) + PLAIN), rho)?;
    // No order at all leaves the sampled direct light: E_0 = M0, and L0 + K L0 = (1 + rho) M0 / pi.
    let direct = experiment.estimates_of_orders(0..0);
    let mut all = vec![
        Comparison::new("L0 + K L0", "cd/m2", direct[0][0], (1.0 + rho) / PI),
        Comparison::new("E_0", "lx", direct[1][0], 1.0),
    ];
    let mut share = 1.0;
    for order in 1..4 {
        share *= rho;
        let e = experiment.estimates_of_orders(order..order + 1)[1][0];
        all.push(Comparison::new(format!("E_0 and order {order}"), "lx", e, 1.0 + share));
    }
    Ok(all)
}

/// Mean indirect illuminance with 100 cd inside; the direct part of the mean, Phi / S, is exact and not a matter of
/// local estimation.
fn mean_indirect(name: &str, walls: &[[DVec3; 3]], rho: f64) -> Result<Comparison> {
    let (meters, weights) = wall_meters(walls);
    let job = run(128, 16) + &omni([0.4, 0.6, 0.5], 100.0) + &meters;
    let (_, batches) = Experiment::new(&job, enclosure(walls, &lambert(rho, 0.0)))?.batches(1..u32::MAX);
    let exact = rho * cavity(400.0 * PI, walls.len() as f64, rho);
    // 1e-4: what the Gauss rule loses near edges.
    Ok(Comparison::new(format!("{name}, rho = {rho}"), "lx", mean_of_meters(&batches, &weights), exact).within(1e-4))
}

fn means() -> Result<Vec<Comparison>> {
    // Floor and ceiling first, as below: what a lux-meter draws depends on its name, a number in the order of the walls.
    let mut cube = box_walls(DVec3::ONE);
    cube.rotate_left(2);
    let mut all = Vec::new();
    for rho in [0.3, 0.5, 0.8] {
        all.push(mean_indirect("unit cube", &cube, rho)?);
    }
    // An L of three unit cubes: floor and ceiling of three squares each, eight walls, one edge that juts in.
    let (o, x, y, z) = (DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z);
    let flat = |at: DVec3| [[at, z, x], [at + y, x, z]];
    let mut l: Vec<_> = [o, x, z].into_iter().flat_map(flat).collect();
    l.extend([[o, x, y], [x, x, y], [o, y, z], [z, y, z]]);
    l.extend([[2.0 * x, z, y], [x + z, y, x], [x + z, z, y], [2.0 * z, y, x]]);
    all.push(mean_indirect("L of three cubes", &l, 0.5)?);
    Ok(all)
}

fn balances() -> Result<Vec<Comparison>> {
    let walls = lambert(0.7, 5.0);
    let mut open = closed_box(DVec3::new(1.0, 2.0, 1.0), &walls);
    open.triangles.truncate(10);
    open.surface_of.truncate(10);
    let mut all = balance("closed box", closed_box(DVec3::ONE, &walls), 6.0, true)?;
    // The last wall is one of 2 m2; the box has 10 m2 in all.
    all.extend(balance("box without a wall", open, 8.0, false)?);
    Ok(all)
}

/// The balance of a box whose walls of `area` \[m2\] emit 5 cd/m2, with an omni of 10 cd inside.
fn balance(name: &str, model: Model, area: f64, closed: bool) -> Result<Vec<Comparison>> {
    let job = run(2048, 64) + &omni([0.5, 0.6, 0.5], 10.0) + &point("p", [0.5, 0.0, 0.5], UP);
    let (_, batches) = Experiment::new(&job, model)?.batches(1..2);
    let sum = Estimate::from_scores(batches.iter().map(|b| b.flux[1] + b.flux[2] + b.flux[3]));
    let exact = PI * 5.0 * area + 40.0 * PI;
    let of = |what: &str, found: Estimate, exact: f64| Comparison::new(format!("{what}, {name}"), "lm", found, exact);
    let mut all = vec![of("emitted", flux(&batches, "emitted"), exact), of("absorbed + escaped + lost", sum, exact)];
    all.push(of("lost", flux(&batches, "lost"), 0.0));
    if closed {
        all.push(of("escaped", flux(&batches, "escaped"), 0.0));
    }
    Ok(all)
}
