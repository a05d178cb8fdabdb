//! Slurm: the shards as a job array, the merge as a job that depends on it.
//!
//! ```text
//! DIR/slurm/shards.sbatch    one array task computes one shard
//! DIR/slurm/merge.sbatch     runs when every task has ended, however it ended, and says what is missing
//! DIR/slurm/<job>_<task>.log, merge-<job>.log
//! ```
//!
//! Slurm and the checkpoints know all there is to know: nothing is remembered here. What is queued is asked of `squeue`, by
//! the path of the script; what is done, of the checkpoints. Where shards exceed the site's MaxArraySize there are
//! several arrays, and the argument of the script says where each begins.

mod script;
mod site;
mod task;
mod time;

pub use task::Task;
pub use time::TimeLimit;

use super::missing::{Missing, list};
use super::{quoted, script_path, this_program};
use crate::error::{Error, Result};
use crate::farm::durable;
use crate::farm::folder::Folder;
use crate::farm::plan::Plan;
use script::Script;
use site::{Queue, Site};
use std::io::Write;
use std::path::Path;

/// What would be misread between the quotation marks of an `#SBATCH` line.
const FORBIDDEN: &str = "\"\\";

/// What `submit --engine slurm` was asked to do.
#[derive(Clone, Debug)]
pub struct Request {
    /// Shards at work at a time, at most.
    pub array_limit: Option<u64>,
    /// Time limit of a job; a shard that needs longer requeues itself.
    pub time: TimeLimit,
    /// Partition; None for the site's default.
    pub partition: Option<String>,
    /// Further options of sbatch, as one would type them.
    pub sbatch: Option<String>,
    /// No script is written and nothing submitted, only said.
    pub dry_run: bool,
    /// Whole shards that are folded into one file whenever so many have come together at the beginning; None for never.
    pub compact: Option<u64>,
}

/// The shards of one array: its tasks are the shards less `first`.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Array {
    first: u64,
    shards: Vec<u64>,
}

/// Submits what is `missing` of `plan` in `folder` and not in the queue yet; returns what to say about it.
///
/// # Errors
/// [`Error::Input`] for a path or an option that cannot stand in a script; [`Error::Failed`] with what Slurm's commands
/// said; [`Error::Io`].
pub fn submit(folder: &Folder, plan: &Plan, missing: &Missing, request: &Request) -> Result<String> {
    let scripts = Scripts::new(folder, plan, request)?;
    let site = if request.dry_run { Site::or_default() } else { Site::ask()? };
    let queue = if request.dry_run { Queue::default() } else { Queue::ask(&scripts.shards.path)? };
    let (queued, wanted): (Vec<u64>, Vec<u64>) = missing.shards.iter().partition(|k| queue.shards.contains(k));
    if wanted.is_empty() {
        return Ok(nothing_to_submit(folder, &queued, &queue));
    }
    let mut text = String::new();
    if !queued.is_empty() {
        text += &format!("queued or running already: shards {} (job {})\n", list(queued), queue.job_list());
    }
    let arrays = arrays(&wanted, site.max_array_size);
    if request.dry_run {
        return Ok(text + &scripts.shown() + &commands(&scripts, &arrays, request.array_limit));
    }
    scripts.write()?;
    let mut jobs: Vec<String> = queue.jobs.iter().cloned().collect();
    let mut before = None;
    for array in &arrays {
        let job = site::sbatch(&array_options(&scripts, array, request.array_limit, before.as_deref()))
            .map_err(|e| partly(&jobs, &e))?;
        text += &format!("job {job}: shards {}\n", list(array.shards.iter().copied()));
        jobs.push(job.clone());
        before = Some(job);
    }
    let merge = site::sbatch(&merge_options(&scripts, &jobs)).map_err(|e| partly(&jobs, &e))?;
    text += &format!("job {merge}: merge, after these\n");
    if let Some(look) = missing.look {
        text += &format!("up to the look at {look} batches; the merge says whether to submit again\n");
    }
    Ok(text + &format!("watch them with: lampyris status --watch {}\n", quoted(&scripts.folder)))
}

/// How to go on with what is `missing` after a merge; None where nothing was ever submitted to Slurm.
///
/// # Errors
/// [`Error::Input`] for a path that cannot stand in a script.
pub fn go_on(folder: &Folder, missing: &Missing) -> Result<Option<String>> {
    let path = folder.root().join("slurm/shards.sbatch");
    if missing.shards.is_empty() || !path.is_file() {
        return Ok(None);
    }
    let path = script_path(&path, FORBIDDEN)?;
    let mut text = match missing.look {
        Some(look) => {
            format!("shards {} are missing up to the look at {look} batches", list(missing.shards.iter().copied()))
        }
        None => format!("shards {} are missing", list(missing.shards.iter().copied())),
    };
    text += "; `lampyris submit` computes them and merges again, as do\n";
    for array in arrays(&missing.shards, Site::or_default().max_array_size) {
        text += &format!("  sbatch --array={} {}", list(array.tasks()), quoted(&path));
        text += &if array.first > 0 { format!(" {}\n", array.first) } else { "\n".to_owned() };
    }
    let merge = script_path(&folder.root().join("slurm/merge.sbatch"), FORBIDDEN)?;
    Ok(Some(text + &format!("  sbatch --dependency=afterany:<those jobs> {}\n", quoted(&merge))))
}

impl Array {
    fn tasks(&self) -> impl Iterator<Item = u64> + '_ {
        self.shards.iter().map(|k| k - self.first)
    }
}

/// The fewest arrays for `shards` where the number of a task is below `max_array_size`.
fn arrays(shards: &[u64], max_array_size: u64) -> Vec<Array> {
    let same = |a: &u64, b: &u64| a / max_array_size == b / max_array_size;
    let array = |chunk: &[u64]| Array { first: chunk[0] / max_array_size * max_array_size, shards: chunk.to_vec() };
    shards.chunk_by(same).map(array).collect()
}

/// The two scripts of a folder.
struct Scripts {
    folder: String,
    shards: Script,
    merge: Script,
}

impl Scripts {
    fn new(folder: &Folder, plan: &Plan, request: &Request) -> Result<Self> {
        let root = script_path(folder.root(), FORBIDDEN)?;
        let extra = extra_lines(request)?;
        let (program, time) = (quoted(&this_program(FORBIDDEN)?), request.time);
        let shards = script::shards(&root, &program, plan, time, request.compact, &extra);
        let merge = script::merge(&root, &program, plan, time, &extra);
        Ok(Scripts { folder: root, shards, merge })
    }

    fn write(&self) -> Result<()> {
        durable::make_folder(&Path::new(&self.folder).join("slurm"))?;
        for script in [&self.shards, &self.merge] {
            durable::replace(Path::new(&script.path), |w| w.write_all(script.text.as_bytes()))?;
        }
        Ok(())
    }

    fn shown(&self) -> String {
        [&self.shards, &self.merge].map(|s| format!("--- {}\n{}", s.path, s.text)).concat() + "---\n"
    }
}

/// Partition and further options, a line each.
fn extra_lines(request: &Request) -> Result<Vec<String>> {
    let partition = request.partition.iter().map(|p| ("--partition", format!("--partition={}", quoted(p))));
    let further = request.sbatch.iter().map(|s| ("--sbatch", s.clone()));
    let check = |(flag, line): (&str, String)| match line.chars().any(char::is_control) {
        true => Err(Error::input("command line", flag, line.escape_debug(), "one line")),
        false => Ok(line),
    };
    partition.chain(further).map(check).collect()
}

/// Options of sbatch for `array`; with a limit one array waits for the other, or each would have as many at work.
fn array_options(scripts: &Scripts, array: &Array, limit: Option<u64>, before: Option<&str>) -> Vec<String> {
    let limit_text = limit.map(|n| format!("%{n}")).unwrap_or_default();
    let mut options = vec![format!("--array={}{limit_text}", list(array.tasks()))];
    options.extend(before.filter(|_| limit.is_some()).map(|job| format!("--dependency=afterany:{job}")));
    options.push(scripts.shards.path.clone());
    options.extend((array.first > 0).then(|| array.first.to_string()));
    options
}

fn merge_options(scripts: &Scripts, jobs: &[String]) -> Vec<String> {
    vec![format!("--dependency=afterany:{}", jobs.join(":")), scripts.merge.path.clone()]
}

/// The commands that would be given, for people.
fn commands(scripts: &Scripts, arrays: &[Array], limit: Option<u64>) -> String {
    let names: Vec<String> = (1..=arrays.len()).map(|i| format!("<job {i}>")).collect();
    let before = |i: usize| i.checked_sub(1).map(|i| names[i].as_str());
    let arrays = arrays.iter().enumerate().map(|(i, array)| array_options(scripts, array, limit, before(i)));
    let all = arrays.chain([merge_options(scripts, &names)]);
    let line = |options: Vec<String>| {
        let words: Vec<String> =
            options.iter().map(|o| if o.starts_with("--") { o.clone() } else { quoted(o) }).collect();
        format!("sbatch {}\n", words.join(" "))
    };
    all.map(line).collect()
}

fn nothing_to_submit(folder: &Folder, queued: &[u64], queue: &Queue) -> String {
    let folder = quoted(&folder.root().to_string_lossy());
    if queued.is_empty() {
        return format!("nothing to submit: no shard is missing; `lampyris merge {folder}` writes the results\n");
    }
    let shards = list(queued.iter().copied());
    format!("nothing to submit: shards {shards} are queued or running (job {})\n", queue.job_list())
}

/// Says of a submission that failed half-way what was submitted.
fn partly(jobs: &[String], error: &Error) -> Error {
    match jobs {
        [] => Error::Failed(error.to_string()),
        jobs => Error::Failed(format!("{error}\njobs {} are queued; submit again later for the rest", jobs.join(", "))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_begin_at_multiples_of_the_sites_limit() {
        let array = |first, shards: &[u64]| Array { first, shards: shards.to_vec() };
        assert_eq!(arrays(&[0, 1, 7], 1001), [array(0, &[0, 1, 7])]);
        assert_eq!(arrays(&[9, 10, 11, 35], 10), [array(0, &[9]), array(10, &[10, 11]), array(30, &[35])]);
        assert_eq!(array(30, &[35, 36]).tasks().collect::<Vec<_>>(), [5, 6]);
        assert!(arrays(&[], 10).is_empty());
    }

    #[test]
    fn with_a_limit_one_array_waits_for_the_other() {
        let script = |name: &str| Script { path: format!("/a b/slurm/{name}.sbatch"), text: String::new() };
        let scripts = Scripts { folder: "/a b".to_owned(), shards: script("shards"), merge: script("merge") };
        let arrays = arrays(&[3, 4, 12], 10);
        let expected = |limit: &str, wait: &str| {
            format!(
                "sbatch --array=3-4{limit} '/a b/slurm/shards.sbatch'\n\
                 sbatch --array=2{limit}{wait} '/a b/slurm/shards.sbatch' 10\n\
                 sbatch --dependency=afterany:<job 1>:<job 2> '/a b/slurm/merge.sbatch'\n"
            )
        };
        assert_eq!(commands(&scripts, &arrays, None), expected("", ""));
        assert_eq!(commands(&scripts, &arrays, Some(5)), expected("%5", " --dependency=afterany:<job 1>"));
    }
}
