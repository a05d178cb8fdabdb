//! Lux-meters towards an edge, and a pixel that contains it: where the plain local estimate fails.
//!
//! A closed unit cube whose walls emit 1 lm/m2 and reflect 0.5: the indirect illuminance is exactly 1 lx everywhere, the
//! total 2 lx, the luminance 2/pi. Lux-meters on the floor at the distance s from a wall; one pixel sees 0 < s < 0.1, another floor and wall.

use super::count::{Counted, Quantity, count};
use super::replicate::Kind;
use lampyris::error::Result;
use lampyris::math::{DVec3, PI};
use lampyris::validate::experiment::Experiment;
use lampyris::validate::scenes::{UP, closed_box, lambert, points};

/// Distances from the wall \[m\].
const DISTANCES: [f64; 7] = [0.3, 0.1, 0.03, 0.01, 0.003, 0.001, 0.0003];

/// The pixel that sees 0 < s < 0.1.
const PIXEL: &str = "[[camera]]\nname = \"edge\"\neye = [0.05, 0.5, 0.5]\ntarget = [0.05, 0, 0.5]\nup = [1, 0, 0]\n\
    vertical_fov_degrees = 11.421186274999286\nwidth = 1\nheight = 1\npixel_samples = 1\nmonitor = [[0, 0]]\n";

/// A pixel half of which shows the wall: it has more positions, and some of them carry connections.
const ACROSS: &str = "[[camera]]\nname = \"across\"\neye = [0.4, 0.4, 0.5]\ntarget = [0, 0, 0.5]\n\
    vertical_fov_degrees = 8\nwidth = 1\nheight = 1\npixel_samples = 1\nmonitor = [[0, 0]]\n";

/// The cube with lux-meters at `distances`, as the job and the model ask, after the tables of `run`.
pub fn cube(run: &str, distances: &[f64]) -> Result<Experiment> {
    let job = format!("{run}{PIXEL}{}", points("p", distances.iter().map(|&s| ([s, 0.0, 0.5], UP))));
    Experiment::new(&job, closed_box(DVec3::ONE, &lambert(0.5, 1.0 / PI)))
}

/// The tables `[run]` and `[transport]` of 32 batches of 64 histories.
pub fn tables(sampling: &str, bounded: bool) -> String {
    let sampling = sampled(sampling);
    format!("[run]\nhistories_per_batch = 64\nbatches = 32\n{sampling}[transport]\nbounded = {bounded}\n")
}

/// The lines of `[run]` for rqmc or random histories, or for "thinned": quasi-random ones of eight trajectories each.
pub fn sampled(sampling: &str) -> String {
    match sampling {
        "thinned" => "sampling = \"rqmc\"\nthinning = 8\n".to_owned(),
        _ => format!("sampling = \"{sampling}\"\n"),
    }
}

/// The experiment: every receiver, indirect and total.
pub fn run(sampling: &str, bounded: bool, replicates: u64) -> Result<Vec<Counted>> {
    let experiment = cube(&(tables(sampling, bounded) + ACROSS), &DISTANCES)?;
    let mut quantities = Vec::new();
    let mut add = |what: &str, set: usize, indirect: f64, total: f64| {
        let exact = |name, kind, truth| Quantity { name, kind, truth: vec![truth], truth_error: 0.0 };
        quantities.push(exact(format!("{what}, indirect"), Kind::Indirect(set), indirect));
        quantities.push(exact(format!("{what}, total"), Kind::Total(set, 0), total));
    };
    for (i, s) in DISTANCES.iter().enumerate() {
        add(&format!("s = {s}"), i + 2, 1.0, 2.0);
    }
    // Cameras come first in the order of the sets.
    add("pixel across", 0, 0.5 / PI, 2.0 / PI);
    add("edge pixel", 1, 0.5 / PI, 2.0 / PI);
    let kernel = if bounded { "bounded" } else { "plain" };
    Ok(count(&format!("{kernel}, {sampling}"), &experiment, quantities, replicates))
}
