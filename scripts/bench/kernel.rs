//! Segments per second of the visibility kernel alone, one thread: `cargo bench --bench kernel -- [R|M|L ...]`.
//!
//! The workload of `segments.rs`: 8 vertices against the 512 x 512 points that a camera sees, each segment from the vertex
//! to a point where both cosines are positive; beside it closest hits along the flights of trajectories. Every path that the
//! processor has is measured, the paths in turn, and must find the same segments blocked. Times are CPU time of the thread.
//!
//! `cargo bench --bench kernel -- leaks` looks for segments that leave closed surfaces instead.

mod common;
mod leaks;
mod segments;

use common::thread_time;
use lampyris::geometry::simd::Path;
use lampyris::geometry::visibility::{BUNDLE, BUNDLES, Lanes, Points, Scratch, TILE};
use lampyris::geometry::{Geometry, Mesh, Ray, kd_order};
use lampyris::math::Vec3;
use lampyris::tally::statistics;
use segments::{Place, Scene, Segments};
use std::time::{Duration, Instant};

const RUNS: usize = 7;
const VERTICES: usize = 8;
const SIDE: u32 = 512;

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    if wanted.contains(&"leaks".to_string()) {
        return leaks::search();
    }
    for scene in Scene::ALL {
        if wanted.is_empty() || wanted.contains(&scene.letter().to_string()) {
            bench(scene);
        }
    }
}

fn bench(scene: Scene) {
    let mut segments = Segments::new(scene, SIDE, VERTICES);
    let places: Vec<_> = segments.receivers.iter().map(|p| p.point.as_dvec3()).collect();
    segments.receivers = kd_order(&places).into_iter().map(|i| segments.receivers[i as usize]).collect();
    let start = Instant::now();
    let mut geometry = Geometry::new(Mesh::new(&segments.triangles), Vec::new(), Vec::new());
    let built = start.elapsed();
    let bytes = geometry.bytes() as f64 / segments.triangles.len() as f64;
    println!(
        "{}: {} triangles, {:.0} bytes each, built in {:.2?}",
        scene.letter(),
        segments.triangles.len(),
        bytes,
        built
    );
    let points = |receivers: &[Place]| {
        let points: Vec<Vec3> = receivers.iter().map(|p| p.point).collect();
        Points::new(&geometry, &points)
    };
    let tiles: Vec<Points> = segments.receivers.chunks(TILE).map(points).collect();
    let facing: Vec<Vec<Lanes>> = segments.vertices.iter().map(|v| facing(v, &segments.receivers)).collect();
    let count = |lanes: &[Lanes]| lanes.iter().flatten().map(|l| u64::from(l.count_ones())).sum::<u64>();
    let traced: u64 = facing.iter().map(|lanes| count(lanes)).sum();
    let paths: Vec<Path> = Path::ALL.into_iter().filter(|p| p.is_available()).collect();
    let mut rates = vec![Vec::new(); paths.len()];
    let mut hits = vec![Vec::new(); paths.len()];
    let mut blocked = Vec::new();
    for _ in 0..RUNS {
        for (k, &path) in paths.iter().enumerate() {
            geometry = geometry.with_path(path);
            let mut seen = facing.clone();
            let start = thread_time();
            for (vertex, seen) in segments.vertices.iter().zip(&mut seen) {
                shadow(&geometry, vertex.point, &tiles, seen);
            }
            rates[k].push(rate(traced, thread_time() - start));
            blocked.push(traced - seen.iter().map(|lanes| count(lanes)).sum::<u64>());
            hits[k].push(closest_hits(&geometry, &segments));
        }
    }
    assert!(blocked.iter().all(|&b| b == blocked[0]), "the paths disagree: {blocked:?}");
    println!("  {traced} segments, {} blocked", blocked[0]);
    for ((path, rates), hits) in paths.iter().zip(rates).zip(hits) {
        let best = rates.iter().copied().fold(0.0, f64::max);
        let (rate, hits) = (statistics::median(rates.into_iter()), statistics::median(hits.into_iter()));
        println!("  {:7} {rate:8.1} M segments/s (best {best:.1}), {hits:.2} M closest hits/s", path.name());
    }
}

/// The points of each tile that face `vertex` and that it faces.
fn facing(vertex: &Place, receivers: &[Place]) -> Vec<Lanes> {
    let lanes = |tile: &[Place]| {
        let mut lanes = [0; BUNDLES];
        for (i, receiver) in tile.iter().enumerate() {
            lanes[i / BUNDLE] |= u16::from(vertex.faces(receiver)) << (i % BUNDLE);
        }
        lanes
    };
    receivers.chunks(TILE).map(lanes).collect()
}

/// One vertex against all tiles.
fn shadow(geometry: &Geometry, apex: Vec3, tiles: &[Points], seen: &mut [Lanes]) {
    let mut scratch = Scratch::default();
    for (tile, seen) in tiles.iter().zip(seen) {
        geometry.hide(&geometry.apex(apex), tile, seen, &mut scratch);
    }
}

/// Millions a second along the flights of trajectories.
fn closest_hits(geometry: &Geometry, segments: &Segments) -> f64 {
    let flights = &segments.flights[..1 << 17];
    let start = thread_time();
    let met = flights.iter().filter(|(origin, direction)| {
        let ray = Ray { origin: origin.as_dvec3(), direction: direction.as_dvec3() };
        geometry.closest_hit(&ray).is_some()
    });
    std::hint::black_box(met.count());
    rate(flights.len() as u64, thread_time() - start)
}

/// Millions a second.
fn rate(count: u64, time: Duration) -> f64 {
    count as f64 / time.as_secs_f64() / 1e6
}
