//! Command line: run, plan, work, status, merge, validate. Types only; what they do is in `commands.rs`.
//!
//! Flags say where and with how many processes; none of them changes a number. Only the job does.

use clap::{Parser, Subcommand};
use std::path::PathBuf;

/// Global illumination in absolute photometric units, every number with a confidence interval.
#[derive(Debug, Parser)]
#[command(
    version,
    after_help = "Example:\n  lampyris run jobs/room.toml        renders into out/room\n\n\
Exit codes: 0 done; 1 failed; 2 wrong usage or bad input; 3 merged but incomplete;\n\
75 stopped by a signal after a checkpoint."
)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Plan, compute with several worker processes, merge and report; resumes what is unfinished.
    #[command(after_help = "Example:\n  lampyris run jobs/room.toml -o out/room -w 4")]
    Run {
        /// The job file.
        job: PathBuf,
        /// Folder of the plan, its checkpoints and results [default: out/<job name>].
        #[arg(short, long, value_name = "DIR")]
        output: Option<PathBuf>,
        /// Worker processes [default: the cores, fewer if memory is short].
        #[arg(short, long, value_name = "WORKERS", value_parser = crew)]
        workers: Option<usize>,
        /// No progress.
        #[arg(short, long)]
        quiet: bool,
    },
    /// Copy the job and its inputs into a folder, write the plan and print it with its sizes.
    #[command(after_help = "Example:\n  lampyris plan jobs/room.toml -o out/room")]
    Plan {
        /// The job file.
        job: PathBuf,
        /// Folder of the plan [default: out/<job name>].
        #[arg(short, long, value_name = "DIR")]
        output: Option<PathBuf>,
    },
    /// Compute one shard of a planned folder, writing checkpoints; resumes from its checkpoint.
    #[command(
        after_help = "Examples:\n  lampyris work out/room --shard 3\n  sbatch --array=0-7 --wrap 'lampyris work out/room'"
    )]
    Work {
        /// Folder of the plan.
        dir: PathBuf,
        /// Number of the shard, from 0.
        #[arg(long, value_name = "K", env = "SLURM_ARRAY_TASK_ID")]
        shard: u64,
        /// Threads [default: the cores].
        #[arg(long, value_name = "N", value_parser = crew)]
        threads: Option<usize>,
        /// Process whose end ends this worker, too.
        #[arg(long, value_name = "PID", hide = true)]
        parent: Option<i32>,
    },
    /// Say how far a folder is, from checkpoint headers; of a goal, whether it is reached, where that is quickly read.
    #[command(after_help = "Example:\n  lampyris status out/room --json")]
    Status {
        /// Folder of the plan.
        dir: PathBuf,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Merge checkpoints into results, also those of an unfinished run (exit code 3).
    #[command(after_help = "Example:\n  lampyris merge out/room copied-from-other-machine -o out/all")]
    Merge {
        /// Folders of one plan.
        #[arg(required = true, value_name = "DIR")]
        dirs: Vec<PathBuf>,
        /// Folder of the results [default: the first DIR].
        #[arg(short, long, value_name = "OUT")]
        output: Option<PathBuf>,
    },
    /// Run cases with an exact answer and print reference, estimate, interval and z; exit code 1 if any fails.
    #[command(after_help = "Examples:\n  lampyris validate\n  lampyris validate --case sobolev/\n  \
                      lampyris validate --markdown --note 'Commit abc, two cores.'")]
    Validate {
        /// Only the cases whose names contain this.
        #[arg(long, value_name = "NAME")]
        case: Option<String>,
        /// Write the results as a document, too [default: docs/validation.md].
        #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "docs/validation.md")]
        markdown: Option<PathBuf>,
        /// What the document shall say of commit, date and machine.
        #[arg(long, value_name = "TEXT", requires = "markdown")]
        note: Option<String>,
    },
}

/// A count of processes or threads: not zero, and not so many that they only hinder each other.
fn crew(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(n) if (1..=1024).contains(&n) => Ok(n),
        _ => Err("allowed: 1 .. 1024".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent_and_every_help_has_an_example() {
        Cli::command().debug_assert();
        for command in Cli::command().get_subcommands() {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            assert!(help.contains("lampyris"), "{}", command.get_name());
        }
    }
}
