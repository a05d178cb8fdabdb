//! `lampyris submit`: a job file or a planned folder to an engine.

use super::{Exit, Outcome, compact_if_due, establish, merge_and_report, missing};
use crate::cli::{Engine, Submit};
use lampyris::error::{Error, Result};
use lampyris::farm::engines::slurm::{self, TimeLimit};
use lampyris::farm::engines::ssh;
use lampyris::farm::folder::Folder;
use lampyris::farm::plan::Plan;
use std::path::Path;

/// Where nobody says otherwise.
const ONE_HOUR: TimeLimit = TimeLimit::hours(1);

/// Plans if need be, and submits what is missing.
pub(super) fn submit(request: Submit) -> Result<Outcome> {
    check(&request)?;
    let (folder, plan) = planned(&request)?;
    match (request.engine, &request.hosts) {
        (Engine::Slurm, _) => by_slurm(request, &folder, &plan),
        (Engine::Ssh, Some(hosts)) => by_ssh(hosts, request.compact, &folder, &plan),
        (Engine::Ssh, None) => Err(missing_hosts()),
    }
}

/// Refuses options of the other engine before anything is written.
fn check(request: &Submit) -> Result<()> {
    let Submit { array_limit, time, partition, sbatch, dry_run, hosts, .. } = request;
    let of_slurm = [
        ("--array-limit", array_limit.is_some()),
        ("--time", time.is_some()),
        ("--partition", partition.is_some()),
        ("--sbatch", sbatch.is_some()),
        ("--dry-run", *dry_run),
    ];
    let of_ssh = [("--hosts", hosts.is_some())];
    let (foreign, engine) = match request.engine {
        Engine::Slurm => (&of_ssh[..], "ssh"),
        Engine::Ssh => (&of_slurm[..], "slurm"),
    };
    if let Some((flag, _)) = foreign.iter().find(|(_, given)| *given) {
        return Err(Error::input("command line", flag, "(given)", format!("only with --engine {engine}")));
    }
    match (request.engine, hosts) {
        (Engine::Ssh, None) => Err(missing_hosts()),
        // Before a plan is made for nobody.
        (Engine::Ssh, Some(hosts)) => ssh::hosts::read(hosts).map(|_| ()),
        _ => Ok(()),
    }
}

fn missing_hosts() -> Error {
    Error::input("command line", "--hosts", "(missing)", "a file of hosts, with --engine ssh")
}

/// The folder and plan that are meant.
fn planned(request: &Submit) -> Result<(Folder, Plan)> {
    if !request.target.is_dir() {
        return establish(&request.target, request.output.clone());
    }
    if let Some(output) = &request.output {
        let allowed = "only with a job file: this folder is planned already";
        return Err(Error::input("command line", "--output", output.display(), allowed));
    }
    let folder = Folder::new(&request.target);
    let plan = folder.read_plan()?;
    Ok((folder, plan))
}

fn by_slurm(request: Submit, folder: &Folder, plan: &Plan) -> Result<Outcome> {
    let Submit { array_limit, time, partition, sbatch, dry_run, compact, .. } = request;
    let time = time.unwrap_or(ONE_HOUR);
    let request = slurm::Request { array_limit, time, partition, sbatch, dry_run, compact };
    let text = slurm::submit(folder, plan, &missing(folder)?, &request)?;
    Ok(Outcome { text, exit: Exit::Done })
}

/// Computes in the foreground, then merges.
fn by_ssh(hosts: &Path, compact: Option<u64>, folder: &Folder, plan: &Plan) -> Result<Outcome> {
    let hosts = ssh::hosts::read(hosts)?;
    let visited = || compact.iter().for_each(|&together| compact_if_due(folder, together));
    match ssh::run(folder, plan, &hosts, &|| missing(folder), &visited, &crate::say)? {
        ssh::Ended::Done => merge_and_report(&[folder.root().to_owned()], None),
        ssh::Ended::Stopped => {
            let text = format!("stopped; the same command goes on in {}\n", folder.root().display());
            Ok(Outcome { text, exit: Exit::Stopped })
        }
    }
}
