//! What randomised quasi-Monte Carlo gains: variance of a batch of random histories over that of a scrambled set.
//!
//!     cargo run --release --example rqmc_gain                        Sobolev's cases A and B at r = 0, 1, 2, 3
//!     cargo run --release --example rqmc_gain -- jobs/room.toml      each receiver set of a job
//!
//! Options: `--batches N` (400) batches of each kind, a multiple of 20, `--histories N,N` (2048,8192) histories of a batch, powers of two.
//! The variance of a receiver set is the sum over its bins. It is taken within 20 groups of batches; what follows "+-"
//! is the standard error of the gain from the scatter of the groups.

use lampyris::farm::inputs::{Prepared, prepare};
use lampyris::farm::pilot::bounds;
use lampyris::farm::realization::Realization;
use lampyris::job::{Job, Sampling};
use lampyris::scene::{Model, Scene, gltf};
use lampyris::tally::BatchScores;
use lampyris::tally::statistics::Estimate;
use std::path::Path;

const GROUPS: u64 = 20;

struct Options {
    batches: u64,
    histories: Vec<u64>,
    jobs: Vec<String>,
}

fn main() {
    let options = options();
    let cases: Vec<(String, Job, Model)> = if options.jobs.is_empty() {
        [("A", [0.5, 0.5, 0.5]), ("B", [0.3, 0.9, 0.8])].map(|(name, case)| sobolev(name, case)).into()
    } else {
        options.jobs.iter().map(|path| of_file(path)).collect()
    };
    println!("| case | histories | receivers | gain | relative error of the mean of a scrambled set |");
    println!("|---|---|---|---|---|");
    for (name, job, model) in cases {
        let scene = Scene::new(model, &job).expect("the scene is right");
        for &histories in &options.histories {
            compare(&name, &job, &scene, histories, options.batches);
        }
    }
}

fn options() -> Options {
    let mut options = Options { batches: 400, histories: vec![2048, 8192], jobs: Vec::new() };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut numbers = || -> Vec<u64> {
            let list = words.next().unwrap_or_default();
            list.split(',').map(|n| n.parse().unwrap_or_else(|_| panic!("{word} takes numbers"))).collect()
        };
        match word.as_str() {
            "--batches" => options.batches = numbers()[0],
            "--histories" => options.histories = numbers(),
            _ => options.jobs.push(word),
        }
    }
    let whole = options.batches.is_multiple_of(GROUPS) && options.batches >= 2 * GROUPS;
    assert!(whole, "--batches: a multiple of {GROUPS}, at least {}, not {}", 2 * GROUPS, options.batches);
    assert!(options.histories.iter().all(|n| n.is_power_of_two()), "--histories: powers of two");
    options
}

/// Plain local estimation in Sobolev's problem: heights h1 and 1 - h1, reflectances rho1 and rho2.
fn sobolev(name: &str, [h1, rho1, rho2]: [f64; 3]) -> (String, Job, Model) {
    let mut text = format!(
        "[transport]\nbounded = false\n\
         [[plane]]\npoint = [0, 0, 0]\nnormal = [0, 1, 0]\nreflectance = {rho1}\n\
         [[plane]]\npoint = [0, 1, 0]\nnormal = [0, -1, 0]\nreflectance = {rho2}\n\
         [[source]]\nkind = \"omni\"\nposition = [0, {h1}, 0]\nintensity = 1\n"
    );
    for r in 0..4 {
        text += &format!("[[point]]\nname = \"r{r}\"\nposition = [{r}, 0, 0]\nnormal = [0, 1, 0]\n");
    }
    let job = Job::parse(&text, "rqmc_gain").expect("the job is right");
    (format!("Sobolev {name}"), job, Model::default())
}

fn of_file(path: &str) -> (String, Job, Model) {
    let Prepared { plan, files } = prepare(Path::new(path)).unwrap_or_else(|e| panic!("{e}"));
    let content = |uri: &str| files.iter().find(|(input, _)| input.name == uri).expect("a file of the plan").1.clone();
    let model = match plan.inputs.first() {
        Some(first) => gltf::load(&first.name, &content(&first.name), &mut |uri| Ok(content(uri))),
        None => Ok(Model::default()),
    };
    (plan.name, plan.job, model.unwrap_or_else(|e| panic!("{e}")))
}

/// Prints one line for each receiver set.
fn compare(name: &str, job: &Job, scene: &Scene, histories: u64, batches: u64) {
    let [random, rqmc] = [Sampling::Random, Sampling::Rqmc].map(|sampling| {
        let mut job = job.clone();
        (job.run.sampling, job.run.histories_per_batch) = (sampling, histories);
        measure(&Realization::new(&job, scene, &bounds(&job, scene)), batches)
    });
    for ((set, random), rqmc) in job.sets().iter().zip(random).zip(rqmc) {
        let gain = random.variance.mean / rqmc.variance.mean;
        let [a, b] = [random.variance.relative_error(), rqmc.variance.relative_error()];
        let error = gain * (a * a + b * b).sqrt();
        let relative = rqmc.variance.mean.sqrt() / rqmc.size;
        println!("| {name} | {histories} | {} | {gain:.2} +- {error:.2} | {:.3} % |", set.name, 100.0 * relative);
    }
}

/// Of one receiver set.
struct Measured {
    /// Sum over bins of the variance of one batch.
    variance: Estimate,
    /// Root of the sum of squares of the means, direct light included.
    size: f64,
}

fn measure(realization: &Realization, batches: u64) -> Vec<Measured> {
    let length = batches / GROUPS;
    let group = |g: u64| -> Vec<(f64, f64)> {
        let scores: Vec<BatchScores> = (g * length..(g + 1) * length).map(|b| realization.batch(b)).collect();
        (0..scores[0].sets.len()).map(|set| sums(&scores, set, &realization.fixed_direct()[set])).collect()
    };
    let groups: Vec<Vec<(f64, f64)>> = (0..GROUPS).map(group).collect();
    let of_set = |set: usize| Measured {
        variance: Estimate::from_scores(groups.iter().map(|g| g[set].0)),
        size: Estimate::from_scores(groups.iter().map(|g| g[set].1)).mean.sqrt(),
    };
    (0..groups[0].len()).map(of_set).collect()
}

/// Sums over the bins of a set that have a value: variances of a batch, squares of the means.
fn sums(scores: &[BatchScores], set: usize, fixed: &[f64]) -> (f64, f64) {
    let bin = |i: usize| {
        let e = Estimate::from_scores(scores.iter().map(|b| b.sets[set].value[i]));
        let mean = e.mean + fixed.get(i).copied().unwrap_or(0.0);
        (e.standard_error * e.standard_error * e.n as f64, mean * mean)
    };
    let values = (0..scores[0].sets[set].value.len()).map(bin).filter(|(v, m)| v.is_finite() && m.is_finite());
    values.fold((0.0, 0.0), |(v, m), (dv, dm)| (v + dv, m + dm))
}
