//! Sixteen rays from one point through the mesh at once, for camera rays: each hit is that of the ray alone.
//!
//! Rays of a packet have a common origin and directions close together. The shaft around them finds the boxes that
//! any of them may meet, nearest first; each box is then asked of the sixteen rays, up to where each surely ends; and the
//! triangles of a block are planes through the origin, the same for all rays:
//!
//! ```text
//! shaft against nodes -> 16 rays against a box -> 8 triangles as planes -> 16 rays against a triangle -> distances in f64
//! ```
//!
//! All but the last is conservative: what a ray surely crosses gives an upper bound of its end, and what begins beyond that is
//! left out. A ray that passes an edge too closely for f32 asks [`Triangle::intersect`](super::mesh::Triangle::intersect). Of the
//! triangles that are left, mostly one, the nearest is found in f64, by the formula that single rays use.

use super::bvh::{Node, WIDTH};
use super::mesh::{Mesh, Open, bits};
use super::planes::{Extent, Planes, Rows};
use super::shaft::{Bundle, Shaft};
use super::simd::{Isa, Kernel, Vector};
use super::{Hit, Ray};
use crate::math::{DVec3, Vec3};
use smallvec::SmallVec;

/// Rays of a packet: the lanes of a vector.
const RAYS: usize = 16;
/// Packets whose rays are put into lanes beforehand: the processor waits for lanes that were written just before.
const AHEAD: usize = 16;
/// The bits of all of them.
const ALL: u32 = (1 << RAYS) - 1;
/// Coordinates of directions that differ by more than this make a shaft of no use.
const COHERENT: f32 = 0.5;

impl Mesh {
    /// What [`Mesh::closest_hit`] gives for each of `rays`.
    pub(super) fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        self.path.run(Packets { mesh: self, rays, hits });
    }
}

/// Rays in packets of [`RAYS`], or one by one where they have little in common.
struct Packets<'a> {
    mesh: &'a Mesh,
    rays: &'a [Ray],
    hits: &'a mut [Option<Hit>],
}

impl Kernel for Packets<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let mut work = Work::default();
        let mut lanes = [Lanes::default(); AHEAD];
        for (rays, hits) in self.rays.chunks(AHEAD * RAYS).zip(self.hits.chunks_mut(AHEAD * RAYS)) {
            for (rays, lanes) in rays.chunks(RAYS).zip(&mut lanes) {
                lanes.fill(self.mesh, rays);
            }
            for ((rays, hits), lanes) in rays.chunks(RAYS).zip(hits.chunks_mut(RAYS)).zip(&lanes) {
                match lanes.directions::<I>() {
                    Some(directions) => Search::<I>::new(self.mesh, rays, &directions, &mut work).run(rays, hits),
                    None => {
                        rays.iter().zip(hits).for_each(|(ray, hit)| *hit = self.mesh.closest_hit(ray, f64::INFINITY))
                    }
                }
            }
        }
    }
}

/// The directions of a packet in lanes, by axis; unused ones repeat the first.
#[derive(Clone, Copy, Default)]
struct Lanes {
    each: [[f32; RAYS]; 3],
    /// True when all start in one point near the mesh.
    common: bool,
}

impl Lanes {
    #[inline(always)]
    fn fill(&mut self, mesh: &Mesh, rays: &[Ray]) {
        let first = &rays[0];
        self.common = rays.len() >= RAYS / 2 && !mesh.is_empty() && mesh.is_near(first.origin);
        let [x, y, z] = &mut self.each;
        for lane in 0..RAYS {
            let Ray { origin, direction } = rays.get(lane).unwrap_or(first);
            self.common &= *origin == first.origin;
            (x[lane], y[lane], z[lane]) = (direction.x as f32, direction.y as f32, direction.z as f32);
        }
    }

    /// With the box around them, if it is small.
    #[inline(always)]
    fn directions<I: Isa>(&self) -> Option<Directions<'_>> {
        let [x, y, z] = [range::<I>(&self.each[0]), range::<I>(&self.each[1]), range::<I>(&self.each[2])];
        let close = |(least, most): (f32, f32)| most - least < COHERENT;
        let all_close = self.common && close(x) && close(y) && close(z);
        all_close.then_some(Directions { each: &self.each, least: [x.0, y.0, z.0], most: [x.1, y.1, z.1] })
    }
}

/// The directions of a packet, as the mesh sees them.
struct Directions<'a> {
    each: &'a [[f32; RAYS]; 3],
    least: [f32; 3],
    most: [f32; 3],
}

/// The least and the greatest lane.
#[inline(always)]
pub(super) fn range<I: Isa>(lanes: &[f32; RAYS]) -> (f32, f32) {
    let half = |at: usize| I::Eight::load(lanes[at..at + 8].try_into().expect("8 of 16"));
    let (mut least, mut most) = ([0.0; 8], [0.0; 8]);
    half(0).min(half(8)).store(&mut least);
    half(0).max(half(8)).store(&mut most);
    let lesser = |a: f32, b: f32| if a < b { a } else { b };
    let greater = |a: f32, b: f32| if a > b { a } else { b };
    let pairs =
        |v: &[f32; 8], f: fn(f32, f32) -> f32| f(f(f(v[0], v[4]), f(v[1], v[5])), f(f(v[2], v[6]), f(v[3], v[7])));
    (pairs(&least, lesser), pairs(&most, greater))
}

/// A triangle that rays cross.
struct Candidate {
    /// In the order of the blocks.
    place: u32,
    lanes: u32,
    /// Lower bounds of the distances \[m\].
    early: [f32; RAYS],
}

/// Memory for many packets.
#[derive(Default)]
struct Work {
    rows: Rows,
    candidates: SmallVec<[Candidate; 8]>,
    open: Open,
}

/// A packet on its way through the hierarchy.
struct Search<'a, I: Isa> {
    mesh: &'a Mesh,
    apex: [f32; 3],
    directions: &'a [[f32; RAYS]; 3],
    shaft: Shaft,
    d: [I::Sixteen; 3],
    bundle: Bundle<I>,
    work: &'a mut Work,
    /// Upper bounds of the distances of the hits, negative in unused lanes \[m\].
    ends: [f32; RAYS],
    /// The largest of them.
    end: f32,
}

impl<'a, I: Isa> Search<'a, I> {
    #[inline(always)]
    fn new(mesh: &'a Mesh, rays: &[Ray], directions: &Directions<'a>, work: &'a mut Work) -> Self {
        let apex = rays[0].origin.as_vec3().to_array();
        let [x, y, z] = directions.each;
        let d = [I::Sixteen::load(x), I::Sixteen::load(y), I::Sixteen::load(z)];
        let mut ends = [f32::INFINITY; RAYS];
        ends.iter_mut().skip(rays.len()).for_each(|end| *end = -1.0);
        let shaft = Shaft::along(apex, directions.least, directions.most);
        let bundle = Bundle::new(&shaft, &d);
        Search { mesh, apex, directions: directions.each, shaft, d, bundle, work, ends, end: f32::INFINITY }
    }

    #[inline(always)]
    fn run(mut self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        self.work.candidates.clear();
        let mut next = Some(0);
        loop {
            if let Some(number) = next.take() {
                let node = &self.mesh.bvh.nodes[number as usize];
                let (met, enter) = self.shaft.meets_before::<I>(node, self.end);
                let mut times = [0.0; WIDTH];
                enter.store(&mut times);
                self.mesh.prefetch(node, met);
                self.work.open.push(number, met, &times);
            }
            let Some((_, number, slot)) = self.work.open.pop(self.end) else { return self.finish(rays, hits) };
            let node = &self.mesh.bvh.nodes[number];
            let met = self.bundle.meets_before(node, slot, I::Sixteen::load(&self.ends)) & ALL;
            if met == 0 {
                continue;
            }
            if node.blocks >> slot & 1 == 1 {
                self.block(node, slot, met);
            } else {
                next = Some(node.child[slot]);
            }
        }
    }

    /// The triangles of a block against the rays `met`.
    #[inline(always)]
    fn block(&mut self, node: &Node, slot: usize, met: u32) {
        let number = node.child[slot] as usize;
        let extent = Extent::new(self.apex, node, slot);
        let directions = &self.shaft.directions;
        let planes = Planes::<I>::new(&self.mesh.blocks[number], self.apex, extent, directions, self.mesh.floor);
        let there = (1u32 << node.triangles[slot]) - 1;
        let may = planes.toward(directions) & there;
        if may == 0 {
            return;
        }
        planes.store(&mut self.work.rows);
        let first = self.mesh.bvh.firsts[number];
        for lane in bits(may) {
            self.triangle(lane, first + lane as u32, met);
        }
        self.end = range::<I>(&self.ends).1;
    }

    /// The triangle in a lane of the rows against the rays `met`.
    #[inline(always)]
    fn triangle(&mut self, lane: usize, place: u32, met: u32) {
        let meeting = self.work.rows.meets::<I>(lane, &self.d);
        let ends = I::Sixteen::load(&self.ends);
        let sure = meeting.sure & met & !ends.less(meeting.early);
        let unsure = meeting.may & met & !meeting.sure;
        if sure | unsure == 0 {
            return;
        }
        let mut candidate = Candidate { place, lanes: sure, early: [0.0; RAYS] };
        meeting.early.store(&mut candidate.early);
        if sure != 0 {
            let nearer = sure & meeting.late.less(ends);
            // Either is 0 where the other is not: the sum of bits is a choice.
            meeting.late.select(nearer).add(ends.select(ALL & !nearer)).store(&mut self.ends);
        }
        if unsure != 0 {
            self.ask_f64(&mut candidate, unsure);
        }
        if candidate.lanes != 0 {
            self.work.candidates.push(candidate);
        }
    }

    /// Decides which of the rays `unsure` cross the triangle.
    #[cold]
    #[inline(never)]
    fn ask_f64(&mut self, candidate: &mut Candidate, unsure: u32) {
        let triangle = &self.mesh.triangles[candidate.place as usize];
        let origin = Vec3::from(self.apex).as_dvec3();
        for lane in bits(unsure) {
            if let Some(t) = triangle.intersect(origin, self.direction(lane), f64::INFINITY) {
                candidate.lanes |= 1 << lane;
                candidate.early[lane] = (t * (1.0 - 1e-6)) as f32;
                self.ends[lane] = self.ends[lane].min((t * (1.0 + 1e-6)) as f32);
            }
        }
    }

    #[inline(always)]
    fn direction(&self, lane: usize) -> DVec3 {
        let [x, y, z] = self.directions;
        Vec3::new(x[lane], y[lane], z[lane]).as_dvec3()
    }

    /// The nearest candidate of each ray.
    #[inline(always)]
    fn finish(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        hits.fill(None);
        let origin = Vec3::from(self.apex).as_dvec3();
        let mut best = [(f64::INFINITY, u32::MAX); RAYS];
        for candidate in &self.work.candidates {
            let late = I::Sixteen::load(&self.ends).less(I::Sixteen::load(&candidate.early));
            let lanes = candidate.lanes & !late;
            if lanes == 0 {
                continue;
            }
            let triangle = &self.mesh.triangles[candidate.place as usize];
            let face = triangle.face(origin);
            let unit = face.unit();
            for lane in bits(lanes) {
                let t = face.distance(self.direction(lane));
                if (t, triangle.primitive) < best[lane] {
                    best[lane] = (t, triangle.primitive);
                    hits[lane] = Some(face.hit(&rays[lane], t, triangle.primitive, unit));
                }
            }
        }
    }
}
