//! A bundle of 16 segments against what its group left over: segments against boxes, then against triangles.
//!
//! Where few segments come near a block, each is tested against its eight triangles at once; where many do, each triangle is tested
//! against all segments, after those that no segment can cross.

use super::super::bvh::{Node, WIDTH};
use super::super::mesh::bits;
use super::super::planes::Planes;
use super::super::shaft::{Bundle, Shaft};
use super::super::simd::{Isa, Vector, prefetch};
use super::Descent;
use crate::math::Vec3;
use arrayvec::ArrayVec;
use smallvec::SmallVec;

/// Segments near a block up to which each is tested alone.
const FEW: u32 = 6;

/// Nodes that wait for a bundle.
type Stack = SmallVec<[Open; 256]>;

/// A node that waits.
#[derive(Clone, Copy)]
struct Open {
    node: u32,
    boxes: u32,
    /// Points whose segments meet its box.
    alive: u32,
}

/// A bundle made ready.
struct Segments<I: Isa> {
    number: usize,
    shaft: Shaft,
    d: [I::Sixteen; 3],
    boxes: Bundle<I>,
}

impl Descent<'_> {
    /// The points of `seen` in bundle `number` that none of the candidates `from` blocks.
    #[inline(always)]
    pub(super) fn bundle<I: Isa>(&mut self, from: &[(u32, u32)], number: usize, seen: u16) -> u16 {
        let (low, high) = self.points.bundles[number];
        let mut shaft = Shaft::new(self.apex, low, high);
        let d = self.points.segments::<I>(number, self.apex);
        let mut boxes = Bundle::new(&shaft, &d);
        if let Some(starts) = self.starts {
            shaft = shaft.after(starts.bundles[number]);
            boxes = boxes.after(I::Sixteen::load(&starts.each[number]));
        }
        let segments = Segments::<I> { number, shaft, d, boxes };
        let mut seen = u32::from(seen);
        let mut open = Stack::new();
        open.extend(from.iter().map(|&(node, boxes)| Open { node, boxes, alive: seen }));
        while let Some(next) = open.pop() {
            if next.alive & seen == 0 {
                continue;
            }
            let node = &self.mesh.bvh.nodes[next.node as usize];
            for (slot, alive) in self.children(&segments, node, next.boxes, next.alive & seen, &mut open) {
                if alive & seen != 0 {
                    seen = self.block(&segments, node, slot, alive & seen, seen);
                    if seen == 0 {
                        return 0;
                    }
                }
            }
        }
        seen as u16
    }

    /// The blocks among the `boxes` of `node` that segments `alive` meet, with those segments; nodes among them go to `open`.
    #[inline(always)]
    fn children<I: Isa>(
        &self,
        segments: &Segments<I>,
        node: &Node,
        boxes: u32,
        alive: u32,
        open: &mut Stack,
    ) -> ArrayVec<(usize, u32), WIDTH> {
        let mut blocks = ArrayVec::new();
        for slot in bits(segments.shaft.meets::<I>(node) & boxes) {
            let alive = segments.boxes.meets(node, slot) & alive;
            if alive == 0 {
                continue;
            }
            let child = node.child[slot];
            if node.blocks >> slot & 1 == 1 {
                prefetch(&self.mesh.blocks[child as usize]);
                blocks.push((slot, alive));
            } else {
                prefetch(&self.mesh.bvh.nodes[child as usize]);
                open.push(Open { node: child, boxes: u32::MAX, alive });
            }
        }
        blocks
    }

    /// The points of `seen` that no triangle of a block blocks, where only the segments `alive` come near it.
    #[inline(always)]
    fn block<I: Isa>(&mut self, segments: &Segments<I>, node: &Node, slot: usize, alive: u32, seen: u32) -> u32 {
        let planes = self.planes::<I>(node, slot, &segments.shaft);
        let (block, there) = (node.child[slot], (1u32 << node.triangles[slot]) - 1);
        if alive.count_ones() <= FEW {
            return seen & !self.blocked(&planes, block, there, segments.number, alive);
        }
        let start = self.starts.map_or(0.0, |starts| starts.bundles[segments.number]);
        let against = self.against(&planes, &segments.shaft.directions, start);
        if against.cover & there != 0 {
            return 0;
        }
        let may = against.may & there;
        if may == 0 {
            return seen;
        }
        planes.store(&mut self.scratch.few[0]);
        let mut seen = seen as u16;
        for lane in bits(may) {
            seen = self.test_triangle::<I>(&self.scratch.few[0], block, lane, segments.number, &segments.d, seen);
            if seen == 0 {
                break;
            }
        }
        u32::from(seen)
    }

    /// The points of `alive` that a triangle of a block blocks, each asked alone.
    #[inline(always)]
    fn blocked<I: Isa>(&self, planes: &Planes<I>, block: u32, there: u32, bundle: usize, alive: u32) -> u32 {
        let mut blocked = 0;
        for lane in bits(alive) {
            let d = (self.points.point(bundle, lane) - Vec3::from(self.apex)).to_array();
            let decided = planes.test(d);
            let before = match self.starts {
                Some(starts) => planes.before(d, starts.each[bundle][lane]),
                None => 0,
            };
            let undecided = there & !(decided.miss | before);
            if decided.hit & undecided != 0 || undecided != 0 && self.crosses_f64(block, undecided, d) {
                blocked |= 1 << lane;
            }
        }
        blocked
    }

    /// True when one of the triangles `undecided` of a block crosses the segment along `d`.
    #[cold]
    #[inline(never)]
    fn crosses_f64(&self, block: u32, undecided: u32, d: [f32; 3]) -> bool {
        let first = self.mesh.bvh.firsts[block as usize] as usize;
        let (apex, d) = (Vec3::from(self.apex).as_dvec3(), Vec3::from(d).as_dvec3());
        bits(undecided).any(|lane| self.mesh.triangles[first + lane].crosses(apex, d))
    }
}
