//! What veils let through of the light from a vertex to the receivers of a tile.
//!
//! Not part of the kernel: plain code, compiled once, for the few segments that veils cross.

#![allow(clippy::needless_range_loop, reason = "several arrays go by one lane or channel")]

use super::totals::Column;
use crate::geometry::visibility::{BUNDLE, BUNDLES, Lanes, Points};
use crate::math::Vec3;
use crate::scene::Scene;

/// Writes to `through` the shares that get from `apex` to the `points` that are `seen`; false, and nothing written, where no veil
/// stands in the way of any.
#[inline(never)]
pub(super) fn let_through<const C: usize>(
    scene: &Scene,
    apex: Vec3,
    points: &Points,
    seen: &Lanes,
    through: &mut [Column; C],
) -> bool {
    let mut any = false;
    scene.geometry.veils_before(apex, points, seen, |bundle, lane, crossing| {
        if !std::mem::replace(&mut any, true) {
            *through = [[[1.0; BUNDLE]; BUNDLES]; C];
        }
        let share = scene.let_through(crossing.primitive, crossing.position, crossing.cosine);
        for c in 0..C {
            through[c][bundle][lane] *= share.0[c] as f32;
        }
    });
    any
}
