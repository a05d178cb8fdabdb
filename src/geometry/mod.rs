//! Where surfaces are: the first hit of a ray, and whether two points see each other.
//!
//! Coordinates are re-centred metres: the middle of the bounded geometry is the origin, so that f32 keeps its
//! digits. Triangles live in f32 behind a [`Mesh`]; infinite planes and spheres are exact in f64. Geometry knows
//! nothing of light, reflectance or pixels: a surface point is a primitive number, a position and a normal.
//!
//! Segments of visibility run between *lifted* points: each surface point is moved off its surface once, whatever
//! it is connected to, by 16 2^-24 (max |p| + D), with D the diagonal of the bounded geometry, or |p| itself where a
//! point on an infinite plane lies farther out. That is a few roundings of an f32 coordinate; the distance, cosines
//! and geometric factor of a connection use the points themselves.

#![allow(clippy::needless_range_loop, reason = "several arrays go by one axis, lane or channel")]

mod apex;
mod binary;
mod bvh;
pub mod harmonic;
mod mesh;
mod ordering;
mod packet;
mod pages;
mod plane;
mod planes;
mod points;
mod proximity;
mod ray;
mod shaft;
pub mod simd;
mod sphere;
mod veils;
pub mod visibility;

pub use apex::Apex;
pub use bvh::Build;
pub use harmonic::Harmonic;
pub use mesh::Mesh;
pub use ordering::kd_order;
pub use plane::Plane;
pub use sphere::Sphere;
pub use veils::Crossing;

use crate::math::{DVec3, Vec3};
use simd::Path;

/// Lift of a surface point in units of its coordinate size.
const LIFT: f64 = 16.0 / (1u64 << 24) as f64;

/// A half line; `direction` is a unit vector.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Start \[m\].
    pub origin: DVec3,
    /// Unit vector.
    pub direction: DVec3,
}

/// A point of a surface met by a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the start of the ray \[m\].
    pub distance: f64,
    /// The point, on the surface to f64 accuracy \[m\].
    pub position: DVec3,
    /// Unit geometric normal on the side of the ray.
    pub normal: DVec3,
    /// True when the ray came from the front.
    pub front: bool,
    /// Triangles first, then spheres, then planes, then harmonics.
    pub primitive: u32,
}

/// All surfaces of a scene.
#[derive(Default)]
pub struct Geometry {
    mesh: Mesh,
    /// Triangles that do not block, where there are any.
    veils: Option<Mesh>,
    spheres: Vec<Sphere>,
    planes: Vec<Plane>,
    harmonics: Vec<Harmonic>,
    /// max |p| + D of the bounded geometry \[m\].
    extent: f64,
}

impl Geometry {
    /// Joins triangles, spheres and planes; coordinates are re-centred already.
    pub fn new(mesh: Mesh, spheres: Vec<Sphere>, planes: Vec<Plane>) -> Self {
        Geometry { mesh, spheres, planes, ..Geometry::default() }.measured()
    }

    /// The same geometry with spheres and planes, re-centred too.
    pub fn with_quadrics(self, spheres: Vec<Sphere>, planes: Vec<Plane>) -> Self {
        Geometry { spheres, planes, ..self }.measured()
    }

    /// The same geometry and star-shaped objects, re-centred too.
    pub fn with_harmonics(mut self, harmonics: Vec<Harmonic>) -> Self {
        self.harmonics = harmonics;
        let (low, high) = self.bounds();
        // Lifted points may stand a little beyond.
        let around = 0.01 * (high - low).max_element();
        let shelled = |h: Harmonic| h.shelled((low - around, high + around));
        self.harmonics = std::mem::take(&mut self.harmonics).into_iter().map(shelled).collect();
        self.measured()
    }

    fn measured(mut self) -> Self {
        let (low, high) = self.bounds();
        self.extent =
            if low.x <= high.x { low.abs().max(high.abs()).max_element() + (high - low).length() } else { 1.0 };
        self
    }

    /// Corners of the box around all bounded geometry \[m\].
    fn bounds(&self) -> (DVec3, DVec3) {
        let spheres = self.spheres.iter().map(|s| (s.center - s.radius, s.center + s.radius));
        let veils = self.veils.iter().map(Mesh::bounds);
        spheres.chain(self.harmonics.iter().map(Harmonic::bounds)).chain(veils).fold(self.mesh.bounds(), union)
    }

    /// Number of triangles.
    pub fn triangles(&self) -> u64 {
        (self.mesh.len() + self.veils.as_ref().map_or(0, Mesh::len)) as u64
    }

    /// Memory of triangles, acceleration structure and what star-shaped objects add to their series \[bytes\].
    pub fn bytes(&self) -> u64 {
        let veils = self.veils.as_ref().map_or(0, Mesh::bytes);
        self.mesh.bytes() + veils + self.harmonics.iter().map(Harmonic::bytes).sum::<u64>()
    }

    /// Corners of the triangle `primitive` \[m\], as the rays see it.
    pub fn triangle(&self, primitive: u32) -> [DVec3; 3] {
        match &self.veils {
            Some(veils) if veils.has(primitive) => veils.triangle(primitive),
            _ => self.mesh.triangle(primitive),
        }
    }

    /// The star-shaped objects.
    pub fn harmonics(&self) -> &[Harmonic] {
        &self.harmonics
    }

    /// True when there are surfaces without bounds.
    pub fn is_unbounded(&self) -> bool {
        !self.planes.is_empty()
    }

    /// Centre and radius of a sphere around all bounded geometry \[m\].
    pub fn bounding_sphere(&self) -> (DVec3, f64) {
        let (low, high) = self.bounds();
        if low.x > high.x { (DVec3::ZERO, 0.0) } else { (0.5 * (low + high), 0.5 * (high - low).length()) }
    }

    /// The first surface along `ray`, a veil included; equal distances go to the lower primitive number, and to what blocks.
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        self.closest_hit_within(ray, f64::INFINITY)
    }

    /// The same where it is at most `limit` away \[m\], else `None`: the shorter, the faster.
    pub fn closest_hit_within(&self, ray: &Ray, limit: f64) -> Option<Hit> {
        let hit = self.closest_block(ray, limit);
        if self.veils.is_some() { self.or_veil(ray, hit, limit) } else { hit }
    }

    /// The same of what blocks.
    fn closest_block(&self, ray: &Ray, limit: f64) -> Option<Hit> {
        let hit = self.mesh.closest_hit(ray, limit);
        if !self.has_others() {
            return hit;
        }
        self.closest_of_all(ray, hit).filter(|hit| hit.distance <= limit)
    }

    /// A veil along `ray` before `hit`, else `hit`.
    fn or_veil(&self, ray: &Ray, hit: Option<Hit>, limit: f64) -> Option<Hit> {
        let end = hit.map_or(limit, |hit| hit.distance);
        let veil = self.veils.as_ref().and_then(|veils| veils.closest_hit(ray, end));
        veil.filter(|veil| hit.is_none() || veil.distance < end).or(hit)
    }

    /// What [`Geometry::closest_hit`] gives for each of `rays`, to `hits`, of the same length. Rays from one point go
    /// several times faster in this way, where 16 that follow each other point in nearly the same direction.
    pub fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        assert_eq!(rays.len(), hits.len(), "a hit for each ray");
        self.mesh.closest_hits(rays, hits);
        if !self.spheres.is_empty() || !self.planes.is_empty() {
            for (ray, hit) in rays.iter().zip(&mut *hits) {
                *hit = self.closest_of_quadrics(ray, *hit);
            }
        }
        for (number, harmonic) in (self.first_harmonic()..).zip(&self.harmonics) {
            harmonic.hits(rays, hits, number);
        }
        if self.veils.is_some() {
            for (ray, hit) in rays.iter().zip(hits) {
                *hit = self.or_veil(ray, *hit, f64::INFINITY);
            }
        }
    }

    /// True where there are surfaces beside triangles.
    fn has_others(&self) -> bool {
        !self.spheres.is_empty() || !self.planes.is_empty() || !self.harmonics.is_empty()
    }

    /// The first surface along `ray`, which meets the triangles at `best`.
    fn closest_of_all(&self, ray: &Ray, best: Option<Hit>) -> Option<Hit> {
        let mut best = self.closest_of_quadrics(ray, best);
        for (number, harmonic) in (self.first_harmonic()..).zip(&self.harmonics) {
            best = nearer(best, number, |limit| harmonic.hit(ray, limit));
        }
        best
    }

    /// The same without what is given by series.
    fn closest_of_quadrics(&self, ray: &Ray, mut best: Option<Hit>) -> Option<Hit> {
        let mut numbers = self.triangles() as u32..;
        for (sphere, number) in self.spheres.iter().zip(&mut numbers) {
            best = nearer(best, number, |_| sphere.hit(ray));
        }
        for (plane, number) in self.planes.iter().zip(&mut numbers) {
            best = nearer(best, number, |_| plane.hit(ray));
        }
        best
    }

    /// The primitive number of the first star-shaped object.
    fn first_harmonic(&self) -> u32 {
        self.triangles() as u32 + (self.spheres.len() + self.planes.len()) as u32
    }

    /// How far points of bounded geometry are lifted \[m\]: thinner things cannot cast a shadow on what touches them.
    pub fn lift_length(&self) -> f64 {
        LIFT * self.extent
    }

    /// The point `position` lifted off the surface along `normal`, as the start of rays and segments \[m\].
    pub fn lift(&self, position: DVec3, normal: DVec3) -> DVec3 {
        position + normal * (LIFT * self.extent.max(position.abs().max_element()))
    }

    /// True when no surface but veils crosses the segment between two lifted points.
    pub fn visible(&self, a: Vec3, b: Vec3) -> bool {
        self.planes.iter().all(|p| !p.blocks(a, b))
            && self.spheres.iter().all(|s| !s.blocks(a, b))
            && self.harmonics.iter().all(|h| !h.blocks(a, b))
            && !self.mesh.blocks(a, b)
    }

    /// The same geometry with its kernels on `path`, which the processor must have: for tests.
    pub fn with_path(mut self, path: Path) -> Self {
        self.mesh.path = path;
        self.veils.iter_mut().for_each(|v| v.path = path);
        self.harmonics.iter_mut().for_each(|h| h.set_path(path));
        self
    }

    /// Instructions of its kernels.
    pub fn path(&self) -> Path {
        self.mesh.path
    }

    /// True when the first surface along each of 14 fixed directions is met from behind, on a side that `absorbs`:
    /// the point lies inside a solid.
    pub fn is_inside(&self, point: DVec3, absorbs: impl Fn(&Hit) -> bool) -> bool {
        probe_directions().all(|direction| {
            let hit = self.closest_block(&Ray { origin: point, direction }, f64::INFINITY);
            hit.is_some_and(|h| !h.front && absorbs(&h))
        })
    }
}

/// The axes and the diagonals of a cube, turned a little so that no probe runs along a wall.
fn probe_directions() -> impl Iterator<Item = DVec3> {
    let corners = [-1.0, 1.0];
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|a| [a, -a]);
    let diagonals = corners
        .into_iter()
        .flat_map(move |x| corners.into_iter().flat_map(move |y| corners.map(|z| DVec3::new(x, y, z))));
    let tilt = DVec3::new(0.0131, -0.0071, 0.0173);
    axes.chain(diagonals).map(move |d| (d.normalize() + tilt).normalize())
}

/// `best`, or what `find` finds nearer as the primitive `number`.
fn nearer(best: Option<Hit>, number: u32, find: impl FnOnce(f64) -> Option<Hit>) -> Option<Hit> {
    let limit = best.map_or(f64::INFINITY, |b| b.distance);
    find(limit).filter(|hit| hit.distance < limit).map(|hit| Hit { primitive: number, ..hit }).or(best)
}

fn union(a: (DVec3, DVec3), b: (DVec3, DVec3)) -> (DVec3, DVec3) {
    (a.0.min(b.0), a.1.max(b.1))
}

/// The hit at `distance` of a surface with unit normal `normal` (front side) and `position`; the number of the
/// primitive is filled in by [`Geometry`].
fn hit(ray: &Ray, distance: f64, position: DVec3, normal: DVec3) -> Hit {
    let front = ray.direction.dot(normal) < 0.0;
    Hit { distance, position, normal: if front { normal } else { -normal }, front, primitive: 0 }
}
