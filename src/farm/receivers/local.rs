//! Scores by local estimation: the histories of a batch connected to the receivers of a tile and to the points of their
//! continuations.
//!
//! A receiver that needs it has C paths in a batch, C proportional to the histories, each serving an equal share of
//! them: so no part of the variance stays when the histories grow. Paths are drawn group by group of the histories, so that
//! memory holds those of one group.

use super::ReceiverSet;
use crate::photometry::Colour;
use crate::random::Generator;
use crate::scene::Scene;
use crate::tally::{Scores, Watched};
use crate::transport::connection::{Connected, Connectors, Link, Rule, Tile, connect};
use crate::transport::continuation::{continue_from, is_due};
use crate::transport::receiver::Receiver;
use std::ops::Range;

/// Histories that share a continuation of each receiver: chosen by measured figure of merit (docs/benchmarks.md).
const HISTORIES_OF_A_PATH: usize = 2;

/// Scores of the bins of one tile.
pub struct TileScores(Vec<BinScore>);

struct BinScore {
    value: Colour,
    direct: Colour,
    peak: f64,
    caustic: f64,
    existed: bool,
    watched: Option<Vec<f64>>,
}

/// A receiver that is continued, with the generator of its paths in this batch.
struct Continued {
    owner: usize,
    receiver: Receiver,
    rng: Generator,
}

impl ReceiverSet {
    /// Scores the bins of one tile against all histories of a batch.
    pub fn score_tile(
        &self,
        scene: &Scene,
        bins: &[u32],
        batch: u64,
        histories: &Connectors,
        (channels, orders): (usize, &Range<u32>),
    ) -> TileScores {
        let sensed: Vec<_> = bins.iter().map(|&bin| self.sense(scene, bin as usize, batch)).collect();
        let mut connected: Vec<Connected> = bins.iter().map(|bin| self.nothing(*bin)).collect();
        let mut caustics = vec![0.0; bins.len()];
        let links = |(owner, receiver): (usize, Option<Receiver>)| Some(Link { owner, receiver: receiver? });
        let links: Vec<Link> = sensed.iter().map(|s| s.receiver).enumerate().filter_map(links).collect();
        let mut continued = self.continued(scene, &links, bins, batch);
        let base = Tile::new(scene, links, 0);
        let rule = Rule { bound: self.bound, channels, orders: orders.clone() };
        let all = histories.histories();
        let groups = if continued.is_empty() { 1 } else { (all / HISTORIES_OF_A_PATH).max(1) };
        for group in 0..groups {
            let range = group * all / groups..(group + 1) * all / groups;
            let mut start = vec![Colour::BLACK; bins.len()];
            let mut caustic = vec![0.0; bins.len()];
            let tiles = continue_all(scene, &mut continued, &rule, &mut start, &mut caustic);
            let tiles: Vec<&Tile> = std::iter::once(&base).chain(&tiles).collect();
            let served = range.len() as f64;
            caustics.iter_mut().zip(caustic).for_each(|(sum, caustic)| *sum += caustic * served);
            connect(scene, histories, range, &tiles, &rule, &start, &mut connected);
        }
        let scores = sensed.iter().zip(connected).zip(caustics).map(|((sensed, connected), caustic)| {
            let value = sensed.direct + connected.sum / self.histories as f64;
            let (direct, existed, peak) = (sensed.direct, sensed.existed, connected.peak);
            let caustic = (caustic + connected.unbounded()) / self.histories as f64;
            BinScore { value, direct, peak, caustic, existed, watched: connected.totals }
        });
        TileScores(scores.collect())
    }

    /// No connections yet, of a bin whose histories are remembered where it is monitored.
    fn nothing(&self, bin: u32) -> Connected {
        let monitored = self.shape.monitored.binary_search(&bin).is_ok();
        Connected { totals: monitored.then(Vec::new), ..Connected::default() }
    }

    /// The receivers among `links` that need a continuation.
    fn continued(&self, scene: &Scene, links: &[Link], bins: &[u32], batch: u64) -> Vec<Continued> {
        let due = links.iter().filter(|l| is_due(scene, &l.receiver, self.bound));
        let continued = due.map(|&Link { owner, receiver }| {
            let index = batch * self.shape.bins() as u64 + u64::from(bins[owner]);
            Continued { owner, receiver, rng: self.continuations.generator(index) }
        });
        continued.collect()
    }
}

/// Draws the next path of each of the `continued`: its points as tiles, one for each depth, where an owner has at most one
/// point. Direct light at them is added to `start`, one entry an owner, and caustic light to `caustic`: every history that
/// the path serves has them.
fn continue_all(
    scene: &Scene,
    continued: &mut [Continued],
    rule: &Rule,
    start: &mut [Colour],
    caustic: &mut [f64],
) -> Vec<Tile> {
    let mut of_depth: Vec<Vec<Link>> = Vec::new();
    for Continued { owner, receiver, rng } in continued {
        let path = continue_from(scene, receiver, rule.bound, rng);
        caustic[*owner] += path.caustic;
        for (k, (direct, point)) in path.direct.into_iter().zip(path.points).enumerate() {
            if of_depth.len() == k {
                of_depth.push(Vec::new());
            }
            of_depth[k].push(Link { owner: *owner, receiver: point });
            if rule.orders.contains(&(k as u32 + 1)) {
                start[*owner] += direct;
            }
        }
    }
    of_depth.into_iter().zip(1..).map(|(links, depth)| Tile::new(scene, links, depth)).collect()
}

impl TileScores {
    /// Writes the scores of `bins`, of a set that watches those in `monitored`, to their places.
    pub fn scatter(self, bins: &[u32], monitored: &[u32], scores: &mut Scores) {
        for (&bin, score) in bins.iter().zip(self.0) {
            if let (Ok(place), Some(totals)) = (monitored.binary_search(&bin), score.watched) {
                scores.watched[place] = Watched { totals };
            }
            let bin = bin as usize;
            scores.value[bin] = score.value.luminance();
            scores.direct[bin] = score.direct.luminance();
            scores.peak[bin] = score.peak;
            scores.caustic[bin] = score.caustic;
            scores.existed[bin] = score.existed;
            if let Some(colour) = scores.colour.get_mut(bin) {
                *colour = score.value.0;
            }
        }
    }
}
