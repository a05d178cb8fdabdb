//! Vectors of space in lanes, by plain operations: for numbers of a result, which are the same bits on every path.

use super::Vector;
use crate::math::Vec3;

/// A vector of space in every lane.
pub type Triple<V> = [V; 3];

/// The same vector in all lanes.
#[inline(always)]
pub fn splat<V: Vector>(v: Vec3) -> Triple<V> {
    [V::splat(v.x), V::splat(v.y), V::splat(v.z)]
}

/// a + b.
#[inline(always)]
pub fn add<V: Vector>(a: &Triple<V>, b: &Triple<V>) -> Triple<V> {
    [a[0].add(b[0]), a[1].add(b[1]), a[2].add(b[2])]
}

/// a - b.
#[inline(always)]
pub fn sub<V: Vector>(a: &Triple<V>, b: &Triple<V>) -> Triple<V> {
    [a[0].sub(b[0]), a[1].sub(b[1]), a[2].sub(b[2])]
}

/// a times the number k.
#[inline(always)]
pub fn scale<V: Vector>(a: &Triple<V>, k: V) -> Triple<V> {
    [a[0].mul(k), a[1].mul(k), a[2].mul(k)]
}

/// (a, b).
#[inline(always)]
pub fn dot<V: Vector>(a: &Triple<V>, b: &Triple<V>) -> V {
    a[0].mul(b[0]).add(a[1].mul(b[1])).add(a[2].mul(b[2]))
}

/// a x b.
#[inline(always)]
pub fn cross<V: Vector>(a: &Triple<V>, b: &Triple<V>) -> Triple<V> {
    [a[1].mul(b[2]).sub(a[2].mul(b[1])), a[2].mul(b[0]).sub(a[0].mul(b[2])), a[0].mul(b[1]).sub(a[1].mul(b[0]))]
}
