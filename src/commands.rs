//! One function for each subcommand: what it computes, what it prints, how it exits. Farm and report meet here.

mod submit;
mod watch;

use crate::cli::Command;
use lampyris::error::{Error, Result};
use lampyris::farm::audit::{self, audit};
use lampyris::farm::coordinator::{self, Options};
use lampyris::farm::durable::{check_output, replace};
use lampyris::farm::engines::missing::Missing;
use lampyris::farm::engines::slurm;
use lampyris::farm::folder::{Folder, plan_text};
use lampyris::farm::inputs::{MOST_TEXT, Prepared, prepare, read_at_most, read_scene};
use lampyris::farm::merge::compact::Compacted;
use lampyris::farm::merge::goal::Look;
use lampyris::farm::merge::settle::wait_until_whole;
use lampyris::farm::merge::{self, goal_reached, looks};
use lampyris::farm::plan::{Plan, human};
use lampyris::farm::status::{Seen, Status, now, status};
use lampyris::farm::worker::{self, Order};
use lampyris::fit;
use lampyris::geometry::simd;
use lampyris::report;
use lampyris::scene::photometric_web::Photometry;
use lampyris::scene::{Tabulated, law_of_road};
use lampyris::validate::{self, Found};
use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Checkpoints that `status` reads through, for the goal, at most \[bytes\].
const CHEAP: u64 = 256 << 20;

/// A task of Slurm waits so long for a plan that its node does not see yet \[s\]: NFS forgets what it remembers after 60 s at most.
const LATE: u64 = 70;

/// What a command says and how it ends.
#[derive(Debug)]
pub struct Outcome {
    /// For standard output.
    pub text: String,
    /// How it ends.
    pub exit: Exit,
}

/// How the process ends when nothing failed; errors know their own exit codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// All is done.
    Done = 0,
    /// Something that was to be shown does not hold.
    Failed = 1,
    /// Something was refused and said so.
    Refused = 2,
    /// Merged, but batches are missing.
    Incomplete = 3,
    /// Stopped by a signal after a checkpoint.
    Stopped = 75,
}

/// Carries out `command`.
///
/// # Errors
/// Whatever stops it.
pub fn execute(command: Command) -> Result<Outcome> {
    // Asked for instructions that are not there, nothing is computed with others.
    simd::Path::chosen()?;
    match command {
        Command::Run { job, output, workers, quiet, compact } => run(&job, output, Options { workers, quiet }, compact),
        Command::Plan { job, output } => plan(&job, output),
        Command::Work { dir, shard, threads, compact, parent } => {
            let folder = Folder::new(&dir);
            let outcome = work(Order { folder: folder.clone(), shard, threads, parent })?;
            if let (Exit::Done, Some(together)) = (outcome.exit, compact) {
                compact_if_due(&folder, together);
            }
            Ok(outcome)
        }
        Command::Status { dir, watch: true, .. } => watch::watch(&Folder::new(&dir)),
        Command::Status { dir, json, .. } => show_status(&dir, json),
        Command::Merge { dirs, output, wait } => {
            wait_until_whole(&folders(&dirs), wait);
            merge_and_report(&dirs, output)
        }
        Command::Submit(request) => submit::submit(request),
        Command::Extend { dir, batches } => extend(&dir, batches),
        Command::Compact { dir } => compact(&dir),
        Command::Audit { dir, sample, seed } => {
            let audited = audit(&audit::Order { folder: Folder::new(&dir), share: sample, seed })?;
            let exit = if audited.faults.is_empty() { Exit::Done } else { Exit::Failed };
            Ok(Outcome { text: audited.to_string(), exit })
        }
        Command::Fit { mesh, node, degree, numbers, lanczos, output } => {
            let text = fit::run(&fit::Request { mesh, node, degree, numbers, lanczos, output })?;
            Ok(Outcome { text, exit: Exit::Done })
        }
        Command::Luminaire { file, output } => luminaire(&file, output),
        Command::Reflectance { job } => reflectance(&job),
        Command::Brdf { table, output } => brdf(&table, &output),
        Command::Validate { case, markdown, note } => validate(case.as_deref(), markdown.as_deref(), note.as_deref()),
    }
}

fn run(job: &Path, output: Option<PathBuf>, options: Options, together: Option<u64>) -> Result<Outcome> {
    let (folder, plan) = planned(job, output)?;
    let reached = |folder: &Folder| Ok(goal_reached(std::slice::from_ref(folder))?.is_some());
    let shard_done = |folder: &Folder| together.iter().for_each(|&together| compact_if_due(folder, together));
    let before = match coordinator::run(&folder, &plan, options, &reached, &shard_done)? {
        coordinator::Ended::WasDone if plan.job.stop.is_some() => "nothing was left to do\n".to_owned(),
        coordinator::Ended::WasDone => format!("all {} batches were done before\n", plan.job.run.batches),
        coordinator::Ended::Done => String::new(),
        coordinator::Ended::Stopped => {
            let text = format!("stopped; run the same command again to go on in {}\n", folder.root().display());
            return Ok(Outcome { text, exit: Exit::Stopped });
        }
    };
    let merged = merge_and_report(&[folder.root().to_owned()], None)?;
    Ok(Outcome { text: before + &merged.text, ..merged })
}

fn plan(job: &Path, output: Option<PathBuf>) -> Result<Outcome> {
    let (folder, plan) = establish(job, output)?;
    let sizes = plan.sizes();
    let text = format!(
        "{}\n# {} shards in {}\n# memory of a worker about {}, batch scores kept in all {}\n\
         # disk of a checkpoint at most {}, of all {}; of noisy maps it is packed to some 0.55 of that\n",
        plan_text(&plan),
        plan.shard_count(),
        folder.root().display(),
        human(sizes.worker),
        human(sizes.kept),
        human(sizes.checkpoint),
        human(sizes.checkpoints),
    );
    Ok(Outcome { text, exit: Exit::Done })
}

/// The plan of `job`: the one that stands there where it is a folder.
fn planned(job: &Path, output: Option<PathBuf>) -> Result<(Folder, Plan)> {
    match output {
        None if Folder::new(job).plan_path().exists() => {
            let folder = Folder::new(job);
            let plan = folder.read_plan()?;
            Ok((folder, plan))
        }
        output => establish(job, output),
    }
}

/// Plans `job` into its folder.
fn establish(job: &Path, output: Option<PathBuf>) -> Result<(Folder, Plan)> {
    let Prepared { plan, files } = prepare(job)?;
    let folder = Folder::new(&output.unwrap_or_else(|| Path::new("out").join(&plan.name)));
    folder.establish(&plan, &files)?;
    Ok((folder, plan))
}

fn work(order: Order) -> Result<Outcome> {
    let shard = order.shard;
    // A worker of a coordinator answers to it, wherever that runs.
    let task = if order.parent.is_none() { slurm::Task::of_environment() } else { None };
    task.iter().for_each(|_| worker::await_plan(&order, LATE));
    let begun = |begun: &worker::Begun| {
        // The log of a job shows every attempt.
        task.iter().for_each(|task| crate::say(&format!("{begun} ({task})\n")));
    };
    let ended = worker::work(&order, &begun)?;
    if let Some(task) = task {
        answer(&task, shard, ended);
    }
    Ok(match ended {
        worker::Ended::Done => Outcome { text: format!("shard {shard}: done\n"), exit: Exit::Done },
        worker::Ended::Stopped | worker::Ended::TimeUp { .. } => {
            Outcome { text: format!("shard {shard}: stopped\n"), exit: Exit::Stopped }
        }
    })
}

/// Does what Slurm expects of its task after `ended`; returns only where the process shall end by itself.
fn answer(task: &slurm::Task, shard: u64, ended: worker::Ended) {
    match ended {
        worker::Ended::Done => {}
        worker::Ended::Stopped => {
            crate::say(&format!("shard {shard}: checkpoint written, waiting to be ended\n"));
            task.wait_to_be_killed()
        }
        worker::Ended::TimeUp { added: 0 } => crate::say(&format!(
            "shard {shard}: no batch fits into the time limit; submit again with a longer --time\n"
        )),
        worker::Ended::TimeUp { added } => {
            crate::say(&format!("shard {shard}: {added} more batches, time is up, to be requeued\n"));
            match task.requeue() {
                Ok(()) => task.wait_to_be_killed(),
                Err(e) => crate::say(&format!("shard {shard}: not requeued: {e}\n")),
            }
        }
    }
}

fn show_status(dir: &Path, json: bool) -> Result<Outcome> {
    let folder = Folder::new(dir);
    let status = judged_status(&folder, CHEAP)?;
    let exit = if status.refused.is_empty() { Exit::Done } else { Exit::Refused };
    let shown = |e| Error::Failed(format!("status has no JSON form: {e}"));
    let text = if json { serde_json::to_string_pretty(&status).map_err(shown)? + "\n" } else { status.to_string() };
    Ok(Outcome { text, exit })
}

/// The progress of a folder and, where checkpoints of at most `most` bytes have to be read for it, where its goal stands.
fn judged_status(folder: &Folder, most: u64) -> Result<Status> {
    let mut status = status(folder)?;
    if status.refused.is_empty() && looks_cheap(folder, &status, most)? {
        match looks(std::slice::from_ref(folder)) {
            Ok(looks) => {
                let reached = looks.last().filter(|look| look.reached).map(|look| look.batches);
                let seen = |look: &Look| Seen { batches: look.batches, relative_half_width: look.relative_half_width };
                status.judge(&folder.read_plan()?, reached, looks.last().map(seen));
            }
            Err(e @ Error::Refused { .. }) => status.refused.push(e.to_string()),
            Err(e) => return Err(e),
        }
    }
    Ok(status)
}

/// True when a look has come and at most `most` bytes have to be read for it.
fn looks_cheap(folder: &Folder, status: &Status, most: u64) -> Result<bool> {
    let Some(look) = status.goal.and_then(|goal| goal.last_look) else { return Ok(false) };
    let plan = folder.read_plan()?;
    let shards = look.div_ceil(plan.job.run.batches_per_shard);
    Ok(plan.sizes().checkpoint.saturating_mul(shards) <= most)
}

fn folders(dirs: &[PathBuf]) -> Vec<Folder> {
    dirs.iter().map(|dir| Folder::new(dir)).collect()
}

fn merge_and_report(dirs: &[PathBuf], output: Option<PathBuf>) -> Result<Outcome> {
    let folders = folders(dirs);
    let output = output.unwrap_or_else(|| dirs[0].clone());
    std::fs::create_dir_all(&output).map_err(Error::io(&output))?;
    let (plan, merged) = merge::merge(&folders, &output)?;
    let summary = report::write(&plan, &merged, &output)?;
    let exit = if merged.missing.is_empty() { Exit::Done } else { Exit::Incomplete };
    let mut text = format!("{summary}results in {}\n", output.display());
    if let ([folder], Exit::Incomplete) = (&folders[..], exit) {
        text += &slurm::go_on(folder, &missing(folder)?)?.unwrap_or_default();
    }
    Ok(Outcome { text, exit })
}

/// What is still to be computed in `folder`.
fn missing(folder: &Folder) -> Result<Missing> {
    let status = judged_status(folder, u64::MAX)?;
    match status.refused.is_empty() {
        true => Ok(Missing::of(&folder.read_plan()?, &status)),
        false => Err(Error::refused(folder.root(), status.refused.join("\n"))),
    }
}

fn extend(dir: &Path, batches: u64) -> Result<Outcome> {
    let plan = Folder::new(dir).extend(batches)?;
    let text = format!("{} batches, {} shards in {}\n", plan.job.run.batches, plan.shard_count(), dir.display());
    Ok(Outcome { text, exit: Exit::Done })
}

/// Compacts `folder` where so many shards have come together. All shards stay as they are if that fails, and the next one that
/// is done tries again: so a failure is only said.
fn compact_if_due(folder: &Folder, together: u64) {
    let compacted = folder.read_plan().and_then(|plan| match merge::compact::is_due(folder, &plan, together)? {
        true => merge::compact::compact(folder, now()).map(|_| ()),
        false => Ok(()),
    });
    if let Err(e) = compacted {
        crate::warn(&format!("not compacted: {e}"));
    }
}

fn compact(dir: &Path) -> Result<Outcome> {
    let Compacted { shards, files } = merge::compact::compact(&Folder::new(dir), now())?;
    let text = match shards {
        0 => "nothing to compact: the first shard is not whole yet\n".to_owned(),
        _ => format!("shards 0 .. {} are in one file, {files} files removed\n", shards - 1),
    };
    Ok(Outcome { text, exit: Exit::Done })
}

/// Says what a photometric file holds, and draws its polar curves.
fn luminaire(file: &Path, output: Option<PathBuf>) -> Result<Outcome> {
    let name = file.display().to_string();
    let bytes = read_at_most(file, MOST_TEXT)
        .map_err(|e| Error::input("command line", "FILE", &name, format!("an IES or EULUMDAT file ({e})")))?;
    let photometry = Photometry::parse(&name, &bytes)?;
    let title = file.file_name().unwrap_or_default().to_string_lossy();
    // With its whole name in front: a luminaire often comes as .ies and .ldt.
    let picture = output.unwrap_or_else(|| PathBuf::from(format!("{title}.png")));
    check_output(&picture, "png")?;
    report::write_polar(&picture, &title, &photometry)?;
    let text = format!("{}curves in {}\n", report::luminaire_text(&photometry), picture.display());
    Ok(Outcome { text, exit: Exit::Done })
}

/// What each material of the job reflects and transmits.
fn reflectance(job: &Path) -> Result<Outcome> {
    Ok(Outcome { text: report::reflectance_text(&read_scene(job)?), exit: Exit::Done })
}

/// Writes the tabulated law of an r-table.
fn brdf(table: &Path, output: &Path) -> Result<Outcome> {
    check_output(output, "brdf")?;
    let name = table.display().to_string();
    let bytes = read_at_most(table, MOST_TEXT)
        .map_err(|e| Error::input("command line", "TABLE", &name, format!("a text with an r-table ({e})")))?;
    let law = law_of_road(&name, &String::from_utf8_lossy(&bytes))?;
    Tabulated::parse(&name, law.as_bytes())?;
    replace(output, |to| to.write_all(law.as_bytes()))?;
    Ok(Outcome { text: format!("tabulated law in {}\n", output.display()), exit: Exit::Done })
}

/// Runs the cases, shows each as soon as it is done, and writes the document `markdown` if one is wanted.
fn validate(part: Option<&str>, markdown: Option<&Path>, note: Option<&str>) -> Result<Outcome> {
    let cases = validate::select(part)?;
    if let Some(file) = markdown {
        // Better now than after two minutes; what stands there stays until the battery is through.
        OpenOptions::new().append(true).create(true).open(file).map_err(Error::io(file))?;
    }
    crate::say(&validate::header());
    let mut found = Vec::new();
    for case in cases {
        let case = case.run()?;
        crate::say(&validate::rows(&case));
        found.push(case);
    }
    if let Some(file) = markdown {
        std::fs::write(file, validate::markdown(&found, note)).map_err(Error::io(file))?;
    }
    Ok(conclusion(&found))
}

/// The last words on a battery, and exit code 1 if a comparison fails.
fn conclusion(found: &[Found]) -> Outcome {
    let exit = if validate::failures(found).is_empty() { Exit::Done } else { Exit::Failed };
    Outcome { text: validate::summary(found), exit }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lampyris::validate::select;

    #[test]
    fn a_wrong_reference_ends_with_exit_code_1() {
        let case = || select(Some("direct/point-source")).unwrap().remove(0).run().unwrap();
        let right = conclusion(&[case()]);
        assert_eq!((right.exit, right.text.contains("FAILS")), (Exit::Done, false), "{}", right.text);
        let mut wrong = case();
        wrong.comparisons[0].reference *= 1.001;
        let outcome = conclusion(&[case(), wrong]);
        assert_eq!(outcome.exit as u8, 1);
        assert!(outcome.text.contains("FAILS direct/point-source: horizontal"), "{}", outcome.text);
    }
}
