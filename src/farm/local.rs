//! Scores by local estimation: the histories of a batch connected to the receivers of a set and to the points of their
//! continuations.
//!
//! A receiver that needs it has C paths in a batch, C proportional to the histories, each serving an equal share of
//! them: so no part of the variance stays when the histories grow. Bins are taken in blocks of neighbours, so that memory does
//! not grow with the picture, and histories in the groups that share paths: the points of all paths of a block and a group
//! are sorted into tiles of neighbours, wherever they belong.

use super::receivers::{Paths, ReceiverSet, Sensed};
use crate::geometry::kd_order;
use crate::photometry::Colour;
use crate::random::Generator;
use crate::scene::Scene;
use crate::tally::{Scores, Watched};
use crate::transport::connection::{Connected, Connectors, Link, Rule, TILE, Tile, connect};
use crate::transport::continuation::{Continuation, continue_from, is_due};
use crate::transport::receiver::Receiver;
use crate::transport::shared::{Shared, direct_light};
use rayon::prelude::*;
use std::ops::Range;

/// Histories that share a continuation of each receiver: chosen by measured figure of merit (docs/benchmarks.md).
const HISTORIES_OF_A_PATH: usize = 4;
/// Bins that are scored together.
const BLOCK: usize = 64 * TILE;

/// The scores of `set` in a batch by all its `histories`; `order` has its bins in the order in which they share tiles, `rule`
/// the channels and the orders of reflection that count.
pub fn score(
    set: &ReceiverSet,
    scene: &Scene,
    order: &[u32],
    batch: u64,
    histories: &Connectors,
    (channels, orders): (usize, &Range<u32>),
) -> Scores {
    let rule = Rule { bound: set.bound(), channels, orders: orders.clone() };
    let mut scores = Scores::zero(set.shape());
    let shared = set.lit_points(scene, batch);
    for bins in order.chunks(BLOCK) {
        let block = Block { set, scene, histories, shared: &shared, rule: &rule, bins, batch };
        for (&bin, score) in bins.iter().zip(block.scores()) {
            score.write(bin, &set.shape().monitored, &mut scores);
        }
    }
    scores
}

/// Bins that are scored together, in one batch.
struct Block<'a> {
    set: &'a ReceiverSet,
    scene: &'a Scene,
    histories: &'a Connectors,
    /// Points of emitters, for each position in a bin.
    shared: &'a [Connectors],
    rule: &'a Rule,
    bins: &'a [u32],
    batch: u64,
}

/// A receiver that is continued, with its paths in this batch.
struct Continued {
    owner: u32,
    receiver: Receiver,
    paths: Paths,
}

impl Block<'_> {
    fn scores(&self) -> Vec<BinScore> {
        let sense = |bins: &[u32]| self.set.sense(self.scene, bins, self.batch, self.shared, self.rule.channels);
        let sensed: Vec<Sensed> = self.bins.par_chunks(TILE).flat_map_iter(sense).collect();
        let mut scores: Vec<BinScore> = sensed.iter().zip(self.bins).map(|(s, &bin)| self.nothing(s, bin)).collect();
        let all = 0..self.histories.histories();
        self.connect(self.links(&sensed), 0, all, &mut scores);
        self.connect_continuations(&sensed, &mut scores);
        let share = 1.0 / self.histories.histories() as f64;
        scores.iter_mut().for_each(|score| score.finish(share));
        scores
    }

    /// The score of a bin before any history.
    fn nothing(&self, sensed: &Sensed, bin: u32) -> BinScore {
        let watched = self.is_watched(bin).then(|| vec![0.0; self.histories.histories()]);
        BinScore { direct: sensed.direct, existed: sensed.existed, watched, ..BinScore::default() }
    }

    fn is_watched(&self, bin: u32) -> bool {
        self.set.shape().monitored.binary_search(&bin).is_ok()
    }

    /// The link of a receiver or of a point of its continuation.
    fn link(&self, owner: u32, receiver: Receiver, start: Colour) -> Link {
        Link { owner, receiver, start, watched: self.is_watched(self.bins[owner as usize]) }
    }

    /// The receivers themselves.
    fn links(&self, sensed: &[Sensed]) -> Vec<Link> {
        let owners = (0..).zip(sensed);
        let both = owners.flat_map(|(owner, s)| [s.receiver, s.behind].map(|r| (owner, r)));
        both.filter_map(|(owner, receiver)| Some(self.link(owner, receiver?, Colour::BLACK))).collect()
    }

    /// Connects `histories` to `links`, which lie `depth` reflections before their owners, and adds that to the owners' scores.
    fn connect(&self, links: Vec<Link>, depth: u32, histories: Range<usize>, scores: &mut [BinScore]) {
        let of_tile = |links: &[Link]| {
            let tile = Tile::new(self.scene, links.to_vec(), depth);
            connect(self.scene, self.histories, histories.clone(), &tile, self.rule)
        };
        let connected: Vec<Vec<Connected>> = links.par_chunks(TILE).map(of_tile).collect();
        for (link, connected) in links.iter().zip(connected.into_iter().flatten()) {
            scores[link.owner as usize].add(&connected, depth, histories.start);
        }
    }

    /// Draws the continuations of the receivers that need them, and connects their points.
    fn connect_continuations(&self, sensed: &[Sensed], scores: &mut [BinScore]) {
        let all = self.histories.histories();
        let groups = (all / HISTORIES_OF_A_PATH).max(1);
        let of_one = |owner: usize, receiver: Option<Receiver>| {
            let receiver = receiver.filter(|r| is_due(self.scene, r, self.rule.bound))?;
            let paths = self.set.continuations(self.bins[owner], self.batch, groups);
            Some(Continued { owner: owner as u32, receiver, paths })
        };
        let continued = |(owner, sensed): (usize, &Sensed)| {
            [sensed.receiver, sensed.behind].into_iter().filter_map(move |receiver| of_one(owner, receiver))
        };
        let mut continued: Vec<Continued> = sensed.par_iter().enumerate().flat_map_iter(continued).collect();
        if continued.is_empty() {
            return;
        }
        let lit = self.set.lit_points_of_continuations(self.scene, self.batch, groups);
        for group in 0..groups {
            let histories = group * all / groups..(group + 1) * all / groups;
            let draw = |c: &mut Continued| {
                let rng = c.paths.next();
                let path = continue_from(self.scene, &c.receiver, self.rule.bound, rng);
                (c.owner, path, rng.clone())
            };
            let paths: Vec<Path> = continued.par_iter_mut().map(draw).collect();
            for (owner, path, _) in &paths {
                scores[*owner as usize].caustic += path.caustic * histories.len() as f64;
            }
            for (points, depth) in points_by_depth(paths).into_iter().zip(1..) {
                let links = self.light_points(points, depth, &lit, group);
                self.connect(links, depth, histories.clone(), scores);
            }
        }
    }

    /// The links of the points of continuations, with the direct light there.
    fn light_points(&self, points: Vec<Point>, depth: u32, lit: &Connectors, group: usize) -> Vec<Link> {
        let counts = self.rule.orders.contains(&depth);
        let of_tile = |points: &mut [Point]| -> Vec<Link> {
            let mut there: Vec<_> = points.iter_mut().map(|(_, receiver, rng)| (*receiver, rng)).collect();
            let what = (true, self.rule.channels);
            let light = direct_light(self.scene, &mut there, Shared::run(lit, group), 1, what);
            let link = |((owner, receiver, _), light): (&Point, Colour)| {
                self.link(*owner, *receiver, if counts { light } else { Colour::BLACK })
            };
            points.iter().zip(light).map(link).collect()
        };
        let mut points = points;
        points.par_chunks_mut(TILE).flat_map_iter(of_tile).collect()
    }
}

/// A path with its owner, and the generator that drew it.
type Path = (u32, Continuation, Generator);
/// A point of a path.
type Point = (u32, Receiver, Generator);

/// The points of `paths`, neighbours together: one list for each number of reflections before their owners.
fn points_by_depth(paths: Vec<Path>) -> Vec<Vec<Point>> {
    let mut by_depth: Vec<Vec<Point>> = Vec::new();
    for (owner, path, rng) in paths {
        for (k, point) in path.points.into_iter().enumerate() {
            if by_depth.len() == k {
                by_depth.push(Vec::new());
            }
            by_depth[k].push((owner, point, rng.clone()));
        }
    }
    let sorted = |points: Vec<Point>| {
        let places: Vec<_> = points.iter().map(|(_, point, _)| point.position).collect();
        kd_order(&places).into_iter().map(|i| points[i as usize].clone()).collect()
    };
    by_depth.into_iter().map(sorted).collect()
}

/// The score of one bin.
#[derive(Default)]
struct BinScore {
    /// Sum over histories, at last their mean \[lx or cd/m2\].
    connected: Colour,
    direct: Colour,
    peak: f64,
    caustic: f64,
    /// Of `connected`, the luminous part by vertices that a delta scatterer lit straight.
    mirrored: f64,
    /// Of `connected`, the luminous part that came by continuations.
    continued: f64,
    existed: bool,
    watched: Option<Vec<f64>>,
}

impl BinScore {
    /// Takes in what the histories from `first` on give a link that lies `depth` reflections before this receiver.
    fn add(&mut self, connected: &Connected, depth: u32, first: usize) {
        self.connected += connected.sum;
        self.peak = self.peak.max(connected.peak);
        self.mirrored += connected.mirrored;
        if depth > 0 {
            self.continued += connected.sum.luminance();
        }
        if let (Some(watched), Some(totals)) = (&mut self.watched, &connected.totals) {
            watched[first..].iter_mut().zip(totals).for_each(|(watched, total)| *watched += total);
        }
    }

    /// From sums over histories to their mean: `share` is one over their number.
    fn finish(&mut self, share: f64) {
        // Of what a mirror sends to the surfaces around the receiver no bound holds the share that continuations bring of
        // all other light. Nothing was mirrored where nothing came at all.
        let unbounded =
            if self.mirrored > 0.0 { self.mirrored * self.continued / self.connected.luminance() } else { 0.0 };
        self.caustic = (self.caustic + unbounded) * share;
        self.connected *= share;
    }

    /// Writes the score to its place in those of its set, which watches the bins in `monitored`.
    fn write(self, bin: u32, monitored: &[u32], scores: &mut Scores) {
        if let (Ok(place), Some(totals)) = (monitored.binary_search(&bin), self.watched) {
            scores.watched[place] = Watched { totals };
        }
        let bin = bin as usize;
        let value = self.direct + self.connected;
        scores.value[bin] = value.luminance();
        scores.direct[bin] = self.direct.luminance();
        scores.peak[bin] = self.peak;
        scores.caustic[bin] = self.caustic;
        scores.existed[bin] = self.existed;
        if let Some(colour) = scores.colour.get_mut(bin) {
            *colour = value.0;
        }
    }
}
