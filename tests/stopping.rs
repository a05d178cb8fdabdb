//! Stopping at the first small error is rejected: an interval whose run ends at the first batch with a narrow enough
//! interval covers the truth too rarely, because a standard error that is small by luck ends the run and is believed.
//! The looks of a plan with a goal keep what the interval promises.
//!
//! Batch scores are means of h exponential histories: a skewed law (skewness 2/sqrt(h)) of mean 1. Both rules see the
//! same batches; the rule of the looks is the program's own code.

use lampyris::farm::merge::goal::{Goal, relative_half_width};
use lampyris::farm::plan::{Input, Plan, SceneSummary};
use lampyris::job::Job;
use lampyris::math::log;
use lampyris::random::{Domain, Generator, Stream};
use lampyris::tally::statistics::{Estimate, student_quantile};

const REPLICATES: u64 = 6000;
const LIMIT: u64 = 4000;
/// Two-sided 99 % normal quantile.
const Z99: f64 = 2.5758;

/// A job with one lux-meter and the goal `half_width`.
fn plan(half_width: f64, batches_per_shard: u64) -> Plan {
    let text = format!(
        "[run]\nbatches_per_shard = {batches_per_shard}\n[stop]\nrelative_half_width = {half_width}\n\
         max_batches = {LIMIT}\n[[point]]\nname = \"meter\"\nposition = [0, 0, 0]\nnormal = [0, 1, 0]\n\
         [[source]]\nkind = \"omni\"\nposition = [0, 1, 0]\nintensity = 1\n"
    );
    let scene =
        SceneSummary { triangles: 0, sources: 1, flux_lm: 1.0, bytes: 0, narrowest_lobe: 1.0, warnings: Vec::new() };
    let job = Job::parse(&text, "test.toml").unwrap();
    Plan::new("test", job, Input::of("test.toml", text.as_bytes()), Vec::new(), scene).unwrap()
}

/// Mean of `histories` exponential scores of mean 1.
fn batch(draw: &mut Generator, histories: u32) -> f64 {
    (0..histories).map(|_| -log(1.0 - draw.uniform())).sum::<f64>() / f64::from(histories)
}

/// How often the interval at the end covers 1, and the mean number of batches.
#[derive(Clone, Copy, Debug, Default)]
struct Outcome {
    covered: u64,
    batches: u64,
}

impl Outcome {
    fn take(&mut self, estimate: Estimate, quantile: f64) {
        let (low, high) = estimate.interval(quantile);
        self.covered += u64::from(low <= 1.0 && 1.0 <= high);
        self.batches += estimate.n;
    }

    fn coverage(self) -> f64 {
        self.covered as f64 / REPLICATES as f64
    }

    /// Half the width of the 99 % binomial interval of the coverage.
    fn bound(self) -> f64 {
        let p = self.coverage();
        Z99 * (p * (1.0 - p) / REPLICATES as f64).sqrt()
    }
}

/// Both rules on the same batches: (first small error, looks).
fn compare(histories: u32, half_width: f64, batches_per_shard: u64) -> (Outcome, Outcome) {
    let plan = plan(half_width, batches_per_shard);
    let goal = Goal::of(&plan).unwrap();
    let looks = plan.looks();
    let quantiles: Vec<f64> = (0..=LIMIT).map(|n| student_quantile(0.95, n)).collect();
    let stream = Stream::new(11, Domain::Receiver, "stopping");
    let (mut naive, mut looked) = (Outcome::default(), Outcome::default());
    for replicate in 0..REPLICATES {
        let mut draw = stream.generator(replicate);
        let (mut mean, mut m2, mut ended) = (0.0, 0.0, false);
        for n in 1..=LIMIT {
            let score = batch(&mut draw, histories);
            let d = score - mean;
            mean += d / n as f64;
            m2 += d * (score - mean);
            let (estimate, quantile) = (Estimate::from_moments(n, mean, m2), quantiles[n as usize]);
            if !ended && n >= 2 && relative_half_width(estimate, quantile) <= half_width {
                naive.take(estimate, quantile);
                ended = true;
            }
            let look = |_, take: &mut dyn FnMut(Estimate)| {
                take(estimate);
                Ok(())
            };
            if looks.contains(&n) && goal.look(n, &look).unwrap().reached {
                looked.take(estimate, quantile);
                break;
            }
            assert!(n < LIMIT, "the goal is within reach");
        }
        assert!(ended, "a look is one of the instants that the other rule takes");
    }
    (naive, looked)
}

#[test]
fn the_first_small_error_deceives_and_the_looks_do_not() {
    // (histories of a batch, goal, batches of a shard)
    let cases = [(4, 0.2, 32), (4, 0.1, 8), (16, 0.2, 8), (16, 0.1, 8), (16, 0.1, 32), (16, 0.05, 8)];
    for (histories, half_width, batches_per_shard) in cases {
        let (naive, looked) = compare(histories, half_width, batches_per_shard);
        let said = |o: Outcome| {
            let batches = o.batches as f64 / REPLICATES as f64;
            format!("{:.4} +- {:.4} after {batches:.1} batches", o.coverage(), o.bound())
        };
        println!(
            "batches of {histories}, {batches_per_shard} a shard, goal {half_width}: first small error {}, looks {}",
            said(naive),
            said(looked)
        );
        // The 99 % binomial interval of the coverage meets [0.94, 0.96], and the coverage lies in [0.93, 0.97].
        let (p, bound) = (looked.coverage(), looked.bound());
        assert!(p + bound >= 0.94 && p - bound <= 0.96 && (0.93..=0.97).contains(&p), "{looked:?}");
        // The other rule misses that: not by chance.
        assert!(naive.coverage() + naive.bound() < 0.94, "{naive:?}");
    }
}
