//! Scores by local estimation: the histories of a batch connected to the receivers of a set and to the points of their
//! continuations.
//!
//! A receiver that needs it has C paths in a batch, C proportional to the histories, each serving an equal share of
//! them: so no part of the variance stays when the histories grow. Bins are taken in blocks of neighbours, so that memory does
//! not grow with the picture, and histories in the groups that share paths: the points of all paths of a block and a group
//! are sorted into tiles of neighbours, wherever they belong.

mod continued;
mod score;

use super::receivers::{ReceiverSet, Sensed};
use super::thinning::Histories;
use crate::photometry::Colour;
use crate::scene::Scene;
use crate::tally::Scores;
use crate::transport::connection::{Connected, Link, Rule, TILE, Tile, connect};
use crate::transport::receiver::Receiver;
use crate::transport::shared::LitPoints;
use rayon::prelude::*;
use score::Score;
use std::ops::Range;

/// Bins that are scored together.
const BLOCK: usize = 64 * TILE;

/// The scores of `set` in a batch by all its `histories`; `order` has its bins in the order in which they share tiles, `rule`
/// the channels and the orders of reflection that count.
pub fn score(
    set: &ReceiverSet,
    scene: &Scene,
    order: &[u32],
    batch: u64,
    histories: &Histories,
    (channels, orders): (usize, &Range<u32>),
) -> Scores {
    let rule = Rule { bound: set.bound(), channels, orders: orders.clone() };
    let mut scores = Scores::zero(set.shape());
    let shared = set.lit_points(scene, batch);
    for bins in order.chunks(BLOCK) {
        let block = Block { set, scene, histories, shared: &shared, rule: &rule, bins, batch };
        let (sensed, of_bins) = block.scores();
        for ((&bin, sensed), score) in bins.iter().zip(sensed).zip(of_bins) {
            score.write((sensed.direct, sensed.existed), bin, &set.shape().monitored, &mut scores);
        }
    }
    scores
}

/// Bins that are scored together, in one batch.
struct Block<'a> {
    set: &'a ReceiverSet,
    scene: &'a Scene,
    histories: &'a Histories,
    /// Points of emitters, for each position in a bin.
    shared: &'a [LitPoints],
    rule: &'a Rule,
    bins: &'a [u32],
    batch: u64,
}

impl Block<'_> {
    /// What the bins are, and what histories give them.
    fn scores(&self) -> (Vec<Sensed>, Vec<Score>) {
        let sense = |bins: &[u32]| self.set.sense(self.scene, bins, self.batch, self.shared, self.rule.channels);
        let sensed: Vec<Sensed> = self.bins.par_chunks(TILE).flat_map_iter(sense).collect();
        let all = self.histories.connectors.histories();
        let nothing = |&bin: &u32| Score::nothing(self.is_watched(bin).then_some(all));
        let mut scores: Vec<Score> = self.bins.iter().map(nothing).collect();
        self.connect_receivers(&self.links(&sensed), &mut scores);
        self.add_continuations(&sensed, &mut scores);
        scores.iter_mut().for_each(|score| score.finish(1.0 / all as f64));
        (sensed, scores)
    }

    fn is_watched(&self, bin: u32) -> bool {
        self.set.shape().monitored.binary_search(&bin).is_ok()
    }

    /// The receivers themselves.
    fn links(&self, sensed: &[Sensed]) -> Vec<Link> {
        let link = |(owner, receiver): (u32, Receiver)| Link {
            owner,
            receiver,
            start: Colour::BLACK,
            watched: self.is_watched(self.bins[owner as usize]),
        };
        (0..).zip(sensed).flat_map(|(owner, s)| s.receivers.iter().map(move |r| (owner, *r))).map(link).collect()
    }

    /// Connects the histories to `links`, the receivers themselves: where there is a pool each tile has vertices of its own.
    fn connect_receivers(&self, links: &[Link], scores: &mut [Score]) {
        let Histories { connectors, pool } = self.histories;
        let all = connectors.histories();
        let Some(pool) = pool else { return self.connect(links, 0, 0..all, 0, scores) };
        let mut rng = self.set.choice(self.bins[0], self.batch);
        let starts: Vec<f64> = links.chunks(TILE).map(|_| rng.uniform()).collect();
        let of_tile = |(links, start): (&[Link], f64)| {
            let own = pool.choose(links, (connectors.vertices(), all), self.rule.bound, start);
            connect(self.scene, &own, 0..all, &Tile::new(self.scene, links.to_vec(), 0), self.rule)
        };
        let connected: Vec<Vec<Connected>> = links.par_chunks(TILE).zip(starts).map(of_tile).collect();
        add(links, connected, (0, 0), scores);
    }

    /// Connects `histories` to `links`, which lie `depth` reflections before the receivers, and adds that to the scores of the
    /// links' owners, of which the history number `first` is the first.
    fn connect(&self, links: &[Link], depth: u32, histories: Range<usize>, first: usize, scores: &mut [Score]) {
        let of_tile = |links: &[Link]| {
            let tile = Tile::new(self.scene, links.to_vec(), depth);
            connect(self.scene, &self.histories.connectors, histories.clone(), &tile, self.rule)
        };
        let connected: Vec<Vec<Connected>> = links.par_chunks(TILE).map(of_tile).collect();
        add(links, connected, (depth, histories.start - first), scores);
    }
}

/// Adds what each of `links` got, `depth` reflections before its receiver, from the history number `first` of its owner on.
fn add(links: &[Link], connected: Vec<Vec<Connected>>, (depth, first): (u32, usize), scores: &mut [Score]) {
    for (link, connected) in links.iter().zip(connected.into_iter().flatten()) {
        scores[link.owner as usize].add(&connected, depth, first);
    }
}
