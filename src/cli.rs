//! Command line: run, plan, work, status, merge, submit, extend, compact, audit, fit, luminaire, validate. Types only; what they
//! do is in `commands.rs`.
//!
//! Flags say where and with how many processes; none of them changes a number. Only the job does.

use clap::{Args, Parser, Subcommand, ValueEnum};
use lampyris::farm::engines::slurm::TimeLimit;
use lampyris::fit::MAX_LANCZOS;
use lampyris::geometry::harmonic::MAX_DEGREE;
use lampyris::geometry::harmonic::file::Numbers;
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
        /// The job file, or a folder that is planned already.
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
        /// Whenever N whole shards have come together at the beginning, fold them into one file, as `compact` does.
        #[arg(long, value_name = "N", value_parser = together())]
        compact: Option<u64>,
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
        /// Behind the shard, where N whole ones have come together at the beginning, fold them into one file, as `compact` does.
        #[arg(long, value_name = "N", value_parser = together())]
        compact: Option<u64>,
        /// Process whose end ends this worker, too.
        #[arg(long, value_name = "PID", hide = true)]
        parent: Option<i32>,
    },
    /// Say how far a folder is, from checkpoint headers; of a goal, whether it is reached, where that is quickly read.
    #[command(after_help = "Examples:\n  lampyris status out/room --watch\n  lampyris status out/room --json")]
    Status {
        /// Folder of the plan.
        dir: PathBuf,
        /// Print JSON.
        #[arg(long)]
        json: bool,
        /// Look again every few seconds until all is done.
        #[arg(long, conflicts_with = "json")]
        watch: bool,
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
        /// Look again for so long while checkpoints are missing or read short: network file systems show some late.
        #[arg(long, value_name = "SECONDS", default_value = "0", value_parser = clap::value_parser!(u64).range(..=86_400))]
        wait: u64,
    },
    /// Compute on many machines: by Slurm, or by ssh with GNU parallel; the same command again submits what is missing.
    #[command(after_help = "Examples:\n  lampyris submit jobs/room.toml -o out/room --engine slurm --time 1:00:00\n  \
                      lampyris submit out/room --engine slurm --array-limit 50 --sbatch '--account=light'\n  \
                      lampyris submit out/room --engine ssh --hosts hosts.txt")]
    Submit(Submit),
    /// Add batches to a planned folder, whether it is finished or not: its checkpoints stay and are continued.
    #[command(after_help = "Example:\n  lampyris extend out/room --batches 512\n  lampyris run out/room")]
    Extend {
        /// Folder of the plan.
        dir: PathBuf,
        /// Batches of the whole job from now on; with a goal its max_batches.
        #[arg(long, value_name = "N")]
        batches: u64,
    },
    /// Fold the whole shards with which a folder begins into one file and remove theirs; workers may go on meanwhile.
    #[command(after_help = "Example:\n  lampyris compact out/room")]
    Compact {
        /// Folder of the plan.
        dir: PathBuf,
    },
    /// Compute batches drawn at random again and compare them with the checkpoints bit for bit; exit code 1 if any differs.
    #[command(after_help = "Examples:\n  lampyris audit out/room\n  lampyris audit out/room --sample 100% --seed 7")]
    Audit {
        /// Folder of the plan.
        dir: PathBuf,
        /// Share of the batches in the checkpoints.
        #[arg(long, value_name = "PERCENT", default_value = "1%", value_parser = share)]
        sample: f64,
        /// Another seed draws other batches.
        #[arg(long, value_name = "S", default_value = "1")]
        seed: u64,
    },
    /// Fit spherical harmonics to a closed, star-shaped mesh, and say how far they are from it.
    #[command(after_help = "Examples:\n  lampyris fit head.glb --node Head --degree 32 -o head.harmonic\n  \
                      lampyris fit cube.obj --degree 32 --lanczos 1 --numbers f64 -o cube.harmonic")]
    Fit {
        /// A .glb, .gltf or .obj file.
        mesh: PathBuf,
        /// The node whose mesh is meant, in its own coordinates [default: the only one].
        #[arg(long, value_name = "NAME")]
        node: Option<String>,
        /// Degree N of the series, 0 .. 128: (N + 1)^2 coefficients.
        #[arg(long, value_name = "N", value_parser = degree)]
        degree: usize,
        /// How coefficients are stored: f32 or f64.
        #[arg(long, value_name = "KIND", default_value = "f32", value_parser = numbers)]
        numbers: Numbers,
        /// Damp degree k by (sin(x)/x)^POWER, x = pi k/(N + 1): fewer ripples at creases, less exact elsewhere.
        #[arg(long, value_name = "POWER", default_value = "0", value_parser = lanczos)]
        lanczos: f64,
        /// The file to write; a picture with .png instead of .harmonic goes beside it.
        #[arg(short, long, value_name = "OUT.harmonic")]
        output: PathBuf,
    },
    /// Say what a photometric file holds (IES LM-63, EULUMDAT), and draw its polar curves.
    #[command(after_help = "Example:\n  lampyris luminaire downlight.ies -o downlight.png")]
    Luminaire {
        /// An .ies or .ldt file.
        file: PathBuf,
        /// The picture [default: the whole name of the file and .png, in the current folder].
        #[arg(short, long, value_name = "OUT.png")]
        output: Option<PathBuf>,
    },
    /// Say of each material of a job how much light it reflects and transmits, by the angle of incidence.
    #[command(after_help = "Example:\n  lampyris reflectance jobs/glass.toml")]
    Reflectance {
        /// A job file.
        job: PathBuf,
    },
    /// Turn a road-surface r-table (CIE 144) into a tabulated law for [[material]].
    #[command(after_help = "Example:\n  lampyris brdf r3.txt -o r3.brdf")]
    Brdf {
        /// A line `beta` with angles, then lines of tan(gamma) and 10^4 r; docs/brdf-format.md.
        table: PathBuf,
        /// The file to write.
        #[arg(short, long, value_name = "OUT.brdf")]
        output: PathBuf,
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

/// What `submit` was asked to do.
#[derive(Debug, Args)]
pub struct Submit {
    /// Folder of a plan, or a job file, which is planned first.
    #[arg(value_name = "DIR|JOB")]
    pub target: PathBuf,
    /// Folder of the plan of a job file [default: out/<job name>].
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Who carries the work to machines: slurm or ssh.
    #[arg(long, value_name = "ENGINE")]
    pub engine: Engine,
    /// With slurm: shards at work at a time, at most.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    pub array_limit: Option<u64>,
    /// With slurm: time limit of a job, as Slurm writes it [default: 1:00:00]; a shard that needs longer goes on in another.
    #[arg(long, value_name = "T")]
    pub time: Option<TimeLimit>,
    /// With slurm: the partition.
    #[arg(long, value_name = "P")]
    pub partition: Option<String>,
    /// With slurm: further options of sbatch.
    #[arg(long, value_name = "OPTIONS", allow_hyphen_values = true)]
    pub sbatch: Option<String>,
    /// With slurm: submit nothing, print scripts and commands; a job file is planned all the same.
    #[arg(long)]
    pub dry_run: bool,
    /// Whenever N whole shards have come together at the beginning, a worker folds them into one file; not on copies of DIR.
    #[arg(long, value_name = "N", value_parser = together())]
    pub compact: Option<u64>,
    /// With ssh: the file of hosts; a line has processes, [user@]host[:port], and a folder where DIR is not shared.
    #[arg(long, value_name = "FILE")]
    pub hosts: Option<PathBuf>,
}

/// What runs workers on many machines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Engine {
    /// A job array.
    Slurm,
    /// GNU parallel and ssh.
    Ssh,
}

/// A number of shards that are folded together.
fn together() -> clap::builder::RangedU64ValueParser {
    clap::value_parser!(u64).range(2..=100_000)
}

/// A share such as `1%`.
fn share(text: &str) -> Result<f64, String> {
    let percent = text.strip_suffix('%').and_then(|number| number.parse().ok());
    let share = percent.map(|percent: f64| percent / 100.0).filter(|share| *share > 0.0 && *share <= 1.0);
    share.ok_or_else(|| "allowed: above 0% and at most 100%".to_owned())
}

/// The degree of a series.
fn degree(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|&n| n <= MAX_DEGREE).ok_or_else(|| format!("allowed: 0 .. {MAX_DEGREE}"))
}

/// A way to store coefficients.
fn numbers(text: &str) -> Result<Numbers, String> {
    Numbers::ALL.into_iter().find(|n| n.name() == text).ok_or_else(|| "allowed: f32, f64".to_owned())
}

/// The power of the Lanczos factor.
fn lanczos(text: &str) -> Result<f64, String> {
    let allowed = || format!("allowed: 0 .. {MAX_LANCZOS}");
    text.parse().ok().filter(|power| (0.0..=MAX_LANCZOS).contains(power)).ok_or_else(allowed)
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
