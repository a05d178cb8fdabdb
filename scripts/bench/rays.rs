//! Closest hits per second, one thread: `cargo bench --bench rays -- [R|M|L ...]`.
//!
//! In the scenes of `segments.rs`: flights of trajectories, which are incoherent, one by one; and the rays of a camera with
//! 256 x 256 pixels in Morton order, one by one and in packets. Beside it `obvhs`'s own closest hit with its own
//! f32 triangles, on the same rays, by both of its hierarchies, compiled for the same instructions. Rounds are interleaved;
//! rates are medians. Times are CPU time of the thread.

mod common;
mod segments;

use common::thread_time;
use glam::Vec3A;
use lampyris::geometry::simd::{Isa, Kernel, Path};
use lampyris::geometry::{Geometry, Hit, Mesh, Ray};
use lampyris::tally::statistics;
use obvhs::BvhBuildParams;
use obvhs::bvh2::{Bvh2, builder::build_bvh2_from_tris};
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::RayHit;
use obvhs::triangle::Triangle;
use segments::{Flight, Scene, Segments, camera};

const RUNS: usize = 9;
const FLIGHTS: usize = 1 << 16;
const SIDE: u32 = 256;

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    for scene in Scene::ALL {
        if wanted.is_empty() || wanted.contains(&scene.letter().to_string()) {
            bench(scene);
        }
    }
}

/// How rays are traced.
#[derive(Clone, Copy, Debug)]
enum Way {
    Single,
    Packets,
    Bvh2,
    CwBvh,
}

fn bench(scene: Scene) {
    let segments = Segments::new(scene, 1, 1);
    let peer = Peer::new(&segments.triangles);
    let mut geometry = Geometry::new(Mesh::new(&segments.triangles), Vec::new(), Vec::new());
    let sets = [("flights", segments.flights[..FLIGHTS].to_vec()), ("camera", camera(SIDE))];
    println!("{}: {} triangles, millions of closest hits a second", scene.letter(), segments.triangles.len());
    for path in Path::ALL.into_iter().filter(|p| p.is_available()) {
        geometry = geometry.with_path(path);
        for (name, flights) in &sets {
            let ways = [Way::Single, Way::Packets, Way::Bvh2, Way::CwBvh];
            let mut rates = ways.map(|_| Vec::new());
            let mut met = ways.map(|_| 0);
            for _ in 0..RUNS {
                for (k, way) in ways.into_iter().enumerate() {
                    let start = thread_time();
                    met[k] = trace(way, &geometry, &peer, flights);
                    rates[k].push(flights.len() as f64 / (thread_time() - start).as_secs_f64() / 1e6);
                }
            }
            assert_eq!(met[0], met[1], "packets and single rays disagree");
            print!("  {:7} {name:8}", path.name());
            for ((way, rates), met) in ways.into_iter().zip(rates).zip(met) {
                let best = rates.iter().copied().fold(0.0, f64::max);
                let lost = flights.len() - met;
                print!(" {way:?} {:.2} (best {best:.2}, {lost} lost);", statistics::median(rates.into_iter()));
            }
            println!();
        }
    }
}

/// How many of `flights` meet anything.
fn trace(way: Way, geometry: &Geometry, peer: &Peer, flights: &[Flight]) -> usize {
    let ray = |&(origin, direction): &Flight| Ray { origin: origin.as_dvec3(), direction: direction.as_dvec3() };
    match way {
        Way::Single => {
            let meets = |flight: &&Flight| std::hint::black_box(&geometry.closest_hit(&ray(flight))).is_some();
            flights.iter().filter(meets).count()
        }
        Way::Packets => {
            let mut hits: Vec<Option<Hit>> = Vec::new();
            let mut met = 0;
            for chunk in flights.chunks(256) {
                let rays: Vec<Ray> = chunk.iter().map(ray).collect();
                hits.resize(rays.len(), None);
                geometry.closest_hits(&rays, &mut hits);
                met += std::hint::black_box(&hits).iter().flatten().count();
            }
            met
        }
        Way::Bvh2 => geometry.path().run(Theirs { peer, compressed: false, flights }),
        Way::CwBvh => geometry.path().run(Theirs { peer, compressed: true, flights }),
    }
}

/// Both hierarchies of `obvhs`, each with its triangles in its order.
struct Peer {
    binary: (Bvh2, Vec<Triangle>),
    compressed: (CwBvh, Vec<Triangle>),
}

impl Peer {
    fn new(triangles: &[segments::Triangle]) -> Self {
        let convert = |t: &segments::Triangle| Triangle { v0: t[0].into(), v1: t[1].into(), v2: t[2].into() };
        let all: Vec<_> = triangles.iter().map(convert).collect();
        let in_order = |order: &[u32]| order.iter().map(|&i| all[i as usize]).collect::<Vec<_>>();
        let (params, mut time) = (BvhBuildParams::medium_build(), Default::default());
        let binary = build_bvh2_from_tris(&all, params, &mut time);
        let compressed = build_cwbvh_from_tris(&all, params, &mut time);
        let orders = (in_order(&binary.primitive_indices), in_order(&compressed.primitive_indices));
        Peer { binary: (binary, orders.0), compressed: (compressed, orders.1) }
    }
}

/// The rays through one of them.
struct Theirs<'a> {
    peer: &'a Peer,
    compressed: bool,
    flights: &'a [Flight],
}

impl Kernel for Theirs<'_> {
    type Output = usize;

    #[inline(always)]
    fn run<I: Isa>(self) -> usize {
        let mut met = 0;
        for &(origin, direction) in self.flights {
            let ray = obvhs::ray::Ray::new(Vec3A::from(origin), Vec3A::from(direction), 0.0, 1e30);
            let mut hit = RayHit::none();
            let found = if self.compressed {
                let (tree, triangles) = &self.peer.compressed;
                tree.ray_traverse(ray, &mut hit, |ray, at| triangles[at].intersect(ray))
            } else {
                let (tree, triangles) = &self.peer.binary;
                tree.ray_traverse(ray, &mut hit, |ray, at| triangles[at].intersect(ray))
            };
            std::hint::black_box(&hit);
            met += usize::from(found);
        }
        met
    }
}
