//! What the receivers of a tile of bins are in one batch, and the direct light there.
//!
//! The positions of a film are drawn bin by bin; the rays of all bins through one stratum are traced together, and so is the
//! direct light where they arrive.

use super::{Bins, ReceiverSet, gaze_ray};
use crate::geometry::Ray;
use crate::math::DVec2;
use crate::photometry::Colour;
use crate::random::Generator;
use crate::random::sobol::PointSet;
use crate::random::systematic::Systematic;
use crate::scene::Scene;
use crate::transport::direct::emitter_samples;
use crate::transport::eye::{Eye, Gaze};
use crate::transport::receiver::{Receiver, Seen, look_at};
use crate::transport::shared::{Effort, LitPoints, Shared, TOGETHER, direct_light};
use smallvec::SmallVec;

/// Histories of a batch for each point of an emitter that its receivers share: chosen by measured figure of merit
/// (docs/benchmarks.md).
const HISTORIES_OF_A_POINT: u64 = 2;
/// Histories of a batch for each of many lights without extent that the positions of a bin ask together, and the least
/// number that one position asks: chosen in the same way.
const HISTORIES_OF_A_LAMP: u64 = 1;
const LEAST_LAMPS: u64 = 4;

/// Parts along each side into which the strata of a bin across an edge are divided, a position in each, and the positions of
/// such a bin that carry connections: chosen in the same way.
const PARTS: u32 = 2;
const CARRIERS: u32 = 4;

/// Least weight of a position in the choice of carriers, so that none is left out whatever its law \[1/sr\].
const LEAST_WORTH: f64 = 1e-3;

/// What the positions of one bin say in one batch.
pub struct Sensed {
    /// Emission and sampled direct light \[lx or cd/m2\].
    pub direct: Colour,
    /// Where the histories are connected to: points, on opal surfaces both sides of them.
    pub receivers: Receivers,
    /// Whether a surface that reflects was there.
    pub existed: bool,
}

/// The receivers of a bin.
pub type Receivers = SmallVec<[Receiver; 1]>;

impl Sensed {
    fn nothing() -> Self {
        Sensed { direct: Colour::BLACK, receivers: Receivers::new(), existed: false }
    }
}

impl ReceiverSet {
    /// The points of emitters that all receivers of the set share in `batch`, for each position in a bin.
    pub fn lit_points(&self, scene: &Scene, batch: u64) -> Vec<LitPoints> {
        let positions = u64::from(self.positions());
        let count = (self.histories / (HISTORIES_OF_A_POINT * positions)).max(1).next_power_of_two() as u32;
        (0..positions).map(|position| self.lit_points_of(scene, batch, position, count)).collect()
    }

    /// The points of emitters that the points of continuations share in `batch`: a run for each of `groups` paths.
    pub fn lit_points_of_continuations(&self, scene: &Scene, batch: u64, groups: usize) -> LitPoints {
        let count = (groups.next_power_of_two() * TOGETHER) as u32;
        self.lit_points_of(scene, batch, u64::from(self.positions()), count)
    }

    fn lit_points_of(&self, scene: &Scene, batch: u64, position: u64, count: u32) -> LitPoints {
        let index = batch * (u64::from(self.positions()) + 1) + position;
        LitPoints::new(scene, &PointSet::new(&self.emitters, index, count.ilog2()), count)
    }

    /// Positions in a bin and batch.
    pub(super) fn positions(&self) -> u32 {
        match &self.bins {
            Bins::Film { strata, .. } => strata * strata,
            Bins::Meters(_) => 1,
        }
    }

    /// Receivers of the bins of a tile in one batch, with their direct light; `shared` are the lit points of the batch.
    pub fn sense(&self, scene: &Scene, bins: &[u32], batch: u64, shared: &[LitPoints], channels: usize) -> Vec<Sensed> {
        let generator = |&bin: &u32| self.stream.generator(batch * self.shape.bins() as u64 + u64::from(bin));
        let mut rngs: Vec<Generator> = bins.iter().map(generator).collect();
        match &self.bins {
            Bins::Meters(meters) => self.sense_meters(scene, bins, meters, &mut rngs, &shared[0], channels),
            Bins::Film { eye, .. } => self.sense_film(scene, bins, eye, &mut rngs, shared, channels),
        }
    }

    fn sense_meters(
        &self,
        scene: &Scene,
        bins: &[u32],
        meters: &[Option<Receiver>],
        rngs: &mut [Generator],
        shared: &LitPoints,
        channels: usize,
    ) -> Vec<Sensed> {
        let receivers: Vec<Option<Receiver>> = bins.iter().map(|&bin| meters[bin as usize]).collect();
        // Their light from lights without extent is the same in every batch.
        let mut rngs: Vec<&mut Generator> = rngs.iter_mut().collect();
        let light = self.light(scene, &receivers, &mut rngs, shared, (0, channels));
        let sensed = |(receiver, direct): (Option<Receiver>, Colour)| {
            // In a scene without reflection there is nothing to wait for beyond direct light.
            let existed = receiver.is_some() && scene.reflects();
            Sensed { direct, receivers: receiver.into_iter().collect(), existed }
        };
        receivers.into_iter().zip(light).map(sensed).collect()
    }

    fn sense_film(
        &self,
        scene: &Scene,
        bins: &[u32],
        eye: &Eye,
        rngs: &mut [Generator],
        shared: &[LitPoints],
        channels: usize,
    ) -> Vec<Sensed> {
        let positions = self.positions();
        let lamps = (self.histories / (HISTORIES_OF_A_LAMP * u64::from(positions))).max(LEAST_LAMPS);
        let carrying: Vec<u32> = rngs.iter_mut().map(|rng| rng.below(positions)).collect();
        let mut sensed: Vec<Sensed> = bins.iter().map(|_| Sensed::nothing()).collect();
        let mut seen_across: Vec<Vec<Seen>> = vec![Vec::new(); bins.len()];
        for (stratum, shared) in (0..).zip(shared) {
            for part in 0..PARTS * PARTS {
                let what = (lamps, channels);
                for (i, seen, light) in self.sense_part(scene, bins, eye, (stratum, part), rngs, (shared, what)) {
                    let sensed = &mut sensed[i];
                    sensed.direct += (seen.emitted + light) / self.positions_of(bins[i]);
                    sensed.existed |= seen.receiver.is_some();
                    if self.is_across(bins[i]) {
                        seen_across[i].push(seen);
                    } else if stratum == carrying[i] {
                        sensed.receivers.extend([seen.receiver, seen.behind].into_iter().flatten());
                    }
                }
            }
        }
        for (i, seen) in seen_across.into_iter().enumerate().filter(|(_, seen)| !seen.is_empty()) {
            sensed[i].receivers = carriers(scene, &seen, &mut rngs[i]);
        }
        sensed
    }

    /// What is seen in one part of one stratum, and the direct light there: of all bins in the first part, of those across an edge in the
    /// others; with the place of each in `bins`.
    fn sense_part(
        &self,
        scene: &Scene,
        bins: &[u32],
        eye: &Eye,
        (stratum, part): (u32, u32),
        rngs: &mut [Generator],
        (shared, what): (&LitPoints, (u64, usize)),
    ) -> Vec<(usize, Seen, Colour)> {
        let asked = |i: &usize| part == 0 || self.is_across(bins[*i]);
        let places: Vec<usize> = (0..bins.len()).filter(asked).collect();
        if places.is_empty() {
            return Vec::new();
        }
        let of_places = (0..).zip(rngs).filter(|(i, _)| asked(i));
        let mut rngs: Vec<&mut Generator> = of_places.map(|(_, rng)| rng).collect();
        let some: Vec<u32> = places.iter().map(|&i| bins[i]).collect();
        let seen = self.look(scene, &some, eye, (stratum, part), &mut rngs);
        let receivers: Vec<Option<Receiver>> = seen.iter().map(|s| s.receiver).collect();
        let mut light = self.light(scene, &receivers, &mut rngs, shared, what);
        let behind: Vec<Option<Receiver>> = seen.iter().map(|s| s.behind).collect();
        if behind.iter().any(Option::is_some) {
            let through = self.light(scene, &behind, &mut rngs, shared, what);
            light.iter_mut().zip(through).for_each(|(light, through)| *light += through);
        }
        places.into_iter().zip(seen).zip(light).map(|((i, seen), light)| (i, seen, light)).collect()
    }

    /// True where the bin lies across an edge.
    fn is_across(&self, bin: u32) -> bool {
        self.edges.get(bin as usize) == Some(&true)
    }

    /// Positions in `bin` and batch.
    fn positions_of(&self, bin: u32) -> f64 {
        let parts = if self.is_across(bin) { PARTS * PARTS } else { 1 };
        f64::from(self.positions() * parts)
    }

    /// The film position of `bin` in a part of a stratum.
    fn place(&self, eye: &Eye, bin: u32, (stratum, part): (u32, u32), rng: &mut Generator) -> DVec2 {
        let strata = self.positions().isqrt();
        if !self.is_across(bin) {
            return self.draw(eye, (strata, stratum), bin as usize, rng);
        }
        let finer = strata * PARTS;
        let (column, row) = (stratum % strata * PARTS + part % PARTS, stratum / strata * PARTS + part / PARTS);
        self.draw(eye, (finer, row * finer + column), bin as usize, rng)
    }

    /// What an eye sees at a position in a part of one stratum of each bin.
    fn look(&self, scene: &Scene, bins: &[u32], eye: &Eye, part: (u32, u32), rngs: &mut [&mut Generator]) -> Vec<Seen> {
        let draw = |(&bin, rng): (&u32, &mut &mut Generator)| eye.gaze(self.place(eye, bin, part, rng));
        let gazes: Vec<Gaze> = bins.iter().zip(&mut *rngs).map(draw).collect();
        let rays: Vec<Ray> = gazes.iter().filter_map(gaze_ray).collect();
        let mut hits = vec![None; rays.len()];
        scene.geometry.closest_hits(&rays, &mut hits);
        let mut hits = hits.into_iter();
        let mut see = |(gaze, rng): (&Gaze, &mut &mut Generator)| {
            let (hit, direction) = match gaze {
                Gaze::Along(ray) => (hits.next().flatten(), ray.direction),
                Gaze::At(hit, direction) => (Some(*hit), *direction),
                Gaze::Nowhere => return Seen::NOTHING,
            };
            match hit {
                Some(hit) => look_at(scene, hit, direction, rng),
                None => Seen { emitted: scene.beyond(direction), ..Seen::NOTHING },
            }
        };
        gazes.iter().zip(rngs).map(&mut see).collect()
    }

    /// Direct light at the receivers that are there, black at the others.
    fn light(
        &self,
        scene: &Scene,
        receivers: &[Option<Receiver>],
        rngs: &mut [&mut Generator],
        shared: &LitPoints,
        (lamps, channels): (u64, usize),
    ) -> Vec<Colour> {
        let samples = emitter_samples(self.histories).div_ceil(u64::from(self.positions()));
        let there = receivers.iter().zip(rngs).filter_map(|(r, rng)| Some(((*r)?, &mut **rng)));
        let mut there: Vec<(Receiver, &mut Generator)> = there.collect();
        let effort = Effort { lamps, samples, of_sky: samples };
        let mut light = direct_light(scene, &mut there, &Shared::all(shared), effort, channels).into_iter();
        receivers.iter().map(|r| r.and_then(|_| light.next()).unwrap_or(Colour::BLACK)).collect()
    }
}

/// Receivers that stand for all that is `seen` in the positions of a bin: some of them, each chosen in proportion to what it reflects.
fn carriers(scene: &Scene, seen: &[Seen], rng: &mut Generator) -> Receivers {
    let matt = |r: Receiver| r.response.as_if_matt(scene, r.normal, -r.normal).luminance();
    let worth = |seen: &Seen| seen.receiver.map_or(0.0, |r| LEAST_WORTH + matt(r));
    let step = seen.iter().map(worth).sum::<f64>() / f64::from(CARRIERS);
    let mut chosen = Receivers::new();
    // Nothing, or less than a number can tell from nothing.
    if step < f64::MIN_POSITIVE {
        return chosen;
    }
    let mut choice = Systematic::new(step, rng.uniform());
    let positions = seen.len() as f64;
    for seen in seen {
        let worth = worth(seen);
        let times = choice.times(worth);
        if times > 0 {
            let weight = f64::from(times) * step / (worth * positions);
            chosen.extend([seen.receiver, seen.behind].into_iter().flatten().map(|r| r.weighted(weight)));
        }
    }
    chosen
}
