//! Local estimation against direct simulation, the illumination map of surface elements that the paper argues against:
//! `cargo bench --bench direct_simulation`, about five minutes of one core.
//!
//! The working plane of the room (`jobs/room.toml`) in elements of four sizes, with the same trajectories for both, one
//! thread. The error is the standard error of an element over its illuminance, as the root of its mean square over the
//! elements; the figure of merit is 1 / (error^2 x CPU seconds). An element has a bias of its own: it is a mean, and the
//! value wanted is that of a point. That bias is the difference of the mean of 5 x 5 points and the middle one, over the
//! illuminance in the middle: of direct light exactly and for every element, of reflected light by a longer local
//! estimate for one element in each half metre. Elements that the column cuts are left out of it.

mod common;

use common::{load, prepare, thread_time};
use lampyris::farm::pilot::bounds;
use lampyris::farm::realization::Realization;
use lampyris::job::Job;
use lampyris::scene::Scene;
use lampyris::tally::statistics::{Estimate, figure_of_merit};
use lampyris::tally::{BatchScores, MomentBlock};

/// Sides of the elements \[m\].
const SIZES: [f64; 4] = [0.5, 0.25, 0.125, 0.0625];
/// Length and width of the working plane \[m\].
const PLANE: [f64; 2] = [6.0, 4.0];
/// Surface of floor, ceiling, walls and column of the room \[m2\].
const SURFACE: f64 = 2.0 * (24.0 - 0.16) + 2.0 * 18.0 + 2.0 * 12.0 + 4.0 * 0.4 * 3.0;
/// Points along the side of an element whose mean is compared with the middle one.
const FINE: usize = 5;
const BATCHES: u64 = 64;
const HISTORIES: u64 = 64;
/// Histories of a batch of the long local estimate.
const LONG: u64 = 256;

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    pool.install(|| {
        let trajectories = BATCHES * HISTORIES;
        println!("{trajectories} trajectories each\n");
        println!("| element [m] | elements | estimator | error | CPU [s] | figure of merit [1/s] | memory |");
        println!("|---|---|---|---|---|---|---|");
        let centres = SIZES.map(compare);
        one_point();
        println!("\n| element [m] | bias of direct light, RMS | largest | of reflected light, RMS | error of that |");
        println!("|---|---|---|---|---|");
        SIZES.iter().zip(&centres).for_each(|(&size, centres)| bias(size, centres));
    });
}

/// A job in its scene.
struct Case {
    job: Job,
    scene: Scene,
}

impl Case {
    fn new(estimator: &str, histories: u64, receivers: &str) -> Case {
        let text = format!(
            "scene = \"room.glb\"\n[run]\nhistories_per_batch = {histories}\nbatches = {BATCHES}\n\
             [transport]\nestimator = \"{estimator}\"\n{receivers}"
        );
        let (job, scene) = prepare(&text, load("room"));
        Case { job, scene }
    }

    /// Estimates of all bins of all sets, direct light included, the scores they came from, and the CPU time \[s\].
    fn run(&self) -> (Vec<Vec<Estimate>>, Vec<BatchScores>, f64) {
        let start = thread_time();
        let realization = Realization::new(&self.job, &self.scene, &bounds(&self.job, &self.scene));
        let batches: Vec<BatchScores> = (0..BATCHES).map(|i| realization.batch(i)).collect();
        let seconds = (thread_time() - start).as_secs_f64();
        let fixed = realization.fixed_direct();
        let bin = |set: usize, i: usize| {
            Estimate::from_scores(batches.iter().map(|b| b.sets[set].value[i])).shifted(fixed[set][i])
        };
        let estimates = (0..fixed.len()).map(|set| (0..fixed[set].len()).map(|i| bin(set, i)).collect()).collect();
        (estimates, batches, seconds)
    }
}

/// A horizontal grid at the height of the working plane, as TOML.
fn grid(name: &str, [x, z]: [f64; 2], [length, width]: [f64; 2], columns: usize, rows: usize) -> String {
    format!(
        "[[grid]]\nname = \"{name}\"\norigin = [{x}, 0.8, {z}]\nu = [{length}, 0, 0]\nv = [0, 0, -{width}]\n\
         normal = [0, 1, 0]\ncolumns = {columns}\nrows = {rows}\nkeep_batches = false\n"
    )
}

/// Both estimators on the whole working plane in elements of `size`; the local estimates at their centres.
fn compare(size: f64) -> Vec<Estimate> {
    let cells = PLANE.map(|edge| (edge / size) as usize);
    let plane = grid("plane", [0.0, 0.0], PLANE, cells[0], cells[1]);
    let (local, _, local_seconds) = Case::new("local", HISTORIES, &plane).run();
    let (counted, _, counted_seconds) = Case::new("direct_simulation", HISTORIES, &plane).run();
    // Both errors over the same illuminance: the better known one.
    let reference = &local[0];
    let bins = reference.len() as f64;
    let row = |name: &str, estimates: &[Estimate], seconds: f64, memory: f64| {
        let error = relative_error(estimates, reference);
        let merit = figure_of_merit(error, seconds);
        let kilobytes = memory * bin_bytes() / 1e3;
        println!(
            "| {size} | {bins} | {name} | {:.2} % | {seconds:.3} | {merit:.1} | {kilobytes:.1} kB |",
            100.0 * error
        );
    };
    row("local, at their centres", &local[0], local_seconds, bins);
    // A map of elements is made of the surfaces; to know the light anywhere, all of them are kept.
    row("direct simulation", &counted[0], counted_seconds, SURFACE / (size * size));
    local.into_iter().next().expect("one grid")
}

/// Local estimation where one value is wanted.
fn one_point() {
    let (local, _, seconds) = Case::new("local", HISTORIES, &grid("desk", [1.9, -0.9], [0.2, 0.2], 1, 1)).run();
    let error = relative_error(&local[0], &local[0]);
    let merit = figure_of_merit(error, seconds);
    let kilobytes = bin_bytes() / 1e3;
    println!("| one point | 1 | local | {:.2} % | {seconds:.3} | {merit:.1} | {kilobytes:.2} kB |", 100.0 * error);
}

/// Root mean square over the elements in the air of standard error over illuminance.
fn relative_error(estimates: &[Estimate], reference: &[Estimate]) -> f64 {
    let pairs = estimates.iter().zip(reference).filter(|(_, r)| r.mean.is_finite());
    let squares: Vec<f64> = pairs.map(|(e, r)| (e.standard_error / r.mean) * (e.standard_error / r.mean)).collect();
    mean(&squares).sqrt()
}

/// Differences between the means of elements and the values in their middles, `centres`.
fn bias(size: f64, centres: &[Estimate]) {
    let direct = direct_bias(size, centres);
    let squares: Vec<f64> = direct.iter().map(|b| b * b).collect();
    let largest = direct.iter().fold(0f64, |largest, b| largest.max(b.abs()));
    let (reflected, noise) = reflected_bias(size);
    let [rms, largest, reflected, noise] = [mean(&squares).sqrt(), largest, reflected, noise].map(|x| 100.0 * x);
    println!("| {size} | {rms:.2} % | {largest:.1} % | {reflected:.3} % | {noise:.3} % |");
}

/// Bias of direct light of every element, over the illuminance in its middle.
fn direct_bias(size: f64, centres: &[Estimate]) -> Vec<f64> {
    let [columns, rows] = PLANE.map(|edge| (edge / size) as usize);
    let case = Case::new("local", 1, &grid("fine", [0.0, 0.0], PLANE, FINE * columns, FINE * rows));
    let realization = Realization::new(&case.job, &case.scene, &[]);
    let fine = &realization.fixed_direct()[0];
    let point = |i: usize, k: usize| {
        let (column, row) = (i % columns * FINE + k % FINE, i / columns * FINE + k / FINE);
        fine[row * FINE * columns + column]
    };
    let of = |i: usize| {
        let points: Vec<f64> = (0..FINE * FINE).map(|k| point(i, k)).collect();
        (mean(&points) - points[FINE * FINE / 2]) / centres[i].mean
    };
    (0..columns * rows).map(of).filter(|bias| bias.is_finite()).collect()
}

/// Root mean square of the bias of reflected light over the illuminance in the middle, of one element in each half
/// metre, and its standard error from the scatter of the scores.
fn reflected_bias(size: f64) -> (f64, f64) {
    let mut receivers = String::new();
    let blocks = PLANE.map(|edge| (edge / SIZES[0]) as usize);
    for (i, j) in (0..blocks[0]).flat_map(|i| (0..blocks[1]).map(move |j| (i, j))) {
        // The element in the middle of its half metre, or next to the middle.
        let within = (SIZES[0] / size / 2.0).floor() * size;
        let corner = [i as f64 * SIZES[0] + within, -(j as f64 * SIZES[0] + within)];
        receivers += &grid(&format!("b{i}_{j}"), corner, [size, size], FINE, FINE);
    }
    let (estimates, batches, _) = Case::new("local", LONG, &receivers).run();
    let middle = FINE * FINE / 2;
    let whole = estimates.iter().enumerate().filter(|(_, s)| s.iter().all(|e| e.mean.is_finite()));
    let of = |(set, points): (usize, &Vec<Estimate>)| {
        let scores = batches.iter().map(|b| mean(&b.sets[set].value) - b.sets[set].value[middle]);
        let Estimate { mean, standard_error, .. } = Estimate::from_scores(scores);
        [mean, standard_error].map(|x| (x / points[middle].mean) * (x / points[middle].mean))
    };
    let squares: Vec<[f64; 2]> = whole.map(of).collect();
    let root = |k: usize| mean(&squares.iter().map(|s| s[k]).collect::<Vec<_>>()).sqrt();
    (root(0), root(1))
}

/// Memory of one bin of a map: number, mean, central sum of squares and what stands beside them.
fn bin_bytes() -> f64 {
    let MomentBlock { mean, m2, direct, peak, caustic, existed, colour: _ } = MomentBlock::new(1, false);
    (size_of_val(&mean[..])
        + size_of_val(&m2[..])
        + size_of_val(&direct[..])
        + size_of_val(&peak[..])
        + size_of_val(&caustic[..])
        + size_of_val(&existed[..])) as f64
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
