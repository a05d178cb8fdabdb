//! Two closed nets of triangles over the same directions, one certainly inside a surface, one outside, as they are seen from afar.
//!
//! From an apex, some triangles of the outer net are seen from the front, others from the back. No point of it is seen farther from its centre than
//! those of the edges between both: the rim.

use super::shells::Shells;
use crate::math::{DMat3, Vec3};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// Cells of the nets along an edge of the cube.
pub(super) const CELLS: usize = 8;
/// Triangles of a patch of 2 x 2 cells, which stand together.
const TOGETHER: usize = 8;
/// Patches of a net.
const PATCHES: usize = 12 * CELLS * CELLS / TOGETHER;
/// Patches that the edges of one lie in, at most, itself among them.
const BESIDE: usize = 5;
/// Edges of a net, and room for one that does not count.
pub(super) const EDGES: usize = 18 * CELLS * CELLS + 1;
/// What f32 rounds of how a triangle faces, in units of the distance.
const ROUNDING: f32 = 4e-6;

/// A corner of both nets.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Corner {
    /// That of the outer net, seen from the centre \[m\].
    pub(super) outer: Vec3,
    /// How many times as far that is as the inner one.
    pub(super) ratio: f32,
}

/// The nets.
#[derive(Debug)]
pub(super) struct Cage {
    /// No corner of the outer net is farther from the centre \[m\].
    pub(super) reach: f64,
    /// As many as there are outlines of it.
    pub(super) outlines: Arc<()>,
    corners: Vec<Corner>,
    /// Unit normals of the outer triangles, and the distances of their planes from the centre.
    planes: [Vec<f32>; 4],
    /// Patch by patch.
    edges: Vec<Edge>,
    patches: Vec<Patch>,
}

/// An edge that may be part of a rim.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Found {
    ends: [u16; 2],
    /// Whether it is, and not only maybe.
    pub(super) is_rim: bool,
}

/// Edges that are looked at together.
#[derive(Clone, Debug, Default)]
struct Patch {
    edges: Range<usize>,
    /// Numbers of the patches that the triangles on both sides are of.
    of: [u16; BESIDE],
}

#[derive(Clone, Copy, Debug)]
struct Edge {
    /// Numbers of its corners.
    ends: [u16; 2],
    /// Numbers of the triangles on both sides.
    sides: [u16; 2],
}

impl Cage {
    /// That of `shells` with [`CELLS`]; `to_world` leads to the world, seen from the centre.
    pub(super) fn new(shells: &Shells, to_world: &DMat3) -> Cage {
        let numbers = &shells.numbers;
        let mut corners = vec![Corner::default(); numbers.iter().flatten().max().map_or(0, |last| last + 1)];
        let mut sides: BTreeMap<[usize; 2], Vec<usize>> = BTreeMap::new();
        let mut planes: [Vec<f32>; 4] = std::array::from_fn(|_| vec![0.0; numbers.len()]);
        for (t, (numbers, triangle)) in numbers.iter().zip(&shells.outer).enumerate() {
            let place = place(t);
            for (k, &number) in numbers.iter().enumerate() {
                let inner = shells.inner.get(t).map_or(0.0, |inner| inner[k].length());
                let ratio = (triangle[k].length() / inner) as f32;
                corners[number] = Corner { outer: (*to_world * triangle[k]).as_vec3(), ratio };
                let next = numbers[(k + 1) % 3];
                sides.entry([number.min(next), number.max(next)]).or_default().push(place);
            }
            let [a, b, c] = numbers.map(|i| corners[i].outer.as_dvec3());
            let normal = (b - a).cross(c - a).normalize_or_zero();
            // Outward: the centre is behind all of them.
            let distance = normal.dot(a);
            let [x, y, z] = (normal * distance.signum()).to_array();
            planes.iter_mut().zip([x, y, z, distance.abs()]).for_each(|(column, x)| column[place] = x as f32);
        }
        let narrow = |numbers: &[usize]| [numbers[0], numbers[1]].map(|number| number as u16);
        let edge = |(ends, sides): (&[usize; 2], &Vec<usize>)| Edge { ends: narrow(ends), sides: narrow(sides) };
        let mut edges: Vec<Edge> = sides.iter().map(edge).collect();
        edges.sort_by_key(|edge| edge.patches()[0]);
        let mut patches: Vec<Patch> = Vec::new();
        for edges in edges.chunk_by(|a, b| a.patches()[0] == b.patches()[0]) {
            let start = patches.last().map_or(0, |last| last.edges.end);
            let mut of: Vec<u16> = edges.iter().flat_map(Edge::patches).collect();
            of.sort_unstable();
            of.dedup();
            let all = std::array::from_fn(|i| of[i.min(of.len() - 1)]);
            assert!(of.len() <= BESIDE, "a patch with edges to {}", of.len());
            patches.push(Patch { edges: start..start + edges.len(), of: all });
        }
        let reach = corners.iter().map(|corner| f64::from(corner.outer.length())).fold(0.0, f64::max) * (1.0 + 1e-6);
        Cage { reach, outlines: Arc::new(()), corners, planes, edges, patches }
    }

    /// Puts into `found` the edges that may be part of the rim of what goes around all of the net, seen from `apex` \[m\] from the centre; gives how many.
    #[inline(always)]
    pub(super) fn rim(&self, apex: Vec3, found: &mut [Found; EDGES]) -> usize {
        let doubt = ROUNDING * apex.length();
        // 2: maybe edge-on.
        let mut facing = [[0u8; TOGETHER]; PATCHES];
        let [x, y, z, d] = self.planes.each_ref().map(|column| &column[..TOGETHER * PATCHES]);
        for (i, facing) in facing.as_flattened_mut().iter_mut().enumerate() {
            let height = apex.x * x[i] + apex.y * y[i] + apex.z * z[i] - d[i];
            *facing = u8::from(height > 0.0) | u8::from(height.abs() <= doubt) << 1;
        }
        // Whether a patch or an edge counts is as good as random: what is written is kept or not, without a branch.
        let (mut mixed, mut patches) = ([0; PATCHES + 1], 0);
        for (number, patch) in self.patches.iter().enumerate() {
            let (mut any, mut all) = (0, u64::MAX);
            for number in patch.of {
                let facing = u64::from_ne_bytes(facing[usize::from(number)]);
                (any, all) = (any | facing, all & facing);
            }
            let is_back = any == 0;
            let is_front = any == all && all == u64::from_ne_bytes([1; TOGETHER]);
            mixed[patches] = number;
            patches += usize::from(!(is_back | is_front));
        }
        let facing = facing.as_flattened();
        let mut count = 0;
        for &number in &mixed[..patches] {
            for edge in &self.edges[self.patches[number].edges.clone()] {
                let (a, b) = (facing[usize::from(edge.sides[0])], facing[usize::from(edge.sides[1])]);
                found[count] = Found { ends: edge.ends, is_rim: (a ^ b) & 1 == 1 };
                count += usize::from((a ^ b) & 1 | (a | b) & 2 != 0);
            }
        }
        count
    }

    /// Where an edge of the rim ends.
    #[inline(always)]
    pub(super) fn ends(&self, found: &Found) -> [&Corner; 2] {
        [&self.corners[usize::from(found.ends[0])], &self.corners[usize::from(found.ends[1])]]
    }

    /// Memory \[bytes\].
    pub(super) fn bytes(&self) -> u64 {
        let edges = size_of_val(&self.edges[..]) + size_of_val(&self.patches[..]);
        (size_of_val(&self.corners[..]) + edges + 4 * size_of_val(&self.planes[0][..])) as u64
    }
}

impl Edge {
    /// The patches of the triangles on both sides.
    fn patches(&self) -> [u16; 2] {
        self.sides.map(|side| side / TOGETHER as u16)
    }
}

/// Where the triangle number `t` of a net stands among those of all patches.
fn place(t: usize) -> usize {
    let (cell, which) = (t / 2, t % 2);
    let (face, u, v) = (cell / (CELLS * CELLS), cell / CELLS % CELLS, cell % CELLS);
    let patch = (face * (CELLS / 2) + u / 2) * (CELLS / 2) + v / 2;
    TOGETHER * patch + 4 * (u % 2) + 2 * (v % 2) + which
}
