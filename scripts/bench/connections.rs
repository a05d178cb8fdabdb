//! Connections per second of one thread, and trajectories per second: `cargo bench --bench connections`.
//!
//! Receivers are the pixels of a camera, connected to the vertices of one batch, visibility and sums included.
//! Times are CPU time of the thread, medians of several runs; on a shared machine compare interleaved runs only.

mod common;

use common::{load, prepare, thread_time};
use lampyris::farm::pilot::bounds;
use lampyris::farm::realization::Realization;
use lampyris::random::sobol::PointSet;
use lampyris::random::{Domain, Stream};
use lampyris::tally::statistics;
use lampyris::transport::trajectory::{Vertex, trace};

const RUNS: usize = 7;
const HISTORIES: u64 = 64;

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    pool.install(|| {
        for (name, side) in [("room", 128), ("cornell", 128), ("blender_room", 64)] {
            bench(name, side);
        }
        points();
    });
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
