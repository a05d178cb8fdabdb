//! Triangles in f32 under a hierarchy of boxes, and single rays through them.
//!
//! Whether a ray crosses a triangle is decided in f64: no ray slips between triangles that share bit-identical corners,
//! because the three edge functions of a triangle are triple products in f64 of f32 corners, and swapping the ends of an
//! edge changes exactly their sign, so the two neighbours of an edge agree about the side on which a ray passes; a ray on the
//! edge meets both. Everything before that, in f32 and for many triangles at once, is conservative.

use super::bvh::{Bvh8, Node, WIDTH};
use super::planes::{Block, Directions, Extent, Planes, splat};
use super::simd::{Isa, Kernel, Path, Vector};
use super::{Hit, Ray, hit};
use crate::math::{DVec3, Vec3};
use smallvec::SmallVec;

/// How far from a triangle's box f64 may see a crossing, in units of the largest coordinate of a corner seen from the start
/// of the ray: far more than f64 rounds, a quarter of what the boxes of the hierarchy are inflated by.
const AROUND: f64 = 4.0 / (1u64 << 24) as f64;

/// Triangles and their hierarchy.
pub struct Mesh {
    /// In the order of the blocks.
    pub(super) triangles: Vec<Triangle>,
    /// Where each primitive stands in `triangles`.
    place: Vec<u32>,
    pub(super) bvh: Bvh8,
    pub(super) blocks: Vec<Block>,
    bounds: (DVec3, DVec3),
    /// The bounds and a little around them, where rays may start.
    near: (DVec3, DVec3),
    /// More than f64 rounds of a distance from a plane \[m\].
    pub(super) floor: f32,
    pub(super) path: Path,
}

/// A triangle as rays meet it.
pub(super) struct Triangle {
    pub(super) corners: [Vec3; 3],
    primitive: u32,
}

impl Default for Mesh {
    fn default() -> Self {
        Mesh::new(&[])
    }
}

impl Mesh {
    /// Builds the hierarchy over `triangles` \[m\], counter-clockwise seen from the front.
    pub fn new(triangles: &[[Vec3; 3]]) -> Self {
        let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let bounds = triangles.iter().flatten().fold(empty, |(low, high), p| {
            let p = p.as_dvec3();
            (low.min(p), high.max(p))
        });
        let diagonal = (bounds.1 - bounds.0).length();
        let size = bounds.0.abs().max(bounds.1.abs()).max_element() + diagonal;
        // Twice the scene is the longest way of a ray inside it; 8 roundings of that are more than a test of a box makes.
        let bvh = Bvh8::new(triangles, (8.0 / f64::from(1 << 24) * 2.0 * size) as f32);
        let mut place = vec![0; triangles.len()];
        for (at, &primitive) in bvh.order.iter().enumerate() {
            place[primitive as usize] = at as u32;
        }
        let ordered = bvh.order.iter().map(|&p| Triangle { corners: triangles[p as usize], primitive: p });
        let ordered: Vec<Triangle> = ordered.collect();
        let block = |number: u32| {
            let corners: Vec<_> = ordered[bvh.block(number)].iter().map(|t| t.corners).collect();
            Block::new(&corners)
        };
        let blocks = (0..bvh.firsts.len() as u32 - 1).map(block).collect();
        let around = 0.01 * (bounds.1 - bounds.0).max_element();
        let near = (bounds.0 - around, bounds.1 + around);
        let floor = (size / (1u64 << 46) as f64) as f32;
        let path = Path::chosen().unwrap_or(Path::Scalar);
        Mesh { triangles: ordered, place, bvh, blocks, bounds, near, floor, path }
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
        let blocks = size_of_val(&self.blocks[..]);
        (size_of_val(&self.triangles[..]) + size_of_val(&self.place[..]) + blocks + self.bvh.bytes()) as u64
    }

    pub(super) fn bounds(&self) -> (DVec3, DVec3) {
        self.bounds
    }

    pub(super) fn triangle(&self, primitive: u32) -> [DVec3; 3] {
        self.triangles[self.place[primitive as usize] as usize].corners.map(|p| p.as_dvec3())
    }

    /// Parameters at which the line o + t d, t in 0 ..= `end`, enters and leaves the mesh; `None` when it misses it.
    ///
    /// Beyond the mesh f32 rounds more than the boxes of the hierarchy are inflated by, so no ray starts there.
    fn clip(&self, o: DVec3, d: DVec3, end: f64) -> Option<(f64, f64)> {
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

    pub(super) fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        if self.is_near(ray.origin) {
            return self.closest_hit_near(ray);
        }
        let (enter, _) = self.clip(ray.origin, ray.direction, f64::INFINITY)?;
        let hit = self.closest_hit_near(&Ray { origin: ray.origin + enter * ray.direction, ..*ray })?;
        Some(Hit { distance: hit.distance + enter, ..hit })
    }

    fn closest_hit_near(&self, ray: &Ray) -> Option<Hit> {
        // Boxes and triangles must see the same ray, or a ray could pass between a box and its triangle.
        let (origin, direction) = (ray.origin.as_vec3(), ray.direction.as_vec3());
        let (distance, primitive) = self.path.run(Closest { mesh: self, origin, direction })?;
        let [a, b, c] = self.triangle(primitive);
        let normal = (b - a).cross(c - a).normalize();
        let near = ray.origin + distance * ray.direction;
        let position = near - normal.dot(near - a) * normal;
        Some(Hit { primitive, ..hit(ray, distance, position, normal) })
    }

    /// True when a triangle crosses the segment from `a` to `b`, ends excluded.
    pub(super) fn blocks(&self, a: Vec3, b: Vec3) -> bool {
        let (o, end) = (a.as_dvec3(), b.as_dvec3());
        if self.is_near(o) && self.is_near(end) {
            return self.path.run(Any { mesh: self, origin: a, direction: b - a });
        }
        let clipped = self.clip(o, end - o, 1.0);
        clipped.is_some_and(|(enter, leave)| {
            let (a, b) = ((o + enter * (end - o)).as_vec3(), (o + leave * (end - o)).as_vec3());
            self.path.run(Any { mesh: self, origin: a, direction: b - a })
        })
    }
}

/// A ray in f32 on its way through the boxes.
struct BoxRay<I: Isa> {
    origin: [I::Eight; 3],
    inverse: [I::Eight; 3],
}

impl<I: Isa> BoxRay<I> {
    #[inline(always)]
    fn new(origin: Vec3, direction: Vec3) -> Self {
        BoxRay { origin: splat::<I>(origin.to_array()), inverse: splat::<I>((1.0 / direction).to_array()) }
    }

    /// The boxes of `node` that the ray meets before `end`, and when.
    #[inline(always)]
    fn meets(&self, node: &Node, end: f32) -> (u32, [f32; WIDTH]) {
        let (mut enter, mut leave) = (I::Eight::splat(0.0), I::Eight::splat(end));
        for axis in 0..3 {
            let low = I::Eight::load(&node.low[axis]).sub(self.origin[axis]).mul(self.inverse[axis]);
            let high = I::Eight::load(&node.high[axis]).sub(self.origin[axis]).mul(self.inverse[axis]);
            enter = low.min(high).max(enter);
            leave = low.max(high).min(leave);
        }
        let mut times = [0.0; WIDTH];
        enter.store(&mut times);
        (!leave.less(enter.mul(I::Eight::splat(1.0 - 1e-6))) & node.boxes, times)
    }
}

/// The triangles of box `slot` of `node` that the ray from `origin` along `direction` may cross.
#[inline(always)]
fn candidates<I: Isa>(mesh: &Mesh, node: &Node, slot: usize, origin: Vec3, direction: Vec3) -> (usize, u32) {
    let (apex, d) = (origin.to_array(), direction.to_array());
    let extent = Extent::new(apex, node, slot);
    let number = node.child[slot];
    let block = &mesh.blocks[number as usize];
    let planes = Planes::<I>::new(block, apex, extent, &Directions::new(d, d), mesh.floor);
    let there = (1u32 << node.triangles[slot]) - 1;
    (mesh.bvh.firsts[number as usize] as usize, planes.along(d) & there)
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

/// Nodes that wait for a ray; memory is asked for only in hierarchies of unusual depth.
type Stack<T> = SmallVec<[T; 96]>;

/// The nearest triangle along a ray: distance and primitive.
struct Closest<'a> {
    mesh: &'a Mesh,
    origin: Vec3,
    direction: Vec3,
}

impl Kernel for Closest<'_> {
    type Output = Option<(f64, u32)>;

    #[inline(always)]
    fn run<I: Isa>(self) -> Option<(f64, u32)> {
        let Closest { mesh, origin, direction } = self;
        let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
        let ray = BoxRay::<I>::new(origin, direction);
        let mut best: Option<(f64, u32)> = None;
        // A box that begins at this very distance may hold a lower primitive number, hence the rounding up.
        let mut end = f32::INFINITY;
        let mut stack: Stack<(f32, u32)> = Stack::new();
        if !mesh.is_empty() {
            stack.push((0.0, 0));
        }
        while let Some((time, number)) = stack.pop() {
            if time > end {
                continue;
            }
            let node = &mesh.bvh.nodes[number as usize];
            let (met, times) = ray.meets(node, end);
            for slot in bits(met & node.blocks) {
                let (first, may) = candidates::<I>(mesh, node, slot, origin, direction);
                for lane in bits(may) {
                    let triangle = &mesh.triangles[first + lane];
                    let limit = best.map_or(f64::INFINITY, |(t, _)| t);
                    let Some(t) = triangle.intersect(o, d, limit) else { continue };
                    if best.is_none_or(|b| (t, triangle.primitive) < b) {
                        best = Some((t, triangle.primitive));
                        end = (t * (1.0 + 1e-6)) as f32;
                    }
                }
            }
            push_sorted(&mut stack, bits(met & !node.blocks).map(|slot| (times[slot], node.child[slot])));
        }
        best
    }
}

/// Pushes nodes, the nearest last.
#[inline(always)]
fn push_sorted(stack: &mut Stack<(f32, u32)>, nodes: impl Iterator<Item = (f32, u32)>) {
    let bottom = stack.len();
    for node in nodes {
        stack.push(node);
        let mut at = stack.len() - 1;
        while at > bottom && stack[at - 1].0 < node.0 {
            stack.swap(at - 1, at);
            at -= 1;
        }
    }
}

/// Whether any triangle crosses a segment.
struct Any<'a> {
    mesh: &'a Mesh,
    origin: Vec3,
    direction: Vec3,
}

impl Kernel for Any<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<I: Isa>(self) -> bool {
        let Any { mesh, origin, direction } = self;
        let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
        let ray = BoxRay::<I>::new(origin, direction);
        let mut stack: Stack<u32> = Stack::new();
        if !mesh.is_empty() {
            stack.push(0);
        }
        while let Some(number) = stack.pop() {
            let node = &mesh.bvh.nodes[number as usize];
            let (met, _) = ray.meets(node, 1.0);
            for slot in bits(met & node.blocks) {
                let (first, may) = candidates::<I>(mesh, node, slot, origin, direction);
                if bits(may).any(|lane| mesh.triangles[first + lane].crosses(o, d)) {
                    return true;
                }
            }
            stack.extend(bits(met & !node.blocks).map(|slot| node.child[slot]));
        }
        false
    }
}

impl Triangle {
    #[cfg(test)]
    pub(super) fn new(corners: [Vec3; 3]) -> Self {
        Triangle { corners, primitive: 0 }
    }

    /// Parameter 0 < t <= limit at which the line o + t d crosses the triangle, edges included.
    ///
    /// A line in the triangle's very plane has only roundings for t and for sides, and could seem to cross anywhere. So the
    /// crossing must lie in the box around the triangle, give or take [`AROUND`]: then no test of a box, which is
    /// inflated by more, can contradict, and the answer is the same by whatever way through the hierarchy.
    #[inline(always)]
    fn intersect(&self, o: DVec3, d: DVec3, limit: f64) -> Option<f64> {
        let [a, b, c] = self.corners.map(|p| p.as_dvec3());
        let normal = (b - a).cross(c - a);
        let t = (normal.dot(a) - normal.dot(o)) / normal.dot(d);
        // Edge-on the quotient is infinite or undefined: a triangle seen edge-on is not there.
        if !(t > 0.0 && t <= limit && t.is_finite()) {
            return None;
        }
        let (a, b, c) = (a - o, b - o, c - o);
        let edges = [d.dot(c.cross(b)), d.dot(a.cross(c)), d.dot(b.cross(a))];
        let one_side = edges.iter().all(|&e| e >= 0.0) || edges.iter().all(|&e| e <= 0.0);
        if !one_side {
            return None;
        }
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let (at, around) = (t * d, AROUND * low.abs().max(high.abs()).max_element());
        (at.cmpge(low - around).all() && at.cmple(high + around).all()).then_some(t)
    }

    /// True when the segment from `o` along `d` crosses the triangle, edges included and ends excluded.
    #[inline(always)]
    pub(super) fn crosses(&self, o: DVec3, d: DVec3) -> bool {
        self.intersect(o, d, 1.0).is_some_and(|t| t < 1.0)
    }
}
