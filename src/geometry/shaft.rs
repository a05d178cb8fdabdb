//! All segments from an apex to the points of a box, against eight boxes at once.
//!
//! A segment o + t d, 0 <= t <= 1, with every coordinate of d in an interval: along each axis the intervals bound when the first
//! segment can enter a slab and when the last one leaves it. A box that no t satisfies on all axes is met by none.
//!
//! The time at a coordinate x is x f - o f with f = 1/d, in one multiply-add. That rounds a place on the segment by less than 4
//! roundings of the largest coordinate of the scene; boxes are inflated by more, see [`super::bvh`]. Factors are finite, and
//! so are times: where d is nearly 0 it is taken to be as small as [`NIL`].

use super::bvh::{Node, WIDTH};
use super::planes::Directions;
use super::simd::{Isa, Vector};

/// Stands for 0 where one divides by the end of an interval \[m\]: far below what boxes are inflated by.
const NIL: f32 = 1e-20;
/// Entries are taken to be this much earlier than computed.
const EARLIER: f32 = 1.0 - 1.0 / (1 << 21) as f32;

/// Which way segments run along an axis, and so on which sides of a box they enter and leave.
#[derive(Clone, Copy, Debug)]
enum Way {
    Up,
    Down,
    /// Some up and some down.
    Both,
}

/// The segments from an apex to a box, made ready.
pub(super) struct Shaft {
    apex: [f32; 3],
    pub(super) directions: Directions,
    /// The share of the segments that is left out, at their start.
    start: f32,
    ways: [Way; 3],
    /// By axis, factor and term of the first time at the low side of a box where segments enter there, or else the last.
    low: [(f32, f32); 3],
    /// The same of the high side.
    high: [(f32, f32); 3],
}

impl Shaft {
    /// From `apex` to the box between `low` and `high` \[m\].
    #[inline(always)]
    pub(super) fn new(apex: [f32; 3], low: [f32; 3], high: [f32; 3]) -> Self {
        // Rounding is monotonic: every d of the bundle, rounded in the same way, lies between these.
        let way = |to: [f32; 3]| [to[0] - apex[0], to[1] - apex[1], to[2] - apex[2]];
        Shaft::along(apex, way(low), way(high))
    }

    /// From `apex` along every d between `least` and `most`.
    #[inline(always)]
    pub(super) fn along(apex: [f32; 3], least: [f32; 3], most: [f32; 3]) -> Self {
        let directions = Directions::new(least, most);
        let (ways, times) = ([Way::Both; 3], [(0.0, 0.0); 3]);
        let mut shaft = Shaft { apex, directions, start: 0.0, ways, low: times, high: times };
        for axis in 0..3 {
            let (mut least, mut most) = (least[axis], most[axis]);
            if least > NIL {
                shaft.ways[axis] = Way::Up;
            } else if most < -NIL {
                shaft.ways[axis] = Way::Down;
            } else {
                (least, most) = (least.min(-NIL), most.max(NIL));
            }
            // Up: the fastest enters first and the slowest leaves last. Down: the other way round, with the same factors.
            let (low, high) = (1.0 / most, 1.0 / least);
            shaft.low[axis] = (low, -apex[axis] * low);
            shaft.high[axis] = (high, -apex[axis] * high);
        }
        shaft
    }

    /// The same without what is before the share `start`.
    #[inline(always)]
    pub(super) fn after(mut self, start: f32) -> Self {
        self.start = start;
        self
    }

    /// The children of `node` whose boxes some segment may meet.
    #[inline(always)]
    pub(super) fn meets<I: Isa>(&self, node: &Node) -> u32 {
        self.meets_before::<I>(node, 1.0).0
    }

    /// The children of `node` whose boxes some ray, 0 <= t <= `end`, may meet, and when the first of them does.
    #[inline(always)]
    pub(super) fn meets_before<I: Isa>(&self, node: &Node, end: f32) -> (u32, I::Eight) {
        let (mut enter, mut leave) = (I::Eight::splat(self.start), I::Eight::splat(end));
        for axis in 0..3 {
            let low = times::<I>(&node.low[axis], self.low[axis]);
            let high = times::<I>(&node.high[axis], self.high[axis]);
            match self.ways[axis] {
                Way::Up => (enter, leave) = (enter.max(low), leave.min(high)),
                Way::Down => (enter, leave) = (enter.max(high), leave.min(low)),
                Way::Both => enter = enter.max(low).max(high),
            }
        }
        let miss = leave.less(enter.mul(I::Eight::splat(EARLIER)));
        (!miss & node.boxes, enter)
    }
}

#[inline(always)]
fn times<I: Isa>(sides: &[f32; WIDTH], (factor, term): (f32, f32)) -> I::Eight {
    I::Eight::load(sides).mul_add(I::Eight::splat(factor), I::Eight::splat(term))
}

/// Sixteen segments from an apex, against one box at a time.
pub(super) struct Bundle<I: Isa> {
    ways: [Way; 3],
    factor: [I::Sixteen; 3],
    term: [I::Sixteen; 3],
    start: I::Sixteen,
}

impl<I: Isa> Bundle<I> {
    /// The segments along `d`, all in `shaft`.
    #[inline(always)]
    pub(super) fn new(shaft: &Shaft, d: &[I::Sixteen; 3]) -> Self {
        let mut bundle = Bundle::<I> { ways: shaft.ways, factor: *d, term: *d, start: I::Sixteen::splat(shaft.start) };
        for axis in 0..3 {
            let d = d[axis].abs().max(I::Sixteen::splat(NIL)).flip(d[axis]);
            let factor = I::Sixteen::splat(1.0).div(d);
            (bundle.factor[axis], bundle.term[axis]) = (factor, factor.mul(I::Sixteen::splat(-shaft.apex[axis])));
        }
        bundle
    }

    /// The same without what is before the shares `starts`.
    #[inline(always)]
    pub(super) fn after(mut self, starts: I::Sixteen) -> Self {
        self.start = starts;
        self
    }

    /// The segments that may meet box `slot` of `node`.
    #[inline(always)]
    pub(super) fn meets(&self, node: &Node, slot: usize) -> u32 {
        self.meets_before(node, slot, I::Sixteen::splat(1.0))
    }

    /// The same for rays that end at `ends`.
    #[inline(always)]
    pub(super) fn meets_before(&self, node: &Node, slot: usize, ends: I::Sixteen) -> u32 {
        debug_assert!(slot < WIDTH);
        let (mut enter, mut leave) = (self.start, ends);
        for axis in 0..3 {
            let (factor, term) = (self.factor[axis], self.term[axis]);
            let low = I::Sixteen::splat(node.low[axis][slot]).mul_add(factor, term);
            let high = I::Sixteen::splat(node.high[axis][slot]).mul_add(factor, term);
            match self.ways[axis] {
                Way::Up => (enter, leave) = (enter.max(low), leave.min(high)),
                Way::Down => (enter, leave) = (enter.max(high), leave.min(low)),
                Way::Both => (enter, leave) = (enter.max(low.min(high)), leave.min(low.max(high))),
            }
        }
        !leave.less(enter.mul(I::Sixteen::splat(EARLIER)))
    }
}
