//! What a worker owes Slurm when it is a task of a job array.
//!
//! After SIGTERM Slurm counts a process that ends by itself as finished or failed, and does not run it again: so
//! the worker writes its checkpoint and waits to be killed. Before the time limit it asks to be run again, and waits as well.

use crate::error::{Error, Result};
use crate::farm::engines::ask;
use std::process::Command;

/// The array task that this process is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Task {
    /// `<array job>_<task>`.
    pub id: String,
    /// How often Slurm has started it again.
    pub restarts: u64,
}

impl Task {
    /// From the environment; None where Slurm has not started this process as a task of a job array.
    pub fn of_environment() -> Option<Task> {
        let number = |name: &str| std::env::var(name).ok()?.parse::<u64>().ok();
        let (job, task) = (number("SLURM_ARRAY_JOB_ID")?, number("SLURM_ARRAY_TASK_ID")?);
        let restarts = number("SLURM_RESTART_COUNT").unwrap_or(0);
        Some(Task { id: format!("{job}_{task}"), restarts })
    }

    /// Asks Slurm to run this task again.
    ///
    /// # Errors
    /// [`Error::Failed`] with what scontrol said.
    pub fn requeue(&self) -> Result<()> {
        // In a session of its own: the SIGTERM that follows at once would end scontrol as well.
        let mut command = Command::new("setsid");
        command.args(["--wait", "scontrol", "requeue", &self.id]);
        match ask(&mut command, "part of util-linux") {
            // It was requeued by somebody else meanwhile.
            Err(Error::Failed(said)) if said.contains("pending execution") => Ok(()),
            other => other.map(|_| ()),
        }
    }

    /// Waits for Slurm to kill this process, at the latest at the time limit of its job.
    pub fn wait_to_be_killed(&self) -> ! {
        loop {
            // Returns at every signal that is caught.
            nix::unistd::pause();
        }
    }
}

impl std::fmt::Display for Task {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "Slurm job {}, restart {}", self.id, self.restarts)
    }
}
