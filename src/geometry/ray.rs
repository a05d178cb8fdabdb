//! Single rays through the mesh: the closest triangle, and whether any is met.
//!
//! A ray asks eight boxes at once, and goes into the nearest first; then eight triangles at once, sheared so that it runs along
//! an axis z, the one nearest to its direction. With (x, y) the corners seen from there, the areas of the triangles between the
//! ray and each edge,
//!
//! ```text
//! U = c_x b_y - c_y b_x,   V = a_x c_y - a_y c_x,   W = b_x a_y - b_y a_x
//! ```
//!
//! have one sign where the line crosses the triangle. They are in f32 with a tolerance: where all three are certain, f64 only
//! computes the distance; where they are not, it decides too.
//!
//! With u = 2^-24, M an upper bound of how far the corners are along any axis, L the longest side of the box around them, and the
//! ray within 0.7 L of this box (boxes are inflated by more than half of what their tests round and allow), |x| and |y| are at
//! most 3.4 L. Their errors are 5 u M + 3.4 u L: 1 of x, 1 of z, 2 of the shear, 1 of the product where it is not fused, and that of
//! the result. Those of the areas are 4 x 3.4 L times that, and 4 u (3.4 L)^2 for their own rounding: 68 u M L + 93 u L^2. What
//! f64 rounds is far less. The tolerance is 72 u M L + 96 u L^2.

use super::bvh::{Node, WIDTH};
use super::mesh::{Face, Leaf, Mesh, Open, Triangle, bits};
use super::planes::{Block, U, splat};
use super::simd::{Isa, Kernel, Vector};
use super::{Hit, Ray};
use crate::math::{DVec3, Vec3};
use smallvec::SmallVec;
use std::hint::black_box;

/// Stands for 0 where one divides by a coordinate of a direction: far below what boxes are inflated by.
const NIL: f32 = 1e-20;

/// The axes with the one that a ray runs along last.
const ORDERS: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];

/// A ray in f32 on its way through the boxes.
struct BoxRay<I: Isa> {
    inverse: [I::Eight; 3],
    /// Origin times inverse.
    shift: [I::Eight; 3],
    /// By axis: the ray goes towards lower coordinates.
    falls: [bool; 3],
}

impl<I: Isa> BoxRay<I> {
    #[inline(always)]
    fn new(origin: Vec3, direction: Vec3) -> Self {
        let inverse = |d: f32| 1.0 / (if d.abs() > NIL { d.abs() } else { NIL }).copysign(d);
        let inverse = [inverse(direction.x), inverse(direction.y), inverse(direction.z)];
        let shift = [origin.x * inverse[0], origin.y * inverse[1], origin.z * inverse[2]];
        let falls = [inverse[0] < 0.0, inverse[1] < 0.0, inverse[2] < 0.0];
        BoxRay { inverse: splat::<I>(inverse), shift: splat::<I>(shift), falls }
    }

    /// The boxes of `node` that the ray meets before `end`, and when.
    #[inline(always)]
    fn meets(&self, node: &Node, end: f32) -> (u32, [f32; WIDTH]) {
        let (mut enter, mut leave) = (I::Eight::splat(0.0), I::Eight::splat(end));
        for axis in 0..3 {
            let (low, high) = (&node.low[axis], &node.high[axis]);
            let (near, far) = if self.falls[axis] { (high, low) } else { (low, high) };
            enter = I::Eight::load(near).mul_sub(self.inverse[axis], self.shift[axis]).max(enter);
            leave = I::Eight::load(far).mul_sub(self.inverse[axis], self.shift[axis]).min(leave);
        }
        let mut times = [0.0; WIDTH];
        enter.store(&mut times);
        (!leave.less(enter.mul(I::Eight::splat(1.0 - 1e-6))) & node.boxes, times)
    }
}

/// Of eight triangles, the ones whose inside a line may cross, and the ones that it surely does.
struct Crossed {
    may: u32,
    sure: u32,
}

/// A ray in f32 on its way through the triangles, its coordinates in the order x, y, z of the sheared space.
struct Sight<I: Isa> {
    axes: [usize; 3],
    origin: [I::Eight; 3],
    /// What x and y lose per z.
    shear: [I::Eight; 2],
    /// |d|, a little more.
    length: f32,
}

impl<I: Isa> Sight<I> {
    /// Along a direction that is `length` long.
    #[inline(always)]
    fn new(origin: Vec3, direction: Vec3, length: f32) -> Self {
        let size = direction.abs();
        let steep = usize::from(size.z > size.x && size.z > size.y);
        let axes = ORDERS[2 * steep + (1 - steep) * usize::from(size.y > size.x)];
        // In memory an index is no branch; which axis it is nobody can predict.
        let (o, d) = (black_box(origin.to_array()), black_box(direction.to_array()));
        let slope = -1.0 / d[axes[2]];
        Sight {
            axes,
            origin: splat::<I>([o[axes[0]], o[axes[1]], o[axes[2]]]),
            shear: [I::Eight::splat(d[axes[0]] * slope), I::Eight::splat(d[axes[1]] * slope)],
            length: length * (1.0 + 8.0 * U),
        }
    }

    /// The triangles of a block, whose box the ray enters at `time`.
    #[inline(always)]
    fn crosses(&self, block: &Block, leaf: Leaf, time: f32) -> Crossed {
        let [a, b, c] = [self.seen(block, 0), self.seen(block, 1), self.seen(block, 2)];
        let [u, v, w] = [area::<I>(&c, &b), area::<I>(&a, &c), area::<I>(&b, &a)];
        let (least, most) = (u.min(v).min(w), u.max(v).max(w));
        let far = time * self.length + 2.0 * leaf.edge;
        let tolerance = (72.0 * far + 96.0 * leaf.edge) * leaf.edge * U;
        let (above, below) = (I::Eight::splat(tolerance), I::Eight::splat(-tolerance));
        let outside = least.less(below) & above.less(most);
        let inside = above.less(least) | most.less(below);
        Crossed { may: !outside & leaf.lanes, sure: inside }
    }

    #[inline(always)]
    fn seen(&self, block: &Block, corner: usize) -> Corner<I> {
        let rows = &block.corners[corner];
        let from = |k: usize| I::Eight::load(&rows[self.axes[k]]).sub(self.origin[k]);
        let z = from(2);
        Corner { x: z.mul_add(self.shear[0], from(0)), y: z.mul_add(self.shear[1], from(1)) }
    }
}

/// Corners of eight triangles across a ray.
struct Corner<I: Isa> {
    x: I::Eight,
    y: I::Eight,
}

#[inline(always)]
fn area<I: Isa>(p: &Corner<I>, q: &Corner<I>) -> I::Eight {
    p.x.mul_sub(q.y, p.y.mul(q.x))
}

/// The same ray, its coordinates read one by one: the processor waits for the caller to have written them where it wrote them in
/// pairs and they are read in others.
#[inline(always)]
fn one_by_one(ray: &Ray) -> Ray {
    let read = |v: &DVec3| DVec3::new(black_box(v.x), black_box(v.y), black_box(v.z));
    Ray { origin: read(&ray.origin), direction: read(&ray.direction) }
}

/// The first triangle along a ray that starts near the mesh.
pub(super) struct Closest<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) ray: &'a Ray,
    /// How far it goes \[m\].
    pub(super) limit: f64,
}

impl Kernel for Closest<'_> {
    type Output = Option<Hit>;

    #[inline(always)]
    fn run<I: Isa>(self) -> Option<Hit> {
        let Closest { mesh, ray, limit } = self;
        let ray = one_by_one(ray);
        // Boxes and triangles must see the same ray, or it could pass between a box and its triangle.
        let (origin, direction) = (ray.origin.as_vec3(), ray.direction.as_vec3());
        let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
        let (boxes, sight) = (BoxRay::<I>::new(origin, direction), Sight::<I>::new(origin, direction, 1.0));
        let mut best = Best { distance: limit.min(f64::MAX), end: (limit * (1.0 + 1e-6)) as f32, found: None };
        let mut open = Open::default();
        let mut next = if mesh.is_empty() { None } else { Some(0) };
        loop {
            if let Some(number) = next.take() {
                let node = &mesh.bvh.nodes[number as usize];
                let (met, times) = boxes.meets(node, best.end);
                mesh.prefetch(node, met);
                open.push(number, met, &times);
            }
            let Some((time, number, slot)) = open.pop(best.end) else { break };
            let node = &mesh.bvh.nodes[number];
            let child = node.child[slot];
            if node.blocks >> slot & 1 == 0 {
                next = Some(child);
                continue;
            }
            let (block, leaf) = (&mesh.blocks[child as usize], mesh.leaves[child as usize]);
            let crossed = sight.crosses(block, leaf, time);
            for lane in bits(crossed.may) {
                let triangle =
                    Triangle { corners: block.triangle(lane), primitive: mesh.bvh.order[leaf.first as usize + lane] };
                best.offer(triangle, crossed.sure >> lane & 1 == 1, o, d);
            }
        }
        let (primitive, face) = best.found?;
        Some(face.hit(&ray, best.distance, primitive, face.unit()))
    }
}

/// The nearest triangle so far.
struct Best {
    distance: f64,
    /// The distance rounded up: a box that begins there may hold a lower primitive number.
    end: f32,
    found: Option<(u32, Face)>,
}

impl Best {
    /// Takes the triangle if the ray meets it before any other; where `inside`, its line surely crosses it.
    #[inline(always)]
    fn offer(&mut self, triangle: Triangle, inside: bool, o: DVec3, d: DVec3) {
        let face = triangle.face(o);
        let t = face.distance(d);
        // Edge-on the quotient is infinite or undefined.
        if !(t > 0.0 && t <= self.distance) || !(inside || triangle.is_crossed(o, d, t)) {
            return;
        }
        if t < self.distance || self.found.as_ref().is_none_or(|&(primitive, _)| triangle.primitive < primitive) {
            (self.distance, self.end) = (t, (t * (1.0 + 1e-6)) as f32);
            self.found = Some((triangle.primitive, face));
        }
    }
}

/// Whether any triangle crosses a segment, ends excluded.
pub(super) struct Any<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) origin: Vec3,
    pub(super) direction: Vec3,
}

impl Kernel for Any<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<I: Isa>(self) -> bool {
        let Any { mesh, origin, direction } = self;
        let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
        let length = direction.dot(direction).sqrt();
        // Of points that are all but one nothing is certain, and NaN says so.
        let length = if length > 1e-15 { length } else { f32::NAN };
        let (ray, sight) = (BoxRay::<I>::new(origin, direction), Sight::<I>::new(origin, direction, length));
        let mut open: SmallVec<[u32; 96]> = SmallVec::new();
        if !mesh.is_empty() {
            open.push(0);
        }
        while let Some(number) = open.pop() {
            let node = &mesh.bvh.nodes[number as usize];
            let (met, times) = ray.meets(node, 1.0);
            for slot in bits(met & node.blocks) {
                let child = node.child[slot] as usize;
                let (block, leaf) = (&mesh.blocks[child], mesh.leaves[child]);
                let crossed = sight.crosses(block, leaf, times[slot]);
                let blocks = |lane: usize| {
                    let triangle = Triangle { corners: block.triangle(lane), primitive: 0 };
                    let t = triangle.face(o).distance(d);
                    t > 0.0 && t < 1.0 && (crossed.sure >> lane & 1 == 1 || triangle.is_crossed(o, d, t))
                };
                if bits(crossed.may).any(blocks) {
                    return true;
                }
            }
            open.extend(bits(met & !node.blocks).map(|slot| node.child[slot]));
        }
        false
    }
}
