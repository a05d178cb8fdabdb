//! Continuations of the receivers of a block: drawn, connected to histories, and shared among neighbours.
//!
//! ```text
//! receivers -> a path of each -> the light of each path -> what it counts at its receiver and, where it is matt, at the
//!                                                          neighbours of its receiver
//! ```

use super::score::Score;
use super::{Block, Sensed};
use crate::farm::receivers::Paths;
use crate::geometry::kd_order;
use crate::geometry::visibility::Scratch;
use crate::photometry::Colour;
use crate::random::Generator;
use crate::transport::connection::{Link, TILE};
use crate::transport::continuation::{Continuation, continue_from, is_due};
use crate::transport::neighbours::{GROUP, Neighbours};
use crate::transport::receiver::Receiver;
use crate::transport::shared::{Effort, LitPoints, Shared, direct_light};
use rayon::prelude::*;
use std::ops::Range;

/// Histories that share a continuation of each receiver, where it has no neighbours to share points with and where it may have:
/// chosen by measured figure of merit (docs/benchmarks.md).
const HISTORIES_OF_A_PATH: [usize; 2] = [4, 32];
/// Paths of a receiver and batch, at least: the tails of fewer show in the means of batches.
const LEAST_PATHS: usize = 4;
/// What the points of continuations ask of direct light: chosen by measured figure of merit.
const EFFORT: Effort = Effort { lamps: 8, samples: 4, of_sky: 1 };

/// A receiver that is continued, with its paths in this batch.
struct Continued {
    owner: u32,
    receiver: Receiver,
    paths: Paths,
    watched: bool,
}

/// A path and the generator that drew it.
struct Path {
    continuation: Continuation,
    rng: Generator,
}

/// A point of the path of a number.
type Point = (u32, Receiver, Generator);

impl Block<'_> {
    /// Draws the continuations of the receivers that need them, and adds the light that comes by them.
    pub(super) fn add_continuations(&self, sensed: &[Sensed], scores: &mut [Score]) {
        let all = self.histories.connectors.histories();
        let may_share = self.may_share();
        let least = LEAST_PATHS.min(all / HISTORIES_OF_A_PATH[0]).max(1);
        let groups = (all / HISTORIES_OF_A_PATH[usize::from(may_share)]).max(least);
        let of_bin = |i: usize| {
            let receivers = sensed[i].receivers.iter().enumerate();
            receivers.filter_map(move |(number, receiver)| self.continued(receiver, (i, number), groups))
        };
        let mut continued: Vec<Continued> = (0..sensed.len()).into_par_iter().flat_map_iter(of_bin).collect();
        if continued.is_empty() {
            return;
        }
        let neighbours =
            |some: &[Continued]| Neighbours::new(self.scene, some.iter().map(|c| &c.receiver), self.rule.bound);
        let neighbourhoods: Vec<Neighbours> = continued.par_chunks(GROUP).map(neighbours).collect();
        let lit = self.set.lit_points_of_continuations(self.scene, self.batch, groups);
        for group in 0..groups {
            let histories = group * all / groups..(group + 1) * all / groups;
            let paths: Vec<Path> = continued.par_iter_mut().map(|c| self.draw(c, may_share)).collect();
            let light = self.light(&continued, &paths, &lit, group, histories.clone());
            let some = neighbourhoods.par_iter().zip(continued.par_chunks(GROUP));
            let some = some.zip(paths.par_chunks(GROUP).zip(light.par_chunks(GROUP)));
            let share = |((neighbours, continued), (paths, light)): ((&Neighbours, &[Continued]), _)| {
                self.shared(neighbours, continued, paths, light, histories.len())
            };
            let given: Vec<Score> = some.flat_map_iter(share).collect();
            for (continued, given) in continued.iter().zip(given) {
                scores[continued.owner as usize].add_path(&given, Colour::WHITE, histories.start);
            }
        }
    }

    /// The `receiver` of that number of the bin number `owner` of the block, if it is continued.
    fn continued(&self, receiver: &Receiver, (owner, number): (usize, usize), groups: usize) -> Option<Continued> {
        let bin = self.bins[owner];
        is_due(self.scene, receiver, self.rule.bound).then(|| Continued {
            owner: owner as u32,
            receiver: *receiver,
            paths: self.set.continuations((bin, number), self.batch, groups),
            watched: self.is_watched(bin),
        })
    }

    /// True where receivers have neighbours, and these could have found any point that one of them finds in the same way.
    fn may_share(&self) -> bool {
        self.set.shape().bins() >= GROUP && !self.scene.has_peaks() && !self.scene.geometry.has_veils()
    }

    fn draw(&self, continued: &mut Continued, may_share: bool) -> Path {
        let rng = continued.paths.next();
        let continuation = continue_from(self.scene, &continued.receiver, self.rule.bound, may_share, rng);
        Path { continuation, rng: rng.clone() }
    }

    /// The light of each path by `histories`.
    fn light(
        &self,
        continued: &[Continued],
        paths: &[Path],
        lit: &LitPoints,
        group: usize,
        histories: Range<usize>,
    ) -> Vec<Score> {
        // What a neighbour may use is watched where any of the neighbourhood is.
        let watched = continued.chunks(GROUP).flat_map(|some| {
            let watched = some.iter().any(|c| c.watched).then_some(histories.len());
            some.iter().map(move |_| Score::nothing(watched))
        });
        let mut light: Vec<Score> = watched.collect();
        for (light, path) in light.iter_mut().zip(paths) {
            light.caustic = path.continuation.caustic * histories.len() as f64;
        }
        for (points, depth) in points_by_depth(paths).into_iter().zip(1..) {
            let links = self.light_points(points, depth, (lit, group), &light);
            self.connect(&links, depth, histories.clone(), histories.start, &mut light);
        }
        light
    }

    /// The links of the points of paths, with the direct light there.
    fn light_points(
        &self,
        mut points: Vec<Point>,
        depth: u32,
        (lit, group): (&LitPoints, usize),
        light: &[Score],
    ) -> Vec<Link> {
        let counts = self.rule.orders.contains(&depth);
        let of_tile = |points: &mut [Point]| -> Vec<Link> {
            let mut there: Vec<_> = points.iter_mut().map(|(_, receiver, rng)| (*receiver, rng)).collect();
            let direct = direct_light(self.scene, &mut there, &Shared::run(lit, group), EFFORT, self.rule.channels);
            let link = |((path, receiver, _), direct): (&Point, Colour)| Link {
                owner: *path,
                receiver: *receiver,
                start: if counts { direct } else { Colour::BLACK },
                watched: light[*path as usize].is_watched(),
            };
            points.iter().zip(direct).map(link).collect()
        };
        points.par_chunks_mut(TILE).flat_map_iter(of_tile).collect()
    }

    /// What each of the neighbours that are `continued` gets of the light of all their paths, in each of so many histories.
    fn shared(
        &self,
        neighbours: &Neighbours,
        continued: &[Continued],
        paths: &[Path],
        light: &[Score],
        histories: usize,
    ) -> Vec<Score> {
        let nothing = |c: &Continued| Score::nothing(c.watched.then_some(histories));
        let mut given: Vec<Score> = continued.iter().map(nothing).collect();
        let mut scratch = Scratch::default();
        for (own, (path, light)) in paths.iter().zip(light).enumerate() {
            match path.continuation.points.first() {
                Some(y) if path.continuation.shared => {
                    let weights = neighbours.weights(self.scene, y, own, &mut scratch);
                    for (given, weight) in given.iter_mut().zip(weights).filter(|(_, w)| !w.is_black()) {
                        given.add_path(light, weight, 0);
                    }
                }
                _ => given[own].add_path(light, Colour::WHITE, 0),
            }
        }
        given
    }
}

/// The points of `paths`, neighbours together: one list for each number of reflections before their receivers.
fn points_by_depth(paths: &[Path]) -> Vec<Vec<Point>> {
    let mut by_depth: Vec<Vec<Point>> = Vec::new();
    for (number, path) in (0..).zip(paths) {
        for (k, point) in path.continuation.points.iter().enumerate() {
            if by_depth.len() == k {
                by_depth.push(Vec::new());
            }
            by_depth[k].push((number, *point, path.rng.clone()));
        }
    }
    let sorted = |points: Vec<Point>| {
        let places: Vec<_> = points.iter().map(|(_, point, _)| point.position).collect();
        kd_order(&places).into_iter().map(|i| points[i as usize].clone()).collect()
    };
    by_depth.into_iter().map(sorted).collect()
}
