//! One job in one scene, run in this process without files: TOML and model -> batches -> estimates.

use crate::error::Result;
use crate::farm::pilot::bounds;
use crate::farm::realization::Realization;
use crate::job::Job;
use crate::scene::{Model, Scene};
use crate::tally::statistics::Estimate;
use crate::tally::{BatchScores, FLUX_BINS};
use std::ops::Range;

/// A job in its scene, ready to run.
pub struct Experiment {
    /// What is asked.
    pub job: Job,
    /// What is there.
    pub scene: Scene,
    /// b of the bounded kernel, as a plan holds it \[1/m2\].
    pub bounds: Vec<f64>,
}

impl Experiment {
    /// The job given as TOML, without a scene file, over `model`.
    ///
    /// # Errors
    /// [`Error::Input`](crate::error::Error::Input) for what the job or the model gets wrong.
    pub fn new(toml: &str, model: Model) -> Result<Experiment> {
        let named =
            if model.triangles.is_empty() && model.replacements.is_empty() { "" } else { "scene = \"in memory\"\n" };
        let job = Job::parse(&format!("{named}{toml}"), "in memory")?;
        let scene = Scene::new(model, &job)?;
        let bounds = bounds(&job, &scene);
        Ok(Experiment { job, scene, bounds })
    }

    /// Direct light that is the same in every batch, and the scores of all batches with vertices limited to `orders`.
    pub fn batches(&self, orders: Range<u32>) -> (Vec<Vec<f64>>, Vec<BatchScores>) {
        let realization = Realization::new(&self.job, &self.scene, &self.bounds).with_orders(orders);
        let scores = (0..self.job.run.batches).map(|i| realization.batch(i)).collect();
        (realization.fixed_direct().to_vec(), scores)
    }

    /// Estimates of every bin of every receiver set, direct light included \[lx or cd/m2\].
    pub fn estimates(&self) -> Vec<Vec<Estimate>> {
        let (fixed, batches) = self.batches(0..u32::MAX);
        estimates(&batches).iter().zip(fixed).map(|(set, fixed)| shifted(set, &fixed)).collect()
    }

    /// The first bin of every receiver set, direct light included: for sets of one bin \[lx or cd/m2\].
    pub fn values(&self) -> Vec<Estimate> {
        self.estimates().iter().map(|set| set[0]).collect()
    }

    /// Direct light that is the same in every batch, at the first bin of every receiver set; it has no error.
    pub fn direct(&self) -> Vec<Estimate> {
        let realization = Realization::new(&self.job, &self.scene, &self.bounds);
        let value = |set: &Vec<f64>| Estimate { n: self.job.run.batches, mean: set[0], standard_error: 0.0 };
        realization.fixed_direct().iter().map(value).collect()
    }

    /// Estimates of the part of every bin that differs from batch to batch, vertices limited to `orders`: all that is
    /// reflected, and the direct light of sources with an area \[lx or cd/m2\].
    pub fn estimates_of_orders(&self, orders: Range<u32>) -> Vec<Vec<Estimate>> {
        estimates(&self.batches(orders).1)
    }
}

fn shifted(set: &[Estimate], fixed: &[f64]) -> Vec<Estimate> {
    set.iter().enumerate().map(|(i, e)| e.shifted(fixed.get(i).copied().unwrap_or(0.0))).collect()
}

/// Estimates of every bin of every receiver set from the scores of all batches.
pub fn estimates(batches: &[BatchScores]) -> Vec<Vec<Estimate>> {
    let sets = 0..batches[0].sets.len();
    let bin = |set: usize, i: usize| Estimate::from_scores(batches.iter().map(|b| b.sets[set].value[i]));
    sets.map(|set| (0..batches[0].sets[set].value.len()).map(|i| bin(set, i)).collect()).collect()
}

/// The estimate of the bin `name` of the flux balance \[lm\].
pub fn flux(batches: &[BatchScores], name: &str) -> Estimate {
    let bin = FLUX_BINS.iter().position(|&b| b == name).expect("one of FLUX_BINS");
    Estimate::from_scores(batches.iter().map(|b| b.flux[bin]))
}
