//! Where a test works: a folder with the job and its scene; whole folders as values.

use crate::bits::Bits;
use crate::process::{expect, lampyris, run_quietly};
use lampyris::farm::checkpoint::{Header, Reader, read_header};
use lampyris::farm::folder::Folder;
use lampyris::farm::plan::Plan;
use lampyris::tally::Tally;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tempfile::TempDir;

/// The job of all tests here.
pub const JOB: &str = include_str!("job.toml");
/// Its batches, shards and batches of a whole shard.
pub const BATCHES: u64 = 28;
pub const SHARDS: u64 = 6;
pub const BATCHES_PER_SHARD: u64 = 5;

/// A folder with `job.toml` and its scene, removed at the end.
pub struct Place {
    temp: TempDir,
}

impl Place {
    pub fn new() -> Place {
        let place = Place { temp: tempfile::tempdir().unwrap() };
        let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/blender_room.glb");
        fs::copy(scene, place.path("room.glb")).unwrap();
        fs::write(place.path("job.toml"), JOB).unwrap();
        place
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.temp.path().join(name)
    }

    /// Writes `name` with `from` in the job replaced by `to`.
    pub fn edited_job(&self, name: &str, from: &str, to: &str) -> PathBuf {
        assert!(JOB.contains(from), "{from}");
        let path = self.path(name);
        fs::write(&path, JOB.replacen(from, to, 1)).unwrap();
        path
    }

    /// Plans the job into the folder `name`.
    pub fn planned(&self, name: &str) -> PathBuf {
        self.plan(&self.path("job.toml"), name)
    }

    pub fn plan(&self, job: &Path, name: &str) -> PathBuf {
        let dir = self.path(name);
        expect(0, lampyris(&["plan"]).arg(job).arg("-o").arg(&dir));
        dir
    }

    /// Runs the job in `dir` to its end and demands the bits of the straight run.
    #[track_caller]
    pub fn finish(&self, dir: &Path) {
        expect(0, &mut run_quietly(&self.path("job.toml"), dir, 2));
        Bits::of(dir).assert_same(&straight().bits);
    }
}

/// The files of a folder, by their paths in it.
#[derive(Clone, PartialEq)]
pub struct Tree(pub BTreeMap<PathBuf, Vec<u8>>);

impl Tree {
    pub fn of(dir: &Path) -> Tree {
        let mut tree = Tree(BTreeMap::new());
        tree.collect(dir, Path::new(""));
        tree
    }

    fn collect(&mut self, root: &Path, below: &Path) {
        for entry in fs::read_dir(root.join(below)).unwrap() {
            let entry = entry.unwrap();
            let path = below.join(entry.file_name());
            match entry.file_type().unwrap().is_dir() {
                true => self.collect(root, &path),
                false => drop(self.0.insert(path.clone(), fs::read(root.join(&path)).unwrap())),
            }
        }
    }

    /// Writes all files into `dir`.
    pub fn restore(&self, dir: &Path) {
        for (path, bytes) in &self.0 {
            let path = dir.join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, bytes).unwrap();
        }
    }

    /// Demands that `dir` holds these files and no others.
    #[track_caller]
    pub fn assert_unchanged(&self, dir: &Path, what: &str) {
        let now = Tree::of(dir);
        let names = |tree: &Tree| tree.0.keys().cloned().collect::<Vec<_>>();
        assert_eq!(names(&now), names(self), "{what}");
        for (path, bytes) in &self.0 {
            assert!(now.0[path] == *bytes, "{what}: {} has changed", path.display());
        }
    }
}

/// The straight run: one worker, one shard after the other, never interrupted.
pub struct Straight {
    pub bits: Bits,
    /// Its whole folder.
    pub tree: Tree,
}

pub fn straight() -> &'static Straight {
    static STRAIGHT: OnceLock<Straight> = OnceLock::new();
    STRAIGHT.get_or_init(|| {
        let place = Place::new();
        let dir = place.path("straight");
        expect(0, &mut run_quietly(&place.path("job.toml"), &dir, 1));
        Straight { bits: Bits::of(&dir), tree: Tree::of(&dir) }
    })
}

/// The straight run's folder before merging: plan, inputs, checkpoints.
pub fn computed() -> Tree {
    let mut tree = straight().tree.clone();
    tree.0.retain(|path, _| path == Path::new("plan.toml") || path.parent() != Some(Path::new("")));
    tree.0.retain(|path, _| !path.to_string_lossy().ends_with(".lock"));
    tree
}

/// The path of a checkpoint inside its folder.
pub fn checkpoint(shard: u64) -> PathBuf {
    PathBuf::from(format!("shards/shard-{shard:06}.ckpt"))
}

pub fn plan_in(dir: &Path) -> Plan {
    Folder::new(dir).read_plan().unwrap()
}

/// Header of a checkpoint; None without one. A checkpoint that cannot be read fails the test.
pub fn header(dir: &Path, shard: u64) -> Option<Header> {
    read_header(&dir.join(checkpoint(shard)), &plan_in(dir), shard).unwrap()
}

/// Batches in the checkpoint of a shard.
pub fn batches(dir: &Path, shard: u64) -> u64 {
    header(dir, shard).map_or(0, |h| h.batches())
}

/// Batches of a whole shard.
pub fn batches_of(shard: u64) -> u64 {
    BATCHES_PER_SHARD.min(BATCHES - shard * BATCHES_PER_SHARD)
}

/// All that a checkpoint says, every section verified.
pub fn content(dir: &Path, shard: u64) -> (Tally, Vec<Vec<u64>>) {
    let plan = plan_in(dir);
    let reader = Reader::open(&dir.join(checkpoint(shard)), &plan, shard).unwrap().unwrap();
    let bits = |set: Vec<f64>| set.into_iter().map(f64::to_bits).collect();
    let fixed = (0..plan.sets().len()).map(|set| bits(reader.fixed_direct(set).unwrap())).collect();
    (reader.tally().unwrap(), fixed)
}

/// Demands that shards of `dir` are, bit for bit, those of the straight run.
#[track_caller]
pub fn assert_shards(dir: &Path, shards: impl IntoIterator<Item = u64>) {
    let temp = tempfile::tempdir().unwrap();
    computed().restore(temp.path());
    for shard in shards {
        assert!(content(dir, shard) == content(temp.path(), shard), "shard {shard} in {}", dir.display());
    }
}
