//! Radiosity against local estimation in Sobolev's problem (case A), read in four ways: `cargo bench --bench radiosity`.
//!
//! The paper finds local estimation "80-90 times" faster than radiosity. How much it is depends on how the solution of the
//! radiosity system is read, so every reading is shown. The error is the root mean square over the 31 points
//! r = 0, 0.1 .. 3 m of plane 1 of the relative error of E1 against the exact solution (7.3) of docs/method.md:
//!
//! ```text
//! E1(r) = h / (h^2 + r^2)^(3/2) + rho int_0^inf [1 + rho kappa] e^(-h k) / [1 - rho^2 kappa^2] kappa J0(k r) k dk
//! kappa(k) = k K1(k),   h = 1/2,   rho = 1/2
//! ```
//!
//! Radiosity: n x n square patches of each plane on [-R, R]^2, direct light at their centres, kernels from centre to
//! centre, all of them kept, Gauss-Seidel until no value changes by more than 1e-3 of itself. Points on the border of two
//! patches take the value of the one with the larger coordinates.

mod common;

use common::{prepare, thread_time};
use lampyris::farm::pilot::bounds;
use lampyris::farm::realization::Realization;
use lampyris::job::Job;
use lampyris::math::{PI, exp, log};
use lampyris::random::{Domain, Stream};
use lampyris::scene::{Model, Scene};
use lampyris::transport::trajectory::{Vertex, trace};
use lampyris::validate::reference;
use libm::j0;

const HEIGHT: f64 = 0.5;
const RHO: f64 = 0.5;
/// Half sides of the planes \[m\] and patches along a side.
const MESHES: [(f64, usize); 5] = [(4.0, 16), (4.0, 32), (4.0, 64), (5.0, 40), (5.0, 72)];
/// Histories of one run of local estimation, and how many runs are averaged.
const RUNS: [(u64, u64); 4] = [(512, 512), (2048, 256), (8192, 64), (32768, 32)];

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    pool.install(|| {
        let exact = exact();
        println!(
            "| R, n | kernels | sweeps | patch | interpolated | exact direct + interpolated | final gather | CPU |"
        );
        println!("|---|---|---|---|---|---|---|---|");
        MESHES.iter().for_each(|&(half, n)| radiosity(half, n, &exact));
        println!("\n| local estimation, N | sampling | roulette | RMS error | kernels | CPU |");
        println!("|---|---|---|---|---|---|");
        for (sampling, roulette) in [("random", "\"analog\""), ("random", "0.05"), ("rqmc", "0.05")] {
            RUNS.iter().for_each(|&(count, runs)| local(sampling, roulette, count, runs, &exact));
        }
    });
}

/// The points r \[m\].
fn points() -> impl Iterator<Item = f64> {
    (0..31).map(|i| f64::from(i) / 10.0)
}

/// Illuminance by the lamp alone at the distance `r2` squared from its foot \[lx\].
fn direct(r2: f64) -> f64 {
    let d2 = HEIGHT * HEIGHT + r2;
    HEIGHT / (d2 * d2.sqrt())
}

/// Light of 1 lm/m2 of exitance from 1 m2 at the other plane, `s2` the distance squared along it \[lx\].
fn kernel(s2: f64) -> f64 {
    1.0 / (PI * (1.0 + s2) * (1.0 + s2))
}

/// Root mean square of the relative errors of `values` at the points.
fn error(values: impl Iterator<Item = f64>, exact: &[f64]) -> f64 {
    let squares: f64 = values.zip(exact).map(|(v, e)| (v / e - 1.0) * (v / e - 1.0)).sum();
    (squares / exact.len() as f64).sqrt()
}

/// kappa(k) = k K1(k) = k int_0^inf exp(-k cosh t) cosh t dt; the trapezoidal rule converges faster than any power.
fn kappa(k: f64) -> f64 {
    if k < 1e-8 {
        return 1.0;
    }
    const STEP: f64 = 1.0 / 16.0;
    let last = (log(1600.0 / k).max(1.0) / STEP) as u32;
    let term = |i: u32| {
        let t = f64::from(i) * STEP;
        let cosh = 0.5 * (exp(t) + exp(-t));
        if i == 0 { 0.5 * exp(-k) } else { exp(-k * cosh) * cosh }
    };
    k * STEP * (0..=last).map(term).sum::<f64>()
}

/// E1 at the points, checked against the reference table \[lx\].
fn exact() -> Vec<f64> {
    // k = s^3 takes the logarithm out of the corner at 0; Simpson's rule to k = 64.
    const STEPS: u32 = 16384;
    let step = 4.0 / f64::from(STEPS);
    let nodes: Vec<(f64, f64)> = (1..STEPS)
        .map(|i| {
            let s = f64::from(i) * step;
            let k = s * s * s;
            let kappa = kappa(k);
            let order = exp(-HEIGHT * k) * (1.0 + RHO * kappa) / (1.0 - RHO * RHO * kappa * kappa);
            let weight = step / 3.0 * if i % 2 == 0 { 2.0 } else { 4.0 };
            (k, weight * RHO * order * kappa * k * 3.0 * s * s)
        })
        .collect();
    let at = |r: f64| direct(r * r) + nodes.iter().map(|&(k, weight)| weight * j0(k * r)).sum::<f64>();
    for row in reference::rows(reference::SOBOLEV).iter().filter(|row| row["case"] == "A") {
        let [r, e1] = ["r", "E1"].map(|column| reference::number(row, column));
        assert!(r > 3.0 || (at(r) / e1 - 1.0).abs() < 1e-9, "r = {r}: {} against {e1}", at(r));
    }
    points().map(at).collect()
}

/// The two planes in patches, and the illuminance of each patch \[lx\].
struct Patches {
    half: f64,
    n: usize,
    planes: [Vec<f64>; 2],
}

impl Patches {
    fn center(&self, i: usize) -> [f64; 2] {
        let along = |k: usize| self.half * ((2 * k + 1) as f64 / self.n as f64 - 1.0);
        [along(i % self.n), along(i / self.n)]
    }

    fn side(&self) -> f64 {
        2.0 * self.half / self.n as f64
    }

    fn direct(&self, i: usize) -> f64 {
        let [x, y] = self.center(i);
        direct(x * x + y * y)
    }

    /// Solves the system; the sweeps it took.
    fn solve(&mut self) -> u32 {
        let count = self.n * self.n;
        let area = self.side() * self.side();
        let centers: Vec<[f64; 2]> = (0..count).map(|i| self.center(i)).collect();
        let matrix = || -> Vec<f64> {
            let row = |[x, y]: [f64; 2]| {
                centers.iter().map(move |c| area * kernel((x - c[0]) * (x - c[0]) + (y - c[1]) * (y - c[1])))
            };
            centers.iter().flat_map(|&c| row(c)).collect()
        };
        let kernels = [matrix(), matrix()];
        let direct: Vec<f64> = (0..count).map(|i| self.direct(i)).collect();
        self.planes = [direct.clone(), direct.clone()];
        for sweep in 1.. {
            let mut change = 0f64;
            for (plane, kernels) in kernels.iter().enumerate() {
                for (i, row) in kernels.chunks_exact(count).enumerate() {
                    let value = direct[i] + RHO * dot(row, &self.planes[1 - plane]);
                    let old = std::mem::replace(&mut self.planes[plane][i], value);
                    change = change.max((value / old - 1.0).abs());
                }
            }
            if change <= 1e-3 {
                return sweep;
            }
        }
        unreachable!("half of the light is absorbed at every sweep")
    }

    /// Value of the patch that holds (x, 0).
    fn patch(&self, x: f64) -> f64 {
        let place = |x: f64| ((x + self.half) / self.side()) as usize;
        self.planes[0][place(0.0) * self.n + place(x)]
    }

    /// `value` of the patches, bilinear between their centres, at (x, 0).
    fn interpolated(&self, x: f64, value: impl Fn(usize) -> f64) -> f64 {
        let place = |x: f64| {
            let at = (x + self.half) / self.side() - 0.5;
            (at as usize, at.fract())
        };
        let ((i, s), (j, t)) = (place(x), place(0.0));
        let row = |j: usize| (1.0 - s) * value(j * self.n + i) + s * value(j * self.n + i + 1);
        (1.0 - t) * row(j) + t * row(j + 1)
    }

    /// Exact direct light at (x, 0), and what the patches of the other plane send there.
    fn gathered(&self, x: f64) -> f64 {
        let area = self.side() * self.side();
        let of = |(i, e): (usize, &f64)| {
            let [a, b] = self.center(i);
            e * kernel((x - a) * (x - a) + b * b)
        };
        direct(x * x) + RHO * area * self.planes[1].iter().enumerate().map(of).sum::<f64>()
    }
}

/// Scalar product in eight running sums, which fit the vectors of the machine.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    for (a, b) in a.chunks(8).zip(b.chunks(8)) {
        sums.iter_mut().zip(a.iter().zip(b)).for_each(|(sum, (a, b))| *sum += a * b);
    }
    sums.iter().sum()
}

/// A row of the table: one mesh in all readings.
fn radiosity(half: f64, n: usize, exact: &[f64]) {
    let start = thread_time();
    let mut patches = Patches { half, n, planes: Default::default() };
    let sweeps = patches.solve();
    let seconds = (thread_time() - start).as_secs_f64();
    let total = |i: usize| patches.planes[0][i];
    let indirect = |i: usize| patches.planes[0][i] - patches.direct(i);
    let errors = [
        error(points().map(|r| patches.patch(r)), exact),
        error(points().map(|r| patches.interpolated(r, total)), exact),
        error(points().map(|r| direct(r * r) + patches.interpolated(r, indirect)), exact),
        error(points().map(|r| patches.gathered(r)), exact),
    ];
    let [patch, interpolated, exact_direct, gather] = errors.map(|e| format!("{:.2} %", 100.0 * e));
    let kernels = 2.0 * (n as f64 * n as f64) * (n as f64 * n as f64);
    println!(
        "| {half}, {n} | {kernels:.1e} | {sweeps} | {patch} | {interpolated} | {exact_direct} | {gather} | {:.1} ms |",
        1e3 * seconds
    );
}

/// A row of the table: `runs` runs of `count` histories, each a batch of its own.
fn local(sampling: &str, roulette: &str, count: u64, runs: u64, exact: &[f64]) {
    let mut text = format!(
        "[run]\nhistories_per_batch = {count}\nbatches = {runs}\nsampling = \"{sampling}\"\n\
         [transport]\nbounded = false\nroulette_below = {roulette}\n\
         [[plane]]\npoint = [0, 0, 0]\nnormal = [0, 1, 0]\nreflectance = {RHO}\n\
         [[plane]]\npoint = [0, 1, 0]\nnormal = [0, -1, 0]\nreflectance = {RHO}\n\
         [[source]]\nkind = \"omni\"\nposition = [0, {HEIGHT}, 0]\nintensity = 1\n"
    );
    // One row of 31 cells whose centres are the points.
    text += "[[grid]]\nname = \"e\"\norigin = [-0.05, 0, 0]\nu = [3.1, 0, 0]\nv = [0, 0, 1e-9]\nnormal = [0, 1, 0]\n\
             columns = 31\nrows = 1\n";
    let (job, scene) = prepare(&text, Model::default());
    let realization = Realization::new(&job, &scene, &bounds(&job, &scene));
    let start = thread_time();
    let batches: Vec<_> = (0..runs).map(|i| realization.batch(i)).collect();
    let seconds = (thread_time() - start).as_secs_f64() / runs as f64;
    let fixed = &realization.fixed_direct()[0];
    let squares = batches.iter().map(|b| {
        let of_run = error(b.sets[0].value.iter().zip(fixed).map(|(v, f)| v + f), exact);
        of_run * of_run
    });
    let error = (squares.sum::<f64>() / runs as f64).sqrt();
    let kernels = vertices(&job, &scene) * count as f64 * exact.len() as f64;
    println!(
        "| {count} | {sampling} | {} | {:.2} % | {kernels:.1e} | {:.1} ms |",
        roulette.trim_matches('"'),
        100.0 * error,
        1e3 * seconds
    );
}

/// Vertices of a history, on average.
fn vertices(job: &Job, scene: &Scene) -> f64 {
    const SAMPLE: u64 = 4096;
    let stream = Stream::new(job.run.seed, Domain::Trajectory, "");
    let mut vertices: Vec<Vertex> = Vec::new();
    for history in 0..SAMPLE {
        trace(scene, &job.transport, &mut stream.generator(history), &mut vertices);
    }
    vertices.len() as f64 / SAMPLE as f64
}
