//! One realization of a job: the scores of one batch, the only parallel computation.
//!
//! A batch is computed from its index alone. Its histories are traced in parallel and collected in index order;
//! then every tile of receivers sums all vertices in index order, so any number of threads gives the same bits.
//! Each receiver set keeps the order in which its bins share tiles, found once from the centres of its bins.

use super::ordering::kd_order;
use super::receivers::{ReceiverSet, TileScores};
use crate::job::{Channels, Job};
use crate::random::{Domain, Stream};
use crate::scene::Scene;
use crate::tally::{BatchScores, Scores};
use crate::transport::connection::{Connectors, TILE};
use crate::transport::trajectory::{FluxBalance, Vertex, trace};
use rayon::prelude::*;
use std::ops::Range;

/// Histories traced by one thread at a time.
const HISTORIES_AT_ONCE: u64 = 64;

/// Everything that is the same for every batch of a job.
pub struct Realization<'a> {
    job: &'a Job,
    scene: &'a Scene,
    sets: Vec<ReceiverSet>,
    /// For each set its bins in the order in which they share tiles.
    orders_of_bins: Vec<Vec<u32>>,
    fixed_direct: Vec<Vec<f64>>,
    trajectories: Stream,
    orders: Range<u32>,
}

impl<'a> Realization<'a> {
    /// Prepares the receivers of `job` in `scene`, in the current rayon pool; `bounds` as in the plan.
    pub fn new(job: &'a Job, scene: &'a Scene, bounds: &[f64]) -> Self {
        let sets = ReceiverSet::all(job, scene, bounds);
        let orders_of_bins = sets.iter().map(|s| order_of_bins(s, scene)).collect();
        let fixed_direct = sets.iter().map(|s| fixed_direct(s, scene)).collect();
        let trajectories = Stream::new(job.run.seed, Domain::Trajectory, "");
        Realization { job, scene, sets, orders_of_bins, fixed_direct, trajectories, orders: 1..u32::MAX }
    }

    /// The same realization with only the vertices x_n, n in `orders`, connected: for tests order by order.
    pub fn with_orders(self, orders: Range<u32>) -> Self {
        Realization { orders, ..self }
    }

    /// Direct light that is the same in every batch, for each receiver set one entry a bin (NaN: no receiver
    /// there), or empty for zero everywhere \[lx or cd/m2\].
    pub fn fixed_direct(&self) -> &[Vec<f64>] {
        &self.fixed_direct
    }

    /// The scores of the batch number `index`.
    pub fn batch(&self, index: u64) -> BatchScores {
        let (histories, flux) = self.trace(index);
        let sets = self.sets.par_iter().zip(&self.orders_of_bins);
        let scores = sets.map(|(set, order)| self.score(set, order, index, &histories)).collect();
        BatchScores { sets: scores, flux: flux.scores(1.0 / self.job.run.histories_per_batch as f64) }
    }

    /// Traces the histories of a batch and prepares their vertices.
    fn trace(&self, index: u64) -> (Connectors, FluxBalance) {
        let count = self.job.run.histories_per_batch;
        let first = index * count;
        let starts: Vec<u64> = (0..count).step_by(HISTORIES_AT_ONCE as usize).collect();
        let traced: Vec<_> = starts
            .into_par_iter()
            .map(|start| self.trace_some(first + start..first + (start + HISTORIES_AT_ONCE).min(count)))
            .collect();
        let mut connectors = Connectors::default();
        let mut flux = FluxBalance::default();
        for (vertices, balance) in traced.iter().flatten() {
            connectors.push(self.scene, vertices);
            flux.add(balance);
        }
        (connectors, flux)
    }

    fn trace_some(&self, histories: Range<u64>) -> Vec<(Vec<Vertex>, FluxBalance)> {
        let trace = |history| {
            let mut vertices = Vec::new();
            let mut rng = self.trajectories.generator(history);
            let flux = trace(self.scene, &self.job.transport, &mut rng, &mut vertices);
            (vertices, flux)
        };
        histories.map(trace).collect()
    }

    /// The scores of one receiver set.
    fn score(&self, set: &ReceiverSet, order: &[u32], batch: u64, histories: &Connectors) -> Scores {
        let channels = if self.job.run.channels == Channels::Rgb { 3 } else { 1 };
        let rule = (channels, &self.orders);
        let tiles: Vec<TileScores> =
            order.par_chunks(TILE).map(|bins| set.score_tile(self.scene, bins, batch, histories, rule)).collect();
        let mut scores = Scores::zero(set.shape());
        for (bins, tile) in order.chunks(TILE).zip(tiles) {
            tile.scatter(bins, &set.shape().monitored, &mut scores);
        }
        scores
    }
}

/// The bins of `set` in the order in which they share tiles.
fn order_of_bins(set: &ReceiverSet, scene: &Scene) -> Vec<u32> {
    let centers: Vec<_> = (0..set.shape().bins()).into_par_iter().map(|i| set.center(scene, i)).collect();
    kd_order(&centers)
}

/// Direct light of the bins of `set` that is the same in every batch; empty for zero everywhere.
fn fixed_direct(set: &ReceiverSet, scene: &Scene) -> Vec<f64> {
    let bins = if set.has_no_fixed_direct() { 0 } else { set.shape().bins() };
    (0..bins).into_par_iter().map(|i| set.fixed_direct(scene, i)).collect()
}
