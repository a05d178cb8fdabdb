//! Eight triangles as planes through an apex: which of them rays from there may cross, and which they surely do.
//!
//! Seen from the apex o, with a = A - o and so on, a segment from o along d crosses the triangle ABC where
//!
//! ```text
//! E_0 = d . (b x c) >= 0,  E_1 = d . (c x a) >= 0,  E_2 = d . (a x b) >= 0,   and  N . d > N . a = V
//! ```
//!
//! for V > 0; for V < 0 all signs turn round. 2 b x c is computed as (b + c) x (C - B), whose error is in proportion to the
//! length of the edge.
//!
//! This is a filter: the answer is [`super::mesh::Triangle::intersect`], in f64. With u = 2^-24, M the largest coordinate of a,
//! b, c, L that of the edges, and S = |d_x| + |d_y| + |d_z|, first-order analysis of the roundings in f32 gives
//!
//! ```text
//! |error of 2 E_k| <= 32 u M L S      |error of N . d| <= 4 u |N||d|      |error of V| <= 5 u |N||a|      N a unit vector
//! ```
//!
//! (4 u M for b + c, u L for an edge, 20 u M L for each coordinate of their product, 12 u M L S for the scalar product; N is
//! rounded once from f64.) A test of a whole box of directions adds one rounding of its sum: 36 u M L S, and 5 u |N||d|.
//! The tolerances used are 48 u M L S and 5.1 u (|a| + |d|), and a little for what f64 rounds. What they leave undecided is
//! asked of f64, and so is everything about a triangle whose V has no certain sign: a wrong answer is impossible and the
//! instructions used do not matter. (A search that climbs towards the largest errors finds 13 and 3.5 where the bounds are 32
//! and 5, see the tests.)
//!
//! A lifted point lies 16 u (max |p| + D) off its own surface, D the diagonal of the geometry: more than 10.2 u D, so the
//! surface that a receiver stands on never needs f64.

mod before;

use super::bvh::{Node, WIDTH};
use super::simd::{Isa, Vector};
use crate::math::Vec3;

/// Half the distance between 1 and the next f32.
pub(super) const U: f32 = 1.0 / (1 << 24) as f32;
/// Tolerance of the edges in units of u M L S.
const EDGE: f32 = 48.0 * U;
/// Tolerance of the face in units of |a| + |d|.
pub(super) const FACE: f32 = 5.1 * U;
/// What f64 itself rounds: 28 2^-53 M^2 S.
const EDGE_F64: f32 = U * U;
/// Keeps tolerances above what underflow loses.
const TINY: f32 = 1e-36;

/// Eight triangles as a structure of arrays, the corners by corner, axis and lane; unused lanes repeat the first.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Block {
    pub(super) corners: [[[f32; WIDTH]; 3]; 3],
    /// Unit normals, the cross products of f64 rounded; 0 for a triangle without area.
    pub(super) normal: [[f32; WIDTH]; 3],
}

impl Block {
    pub(super) fn new(triangles: &[[Vec3; 3]]) -> Self {
        let mut block = Block { corners: [[[0.0; WIDTH]; 3]; 3], normal: [[0.0; WIDTH]; 3] };
        for lane in 0..WIDTH {
            let corners = triangles.get(lane).unwrap_or(&triangles[0]);
            let [a, b, c] = corners.map(|p| p.as_dvec3());
            let normal = (b - a).cross(c - a);
            // Scaled first: the square of a tiny number is zero.
            let normal = (normal / normal.abs().max_element()).normalize_or_zero().as_vec3();
            for axis in 0..3 {
                block.normal[axis][lane] = if normal.is_finite() { normal[axis] } else { 0.0 };
                for (corner, p) in corners.iter().enumerate() {
                    block.corners[corner][axis][lane] = p[axis];
                }
            }
        }
        block
    }

    /// The triangle in `lane`.
    #[inline(always)]
    pub(super) fn triangle(&self, lane: usize) -> [Vec3; 3] {
        let corner = |[x, y, z]: &[[f32; WIDTH]; 3]| Vec3::new(x[lane], y[lane], z[lane]);
        [corner(&self.corners[0]), corner(&self.corners[1]), corner(&self.corners[2])]
    }
}

/// A box of directions from the apex, by centre and half extent \[m\]: every d of a bundle lies inside.
#[derive(Clone, Copy, Debug)]
pub(super) struct Directions {
    pub(super) center: [f32; 3],
    pub(super) half: [f32; 3],
    /// An upper bound of S.
    pub(super) sum: f32,
    /// An upper bound of |d| \[m\].
    pub(super) length: f32,
}

impl Directions {
    /// The box from `low` to `high`, corner by corner.
    #[inline(always)]
    pub(super) fn new(low: [f32; 3], high: [f32; 3]) -> Self {
        let mut d = Directions { center: [0.0; 3], half: [0.0; 3], sum: 0.0, length: 0.0 };
        let mut squares = 0.0;
        for axis in 0..3 {
            let far = low[axis].abs().max(high[axis].abs());
            d.center[axis] = 0.5 * (low[axis] + high[axis]);
            // Wide enough for the rounding of both.
            d.half[axis] = 0.5 * (high[axis] - low[axis]) * (1.0 + 4.0 * U) + 4.0 * U * far;
            d.sum += far;
            squares += far * far;
        }
        d.length = squares.sqrt();
        d
    }
}

impl Directions {
    /// From `apex` to the points of the box from `low` to `high`.
    #[inline(always)]
    pub(super) fn between(apex: [f32; 3], low: [f32; 3], high: [f32; 3]) -> Self {
        // Rounding is monotonic: every d of the bundle, rounded in the same way, lies between these.
        let [least, most] = [low, high].map(|p| [p[0] - apex[0], p[1] - apex[1], p[2] - apex[2]]);
        Directions::new(least, most)
    }
}

/// How large the corners of a block are, seen from the apex.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    /// An upper bound of |a|, |b|, |c| \[m\].
    far: f32,
    /// M.
    size: f32,
    /// L.
    edge: f32,
}

impl Extent {
    /// Of the block in box `slot` of `node`.
    #[inline(always)]
    pub(super) fn new(apex: [f32; 3], node: &Node, slot: usize) -> Self {
        let (mut size, mut edge, mut squares) = (0.0f32, 0.0f32, 0.0f32);
        for axis in 0..3 {
            let (low, high) = (node.low[axis][slot], node.high[axis][slot]);
            let far = (low - apex[axis]).abs().max((high - apex[axis]).abs());
            size = size.max(far);
            edge = edge.max(high - low);
            squares += far * far;
        }
        Extent { far: squares.sqrt(), size, edge }
    }
}

/// The planes of a block for one apex; lanes are triangles.
pub(super) struct Planes<I: Isa> {
    /// Normals of the planes through the apex and the edges, turned so that inside is positive.
    edges: [[I::Eight; 3]; 3],
    /// N, turned away from the apex.
    face: [I::Eight; 3],
    /// |V|, the distance of the plane from the apex.
    volume: I::Eight,
    /// Bit i: V of triangle i has no certain sign.
    doubtful: u32,
    edge_tolerance: f32,
    face_tolerance: f32,
}

/// Of eight triangles, the ones that some direction of a box may cross, and those that all surely do.
#[derive(Clone, Copy, Debug)]
pub(super) struct Against {
    pub(super) may: u32,
    pub(super) cover: u32,
}

impl<I: Isa> Planes<I> {
    /// The planes of `block`, of size `extent`, for rays from `apex` in `directions`; `floor` is what f64 rounds of
    /// coordinates \[m\].
    #[inline(always)]
    pub(super) fn new(block: &Block, apex: [f32; 3], extent: Extent, directions: &Directions, floor: f32) -> Self {
        let [a, b, c] = &block.corners;
        let (a, b, c) = (load::<I>(a), load::<I>(b), load::<I>(c));
        let o = [I::Eight::splat(apex[0]), I::Eight::splat(apex[1]), I::Eight::splat(apex[2])];
        let (x, y, z) = (sub::<I>(a, o), sub::<I>(b, o), sub::<I>(c, o));
        let edges = [
            cross::<I>(add::<I>(y, z), sub::<I>(c, b)),
            cross::<I>(add::<I>(z, x), sub::<I>(a, c)),
            cross::<I>(add::<I>(x, y), sub::<I>(b, a)),
        ];
        let face = load::<I>(&block.normal);
        let volume = dot::<I>(face, x);
        let Extent { far, size, edge } = extent;
        Planes {
            edges: [turn::<I>(edges[0], volume), turn::<I>(edges[1], volume), turn::<I>(edges[2], volume)],
            face: turn::<I>(face, volume),
            volume: volume.abs(),
            doubtful: volume.abs().less(I::Eight::splat(FACE * far + floor)),
            edge_tolerance: (EDGE * edge + EDGE_F64 * size) * size * directions.sum + TINY,
            face_tolerance: FACE * (far + directions.length) + floor,
        }
    }

    /// All directions of a box at once.
    #[inline(always)]
    pub(super) fn against(&self, directions: &Directions) -> Against {
        let center = splat::<I>(directions.center);
        let half = splat::<I>(directions.half);
        let (mut miss, mut cover) = (0, u32::MAX);
        let tolerance = I::Eight::splat(self.edge_tolerance);
        let negative = I::Eight::splat(-self.edge_tolerance);
        for edge in &self.edges {
            let (middle, spread) = (dot::<I>(*edge, center), dot::<I>(abs::<I>(*edge), half));
            miss |= middle.add(spread).less(negative);
            cover &= tolerance.less(middle.sub(spread));
        }
        let (middle, spread) = (dot::<I>(self.face, center), dot::<I>(abs::<I>(self.face), half));
        // The distance goes off first: what that rounds is in proportion to the difference, not to the distance.
        miss |= middle.add(spread).sub(self.volume).less(I::Eight::splat(-self.face_tolerance));
        cover &= I::Eight::splat(self.face_tolerance).less(middle.sub(spread).sub(self.volume));
        Against { may: !miss | self.doubtful, cover: cover & !self.doubtful }
    }

    /// The triangles that some ray in a box of directions, of any length, may cross.
    #[inline(always)]
    pub(super) fn toward(&self, directions: &Directions) -> u32 {
        let center = splat::<I>(directions.center);
        let half = splat::<I>(directions.half);
        let negative = I::Eight::splat(-self.edge_tolerance);
        let mut miss = 0;
        for edge in &self.edges {
            let (middle, spread) = (dot::<I>(*edge, center), dot::<I>(abs::<I>(*edge), half));
            miss |= middle.add(spread).less(negative);
        }
        !miss | self.doubtful
    }

    /// The segment along `d` against all triangles.
    #[inline(always)]
    pub(super) fn test(&self, d: [f32; 3]) -> Decided {
        let d = splat::<I>(d);
        let [first, second, third] = &self.edges;
        let inside = dot::<I>(*first, d).min(dot::<I>(*second, d)).min(dot::<I>(*third, d));
        let beyond = dot::<I>(self.face, d).sub(self.volume);
        let (edge, face) = (self.edge_tolerance, self.face_tolerance);
        let miss = inside.less(I::Eight::splat(-edge)) | beyond.less(I::Eight::splat(-face));
        let hit = I::Eight::splat(edge).less(inside) & I::Eight::splat(face).less(beyond);
        Decided { miss: miss & !self.doubtful, hit: hit & !self.doubtful }
    }

    /// To memory, from where single triangles are taken.
    #[inline(always)]
    pub(super) fn store(&self, rows: &mut Rows) {
        for axis in 0..3 {
            for edge in 0..3 {
                self.edges[edge][axis].store(&mut rows.edges[edge][axis]);
            }
            self.face[axis].store(&mut rows.face[axis]);
        }
        self.volume.store(&mut rows.volume);
        (rows.edge_tolerance, rows.face_tolerance) = (self.edge_tolerance, self.face_tolerance);
        rows.doubtful = self.doubtful;
    }
}

/// [`Planes`] in memory.
#[derive(Default)]
pub(super) struct Rows {
    edges: [[[f32; WIDTH]; 3]; 3],
    face: [[f32; WIDTH]; 3],
    volume: [f32; WIDTH],
    doubtful: u32,
    edge_tolerance: f32,
    face_tolerance: f32,
}

/// Of 16 rays, the ones that surely miss a triangle and those that surely cross it; f64 decides the rest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Decided {
    pub(super) miss: u32,
    pub(super) hit: u32,
}

impl Rows {
    /// The planes again, with the tolerances of the directions that they were made for.
    #[inline(always)]
    pub(super) fn planes<I: Isa>(&self) -> Planes<I> {
        let [first, second, third] = &self.edges;
        Planes {
            edges: [load::<I>(first), load::<I>(second), load::<I>(third)],
            face: load::<I>(&self.face),
            volume: I::Eight::load(&self.volume),
            doubtful: self.doubtful,
            edge_tolerance: self.edge_tolerance,
            face_tolerance: self.face_tolerance,
        }
    }

    /// The triangle in `lane` against 16 rays along `d`.
    #[inline(always)]
    pub(super) fn test<I: Isa>(&self, lane: usize, d: &[I::Sixteen; 3]) -> Decided {
        if self.doubtful >> lane & 1 == 1 {
            return Decided { miss: 0, hit: 0 };
        }
        let [first, second, third] = &self.edges;
        let inside = along::<I>(first, lane, d).min(along::<I>(second, lane, d)).min(along::<I>(third, lane, d));
        let beyond = along::<I>(&self.face, lane, d).sub(I::Sixteen::splat(self.volume[lane]));
        let (edge, face) = (self.edge_tolerance, self.face_tolerance);
        let miss = inside.less(I::Sixteen::splat(-edge)) | beyond.less(I::Sixteen::splat(-face));
        let hit = I::Sixteen::splat(edge).less(inside) & I::Sixteen::splat(face).less(beyond);
        Decided { miss, hit }
    }

    /// The triangle in `lane` against 16 rays along unit vectors `d`.
    #[inline(always)]
    pub(super) fn meets<I: Isa>(&self, lane: usize, d: &[I::Sixteen; 3]) -> Meeting<I> {
        let [first, second, third] = &self.edges;
        let inside = along::<I>(first, lane, d).min(along::<I>(second, lane, d)).min(along::<I>(third, lane, d));
        let toward = along::<I>(&self.face, lane, d);
        let (edge, face, volume) = (I::Sixteen::splat(self.edge_tolerance), self.face_tolerance, self.volume[lane]);
        let slope = I::Sixteen::splat(FACE);
        let miss = inside.less(I::Sixteen::splat(-self.edge_tolerance)) | toward.less(I::Sixteen::splat(-FACE));
        let early = I::Sixteen::splat((volume - face) * (1.0 - 8.0 * U)).div(toward.add(slope));
        let late = I::Sixteen::splat((volume + face) * (1.0 + 8.0 * U)).div(toward.sub(slope));
        if self.doubtful >> lane & 1 == 1 {
            return Meeting { may: u32::MAX, sure: 0, early, late };
        }
        Meeting { may: !miss, sure: edge.less(inside) & slope.less(toward), early, late }
    }
}

/// How 16 rays meet a triangle: the ones that may cross it, and the ones that surely do, at distances between `early` and `late`.
#[derive(Clone, Copy)]
pub(super) struct Meeting<I: Isa> {
    pub(super) may: u32,
    pub(super) sure: u32,
    pub(super) early: I::Sixteen,
    pub(super) late: I::Sixteen,
}

/// The scalar products of one normal with 16 directions.
#[inline(always)]
fn along<I: Isa>(normals: &[[f32; WIDTH]; 3], lane: usize, d: &[I::Sixteen; 3]) -> I::Sixteen {
    let z = d[2].mul(I::Sixteen::splat(normals[2][lane]));
    let yz = d[1].mul_add(I::Sixteen::splat(normals[1][lane]), z);
    d[0].mul_add(I::Sixteen::splat(normals[0][lane]), yz)
}

#[inline(always)]
pub(super) fn load<I: Isa>(rows: &[[f32; WIDTH]; 3]) -> [I::Eight; 3] {
    [I::Eight::load(&rows[0]), I::Eight::load(&rows[1]), I::Eight::load(&rows[2])]
}

/// The same vector in all lanes.
#[inline(always)]
pub(super) fn splat<I: Isa>(v: [f32; 3]) -> [I::Eight; 3] {
    [I::Eight::splat(v[0]), I::Eight::splat(v[1]), I::Eight::splat(v[2])]
}

#[inline(always)]
fn add<I: Isa>(a: [I::Eight; 3], b: [I::Eight; 3]) -> [I::Eight; 3] {
    [a[0].add(b[0]), a[1].add(b[1]), a[2].add(b[2])]
}

#[inline(always)]
pub(super) fn sub<I: Isa>(a: [I::Eight; 3], b: [I::Eight; 3]) -> [I::Eight; 3] {
    [a[0].sub(b[0]), a[1].sub(b[1]), a[2].sub(b[2])]
}

#[inline(always)]
fn abs<I: Isa>(a: [I::Eight; 3]) -> [I::Eight; 3] {
    [a[0].abs(), a[1].abs(), a[2].abs()]
}

#[inline(always)]
fn turn<I: Isa>(a: [I::Eight; 3], sign: I::Eight) -> [I::Eight; 3] {
    [a[0].flip(sign), a[1].flip(sign), a[2].flip(sign)]
}

#[inline(always)]
pub(super) fn dot<I: Isa>(a: [I::Eight; 3], b: [I::Eight; 3]) -> I::Eight {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2].mul(b[2])))
}

#[inline(always)]
fn cross<I: Isa>(a: [I::Eight; 3], b: [I::Eight; 3]) -> [I::Eight; 3] {
    [a[1].mul_sub(b[2], a[2].mul(b[1])), a[2].mul_sub(b[0], a[0].mul(b[2])), a[0].mul_sub(b[1], a[1].mul(b[0]))]
}

#[cfg(test)]
mod tests;
