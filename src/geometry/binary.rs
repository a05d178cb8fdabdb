//! The binary hierarchy over many boxes, built by all threads.
//!
//! Many boxes are cut into parts by the medians of their middles; `obvhs` builds a hierarchy over each part, and one over the
//! parts, which are joined. The parts do not depend on the number of threads, so neither does the tree.

use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use rayon::prelude::*;

/// Boxes from which on they are cut into parts. Among a million, segments are traced 13 % faster than without cuts and single
/// rays 14 % slower; among a hundred thousand around one object both are 20 % slower.
const MANY: usize = 1 << 18;
/// Halvings: 16 parts.
const CUTS: u32 = 4;

/// The hierarchy over `boxes`.
pub(super) fn build(boxes: &[Aabb], care: BvhBuildParams) -> Bvh2 {
    if boxes.len() < MANY {
        return build_bvh2(boxes, care, &mut Default::default());
    }
    let mut all: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut parts = Vec::new();
    cut(boxes, &mut all, CUTS, &mut parts);
    let built: Vec<Bvh2> = parts.par_iter().map(|part| of_part(boxes, part, care)).collect();
    let around: Vec<Aabb> = built.iter().map(|part| part.nodes[0].aabb).collect();
    let one_each = BvhBuildParams { max_prims_per_leaf: 1, ..care };
    join(build_bvh2(&around, one_each, &mut Default::default()), &built)
}

/// Cuts `some` into 2^`cuts` parts of equal size, each in half along the longest side of the box around its middles.
fn cut<'a>(boxes: &[Aabb], some: &'a mut [u32], cuts: u32, parts: &mut Vec<&'a [u32]>) {
    if cuts == 0 {
        parts.push(some);
        return;
    }
    let middle = |i: u32| boxes[i as usize].min + boxes[i as usize].max;
    let empty = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
    let (low, high) = some.iter().fold(empty, |(low, high), &i| (low.min(middle(i)), high.max(middle(i))));
    let axis = (high - low).max_position();
    let half = some.len() / 2;
    some.select_nth_unstable_by(half, |&a, &b| middle(a)[axis].total_cmp(&middle(b)[axis]).then(a.cmp(&b)));
    let (first, second) = some.split_at_mut(half);
    cut(boxes, first, cuts - 1, parts);
    cut(boxes, second, cuts - 1, parts);
}

/// The hierarchy over some boxes, which it calls by their numbers among all.
fn of_part(boxes: &[Aabb], part: &[u32], care: BvhBuildParams) -> Bvh2 {
    let own: Vec<Aabb> = part.iter().map(|&i| boxes[i as usize]).collect();
    let mut built = build_bvh2(&own, care, &mut Default::default());
    built.primitive_indices.iter_mut().for_each(|i| *i = part[*i as usize]);
    built
}

/// The hierarchy `top` over the roots of `parts`, with the parts below it.
fn join(top: Bvh2, parts: &[Bvh2]) -> Bvh2 {
    let mut whole = Bvh2 { nodes: top.nodes, ..Bvh2::default() };
    for node in 0..whole.nodes.len() {
        if !whole.nodes[node].is_leaf() {
            continue;
        }
        let part = &parts[top.primitive_indices[whole.nodes[node].first_index as usize] as usize];
        let (triangles, nodes) = (whole.primitive_indices.len() as u32, whole.nodes.len() as u32);
        let mut moved = part.nodes.clone();
        for inside in &mut moved {
            // The root takes the place of the leaf, so what comes after it moves up by one.
            inside.first_index += if inside.is_leaf() { triangles } else { nodes - 1 };
        }
        whole.nodes[node] = moved[0];
        whole.nodes.extend(&moved[1..]);
        whole.primitive_indices.extend(&part.primitive_indices);
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Domain, Stream};

    fn boxes(count: usize) -> Vec<Aabb> {
        let mut rng = Stream::new(5, Domain::Trajectory, "boxes").generator(0);
        let mut number = || rng.uniform() as f32;
        let mut one = |_| {
            let low = Vec3A::new(number(), number(), number());
            Aabb::new(low, low + 0.01 * number())
        };
        // Some alike, so that middles are equal.
        (0..count).map(|i| if i % 7 == 0 { Aabb::new(Vec3A::ZERO, Vec3A::ONE) } else { one(i) }).collect()
    }

    /// The boxes below each leaf, and whether every node is around what is below it.
    fn walk(tree: &Bvh2, boxes: &[Aabb]) -> Vec<u32> {
        let (mut found, mut open) = (Vec::new(), vec![0usize]);
        let is_around =
            |outer: &Aabb, inner: &Aabb| outer.min.cmple(inner.min).all() && outer.max.cmpge(inner.max).all();
        while let Some(number) = open.pop() {
            let node = &tree.nodes[number];
            let first = node.first_index as usize;
            if node.is_leaf() {
                let below = &tree.primitive_indices[first..first + node.prim_count as usize];
                assert!(below.iter().all(|&i| is_around(&node.aabb, &boxes[i as usize])));
                found.extend(below);
            } else {
                assert!([first, first + 1].into_iter().all(|c| is_around(&node.aabb, &tree.nodes[c].aabb)));
                open.extend([first, first + 1]);
            }
        }
        found
    }

    #[test]
    fn every_box_of_many_is_below_the_root_once_whatever_the_threads() {
        let boxes = boxes(MANY + 1);
        let care = BvhBuildParams { max_prims_per_leaf: 8, ..BvhBuildParams::fastest_build() };
        let built = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            walk(&pool.install(|| build(&boxes, care)), &boxes)
        };
        let (one, mut three) = (built(1), built(3));
        assert_eq!(one, three);
        three.sort_unstable();
        assert!(three.into_iter().eq(0..boxes.len() as u32));
    }
}
