//! Durable replace: write beside, sync, rename, sync the folder. Nobody else renames.
//!
//! Whoever replaces a checkpoint holds a lock beside it from the first byte to the last sync, so a temporary file found
//! under the lock belongs to a process that died: it is removed. On file systems without locks, or where a frozen process
//! keeps the lock for half a minute, leftovers stay, and are harmless because nobody reads them. A reader sees the old file
//! or the new one, whole.
//!
//! Tests stop a process inside a replacement: once [`arm_fault`] has been called, the environment variable
//! `LAMPYRIS_FAULT=<step>:<count>` kills the process with SIGKILL at the named [`Step`] of its `<count>`-th
//! replacement (from 1), for example `LAMPYRIS_FAULT=before-rename:2`. Only workers arm it.

use crate::error::{Error, Result};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::fs::{File, OpenOptions, Permissions, TryLockError};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Suffix of files being written.
const TEMPORARY: &str = ".tmp";
/// A replacement takes seconds; who holds a lock for longer is frozen, as on a node that was cut off.
const PATIENCE: Duration = Duration::from_secs(30);
/// Time between two tries for a lock.
const BETWEEN_TRIES: Duration = Duration::from_millis(10);

/// The moments of a replacement at which a process can be made to die.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// The temporary file exists and is empty.
    AfterCreate,
    /// All is written, nothing is synced.
    AfterWrite,
    /// The temporary file is safe on disk.
    AfterSync,
    /// The decision to replace has been taken.
    BeforeRename,
    /// The new file stands in its place, the folder is not synced.
    AfterRename,
    /// All is done.
    AfterFolderSync,
}

impl Step {
    /// Every step, in order.
    pub const ALL: [Step; 6] = [
        Step::AfterCreate,
        Step::AfterWrite,
        Step::AfterSync,
        Step::BeforeRename,
        Step::AfterRename,
        Step::AfterFolderSync,
    ];

    /// Its name in `LAMPYRIS_FAULT`.
    pub fn name(self) -> &'static str {
        match self {
            Step::AfterCreate => "after-create",
            Step::AfterWrite => "after-write",
            Step::AfterSync => "after-sync",
            Step::BeforeRename => "before-rename",
            Step::AfterRename => "after-rename",
            Step::AfterFolderSync => "after-folder-sync",
        }
    }
}

static FAULT: OnceLock<(Step, u64)> = OnceLock::new();
static REPLACEMENTS: AtomicU64 = AtomicU64::new(0);

/// Takes the step and count at which to die from `LAMPYRIS_FAULT`; does nothing without that variable.
///
/// # Errors
/// [`Error::Input`] for a value that names no step: a fault that never fires would make a test pass for nothing.
pub fn arm_fault() -> Result<()> {
    let Ok(value) = std::env::var("LAMPYRIS_FAULT") else { return Ok(()) };
    let parsed = value.split_once(':').and_then(|(name, count)| {
        let step = Step::ALL.into_iter().find(|s| s.name() == name)?;
        Some((step, count.parse().ok()?))
    });
    let names = Step::ALL.map(Step::name).join(", ");
    let allowed = format!("<step>:<count> with a step among {names}");
    let fault = parsed.ok_or_else(|| Error::input("environment", "LAMPYRIS_FAULT", &value, allowed))?;
    FAULT.get_or_init(|| fault);
    Ok(())
}

fn reached(step: Step) {
    if FAULT.get() == Some(&(step, REPLACEMENTS.load(Ordering::Relaxed))) {
        // Nothing to report to: if the signal could not be sent, the test that asked for it sees a live process.
        let _ = kill(Pid::this(), Signal::SIGKILL);
    }
}

/// What a replacement is written to.
pub type Beside<'a> = BufWriter<&'a File>;

/// Replaces the file at `path` by what `write` writes, durably. Nobody else may be replacing it.
///
/// # Errors
/// [`Error::Io`]; the old file is then untouched.
pub fn replace(path: &Path, write: impl FnOnce(&mut Beside) -> io::Result<()>) -> Result<()> {
    put(path, write, || Ok(true)).map(|_| ())
}

/// Like [`replace`], under a lock and only if `allowed` says so just before the rename; true when replaced.
///
/// # Errors
/// [`Error::Io`], or what `allowed` returns; the old file is then untouched.
pub fn replace_if(
    path: &Path,
    write: impl FnOnce(&mut Beside) -> io::Result<()>,
    allowed: impl FnOnce() -> Result<bool>,
) -> Result<bool> {
    let lock = lock_beside(path, PATIENCE)?;
    if lock.is_some() {
        remove_leftovers(path);
    }
    put(path, write, allowed)
}

fn put(
    path: &Path,
    write: impl FnOnce(&mut Beside) -> io::Result<()>,
    allowed: impl FnOnce() -> Result<bool>,
) -> Result<bool> {
    REPLACEMENTS.fetch_add(1, Ordering::Relaxed);
    let folder = folder_of(path);
    // A temporary file is private by default; results are as readable as the user's umask lets them be.
    let permissions = Permissions::from_mode(0o666);
    let mut builder = tempfile::Builder::new();
    let builder = builder.suffix(TEMPORARY).permissions(permissions);
    let file = builder.prefix(&beside(path, ".")).tempfile_in(folder).map_err(Error::io(folder))?;
    reached(Step::AfterCreate);
    let mut buffered = BufWriter::with_capacity(1 << 18, file.as_file());
    write(&mut buffered).and_then(|()| buffered.flush()).map_err(Error::io(path))?;
    drop(buffered);
    reached(Step::AfterWrite);
    file.as_file().sync_all().map_err(Error::io(path))?;
    reached(Step::AfterSync);
    if !allowed()? {
        return Ok(false);
    }
    reached(Step::BeforeRename);
    file.persist(path).map_err(|e| Error::io(path)(e.error))?;
    reached(Step::AfterRename);
    sync_folder(folder)?;
    reached(Step::AfterFolderSync);
    Ok(true)
}

/// Makes the folder at `path` where there is none, durably.
///
/// # Errors
/// [`Error::Io`].
pub fn make_folder(path: &Path) -> Result<()> {
    if path.is_dir() {
        return Ok(());
    }
    std::fs::create_dir_all(path).map_err(Error::io(path))?;
    sync_folder(folder_of(path))
}

/// Makes the folder at `path` where there is none, inside one that is there: what somebody has removed stays away.
///
/// # Errors
/// [`Error::Io`].
pub fn make_inside(path: &Path) -> Result<()> {
    match std::fs::create_dir(path) {
        Err(e) if e.kind() == ErrorKind::AlreadyExists => Ok(()),
        other => other.map_err(Error::io(path)).and_then(|()| sync_folder(folder_of(path))),
    }
}

/// Refuses the path of a file to write, as the command line has it, that does not end in `.<ending>`, for it may be that of an input, or
/// lies in no folder.
///
/// # Errors
/// [`Error::Input`].
pub fn check_output(path: &Path, ending: &str) -> Result<()> {
    let bad = |allowed: String| Err(Error::input("command line", "--output", path.display(), allowed));
    match path.extension().is_some_and(|e| e == ending) {
        false => bad(format!("a file name that ends in .{ending}")),
        true if !folder_of(path).is_dir() => bad("a file in a folder that is there".to_owned()),
        true => Ok(()),
    }
}

fn folder_of(path: &Path) -> &Path {
    let folder = path.parent().expect("replaced files have a name");
    // A bare name has an empty parent, which is no folder that can be opened.
    if folder == Path::new("") { Path::new(".") } else { folder }
}

/// Makes a rename or a new file in `folder` survive a power cut.
fn sync_folder(folder: &Path) -> Result<()> {
    let synced = File::open(folder).and_then(|f| f.sync_all());
    match synced {
        // Some network file systems do not sync folders; there is nothing better to do there.
        Err(e) if matches!(e.kind(), ErrorKind::InvalidInput | ErrorKind::Unsupported) => Ok(()),
        other => other.map_err(Error::io(folder)),
    }
}

/// `.<file name><end>`: hidden names that belong to `path`.
fn beside(path: &Path, end: &str) -> String {
    let name = path.file_name().expect("replaced files have a name").to_string_lossy();
    format!(".{name}{end}")
}

/// Where the lock of the file at `path` lies.
pub fn lock_path(path: &Path) -> PathBuf {
    path.with_file_name(beside(path, ".lock"))
}

/// The lock beside `path`, released when dropped or when the process dies; None where there are no locks, or where somebody
/// keeps it beyond `patience`.
fn lock_beside(path: &Path, patience: Duration) -> Result<Option<File>> {
    let lock = lock_path(path);
    let opened = OpenOptions::new().create(true).truncate(false).write(true).open(&lock);
    let file = opened.map_err(Error::io(&lock))?;
    let begun = Instant::now();
    loop {
        match file.try_lock() {
            Ok(()) => return Ok(Some(file)),
            Err(TryLockError::WouldBlock) if begun.elapsed() < patience => std::thread::sleep(BETWEEN_TRIES),
            Err(_) => return Ok(None),
        }
    }
}

fn remove_leftovers(path: &Path) {
    let prefix = beside(path, ".");
    let Ok(entries) = std::fs::read_dir(folder_of(path)) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with(&prefix) && name.ends_with(TEMPORARY) {
            // A leftover that cannot be removed does no harm.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replaces_keeps_and_cleans_up() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.ckpt");
        let leftover = folder.path().join(".x.ckpt.abc.tmp");
        let other = folder.path().join(".x.ckpt2.abc.tmp");
        std::fs::write(&leftover, "half").unwrap();
        std::fs::write(&other, "half").unwrap();
        assert!(replace_if(&path, |w| w.write_all(b"one"), || Ok(true)).unwrap());
        assert!(!leftover.exists() && other.exists());
        let replaced = replace_if(&path, |w| w.write_all(b"two"), || Ok(false)).unwrap();
        assert!(!replaced);
        assert_eq!(std::fs::read(&path).unwrap(), b"one");
        let failed = replace(&path, |_| Err(io::Error::other("disk full")));
        assert!(failed.unwrap_err().to_string().contains("disk full"));
        assert_eq!(std::fs::read(&path).unwrap(), b"one");
        let names: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert_eq!(names.len(), 3, "{names:?}");
    }

    #[test]
    fn a_lock_is_waited_for_but_not_for_ever() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.ckpt");
        let held = lock_beside(&path, PATIENCE).unwrap().unwrap();
        assert!(lock_beside(&path, Duration::from_millis(30)).unwrap().is_none());
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| lock_beside(&path, PATIENCE).unwrap().is_some());
            std::thread::sleep(Duration::from_millis(30));
            assert!(!waiting.is_finished());
            drop(held);
            assert!(waiting.join().unwrap());
        });
    }
}
