//! What size costs: `cargo build --release && cargo run --release --example scale [-- PART...]`.
//!
//! | part | what |
//! |---|---|
//! | `shards` | plan, status, merge and compact of 1,250, 2,500, 5,000 and 10,000 shards of ten batches: time and peak memory |
//! | `pixels` | a map of 7680 x 4320 pixels in 8 shards: bytes on the disk, merging beside the speed of the disk, peak memory |
//!
//! Scores are made up: what files cost does not depend on how their numbers came about. `pixels` takes 4 GB of memory to
//! make its checkpoints and 12 GB of disk, in a temporary folder that is removed at the end. Results: `docs/farm.md`.

use lampyris::farm::checkpoint::{Run, Snapshot, write};
use lampyris::farm::folder::Folder;
use lampyris::farm::merge::merge;
use lampyris::farm::plan::Plan;
use lampyris::tally::{BatchScores, Scores, Tally};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

/// One source, which both jobs have.
const LIGHT: &str = "[[source]]\nkind = \"omni\"\nposition = [0.0, 2.0, 0.0]\nintensity = 100.0\n";

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    // Peak memory belongs to a process, so merging alone is measured in one of its own.
    if let [word, folder] = &words[..]
        && word == "fold"
    {
        let folder = Path::new(folder);
        merge(&[Folder::new(folder)], folder).expect("the shards are whole");
        return;
    }
    let wanted = |part: &str| words.is_empty() || words.iter().any(|word| word == part);
    if wanted("shards") {
        [1_250, 2_500, 5_000, 10_000].into_iter().for_each(shards);
    }
    if wanted("pixels") {
        pixels();
    }
}

/// Jobs of many shards, each of ten batches of a small grid, a map of 32 x 24 pixels and a lux-meter.
fn shards(count: u64) {
    let place = Place::new(&format!(
        "[run]\nsampling = \"random\"\nhistories_per_batch = 1\nbatches = {}\nbatches_per_shard = 10\n\
         [[camera]]\nname = \"view\"\neye = [0.0, 1.0, 3.0]\ntarget = [0.0, 1.0, 0.0]\n\
         vertical_fov_degrees = 40.0\nwidth = 32\nheight = 24\n\
         [[grid]]\nname = \"desk\"\norigin = [0.0, 0.8, 0.0]\nu = [1.0, 0.0, 0.0]\nv = [0.0, 0.0, -1.0]\n\
         normal = [0.0, 1.0, 0.0]\ncolumns = 8\nrows = 8\n\
         [[point]]\nname = \"meter\"\nposition = [0.0, 0.8, 0.0]\nnormal = [0.0, 1.0, 0.0]\n{LIGHT}",
        10 * count
    ));
    let planned = measure(place.lampyris("plan").arg(place.job()).arg("-o").arg(place.dir()));
    let folder = Folder::new(&place.dir());
    let plan = folder.read_plan().expect("it was planned");
    let tally = tally(&plan, 10);
    (0..count).for_each(|shard| save(&folder, &plan, shard, &tally));
    let bytes = bytes_in(&place.dir().join("shards"));
    let status = measure(place.lampyris("status").arg(place.dir()));
    let merged = measure(place.lampyris("merge").arg(place.dir()));
    let compacted = measure(place.lampyris("compact").arg(place.dir()));
    let after = bytes_in(&place.dir().join("shards"));
    println!(
        "{count} shards, {} batches, {:.0} MB: plan {planned}, status {status}, merge {merged}, compact {compacted} \
         ({:.0} MB then)",
        10 * count,
        bytes as f64 / 1e6,
        after as f64 / 1e6
    );
}

/// A job of one map of 33 megapixels.
fn pixels() {
    const SHARDS: u64 = 8;
    let (width, height) = (7680u64, 4320u64);
    let place = Place::new(&format!(
        "[run]\nsampling = \"random\"\nhistories_per_batch = 1\nbatches = {}\nbatches_per_shard = 2\n\
         [[camera]]\nname = \"view\"\neye = [0.0, 1.0, 3.0]\ntarget = [0.0, 1.0, 0.0]\n\
         vertical_fov_degrees = 40.0\nwidth = {width}\nheight = {height}\n{LIGHT}",
        2 * SHARDS
    ));
    measure(place.lampyris("plan").arg(place.job()).arg("-o").arg(place.dir()));
    let folder = Folder::new(&place.dir());
    let plan = folder.read_plan().expect("it was planned");
    let tally = tally(&plan, 2);
    let start = Instant::now();
    (0..SHARDS).for_each(|shard| save(&folder, &plan, shard, &tally));
    let written = start.elapsed().as_secs_f64();
    drop(tally);
    let bytes = bytes_in(&place.dir().join("shards"));
    let (megapixels, decoded) = ((width * height) as f64 / 1e6, (48 * width * height * SHARDS) as f64);
    println!(
        "{megapixels:.1} megapixels, {SHARDS} shards: {:.2} GB on the disk, {:.2} GB decoded; {:.1} MB a megapixel and \
         shard; written in {written:.0} s",
        bytes as f64 / 1e9,
        decoded / 1e9,
        bytes as f64 / 1e6 / megapixels / SHARDS as f64
    );
    for _ in 0..3 {
        forget(&folder);
        let start = Instant::now();
        read(&folder);
        let disk = start.elapsed().as_secs_f64();
        forget(&folder);
        let fold = measure(
            Command::new(std::env::current_exe().expect("this program has a path")).arg("fold").arg(place.dir()),
        );
        println!(
            "reading the files {disk:.1} s = {:.2} GB/s; merging them {fold} = {:.2} GB/s on the disk, {:.2} GB/s decoded",
            bytes as f64 / 1e9 / disk,
            bytes as f64 / 1e9 / fold.seconds,
            decoded / 1e9 / fold.seconds
        );
    }
    let whole = measure(place.lampyris("merge").arg(place.dir()));
    println!("`lampyris merge` with its files of results: {whole}");
    let compacted = measure(place.lampyris("compact").arg(place.dir()));
    println!("`lampyris compact`: {compacted}, {:.2} GB then", bytes_in(&place.dir().join("shards")) as f64 / 1e9);
}

/// A temporary folder with a job.
struct Place {
    temp: tempfile::TempDir,
}

impl Place {
    fn new(job: &str) -> Place {
        let place = Place { temp: tempfile::tempdir().expect("a temporary folder") };
        std::fs::write(place.job(), job).expect("the disk has room");
        place
    }

    fn job(&self) -> PathBuf {
        self.temp.path().join("job.toml")
    }

    fn dir(&self) -> PathBuf {
        self.temp.path().join("dir")
    }

    /// The program, which lies beside the folder of the examples.
    fn lampyris(&self, command: &str) -> Command {
        let own = std::env::current_exe().expect("this program has a path");
        let program =
            own.parent().and_then(Path::parent).expect("examples have a folder of their own").join("lampyris");
        let mut lampyris = Command::new(program);
        lampyris.arg(command);
        lampyris
    }
}

/// Wall clock and peak memory of a process.
struct Cost {
    seconds: f64,
    memory: u64,
}

impl std::fmt::Display for Cost {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{:.2} s and {:.0} MB", self.seconds, self.memory as f64 / 1e6)
    }
}

fn measure(command: &mut Command) -> Cost {
    let start = Instant::now();
    let mut child = command.stdout(Stdio::null()).spawn().expect("the program starts: `cargo build --release`");
    let mut memory = 0;
    let status = loop {
        // The largest so far, until its last milliseconds.
        memory = peak_memory(child.id()).unwrap_or(memory).max(memory);
        match child.try_wait().expect("it can be waited for") {
            Some(status) => break status,
            None => std::thread::sleep(std::time::Duration::from_millis(2)),
        }
    };
    assert!(status.success(), "{command:?}: {status}");
    Cost { seconds: start.elapsed().as_secs_f64(), memory }
}

fn peak_memory(pid: u32) -> Option<u64> {
    let text = std::fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(1024 * line.trim().trim_end_matches(" kB").parse::<u64>().ok()?)
}

/// A tally of `batches` batches whose numbers look like those of a room: smooth, and noisy in their last digits.
fn tally(plan: &Plan, batches: u64) -> Tally {
    let mut tally = Tally::new(&plan.sets());
    for batch in 0..batches {
        let fill = |shape| {
            let mut scores = Scores::zero(shape);
            let bins = scores.value.len() as f64;
            for i in 0..scores.value.len() {
                // Weyl's sequence: cheap, and as hard to pack as any noise.
                let noise = ((i as f64 * 0.618_033_988_749_894_9 + batch as f64 * 0.414_213_562_373_095) % 1.0).sqrt();
                scores.value[i] = 20.0 + 10.0 * (i as f64 / bins) + noise;
                scores.direct[i] = 0.3 * scores.value[i] + 0.1 * noise;
                scores.peak[i] = 0.2 * noise * noise;
                scores.existed[i] = true;
            }
            scores.watched.iter_mut().for_each(|w| w.totals = vec![1.0]);
            scores
        };
        let sets = plan.sets().iter().map(fill).collect();
        tally.accumulate(&BatchScores { sets, flux: [1.0, 0.75, 0.25, 0.0, batch as f64] });
    }
    tally
}

fn save(folder: &Folder, plan: &Plan, shard: u64, tally: &Tally) {
    let fixed_direct: Vec<Vec<f64>> = plan.sets().iter().map(|_| Vec::new()).collect();
    let run = Run { batches: tally.batches(), host: "bench".into(), instructions: "scalar".into(), seconds: 60.0 };
    let (fixed_direct, runs) = (&fixed_direct[..], &[run][..]);
    let snapshot = Snapshot { plan, shard, tally, fixed_direct, runs, written: 0, relative_error: 0.1 };
    assert!(write(&folder.shard_path(shard), &snapshot).expect("the disk has room"));
}

fn bytes_in(folder: &Path) -> u64 {
    let entries = std::fs::read_dir(folder).expect("it was planned");
    entries.map(|entry| entry.and_then(|e| e.metadata()).expect("it was written").len()).sum()
}

/// Asks the system to drop the checkpoints from its cache.
fn forget(folder: &Folder) {
    for (_, path) in folder.checkpoints().expect("it was planned") {
        let from = format!("if={}", path.display());
        run(Command::new("dd").arg(from).args(["iflag=nocache", "count=0"]));
    }
}

/// Reads every checkpoint and does nothing with it.
fn read(folder: &Folder) {
    for (_, path) in folder.checkpoints().expect("it was planned") {
        run(Command::new("dd").arg(format!("if={}", path.display())).args(["of=/dev/null", "bs=1M"]));
    }
}

fn run(command: &mut Command) {
    assert!(command.stderr(Stdio::null()).status().expect("dd is there").success(), "{command:?}");
}
