//! Copies of a planned folder on machines that do not share it: out with rsync, checkpoints back.
//!
//! ```text
//! out    plan, inputs, this program, unfinished checkpoints   -> FOLDER on the host
//! back   FOLDER/shards, FOLDER/attempts                       -> DIR/ssh/host-<n>
//! take   of each shard the longer checkpoint                  -> DIR/shards
//! ```
//!
//! What comes back is read through and compared before it replaces anything: a longer checkpoint is taken where the
//! one that stands here is its prefix, and refused by name where it is not. Of a shard that was compacted here nothing is longer.

use super::hosts::{Host, Login};
use crate::error::{Error, Result};
use crate::farm::attempts;
use crate::farm::checkpoint::{Reader, read_compaction, read_header, read_progress};
use crate::farm::durable;
use crate::farm::engines::ask;
use crate::farm::folder::Folder;
use crate::farm::plan::Plan;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What to do where a program is missing.
const HINT: &str =
    "needed by --engine ssh, here and on hosts with a folder of their own (packages rsync, openssh-client)";
/// Of a folder on a host, only this comes back.
const BACK: [&str; 5] = [
    "--include=/shards/",
    "--include=/shards/shard-*.ckpt",
    "--include=/attempts/",
    "--include=/attempts/shard-*.jsonl",
    "--exclude=*",
];

/// Makes sure that the host answers, and that its folder is there: the one it shares, or a place for a copy.
pub(super) fn reach(host: &Host, root: &str) -> Result<()> {
    match (&host.login, &host.folder) {
        (None, _) => Ok(()),
        (Some(login), Some(there)) => ask(&mut login.command(&["mkdir", "-p", there]), HINT).map(|_| ()),
        (Some(login), None) => {
            let seen = ask(&mut login.command(&["test", "-r", &format!("{root}/plan.toml")]), HINT);
            seen.map(|_| ()).map_err(|e| Error::Failed(format!("{e}: it must see {root}, or be given a folder")))
        }
    }
}

/// Brings the host's copy up to date, with what `shards` have so far.
pub(super) fn send(host: &Host, folder: &Folder, root: &str, program: &str, shards: &[u64]) -> Result<()> {
    let (Some(login), Some(there)) = (&host.login, &host.folder) else { return Ok(()) };
    let mut out = rsync(login);
    out.args(["--recursive", "--ignore-missing-args"]);
    let begun = shards.iter().map(|&k| folder.shard_path(k)).filter(|path| path.exists());
    let below = |path: PathBuf| format!("{root}/./shards/{}", path.file_name().unwrap_or_default().to_string_lossy());
    out.arg("--relative").args([format!("{root}/./plan.toml"), format!("{root}/./inputs")]).args(begun.map(below));
    ask(out.arg(format!("{}:{there}/", login.destination)), HINT)?;
    ask(rsync(login).arg(program).arg(format!("{}:{there}/lampyris", login.destination)), HINT).map(|_| ())
}

/// Takes over what host number `n` has done on its copy.
pub(super) fn fetch(host: &Host, n: usize, folder: &Folder, plan: &Plan) -> Result<()> {
    let (Some(login), Some(there)) = (&host.login, &host.folder) else { return Ok(()) };
    let here = Folder::new(&folder.root().join("ssh").join(format!("host-{n}")));
    durable::make_inside(here.root())?;
    let mut back = rsync(login);
    back.arg("--recursive").args(BACK).arg(format!("{}:{there}/", login.destination)).arg(here.root());
    ask(&mut back, HINT)?;
    take(&here, folder, plan)
}

/// rsync by way of `login`, with names taken as they are.
fn rsync(login: &Login) -> Command {
    let mut command = Command::new("rsync");
    command.args(["--times", "--perms", "--protect-args", "--rsh", &login.ssh_line()]);
    command
}

/// Takes from `copy` the checkpoints that are longer than those in `folder`, and attempts that are not known there.
fn take(copy: &Folder, folder: &Folder, plan: &Plan) -> Result<()> {
    let folded = read_compaction(folder, plan)?.map_or_else(Vec::new, |folded| folded.parts(plan));
    for (k, path) in copy.checkpoints()? {
        let Some(reader) = Reader::open(&path, plan, k)? else { continue };
        let standing = read_progress(folder, plan, &folded, k)?;
        let (old, new) = (standing.map(|header| header.digests).unwrap_or_default(), &reader.header().digests);
        if !new.starts_with(&old) && !old.starts_with(new) {
            let compacted = k < folded.len() as u64;
            let other = if compacted { folder.compaction_path() } else { folder.shard_path(k) };
            let reason = format!("contradicts {}", other.display());
            return Err(Error::refused(&path, reason));
        }
        if new.len() > old.len() {
            // Damage shows now rather than in the merge, when the host may be gone.
            reader.tally()?;
            replace(folder, k, &path, new.len(), plan)?;
        }
    }
    attempts::begun(copy)?.into_iter().try_for_each(|k| attempts::join(folder, k, &attempts::read(copy, k)?))
}

/// Puts the file at `from`, of `batches` batches, in the place of the checkpoint of shard `k`.
fn replace(folder: &Folder, k: u64, from: &Path, batches: usize, plan: &Plan) -> Result<()> {
    let to = folder.shard_path(k);
    durable::make_inside(to.parent().expect("a checkpoint lies in a folder"))?;
    let mut file = File::open(from).map_err(Error::io(from))?;
    // Somebody else may have gone further meanwhile, or have compacted the shard: its file is asked for first, as it is
    // removed last.
    let shorter = || {
        let standing = match read_header(&to, plan, k)? {
            Some(header) => header.digests.len(),
            None => read_compaction(folder, plan)?.map_or(0, |folded| folded.digests_of(plan, k).len()),
        };
        Ok(standing < batches)
    };
    durable::replace_if(&to, |w| std::io::copy(&mut file, w).map(|_| ()), shorter).map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::farm::merge::compact::compact;
    use crate::farm::testing::{JOB, fixed_direct, plan, plan_of, save, save_tally, tally};

    #[test]
    fn longer_checkpoints_are_taken_shorter_ones_left_and_others_refused() {
        let (temp, plan) = (tempfile::tempdir().unwrap(), plan());
        let folder = |name: &str| Folder::new(&temp.path().join(name));
        let (here, copy) = (folder("here"), folder("a copy"));
        let batches = |k: u64| read_header(&here.shard_path(k), &plan, k).unwrap().map_or(0, |h| h.batches());
        for (folder, shard, done) in [(&here, 0, 1), (&copy, 0, 3), (&here, 1, 4), (&copy, 1, 2), (&copy, 2, 2)] {
            assert!(save(folder, &plan, shard, done).unwrap());
        }
        take(&copy, &here, &plan).unwrap();
        assert_eq!([0, 1, 2].map(batches), [3, 4, 2]);
        // The tally of a damaged file is not taken, nor that of another shard.
        let path = copy.shard_path(0);
        assert!(save(&copy, &plan, 0, 4).unwrap());
        let mut bytes = std::fs::read(&path).unwrap();
        *bytes.last_mut().unwrap() ^= 1;
        std::fs::write(&path, &bytes).unwrap();
        assert!(matches!(take(&copy, &here, &plan), Err(Error::Refused { .. })));
        std::fs::copy(copy.shard_path(1), &path).unwrap();
        assert!(matches!(take(&copy, &here, &plan), Err(Error::Refused { .. })));
        assert_eq!([0, 1, 2].map(batches), [3, 4, 2]);
    }

    #[test]
    fn of_a_compacted_shard_nothing_comes_back() {
        let (temp, plan) = (tempfile::tempdir().unwrap(), plan());
        let folder = |name: &str| Folder::new(&temp.path().join(name));
        let (here, copy) = (folder("here"), folder("copy"));
        here.establish(&plan, &[]).unwrap();
        for (folder, shard, done) in [(&here, 0, 4), (&here, 1, 4), (&copy, 0, 4), (&copy, 1, 2), (&copy, 2, 1)] {
            assert!(save(folder, &plan, shard, done).unwrap());
        }
        assert_eq!(compact(&here, 7).unwrap().shards, 2);
        take(&copy, &here, &plan).unwrap();
        let numbers = || here.checkpoints().unwrap().into_iter().map(|(k, _)| k).collect::<Vec<_>>();
        assert_eq!(numbers(), [2]);
        // It was compacted after it had been compared.
        replace(&here, 0, &copy.shard_path(0), 4, &plan).unwrap();
        assert_eq!(numbers(), [2]);
        // What contradicts the compaction is named with it.
        let seed = plan_of(&JOB.replace("seed = 7", "seed = 8")).unwrap();
        std::fs::remove_file(copy.shard_path(0)).unwrap();
        assert!(save_tally(&copy, &plan, 0, &tally(&seed, 0, 2), &fixed_direct(&plan)).unwrap());
        let refused = take(&copy, &here, &plan).unwrap_err().to_string();
        assert!(refused.contains("contradicts") && refused.contains("compacted.ckpt"), "{refused}");
        assert_eq!(numbers(), [2]);
    }
}
