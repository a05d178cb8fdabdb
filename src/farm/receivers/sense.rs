//! What the receivers of a tile of bins are in one batch, and the direct light there.
//!
//! The positions of a film are drawn bin by bin; the rays of all bins through one stratum are traced together, and so is the
//! direct light where they arrive.

use super::{Bins, ReceiverSet, gaze_ray};
use crate::geometry::Ray;
use crate::photometry::Colour;
use crate::random::Generator;
use crate::random::sobol::PointSet;
use crate::scene::Scene;
use crate::transport::direct::emitter_samples;
use crate::transport::eye::{Eye, Gaze};
use crate::transport::receiver::{Receiver, Seen, look_at};
use crate::transport::shared::{Effort, LitPoints, Shared, TOGETHER, direct_light};

/// Histories of a batch for each point of an emitter that its receivers share: chosen by measured figure of merit
/// (docs/benchmarks.md).
const HISTORIES_OF_A_POINT: u64 = 2;
/// Histories of a batch for each of many lights without extent that the positions of a bin ask together, and the least
/// number that one position asks: chosen in the same way.
const HISTORIES_OF_A_LAMP: u64 = 1;
const LEAST_LAMPS: u64 = 4;

/// What the positions of one bin say in one batch.
pub struct Sensed {
    /// Emission and sampled direct light \[lx or cd/m2\].
    pub direct: Colour,
    /// Where the histories are connected to.
    pub receiver: Option<Receiver>,
    /// The same for light that arrives on the other side of an opal surface.
    pub behind: Option<Receiver>,
    /// Whether a surface that reflects was there.
    pub existed: bool,
}

impl Sensed {
    fn nothing() -> Self {
        Sensed { direct: Colour::BLACK, receiver: None, behind: None, existed: false }
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
        let light = self.light(scene, &receivers, rngs, shared, 0, channels);
        let sensed = |(receiver, direct): (Option<Receiver>, Colour)| {
            // In a scene without reflection there is nothing to wait for beyond direct light.
            Sensed { direct, receiver, behind: None, existed: receiver.is_some() && scene.reflects() }
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
        for (stratum, shared) in (0..).zip(shared) {
            let seen = self.look(scene, bins, eye, stratum, rngs);
            let receivers: Vec<Option<Receiver>> = seen.iter().map(|s| s.receiver).collect();
            let light = self.light(scene, &receivers, rngs, shared, lamps, channels);
            let behind: Vec<Option<Receiver>> = seen.iter().map(|s| s.behind).collect();
            if behind.iter().any(Option::is_some) {
                let through = self.light(scene, &behind, rngs, shared, lamps, channels);
                sensed.iter_mut().zip(through).for_each(|(sensed, through)| sensed.direct += through);
            }
            for (i, (seen, light)) in seen.iter().zip(light).enumerate() {
                sensed[i].direct += seen.emitted + light;
                sensed[i].existed |= seen.receiver.is_some();
                if stratum == carrying[i] {
                    (sensed[i].receiver, sensed[i].behind) = (seen.receiver, seen.behind);
                }
            }
        }
        sensed.iter_mut().for_each(|s| s.direct = s.direct / f64::from(positions));
        sensed
    }

    /// What an eye sees at a position in one stratum of each bin.
    fn look(&self, scene: &Scene, bins: &[u32], eye: &Eye, stratum: u32, rngs: &mut [Generator]) -> Vec<Seen> {
        let draw = |(&bin, rng): (&u32, &mut Generator)| eye.gaze(self.draw(eye, stratum, bin as usize, rng));
        let gazes: Vec<Gaze> = bins.iter().zip(&mut *rngs).map(draw).collect();
        let rays: Vec<Ray> = gazes.iter().filter_map(gaze_ray).collect();
        let mut hits = vec![None; rays.len()];
        scene.geometry.closest_hits(&rays, &mut hits);
        let mut hits = hits.into_iter();
        let mut see = |(gaze, rng): (&Gaze, &mut Generator)| {
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
        rngs: &mut [Generator],
        shared: &LitPoints,
        lamps: u64,
        channels: usize,
    ) -> Vec<Colour> {
        let samples = emitter_samples(self.histories).div_ceil(u64::from(self.positions()));
        let there = receivers.iter().zip(rngs).filter_map(|(r, rng)| Some(((*r)?, rng)));
        let mut there: Vec<(Receiver, &mut Generator)> = there.collect();
        let effort = Effort { lamps, samples, of_sky: samples };
        let mut light = direct_light(scene, &mut there, &Shared::all(shared), effort, channels).into_iter();
        receivers.iter().map(|r| r.and_then(|_| light.next()).unwrap_or(Colour::BLACK)).collect()
    }
}
