//! The visibility kernel: one apex against a tile of up to 256 lifted points.
//!
//! Points of a tile lie close together, and so do their segments from a common apex. The tile is nested: 256 points in 4 groups
//! of 64 in 4 bundles of 16. The shaft around the segments of a tile finds the boxes that any of them may meet; the shafts of
//! its groups and bundles go on from there, and only a bundle looks at single segments:
//!
//! ```text
//! tile -> shaft against nodes -> candidates -> group -> shaft -> candidates -> bundle -> shaft, then 16 segments against
//! boxes -> 8 triangles as planes through the apex: all segments miss, all are blocked, or each is asked
//! ```
//!
//! Every step before a triangle is conservative and the planes leave to f64 what they cannot tell ([`super::planes`]), so the
//! answer for each point is that of [`Geometry::visible`], whatever the tile and the instructions.
//!
//! Planes and spheres are asked after the triangles, of the points that are left: on which side, or inside which, a point of the
//! tile lies is known beforehand. Another kind of surface fits in like these, or as triangles whose bits are
//! taken out of `hit` and given to f64 code of their own.

use super::bvh::{Node, WIDTH};
use super::mesh::{Mesh, bits};
use super::planes::{Extent, Planes, Rows};
use super::shaft::{Bundle, Shaft};
use super::simd::{Isa, Vector, prefetch};
use super::{Geometry, Sphere};
use crate::math::{DVec3, Vec3};
use arrayvec::ArrayVec;
use smallvec::SmallVec;

/// Points of a tile.
pub const TILE: usize = 256;
/// Points of a bundle: the lanes of a vector.
pub const BUNDLE: usize = 16;
/// Bundles of a tile.
pub const BUNDLES: usize = TILE / BUNDLE;
/// Bundles of a group.
const GROUP: usize = 4;
/// Nodes that a shaft hands down, at most.
const CANDIDATES: usize = 64;
/// Nodes that the shaft of a tile or a group opens: beyond that its groups or bundles go on alone.
const OPENED: usize = 4;
/// Blocks whose triangles the shaft of a tile or a group tests at once, at most.
const FEW: u32 = 4;

/// For each bundle of a tile, a bit for each of its points.
pub type Lanes = [u16; BUNDLES];

/// A box between two corners \[m\].
type Corners = ([f32; 3], [f32; 3]);

/// Up to [`TILE`] lifted points, as the kernel wants them.
#[derive(Debug)]
pub struct Points {
    x: [[f32; BUNDLE]; BUNDLES],
    y: [[f32; BUNDLE]; BUNDLES],
    z: [[f32; BUNDLE]; BUNDLES],
    tile: Corners,
    groups: [Corners; BUNDLES / GROUP],
    bundles: [Corners; BUNDLES],
    /// Points so far from the mesh that they go through it alone.
    far: Lanes,
    /// Of each plane, the points in front of it and those behind it.
    sides: Vec<[Lanes; 2]>,
    /// Of each sphere, the points inside.
    inside: Vec<Lanes>,
}

impl Points {
    /// The tile of `points`, at most [`TILE`] \[m\].
    pub fn new(geometry: &Geometry, points: &[Vec3]) -> Self {
        let empty = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        let mut tile = Points {
            x: [[0.0; BUNDLE]; BUNDLES],
            y: [[0.0; BUNDLE]; BUNDLES],
            z: [[0.0; BUNDLE]; BUNDLES],
            tile: empty,
            groups: [empty; BUNDLES / GROUP],
            bundles: [empty; BUNDLES],
            far: [0; BUNDLES],
            sides: Vec::new(),
            inside: Vec::new(),
        };
        for (i, &point) in points.iter().enumerate() {
            let (bundle, lane) = (i / BUNDLE, i % BUNDLE);
            (tile.x[bundle][lane], tile.y[bundle][lane], tile.z[bundle][lane]) = point.into();
            if geometry.mesh.is_near(point.as_dvec3()) {
                for corners in [&mut tile.tile, &mut tile.groups[bundle / GROUP], &mut tile.bundles[bundle]] {
                    include(corners, point);
                }
            } else {
                tile.far[bundle] |= 1 << lane;
            }
        }
        let where_true = |is: &dyn Fn(DVec3) -> bool| {
            let mut lanes = [0; BUNDLES];
            for (i, point) in points.iter().enumerate() {
                lanes[i / BUNDLE] |= u16::from(is(point.as_dvec3())) << (i % BUNDLE);
            }
            lanes
        };
        let sides = |p: &super::Plane| [where_true(&|q| p.height(q) > 0.0), where_true(&|q| p.height(q) < 0.0)];
        tile.sides = geometry.planes.iter().map(sides).collect();
        tile.inside = geometry.spheres.iter().map(|s| where_true(&|q| s.contains(q))).collect();
        tile
    }

    /// A point of the tile \[m\].
    #[inline(always)]
    fn point(&self, bundle: usize, lane: usize) -> Vec3 {
        Vec3::new(self.x[bundle][lane], self.y[bundle][lane], self.z[bundle][lane])
    }

    /// The segments from `apex` to the points of a bundle.
    #[inline(always)]
    fn segments<I: Isa>(&self, bundle: usize, apex: [f32; 3]) -> [I::Sixteen; 3] {
        [
            I::Sixteen::load(&self.x[bundle]).sub(I::Sixteen::splat(apex[0])),
            I::Sixteen::load(&self.y[bundle]).sub(I::Sixteen::splat(apex[1])),
            I::Sixteen::load(&self.z[bundle]).sub(I::Sixteen::splat(apex[2])),
        ]
    }
}

fn include(corners: &mut Corners, point: Vec3) {
    for axis in 0..3 {
        corners.0[axis] = corners.0[axis].min(point[axis]);
        corners.1[axis] = corners.1[axis].max(point[axis]);
    }
}

impl Geometry {
    /// Clears the bits of the points in `seen` that `apex` does not see.
    #[inline(always)]
    pub fn shadow<I: Isa>(&self, apex: Vec3, points: &Points, seen: &mut Lanes, scratch: &mut Scratch) {
        if !self.mesh.is_empty() {
            self.mesh.shadow::<I>(apex, points, seen, scratch);
        }
        let far = apex.as_dvec3();
        for (plane, [front, behind]) in self.planes.iter().zip(&points.sides) {
            let height = plane.height(far);
            let blocked = if height > 0.0 { Some(behind) } else { (height < 0.0).then_some(front) };
            if let Some(blocked) = blocked {
                seen.iter_mut().zip(blocked).for_each(|(seen, blocked)| *seen &= !blocked);
            }
        }
        for (sphere, inside) in self.spheres.iter().zip(&points.inside) {
            shadow_of_sphere(sphere, apex, points, inside, seen);
        }
    }
}

#[inline(always)]
fn shadow_of_sphere(sphere: &Sphere, apex: Vec3, points: &Points, inside: &Lanes, seen: &mut Lanes) {
    let contained = sphere.contains(apex.as_dvec3());
    for (bundle, seen) in seen.iter_mut().enumerate() {
        if contained {
            *seen &= inside[bundle];
            continue;
        }
        *seen &= !inside[bundle];
        for lane in bits(u32::from(*seen)) {
            *seen &= !(u16::from(sphere.blocks(apex, points.point(bundle, lane))) << lane);
        }
    }
}

impl Mesh {
    #[inline(always)]
    fn shadow<I: Isa>(&self, apex: Vec3, points: &Points, seen: &mut Lanes, scratch: &mut Scratch) {
        if !self.is_near(apex.as_dvec3()) {
            return self.shadow_one_by_one(apex, points, &[u16::MAX; BUNDLES], seen);
        }
        let alone = points.far != [0; BUNDLES];
        if alone {
            self.shadow_one_by_one(apex, points, &points.far, seen);
        }
        let mut near = *seen;
        near.iter_mut().zip(&points.far).for_each(|(near, far)| *near &= !far);
        let mut descent = Descent { mesh: self, points, apex: apex.to_array(), scratch };
        descent.tile::<I>(&mut near);
        for ((seen, near), far) in seen.iter_mut().zip(near).zip(points.far) {
            *seen = near | *seen & far;
        }
    }

    /// The same for the points in `which`, by single segments.
    fn shadow_one_by_one(&self, apex: Vec3, points: &Points, which: &Lanes, seen: &mut Lanes) {
        for (bundle, seen) in seen.iter_mut().enumerate() {
            for lane in bits(u32::from(*seen & which[bundle])) {
                *seen &= !(u16::from(self.blocks(apex, points.point(bundle, lane))) << lane);
            }
        }
    }
}

/// Nodes that a shaft could not rule out, with the boxes of each that are left.
type Candidates = ArrayVec<(u32, u32), CANDIDATES>;

/// Segments up to which each is tested against a whole block.
const SINGLY: u32 = 8;

/// A node on the stack of a bundle.
#[derive(Clone, Copy)]
struct Open {
    node: u32,
    boxes: u32,
    /// Points whose segments meet its box.
    alive: u32,
}

/// Memory that a kernel works in: made once for many calls.
#[derive(Default)]
pub struct Scratch {
    rows: Rows,
}

/// One apex on its way through the hierarchy.
struct Descent<'a> {
    mesh: &'a Mesh,
    points: &'a Points,
    apex: [f32; 3],
    scratch: &'a mut Scratch,
}

impl Descent<'_> {
    #[inline(always)]
    fn tile<I: Isa>(&mut self, seen: &mut Lanes) {
        if *seen == [0; BUNDLES] {
            return;
        }
        let root = [(0, u32::MAX)];
        let Some(of_tile) = self.narrow::<I>(&root, self.points.tile, 0, seen) else { return };
        for group in 0..BUNDLES / GROUP {
            let first = group * GROUP;
            let lanes = &mut seen[first..first + GROUP];
            if lanes.iter().all(|&l| l == 0) {
                continue;
            }
            let corners = self.points.groups[group];
            let Some(of_group) = self.narrow::<I>(&of_tile, corners, first, lanes) else { continue };
            for (k, lanes) in lanes.iter_mut().enumerate() {
                if *lanes != 0 {
                    *lanes = self.bundle::<I>(&of_group, first + k, *lanes);
                }
            }
        }
    }

    /// What of `from` the segments to the box `corners` may meet; `None` where nothing is left to ask for the bundles from
    /// `first` on, whose points are `seen`.
    #[inline(always)]
    fn narrow<I: Isa>(
        &mut self,
        from: &[(u32, u32)],
        corners: Corners,
        first: usize,
        seen: &mut [u16],
    ) -> Option<Candidates> {
        let shaft = Shaft::new(self.apex, corners.0, corners.1);
        let mut open = Candidates::new();
        open.extend(from.iter().copied());
        let mut left = Candidates::new();
        let (mut blocks, mut opened) = (0, 0);
        while let Some((number, boxes)) = open.pop() {
            let node = &self.mesh.bvh.nodes[number as usize];
            let met = shaft.meets::<I>(node) & boxes;
            let inner = met & !node.blocks;
            // Every open node leaves at most one candidate, so what is open and what is left together must fit.
            let room = open.len() + left.len() + 1 + inner.count_ones() as usize <= CANDIDATES;
            let go_on = opened < OPENED && room;
            let kept = if go_on { met & node.blocks } else { met };
            if go_on {
                opened += 1;
                for slot in bits(inner) {
                    open.push((node.child[slot], u32::MAX));
                }
            } else if inner != 0 {
                blocks = FEW + 1;
            }
            blocks += (met & node.blocks).count_ones();
            if kept != 0 {
                left.push((number, kept));
            }
        }
        if blocks == 0 {
            return None;
        }
        if blocks <= FEW { self.test_few::<I>(left, &shaft, first, seen) } else { Some(left) }
    }

    /// Tests the triangles of a few blocks for a whole tile or group; what is left of them.
    #[inline(always)]
    fn test_few<I: Isa>(
        &mut self,
        mut few: Candidates,
        shaft: &Shaft,
        first: usize,
        seen: &mut [u16],
    ) -> Option<Candidates> {
        let mut undecided = false;
        for k in 0..few.len() {
            let (number, boxes) = few[k];
            let node = &self.mesh.bvh.nodes[number as usize];
            for slot in bits(boxes) {
                let planes = self.planes::<I>(node, slot, shaft);
                let against = planes.against(&shaft.directions);
                let there = (1u32 << node.triangles[slot]) - 1;
                if against.cover & there != 0 {
                    seen.fill(0);
                    return None;
                }
                let may = against.may & there;
                if may.count_ones() > 2 {
                    undecided = true;
                    continue;
                }
                few[k].1 &= !(1 << slot);
                if may != 0 && self.test_all::<I>(&planes, node.child[slot], may, first, seen) {
                    return None;
                }
            }
        }
        undecided.then_some(few)
    }

    /// Tests the triangles `may` of a block against the bundles from `first` on; true when no point is left.
    #[inline(always)]
    fn test_all<I: Isa>(&mut self, planes: &Planes<I>, block: u32, may: u32, first: usize, seen: &mut [u16]) -> bool {
        planes.store(&mut self.scratch.rows);
        let mut left = 0;
        for (k, seen) in seen.iter_mut().enumerate() {
            if *seen != 0 {
                let d = self.points.segments::<I>(first + k, self.apex);
                for lane in bits(may) {
                    *seen = self.test_triangle::<I>(block, lane, first + k, &d, *seen);
                }
                left |= *seen;
            }
        }
        left == 0
    }

    /// The points of `seen` in a bundle that none of the candidates blocks.
    #[inline(always)]
    fn bundle<I: Isa>(&mut self, from: &[(u32, u32)], bundle: usize, seen: u16) -> u16 {
        let corners = self.points.bundles[bundle];
        let shaft = Shaft::new(self.apex, corners.0, corners.1);
        let d = self.points.segments::<I>(bundle, self.apex);
        let segments = Bundle::<I>::new(&shaft, self.apex, &d);
        let mut seen = u32::from(seen);
        let mut open: SmallVec<[Open; 256]> = SmallVec::new();
        open.extend(from.iter().map(|&(node, boxes)| Open { node, boxes, alive: seen }));
        while let Some(Open { node, boxes, alive }) = open.pop() {
            if alive & seen == 0 {
                continue;
            }
            let node = &self.mesh.bvh.nodes[node as usize];
            let met = shaft.meets::<I>(node) & boxes;
            let (mut blocks, mut near) = ([(0, 0); WIDTH], 0);
            for slot in bits(met) {
                let alive = segments.meets(node, slot) & alive & seen;
                if alive == 0 {
                    continue;
                }
                if node.blocks >> slot & 1 == 1 {
                    prefetch(&self.mesh.blocks[node.child[slot] as usize]);
                    blocks[near] = (slot, alive);
                    near += 1;
                } else {
                    prefetch(&self.mesh.bvh.nodes[node.child[slot] as usize]);
                    open.push(Open { node: node.child[slot], boxes: u32::MAX, alive });
                }
            }
            for &(slot, alive) in &blocks[..near] {
                if alive & seen != 0 {
                    seen = self.block::<I>(node, slot, bundle, &shaft, &d, alive & seen, seen);
                    if seen == 0 {
                        return 0;
                    }
                }
            }
        }
        seen as u16
    }

    /// The points of `seen` that no triangle of a block blocks, where only those `alive` are near it.
    #[expect(clippy::too_many_arguments, reason = "TODO")]
    #[inline(always)]
    fn block<I: Isa>(
        &mut self,
        node: &Node,
        slot: usize,
        bundle: usize,
        shaft: &Shaft,
        d: &[I::Sixteen; 3],
        alive: u32,
        seen: u32,
    ) -> u32 {
        let planes = self.planes::<I>(node, slot, shaft);
        let there = (1u32 << node.triangles[slot]) - 1;
        if alive.count_ones() <= SINGLY {
            return self.singly::<I>(&planes, node.child[slot], there, bundle, alive, seen);
        }
        let against = planes.against(&shaft.directions);
        if against.cover & there != 0 {
            return 0;
        }
        let may = against.may & there;
        if may == 0 {
            return seen;
        }
        planes.store(&mut self.scratch.rows);
        let mut seen = seen as u16;
        for lane in bits(may) {
            seen = self.test_triangle::<I>(node.child[slot], lane, bundle, d, seen);
            if seen == 0 {
                break;
            }
        }
        u32::from(seen)
    }

    #[inline(always)]
    fn singly<I: Isa>(&self, planes: &Planes<I>, block: u32, there: u32, bundle: usize, alive: u32, mut seen: u32) -> u32 {
        for lane in bits(alive) {
            let p = self.points;
            let d = [p.x[bundle][lane] - self.apex[0], p.y[bundle][lane] - self.apex[1], p.z[bundle][lane] - self.apex[2]];
            let decided = planes.test(d);
            let blocked = if decided.hit & there != 0 {
                true
            } else {
                let undecided = there & !decided.miss;
                undecided != 0 && self.ask_f64_one(block, undecided, d)
            };
            seen &= !(u32::from(blocked) << lane);
        }
        seen
    }

    #[cold]
    #[inline(never)]
    fn ask_f64_one(&self, block: u32, undecided: u32, d: [f32; 3]) -> bool {
        let first = self.mesh.bvh.firsts[block as usize] as usize;
        let (apex, d) = (Vec3::from(self.apex).as_dvec3(), Vec3::from(d).as_dvec3());
        bits(undecided).any(|lane| self.mesh.triangles[first + lane].crosses(apex, d))
    }

    #[inline(always)]
    fn planes<I: Isa>(&self, node: &Node, slot: usize, shaft: &Shaft) -> Planes<I> {
        let extent = Extent::new(self.apex, node, slot);
        let block = &self.mesh.blocks[node.child[slot] as usize];
        Planes::new(block, self.apex, extent, &shaft.directions, self.mesh.floor)
    }

    /// The points of `seen` that one triangle does not block.
    #[inline(always)]
    fn test_triangle<I: Isa>(&self, block: u32, lane: usize, bundle: usize, d: &[I::Sixteen; 3], seen: u16) -> u16 {
        let decided = self.scratch.rows.test::<I>(lane, d);
        let seen = seen & !(decided.hit as u16);
        let undecided = seen & !(decided.miss as u16);
        if undecided == 0 { seen } else { self.ask_f64(block, lane, bundle, undecided, seen) }
    }

    #[cold]
    #[inline(never)]
    fn ask_f64(&self, block: u32, lane: usize, bundle: usize, undecided: u16, mut seen: u16) -> u16 {
        let triangle = &self.mesh.triangles[self.mesh.bvh.firsts[block as usize] as usize + lane];
        let apex = Vec3::from(self.apex);
        for point in bits(u32::from(undecided)) {
            let d = self.points.point(bundle, point) - apex;
            seen &= !(u16::from(triangle.crosses(apex.as_dvec3(), d.as_dvec3())) << point);
        }
        seen
    }
}
