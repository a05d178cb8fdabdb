//! Triangles in f32 under a hierarchy of boxes, and what all rays through them share.
//!
//! Whether a ray crosses a triangle is decided in f64: no ray slips between triangles that share bit-identical corners,
//! because the three edge functions of a triangle are triple products in f64 of f32 corners, and swapping the ends of an
//! edge changes exactly their sign, so the two neighbours of an edge agree about the side on which a ray passes; a ray on the
//! edge meets both. Everything before that, in f32 and for many triangles at once, is conservative.

use super::bvh::{Build, Bvh8, Node, WIDTH};
use super::pages;
use super::planes::Block;
use super::ray::{Any, Closest};
use super::simd::{Path, prefetch};
use super::{Hit, Ray, hit};
use crate::math::{DVec3, Vec3};
use arrayvec::ArrayVec;

/// How far from a triangle's box f64 may see a crossing, in units of the largest coordinate of a corner seen from the start
/// of the ray: far more than f64 rounds, a quarter of what the boxes of the hierarchy are inflated by.
const AROUND: f64 = 4.0 / (1u64 << 24) as f64;

/// Blocks that stay in the caches near a core.
const CACHED: usize = 256;

/// Triangles and their hierarchy.
pub struct Mesh {
    /// In the order of the blocks.
    pub(super) triangles: Vec<Triangle>,
    /// Where each primitive stands in `triangles`.
    place: Vec<u32>,
    pub(super) bvh: Bvh8,
    pub(super) blocks: Vec<Block>,
    /// What rays want to know of each block beforehand.
    pub(super) leaves: Vec<Leaf>,
    bounds: (DVec3, DVec3),
    /// The bounds and a little around them, where rays may start.
    near: (DVec3, DVec3),
    /// More than f64 rounds of a distance from a plane \[m\].
    pub(super) floor: f32,
    pub(super) path: Path,
}

/// A block, for single rays.
#[derive(Clone, Copy)]
pub(super) struct Leaf {
    /// Where its triangles begin.
    pub(super) first: u32,
    /// Bit i: lane i has a triangle.
    pub(super) lanes: u32,
    /// The longest side of the box around it \[m\].
    pub(super) edge: f32,
}

/// A triangle as rays meet it.
pub(super) struct Triangle {
    pub(super) corners: [Vec3; 3],
    pub(super) primitive: u32,
}

impl Default for Mesh {
    fn default() -> Self {
        Mesh::new(&[])
    }
}

impl Mesh {
    /// Builds the hierarchy over `triangles` \[m\], counter-clockwise seen from the front.
    pub fn new(triangles: &[[Vec3; 3]]) -> Self {
        Mesh::built(triangles, Build::Thorough)
    }

    /// The same with more or less care.
    pub fn built(triangles: &[[Vec3; 3]], build: Build) -> Self {
        Mesh::within(triangles, build, (DVec3::INFINITY, DVec3::NEG_INFINITY))
    }

    /// The same for rays and segments that come from anywhere in the box between two corners.
    pub(super) fn within(triangles: &[[Vec3; 3]], build: Build, around: (DVec3, DVec3)) -> Self {
        let own = Mesh::bounds_of(triangles);
        let bounds = (around.0.min(own.0), around.1.max(own.1));
        let diagonal = (bounds.1 - bounds.0).length();
        let size = bounds.0.abs().max(bounds.1.abs()).max_element() + diagonal;
        // Twice the scene is the longest way of a ray inside it; 8 roundings of that are more than a test of a box makes.
        let bvh = Bvh8::new(triangles, (8.0 / f64::from(1 << 24) * 2.0 * size) as f32, build);
        let mut place = vec![0; triangles.len()];
        for (at, &primitive) in bvh.order.iter().enumerate() {
            place[primitive as usize] = at as u32;
        }
        let ordered = bvh.order.iter().map(|&p| Triangle { corners: triangles[p as usize], primitive: p });
        let ordered = pages::collect(triangles.len(), ordered);
        let block = |number: u32| {
            let corners: Vec<_> = ordered[bvh.block(number)].iter().map(|t| t.corners).collect();
            Block::new(&corners)
        };
        let blocks = pages::collect(bvh.firsts.len() - 1, (0..bvh.firsts.len() as u32 - 1).map(block));
        let leaves = leaves(&bvh);
        let around = 0.01 * (bounds.1 - bounds.0).max_element();
        let near = (bounds.0 - around, bounds.1 + around);
        let floor = (size / (1u64 << 46) as f64) as f32;
        let path = Path::chosen().unwrap_or(Path::Scalar);
        Mesh { triangles: ordered, place, bvh, blocks, leaves, bounds, near, floor, path }
    }

    /// Corners of the box around `triangles` \[m\].
    pub(super) fn bounds_of(triangles: &[[Vec3; 3]]) -> (DVec3, DVec3) {
        let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        triangles.iter().flatten().fold(empty, |(low, high), p| (low.min(p.as_dvec3()), high.max(p.as_dvec3())))
    }

    /// The same triangles under other numbers, in ascending order: that of triangle i is `numbers[i]`.
    pub(super) fn numbered(mut self, numbers: &[u32]) -> Self {
        self.place = vec![u32::MAX; numbers.last().map_or(0, |&last| last as usize + 1)];
        for (place, (triangle, primitive)) in (0..).zip(self.triangles.iter_mut().zip(&mut self.bvh.order)) {
            *primitive = numbers[*primitive as usize];
            triangle.primitive = *primitive;
            self.place[*primitive as usize] = place;
        }
        self
    }

    /// True when `primitive` is one of its triangles.
    pub(super) fn has(&self, primitive: u32) -> bool {
        self.place.get(primitive as usize).is_some_and(|&place| place != u32::MAX)
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// True without triangles.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Memory \[bytes\].
    pub fn bytes(&self) -> u64 {
        let blocks = size_of_val(&self.blocks[..]) + size_of_val(&self.leaves[..]);
        (size_of_val(&self.triangles[..]) + size_of_val(&self.place[..]) + blocks + self.bvh.bytes()) as u64
    }

    pub(super) fn bounds(&self) -> (DVec3, DVec3) {
        self.bounds
    }

    pub(super) fn triangle(&self, primitive: u32) -> [DVec3; 3] {
        self.triangles[self.place(primitive) as usize].corners.map(|p| p.as_dvec3())
    }

    /// Where a primitive stands in the order of the blocks.
    pub(super) fn place(&self, primitive: u32) -> u32 {
        self.place[primitive as usize]
    }

    /// Parameters at which the line o + t d, t in 0 ..= `end`, enters and leaves the mesh; `None` when it misses it.
    ///
    /// Beyond the mesh f32 rounds more than the boxes of the hierarchy are inflated by, so no ray starts there.
    pub(super) fn clip(&self, o: DVec3, d: DVec3, end: f64) -> Option<(f64, f64)> {
        let (low, high) = self.near;
        let (mut enter, mut leave) = (0.0f64, end);
        for axis in 0..3 {
            let (a, b) = ((low[axis] - o[axis]) / d[axis], (high[axis] - o[axis]) / d[axis]);
            // 0/0 on a face of the box is NaN, which min and max pass over.
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter <= leave).then_some((enter, leave))
    }

    pub(super) fn is_near(&self, p: DVec3) -> bool {
        p.cmpge(self.near.0).all() && p.cmple(self.near.1).all()
    }

    /// The first triangle at most `limit` away.
    #[inline]
    pub(super) fn closest_hit(&self, ray: &Ray, limit: f64) -> Option<Hit> {
        if self.is_near(ray.origin) {
            self.path.for_eights().run(Closest { mesh: self, ray, limit })
        } else {
            self.closest_hit_from_far(ray, limit)
        }
    }

    #[cold]
    fn closest_hit_from_far(&self, ray: &Ray, limit: f64) -> Option<Hit> {
        let (enter, _) = self.clip(ray.origin, ray.direction, limit)?;
        let near = Ray { origin: ray.origin + enter * ray.direction, ..*ray };
        let hit = self.path.for_eights().run(Closest { mesh: self, ray: &near, limit: limit - enter })?;
        Some(Hit { distance: hit.distance + enter, ..hit })
    }

    /// Asks for the memory of what is in the boxes `met` of `node`.
    #[inline(always)]
    pub(super) fn prefetch(&self, node: &Node, met: u32) {
        if self.blocks.len() < CACHED {
            return;
        }
        for slot in bits(met) {
            let child = node.child[slot] as usize;
            if node.blocks >> slot & 1 == 1 {
                prefetch(&self.blocks[child]);
            } else {
                prefetch(&self.bvh.nodes[child]);
            }
        }
    }

    /// True when a triangle crosses the segment from `a` to `b`, ends excluded.
    pub(super) fn blocks(&self, a: Vec3, b: Vec3) -> bool {
        let (o, end) = (a.as_dvec3(), b.as_dvec3());
        if self.is_near(o) && self.is_near(end) {
            return self.path.for_eights().run(Any { mesh: self, origin: a, direction: b - a });
        }
        let clipped = self.clip(o, end - o, 1.0);
        clipped.is_some_and(|(enter, leave)| {
            let (a, b) = ((o + enter * (end - o)).as_vec3(), (o + leave * (end - o)).as_vec3());
            self.path.for_eights().run(Any { mesh: self, origin: a, direction: b - a })
        })
    }
}

fn leaves(bvh: &Bvh8) -> Vec<Leaf> {
    let mut leaves = vec![Leaf { first: 0, lanes: 0, edge: 0.0 }; bvh.firsts.len() - 1];
    for node in &bvh.nodes {
        for slot in bits(node.blocks) {
            let number = node.child[slot];
            let edge = (0..3).map(|axis| node.high[axis][slot] - node.low[axis][slot]).fold(0.0, f32::max);
            let range = bvh.block(number);
            let lanes = (1u32 << range.len()) - 1;
            leaves[number as usize] = Leaf { first: range.start as u32, lanes, edge };
        }
    }
    leaves
}

/// The numbers of the bits that are set.
#[inline(always)]
pub(super) fn bits(mask: u32) -> Bits {
    Bits(mask)
}

/// See [`bits`].
pub(super) struct Bits(u32);

impl Iterator for Bits {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        if self.0 == 0 {
            return None;
        }
        let bit = self.0.trailing_zeros() as usize;
        self.0 &= self.0 - 1;
        Some(bit)
    }
}

/// Boxes that wait for rays, by when they are entered.
#[derive(Default)]
pub(super) struct Open {
    /// The bits of the time, which is not negative, above the node and the slot: one number to compare and to keep.
    keys: ArrayVec<u64, 96>,
    /// Those below, in hierarchies of unusual depth.
    below: Vec<u64>,
}

impl Open {
    /// Adds the boxes `met` of the node `number`, the nearest last.
    #[inline(always)]
    pub(super) fn push(&mut self, number: u32, met: u32, times: &[f32; WIDTH]) {
        if self.keys.remaining_capacity() < WIDTH {
            self.make_room();
        }
        let bottom = self.keys.len();
        for slot in bits(met) {
            let key = u64::from(times[slot].to_bits()) << 32 | u64::from(number * WIDTH as u32 + slot as u32);
            let mut at = self.keys.len();
            self.keys.push(key);
            while at > bottom && self.keys[at - 1] < key {
                self.keys[at] = self.keys[at - 1];
                at -= 1;
            }
            self.keys[at] = key;
        }
    }

    #[cold]
    #[inline(never)]
    fn make_room(&mut self) {
        self.below.extend(self.keys.drain(..));
    }

    /// The time, node and slot of the box on top that is entered before `end`; it and all above it are taken off.
    #[inline(always)]
    pub(super) fn pop(&mut self, end: f32) -> Option<(f32, usize, usize)> {
        loop {
            let key = match self.keys.pop() {
                Some(key) => key,
                None => self.below.pop()?,
            };
            let (time, at) = (f32::from_bits((key >> 32) as u32), key as u32 as usize);
            if time <= end {
                return Some((time, at / WIDTH, at % WIDTH));
            }
        }
    }
}

/// The plane of a triangle for rays from one point.
pub(super) struct Face {
    corner: DVec3,
    /// N, of the length of twice the area.
    normal: DVec3,
    /// N . (corner - origin): a ray along d meets the plane at its quotient by N . d.
    numerator: f64,
}

impl Face {
    #[inline(always)]
    pub(super) fn distance(&self, d: DVec3) -> f64 {
        self.numerator / self.normal.dot(d)
    }

    /// The unit normal.
    #[inline(always)]
    pub(super) fn unit(&self) -> DVec3 {
        // What `normalize` computes; its square root is an instruction of old, slow between those of wide vectors.
        self.normal * (1.0 / self.normal.dot(self.normal).sqrt())
    }

    /// The hit of `ray` at `distance` on this face of `primitive`, with unit normal `unit`.
    #[inline(always)]
    pub(super) fn hit(&self, ray: &Ray, distance: f64, primitive: u32, unit: DVec3) -> Hit {
        let near = ray.origin + distance * ray.direction;
        let position = near - unit.dot(near - self.corner) * unit;
        Hit { primitive, ..hit(ray, distance, position, unit) }
    }
}

impl Triangle {
    #[cfg(test)]
    pub(super) fn new(corners: [Vec3; 3]) -> Self {
        Triangle { corners, primitive: 0 }
    }

    /// Its plane for rays from `o`.
    #[inline(always)]
    pub(super) fn face(&self, o: DVec3) -> Face {
        let [a, b, c] = self.corners.map(|p| p.as_dvec3());
        let normal = (b - a).cross(c - a);
        Face { corner: a, normal, numerator: normal.dot(a) - normal.dot(o) }
    }

    /// Parameter 0 < t <= limit at which the line o + t d crosses the triangle, edges included.
    #[inline(always)]
    pub(super) fn intersect(&self, o: DVec3, d: DVec3, limit: f64) -> Option<f64> {
        let t = self.face(o).distance(d);
        // Edge-on the quotient is infinite or undefined: a triangle seen edge-on is not there.
        (t > 0.0 && t <= limit && t.is_finite() && self.is_crossed(o, d, t)).then_some(t)
    }

    /// True when the line along `d`, which meets the plane at parameter `t`, crosses the triangle, edges included.
    ///
    /// A line in the triangle's very plane has only roundings for t and for sides, and could seem to cross anywhere. So the
    /// crossing must lie in the box around the triangle, give or take [`AROUND`]: then no test of a box, which is
    /// inflated by more, can contradict, and the answer is the same by whatever way through the hierarchy.
    #[inline(always)]
    pub(super) fn is_crossed(&self, o: DVec3, d: DVec3, t: f64) -> bool {
        let [a, b, c] = self.corners.map(|p| p.as_dvec3() - o);
        let edges = [d.dot(c.cross(b)), d.dot(a.cross(c)), d.dot(b.cross(a))];
        let one_side = edges.iter().all(|&e| e >= 0.0) || edges.iter().all(|&e| e <= 0.0);
        if !one_side {
            return false;
        }
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let (at, around) = (t * d, AROUND * low.abs().max(high.abs()).max_element());
        at.cmpge(low - around).all() && at.cmple(high + around).all()
    }

    /// True when the segment from `o` along `d` crosses the triangle, edges included and ends excluded.
    #[inline(always)]
    pub(super) fn crosses(&self, o: DVec3, d: DVec3) -> bool {
        self.intersect(o, d, 1.0).is_some_and(|t| t < 1.0)
    }
}
