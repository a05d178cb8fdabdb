//! The folder of one plan: what lies where, and how a plan gets in and out.
//!
//! ```text
//! DIR/plan.toml                  the plan, readable
//! DIR/inputs/<digest>.<ext>      the job file and every input file, by content
//! DIR/shards/shard-000012.ckpt   one checkpoint for each shard
//! DIR/shards/compacted.ckpt      the first shards together, once they have been compacted
//! DIR/attempts/...               who has begun which shard; no number depends on it
//! DIR/slurm/, DIR/ssh/           scripts, logs and copies of `lampyris submit`
//! DIR/...                        results
//! ```
//!
//! `work DIR` needs nothing else, so the folder can be copied to another machine.

use super::durable;
use super::plan::{Input, NUMERICS, Plan};
use crate::error::{Error, Result};
use crate::job::Job;
use std::fs;
use std::io::ErrorKind;
use std::io::Write as _;
use std::path::{Path, PathBuf};

const HEADING: &str = "\
# Written by lampyris: a job with every default resolved, its inputs by content, its division into shards.
# Do not edit; change the job file and run it again on this folder.

";

/// Begins the last line of a plan.
const SEAL: &str = "\n# blake3 ";

/// Name of the file of the first shards together.
const COMPACTED: &str = "compacted.ckpt";

/// Where a plan, its inputs, checkpoints and results lie.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Folder {
    root: PathBuf,
}

impl Folder {
    /// The folder at `root`, which need not exist yet.
    pub fn new(root: &Path) -> Self {
        Folder { root: root.to_owned() }
    }

    /// The folder itself, where results go.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// `plan.toml`.
    pub fn plan_path(&self) -> PathBuf {
        self.root.join("plan.toml")
    }

    /// Where the file `input` is kept.
    pub fn input_path(&self, input: &Input) -> PathBuf {
        let extension = Path::new(&input.name).extension().and_then(|e| e.to_str()).unwrap_or("");
        let plain = (1..=8).contains(&extension.len()) && extension.bytes().all(|b| b.is_ascii_alphanumeric());
        let name = if plain { format!("{}.{extension}", input.digest) } else { input.digest.clone() };
        self.root.join("inputs").join(name)
    }

    /// The checkpoint of shard `k`.
    pub fn shard_path(&self, k: u64) -> PathBuf {
        self.root.join("shards").join(format!("shard-{k:06}.ckpt"))
    }

    /// Who has begun shard `k`.
    pub fn attempts_path(&self, k: u64) -> PathBuf {
        self.root.join("attempts").join(format!("shard-{k:06}.jsonl"))
    }

    /// The first shards together.
    pub fn compaction_path(&self) -> PathBuf {
        self.root.join("shards").join(COMPACTED)
    }

    /// Every checkpoint of a shard there is, with its shard, in shard order.
    ///
    /// # Errors
    /// [`Error::Refused`] for a `.ckpt` file whose name is that of no shard: it would be left out silently.
    pub fn checkpoints(&self) -> Result<Vec<(u64, PathBuf)>> {
        let shards = self.root.join("shards");
        let entries = match fs::read_dir(&shards) {
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
            other => other.map_err(Error::io(&shards))?,
        };
        let mut found = Vec::new();
        for entry in entries {
            let path = entry.map_err(Error::io(&shards))?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if name.starts_with('.') || name == COMPACTED || !name.ends_with(".ckpt") {
                continue;
            }
            let number = name.strip_prefix("shard-").and_then(|n| n.strip_suffix(".ckpt")?.parse().ok());
            match number.filter(|&k| self.shard_path(k) == path) {
                Some(k) => found.push((k, path)),
                None => return Err(Error::refused(&path, "not the name of a shard, such as shard-000012.ckpt")),
            }
        }
        found.sort();
        Ok(found)
    }

    /// Reads and checks the plan.
    ///
    /// # Errors
    /// [`Error::Input`] without a plan; [`Error::Refused`] for one that is damaged or of another version.
    pub fn read_plan(&self) -> Result<Plan> {
        let path = self.plan_path();
        let text = match fs::read_to_string(&path) {
            Err(e) if e.kind() == ErrorKind::NotFound => {
                let allowed = "a folder made by `lampyris plan` or `lampyris run`";
                return Err(Error::input(self.root.display(), "plan.toml", "(missing)", allowed));
            }
            Err(e) if e.kind() == ErrorKind::InvalidData => return Err(Error::refused(&path, "not text")),
            other => other.map_err(Error::io(&path))?,
        };
        let plan: Plan =
            toml::from_str(&text).map_err(|e| Error::refused(&path, format!("not a plan: {}", e.message())))?;
        check_plan(&plan, &path)?;
        if !is_sealed(&text) {
            return Err(Error::refused(&path, "edited or damaged: its text is not the one that was written"));
        }
        Ok(plan)
    }

    /// Sets the number of batches of the plan that stands here, with a goal its limit, to `batches`; the plan as it is then.
    /// Checkpoints stay what they are: the beginning of their shards.
    ///
    /// # Errors
    /// [`Error::Input`] for fewer batches than are planned, or more than a plan may have; those of reading and writing.
    pub fn extend(&self, batches: u64) -> Result<Plan> {
        let mut plan = self.read_plan()?;
        let before = plan.job.run.batches;
        if batches < before {
            let allowed = format!("at least {before}, the batches planned: moments cannot be cut back");
            return Err(Error::input("command line", "--batches", batches, allowed));
        }
        plan.job.run.batches = batches;
        plan.job.stop.iter_mut().for_each(|stop| stop.max_batches = batches);
        check_plan(&plan, &self.plan_path())?;
        self.establish(&plan, &[])?;
        Ok(plan)
    }

    /// Makes this the folder of `plan`: new, or continuing an older plan that it extends. `files` are the contents
    /// of the job file and the inputs.
    ///
    /// # Errors
    /// [`Error::Refused`] naming what differs from the plan that stands here; [`Error::Io`].
    pub fn establish(&self, plan: &Plan, files: &[(Input, Vec<u8>)]) -> Result<()> {
        self.check_obstacles(plan)?;
        for sub in ["inputs", "shards"] {
            durable::make_folder(&self.root.join(sub))?;
        }
        for (input, bytes) in files {
            let path = self.input_path(input);
            if self.read_input(input).is_err() {
                durable::replace(&path, |w| w.write_all(bytes))?;
            }
        }
        // The plan comes last: a folder with a plan has all its inputs.
        let text = sealed(&plan_text(plan));
        if fs::read_to_string(self.plan_path()).is_ok_and(|old| old == text) {
            return Ok(());
        }
        // Of two that plan at once the second one sees what the first has written.
        let allowed = || self.check_obstacles(plan).map(|()| true);
        durable::replace_if(&self.plan_path(), |w| w.write_all(text.as_bytes()), allowed).map(|_| ())
    }

    /// Refuses a plan that cannot continue the one that stands here, if one does.
    fn check_obstacles(&self, plan: &Plan) -> Result<()> {
        if !self.plan_path().exists() {
            return Ok(());
        }
        let obstacles = plan.obstacles(&self.read_plan()?);
        if obstacles.is_empty() {
            return Ok(());
        }
        let reason = format!("the job is no longer the one planned here:\n  {}", obstacles.join("\n  "));
        Err(Error::refused(&self.plan_path(), reason))
    }

    /// The bytes of `input`, verified against its digest.
    ///
    /// # Errors
    /// [`Error::Refused`] when they are not what the plan says; [`Error::Io`].
    pub fn read_input(&self, input: &Input) -> Result<Vec<u8>> {
        let path = self.input_path(input);
        let bytes = fs::read(&path).map_err(Error::io(&path))?;
        if Input::of(&input.name, &bytes).digest != input.digest {
            return Err(Error::refused(&path, format!("damaged: not the bytes of \"{}\" any more", input.name)));
        }
        Ok(bytes)
    }
}

/// The plan as it is stored and shown.
pub fn plan_text(plan: &Plan) -> String {
    let body = toml::to_string(plan).expect("a plan has a TOML form: checked numbers and string keys");
    format!("{HEADING}{body}")
}

/// `text` with a last line by which it is known again.
fn sealed(text: &str) -> String {
    format!("{text}{SEAL}{}\n", blake3::hash(text.as_bytes()).to_hex())
}

/// True for a whole text that [`sealed`] made.
fn is_sealed(text: &str) -> bool {
    text.rfind(SEAL).is_some_and(|at| sealed(&text[..at]) == text)
}

/// Refuses a plan that this program did not write or would compute otherwise.
fn check_plan(plan: &Plan, path: &Path) -> Result<()> {
    if plan.numerics != NUMERICS {
        let reason = format!("NUMERICS {} of program {}, this program has {NUMERICS}", plan.numerics, plan.program);
        return Err(Error::refused(path, reason));
    }
    let hex = |d: &str| d.len() == 64 && d.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b));
    if !plan.inputs.iter().chain([&plan.job_file]).all(|i| hex(&i.digest)) {
        return Err(Error::refused(path, "damaged: an input has no digest of 64 hexadecimal digits"));
    }
    if plan.content_digest().to_hex().as_str() != plan.digest {
        return Err(Error::refused(path, "edited or damaged: its digest is not that of its content"));
    }
    let bounds = if plan.job.is_bounded() { plan.sets().len() } else { 0 };
    if plan.bounds.len() != bounds || !plan.bounds.iter().all(|b| *b > 0.0) {
        return Err(Error::refused(path, "edited or damaged: the bounds are not one above zero for each receiver set"));
    }
    // The fields outside the digest are checked as those of a job file are.
    if plan.name.chars().any(char::is_control) {
        return Err(Error::refused(path, "edited or damaged: the name of the job has control characters"));
    }
    plan.check_sizes()?;
    plan.check_looks()?;
    let job = toml::to_string(&plan.job).map_err(|e| Error::refused(path, e))?;
    Job::parse(&job, &path.display().to_string()).map(|_| ())
}
