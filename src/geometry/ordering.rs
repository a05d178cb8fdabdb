//! The order in which points share tiles: neighbours in space together, by median splits.
//!
//! A tile whose receivers lie close together sees the same few occluders, which is what the visibility kernel
//! lives on; so do the groups and bundles of points inside a tile. The order never changes a number: every point has
//! sums of its own.

use super::visibility::TILE;
use crate::math::DVec3;

/// Sizes of the runs that lie close together: a tile, a group, a bundle.
const RUNS: [usize; 3] = [TILE, 64, 16];

/// Indices of `points` so that each run of a tile, group and bundle lies close together; points that are not finite come
/// last.
pub fn kd_order(points: &[DVec3]) -> Vec<u32> {
    let (mut order, lost): (Vec<u32>, Vec<u32>) =
        (0..points.len() as u32).partition(|&i| points[i as usize].is_finite());
    split(points, &mut order);
    order.extend(lost);
    order
}

fn split(points: &[DVec3], order: &mut [u32]) {
    let Some(run) = RUNS.into_iter().find(|&run| order.len() > run) else { return };
    let at = |i: &u32| points[*i as usize];
    let (low, high) =
        order.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), i| (l.min(at(i)), h.max(at(i))));
    let axis = (high - low).max_position();
    // Whole runs on the left, so that no run straddles a split.
    let middle = (order.len() / 2).next_multiple_of(run).min(order.len() - 1);
    let key = |i: &u32| (at(i)[axis], *i);
    order.select_nth_unstable_by(middle, |a, b| {
        let ((x, i), (y, j)) = (key(a), key(b));
        x.total_cmp(&y).then(i.cmp(&j))
    });
    let (left, right) = order.split_at_mut(middle);
    split(points, left);
    split(points, right);
}
