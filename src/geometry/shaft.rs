//! All segments from an apex to the points of a box, against eight boxes at once.
//!
//! A segment o + t d, 0 <= t <= 1, with every coordinate of d in an interval: along each axis the intervals bound when the first
//! segment can enter a slab and when the last one leaves it. A box that no t satisfies on all axes is met by none.
//! Boxes are inflated by more than this rounds, see [`super::bvh`].

use super::bvh::{Node, WIDTH};
use super::planes::Directions;
use super::simd::{Isa, Vector};

/// Stands for 0 where one divides by the end of an interval \[m\]: far below what boxes are inflated by.
const NIL: f32 = 1e-20;
/// Entries are taken to be this much earlier than computed.
const EARLIER: f32 = 1.0 - 1.0 / (1 << 21) as f32;

/// On which sides of a box segments enter along an axis, and leave.
#[derive(Clone, Copy, Debug)]
enum Way {
    /// All segments run up: in at the low side, out at the high one.
    Up,
    /// All run down.
    Down,
    /// Some run up and some run down.
    Both,
}

impl Way {
    #[inline(always)]
    fn new(least: f32, most: f32) -> Self {
        if least > NIL {
            Way::Up
        } else if most < -NIL {
            Way::Down
        } else {
            Way::Both
        }
    }
}

/// The segments from an apex to a box, made ready.
pub(super) struct Shaft {
    pub(super) directions: Directions,
    ways: [Way; 3],
    /// By axis, the times at the low and the high side of a box: factor and term of its coordinate.
    low: [(f32, f32); 3],
    high: [(f32, f32); 3],
}

impl Shaft {
    /// From `apex` to the box between `low` and `high` \[m\].
    #[inline(always)]
    pub(super) fn new(apex: [f32; 3], low: [f32; 3], high: [f32; 3]) -> Self {
        let (mut least, mut most) = ([0.0; 3], [0.0; 3]);
        let mut shaft = Shaft {
            directions: Directions::new(least, most),
            ways: [Way::Both; 3],
            low: [(0.0, 0.0); 3],
            high: [(0.0, 0.0); 3],
        };
        for axis in 0..3 {
            // Rounding is monotonic: every d of the bundle, rounded in the same way, lies between these.
            (least[axis], most[axis]) = (low[axis] - apex[axis], high[axis] - apex[axis]);
            let way = Way::new(least[axis], most[axis]);
            let (at_low, at_high) = match way {
                Way::Up => (1.0 / most[axis], 1.0 / least[axis]),
                Way::Down => (1.0 / most[axis], 1.0 / least[axis]),
                Way::Both => (1.0 / most[axis].max(NIL), 1.0 / least[axis].min(-NIL)),
            };
            shaft.ways[axis] = way;
            shaft.low[axis] = (at_low, -apex[axis] * at_low);
            shaft.high[axis] = (at_high, -apex[axis] * at_high);
        }
        shaft.directions = Directions::new(least, most);
        shaft
    }

    /// The children of `node` whose boxes some segment may meet.
    #[inline(always)]
    pub(super) fn meets<I: Isa>(&self, node: &Node) -> u32 {
        let (mut enter, mut leave) = (I::Eight::splat(0.0), I::Eight::splat(1.0));
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
        !miss & node.boxes
    }
}

#[inline(always)]
fn times<I: Isa>(sides: &[f32; WIDTH], (factor, term): (f32, f32)) -> I::Eight {
    I::Eight::load(sides).mul_add(I::Eight::splat(factor), I::Eight::splat(term))
}

/// 1/d, and finite where d is 0.
#[inline(always)]
fn inverse<I: Isa>(d: I::Sixteen) -> I::Sixteen {
    I::Sixteen::splat(1.0).div(d.abs().max(I::Sixteen::splat(NIL)).flip(d))
}

/// Sixteen segments from an apex, against one box at a time.
pub(super) struct Bundle<I: Isa> {
    ways: [Way; 3],
    /// By axis, the time at a coordinate: its factor and the term.
    factor: [I::Sixteen; 3],
    term: [I::Sixteen; 3],
}

impl<I: Isa> Bundle<I> {
    /// The segments along `d` from `apex`, all in `shaft`.
    #[inline(always)]
    pub(super) fn new(shaft: &Shaft, apex: [f32; 3], d: &[I::Sixteen; 3]) -> Self {
        let mut bundle = Bundle::<I> { ways: shaft.ways, factor: *d, term: *d };
        for axis in 0..3 {
            bundle.factor[axis] = inverse::<I>(d[axis]);
            bundle.term[axis] = bundle.factor[axis].mul(I::Sixteen::splat(-apex[axis]));
        }
        bundle
    }

    /// The segments that may meet box `slot` of `node`.
    #[inline(always)]
    pub(super) fn meets(&self, node: &Node, slot: usize) -> u32 {
        debug_assert!(slot < WIDTH);
        let (mut enter, mut leave) = (I::Sixteen::splat(0.0), I::Sixteen::splat(1.0));
        for axis in 0..3 {
            let low = self.factor[axis].mul_add(I::Sixteen::splat(node.low[axis][slot]), self.term[axis]);
            let high = self.factor[axis].mul_add(I::Sixteen::splat(node.high[axis][slot]), self.term[axis]);
            match self.ways[axis] {
                Way::Up => (enter, leave) = (enter.max(low), leave.min(high)),
                Way::Down => (enter, leave) = (enter.max(high), leave.min(low)),
                Way::Both => (enter, leave) = (enter.max(low.min(high)), leave.min(low.max(high))),
            }
        }
        !leave.less(enter.mul(I::Sixteen::splat(EARLIER)))
    }
}
