//! One replicate: an experiment under a seed of its own, and what it says of a quantity.
//!
//! Intervals and marks are the crate's: `Estimate` and `student_quantile`, `tally::derived`, `tally::health`; runs with a
//! goal end at the looks of their plan.

use lampyris::farm::merge::goal::Goal;
use lampyris::farm::plan::{Input, Plan, SceneSummary};
use lampyris::farm::realization::Realization;
use lampyris::job::Job;
use lampyris::tally::derived::{Bounded, Family, Series, family_quantile, ratio};
use lampyris::tally::health::{Common, Counted, Examined, Signs};
use lampyris::tally::statistics::{Estimate, student_quantile};
use lampyris::tally::{Moments, Replicates, SetTally, Tally};
use lampyris::validate::experiment::Experiment;

/// Why reading batch scores does not fail here.
const HELD: &str = "batch scores of one process are in memory";

/// What is read from a replicate.
#[derive(Clone, Debug)]
pub enum Kind {
    /// A bin of a set, direct light included.
    Total(usize, usize),
    /// The same without direct light, of a set that keeps its batches or of the first pixel of a map.
    Indirect(usize),
    /// Mean of a grid.
    Mean(usize),
    /// Least value of a grid.
    Minimum(usize),
    /// Least value over mean of a grid.
    Uniformity(usize),
    /// All bins of a grid at once.
    Together(usize),
    /// First bin of one set over the first bin of another.
    Ratio(usize, usize),
}

impl Kind {
    /// True for intervals that are wider than need be, by construction.
    pub fn is_conservative(&self) -> bool {
        matches!(self, Kind::Minimum(_) | Kind::Uniformity(_) | Kind::Together(_))
    }

    /// Sets and bins whose marks are those of the quantity.
    fn bins(&self, tally: &Tally) -> Vec<(usize, usize)> {
        match *self {
            Kind::Total(set, bin) => vec![(set, bin)],
            Kind::Indirect(set) => vec![(set, 0)],
            Kind::Ratio(a, b) => vec![(a, 0), (b, 0)],
            Kind::Mean(set) | Kind::Minimum(set) | Kind::Uniformity(set) | Kind::Together(set) => {
                let SetTally::Replicates(scores) = &tally.sets[set] else { panic!("grids keep their batches") };
                (0..scores.bins as usize).map(|bin| (set, bin)).collect()
            }
        }
    }
}

/// A value with its interval; of several bins one after the other.
#[derive(Clone, Debug)]
pub struct Reading {
    /// (value, low, high), one, or as many as bins hold together.
    pub intervals: Vec<(f64, f64, f64)>,
    /// Standard error of the first value; NaN where it has none.
    pub standard_error: f64,
    /// What the marks follow from, one for each bin concerned.
    pub signs: Vec<Signs>,
    /// Batches of the replicate.
    pub batches: u64,
}

/// The tally of an experiment under one seed.
pub struct Replicate {
    tally: Tally,
    fixed: Vec<Vec<f64>>,
    /// Scores less direct light, of the first bin of each set, batch by batch.
    indirect: Vec<Vec<f64>>,
    job: Job,
    narrowest_lobe: f64,
}

impl Replicate {
    /// All batches of `experiment` under `seed`; with a goal, those before the look that finds it reached.
    pub fn new(experiment: &Experiment, seed: u64) -> Replicate {
        Replicate::of(experiment, seed, experiment.job.run.batches)
    }

    /// As [`Replicate::new`], of `batches` batches at most.
    pub fn of(experiment: &Experiment, seed: u64, batches: u64) -> Replicate {
        let mut job = experiment.job.clone();
        job.run.seed = seed;
        let realization = Realization::new(&job, &experiment.scene, &experiment.bounds);
        let goal = job.stop.as_ref().map(|_| plan(&job)).map(|plan| (Goal::of(&plan).expect("a goal"), plan.looks()));
        let shapes = job.sets();
        let indirect = vec![Vec::new(); shapes.len()];
        let fixed = realization.fixed_direct().to_vec();
        let narrowest_lobe = experiment.scene.narrowest_lobe();
        let mut replicate = Replicate { tally: Tally::new(&shapes), fixed, indirect, job: job.clone(), narrowest_lobe };
        for index in 0..batches {
            let scores = realization.batch(index);
            for (indirect, set) in replicate.indirect.iter_mut().zip(&scores.sets) {
                indirect.push(set.value[0] - set.direct[0]);
            }
            replicate.tally.accumulate(&scores);
            if goal.as_ref().is_some_and(|(goal, looks)| looks.contains(&(index + 1)) && replicate.reaches(goal)) {
                break;
            }
        }
        replicate
    }

    fn reaches(&self, goal: &Goal) -> bool {
        let estimates = |set: usize, take: &mut dyn FnMut(Estimate)| {
            let bins = match &self.tally.sets[set] {
                SetTally::Moments(m) => m.bins.len(),
                SetTally::Replicates(r) => r.bins as usize,
            };
            (0..bins).filter_map(|bin| self.estimate(set, bin)).for_each(take);
            Ok(())
        };
        goal.look(self.tally.batches(), &estimates).expect("nothing is read").reached
    }

    /// The estimate of a bin, direct light included; None without a receiver.
    pub fn estimate(&self, set: usize, bin: usize) -> Option<Estimate> {
        let random = match &self.tally.sets[set] {
            SetTally::Moments(m) => m.bins.estimate(bin, m.n),
            SetTally::Replicates(r) => r.estimate(bin),
        };
        random.with_fixed(&self.fixed[set], bin)
    }

    /// What this replicate says of a quantity.
    pub fn read(&self, kind: &Kind) -> Reading {
        let batches = self.tally.batches();
        let confidence = self.job.run.confidence;
        let t = student_quantile(confidence, batches);
        let of = |e: Estimate| (vec![with(e, t)], e.standard_error);
        let (intervals, standard_error) = match *kind {
            Kind::Total(set, bin) => of(self.estimate(set, bin).expect("a receiver")),
            Kind::Indirect(set) => of(Estimate::from_scores(self.indirect[set].iter().copied())),
            Kind::Mean(set) => of(self.series(set).estimate()),
            Kind::Ratio(a, b) => of(ratio(&self.series(a), &self.series(b), confidence)),
            Kind::Minimum(set) => bounded(self.family(set).minimum(confidence).expect(HELD)),
            Kind::Uniformity(set) => bounded(self.family(set).uniformity(confidence).expect(HELD)),
            Kind::Together(set) => {
                let bins = self.replicates(set).bins as usize;
                let t = family_quantile(confidence, self.family(set).len(), batches);
                let of_bin = |bin| with(self.estimate(set, bin).expect("a receiver"), t);
                ((0..bins).map(of_bin).collect(), f64::NAN)
            }
        };
        let signs = kind.bins(&self.tally).into_iter().map(|(set, bin)| self.signs(set, bin)).collect();
        Reading { intervals, standard_error, signs, batches }
    }

    fn replicates(&self, set: usize) -> &Replicates {
        let SetTally::Replicates(scores) = &self.tally.sets[set] else { panic!("a set that keeps its batches") };
        scores
    }

    fn family(&self, set: usize) -> Family<'_> {
        Family::new(self.replicates(set), &self.fixed[set])
    }

    fn series(&self, set: usize) -> Series {
        self.family(set).mean().expect(HELD)
    }

    /// What the marks of a bin follow from.
    fn signs(&self, set: usize, bin: usize) -> Signs {
        let counted = match &self.tally.sets[set] {
            SetTally::Moments(Moments { n, bins }) => Counted::of_moments(bins, bin, *n),
            SetTally::Replicates(scores) => Counted::of_replicates(scores, bin),
        };
        let run = &self.job.run;
        let fixed = self.fixed[set].get(bin).copied().unwrap_or(0.0);
        let monitor = self.tally.monitors[set].iter().find(|m| m.bin as usize == bin);
        let examined = monitor.map(|m| Examined::new(m, fixed, run.sampling));
        let histories = self.tally.batches() as f64 * run.histories_per_batch as f64;
        let common = Common { histories, narrowest_lobe: self.narrowest_lobe };
        Signs::of(&common, &counted, fixed, examined.as_ref())
    }
}

fn with(estimate: Estimate, t: f64) -> (f64, f64, f64) {
    let (low, high) = estimate.interval(t);
    (estimate.mean, low, high)
}

fn bounded(b: Bounded) -> (Vec<(f64, f64, f64)>, f64) {
    (vec![(b.value, b.low, b.high)], f64::NAN)
}

/// The plan of a job in memory, for its goal and looks.
fn plan(job: &Job) -> Plan {
    let (narrowest_lobe, warnings) = (1.0, Vec::new());
    let scene = SceneSummary { triangles: 0, sources: 1, flux_lm: 1.0, bytes: 0, narrowest_lobe, warnings };
    Plan::new("coverage", job.clone(), Input::of("job.toml", b""), Vec::new(), scene).expect("a job for a plan")
}
