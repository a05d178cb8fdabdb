//! One worker process.

use crate::error::{Error, Result};
use crate::farm::folder::Folder;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, Command, ExitStatus, Stdio};

/// Of what a worker wrote to its standard error, this much is shown \[bytes\].
const LAST_WORDS: u64 = 2048;
/// Exit code of a worker that refuses its input: trying again cannot help.
const REFUSED: i32 = 2;

/// A running worker.
#[derive(Debug)]
pub struct Worker {
    /// The shard it computes.
    pub shard: u64,
    /// Batches in the checkpoint when it was started.
    pub batches_at_start: u64,
    child: Child,
    /// Its standard error: a file without a name, so that no thread has to listen.
    stderr: File,
}

/// How a worker ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// With code 2: bad input or a refused file.
    Refused,
    /// With any other code.
    Code(i32),
    /// By a signal.
    Signal(i32),
}

impl std::fmt::Display for Exit {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Exit::Refused => write!(f, "refused its input"),
            Exit::Code(code) => write!(f, "ended with exit code {code}"),
            Exit::Signal(signal) => write!(f, "was ended by signal {signal}"),
        }
    }
}

impl Exit {
    fn of(status: ExitStatus) -> Self {
        match (status.code(), status.signal()) {
            (Some(REFUSED), _) => Exit::Refused,
            (Some(code), _) => Exit::Code(code),
            (None, signal) => Exit::Signal(signal.unwrap_or(0)),
        }
    }
}

impl Worker {
    /// Starts `lampyris work` on `shard`. The worker asks the kernel to be stopped when this process ends.
    pub fn start(folder: &Folder, shard: u64, threads: usize, batches_at_start: u64) -> Result<Worker> {
        let failed = |what: &str, e: std::io::Error| Error::Failed(format!("shard {shard}: {what}: {e}"));
        let program = std::env::current_exe().map_err(|e| failed("cannot find this program", e))?;
        let stderr = tempfile::tempfile().map_err(|e| failed("cannot make a file for its messages", e))?;
        let copy = stderr.try_clone().map_err(|e| failed("cannot share the file for its messages", e))?;
        let mut command = Command::new(program);
        command.arg("work").arg(folder.root());
        command.args(["--shard", &shard.to_string(), "--threads", &threads.to_string()]);
        command.args(["--parent", &std::process::id().to_string()]);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(copy);
        let child = command.spawn().map_err(|e| failed("cannot start a worker", e))?;
        Ok(Worker { shard, batches_at_start, child, stderr })
    }

    /// `child` as the worker of `shard`.
    #[cfg(test)]
    pub fn fake(shard: u64, child: Child) -> Worker {
        let stderr = tempfile::tempfile().expect("tests have room for a file");
        Worker { shard, batches_at_start: 0, child, stderr }
    }

    /// How it ended; None while it runs.
    pub fn ended(&mut self) -> Result<Option<Exit>> {
        let status = self.child.try_wait().map_err(|e| Error::Failed(format!("shard {}: {e}", self.shard)))?;
        Ok(status.map(Exit::of))
    }

    /// Asks it to write its checkpoint and stop.
    pub fn ask_to_stop(&self) {
        let pid = i32::try_from(self.child.id()).expect("process numbers fit in an i32");
        // It may have ended already: then there is nobody to ask.
        let _ = kill(Pid::from_raw(pid), Signal::SIGTERM);
    }

    /// Waits for its end.
    pub fn wait(&mut self) -> Result<()> {
        self.child.wait().map(|_| ()).map_err(|e| Error::Failed(format!("shard {}: {e}", self.shard)))
    }

    /// The end of what it wrote to its standard error. Only after its end: the position in the file is shared.
    pub fn last_words(&mut self) -> String {
        let read = |file: &mut File| -> std::io::Result<Vec<u8>> {
            let length = file.metadata()?.len();
            file.seek(SeekFrom::Start(length.saturating_sub(LAST_WORDS)))?;
            let mut bytes = Vec::new();
            file.take(LAST_WORDS).read_to_end(&mut bytes)?;
            Ok(bytes)
        };
        let bytes = read(&mut self.stderr).unwrap_or_default();
        let text = String::from_utf8_lossy(&bytes).trim().to_owned();
        if text.is_empty() { "(it said nothing)".to_owned() } else { text }
    }
}
