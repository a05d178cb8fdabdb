//! One error type for the whole program, and the exit code each error stands for.

mod words;

pub use words::{in_words, listed};

use std::path::{Path, PathBuf};

/// What went wrong, in words a user can act on.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A value somebody typed or a file from elsewhere is outside what is allowed.
    #[error("{file}: {field} = {value}: {allowed}")]
    Input {
        /// File the value stands in.
        file: String,
        /// Path of the field inside the file, such as `camera[0].width`.
        field: String,
        /// The offending value as written.
        value: String,
        /// What would have been accepted.
        allowed: String,
    },
    /// A file is not of the kind, version or plan it should be, or is damaged. Nothing was changed.
    #[error("{path}: refused: {reason}")]
    Refused {
        /// The file.
        path: PathBuf,
        /// Why it is not used.
        reason: String,
    },
    /// The operating system refused to read or write a file.
    #[error("{path}: {source}")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A worker process ended without finishing its shard.
    #[error("shard {shard}: {message}")]
    Worker {
        /// Number of the shard.
        shard: u64,
        /// What it said last.
        message: String,
        /// Exit code that this stands for: 2 when it refused its input, else 1.
        code: u8,
    },
    /// The work itself failed.
    #[error("{0}")]
    Failed(String),
}

/// The result of everything that can fail.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// An [`Error::Input`] from anything printable.
    pub fn input(file: impl ToString, field: impl ToString, value: impl ToString, allowed: impl ToString) -> Self {
        Error::Input {
            file: file.to_string(),
            field: field.to_string(),
            value: words::shown(&value.to_string()),
            allowed: allowed.to_string(),
        }
    }

    /// The same of the file called `file`: who finds that things do not fit together need not know where they were typed.
    pub fn in_file(mut self, name: &str) -> Self {
        if let Error::Input { file, .. } = &mut self {
            *file = name.to_owned();
        }
        self
    }

    /// The same of the field `field`: who reads a file need not know where it was named.
    pub fn in_field(mut self, name: &str) -> Self {
        if let Error::Input { field, .. } = &mut self {
            *field = name.to_owned();
        }
        self
    }

    /// An [`Error::Refused`] for the file at `path`.
    pub fn refused(path: &Path, reason: impl ToString) -> Self {
        Error::Refused { path: path.to_owned(), reason: reason.to_string() }
    }

    /// A closure that attaches `path` to an I/O error, for `map_err`.
    pub fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        move |source| Error::Io { path: path.to_owned(), source }
    }

    /// Exit code of the process: 2 for bad input, 1 for everything that failed.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Input { .. } | Error::Refused { .. } => 2,
            Error::Worker { code, .. } => *code,
            Error::Io { .. } | Error::Failed(_) => 1,
        }
    }
}
