//! Figure of merit of a grid and of an image, with and without the bounded kernel, against the histories of a batch:
//! `cargo bench --bench remedy [-- --quick]`. Prints a markdown table.
//!
//! FOM = 1 / (mean squared relative error of the bins x CPU seconds of the one thread). Both kernels are run in turn, every
//! figure is the median of three seeds. It is from this table that the default sizes of batches were chosen.

mod common;

use common::{Reached, load, prepare, reach};
use lampyris::farm::pilot::bounds;
use lampyris::farm::realization::Realization;
use lampyris::tally::statistics::{figure_of_merit, median};

/// Histories of a run, over all batches.
const HISTORIES: u64 = 8192;
const SEEDS: u64 = 3;

struct Task {
    name: &'static str,
    scene: &'static str,
    receivers: &'static str,
    sizes: &'static [u64],
}

const TASKS: [Task; 4] = [
    Task {
        name: "room, grid 16 x 16",
        scene: "room",
        receivers: "[[grid]]\nname = 'g'\norigin = [0.0, 0.8, 0.0]\nu = [6.0, 0.0, 0.0]\nv = [0.0, 0.0, -4.0]\n\
                    normal = [0.0, 1.0, 0.0]\ncolumns = 16\nrows = 16\n",
        sizes: &[64, 256, 512],
    },
    Task {
        name: "room, image 32 x 32, 4 positions",
        scene: "room",
        receivers: "[[camera]]\nname = 'v'\nnode = 'camera'\nwidth = 32\nheight = 32\n",
        sizes: &[4, 8, 16, 32, 64],
    },
    Task {
        name: "room, image 32 x 32, 16 positions",
        scene: "room",
        receivers: "[[camera]]\nname = 'v'\nnode = 'camera'\nwidth = 32\nheight = 32\npixel_samples = 16\n",
        sizes: &[8, 16, 32],
    },
    Task {
        name: "cornell, grid 16 x 16",
        scene: "cornell",
        receivers: "[[grid]]\nname = 'g'\norigin = [0.0, 0.001, 0.0]\nu = [0.55, 0.0, 0.0]\nv = [0.0, 0.0, -0.55]\n\
                    normal = [0.0, 1.0, 0.0]\ncolumns = 16\nrows = 16\n",
        sizes: &[64, 256, 512],
    },
];

fn main() {
    let quick = std::env::args().any(|a| a == "--quick");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    println!(
        "| task | histories of a batch | kernel | us a history and bin | error of {HISTORIES} | worst bin | FOM [1/s] |"
    );
    println!("|---|---|---|---|---|---|---|");
    pool.install(|| {
        for task in &TASKS {
            for &size in task.sizes {
                compare(task, size, if quick { 1 } else { SEEDS });
            }
        }
    });
}

fn compare(task: &Task, size: u64, seeds: u64) {
    let mut reached = [Vec::new(), Vec::new()];
    for seed in 1..=seeds {
        for (bounded, into) in [true, false].into_iter().zip(&mut reached) {
            into.push(run(task, size, seed, bounded));
        }
    }
    for (kernel, runs) in ["bounded", "plain"].into_iter().zip(&reached) {
        let of = |f: &dyn Fn(&Reached) -> f64| median(runs.iter().map(f));
        println!(
            "| {} | {size} | {kernel} | {:.2} | {:.3} % | {:.2} % | {:.0} |",
            task.name,
            1e6 * of(&|r| r.of_a_bin),
            100.0 * of(&|r| r.relative_error),
            100.0 * of(&|r| r.worst),
            of(&|r| figure_of_merit(r.relative_error, r.seconds)),
        );
    }
}

fn run(task: &Task, size: u64, seed: u64, bounded: bool) -> Reached {
    let batches = HISTORIES / size;
    let text = format!(
        "scene = '{}.glb'\n[run]\nseed = {seed}\nhistories_per_batch = {size}\nbatches = {batches}\n[transport]\n\
         bounded = {bounded}\n{}",
        task.scene, task.receivers
    );
    let (job, scene) = prepare(&text, load(task.scene));
    let realization = Realization::new(&job, &scene, &bounds(&job, &scene));
    reach(&realization, &job)
}
