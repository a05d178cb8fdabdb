//! Connections per second of one thread, and trajectories per second: `cargo bench --bench connections`.
//!
//! First the connection loop by itself, on the workload of `segments.rs`: lux-meters in the points that a camera sees, and
//! vertices of trajectories six to a history; a connection is one whose cosines are both positive. Then whole batches.
//!
//! Receivers are the pixels of a camera, connected to the vertices of one batch, visibility and sums included.
//! Times are CPU time of the thread, medians of several runs; on a shared machine compare interleaved runs only.

mod common;
mod segments;

use common::{load, prepare, thread_time};
use lampyris::farm::pilot::bounds;
use lampyris::farm::realization::Realization;
use lampyris::geometry::kd_order;
use lampyris::math::{DVec3, Vec3};
use lampyris::photometry::Colour;
use lampyris::random::sobol::PointSet;
use lampyris::random::{Domain, Stream};
use lampyris::scene::{Model, Reflectance, Surface};
use lampyris::tally::statistics;
use lampyris::transport::connection::{Connectors, Link, Rule, TILE, Tile, connect};
use lampyris::transport::receiver::{Receiver, Response};
use lampyris::transport::trajectory::{Vertex, trace};
use lampyris::validate::scenes::{UP, lambert, omni, point};
use segments::{Place, Segments};

const RUNS: usize = 7;
const HISTORIES: u64 = 64;

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    pool.install(|| {
        for which in segments::Scene::ALL {
            connection_loop(which, "lux-meters, matt vertices", Reflectance::Lambert(Colour::grey(0.5)));
        }
        let plastic = Reflectance::metallic_roughness(Colour::grey(0.5), 0.0, 0.5);
        connection_loop(segments::Scene::ALL[0], "eyes on GGX over matt, vertices of the same", plastic);
        let metal = Reflectance::metallic_roughness(Colour::grey(0.5), 1.0, 0.5);
        connection_loop(segments::Scene::ALL[0], "eyes on GGX of metal, vertices of the same", metal);
        for (name, side) in [("room", 128), ("cornell", 128), ("blender_room", 64)] {
            bench(name, side);
        }
        points();
    });
}

/// Visibility, factors and sums: the vertices of a scene of `segments.rs` connected to its receivers.
fn connection_loop(which: segments::Scene, what: &str, reflectance: Reflectance) {
    let segments = Segments::new(which, 512, 48);
    let count = segments.triangles.len();
    let matt = reflectance.lambert().is_some();
    let surface = Surface { double_sided: true, reflectance, ..lambert(0.5, 0.0) };
    let model = Model {
        positions: segments.triangles.iter().flatten().map(|p| p.as_dvec3()).collect(),
        triangles: (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        surface_of: vec![0; count],
        surfaces: vec![surface],
        ..Model::default()
    };
    let job = format!("scene = \"memory\"\n{}{}", omni([3.0, 2.0, 2.5], 1.0), point("p", [3.0, 2.0, 2.0], UP));
    let (_, scene) = prepare(&job, model);
    let place = |p: Vec3| scene.place(p.as_dvec3().to_array());
    let response = |position: DVec3, normal: DVec3| match matt {
        true => Response::Cosine,
        false => Response::reflectance(&scene, (0, position, normal), normal, Colour::WHITE, 0.0),
    };
    let receiver = |p: &Place| {
        let (position, normal) = (place(p.point), p.normal.as_dvec3());
        Receiver { position, normal, response: response(position, normal) }
    };
    let vertex = |p: &Place| Vertex {
        position: place(p.point),
        normal: p.normal.as_dvec3(),
        w_in: -p.normal.as_dvec3(),
        weight: Colour::WHITE,
        primitive: 0,
        order: 1,
        after_delta: false,
        emphasis: 1.0,
    };
    let mut connectors = Connectors::default();
    for history in segments.vertices.chunks(6) {
        connectors.push(&scene, &history.iter().map(vertex).collect::<Vec<_>>());
    }
    let places: Vec<_> = segments.receivers.iter().map(|p| p.point.as_dvec3()).collect();
    let ordered: Vec<Place> = kd_order(&places).into_iter().map(|i| segments.receivers[i as usize]).collect();
    let link = |p: &Place| Link { owner: 0, receiver: receiver(p), start: Colour::BLACK, watched: false };
    let tile = |places: &[Place]| Tile::new(&scene, places.iter().map(link).collect(), 0);
    let tiles: Vec<Tile> = ordered.chunks(TILE).map(tile).collect();
    let facing = |v: &Place| ordered.iter().filter(|r| v.faces(r)).count();
    let connections: usize = segments.vertices.iter().map(facing).sum();
    let rule = Rule { bound: 1.0, channels: 1, orders: 0..u32::MAX };
    let seconds = median(|| {
        let start = thread_time();
        for tile in &tiles {
            std::hint::black_box(connect(&scene, &connectors, 0..connectors.histories(), tile, &rule));
        }
        (thread_time() - start).as_secs_f64()
    });
    println!(
        "{}: {count} triangles, {:.1} M connections/s in the loop ({}; {what})",
        which.letter(),
        connections as f64 / seconds / 1e6,
        scene.geometry.path().name()
    );
}

fn bench(name: &str, side: u32) {
    let camera = if name == "blender_room" { "camera_wide" } else { "camera" };
    let text = format!(
        "scene = \"{name}.glb\"\n[run]\nhistories_per_batch = {HISTORIES}\n[[camera]]\nname = \"view\"\n\
         node = \"{camera}\"\nwidth = {side}\nheight = {side}\npixel_samples = 1\n"
    );
    let (job, scene) = prepare(&text, load(name));
    let mut vertices: Vec<Vertex> = Vec::new();
    let trajectories = Stream::new(job.run.seed, Domain::Trajectory, "");
    let per_history = median(|| {
        vertices.clear();
        let start = thread_time();
        (0..HISTORIES * 64).for_each(|h| {
            trace(&scene, &job.transport, &mut trajectories.generator(h), &mut vertices);
        });
        (thread_time() - start).as_secs_f64() / (HISTORIES * 64) as f64
    });
    let per_batch = vertices.len() as f64 / 64.0;
    let realization = Realization::new(&job, &scene, &bounds(&job, &scene));
    let seconds = median(|| {
        let start = thread_time();
        std::hint::black_box(realization.batch(0));
        (thread_time() - start).as_secs_f64()
    });
    let connections = per_batch * f64::from(side * side);
    println!(
        "{name}: {} triangles, {:.2} M connections/s, {:.2} us a history of {:.1} vertices",
        scene.triangles(),
        connections / seconds / 1e6,
        per_history * 1e6,
        per_batch / HISTORIES as f64
    );
}

/// Scrambled Sobol points, the eight coordinates of a history.
fn points() {
    let scrambling = Stream::new(1, Domain::Scrambling, "");
    for m in [6, 11, 16] {
        let seconds = median(|| {
            let start = thread_time();
            let batches = (1 << 18) >> m;
            let of_batch = |batch: u64| -> f64 {
                let set = PointSet::new(&scrambling, batch, m);
                (0..1 << m).map(|i| set.point(i).iter().sum::<f64>()).sum()
            };
            std::hint::black_box((0..batches).map(of_batch).sum::<f64>());
            (thread_time() - start).as_secs_f64()
        });
        println!("quasi-random points in sets of 2^{m}: {:.0} ns each", seconds / f64::from(1 << 18) * 1e9);
    }
}

fn median(mut run: impl FnMut() -> f64) -> f64 {
    statistics::median((0..RUNS).map(|_| run()))
}
