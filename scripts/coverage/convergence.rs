//! No floor: the variance of lux-meters 5 mm from a column falls as 1/N when the batches stay and their histories grow.
//!
//! The room of scenes/room.glb, its column 3.9 < x < 4.3 m, -2.8 < z < -2.4 m. 32 batches of 2^5 to 2^11 histories, so
//! N = 2^10 to 2^16. Pixels beside the lux-meters: their positions, one draw a batch, are a part of the variance that
//! falls with the batches alone.

use super::cases::load;
use super::count::{is_marked, square};
use super::replicate::{Kind, Reading, Replicate};
use lampyris::error::Result;
use lampyris::math::log2;
use lampyris::tally::health::{Mark, health};
use lampyris::tally::statistics::Estimate;
use lampyris::validate::experiment::Experiment;
use lampyris::validate::scenes::{UP, points};
use rayon::prelude::*;
use std::ops::RangeInclusive;

/// Exponents m of the numbers of histories N = 2^m, of which 32 = 2^5 are the batches.
const SIZES: RangeInclusive<u32> = 10..=16;
/// Lux-meters: place, position \[m\], direction.
const METERS: [(&str, [f64; 3], [f64; 3]); 10] = [
    ("lit face, floor", [3.895, 0.0, -2.6], UP),
    ("lit face, 0.8 m", [3.895, 0.8, -2.6], UP),
    ("lit face, 2.9 m", [3.895, 2.9, -2.6], UP),
    ("lit face, 0.8 m, facing it", [3.895, 0.8, -2.6], [1.0, 0.0, 0.0]),
    ("side face, 0.8 m", [4.1, 0.8, -2.395], UP),
    ("other side face, 0.8 m", [4.1, 0.8, -2.805], UP),
    ("dark face, 0.8 m", [4.305, 0.8, -2.6], UP),
    ("corner, 0.8 m", [3.895, 0.8, -2.395], UP),
    ("desk, far from walls", [2.0, 0.8, -1.0], UP),
    ("in the shadow, far from walls", [5.0, 0.8, -3.0], UP),
];
const PIXELS: usize = 9;

/// Of each size and seed what each receiver reads.
struct Found {
    kinds: Vec<(String, Kind)>,
    readings: Vec<Vec<Vec<Reading>>>,
}

/// Runs and prints the table.
pub fn run(sampling: &str, seeds: u64) -> Result<()> {
    let found = Found::new(sampling, seeds)?;
    found.print(sampling, seeds);
    Ok(())
}

impl Found {
    fn new(sampling: &str, seeds: u64) -> Result<Found> {
        let mut readings = Vec::new();
        let mut kinds: Vec<(String, Kind)> =
            METERS.iter().enumerate().map(|(i, m)| (m.0.to_owned(), Kind::Total(1 + i, 0))).collect();
        kinds.extend((0..PIXELS).map(|i| (format!("pixel {i} (exempt)"), Kind::Total(0, i))));
        for size in SIZES {
            let histories = 1u32 << (size - 5);
            let job = format!(
                "[run]\nhistories_per_batch = {histories}\nbatches = 32\nsampling = \"{sampling}\"\n\
                 [[camera]]\nname = \"view\"\nnode = \"camera\"\nwidth = 3\nheight = 3\n{}",
                points("p", METERS.map(|(_, position, normal)| (position, normal)))
            );
            let experiment = Experiment::new(&job, load("room")?)?;
            let read = |seed| -> Vec<Reading> {
                let replicate = Replicate::new(&experiment, seed);
                kinds.iter().map(|(_, kind)| replicate.read(kind)).collect()
            };
            readings.push((1..=seeds).into_par_iter().map(read).collect());
        }
        Ok(Found { kinds, readings })
    }

    /// N times the mean over the seeds of the estimated relative variance, and its slope against N.
    fn print(&self, sampling: &str, seeds: u64) {
        let sizes: Vec<String> = SIZES.map(|m| format!("2^{m}")).collect();
        println!(
            "\nN x relative variance by sizes N, {sampling}, mean of {seeds} seeds; slope of log variance over log N.\n"
        );
        println!("| receiver | {} | slope | unhealthy at 2^10 | at 2^16 |", sizes.join(" | "));
        println!("|---|{}---|---|---|", "---|".repeat(sizes.len()));
        for (which, (name, _)) in self.kinds.iter().enumerate() {
            let last = &self.readings[self.readings.len() - 1];
            let truth = Estimate::from_scores(last.iter().map(|r| r[which].intervals[0].0)).mean;
            let variances: Vec<Estimate> =
                self.readings.iter().map(|of_size| mean_variance(of_size, which, truth)).collect();
            let points: Vec<(f64, f64)> = SIZES.zip(&variances).map(|(m, v)| (f64::from(m), log2(v.mean))).collect();
            let (slope, _) = fit(&points);
            // The error of log2 of a mean of `seeds` variances of 31 degrees of freedom each.
            let one = (2.0 / (31.0 * seeds as f64)).sqrt() / std::f64::consts::LN_2;
            let columns: Vec<String> =
                SIZES.zip(&variances).map(|(m, v)| format!("{:.3}", v.mean * f64::from(1u32 << m))).collect();
            println!(
                "| {name} | {} | {slope:.3} ({:.3}) | {} | {} |",
                columns.join(" | "),
                one / spread(&points),
                marks(&self.readings[0], which),
                marks(last, which),
            );
        }
        self.print_observed();
    }

    /// Squared distances from the mean of the largest runs, over those that the estimated variances promise.
    fn print_observed(&self) {
        let last = &self.readings[self.readings.len() - 1];
        let of_size = |of_size: &Vec<Vec<Reading>>| {
            let ratio = |which: usize| {
                let truth = Estimate::from_scores(last.iter().map(|r| r[which].intervals[0].0)).mean;
                let observed: f64 = of_size.iter().map(|r| square(r[which].intervals[0].0 - truth)).sum();
                let promised: f64 = of_size.iter().map(|r| square(r[which].standard_error)).sum();
                observed / promised
            };
            format!("{:.2}", (0..METERS.len()).map(ratio).sum::<f64>() / METERS.len() as f64)
        };
        let all: Vec<String> = self.readings[..self.readings.len() - 2].iter().map(of_size).collect();
        println!("\nObserved over estimated squared error of the lux-meters, N = 2^10 to 2^14: {}.", all.join(", "));
    }
}

fn mean_variance(readings: &[Vec<Reading>], which: usize, truth: f64) -> Estimate {
    Estimate::from_scores(readings.iter().map(|r| square(r[which].standard_error / truth)))
}

/// Slope and intercept of the straight line of least squares.
fn fit(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let slope = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>() / square(spread(points));
    (slope, my - slope * mx)
}

/// Root of the sum of the squared distances of x from its mean.
fn spread(points: &[(f64, f64)]) -> f64 {
    let mean = points.iter().map(|p| p.0).sum::<f64>() / points.len() as f64;
    points.iter().map(|p| square(p.0 - mean)).sum::<f64>().sqrt()
}

/// How many of the runs are marked, and by what.
fn marks(readings: &[Vec<Reading>], which: usize) -> String {
    let marked = readings.iter().filter(|r| is_marked(&r[which].signs)).count();
    let has = |mark: &Mark| readings.iter().any(|r| r[which].signs.iter().any(|s| health(s).has(*mark)));
    let words: Vec<&str> = Mark::ALL.into_iter().filter(has).map(Mark::word).collect();
    format!("{marked} of {}{}{}", readings.len(), if marked > 0 { ": " } else { "" }, words.join(", "))
}
