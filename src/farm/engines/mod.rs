//! Engines that run workers on many machines: Slurm, and GNU parallel over ssh. An engine carries `lampyris work` to
//! machines and checkpoints back; what is to be done it reads from the folder, and it knows no tally.
//!
//! ```text
//! missing   plan and progress -> shards that are still to be computed
//! slurm     batch scripts, a job array, a merge that depends on it; what the worker owes Slurm
//! ssh       hosts, copies of the folder, rounds of GNU parallel
//! ```

pub mod missing;
pub mod slurm;
pub mod ssh;

use crate::error::{Error, Result};
use std::io::ErrorKind;
use std::path::Path;
use std::process::{Command, Output};

/// The output of `command`, which must succeed; `hint` says what to do where its program is missing.
fn ask(command: &mut Command, hint: &str) -> Result<String> {
    let output = answer(command, hint)?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
    }
    let said = String::from_utf8_lossy(&output.stderr);
    Err(Error::Failed(format!("{}: {}: {}", name(command), output.status, said.trim())))
}

/// What `command` says and how it ends.
fn answer(command: &mut Command, hint: &str) -> Result<Output> {
    command.output().map_err(|e| not_started(command, hint, &e))
}

/// Why `command` could not be started.
fn not_started(command: &Command, hint: &str, error: &std::io::Error) -> Error {
    let hint = if error.kind() == ErrorKind::NotFound { format!(": {hint}") } else { String::new() };
    Error::Failed(format!("{}: {error}{hint}", name(command)))
}

fn name(command: &Command) -> String {
    command.get_program().to_string_lossy().into_owned()
}

/// `path` from the root, as text that may stand in a script.
///
/// # Errors
/// [`Error::Input`] for a path that is not UTF-8, or with one of the characters `forbidden` or a control character.
fn script_path(path: &Path, forbidden: &str) -> Result<String> {
    let absolute = std::path::absolute(path).map_err(Error::io(path))?;
    let usable = |text: &&str| !text.chars().any(|c| c.is_control() || forbidden.contains(c));
    match absolute.to_str().filter(usable) {
        Some(text) => Ok(text.to_owned()),
        None => {
            let allowed = format!("a path in UTF-8 without control characters and {forbidden}");
            Err(Error::input("command line", "path", absolute.display(), allowed))
        }
    }
}

/// This program, as other machines that share its folder find it.
fn this_program(forbidden: &str) -> Result<String> {
    let program = std::env::current_exe().map_err(|e| Error::Failed(format!("cannot find this program: {e}")))?;
    script_path(&program, forbidden)
}

/// `text` as one word of a shell.
fn quoted(text: &str) -> String {
    shlex::try_quote(text).expect("no NUL in a path or a name").into_owned()
}
