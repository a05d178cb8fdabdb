//! Scores of a receiver set by paths from its receivers (`estimator = "reverse"`).
//!
//! Each bin of each batch follows as many paths as the batch has histories, with a generator of its own. Every path of a
//! map has its own position in the pixel and looks at light and emission for itself; what is the same for all paths of a
//! lux-meter, direct light of sources without extent, is the set's fixed part.

use super::{Bins, ReceiverSet, gaze};
use crate::job::Transport;
use crate::photometry::Colour;
use crate::random::{Generator, Stream};
use crate::scene::Scene;
use crate::tally::Scores;
use crate::transport::receiver::Receiver;
use crate::transport::reverse::{Found, lights_at, path};

/// What all paths of one bin found in one batch: means over the paths.
#[derive(Clone, Debug, Default)]
pub struct Paths {
    value: Colour,
    direct: Colour,
    /// The largest luminous total of one path, direct light left out.
    peak: f64,
    /// Mean of [`Found::caustic`].
    caustic: f64,
    existed: bool,
    /// The luminous total of each path of a monitored bin, light met by the first ray included.
    totals: Vec<f64>,
}

impl ReceiverSet {
    /// Follows the paths of bin `bin` in the batch number `batch`; `stream` is that of the set.
    pub fn reverse(&self, scene: &Scene, transport: &Transport, stream: &Stream, bin: u32, batch: u64) -> Paths {
        let mut rng = stream.generator(batch * self.shape.bins() as u64 + u64::from(bin));
        let watched = self.shape.monitored.binary_search(&bin).is_ok();
        let strata = match &self.bins {
            Bins::Film { strata, .. } => *strata,
            Bins::Meters(_) => 1,
        };
        // Turned by chance, so that a number of paths that the strata do not divide favours none of them.
        let turn = u64::from(rng.below(strata * strata));
        let mut paths = Paths::default();
        for k in 0..self.histories {
            let stratum = ((k + turn) % u64::from(strata * strata)) as u32;
            let (seen, receiver) = self.look_from(scene, bin as usize, stratum, &mut rng);
            let found = receiver.map_or(Found::default(), |r| path(scene, transport, &r, &mut rng));
            paths.add(seen, receiver.is_some() && scene.reflects(), &found, watched);
        }
        paths.divide_by(self.histories);
        paths
    }

    /// The receiver of one path, with the direct light that does not come from the path itself.
    fn look_from(&self, scene: &Scene, bin: usize, stratum: u32, rng: &mut Generator) -> (Colour, Option<Receiver>) {
        match &self.bins {
            Bins::Meters(meters) => (Colour::BLACK, meters[bin]),
            Bins::Film { eye, .. } => {
                let film = self.draw(eye, (self.positions().isqrt(), stratum), bin, rng);
                let seen = gaze(scene, eye, film, rng);
                let receiver = seen.receiver.map(|r| r.on_one_side(scene, rng));
                let lit = receiver.map_or(Colour::BLACK, |r| lights_at(scene, &r));
                (seen.emitted + lit, receiver)
            }
        }
    }

    /// The scores of the whole set from the paths of all its bins, in their order.
    pub fn reverse_scores(&self, all: Vec<Paths>) -> Scores {
        let mut scores = Scores::zero(&self.shape);
        for (bin, paths) in all.into_iter().enumerate() {
            scores.value[bin] = paths.value.luminance();
            scores.direct[bin] = paths.direct.luminance();
            scores.peak[bin] = paths.peak;
            scores.caustic[bin] = paths.caustic;
            scores.existed[bin] = paths.existed;
            if let Some(colour) = scores.colour.get_mut(bin) {
                *colour = paths.value.0;
            }
            if let Ok(place) = self.shape.monitored.binary_search(&(bin as u32)) {
                scores.watched[place].totals = paths.totals;
            }
        }
        scores
    }
}

impl Paths {
    fn add(&mut self, seen: Colour, existed: bool, found: &Found, watched: bool) {
        let direct = seen + found.direct;
        self.direct += direct;
        self.value += direct + found.reflected;
        self.peak = self.peak.max(found.reflected.luminance());
        self.caustic += found.caustic.luminance();
        self.existed |= existed;
        if watched {
            self.totals.push((found.direct + found.reflected).luminance());
        }
    }

    fn divide_by(&mut self, paths: u64) {
        self.value = self.value / paths as f64;
        self.direct = self.direct / paths as f64;
        self.caustic /= paths as f64;
    }
}
