//! The visibility kernel: one apex against a tile of up to 256 lifted points.
//!
//! Points of a tile lie close together, and so do their segments from a common apex. The tile is nested: 256 points in 4 groups
//! of 64 in 4 bundles of 16. The shaft around the segments of a tile finds the boxes that any of them may meet; the shafts of
//! its groups and bundles go on from there, and only a bundle looks at single segments:
//!
//! ```text
//! tile -> shaft against nodes -> candidates -> group -> shaft -> candidates -> bundle -> shaft, then 16 segments against
//! boxes -> 8 triangles as planes through the apex, against each segment that is left, or each triangle against all
//! ```
//!
//! Every step before a triangle is conservative and the planes leave to f64 what they cannot tell (`geometry::planes`), so the
//! answer for each point is that of [`Geometry::visible`], whatever the tile and the instructions.
//!
//! Planes and spheres are asked after the triangles, of the points that are left: on which side, or inside which, a point of the
//! tile lies is known beforehand. Another kind of surface fits in like these, or as triangles whose bits are
//! taken out of `hit` and given to f64 code of their own.

mod bundle;
mod starts;

use super::bvh::Node;
use super::mesh::{Mesh, bits};
use super::planes::{Against, Decided, Directions, Extent, Planes, Rows};
use super::points::{Corners, Ends};
use super::shaft::Shaft;
use super::simd::{Isa, Kernel, Vector};
use super::{Apex, Geometry, Sphere};
use crate::math::Vec3;
use arrayvec::ArrayVec;

pub use super::points::Points;
pub(super) use starts::Starts;

/// Points of a tile.
pub const TILE: usize = 256;
/// Points of a bundle: the lanes of a vector.
pub const BUNDLE: usize = 16;
/// Bundles of a tile.
pub const BUNDLES: usize = TILE / BUNDLE;
/// Bundles of a group.
pub(super) const GROUP: usize = 4;
/// Nodes that a shaft hands down, at most.
const CANDIDATES: usize = 64;
/// Nodes that the shaft of a tile or a group opens: beyond that its groups or bundles go on alone.
const OPENED: usize = 4;
/// Blocks whose triangles the shaft of a tile or a group tests at once, at most.
const FEW: u32 = 12;
/// Triangles that every bundle of a tile or a group is asked for, at most.
const MANY: u32 = 12;

/// For each bundle of a tile, a bit for each of its points.
pub type Lanes = [u16; BUNDLES];

impl Geometry {
    /// Clears the bits of the points in `seen` that `apex` does not see.
    pub fn hide(&self, apex: &Apex, points: &Points, seen: &mut Lanes, scratch: &mut Scratch) {
        self.mesh.hide(apex.at, &points.ends, seen, scratch);
        let far = apex.at.as_dvec3();
        for (plane, [front, behind]) in self.planes.iter().zip(&points.sides) {
            let height = plane.height(far);
            let blocked = if height > 0.0 { Some(behind) } else { (height < 0.0).then_some(front) };
            if let Some(blocked) = blocked {
                seen.iter_mut().zip(blocked).for_each(|(seen, blocked)| *seen &= !blocked);
            }
        }
        for (sphere, inside) in self.spheres.iter().zip(&points.inside) {
            shadow_of_sphere(sphere, apex.at, points, inside, seen);
        }
        debug_assert_eq!(self.harmonics.len(), apex.prospects.len(), "an apex of this geometry");
        let harmonics = self.harmonics.iter().zip(&apex.prospects);
        for ((harmonic, prospect), beside) in harmonics.zip(&points.beside) {
            harmonic.hide((apex.at, prospect), points, beside, seen, scratch);
        }
    }
}

/// See [`Mesh::hide`].
struct Hide<'a> {
    mesh: &'a Mesh,
    apex: Vec3,
    starts: Option<&'a Starts>,
    points: &'a Ends,
    seen: &'a mut Lanes,
    scratch: &'a mut Scratch,
}

impl Kernel for Hide<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let Hide { mesh, apex, starts, points, seen, scratch } = self;
        mesh.shadow::<I>(apex, starts, points, seen, scratch);
    }
}

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
    /// Clears the bits of the points in `seen` between which and `apex` a triangle stands, with the instructions of the processor:
    /// compiled once for all callers.
    pub(super) fn hide(&self, apex: Vec3, points: &Ends, seen: &mut Lanes, scratch: &mut Scratch) {
        self.hide_after(apex, None, points, seen, scratch);
    }

    /// The same without what is at the start of segments.
    pub(super) fn hide_after(
        &self,
        apex: Vec3,
        starts: Option<&Starts>,
        points: &Ends,
        seen: &mut Lanes,
        scratch: &mut Scratch,
    ) {
        if !self.is_empty() {
            self.path.run(Hide { mesh: self, apex, starts, points, seen, scratch });
        }
    }

    #[inline(always)]
    fn shadow<I: Isa>(
        &self,
        apex: Vec3,
        starts: Option<&Starts>,
        points: &Ends,
        seen: &mut Lanes,
        scratch: &mut Scratch,
    ) {
        if !self.is_near(apex.as_dvec3()) {
            return self.shadow_one_by_one(apex, points, &[u16::MAX; BUNDLES], seen);
        }
        let alone = points.far != [0; BUNDLES];
        if alone {
            self.shadow_one_by_one(apex, points, &points.far, seen);
        }
        let mut near = *seen;
        near.iter_mut().zip(&points.far).for_each(|(near, far)| *near &= !far);
        // In one place: it is long, and compiled whole.
        let mut descent = Descent { mesh: self, starts, points, apex: apex.to_array(), scratch };
        descent.tile::<I>(&mut near);
        for ((seen, near), far) in seen.iter_mut().zip(near).zip(points.far) {
            *seen = near | *seen & far;
        }
    }

    /// The same for the points in `which`, by single segments.
    fn shadow_one_by_one(&self, apex: Vec3, points: &Ends, which: &Lanes, seen: &mut Lanes) {
        for (bundle, seen) in seen.iter_mut().enumerate() {
            for lane in bits(u32::from(*seen & which[bundle])) {
                *seen &= !(u16::from(self.blocks(apex, points.point(bundle, lane))) << lane);
            }
        }
    }
}

/// Nodes that a shaft could not rule out, with the boxes of each that are left.
type Candidates = ArrayVec<(u32, u32), CANDIDATES>;

/// Memory that a kernel works in: made once for many calls.
#[derive(Default)]
pub struct Scratch {
    few: [Rows; FEW as usize],
}

/// One apex on its way through the hierarchy.
struct Descent<'a> {
    mesh: &'a Mesh,
    starts: Option<&'a Starts>,
    points: &'a Ends,
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
        let start = self.starts.map_or(0.0, |starts| starts.tile);
        let Some(of_tile) = self.narrow::<I>(&root, (self.points.tile, start), 0, seen) else { return };
        for group in 0..BUNDLES / GROUP {
            let first = group * GROUP;
            let lanes = &mut seen[first..first + GROUP];
            if lanes.iter().all(|&l| l == 0) {
                continue;
            }
            let start = self.starts.map_or(0.0, |starts| starts.groups[group]);
            let corners = (self.points.groups[group], start);
            let Some(of_group) = self.narrow::<I>(&of_tile, corners, first, lanes) else { continue };
            for (k, lanes) in lanes.iter_mut().enumerate() {
                if *lanes != 0 {
                    *lanes = self.bundle::<I>(&of_group, first + k, *lanes);
                }
            }
        }
    }

    /// What of `from` the segments to the box `corners` may meet, from the share `start` on; `None` where nothing is left to ask for the bundles from
    /// `first` on, whose points are `seen`.
    #[inline(always)]
    fn narrow<I: Isa>(
        &mut self,
        from: &[(u32, u32)],
        (corners, start): (Corners, f32),
        first: usize,
        seen: &mut [u16],
    ) -> Option<Candidates> {
        let shaft = Shaft::new(self.apex, corners.0, corners.1).after(start);
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
        if blocks > FEW {
            return Some(left);
        }
        self.test_few::<I>(&mut left, (&shaft, start), first, seen).then_some(left)
    }

    /// Tests the triangles of a few blocks for a whole tile or group: their planes are set up once, and asked of each group before
    /// each bundle. True where there are too many of them, and smaller shafts must go on with what is left of `few`.
    #[inline(always)]
    fn test_few<I: Isa>(
        &mut self,
        few: &mut Candidates,
        (shaft, start): (&Shaft, f32),
        first: usize,
        seen: &mut [u16],
    ) -> bool {
        let mut asked: ArrayVec<(u32, u32), { FEW as usize }> = ArrayVec::new();
        let mut triangles = 0;
        for (number, boxes) in few.iter_mut() {
            let node = &self.mesh.bvh.nodes[*number as usize];
            for slot in bits(*boxes) {
                let planes = self.planes::<I>(node, slot, shaft);
                let there = (1u32 << node.triangles[slot]) - 1;
                let against = self.against(&planes, &shaft.directions, start);
                if against.cover & there != 0 {
                    seen.fill(0);
                    return false;
                }
                let may = against.may & there;
                triangles += may.count_ones();
                if may == 0 {
                    *boxes &= !(1 << slot);
                } else if triangles <= MANY {
                    planes.store(&mut self.scratch.few[asked.len()]);
                    asked.push((node.child[slot], may));
                }
            }
        }
        if triangles > MANY {
            return true;
        }
        if !asked.is_empty() {
            for (group, seen) in seen.chunks_mut(GROUP).enumerate() {
                self.test_group::<I>(&asked, first + group * GROUP, seen);
            }
        }
        false
    }

    /// Tests the triangles of the blocks `asked`, whose planes are in the scratch, against the group of bundles from `first` on.
    #[inline(always)]
    fn test_group<I: Isa>(&mut self, asked: &[(u32, u32)], first: usize, seen: &mut [u16]) {
        if seen.iter().all(|&lanes| lanes == 0) {
            return;
        }
        let (low, high) = self.points.groups[first / GROUP];
        let directions = Directions::between(self.apex, low, high);
        let start = self.starts.map_or(0.0, |starts| starts.groups[first / GROUP]);
        let mut may: [u32; FEW as usize] = [0; FEW as usize];
        for (k, &(_, triangles)) in asked.iter().enumerate() {
            let against = self.against(&self.scratch.few[k].planes::<I>(), &directions, start);
            if against.cover & triangles != 0 {
                return seen.fill(0);
            }
            may[k] = against.may & triangles;
        }
        if may.iter().all(|&triangles| triangles == 0) {
            return;
        }
        for (k, seen) in seen.iter_mut().enumerate().filter(|(_, seen)| **seen != 0) {
            let d = self.points.segments::<I>(first + k, self.apex);
            for (place, &(block, _)) in asked.iter().enumerate() {
                for lane in bits(may[place]) {
                    let rows = &self.scratch.few[place];
                    *seen = self.test_triangle::<I>(rows, block, lane, first + k, &d, *seen);
                }
            }
        }
    }

    /// All directions of a box against the triangles of a block, from the share `start` on; what covers a box may do so before that.
    #[inline(always)]
    fn against<I: Isa>(&self, planes: &Planes<I>, directions: &Directions, start: f32) -> Against {
        let against = planes.against(directions);
        if self.starts.is_none() {
            return against;
        }
        Against { may: against.may & !planes.before_all(directions, start), cover: 0 }
    }

    #[inline(always)]
    fn planes<I: Isa>(&self, node: &Node, slot: usize, shaft: &Shaft) -> Planes<I> {
        let extent = Extent::new(self.apex, node, slot);
        let block = &self.mesh.blocks[node.child[slot] as usize];
        Planes::new(block, self.apex, extent, &shaft.directions, self.mesh.floor)
    }

    /// The points of `seen` that one triangle does not block.
    #[inline(always)]
    fn test_triangle<I: Isa>(
        &self,
        rows: &Rows,
        block: u32,
        lane: usize,
        bundle: usize,
        d: &[I::Sixteen; 3],
        seen: u16,
    ) -> u16 {
        let mut decided = rows.test::<I>(lane, d);
        if let Some(starts) = self.starts {
            let before = rows.before::<I>(lane, d, I::Sixteen::load(&starts.each[bundle]));
            decided = Decided { miss: decided.miss | before, hit: decided.hit & !before };
        }
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
