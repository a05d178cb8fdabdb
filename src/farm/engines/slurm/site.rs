//! What Slurm says: the site's limits, what is queued; and what it is told: a job to submit.

use crate::error::{Error, Result};
use crate::farm::engines::ask;
use std::collections::BTreeSet;
use std::process::Command;

/// What to do where Slurm's commands are missing.
const HINT: &str = "submit from a machine that has Slurm's commands";
/// Slurm's own default.
const MAX_ARRAY_SIZE: u64 = 1001;

/// The limits of a site.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Site {
    /// Numbers of array tasks are below this.
    pub max_array_size: u64,
}

impl Site {
    pub fn ask() -> Result<Site> {
        let config = ask(Command::new("scontrol").args(["show", "config"]), HINT)?;
        match max_array_size(&config) {
            Some(max_array_size) => Ok(Site { max_array_size }),
            None => Err(Error::Failed("scontrol show config: no MaxArraySize of at least 2 in it".to_owned())),
        }
    }

    /// The site's limits, or Slurm's defaults where nobody can be asked.
    pub fn or_default() -> Site {
        Site::ask().unwrap_or(Site { max_array_size: MAX_ARRAY_SIZE })
    }
}

fn max_array_size(config: &str) -> Option<u64> {
    let line = config.lines().find(|line| line.starts_with("MaxArraySize"))?;
    line.split_once('=')?.1.trim().parse().ok().filter(|&n| n >= 2)
}

/// Shards that are queued or running.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Queue {
    pub shards: BTreeSet<u64>,
    /// The jobs that they belong to.
    pub jobs: BTreeSet<String>,
}

impl Queue {
    /// Of the script at `path`, as it was submitted by the same user.
    pub fn ask(path: &str) -> Result<Queue> {
        // Job, task, command with its arguments; pending tasks of an array a line each.
        let text = ask(Command::new("squeue").args(["--me", "-h", "-r", "-o", "%F|%K|%o"]), HINT)?;
        Ok(Queue::of(&text, path))
    }

    fn of(text: &str, path: &str) -> Queue {
        let mut queue = Queue::default();
        for (job, shard) in text.lines().filter_map(|line| job_and_shard(line, path)) {
            queue.jobs.insert(job);
            queue.shards.insert(shard);
        }
        queue
    }

    pub fn job_list(&self) -> String {
        self.jobs.iter().cloned().collect::<Vec<_>>().join(", ")
    }
}

/// Job and shard of a line of squeue, if its command is the script at `path`.
fn job_and_shard(line: &str, path: &str) -> Option<(String, u64)> {
    let mut fields = line.splitn(3, '|');
    let (job, task, command) = (fields.next()?, fields.next()?, fields.next()?);
    let first = match command.strip_prefix(path)?.trim_end() {
        "" => 0,
        argument => argument.strip_prefix(' ')?.trim().parse::<u64>().ok()?,
    };
    Some((job.to_owned(), first.checked_add(task.parse().ok()?)?))
}

/// Submits a job; its number.
pub(super) fn sbatch(options: &[String]) -> Result<String> {
    let said = ask(Command::new("sbatch").arg("--parsable").args(options), HINT)?;
    // The number, and on some sites the cluster.
    let number = said.trim().split(';').next().unwrap_or_default();
    match number.bytes().all(|b| b.is_ascii_digit()) && !number.is_empty() {
        true => Ok(number.to_owned()),
        false => Err(Error::Failed(format!("sbatch: no number of a job in \"{}\"", said.trim()))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_queue_knows_the_shards_of_a_script_by_its_path_and_argument() {
        let path = "/data/my runs/it's|x/slurm/shards.sbatch";
        let text = format!(
            "12|0|{path}\n12|7|{path} \n13|3|{path} 1000\n14|5|{path}.old\n15|N/A|/data/merge.sbatch\n16|1|(null)\n\
             17|2|{path} x\n18|N/A|{path}\n"
        );
        let queue = Queue::of(&text, path);
        assert_eq!(queue.shards, BTreeSet::from([0, 7, 1003]));
        assert_eq!(queue.job_list(), "12, 13");
        assert_eq!(Queue::of("", path), Queue::default());
    }

    #[test]
    fn the_limit_of_arrays_is_found_in_the_configuration() {
        assert_eq!(max_array_size("A = 1\nMaxArraySize            = 1001\nB = 2"), Some(1001));
        assert_eq!(max_array_size("MaxArraySize = 0"), None);
        assert_eq!(max_array_size("nothing"), None);
    }
}
