//! Machines without a scheduler: GNU parallel carries shards to them by ssh.
//!
//! In rounds: whatever is missing goes out, each shard to the next free process of any host; what a host fails at, GNU
//! parallel gives to another. Hosts without a copy of the folder work in the folder itself; from the others checkpoints
//! are fetched while they work and at the end of a round. A round without a new batch is the last.
//!
//! ```text
//! DIR/ssh/logins     hosts, as GNU parallel reads them
//! DIR/ssh/log        what the workers said
//! DIR/ssh/host-<n>   what was fetched from host n
//! ```

mod copies;
pub mod hosts;

use super::missing::{Missing, list};
use super::{not_started, quoted, script_path, this_program};
use crate::error::{Error, Result};
use crate::farm::checkpoint::{Header, read_compaction, read_progress};
use crate::farm::durable;
use crate::farm::folder::Folder;
use crate::farm::plan::Plan;
use crate::farm::status::status;
use hosts::{FORBIDDEN, Host};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use signal_hook::consts::{SIGINT, SIGTERM};
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// What to do without GNU parallel.
const HINT: &str = "--engine ssh needs GNU parallel (package parallel)";
/// Time between two looks at GNU parallel.
const POLL: Duration = Duration::from_millis(200);
/// Time between two visits to the copies, at least.
const VISIT: Duration = Duration::from_secs(5);
/// What hosts have written into the folder may be seen here so much later: NFS forgets what it remembers after 60 s at most.
const LATE: Duration = Duration::from_secs(70);
/// A worker whose connection ends has this long to write its checkpoint \[ms\].
const GRACE: &str = "TERM,10000,KILL,25";
/// Of the log this much is shown when a round was in vain \[bytes\].
const LAST_WORDS: u64 = 2048;

/// How a submission ended when nothing failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// Nothing is missing any more.
    Done,
    /// A signal asked to stop.
    Stopped,
}

/// Computes what is missing of `plan` in `folder` on `hosts`: `missing` says what that is, from the folder; `visited`
/// is told now and then while hosts are at work; `say` tells the user.
///
/// # Errors
/// [`Error::Failed`] where no host can be reached, GNU parallel is not there, or a round brings no new batch;
/// [`Error::Refused`] for checkpoints from a host that are damaged or contradict those here.
pub fn run(
    folder: &Folder,
    plan: &Plan,
    hosts: &[Host],
    missing: &dyn Fn() -> Result<Missing>,
    visited: &dyn Fn(),
    say: &dyn Fn(&str),
) -> Result<Ended> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGTERM, SIGINT] {
        signal_hook::flag::register(signal, Arc::clone(&stop))
            .map_err(|e| Error::Failed(format!("cannot catch signal {signal}: {e}")))?;
    }
    let (root, program) = (script_path(folder.root(), FORBIDDEN)?, this_program(FORBIDDEN)?);
    durable::make_folder(&folder.root().join("ssh"))?;
    let run = Run { folder, plan, hosts, root, program, visited, say };
    let mut before = None;
    loop {
        let ready = run.ready();
        // What was done since, or what an earlier submission has left on the hosts.
        run.fetch(&ready)?;
        if stop.load(Ordering::Relaxed) {
            return Ok(Ended::Stopped);
        }
        let shards = missing()?.shards;
        if shards.is_empty() {
            return Ok(Ended::Done);
        }
        let batches = Some(status(folder)?.batches);
        if before == batches {
            return Err(Error::Failed(format!("no host has computed a batch; {}", run.last_words())));
        }
        before = batches;
        let copies = ready.iter().any(|(_, host)| host.folder.is_some());
        if run.round(ready, &shards, &stop)? && !copies {
            run.wait_for(&shards);
        }
    }
}

struct Run<'a> {
    folder: &'a Folder,
    plan: &'a Plan,
    hosts: &'a [Host],
    /// The folder, from the root.
    root: String,
    /// This program, on hosts that share it.
    program: String,
    visited: &'a dyn Fn(),
    say: &'a dyn Fn(&str),
}

impl Run<'_> {
    /// The hosts that can be reached and have a place to work in, with their numbers.
    fn ready(&self) -> Vec<(usize, &Host)> {
        let said = |host: &Host, e: &Error| (self.say)(&format!("{} is left out: {e}\n", host.short_name()));
        let ready = |host: &Host| copies::reach(host, &self.root).inspect_err(|e| said(host, e)).is_ok();
        (1..).zip(self.hosts).filter(|(_, host)| ready(host)).collect()
    }

    /// Gives `shards` to hosts; true when every worker said that its shard is done.
    fn round(&self, ready: Vec<(usize, &Host)>, shards: &[u64], stop: &AtomicBool) -> Result<bool> {
        let said = |host: &Host, e: &Error| (self.say)(&format!("{} is left out: {e}\n", host.short_name()));
        let send = |host: &Host| copies::send(host, self.folder, &self.root, &self.program, shards);
        let sent = |host: &Host| send(host).inspect_err(|e| said(host, e)).is_ok();
        let ready: Vec<(usize, &Host)> = ready.into_iter().filter(|(_, host)| sent(host)).collect();
        if ready.is_empty() {
            return Err(Error::Failed("no host can be used".to_owned()));
        }
        let names: Vec<String> = ready.iter().map(|(_, host)| host.short_name()).collect();
        (self.say)(&format!("shards {} on {}\n", list(shards.iter().copied()), names.join(", ")));
        let mut parallel = self.start(&ready, shards)?;
        let ended = self.watch(&mut parallel, &ready, stop);
        // Whatever happened, nobody is left behind.
        if ended.is_err() {
            end(&mut parallel)?;
        }
        ended
    }

    /// GNU parallel with the shards on its standard input.
    fn start(&self, hosts: &[(usize, &Host)], shards: &[u64]) -> Result<Child> {
        let logins = self.folder.root().join("ssh/logins");
        let lines: String = hosts.iter().map(|(_, host)| format!("{}/{}\n", host.processes, host.name())).collect();
        durable::replace(&logins, |w| w.write_all(lines.as_bytes()))?;
        let log = self.log()?;
        let copy = log.try_clone().map_err(|e| Error::Failed(format!("cannot share the log: {e}")))?;
        let mut command = Command::new("parallel");
        command.args(["--will-cite", "--sshloginfile"]).arg(&logins).args(["--termseq", GRACE]);
        // Once on every host, and once more.
        command.args(["--retries", &(hosts.len() + 1).max(3).to_string(), "--tagstring", "shard {}"]);
        command.arg(self.command(hosts)).stdin(Stdio::piped()).stdout(log).stderr(copy);
        let mut child = command.spawn().map_err(|e| not_started(&command, HINT, &e))?;
        let numbers: String = shards.iter().map(|k| format!("{k}\n")).collect();
        let mut stdin = child.stdin.take().expect("its standard input is a pipe");
        // If it has ended already, its exit and its log say more than the broken pipe.
        let _ = stdin.write_all(numbers.as_bytes());
        Ok(child)
    }

    /// What a host is to do for the shard `{}`, wherever its folder is.
    fn command(&self, hosts: &[(usize, &Host)]) -> String {
        let mut script = "case \"$PARALLEL_SSHLOGIN\" in ".to_owned();
        for (_, host) in hosts {
            if let Some(folder) = &host.folder {
                script += &format!("{}) folder={};; ", quoted(&host.name()), quoted(folder));
            }
        }
        let (root, program) = (quoted(&self.root), quoted(&self.program));
        script += &format!("*) exec {program} work {root} --shard \"$1\" --threads 1;; esac; ");
        script += "exec \"$folder/lampyris\" work \"$folder\" --shard \"$1\" --threads 1";
        format!("sh -c {} shard {{}}", quoted(&script))
    }

    /// Looks again while `shards`, which are done, are not seen to be: the folder may be shown late.
    fn wait_for(&self, shards: &[u64]) {
        let begun = Instant::now();
        let is_done = |k: u64, folded: &[Header]| {
            let header = read_progress(self.folder, self.plan, folded, k);
            let range = self.plan.shard(k);
            header.is_ok_and(|header| header.is_some_and(|header| header.batches() >= range.end - range.start))
        };
        let all_done = || {
            let folded = read_compaction(self.folder, self.plan).ok().flatten();
            let folded = folded.map_or_else(Vec::new, |folded| folded.parts(self.plan));
            shards.iter().all(|&k| is_done(k, &folded))
        };
        while begun.elapsed() < LATE && !all_done() {
            std::thread::sleep(POLL);
        }
    }

    /// Until it ends or a signal asks to stop, visiting the copies now and then; true when every worker ended well.
    fn watch(&self, parallel: &mut Child, hosts: &[(usize, &Host)], stop: &AtomicBool) -> Result<bool> {
        let has_copies = hosts.iter().any(|(_, host)| host.folder.is_some());
        let pause = VISIT.max(Duration::from_secs_f64(self.plan.job.run.checkpoint_seconds));
        let mut visited = Instant::now();
        loop {
            if let Some(status) = parallel.try_wait().map_err(|e| Error::Failed(format!("parallel: {e}")))? {
                return Ok(status.success());
            }
            if stop.load(Ordering::Relaxed) {
                return end(parallel).map(|()| false);
            }
            std::thread::sleep(POLL);
            if visited.elapsed() > pause {
                if has_copies {
                    self.fetch(hosts)?;
                }
                (self.visited)();
                visited = Instant::now();
            }
        }
    }

    /// Takes over what `hosts` have done on their copies. One that cannot be reached may have died: it is said of the
    /// next round.
    fn fetch(&self, hosts: &[(usize, &Host)]) -> Result<()> {
        for (n, host) in hosts {
            match copies::fetch(host, *n, self.folder, self.plan) {
                Err(Error::Failed(_)) => {}
                other => other?,
            }
        }
        Ok(())
    }

    fn log(&self) -> Result<File> {
        let path = self.folder.root().join("ssh/log");
        OpenOptions::new().create(true).append(true).open(&path).map_err(Error::io(&path))
    }

    /// The end of the log.
    fn last_words(&self) -> String {
        let path = self.folder.root().join("ssh/log");
        format!("{} says at its end:\n{}", path.display(), tail(&path).unwrap_or_default().trim())
    }
}

fn tail(path: &Path) -> std::io::Result<String> {
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(LAST_WORDS)))?;
    let mut bytes = Vec::new();
    file.take(LAST_WORDS).read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Ends GNU parallel and, by way of their connections, the workers.
fn end(parallel: &mut Child) -> Result<()> {
    let pid = Pid::from_raw(i32::try_from(parallel.id()).expect("process numbers fit in an i32"));
    // At the first signal it starts nothing more, at the second it ends what runs. It may have ended already.
    for _ in 0..2 {
        let _ = kill(pid, Signal::SIGTERM);
        std::thread::sleep(POLL);
    }
    parallel.wait().map(|_| ()).map_err(|e| Error::Failed(format!("parallel: {e}")))
}
