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

/// The segments from an apex to a box, made ready.
pub(super) struct Shaft {
    apex: [f32; 3],
    pub(super) directions: Directions,
    /// Factors of a box's low and high sides in the time of entry.
    enter: [[f32; 3]; 2],
    /// Factors and terms of its high and low sides in the time of leaving.
    leave: [[f32; 3]; 2],
    stay: [[f32; 3]; 2],
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
        let (mut enter, mut leave, mut stay) = ([[0.0; 3]; 2], [[0.0; 3]; 2], [[f32::INFINITY; 3]; 2]);
        for axis in 0..3 {
            enter[0][axis] = 1.0 / most[axis].max(NIL);
            enter[1][axis] = 1.0 / least[axis].min(-NIL);
            if least[axis] > NIL {
                (leave[0][axis], stay[0][axis]) = (1.0 / least[axis], 0.0);
            }
            if most[axis] < -NIL {
                (leave[1][axis], stay[1][axis]) = (1.0 / most[axis], 0.0);
            }
        }
        Shaft { apex, directions: Directions::new(least, most), enter, leave, stay }
    }

    /// The children of `node` whose boxes some segment may meet.
    #[inline(always)]
    pub(super) fn meets<I: Isa>(&self, node: &Node) -> u32 {
        self.meets_before::<I>(node, 1.0).0
    }

    /// The children of `node` whose boxes some ray, 0 <= t <= `end`, may meet, and when the first of them does.
    #[inline(always)]
    pub(super) fn meets_before<I: Isa>(&self, node: &Node, end: f32) -> (u32, I::Eight) {
        let (mut enter, mut leave) = (I::Eight::splat(0.0), I::Eight::splat(end));
        for axis in 0..3 {
            let apex = I::Eight::splat(self.apex[axis]);
            let low = I::Eight::load(&node.low[axis]).sub(apex);
            let high = I::Eight::load(&node.high[axis]).sub(apex);
            let [enter_low, enter_high] = lanes::<I>(&self.enter, axis);
            let [leave_high, leave_low] = lanes::<I>(&self.leave, axis);
            let [stay_high, stay_low] = lanes::<I>(&self.stay, axis);
            enter = enter.max(low.mul(enter_low).max(high.mul(enter_high)));
            leave = leave.min(high.mul_add(leave_high, stay_high).min(low.mul_add(leave_low, stay_low)));
        }
        let miss = leave.less(enter.mul(I::Eight::splat(EARLIER)));
        (!miss & node.boxes, enter)
    }
}

#[inline(always)]
fn lanes<I: Isa>(sides: &[[f32; 3]; 2], axis: usize) -> [I::Eight; 2] {
    [I::Eight::splat(sides[0][axis]), I::Eight::splat(sides[1][axis])]
}

/// Sixteen segments from an apex, against one box at a time.
pub(super) struct Bundle<I: Isa> {
    inverse: [I::Sixteen; 3],
}

impl<I: Isa> Bundle<I> {
    /// The segments along `d`.
    #[inline(always)]
    pub(super) fn new(d: &[I::Sixteen; 3]) -> Self {
        let one = I::Sixteen::splat(1.0);
        Bundle { inverse: [one.div(d[0]), one.div(d[1]), one.div(d[2])] }
    }

    /// The segments that may meet box `slot` of `node`.
    ///
    /// A segment along one side of a box has an undefined time of entry; either answer is right, for the side is farther
    /// from what is in the box than rounding is.
    #[inline(always)]
    pub(super) fn meets(&self, node: &Node, slot: usize, apex: [f32; 3]) -> u32 {
        self.meets_before(node, slot, apex, I::Sixteen::splat(1.0))
    }

    /// The same for rays that end at `ends`.
    #[inline(always)]
    pub(super) fn meets_before(&self, node: &Node, slot: usize, apex: [f32; 3], ends: I::Sixteen) -> u32 {
        debug_assert!(slot < WIDTH);
        let (mut enter, mut leave) = (I::Sixteen::splat(0.0), ends);
        for axis in 0..3 {
            let low = self.inverse[axis].mul(I::Sixteen::splat(node.low[axis][slot] - apex[axis]));
            let high = self.inverse[axis].mul(I::Sixteen::splat(node.high[axis][slot] - apex[axis]));
            enter = low.min(high).max(enter);
            leave = low.max(high).min(leave);
        }
        !leave.less(enter.mul(I::Sixteen::splat(EARLIER)))
    }
}
