//! One realization of a job: the scores of one batch, with `farm::local` and `farm::thinning` the only parallel computation.
//!
//! A batch is computed from its index alone. Its trajectories are traced in parallel and collected in index order, and thinned
//! to histories; then every tile of receivers sums all vertices history by history, so any number of threads gives the same
//! bits. The other estimators keep to this: a bin follows its own paths, a grid counts the histories in index order.
//! Each receiver set keeps the order in which its bins share tiles, found once from the centres of its bins.

use super::local;
use super::receivers::{CentreSight, ReceiverSet};
use super::regions::{Regions, Seen};
use super::thinning::{Histories, Thinning};
use crate::geometry::kd_order;
use crate::job::{Channels, Estimator, Job, Sampling};
use crate::random::sobol::PointSet;
use crate::random::{Domain, Stream};
use crate::scene::Scene;
use crate::tally::{BatchScores, Scores};
use crate::transport::connection::{Connectors, TILE};
use crate::transport::trajectory::{FluxBalance, Record, Segment, Vertex, trace};
use rayon::prelude::*;
use std::ops::Range;

/// Trajectories traced by one thread at a time.
const TRAJECTORIES_AT_ONCE: u64 = 64;

/// Trajectories traced before their vertices are thinned, all threads together.
const WAVE: u64 = 1024;

/// Everything that is the same for every batch of a job.
pub struct Realization<'a> {
    job: &'a Job,
    scene: &'a Scene,
    /// All receiver sets but the regions, which come last.
    sets: Vec<ReceiverSet>,
    regions: Regions,
    /// For each set its bins in the order in which they share tiles.
    orders_of_bins: Vec<Vec<u32>>,
    fixed_direct: Vec<Vec<f64>>,
    trajectories: Stream,
    scrambling: Stream,
    thinning: Stream,
    orders: Range<u32>,
}

impl<'a> Realization<'a> {
    /// Prepares the receivers of `job` in `scene`, in the current rayon pool; `bounds` as in the plan.
    pub fn new(job: &'a Job, scene: &'a Scene, bounds: &[f64]) -> Self {
        let sets = ReceiverSet::all(job, scene, bounds);
        let orders_of_bins: Vec<_> = sets.iter().map(|s| order_of_bins(s, scene)).collect();
        let regions = Regions::place(job, scene, "", centres).expect("regions were placed when the job was planned");
        let estimator = job.transport.estimator;
        let fixed = |(set, order): (&ReceiverSet, &Vec<u32>)| fixed_direct(set, scene, order, estimator);
        let mut fixed_direct: Vec<Vec<f64>> = sets.iter().zip(&orders_of_bins).map(fixed).collect();
        // A map has no direct light that is the same in every batch, and so has no region.
        fixed_direct.resize_with(sets.len() + regions.len(), Vec::new);
        let trajectories = Stream::new(job.run.seed, Domain::Trajectory, "");
        let scrambling = Stream::new(job.run.seed, Domain::Scrambling, "");
        let thinning = Stream::new(job.run.seed, Domain::Thinning, "");
        let orders = 1..u32::MAX;
        Realization {
            job,
            scene,
            sets,
            regions,
            orders_of_bins,
            fixed_direct,
            trajectories,
            scrambling,
            thinning,
            orders,
        }
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
        let (mut sets, flux) = match self.job.transport.estimator {
            Estimator::Local => self.local(index),
            // No trajectory leaves a source.
            Estimator::Reverse => (self.reverse(index), FluxBalance::default()),
            Estimator::DirectSimulation => self.direct_simulation(index),
        };
        sets.extend(self.regions.scores(&sets));
        BatchScores { sets, flux: flux.scores(1.0 / self.job.run.trajectories_per_batch() as f64) }
    }

    /// Scores by connections from trajectories to receivers.
    fn local(&self, index: u64) -> (Vec<Scores>, FluxBalance) {
        let (histories, flux) = self.histories(index);
        let sets = self.sets.par_iter().zip(&self.orders_of_bins);
        let channels = if self.job.run.channels == Channels::Rgb { 3 } else { 1 };
        let rule = (channels, &self.orders);
        let score =
            |(set, order): (&ReceiverSet, &Vec<u32>)| local::score(set, self.scene, order, index, &histories, rule);
        (sets.map(score).collect(), flux)
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
        let traced = self.trace::<Segment>(index, 0..self.job.run.trajectories_per_batch());
        let flux = balance(&traced);
        let sets = self.sets.par_iter().zip(&self.job.grids);
        let count =
            |(set, grid): (&ReceiverSet, _)| set.counted(self.scene, grid, traced.iter().flat_map(Traced::histories));
        (sets.map(count).collect(), flux)
    }

    /// The histories of a batch.
    fn histories(&self, index: u64) -> (Histories, FluxBalance) {
        let count = self.job.run.trajectories_per_batch();
        if self.job.run.thinning == 1 {
            let traced = self.trace::<Vertex>(index, 0..count);
            let mut connectors = Connectors::default();
            traced.iter().flat_map(Traced::histories).for_each(|vertices| connectors.push(self.scene, vertices));
            return (Histories { connectors, pool: None }, balance(&traced));
        }
        let mut flux = FluxBalance::default();
        let run = &self.job.run;
        let chosen = (run.thinning, run.vertices_kept());
        let mut thinning = Thinning::new(self.scene, chosen, self.thinning.generator(index));
        for start in (0..count).step_by(WAVE as usize) {
            let traced = self.trace::<Vertex>(index, start..(start + WAVE).min(count));
            flux.add(&balance(&traced));
            thinning.take(traced.into_iter().flat_map(|t| t.records));
        }
        (thinning.finish(self.job.run.histories_per_batch), flux)
    }

    /// The quasi-random set of a batch, where the job asks for one.
    fn points(&self, batch: u64) -> Option<PointSet> {
        let count = self.job.run.trajectories_per_batch();
        let set = || {
            assert!(count.is_power_of_two(), "the job was checked: {count} histories");
            PointSet::new(&self.scrambling, batch, count.ilog2())
        };
        (self.job.run.sampling == Sampling::Rqmc).then(set)
    }

    /// Traces the trajectories `range` of a batch, in the order of their index.
    fn trace<T: Send>(&self, index: u64, range: Range<u64>) -> Vec<Traced<T>>
    where
        Vec<T>: Record,
    {
        let points = self.points(index);
        let starts: Vec<u64> = range.clone().step_by(TRAJECTORIES_AT_ONCE as usize).collect();
        let some =
            |start| self.trace_some(index, start..(start + TRAJECTORIES_AT_ONCE).min(range.end), points.as_ref());
        starts.into_par_iter().map(some).collect()
    }

    /// Traces the trajectories `range` of a batch; number i starts with point i of `points`.
    fn trace_some<T>(&self, batch: u64, range: Range<u64>, points: Option<&PointSet>) -> Traced<T>
    where
        Vec<T>: Record,
    {
        let first = batch * self.job.run.trajectories_per_batch();
        let mut traced = Traced { records: Vec::new(), ends: Vec::new(), flux: FluxBalance::default() };
        for i in range {
            let mut rng = self.trajectories.generator(first + i);
            if let Some(points) = points {
                rng = rng.after(points.point(i as u32));
            }
            traced.flux.add(&trace(self.scene, &self.job.transport, &mut rng, &mut traced.records));
            traced.ends.push(traced.records.len());
        }
        traced
    }
}

/// What some trajectories left behind, one after the other.
struct Traced<T> {
    records: Vec<T>,
    /// Where the records of each trajectory end.
    ends: Vec<usize>,
    flux: FluxBalance,
}

impl<T> Traced<T> {
    /// The records of each trajectory.
    fn histories(&self) -> impl Iterator<Item = &[T]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.records[start..end])
    }
}

/// The fate of the flux of all trajectories.
fn balance<T>(traced: &[Traced<T>]) -> FluxBalance {
    let mut flux = FluxBalance::default();
    traced.iter().for_each(|t| flux.add(&t.flux));
    flux
}

/// The surfaces seen in the centre of each pixel.
fn centres(sight: &CentreSight) -> Seen {
    (0..sight.pixels()).into_par_iter().map(|pixel| sight.surfaces(pixel)).collect()
}

/// The bins of `set` in the order in which they share tiles.
fn order_of_bins(set: &ReceiverSet, scene: &Scene) -> Vec<u32> {
    let centers: Vec<_> = (0..set.shape().bins()).into_par_iter().map(|i| set.center(scene, i)).collect();
    kd_order(&centers)
}

/// Direct light of the bins of `set` that is the same in every batch; empty for zero everywhere. `order` has the bins in the order in
/// which they share tiles.
fn fixed_direct(set: &ReceiverSet, scene: &Scene, order: &[u32], estimator: Estimator) -> Vec<f64> {
    if set.has_no_fixed_direct() {
        return Vec::new();
    }
    if estimator == Estimator::DirectSimulation {
        return (0..set.shape().bins()).map(|i| set.counted_beforehand(i)).collect();
    }
    let mut all = vec![0.0; set.shape().bins()];
    let tiles: Vec<Vec<f64>> = order.par_chunks(TILE).map(|bins| set.fixed_direct(scene, bins)).collect();
    order.iter().zip(tiles.into_iter().flatten()).for_each(|(&bin, light)| all[bin as usize] = light);
    all
}
