//! 10^8 segments from inside a closed surface to outside, a quarter each through edges, corners and the middle of edges: every one
//! must be blocked, on every path.

use super::common::thread_time;
use super::segments::{Scene, Triangle};
use super::{rate, shadow};
use lampyris::geometry::simd::Path;
use lampyris::geometry::visibility::{BUNDLES, Points, TILE};
use lampyris::geometry::{Geometry, Mesh};
use lampyris::math::{DVec3, Vec3};
use lampyris::random::{Domain, Generator, Stream, sphere};

/// Segments of all paths and surfaces.
const SEGMENTS: u64 = 100_000_000;

/// A closed surface: what a ball around its middle encloses, and what a larger one keeps out.
struct Closed {
    name: &'static str,
    triangles: Vec<Triangle>,
    middle: DVec3,
    /// Radius of the ball inside \[m\].
    inside: f64,
    /// Radius of the ball around it \[m\].
    outside: f64,
}

/// Counts the segments that get out; panics when one does.
pub fn search() {
    let room = Scene::Room.triangles();
    let bumpy = Scene::Object.triangles().split_off(24);
    let closed = [
        Closed { name: "room", triangles: room, middle: DVec3::new(3.0, 2.0, 1.5), inside: 1.4, outside: 3.91 },
        Closed { name: "bumpy", triangles: bumpy, middle: DVec3::new(2.6, 2.2, 1.3), inside: 0.45, outside: 1.03 },
    ];
    let paths: Vec<Path> = Path::ALL.into_iter().filter(|p| p.is_available()).collect();
    let each = SEGMENTS.div_ceil((closed.len() * paths.len() * TILE) as u64);
    for closed in &closed {
        let (start, leaks) = (thread_time(), closed.leaks(&paths, each));
        let segments = each * (paths.len() * TILE) as u64;
        let rate = rate(segments, thread_time() - start);
        println!("{}: {leaks} of {segments} segments leak ({rate:.1} M/s with their making)", closed.name);
        assert_eq!(leaks, 0, "{}", closed.name);
    }
}

impl Closed {
    fn leaks(&self, paths: &[Path], tiles: u64) -> u64 {
        // Specks far away, so that points outside are near the mesh and asked by the kernel, not one by one.
        let speck = |at: DVec3| [at, at + 1e-5 * DVec3::X, at + 1e-5 * DVec3::Y].map(|p| p.as_vec3());
        let around = 3.0 * self.outside * DVec3::new(1.0, 0.99, 0.98);
        let specks = [speck(self.middle + around), speck(self.middle - around)];
        let all: Vec<Triangle> = self.triangles.iter().copied().chain(specks).collect();
        let mut geometry = Geometry::new(Mesh::new(&all), Vec::new(), Vec::new());
        let mut leaks = 0;
        for i in 0..tiles {
            let mut rng = Stream::new(71, Domain::Receiver, self.name).generator(i);
            let apex = (self.middle + self.inside * rng.uniform() * sphere(rng.uniform2())).as_vec3();
            let one = i.is_multiple_of(2).then(|| rng.below(self.triangles.len() as u32));
            let points: Vec<Vec3> = (0..TILE).map(|_| self.beyond(&mut rng, apex, one)).collect();
            for &path in paths {
                geometry = geometry.with_path(path);
                let tiles = [Points::new(&geometry, &points)];
                let mut seen = [[u16::MAX; BUNDLES]];
                shadow(&geometry, apex, &tiles, &mut seen);
                leaks += seen[0].iter().map(|lanes| u64::from(lanes.count_ones())).sum::<u64>();
            }
        }
        leaks
    }

    /// A point outside that `apex` sees behind a corner or an edge of triangle `one`, or of any.
    fn beyond(&self, rng: &mut Generator, apex: Vec3, one: Option<u32>) -> Vec3 {
        let triangle = one.unwrap_or_else(|| rng.below(self.triangles.len() as u32));
        let [a, b, c] = self.triangles[triangle as usize].map(|p| p.as_dvec3());
        let (u, v) = (rng.uniform(), rng.uniform());
        let targets = [a, a + (b - a) * u, 0.5 * (a + b), a + (b - a) * (0.5 * u) + (c - a) * (0.5 * v)];
        let away = targets[rng.below(4) as usize].as_vec3() - apex;
        apex + away * ((self.outside * (1.001 + rng.uniform()) + self.inside) as f32 / away.length())
    }
}
