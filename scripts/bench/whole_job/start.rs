//! From the start of `lampyris run` to the first batch in a checkpoint, and where that time goes.

use super::{cpu_timed, large, program, timed};
use lampyris::farm::folder::Folder;
use lampyris::farm::inputs::{load_scene, prepare};
use lampyris::farm::pilot::bounds;
use lampyris::farm::realization::Realization;
use lampyris::geometry::Mesh;
use lampyris::math::Vec3;
use lampyris::scene::{Scene, gltf};
use lampyris::tally::statistics::median;
use nix::sys::signal::{Signal, killpg};
use nix::unistd::Pid;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const RUNS: usize = 3;

/// The room of `jobs/room.toml`, and a million triangles.
pub fn bench() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, path) in [("room", room(folder.path())), ("large", million(folder.path()))] {
        for workers in ["1", "2"] {
            let first = median((0..RUNS).map(|_| to_first_checkpoint(&path, workers)));
            println!("{name}, {workers} workers: first batch in a checkpoint after {first:.2} s");
        }
        let runs: Vec<Vec<(&str, [f64; 2])>> = (0..RUNS).map(|_| phases(&path)).collect();
        for (i, (phase, _)) in runs[0].iter().enumerate() {
            let [wall, cpu] = [0, 1].map(|time| 1e3 * median(runs.iter().map(|run| run[i].1[time])));
            println!("{name}: {wall:8.1} ms ({cpu:.1}) {phase}");
        }
    }
}

/// The job of the room, a batch a shard, so that a batch is in a checkpoint as soon as it is done.
fn room(folder: &Path) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let job = std::fs::read_to_string(root.join("jobs/room.toml")).expect("the job ships with the project");
    let scene = root.join("scenes/room.glb").display().to_string();
    let job = job
        .replace("../scenes/room.glb", &scene)
        .replace("\nbatches_per_shard = 16", "\nbatches_per_shard = 1\nsampling = \"random\"");
    let path = folder.join("room.toml");
    std::fs::write(&path, job).expect("a job file");
    path
}

/// The job of the large scene, with the receivers of the room.
fn million(folder: &Path) -> PathBuf {
    let (bytes, triangles) = large::glb();
    println!("large: {triangles} triangles, {} bytes", bytes.len());
    std::fs::write(folder.join("large.glb"), bytes).expect("a scene file");
    let path = folder.join("large.toml");
    let job = "scene = \"large.glb\"\n[run]\nhistories_per_batch = 16\nbatches = 64\nbatches_per_shard = 1\n\
        sampling = \"random\"\n[[source]]\nkind = \"omni\"\nposition = [3.0, 2.6, 2.0]\nintensity = 79.577\n\
        [[camera]]\nname = \"view\"\neye = [0.3, 1.6, 3.7]\ntarget = [3.5, 0.8, 1.5]\nvertical_fov_degrees = 60.0\n\
        width = 256\nheight = 256\n[[grid]]\nname = \"workplane\"\norigin = [0.0, 1.9, 4.0]\nu = [6.0, 0.0, 0.0]\n\
        v = [0.0, 0.0, -4.0]\nnormal = [0.0, 1.0, 0.0]\ncolumns = 32\nrows = 32\n";
    std::fs::write(&path, job).expect("a job file");
    path
}

/// Time from the start of the program to the first checkpoint \[s\].
fn to_first_checkpoint(job: &Path, workers: &str) -> f64 {
    let out = tempfile::tempdir().expect("a temporary folder");
    let (job, dir) = (job.display().to_string(), out.path().join("out"));
    let start = Instant::now();
    let mut command = program(&["run", "-q", "-w", workers, &job, "-o", &dir.display().to_string()]);
    let mut child = command.process_group(0).spawn().expect("the program starts");
    let is_there = || Folder::new(&dir).checkpoints().is_ok_and(|found| !found.is_empty());
    while !is_there() {
        assert!(child.try_wait().expect("it is ours").is_none(), "it ended without a checkpoint");
        std::thread::sleep(Duration::from_millis(1));
    }
    let seconds = start.elapsed().as_secs_f64();
    // Its workers too: left alone or asked to stop, they would finish their batches first, and slow down what is measured next.
    let group = Pid::from_raw(child.id().try_into().expect("process numbers fit"));
    killpg(group, Signal::SIGKILL).expect("it is ours");
    child.wait().expect("it is ours");
    seconds
}

/// Wall clock and CPU time of `work` \[s\], and what it made.
fn both<T>(work: impl FnOnce() -> T) -> ([f64; 2], T) {
    let (wall, (cpu, made)) = timed(|| cpu_timed(work));
    ([wall, cpu], made)
}

/// The same work inside this process, phase by phase, in the order of the program.
fn phases(path: &Path) -> Vec<(&'static str, [f64; 2])> {
    let out = tempfile::tempdir().expect("a temporary folder");
    let folder = Folder::new(&out.path().join("out"));
    let (prepared, made) = both(|| prepare(path).expect("the job is right"));
    let (established, ()) = both(|| folder.establish(&made.plan, &made.files).expect("the disk has room"));
    let plan = &made.plan;
    let (read, bytes) = both(|| folder.read_input(&plan.inputs[0]).expect("it was written"));
    let no_other = &mut |uri: &str| panic!("{uri}: the scene is one file");
    let (decoded, model) = both(|| gltf::load("bench", &bytes, no_other).expect("the scene is right"));
    let corners = |t: &[u32; 3]| t.map(|v| model.positions[v as usize].as_vec3());
    let triangles: Vec<[Vec3; 3]> = model.triangles.iter().map(corners).collect();
    let (built, mesh) = both(|| Mesh::new(&triangles));
    drop(mesh);
    let (joined, scene) = both(|| Scene::new(model, &plan.job).expect("the scene is right"));
    let (bounded, _) = both(|| bounds(&plan.job, &scene));
    let (realized, realization) = both(|| Realization::new(&plan.job, &scene, &plan.bounds));
    let (batch, _) = both(|| realization.batch(0));
    let (loaded, _) = both(|| load_scene(&folder, plan).expect("the scene is right"));
    vec![
        ("plan in all", prepared),
        ("  of it the pilot", bounded),
        ("inputs and plan into the folder", established),
        ("scene of a worker in all", loaded),
        ("  of it reading and its digest", read),
        ("  of it decoding", decoded),
        ("  of it joining", joined),
        ("    of that the hierarchy", built),
        ("receivers placed and ordered", realized),
        ("first batch", batch),
    ]
}
