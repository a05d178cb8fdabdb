//! Sixteen rays from one point through the mesh at once, for camera rays: each hit is that of the ray alone.
//!
//! Rays of a packet have a common origin and directions close together. The shaft around them finds the boxes that
//! any of them may meet, nearest first; each box is then asked of the sixteen rays, up to the nearest triangle that each has
//! met so far; and the triangles of a block are planes through the origin, the same for all rays:
//!
//! ```text
//! shaft against nodes -> 16 rays against a box -> 8 triangles as planes -> 16 rays against a triangle -> distances in f64
//! ```
//!
//! All but the last is conservative. Distances are computed in f64 by the formula of
//! [`Triangle::intersect`](super::mesh::Triangle::intersect), whose first half the rays share; rays that pass an edge too closely
//! for f32 are asked one by one.

use super::bvh::{Node, WIDTH};
use super::mesh::{Mesh, Stack, bits, push_sorted};
use super::planes::{Extent, Planes, Rows};
use super::shaft::{Bundle, Shaft};
use super::simd::{Isa, Kernel, Vector};
use super::{Hit, Ray};
use crate::math::{DVec3, Vec3};

/// Rays of a packet: the lanes of a vector.
const RAYS: usize = 16;
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
        let mut rows = Rows::default();
        for (rays, hits) in self.rays.chunks(RAYS).zip(self.hits.chunks_mut(RAYS)) {
            match Directions::common(self.mesh, rays) {
                Some(directions) => packet::<I>(self.mesh, rays, &directions, hits, &mut rows),
                None => rays.iter().zip(hits).for_each(|(ray, hit)| *hit = self.mesh.closest_hit(ray)),
            }
        }
    }
}

/// The directions of a packet, by axis, as the mesh sees them.
struct Directions {
    each: [[f32; RAYS]; 3],
    least: [f32; 3],
    most: [f32; 3],
}

impl Directions {
    /// Of `rays`, if they start in one point near the mesh and lie close together; unused lanes repeat the first.
    #[inline(always)]
    fn common(mesh: &Mesh, rays: &[Ray]) -> Option<Self> {
        let origin = rays[0].origin;
        if rays.len() < RAYS / 2 || mesh.is_empty() || !mesh.is_near(origin) || rays.iter().any(|r| r.origin != origin)
        {
            return None;
        }
        let first = rays[0].direction.as_vec3().to_array();
        let mut d = Directions { each: first.map(|x| [x; RAYS]), least: first, most: first };
        for (lane, ray) in rays.iter().enumerate() {
            let direction = ray.direction.as_vec3();
            for axis in 0..3 {
                d.each[axis][lane] = direction[axis];
                d.least[axis] = d.least[axis].min(direction[axis]);
                d.most[axis] = d.most[axis].max(direction[axis]);
            }
        }
        (0..3).all(|axis| d.most[axis] - d.least[axis] < COHERENT).then_some(d)
    }
}

#[inline(always)]
fn packet<I: Isa>(mesh: &Mesh, rays: &[Ray], directions: &Directions, hits: &mut [Option<Hit>], rows: &mut Rows) {
    let best = Search::<I>::new(mesh, rays[0].origin.as_vec3(), directions, rows).run();
    // Neighbours often lie on one triangle.
    let (mut seen, mut plane) = (NONE, (DVec3::ZERO, DVec3::ZERO));
    for (lane, (ray, hit)) in rays.iter().zip(hits).enumerate() {
        let place = best.place[lane];
        if place == NONE {
            *hit = None;
            continue;
        }
        if place != seen {
            (seen, plane) = (place, mesh.plane(place));
        }
        *hit = Some(mesh.hit(ray, best.distance[lane], place, plane));
    }
}

/// Stands for no triangle.
const NONE: u32 = u32::MAX;

/// The nearest triangles so far, by ray.
struct Best {
    distance: [f64; RAYS],
    primitive: [u32; RAYS],
    /// In the order of the blocks.
    place: [u32; RAYS],
    /// Upper bounds of the distances.
    ends: [f32; RAYS],
    /// The largest of them.
    end: f32,
}

impl Best {
    /// Takes the triangle at `place` for the rays of `lanes` that meet it at the distances `t` before any other.
    #[inline(always)]
    fn offer(&mut self, lanes: u32, t: &[f64; RAYS], primitive: u32, place: u32) {
        let mut end = 0.0f32;
        for lane in 0..RAYS {
            let (t, best) = (t[lane], self.distance[lane]);
            let nearer = t < best || (t == best && primitive < self.primitive[lane]);
            let taken = (lanes >> lane & 1 == 1) & (t > 0.0) & (t < f64::INFINITY) & nearer;
            self.distance[lane] = if taken { t } else { best };
            self.primitive[lane] = if taken { primitive } else { self.primitive[lane] };
            self.place[lane] = if taken { place } else { self.place[lane] };
            // Rounded up, as for a single ray.
            self.ends[lane] = if taken { (t * (1.0 + 1e-6)) as f32 } else { self.ends[lane] };
            end = end.max(self.ends[lane]);
        }
        self.end = end;
    }
}

/// A packet on its way through the hierarchy.
struct Search<'a, I: Isa> {
    mesh: &'a Mesh,
    apex: [f32; 3],
    origin: DVec3,
    shaft: Shaft,
    d: [I::Sixteen; 3],
    bundle: Bundle<I>,
    /// The directions in f64, by axis.
    directions: [[f64; RAYS]; 3],
    rows: &'a mut Rows,
    best: Best,
}

impl<'a, I: Isa> Search<'a, I> {
    #[inline(always)]
    fn new(mesh: &'a Mesh, origin: Vec3, directions: &Directions, rows: &'a mut Rows) -> Self {
        let apex = origin.to_array();
        let [x, y, z] = &directions.each;
        let d = [I::Sixteen::load(x), I::Sixteen::load(y), I::Sixteen::load(z)];
        let far = f32::INFINITY;
        Search {
            mesh,
            apex,
            origin: origin.as_dvec3(),
            shaft: Shaft::along(apex, directions.least, directions.most),
            d,
            bundle: Bundle::new(&d),
            directions: [x.map(f64::from), y.map(f64::from), z.map(f64::from)],
            rows,
            best: Best {
                distance: [f64::INFINITY; RAYS],
                primitive: [NONE; RAYS],
                place: [NONE; RAYS],
                ends: [far; RAYS],
                end: far,
            },
        }
    }

    #[inline(always)]
    fn run(mut self) -> Best {
        // A box is on the stack by its node and slot.
        let mut open: Stack<(f32, u32)> = Stack::new();
        let mut next = Some(0);
        loop {
            if let Some(number) = next.take() {
                let node = &self.mesh.bvh.nodes[number as usize];
                let (met, enter) = self.shaft.meets_before::<I>(node, self.best.end);
                let mut times = [0.0; WIDTH];
                enter.store(&mut times);
                push_sorted(&mut open, bits(met).map(|slot| (times[slot], number * WIDTH as u32 + slot as u32)));
            }
            let Some((time, at)) = open.pop() else { return self.best };
            if time > self.best.end {
                continue;
            }
            let (node, slot) = (&self.mesh.bvh.nodes[at as usize / WIDTH], at as usize % WIDTH);
            let ends = I::Sixteen::load(&self.best.ends);
            let met = self.bundle.meets_before(node, slot, self.apex, ends) & ALL;
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
        planes.store(self.rows);
        let first = self.mesh.bvh.firsts[number];
        for lane in bits(may) {
            let decided = self.rows.test_rays::<I>(lane, &self.d, I::Sixteen::load(&self.best.ends));
            let left = met & !decided.miss;
            if left != 0 {
                self.triangle(first + lane as u32, left & decided.hit, left & !decided.hit);
            }
        }
    }

    /// One triangle against rays that surely cross it if they meet its plane, and others that may.
    #[inline(always)]
    fn triangle(&mut self, place: u32, sure: u32, doubtful: u32) {
        let triangle = &self.mesh.triangles[place as usize];
        let (normal, numerator) = triangle.plane_from(self.origin);
        let [x, y, z] = &self.directions;
        let mut t = [0.0; RAYS];
        for (lane, t) in t.iter_mut().enumerate() {
            *t = numerator / normal.dot(DVec3::new(x[lane], y[lane], z[lane]));
        }
        let mut lanes = sure;
        for lane in bits(doubtful) {
            let d = DVec3::new(x[lane], y[lane], z[lane]);
            let crosses = triangle.intersect(self.origin, d, self.best.distance[lane]).is_some();
            lanes |= u32::from(crosses) << lane;
        }
        if lanes != 0 {
            self.best.offer(lanes, &t, triangle.primitive, place);
        }
    }
}
