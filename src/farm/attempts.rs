//! Who has begun a shard, where, when and from which batch: one line of JSON for each worker process.
//!
//! ```text
//! DIR/attempts/shard-000012.jsonl
//! ```
//!
//! For the eyes of those who watch. No number depends on it, so lines are appended without locks, and a line that
//! cannot be read is passed over: two workers that begin one shard at one instant on a network file system may cost a
//! line of history, never a batch.

use super::durable;
use super::folder::Folder;
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Read, Write};

/// Of a file of attempts this much is read \[bytes\]: thousands of lines.
const LONGEST: u64 = 1 << 20;

/// One worker process on a shard.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Attempt {
    /// When it began \[s since 1970\].
    pub started: u64,
    /// Machine it ran on.
    pub host: String,
    /// Its process number there.
    pub process: u32,
    /// Batches in the checkpoint from which it went on.
    pub batches: u64,
}

/// Adds `attempt` on shard `k`; the number of attempts so far, this one included.
///
/// # Errors
/// [`Error::Io`]: where nothing can be written a worker need not begin.
pub fn add(folder: &Folder, k: u64, attempt: &Attempt) -> Result<u64> {
    let path = folder.attempts_path(k);
    durable::make_inside(path.parent().expect("attempts lie in a folder"))?;
    let mut line = serde_json::to_string(attempt).expect("numbers and a string have a JSON form");
    line.push('\n');
    let mut file = OpenOptions::new().create(true).append(true).open(&path).map_err(Error::io(&path))?;
    file.write_all(line.as_bytes()).map_err(Error::io(&path))?;
    Ok(read(folder, k)?.len() as u64)
}

/// The shards that somebody has begun, ascending.
///
/// # Errors
/// [`Error::Io`].
pub fn begun(folder: &Folder) -> Result<Vec<u64>> {
    let attempts = folder.root().join("attempts");
    let entries = match std::fs::read_dir(&attempts) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
        other => other.map_err(Error::io(&attempts))?,
    };
    let mut shards = Vec::new();
    for entry in entries {
        let name = entry.map_err(Error::io(&attempts))?.file_name();
        let number: Option<u64> =
            name.to_str().and_then(|n| n.strip_prefix("shard-")?.strip_suffix(".jsonl")?.parse().ok());
        shards.extend(number);
    }
    shards.sort_unstable();
    Ok(shards)
}

/// The attempts on shard `k` so far, in the order in which they were written.
///
/// # Errors
/// [`Error::Io`].
pub fn read(folder: &Folder, k: u64) -> Result<Vec<Attempt>> {
    let path = folder.attempts_path(k);
    let file = match File::open(&path) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
        other => other.map_err(Error::io(&path))?,
    };
    let mut bytes = Vec::new();
    file.take(LONGEST).read_to_end(&mut bytes).map_err(Error::io(&path))?;
    let lines = bytes.split(|&b| b == b'\n');
    Ok(lines.filter_map(|line| serde_json::from_slice(line).ok()).map(without_control).collect())
}

/// A host name from a file goes to a terminal.
fn without_control(attempt: Attempt) -> Attempt {
    Attempt { host: attempt.host.chars().filter(|c| !c.is_control()).take(64).collect(), ..attempt }
}

/// Adds to shard `k` those of `others` that are not known yet: they were made on a copy of the folder.
///
/// # Errors
/// [`Error::Io`].
pub fn join(folder: &Folder, k: u64, others: &[Attempt]) -> Result<()> {
    let known = read(folder, k)?;
    others.iter().filter(|other| !known.contains(other)).try_for_each(|other| add(folder, k, other).map(|_| ()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attempts_are_counted_joined_and_damaged_lines_passed_over() {
        let temp = tempfile::tempdir().unwrap();
        let (here, copy) = (Folder::new(&temp.path().join("a b")), Folder::new(&temp.path().join("copy")));
        let attempt = |started| Attempt { started, host: "n1".to_owned(), process: 7, batches: 2 };
        assert_eq!(read(&here, 3).unwrap(), []);
        assert!(add(&here, 3, &attempt(10)).is_err(), "a folder that is not there is not made");
        [&here, &copy].iter().for_each(|folder| std::fs::create_dir(folder.root()).unwrap());
        assert_eq!(add(&here, 3, &attempt(10)).unwrap(), 1);
        std::fs::OpenOptions::new().append(true).open(here.attempts_path(3)).unwrap().write_all(b"{\"sta\n").unwrap();
        assert_eq!(add(&here, 3, &attempt(20)).unwrap(), 2);
        assert_eq!(add(&copy, 3, &attempt(20)).unwrap(), 1);
        assert_eq!(add(&copy, 3, &Attempt { host: "n2\x1b[2J".to_owned(), ..attempt(30) }).unwrap(), 2);
        join(&here, 3, &read(&copy, 3).unwrap()).unwrap();
        join(&here, 3, &read(&copy, 3).unwrap()).unwrap();
        let all: Vec<(u64, String)> = read(&here, 3).unwrap().into_iter().map(|a| (a.started, a.host)).collect();
        let host = |name: &str| name.to_owned();
        assert_eq!(all, [(10, host("n1")), (20, host("n1")), (30, host("n2[2J"))]);
    }
}
