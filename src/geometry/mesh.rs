//! Triangles in f32 under a binary bounding volume hierarchy of `obvhs`.
//!
//! No ray slips between triangles that share bit-identical corners: the three edge functions of a triangle are
//! triple products in f64 of f32 corners, and swapping the ends of an edge changes exactly their sign, so the two
//! neighbours of an edge agree about the side on which a ray passes; a ray on the edge meets both. The boxes of
//! the hierarchy are inflated by more than its f32 slab test rounds.

use super::{Hit, Ray, hit};
use crate::math::{DVec3, Vec3};
use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use obvhs::ray::{Ray as BoxRay, RayHit};

/// Triangles and their hierarchy.
pub struct Mesh {
    /// In the order of the leaves of the hierarchy.
    pub(super) triangles: Vec<Triangle>,
    /// Where each primitive stands in `triangles`.
    place: Vec<u32>,
    pub(super) bvh: Bvh2,
    bounds: (DVec3, DVec3),
    /// The bounds and a little around them, where rays may start.
    near: (DVec3, DVec3),
}

/// A triangle as rays meet it: (normal, x) = offset on its plane.
pub(super) struct Triangle {
    pub(super) corners: [Vec3; 3],
    primitive: u32,
    normal: DVec3,
    offset: f64,
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
        let bvh = build(triangles, bounds);
        let mut place = vec![0; triangles.len()];
        for (at, &primitive) in bvh.primitive_indices.iter().enumerate() {
            place[primitive as usize] = at as u32;
        }
        let ordered = bvh.primitive_indices.iter().map(|&p| Triangle::new(triangles[p as usize], p));
        let around = 0.01 * (bounds.1 - bounds.0).max_element();
        let near = (bounds.0 - around, bounds.1 + around);
        Mesh { triangles: ordered.collect(), place, bvh, bounds, near }
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
        let bvh = size_of_val(&self.bvh.nodes[..]) + size_of_val(&self.bvh.primitive_indices[..]);
        (size_of_val(&self.triangles[..]) + size_of_val(&self.place[..]) + bvh) as u64
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

    fn is_near(&self, p: DVec3) -> bool {
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
        let (origin, direction) = (ray.origin.as_vec3a(), ray.direction.as_vec3a());
        let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
        let mut best: Option<(f64, u32)> = None;
        let box_ray = BoxRay::new_inf(origin, direction);
        self.bvh.ray_traverse(box_ray, &mut RayHit::none(), |_, at| {
            let triangle = &self.triangles[at];
            let limit = best.map_or(f64::INFINITY, |(t, _)| t);
            let Some(t) = triangle.intersect(o, d, limit) else { return f32::INFINITY };
            let found = (t, triangle.primitive);
            if best.is_none_or(|b| found < b) {
                best = Some(found);
            }
            // Rounded up: a box that begins at this very distance may hold a lower primitive number.
            (t * (1.0 + 1e-6)) as f32
        });
        let (distance, primitive) = best?;
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
            return self.blocks_near(a, b);
        }
        let clipped = self.clip(o, end - o, 1.0);
        clipped.is_some_and(|(enter, leave)| {
            self.blocks_near((o + enter * (end - o)).as_vec3(), (o + leave * (end - o)).as_vec3())
        })
    }

    fn blocks_near(&self, a: Vec3, b: Vec3) -> bool {
        let (o, d) = (a.as_dvec3(), (b - a).as_dvec3());
        let box_ray = BoxRay::new(a.into(), (b - a).into(), 0.0, 1.0);
        !self.bvh.ray_traverse_miss(box_ray, |_, at| match self.triangles[at].intersect(o, d, 1.0) {
            Some(t) if t < 1.0 => 0.0,
            _ => f32::INFINITY,
        })
    }
}

fn build(triangles: &[[Vec3; 3]], bounds: (DVec3, DVec3)) -> Bvh2 {
    if triangles.is_empty() {
        return Bvh2::default();
    }
    // Twice the scene is the longest way of a ray inside it; 8 roundings of that are more than a slab test makes.
    let size = bounds.0.abs().max(bounds.1.abs()).max_element() + (bounds.1 - bounds.0).length();
    let margin = Vec3A::splat((8.0 / f64::from(1 << 24) * 2.0 * size) as f32);
    let boxes: Vec<Aabb> = triangles
        .iter()
        .map(|t| {
            let tight = Aabb::from_points(&t.map(Vec3A::from));
            Aabb::new(tight.min - margin, tight.max + margin)
        })
        .collect();
    build_bvh2(&boxes, BvhBuildParams::medium_build(), &mut Default::default())
}

impl Triangle {
    fn new(corners: [Vec3; 3], primitive: u32) -> Self {
        let [a, b, c] = corners.map(|p| p.as_dvec3());
        let normal = (b - a).cross(c - a);
        Triangle { corners, primitive, normal, offset: normal.dot(a) }
    }

    /// Parameter 0 < t <= limit at which the line o + t d crosses the triangle, edges included.
    #[inline(always)]
    fn intersect(&self, o: DVec3, d: DVec3, limit: f64) -> Option<f64> {
        let t = (self.offset - self.normal.dot(o)) / self.normal.dot(d);
        // Edge-on the quotient is infinite or undefined: a triangle seen edge-on is not there.
        if !(t > 0.0 && t <= limit && t.is_finite()) {
            return None;
        }
        let [a, b, c] = self.corners.map(|p| p.as_dvec3() - o);
        let edges = [d.dot(c.cross(b)), d.dot(a.cross(c)), d.dot(b.cross(a))];
        let one_side = edges.iter().all(|&e| e >= 0.0) || edges.iter().all(|&e| e <= 0.0);
        one_side.then_some(t)
    }
}
