//! One realization of a job: the scores of one batch, the only parallel computation.
//!
//! A batch is computed from its index alone. Its histories are traced in parallel and collected in index order;
//! then every tile of receivers sums all vertices in index order, so any number of threads gives the same bits.
//! The other estimators keep to this: a bin follows its own paths, a grid counts the histories in index order.
//! Each receiver set keeps the order in which its bins share tiles, found once from the centres of its bins.

use super::ordering::kd_order;
use super::receivers::{ReceiverSet, TileScores};
use crate::job::{Channels, Estimator, Job};
use crate::random::{Domain, Stream};
use crate::scene::Scene;
use crate::tally::{BatchScores, Scores};
use crate::transport::connection::{Connectors, TILE};
use crate::transport::trajectory::{FluxBalance, Record, Segment, Vertex, trace};
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
        let fixed_direct = sets.iter().map(|s| fixed_direct(s, scene, job.transport.estimator)).collect();
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
        let (sets, flux) = match self.job.transport.estimator {
            Estimator::Local => self.local(index),
            // No trajectory leaves a source.
            Estimator::Reverse => (self.reverse(index), FluxBalance::default()),
            Estimator::DirectSimulation => self.direct_simulation(index),
        };
        BatchScores { sets, flux: flux.scores(1.0 / self.job.run.histories_per_batch as f64) }
    }

    /// Scores by connections from trajectories to receivers.
    fn local(&self, index: u64) -> (Vec<Scores>, FluxBalance) {
        let (histories, flux) = self.connectors(index);
        let sets = self.sets.par_iter().zip(&self.orders_of_bins);
        (sets.map(|(set, order)| self.score(set, order, index, &histories)).collect(), flux)
    }

    /// Scores by paths from the receivers.
    fn reverse(&self, index: u64) -> Vec<Scores> {
        let of_set = |set: &ReceiverSet| {
            let stream = Stream::new(self.job.run.seed, Domain::Reverse, &set.shape().name);
            let bins = (0..set.shape().bins() as u32).into_par_iter();
            let paths = bins.map(|bin| set.reverse(self.scene, &self.job.transport, &stream, bin, index)).collect();
            set.reverse_scores(paths)
        };
        self.sets.par_iter().map(of_set).collect()
    }

    /// Scores by counting trajectories on the cells of the grids, the only receivers of such a job.
    fn direct_simulation(&self, index: u64) -> (Vec<Scores>, FluxBalance) {
        let traced = self.trace::<Vec<Segment>>(index);
        let mut flux = FluxBalance::default();
        traced.iter().for_each(|(_, balance)| flux.add(balance));
        let sets = self.sets.par_iter().zip(&self.job.grids);
        let count = |(set, grid): (&ReceiverSet, _)| set.counted(self.scene, grid, traced.iter().map(|(s, _)| s));
        (sets.map(count).collect(), flux)
    }

    /// The histories of a batch as connectors.
    fn connectors(&self, index: u64) -> (Connectors, FluxBalance) {
        let mut connectors = Connectors::default();
        let mut flux = FluxBalance::default();
        for (vertices, balance) in &self.trace::<Vec<Vertex>>(index) {
            connectors.push(self.scene, vertices, &self.orders);
            flux.add(balance);
        }
        (connectors, flux)
    }

    /// Traces the histories of a batch; their records in the order of their index.
    fn trace<R: Record + Default + Send>(&self, index: u64) -> Vec<(R, FluxBalance)> {
        let count = self.job.run.histories_per_batch;
        let first = index * count;
        let starts: Vec<u64> = (0..count).step_by(HISTORIES_AT_ONCE as usize).collect();
        let some = |start: u64| self.trace_some(first + start..first + (start + HISTORIES_AT_ONCE).min(count));
        let traced: Vec<Vec<_>> = starts.into_par_iter().map(some).collect();
        traced.into_iter().flatten().collect()
    }

    fn trace_some<R: Record + Default>(&self, histories: Range<u64>) -> Vec<(R, FluxBalance)> {
        let trace = |history| {
            let mut record = R::default();
            let mut rng = self.trajectories.generator(history);
            let flux = trace(self.scene, &self.job.transport, &mut rng, &mut record);
            (record, flux)
        };
        histories.map(trace).collect()
    }

    /// The scores of one receiver set by connections.
    fn score(&self, set: &ReceiverSet, order: &[u32], batch: u64, histories: &Connectors) -> Scores {
        let channels = if self.job.run.channels == Channels::Rgb { 3 } else { 1 };
        let tiles: Vec<TileScores> =
            order.par_chunks(TILE).map(|bins| set.score_tile(self.scene, bins, batch, histories, channels)).collect();
        let mut scores = Scores::zero(set.shape());
        for (bins, tile) in order.chunks(TILE).zip(tiles) {
            tile.scatter(bins, &mut scores);
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
fn fixed_direct(set: &ReceiverSet, scene: &Scene, estimator: Estimator) -> Vec<f64> {
    let bins = if set.has_no_fixed_direct() { 0 } else { set.shape().bins() };
    let of = |i| match estimator {
        Estimator::Local | Estimator::Reverse => set.fixed_direct(scene, i),
        Estimator::DirectSimulation => set.counted_beforehand(i),
    };
    (0..bins).into_par_iter().map(of).collect()
}
