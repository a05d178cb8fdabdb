//! Segments to measure visibility kernels with: three scenes, the surface points that a camera sees in them as
//! receivers, and the vertices of trajectories of a lamp.
//!
//! The workload is every vertex against every receiver where both cosines are positive. The scenes are a room of
//! 6 x 4 x 3 m with a column and a box, the room with a bumpy sphere, and the room with ten of them. Everything is
//! in f32 and reproducible; the closest hits that make the points are those of `obvhs`, so that no kernel of ours
//! takes part in what it is measured with. [`Segments::write`] hands the same segments to other programs.
#![allow(dead_code, reason = "each bench uses its own part")]

use glam::{Vec3, vec3};
use libm::{cosf, sinf};
use obvhs::BvhBuildParams;
use obvhs::bvh2::{Bvh2, builder::build_bvh2_from_tris};
use obvhs::ray::{Ray, RayHit};
use rand_core::Rng;
use rand_pcg::Pcg64Mcg;
use std::f32::consts::{PI, TAU};
use std::io::{self, Write};

/// Corners \[m\].
pub type Triangle = [Vec3; 3];

/// How far points are lifted along their normals \[m\].
pub const LIFT: f32 = 1e-4;
/// Quadrilaterals around and from pole to pole of a bumpy sphere: 100 488 triangles.
const BUMPY: (usize, usize) = (316, 160);
/// Vertices of one trajectory, without the lamp.
const LENGTH: usize = 6;
/// Flights of trajectories that are kept for the measurement of closest hits.
const FLIGHTS: usize = 1 << 19;

/// The scenes by the size of their triangle count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scene {
    /// Room, column and box: 34 triangles (the box lacks a face).
    Room,
    /// Room, column and a bumpy sphere: 100 512 triangles.
    Object,
    /// Room, column and ten bumpy spheres: 1 004 904 triangles.
    Crowd,
}

impl Scene {
    /// All, by triangle count.
    pub const ALL: [Scene; 3] = [Scene::Room, Scene::Object, Scene::Crowd];

    /// The letter of the scene in tables and file names.
    pub fn letter(self) -> char {
        match self {
            Scene::Room => 'R',
            Scene::Object => 'M',
            Scene::Crowd => 'L',
        }
    }

    /// The scene's triangles \[m\].
    pub fn triangles(self) -> Vec<Triangle> {
        let mut all = Vec::new();
        cuboid(&mut all, Vec3::ZERO, vec3(6.0, 4.0, 3.0));
        cuboid(&mut all, vec3(3.6, 1.2, 0.0), vec3(4.0, 1.6, 3.0));
        match self {
            Scene::Room => {
                cuboid(&mut all, vec3(1.6, 2.4, 0.0), vec3(2.4, 3.2, 0.8));
                all.truncate(34);
            }
            Scene::Object => bumpy_sphere(&mut all, vec3(2.6, 2.2, 1.3), 0.75, 0.3),
            Scene::Crowd => {
                let mut numbers = Numbers::new(5);
                for i in 0..10 {
                    let (column, row) = ((i % 5) as f32, (i / 5) as f32);
                    let y = 0.9 + 2.0 * row + 0.4 * numbers.uniform();
                    let centre = vec3(0.8 + 1.1 * column, y, 0.6 + 1.4 * numbers.uniform());
                    bumpy_sphere(&mut all, centre, 0.42, i as f32);
                }
            }
        }
        all
    }
}

/// A point on a surface, lifted by [`LIFT`], and the unit normal on the side from which it was seen.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Position \[m\].
    pub point: Vec3,
    /// Unit normal.
    pub normal: Vec3,
}

impl Place {
    /// True if each of the two lies in front of the other's surface: then the segment between them is traced.
    pub fn faces(&self, other: &Place) -> bool {
        let way = other.point - self.point;
        way.dot(self.normal) > 0.0 && way.dot(other.normal) < 0.0
    }
}

/// A flight of a trajectory: where it starts \[m\] and its unit direction.
pub type Flight = (Vec3, Vec3);

/// A scene with its receivers and vertices.
pub struct Segments {
    /// The scene.
    pub triangles: Vec<Triangle>,
    /// Hits of a square camera's pixel centres, in Morton order of the pixels.
    pub receivers: Vec<Place>,
    /// The first vertices of the trajectories.
    pub vertices: Vec<Place>,
    /// Flights of the trajectories, which are incoherent.
    pub flights: Vec<Flight>,
}

impl Segments {
    /// `side` x `side` receivers (a power of two) and `vertices` vertices in `scene`.
    pub fn new(scene: Scene, side: u32, vertices: usize) -> Self {
        let triangles = scene.triangles();
        let tracer = Tracer::new(&triangles);
        let receivers = seen_by_camera(&tracer, side);
        let (vertices, flights) = trajectories(&tracer, vertices);
        Segments { triangles, receivers, vertices, flights }
    }

    /// Writes counts (triangles, receivers, vertices, flights: u32), then corners, then point and normal of each
    /// receiver and vertex, then start and direction of each flight; coordinates are f32, all little-endian.
    pub fn write(&self, to: &mut impl Write) -> io::Result<()> {
        for count in [self.triangles.len(), self.receivers.len(), self.vertices.len(), self.flights.len()] {
            to.write_all(&(count as u32).to_le_bytes())?;
        }
        let places = self.receivers.iter().chain(&self.vertices).flat_map(|p| [p.point, p.normal]);
        let flights = self.flights.iter().flat_map(|&(start, direction)| [start, direction]);
        for vector in self.triangles.iter().flatten().copied().chain(places).chain(flights) {
            for coordinate in vector.to_array() {
                to.write_all(&coordinate.to_le_bytes())?;
            }
        }
        Ok(())
    }
}

/// The closest hit in a scene.
struct Tracer<'a> {
    triangles: &'a [Triangle],
    solid: Vec<obvhs::triangle::Triangle>,
    tree: Bvh2,
}

impl<'a> Tracer<'a> {
    fn new(triangles: &'a [Triangle]) -> Self {
        let convert = |t: &Triangle| obvhs::triangle::Triangle { v0: t[0].into(), v1: t[1].into(), v2: t[2].into() };
        let solid: Vec<_> = triangles.iter().map(convert).collect();
        let tree = build_bvh2_from_tris(&solid, BvhBuildParams::fast_build(), &mut Default::default());
        Tracer { triangles, solid, tree }
    }

    /// Where the flight ends; none if it leaves the scene.
    fn hit(&self, (start, direction): Flight) -> Option<Place> {
        let ray = Ray::new(start.into(), direction.into(), 0.0, 1e30);
        let mut hit = RayHit::none();
        let order = &self.tree.primitive_indices;
        let intersect = |ray: &Ray, at: usize| self.solid[order[at] as usize].intersect(ray);
        if !self.tree.ray_traverse(ray, &mut hit, intersect) {
            return None;
        }
        let [a, b, c] = self.triangles[order[hit.primitive_id as usize] as usize];
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        Some(Place { point: start + direction * hit.t + normal * LIFT, normal })
    }
}

/// What the centres of the camera's pixels see, pixels in Morton order.
fn seen_by_camera(tracer: &Tracer, side: u32) -> Vec<Place> {
    camera(side).into_iter().map(|flight| tracer.hit(flight).expect("the room is closed")).collect()
}

/// The rays through the centres of the camera's pixels, `side` x `side` in Morton order.
pub fn camera(side: u32) -> Vec<Flight> {
    let eye = vec3(0.3, 0.35, 1.9);
    let forward = (vec3(3.6, 2.6, 1.1) - eye).normalize();
    let right = forward.cross(Vec3::Z).normalize();
    let up = right.cross(forward);
    let across = |index: u32| ((index as f32 + 0.5) / side as f32 * 2.0 - 1.0) * 0.75;
    let pixel = |index: u32| {
        let (u, v) = (across(even_bits(index)), across(even_bits(index >> 1)));
        (eye, (forward + right * u - up * v).normalize())
    };
    (0..side * side).map(pixel).collect()
}

/// Vertices of trajectories from a lamp, the first `count`, and the first [`FLIGHTS`] flights or a few more.
fn trajectories(tracer: &Tracer, count: usize) -> (Vec<Place>, Vec<Flight>) {
    let lamp = vec3(4.6, 2.2, 2.6);
    let mut numbers = Numbers::new(77);
    let (mut vertices, mut flights) = (Vec::new(), Vec::new());
    while vertices.len() < count || flights.len() < FLIGHTS {
        let mut flight = (lamp, numbers.direction());
        for _ in 0..LENGTH {
            flights.push(flight);
            let Some(vertex) = tracer.hit(flight) else { break };
            vertices.push(vertex);
            flight = (vertex.point, (vertex.normal + numbers.direction() * 0.999).normalize());
        }
    }
    vertices.truncate(count);
    (vertices, flights)
}

/// The bits of `index` with even numbers, pressed together.
fn even_bits(index: u32) -> u32 {
    (0..16).map(|bit| ((index >> (2 * bit)) & 1) << bit).sum()
}

/// Random numbers in f32.
struct Numbers(Pcg64Mcg);

impl Numbers {
    fn new(seed: u64) -> Self {
        Numbers(Pcg64Mcg::new(0xcafef00dd15ea5e5_u128 ^ (u128::from(seed) << 17) | 1))
    }

    /// Uniform in [0, 1).
    fn uniform(&mut self) -> f32 {
        (self.0.next_u32() >> 8) as f32 / (1 << 24) as f32
    }

    /// A unit vector, uniform on the sphere.
    fn direction(&mut self) -> Vec3 {
        let z = 2.0 * self.uniform() - 1.0;
        let angle = self.uniform() * TAU;
        let radius = (1.0 - z * z).max(0.0).sqrt();
        vec3(radius * cosf(angle), radius * sinf(angle), z)
    }
}

fn quadrilateral(to: &mut Vec<Triangle>, a: Vec3, b: Vec3, c: Vec3, d: Vec3) {
    to.push([a, b, c]);
    to.push([a, c, d]);
}

/// The surface of the box between two corners \[m\]: 12 triangles.
fn cuboid(to: &mut Vec<Triangle>, low: Vec3, high: Vec3) {
    let corner = |bits: usize| {
        let side = |axis: usize| if bits >> axis & 1 == 1 { high[axis] } else { low[axis] };
        vec3(side(0), side(1), side(2))
    };
    for face in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
        let [a, b, c, d] = face.map(corner);
        quadrilateral(to, a, b, c, d);
    }
}

/// An ellipsoid of about `radius` \[m\] with bumps of three sizes; spheres of different `phase` differ.
fn bumpy_sphere(to: &mut Vec<Triangle>, centre: Vec3, radius: f32, phase: f32) {
    let (around, along) = BUMPY;
    let corner = |i: usize, j: usize| {
        let u = (i % around) as f32 / around as f32 * TAU;
        let v = j as f32 / along as f32 * PI;
        let ring = sinf(v);
        let direction = vec3(ring * cosf(u), ring * sinf(u), cosf(v));
        centre + direction * radius * bumps(u, v, phase) * vec3(0.8, 0.9, 1.15)
    };
    for j in 0..along {
        for i in 0..around {
            let (a, b, c, d) = (corner(i, j), corner(i, j + 1), corner(i + 1, j + 1), corner(i + 1, j));
            if j != 0 {
                to.push([a, b, d]);
            }
            if j != along - 1 {
                to.push([d, b, c]);
            }
        }
    }
}

/// The radius of the bumpy sphere at longitude `u` and polar angle `v` \[rad\], in units of its mean; none at the poles.
fn bumps(u: f32, v: f32, phase: f32) -> f32 {
    let ring = sinf(v);
    let large = 0.12 * sinf(5.0 * u + phase) * ring * ring * cosf(4.0 * v);
    let middle = 0.05 * sinf(17.0 * u) * sinf(13.0 * v + phase) * ring;
    let small = 0.015 * sinf(61.0 * u + phase) * sinf(47.0 * v) * ring;
    1.0 + large + middle + small
}
