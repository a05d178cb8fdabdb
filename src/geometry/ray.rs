//! Single rays through the mesh: the closest triangle, and whether any is met.
//!
//! A ray asks eight boxes at once, and goes into the nearest first; then eight triangles at once. With (x, y) the corners across
//! the ray, in the frame of two unit vectors at right angles to it, the areas of the triangles between the ray and each edge,
//!
//! ```text
//! U = c_x b_y - c_y b_x,   V = a_x c_y - a_y c_x,   W = b_x a_y - b_y a_x
//! ```
//!
//! have one sign where the line crosses the triangle; N . a / N . d is where. Both are in f32 with certain bounds, so that f64
//! computes the distance of what is nearest, mostly one triangle, and is asked whether it is crossed at all only where the ray
//! passes an edge too closely.
//!
//! With u = 2^-24, M an upper bound of how far the corners are, L the longest side of the box around them, and the ray within L/2
//! of this box (boxes are inflated more than their test rounds), |x| and |y| are at most 2.3 L. Their errors are at most 14 u M: 1
//! of the corner, 6 of the scalar product, 6 because the frame is rounded and the ray not quite at right angles to it, 1 to spare.
//! Those of the areas are 4 x 2.3 L times that, and 4 u (2.3 L)^2 for their own rounding: 130 u M L + 24 u L^2. The errors of N . a and
//! N . d are those in [`super::planes`].

use super::bvh::{Node, WIDTH};
use super::mesh::{Face, Mesh, Open, bits};
use super::planes::{Block, FACE, U, dot, load, splat, sub};
use super::simd::{Isa, Kernel, Vector};
use super::{Hit, Ray};
use crate::math::{DVec3, Vec3};
use arrayvec::ArrayVec;
use smallvec::SmallVec;

/// Stands for 0 where one divides by a coordinate of a direction: far below what boxes are inflated by.
const NIL: f32 = 1e-20;

/// Tolerance of the areas in units of u M L.
const ACROSS: f32 = 130.0;

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

/// How a ray meets eight triangles: the ones that it may cross, and the ones that it surely does, at distances
/// between `early` and `late`, in lengths of its direction.
struct Meeting {
    may: u32,
    sure: u32,
    early: [f32; WIDTH],
    late: [f32; WIDTH],
}

/// A ray in f32 on its way through the triangles.
struct Sight<I: Isa> {
    origin: [I::Eight; 3],
    direction: [I::Eight; 3],
    /// Two unit vectors across the direction.
    across: [[I::Eight; 3]; 2],
    /// |d|, a little more.
    length: f32,
    floor: f32,
}

impl<I: Isa> Sight<I> {
    /// Along a direction that is `length` long.
    #[inline(always)]
    fn new(origin: Vec3, direction: Vec3, length: f32, floor: f32) -> Self {
        let Vec3 { x, y, z } = direction / length;
        // The frame of Duff et al. 2017.
        let sign = 1f32.copysign(z);
        let a = -1.0 / (sign + z);
        let b = x * y * a;
        let across = [[1.0 + sign * x * x * a, sign * b, -sign * x], [b, sign + y * y * a, -y]];
        Sight {
            origin: splat::<I>(origin.to_array()),
            direction: splat::<I>(direction.to_array()),
            across: [splat::<I>(across[0]), splat::<I>(across[1])],
            length: length * (1.0 + 8.0 * U),
            floor,
        }
    }

    /// Box `slot` of `node`, which the ray enters at `time`.
    #[inline(always)]
    fn meets(&self, block: &Block, node: &Node, slot: usize, time: f32) -> Option<Meeting> {
        let side = |axis: usize| node.high[axis][slot] - node.low[axis][slot];
        let greater = |a: f32, b: f32| if a > b { a } else { b };
        let edge = greater(greater(side(0), side(1)), side(2));
        let far = time * self.length + 2.0 * edge;
        let [a, b, c] = [self.seen(block, 0), self.seen(block, 1), self.seen(block, 2)];
        let [u, v, w] = [area::<I>(&c, &b), area::<I>(&a, &c), area::<I>(&b, &a)];
        let (least, most) = (u.min(v).min(w), u.max(v).max(w));
        let tolerance = (ACROSS * far + 24.0 * edge) * edge * U;
        let (above, below) = (I::Eight::splat(tolerance), I::Eight::splat(-tolerance));
        let outside = least.less(below) & above.less(most);
        let there = (1u32 << node.triangles[slot]) - 1;
        if !outside & there == 0 {
            return None;
        }
        let normal = load::<I>(&block.normal);
        let volume = dot::<I>(normal, a.from);
        let toward = dot::<I>(normal, self.direction).flip(volume);
        let volume = volume.abs();
        let face = I::Eight::splat(FACE * far + self.floor);
        let slope = I::Eight::splat(FACE * self.length);
        let doubtful = volume.less(face);
        let away = toward.less(I::Eight::splat(-FACE * self.length)) & !doubtful;
        let may = !(outside | away) & there;
        if may == 0 {
            return None;
        }
        let inside = above.less(least) | most.less(below);
        let (mut early, mut late) = ([0.0; WIDTH], [0.0; WIDTH]);
        volume.sub(face).mul(I::Eight::splat(1.0 - 8.0 * U)).div(toward.add(slope)).store(&mut early);
        volume.add(face).mul(I::Eight::splat(1.0 + 8.0 * U)).div(toward.sub(slope)).store(&mut late);
        Some(Meeting { may, sure: may & inside & !doubtful & slope.less(toward), early, late })
    }

    #[inline(always)]
    fn seen(&self, block: &Block, corner: usize) -> Corner<I> {
        let from = sub::<I>(load::<I>(&block.corners[corner]), self.origin);
        Corner { x: dot::<I>(from, self.across[0]), y: dot::<I>(from, self.across[1]), from }
    }
}

/// Corners of eight triangles, seen from the origin of a ray.
struct Corner<I: Isa> {
    from: [I::Eight; 3],
    x: I::Eight,
    y: I::Eight,
}

#[inline(always)]
fn area<I: Isa>(p: &Corner<I>, q: &Corner<I>) -> I::Eight {
    p.x.mul_sub(q.y, p.y.mul(q.x))
}

/// The first triangle along a ray that starts near the mesh.
pub(super) struct Closest<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) ray: &'a Ray,
}

impl Kernel for Closest<'_> {
    type Output = Option<Hit>;

    #[inline(always)]
    fn run<I: Isa>(self) -> Option<Hit> {
        let Closest { mesh, ray } = self;
        // Boxes and triangles must see the same ray, or it could pass between a box and its triangle.
        let (origin, direction) = (ray.origin.as_vec3(), ray.direction.as_vec3());
        let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
        let (boxes, sight) = (BoxRay::<I>::new(origin, direction), Sight::<I>::new(origin, direction, 1.0, mesh.floor));
        let mut candidates = Candidates { crossed: ArrayVec::new(), end: f32::INFINITY };
        let mut open = Open::default();
        let mut next = if mesh.is_empty() { None } else { Some(0) };
        loop {
            if let Some(number) = next.take() {
                let (met, times) = boxes.meets(&mesh.bvh.nodes[number as usize], candidates.end);
                open.push(number, met, &times);
            }
            let Some((time, number, slot)) = open.pop(candidates.end) else { break };
            let node = &mesh.bvh.nodes[number];
            let child = node.child[slot];
            if node.blocks >> slot & 1 == 0 {
                next = Some(child);
            } else if let Some(meeting) = sight.meets(&mesh.blocks[child as usize], node, slot, time) {
                candidates.add(mesh, mesh.bvh.firsts[child as usize], &meeting, o, d);
            }
        }
        let (t, primitive, face) = candidates.nearest(mesh, o, d)?;
        Some(face.hit(ray, t, primitive, face.unit()))
    }
}

/// Triangles that a ray crosses.
struct Candidates {
    /// Lower bounds of the distance, and places.
    crossed: ArrayVec<(f32, u32), 16>,
    /// An upper bound of the distance of the nearest.
    end: f32,
}

impl Candidates {
    /// Takes the triangles of a block from place `first` on.
    #[inline(always)]
    fn add(&mut self, mesh: &Mesh, first: u32, meeting: &Meeting, o: DVec3, d: DVec3) {
        for lane in bits(meeting.may) {
            let place = first + lane as u32;
            let (early, late) = match meeting.sure >> lane & 1 {
                1 => (meeting.early[lane], meeting.late[lane]),
                _ => match mesh.triangles[place as usize].intersect(o, d, f64::INFINITY) {
                    Some(t) => ((t * (1.0 - 1e-6)) as f32, (t * (1.0 + 1e-6)) as f32),
                    None => continue,
                },
            };
            if early <= self.end {
                self.end = if late < self.end { late } else { self.end };
                if self.crossed.is_full() {
                    self.decide(mesh, o, d);
                }
                self.crossed.push((early, place));
            }
        }
    }

    /// Keeps the nearest alone.
    #[cold]
    #[inline(never)]
    fn decide(&mut self, mesh: &Mesh, o: DVec3, d: DVec3) {
        let nearest =
            self.nearest(mesh, o, d).map(|(t, primitive, _)| ((t * (1.0 - 1e-6)) as f32, mesh.place(primitive)));
        self.crossed.clear();
        self.crossed.extend(nearest);
    }

    /// Distance, primitive and plane of the nearest, the lower primitive of equals.
    #[inline(always)]
    fn nearest(&self, mesh: &Mesh, o: DVec3, d: DVec3) -> Option<(f64, u32, Face)> {
        let mut best: Option<(f64, u32, Face)> = None;
        for &(early, place) in &self.crossed {
            if early <= self.end {
                let triangle = &mesh.triangles[place as usize];
                let face = triangle.face(o);
                let t = face.distance(d);
                if best.as_ref().is_none_or(|&(least, primitive, _)| (t, triangle.primitive) < (least, primitive)) {
                    best = Some((t, triangle.primitive, face));
                }
            }
        }
        best
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
        let (ray, sight) =
            (BoxRay::<I>::new(origin, direction), Sight::<I>::new(origin, direction, length, mesh.floor));
        let mut open: SmallVec<[u32; 96]> = SmallVec::new();
        if !mesh.is_empty() {
            open.push(0);
        }
        while let Some(number) = open.pop() {
            let node = &mesh.bvh.nodes[number as usize];
            let (met, times) = ray.meets(node, 1.0);
            for slot in bits(met & node.blocks) {
                let child = node.child[slot] as usize;
                let Some(meeting) = sight.meets(&mesh.blocks[child], node, slot, times[slot]) else { continue };
                let first = mesh.bvh.firsts[child] as usize;
                let crosses = |lane: usize| match meeting.sure >> lane & 1 == 1 && meeting.late[lane] < 1.0 {
                    true => true,
                    false => mesh.triangles[first + lane].crosses(o, d),
                };
                if bits(meeting.may).any(crosses) {
                    return true;
                }
            }
            open.extend(bits(met & !node.blocks).map(|slot| node.child[slot]));
        }
        false
    }
}
