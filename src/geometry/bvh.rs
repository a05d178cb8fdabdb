//! A hierarchy of boxes with eight children a node, over blocks of eight triangles.
//!
//! `obvhs` builds a binary hierarchy; it is collapsed here into wide nodes and full leaves, laid out for vectors. Boxes are
//! inflated by more than any of their tests rounds, so no test of a box is ever wrong about a triangle inside: answers
//! come from triangles alone.

use super::{binary, pages};
use crate::math::Vec3;
use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::ploc::PlocSearchDistance;
use std::ops::Range;

/// Children of a node, and triangles of a block.
pub(super) const WIDTH: usize = 8;

/// Triangles up to which the hierarchy is built with most care.
const FEW: usize = 1 << 17;

/// How much time is spent to make a hierarchy good. No hit depends on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Build {
    /// Little: for a few thousand rays.
    Quick,
    /// What pays in a job.
    Thorough,
}

/// Eight boxes, each around a node or a block.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// Low corners, by axis \[m\].
    pub(super) low: [[f32; WIDTH]; 3],
    /// High corners, by axis \[m\].
    pub(super) high: [[f32; WIDTH]; 3],
    /// Number of the node or block in each box.
    pub(super) child: [u32; WIDTH],
    /// Triangles in each block.
    pub(super) triangles: [u8; WIDTH],
    /// Bit i: box i is there.
    pub(super) boxes: u32,
    /// Bit i: box i is around a block.
    pub(super) blocks: u32,
}

/// The hierarchy of a set of boxes.
#[derive(Debug, Default)]
pub(super) struct Bvh8 {
    /// The root first; empty without triangles.
    pub(super) nodes: Vec<Node>,
    /// Triangles in the order of the blocks.
    pub(super) order: Vec<u32>,
    /// Where each block begins in `order`, and its end at last.
    pub(super) firsts: Vec<u32>,
    /// Nodes on the longest way down.
    pub(super) depth: usize,
}

impl Bvh8 {
    /// The hierarchy over `triangles`, their boxes inflated by `margin` \[m\].
    pub(super) fn new(triangles: &[[Vec3; 3]], margin: f32, build: Build) -> Self {
        if triangles.is_empty() {
            return Bvh8 { firsts: vec![0], ..Bvh8::default() };
        }
        let margin = Vec3A::splat(margin);
        let inflated = |t: &[Vec3; 3]| {
            let tight = Aabb::from_points(&t.map(Vec3A::from));
            Aabb::new(tight.min - margin, tight.max + margin)
        };
        let boxes: Vec<Aabb> = triangles.iter().map(inflated).collect();
        let bvh = Collapse::of(&binary::build(&boxes, care(triangles.len(), build)));
        Bvh8 { nodes: pages::collect(bvh.nodes.len(), bvh.nodes.into_iter()), ..bvh }
    }

    /// Places in `order` of the triangles of a block.
    pub(super) fn block(&self, number: u32) -> Range<usize> {
        let number = number as usize;
        self.firsts[number] as usize..self.firsts[number + 1] as usize
    }

    /// The blocks whose boxes overlap the box from `low` to `high`.
    pub(super) fn blocks_in(&self, low: Vec3, high: Vec3) -> impl Iterator<Item = u32> {
        let mut open: Vec<u32> = if self.nodes.is_empty() { Vec::new() } else { vec![0] };
        let overlaps = move |node: &Node, slot: usize| {
            (0..3).all(|axis| node.low[axis][slot] <= high[axis] && node.high[axis][slot] >= low[axis])
        };
        let mut found: Vec<u32> = Vec::new();
        std::iter::from_fn(move || {
            while found.is_empty()
                && let Some(number) = open.pop()
            {
                let node = &self.nodes[number as usize];
                for slot in (0..WIDTH).filter(|&slot| node.boxes >> slot & 1 == 1 && overlaps(node, slot)) {
                    let into = if node.blocks >> slot & 1 == 1 { &mut found } else { &mut open };
                    into.push(node.child[slot]);
                }
            }
            found.pop()
        })
    }

    /// Memory \[bytes\].
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.order[..]) + size_of_val(&self.firsts[..])
    }
}

/// How a hierarchy of `count` triangles is built. Most care gains 25 % of the kernel's speed in a room of 34 triangles; among a
/// million it takes 1 s more and gains nothing over a wider search for neighbours, which gains 7 %.
fn care(count: usize, build: Build) -> BvhBuildParams {
    let medium = BvhBuildParams::medium_build();
    let (ploc_search_distance, search_depth_threshold) = (PlocSearchDistance::High, 2);
    let wide = BvhBuildParams { ploc_search_distance, search_depth_threshold, ..medium };
    let preset = match build {
        Build::Quick => BvhBuildParams::fastest_build(),
        Build::Thorough if count <= FEW => BvhBuildParams::slow_build(),
        Build::Thorough => wide,
    };
    BvhBuildParams { max_prims_per_leaf: WIDTH as u32, pre_split: false, ..preset }
}

/// A binary hierarchy on its way into a wide one.
struct Collapse<'a> {
    from: &'a Bvh2,
    /// Triangles below each binary node.
    counts: Vec<u32>,
    into: Bvh8,
}

impl Collapse<'_> {
    fn of(from: &Bvh2) -> Bvh8 {
        let mut collapse = Collapse { from, counts: counts(from), into: Bvh8::default() };
        // A stack instead of recursion: hierarchies from elsewhere may be deep.
        let mut open = vec![(0usize, None::<(usize, usize)>, 1usize)];
        while let Some((binary, parent, depth)) = open.pop() {
            let number = collapse.into.nodes.len();
            if let Some((node, slot)) = parent {
                collapse.into.nodes[node].child[slot] = number as u32;
            }
            collapse.into.depth = collapse.into.depth.max(depth);
            for (slot, child) in collapse.node(binary) {
                open.push((child, Some((number, slot)), depth + 1));
            }
        }
        collapse.into.firsts.push(collapse.into.order.len() as u32);
        collapse.into
    }

    fn is_block(&self, binary: usize) -> bool {
        self.counts[binary] as usize <= WIDTH || self.from.nodes[binary].is_leaf()
    }

    /// Appends the wide node made of the binary node `binary`; the children that are nodes themselves, with their slots.
    fn node(&mut self, binary: usize) -> Vec<(usize, usize)> {
        let mut children = vec![binary];
        while children.len() < WIDTH {
            let area = |i: &usize| self.from.nodes[children[*i]].aabb.half_area();
            let widest =
                (0..children.len()).filter(|&i| !self.is_block(children[i])).max_by(|a, b| area(a).total_cmp(&area(b)));
            let Some(widest) = widest else { break };
            let first = self.from.nodes[children[widest]].first_index as usize;
            children[widest] = first;
            children.push(first + 1);
        }
        let mut node = Node {
            low: [[f32::INFINITY; WIDTH]; 3],
            high: [[f32::NEG_INFINITY; WIDTH]; 3],
            child: [0; WIDTH],
            triangles: [0; WIDTH],
            boxes: (1 << children.len()) - 1,
            blocks: 0,
        };
        let mut inner = Vec::new();
        for (slot, &child) in children.iter().enumerate() {
            let aabb = self.from.nodes[child].aabb;
            for axis in 0..3 {
                node.low[axis][slot] = aabb.min[axis];
                node.high[axis][slot] = aabb.max[axis];
            }
            if self.is_block(child) {
                node.blocks |= 1 << slot;
                node.triangles[slot] = self.counts[child] as u8;
                node.child[slot] = self.block(child);
            } else {
                inner.push((slot, child));
            }
        }
        self.into.nodes.push(node);
        inner
    }

    /// Appends the block of all triangles below `binary`; its number.
    fn block(&mut self, binary: usize) -> u32 {
        let number = self.into.firsts.len();
        self.into.firsts.push(self.into.order.len() as u32);
        let mut open = vec![binary];
        while let Some(binary) = open.pop() {
            let node = &self.from.nodes[binary];
            let first = node.first_index as usize;
            if node.is_leaf() {
                let leaf = first..first + node.prim_count as usize;
                self.into.order.extend(&self.from.primitive_indices[leaf]);
            } else {
                open.extend([first + 1, first]);
            }
        }
        number as u32
    }
}

/// Triangles below each node of `bvh`.
fn counts(bvh: &Bvh2) -> Vec<u32> {
    let mut counts = vec![0; bvh.nodes.len()];
    let mut order = vec![0usize];
    let mut next = 0;
    while let Some(&node) = order.get(next) {
        next += 1;
        if !bvh.nodes[node].is_leaf() {
            let first = bvh.nodes[node].first_index as usize;
            order.extend([first, first + 1]);
        }
    }
    for &node in order.iter().rev() {
        let binary = &bvh.nodes[node];
        let first = binary.first_index as usize;
        counts[node] = if binary.is_leaf() { binary.prim_count } else { counts[first] + counts[first + 1] };
    }
    counts
}
