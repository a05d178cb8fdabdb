//! Which of many vertices a tile of receivers is connected to.
//!
//! Vertices that stand for equal shares of the light are a good choice for the whole scene, but a tile in the dark is lit by few of
//! them. So more are kept than are connected, and each tile chooses its own: vertex i in proportion to
//!
//! ```text
//! B_i = g_i + e g,    g_i = min(b, (n_i,w)_+ (N,-w)_+ / |w|^4),    g = the mean of the g_i
//! ```
//!
//! with w from the vertex to the middle of the tile, both cosines and the distance widened by its radius, and no visibility. Chosen
//! systematically, along the order in which the vertices lie in space, so that every sum over vertices keeps its mean; the
//! share e lets none that is underestimated count more than (1 + e)/e times as much as if all were alike.

#![allow(clippy::needless_range_loop, reason = "several arrays go by one lane")]

use super::connection::Link;
use super::connectors::Connectors;
use super::trajectory::Vertex;
use crate::math::DVec3;
use crate::random::systematic::Systematic;
use crate::scene::Scene;

/// e: chosen by measured figure of merit (docs/benchmarks.md).
const ALIKE: f32 = 0.1;
/// Bound of the kernel where it has none, so that sums stay finite \[1/m2\].
const MOST: f64 = 1e30;
/// Vertices that are looked at together.
const BLOCK: usize = 16;

/// Vertices to choose from, as a structure of arrays, and as connectors.
#[derive(Debug, Default)]
pub struct Pool {
    connectors: Connectors,
    blocks: Vec<Block>,
}

#[derive(Clone, Debug, Default)]
struct Block {
    position: [[f32; BLOCK]; 3],
    normal: [[f32; BLOCK]; 3],
    /// 1, or 0 in the lanes beyond the last vertex.
    there: [f32; BLOCK],
}

impl Pool {
    /// The pool of `vertices`, neighbours after each other; each is taken to reflect the same.
    pub fn new(scene: &Scene, vertices: &[Vertex]) -> Self {
        let mut connectors = Connectors::default();
        connectors.push(scene, vertices);
        let mut blocks = vec![Block::default(); connectors.vertices().div_ceil(BLOCK)];
        for (i, (position, normal)) in connectors.places().enumerate() {
            let (block, lane) = (&mut blocks[i / BLOCK], i % BLOCK);
            for axis in 0..3 {
                block.position[axis][lane] = position[axis];
                block.normal[axis][lane] = normal[axis];
            }
            block.there[lane] = 1.0;
        }
        Pool { connectors, blocks }
    }

    /// About `wanted` of them for the receivers of `links`, dealt to so many `histories`; `bound` is that of the kernel, `start` a
    /// uniform number.
    pub fn choose(&self, links: &[Link], (wanted, histories): (usize, usize), bound: f64, start: f64) -> Connectors {
        let worths = self.worths(&Outlook::new(links, bound));
        let sums: Vec<f64> = worths.iter().map(sum).collect();
        let step = sums.iter().sum::<f64>() / wanted.max(1) as f64;
        let mut choice = Systematic::new(step, start);
        let mut chosen = Vec::with_capacity(wanted + 1);
        for (number, (worths, sum)) in worths.iter().zip(sums).enumerate() {
            if choice.skips(sum) {
                continue;
            }
            for (lane, &worth) in worths.iter().enumerate() {
                let times = choice.times(f64::from(worth));
                if times > 0 {
                    let factor = f64::from(times) * step / f64::from(worth);
                    chosen.push((number * BLOCK + lane, factor as f32));
                }
            }
        }
        self.connectors.dealt(&chosen, histories)
    }

    /// B_i of all vertices, 0 in lanes without one.
    fn worths(&self, outlook: &Outlook) -> Vec<[f32; BLOCK]> {
        let mut worths: Vec<[f32; BLOCK]> = self.blocks.iter().map(|block| outlook.of(block)).collect();
        let all: f64 = worths.iter().map(sum).sum();
        // Where nothing is expected, or less than a number can tell from it, all are equal.
        let alike = ALIKE * (all / self.connectors.vertices() as f64) as f32;
        let alike = if alike >= f32::MIN_POSITIVE { alike } else { 1.0 };
        for (worths, block) in worths.iter_mut().zip(&self.blocks) {
            for lane in 0..BLOCK {
                worths[lane] += alike * block.there[lane];
            }
        }
        worths
    }
}

/// The sum of sixteen, in a fixed order.
fn sum(of: &[f32; BLOCK]) -> f64 {
    let mut halves = of.map(f64::from);
    let mut width = BLOCK / 2;
    while width > 0 {
        for i in 0..width {
            halves[i] += halves[i + width];
        }
        width /= 2;
    }
    halves[0]
}

/// What a tile of receivers looks like from vertices.
struct Outlook {
    middle: [f32; 3],
    radius: f32,
    normal: [f32; 3],
    /// Sine of the largest angle between `normal` and a normal of the tile.
    spread: f32,
    bound: f32,
}

impl Outlook {
    fn new(links: &[Link], bound: f64) -> Self {
        let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let receivers = || links.iter().map(|link| &link.receiver);
        let (low, high) = receivers().fold(empty, |(low, high), r| (low.min(r.position), high.max(r.position)));
        let normal = receivers().map(|r| r.normal).sum::<DVec3>().try_normalize().unwrap_or(DVec3::Y);
        let least = receivers().map(|r| r.normal.dot(normal)).fold(1.0, f64::min);
        let spread = if least > 0.0 { (1.0 - least * least).max(0.0).sqrt() } else { 1.0 };
        Outlook {
            middle: (0.5 * (low + high)).as_vec3().to_array(),
            radius: (0.5 * low.distance(high)) as f32,
            normal: normal.as_vec3().to_array(),
            spread: spread as f32,
            bound: bound.min(MOST) as f32,
        }
    }

    /// g_i of the vertices of a block.
    fn of(&self, block: &Block) -> [f32; BLOCK] {
        let mut bounds = [0.0; BLOCK];
        for i in 0..BLOCK {
            let way = [0, 1, 2].map(|axis| self.middle[axis] - block.position[axis][i]);
            let normal = [0, 1, 2].map(|axis| block.normal[axis][i]);
            let d2 = way[0] * way[0] + way[1] * way[1] + way[2] * way[2];
            let leaving = way[0] * normal[0] + way[1] * normal[1] + way[2] * normal[2] + self.radius;
            let height = way[0] * self.normal[0] + way[1] * self.normal[1] + way[2] * self.normal[2];
            let arriving = self.radius + self.spread * d2.sqrt() - height;
            let far = d2 + self.radius * self.radius + f32::MIN_POSITIVE;
            let factor = (leaving.max(0.0) / far) * (arriving.max(0.0) / far);
            bounds[i] = block.there[i] * factor.min(self.bound);
        }
        bounds
    }
}
