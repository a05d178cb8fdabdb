use super::*;
use crate::farm::testing::plan;
use nix::errno::Errno;
use nix::sys::signal::kill;
use nix::sys::wait::waitpid;
use nix::unistd::Pid;
use std::process::{Child, Command};

fn sleeper() -> (Child, Pid) {
    let child = Command::new("sleep").arg("60").spawn().unwrap();
    let pid = Pid::from_raw(child.id().try_into().unwrap());
    (child, pid)
}

#[test]
fn every_worker_is_waited_for_and_the_first_failure_said() {
    let (temp, plan) = (tempfile::tempdir().unwrap(), plan());
    let folder = Folder::new(temp.path());
    let mut children = [sleeper(), sleeper(), sleeper()];
    // The first two are reaped by somebody else, so that waiting for them fails.
    for (child, pid) in &mut children[..2] {
        child.kill().unwrap();
        waitpid(*pid, None).unwrap();
    }
    let pid = children[2].1;
    let running = (0..3).zip(children).map(|(shard, (child, _))| Worker::fake(shard, child)).collect();
    let shards = read_shards(&folder, &plan).unwrap();
    let (waiting, failures) = (VecDeque::new(), vec![0; 3]);
    let mut crew =
        Crew { folder: &folder, plan: &plan, slots: 3, waiting, running, shards, failures, shard_done: &|_| {} };
    let failed = crew.dismiss().unwrap_err().to_string();
    assert!(failed.starts_with("shard 0: "), "{failed}");
    // Neither at work nor a zombie.
    assert_eq!(kill(pid, None), Err(Errno::ESRCH));
}

#[test]
fn the_failure_that_ended_the_run_is_said_first() {
    let failed = |what: &str| Error::Failed(what.to_owned());
    let said = |ended, dismissed| first_failure(ended, dismissed).map_err(|e| e.to_string());
    assert_eq!(said(Err(failed("run")), Err(failed("wait"))), Err("run".to_owned()));
    assert_eq!(said(Err(failed("run")), Ok(())), Err("run".to_owned()));
    assert_eq!(said(Ok(Ended::Done), Err(failed("wait"))), Err("wait".to_owned()));
    assert_eq!(said(Ok(Ended::Stopped), Ok(())), Ok(Ended::Stopped));
}
