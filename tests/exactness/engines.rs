//! What engines build on: the worker's answers to signals, submissions as far as they go without Slurm and ssh, several
//! coordinators, previews while others work. The engines themselves run in `scripts/external.sh`.

use crate::bits::{Bits, summary};
use crate::place::{BATCHES, Place, SHARDS, batches, batches_of, checkpoint, computed, plan_in, straight};
use crate::process::{alive, expect, lampyris, pid, run_quietly, send, start, stat, wait_for, work};
use lampyris::farm::attempts;
use lampyris::farm::durable::lock_path;
use lampyris::farm::folder::Folder;
use nix::sys::signal::Signal;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};

const ATTEMPTS: usize = 100;

/// A plan of one long shard, whose checkpoints are written after a second and for signals only.
fn one_shard(place: &Place, name: &str) -> PathBuf {
    let job = fs::read_to_string(place.path("job.toml")).unwrap();
    let job =
        job.replace("batches = 28", "batches = 200").replace("batches_per_shard = 5 ", "batches_per_shard = 200 ");
    let path = place.path(&format!("{name}.toml"));
    fs::write(&path, job.replace("checkpoint_seconds = 0.1", "checkpoint_seconds = 86400.0")).unwrap();
    place.plan(&path, name)
}

/// Starts a worker on shard 0, as Slurm would or not, and waits until it has written a checkpoint and goes on: a signal finds
/// it computing a batch.
fn begin(dir: &Path, by_slurm: bool) -> Child {
    let before = attempts::read(&Folder::new(dir), 0).unwrap().len();
    let had = batches(dir, 0);
    let mut command = work(dir, 0);
    if by_slurm {
        // Without programs: scontrol can be asked for nothing.
        command.env("SLURM_ARRAY_JOB_ID", "12").env("SLURM_ARRAY_TASK_ID", "0").env("PATH", "");
    }
    let worker = start(&mut command);
    wait_for("an attempt", || (attempts::read(&Folder::new(dir), 0).unwrap().len() > before).then_some(()));
    send(pid(&worker), Signal::SIGUSR1);
    more_than(dir, had);
    // Whoever replaces a checkpoint holds its lock to the end.
    fs::File::open(lock_path(&dir.join(checkpoint(0)))).unwrap().lock().unwrap();
    let ticks = || stat(pid(&worker)).unwrap().ticks;
    let saved = ticks();
    wait_for("the next batch", || (ticks() > saved + 1).then_some(()));
    worker
}

/// Batches in the checkpoint, as soon as there are more than `had`.
fn more_than(dir: &Path, had: u64) -> u64 {
    wait_for("a checkpoint", || Some(batches(dir, 0)).filter(|&n| n > had))
}

#[test]
fn sigusr1_writes_a_checkpoint_and_the_worker_goes_on() {
    let place = Place::new();
    let dir = one_shard(&place, "dir");
    let mut worker = begin(&dir, false);
    let before = batches(&dir, 0);
    send(pid(&worker), Signal::SIGUSR1);
    let first = more_than(&dir, before);
    send(pid(&worker), Signal::SIGUSR1);
    let second = more_than(&dir, first);
    assert!(second < 200 && alive(pid(&worker)), "{first}, {second}");
    send(pid(&worker), Signal::SIGTERM);
    assert_eq!(worker.wait().unwrap().code(), Some(75));
    assert!(batches(&dir, 0) >= second);
}

#[test]
fn sigusr2_ends_a_worker_after_a_checkpoint() {
    let place = Place::new();
    let dir = one_shard(&place, "dir");
    // By itself; and where Slurm cannot be asked to run it again, with the same code: incomplete, but nothing is lost.
    for by_slurm in [false, true] {
        let mut worker = begin(&dir, by_slurm);
        let had = batches(&dir, 0);
        send(pid(&worker), Signal::SIGUSR2);
        assert_eq!(worker.wait().unwrap().code(), Some(75));
        assert!((had + 1..200).contains(&batches(&dir, 0)));
    }
    let attempts = attempts::read(&Folder::new(&dir), 0).unwrap();
    assert_eq!((attempts[0].batches, attempts.len()), (0, 2));
    assert!(attempts[1].batches > 1);
}

#[test]
fn a_task_of_slurm_writes_a_checkpoint_at_sigterm_and_waits_to_be_killed() {
    let place = Place::new();
    let dir = one_shard(&place, "dir");
    let mut worker = begin(&dir, true);
    let before = batches(&dir, 0);
    send(pid(&worker), Signal::SIGTERM);
    let written = more_than(&dir, before);
    // Signals wake it, and it goes on waiting: neither an exit code nor another batch.
    for signal in [Signal::SIGTERM, Signal::SIGUSR1, Signal::SIGUSR2, Signal::SIGTERM] {
        send(pid(&worker), signal);
        std::thread::sleep(std::time::Duration::from_millis(50));
        assert!(alive(pid(&worker)), "{signal}");
    }
    assert_eq!(batches(&dir, 0), written);
    worker.kill().unwrap();
    worker.wait().unwrap();
}

/// `lampyris submit` by Slurm where there is no program at all.
fn submit(dir: &Path) -> Command {
    let mut command = lampyris(&["submit", "--engine", "slurm"]);
    command.arg(dir).env("PATH", "");
    command
}

#[test]
fn a_dry_run_shows_scripts_and_commands_for_what_is_missing_and_writes_nothing() {
    let place = Place::new();
    let dir = place.planned("it's a farm");
    let said = expect(0, submit(&dir).args(["--dry-run", "--array-limit", "2", "--time", "2-12"]));
    let script = dir.join("slurm/shards.sbatch");
    let shown = format!("sbatch --array=0-5%2 \"{}\"\n", script.display());
    assert!(said.contains(&shown), "{shown}{said}");
    assert!(said.contains("#SBATCH --time=2-12:00:00\n") && said.contains("#SBATCH --signal=B:USR2@120\n"), "{said}");
    expect(0, &mut work(&dir, 2));
    let said = expect(0, submit(&dir).args(["--dry-run", "--partition", "long", "--sbatch", "--account=a -c 2"]));
    assert!(said.contains("sbatch --array=0-1,3-5 \"") && said.contains("#SBATCH --account=a -c 2\n"), "{said}");
    let said = expect(1, &mut submit(&dir));
    assert!(said.contains("scontrol: ") && said.contains("submit from a machine that has Slurm's commands"), "{said}");
    assert!(!dir.join("slurm").exists());
    // A merge speaks of Slurm only where something was submitted.
    let said = expect(3, lampyris(&["merge"]).arg(&dir).env("PATH", ""));
    assert!(!said.contains("sbatch"), "{said}");
    fs::create_dir(dir.join("slurm")).unwrap();
    fs::write(&script, "").unwrap();
    let said = expect(3, lampyris(&["merge"]).arg(&dir).env("PATH", ""));
    let again = format!("\n  sbatch --array=0-1,3-5 \"{}\"\n", script.display());
    assert!(said.contains("shards 0-1,3-5 are missing; ") && said.contains(&again), "{said}");
    computed().restore(&dir);
    let said = expect(0, submit(&dir).arg("--dry-run"));
    assert!(said.starts_with("nothing to submit: no shard is missing"), "{said}");
}

#[test]
fn of_a_compacted_folder_only_what_is_missing_behind_it_is_submitted_and_computed() {
    let place = Place::new();
    let dir = place.planned("dir");
    (0..3).for_each(|shard| drop(expect(0, &mut work(&dir, shard))));
    expect(0, lampyris(&["compact"]).arg(&dir));
    assert!(!dir.join(checkpoint(0)).exists());
    let said = expect(0, submit(&dir).arg("--dry-run"));
    assert!(said.contains("\nsbatch --array=3-5 "), "{said}");
    // A task that was queued before finds its shard complete.
    expect(0, &mut work(&dir, 1));
    assert!(!dir.join(checkpoint(1)).exists());
    let seen = expect(0, lampyris(&["status", "--json"]).arg(&dir));
    let seen: serde_json::Value = serde_json::from_str(&seen).unwrap();
    assert_eq!((&seen["shards_done"], &seen["attempts"]), (&3.into(), &3.into()), "{seen}");
    assert_eq!(seen["shards"][0]["host"], seen["hosts"][0]["host"], "{seen}");
    (3..6).for_each(|shard| drop(expect(0, &mut work(&dir, shard))));
    let said = expect(0, submit(&dir).arg("--dry-run"));
    assert!(said.starts_with("nothing to submit: no shard is missing"), "{said}");
    expect(0, lampyris(&["merge"]).arg(&dir));
    Bits::of(&dir).assert_same(&straight().bits);
    // Longer, whole again, and what is missing is new.
    expect(0, lampyris(&["extend", "--batches", "33"]).arg(&dir));
    let said = expect(0, submit(&dir).arg("--dry-run"));
    assert!(said.contains("\nsbatch --array=5-6 "), "{said}");
}

#[test]
fn wrong_submissions_are_named() {
    let place = Place::new();
    let dir = place.planned("dir");
    let hosts = place.path("hosts");
    fs::write(&hosts, "2 a;b\n").unwrap();
    let hosts = hosts.to_str().unwrap();
    for (args, fragment) in [
        (&["--engine", "pbs"][..], "[possible values: slurm, ssh]"),
        (&["--engine", "slurm", "--time", "1h"], "allowed: Slurm's forms from one minute to a year"),
        (&["--engine", "slurm", "--array-limit", "0"], "0 is not in 1..=100000"),
        (&["--engine", "slurm", "--hosts", hosts], "--hosts = (given): only with --engine ssh"),
        (&["--engine", "slurm", "--sbatch", "-c 2\n-x"], "--sbatch = -c 2\\n-x: one line"),
        (&["--engine", "slurm", "-o", "elsewhere"], "--output = elsewhere: only with a job file"),
        (&["--engine", "ssh"], "--hosts = (missing): a file of hosts"),
        (&["--engine", "ssh", "--hosts", "nowhere"], "--hosts = nowhere: a file of hosts ("),
        (&["--engine", "ssh", "--hosts", hosts], "line 1 = 2 a;b: a login such as user@host"),
        (&["--engine", "ssh", "--hosts", hosts, "--dry-run"], "--dry-run = (given): only with --engine slurm"),
    ] {
        let said = expect(2, lampyris(&["submit"]).arg(&dir).args(args).env("PATH", ""));
        assert!(said.contains(fragment), "{args:?}: {said}");
    }
    let quoted = place.planned("a \"farm\"");
    let said = expect(2, submit(&quoted).arg("--dry-run"));
    assert!(said.contains("a path in UTF-8 without control characters and \"\\"), "{said}");
    fs::write(hosts, "2 :\n").unwrap();
    let said = expect(1, lampyris(&["submit", "--engine", "ssh", "--hosts", hosts]).arg(&dir).env("PATH", ""));
    assert!(said.contains("--engine ssh needs GNU parallel"), "{said}");
    assert!((0..SHARDS).all(|k| batches(&dir, k) == 0));
}

#[test]
fn previews_are_merged_and_the_folder_watched_while_others_work() {
    const PREVIEWS: usize = 5;
    let place = Place::new();
    let job = place.edited_job("long.toml", "batches = 28", "batches = 120");
    let (mut previews, mut round) = (0, 0);
    while previews < PREVIEWS && round < ATTEMPTS {
        let dir = place.path(&format!("dir-{round}"));
        let out = place.path("preview");
        let mut run = start(&mut run_quietly(&job, &dir, 2));
        wait_for("a checkpoint", || dir.join(checkpoint(0)).exists().then_some(()));
        let watch = lampyris(&["status", "--watch"]).arg(&dir).stdout(std::process::Stdio::piped()).spawn().unwrap();
        let mut seen = 0;
        while run.try_wait().unwrap().is_none() {
            let merged = lampyris(&["merge"]).arg(&dir).arg("-o").arg(&out).output().unwrap();
            let said = String::from_utf8_lossy(&merged.stderr).into_owned();
            assert!(matches!(merged.status.code(), Some(0 | 3)), "{}: {said}", merged.status);
            let now = summary(&out)["batches"].as_u64().unwrap();
            assert!(now >= seen, "{now} after {seen}");
            previews += usize::from(now > seen && merged.status.code() == Some(3));
            seen = now;
        }
        assert_eq!(run.wait().unwrap().code(), Some(0));
        let watched = watch.wait_with_output().unwrap();
        let text = String::from_utf8(watched.stdout).unwrap();
        assert!(watched.status.success() && text.contains("120 of 120 batches, 24 of 24 shards done\n"), "{text}");
        expect(0, lampyris(&["merge"]).arg(&dir).arg("-o").arg(&out));
        Bits::of(&out).assert_same(&Bits::of(&dir));
        round += 1;
    }
    assert!(previews >= PREVIEWS, "only {previews} previews while workers were at work");
}

#[test]
fn two_coordinators_at_once_do_no_harm() {
    let place = Place::new();
    let dir = place.planned("dir");
    let mut runs = [0, 1].map(|_| start(&mut run_quietly(&place.path("job.toml"), &dir, 2)));
    for run in &mut runs {
        assert_eq!(run.wait().unwrap().code(), Some(0));
    }
    Bits::of(&dir).assert_same(&straight().bits);
    let done: u64 = (0..SHARDS).map(|k| batches(&dir, k)).sum();
    assert_eq!((done, plan_in(&dir).job.run.batches, batches_of(SHARDS - 1)), (BATCHES, BATCHES, 3));
}

#[test]
fn a_folder_that_is_removed_ends_a_run_with_a_message() {
    let place = Place::new();
    let job = place.edited_job("long.toml", "batches = 28", "batches = 2000");
    let dir = place.path("dir");
    let run = run_quietly(&job, &dir, 2).stderr(std::process::Stdio::piped()).spawn().unwrap();
    wait_for("a checkpoint", || dir.join(checkpoint(0)).exists().then_some(()));
    fs::rename(&dir, place.path("elsewhere")).unwrap();
    let output = run.wait_with_output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(matches!(output.status.code(), Some(1 | 2)), "{}: {said}", output.status);
    assert!(said.contains(dir.to_str().unwrap()) && !said.contains("panicked"), "{said}");
    // What was done is where the folder is now, and nothing else is needed to go on.
    let moved = place.path("elsewhere");
    assert!(batches(&moved, 0) > 0);
    expect(0, lampyris(&["work", "--threads", "1", "--shard", "0"]).arg(&moved));
    assert_eq!(batches(&moved, 0), 5);
}
