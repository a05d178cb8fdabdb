//! `lampyris audit`: what is wrong is found although every checksum is right.

use crate::place::{Place, batches_of, checkpoint, computed, plan_in};
use crate::process::{expect, lampyris};
use lampyris::farm::checkpoint::{Reader, Run, Snapshot, write};
use lampyris::tally::{SetTally, Tally};
use std::fs;
use std::path::Path;

const SHARD: u64 = 2;

fn audit(code: i32, dir: &Path, sample: &str) -> String {
    expect(code, lampyris(&["audit", "--sample", sample, "--seed", "3"]).arg(dir))
}

/// Writes the checkpoint of [`SHARD`] anew with its tally edited, every checksum right.
fn forge(dir: &Path, edit: impl Fn(&mut Tally)) {
    let plan = plan_in(dir);
    let path = dir.join(checkpoint(SHARD));
    let reader = Reader::open(&path, &plan, SHARD).unwrap().unwrap();
    let mut tally = reader.tally().unwrap();
    edit(&mut tally);
    let fixed: Vec<Vec<f64>> = (0..plan.sets().len()).map(|set| reader.fixed_direct(set).unwrap()).collect();
    let run = |batches, host: &str| Run { batches, host: host.into(), instructions: "scalar".into(), seconds: 1.0 };
    let runs = [run(2, "good"), run(tally.batches() - 2, "bad")];
    let snapshot = Snapshot {
        plan: &plan,
        shard: SHARD,
        tally: &tally,
        fixed_direct: &fixed,
        runs: &runs,
        written: 0,
        relative_error: 0.1,
    };
    fs::remove_file(&path).unwrap();
    assert!(write(&path, &snapshot).unwrap());
}

/// The first set that keeps its batches.
fn kept(tally: &mut Tally) -> &mut lampyris::tally::Replicates {
    let found = tally.sets.iter_mut().find_map(|set| match set {
        SetTally::Replicates(scores) => Some(scores),
        SetTally::Moments(_) => None,
    });
    found.unwrap()
}

fn flip(x: &mut f64) {
    *x = f64::from_bits(x.to_bits() ^ 1);
}

#[test]
fn an_honest_folder_passes_and_every_kind_of_forgery_is_found() {
    let place = Place::new();
    let dir = place.path("dir");
    computed().restore(&dir);
    let said = audit(0, &dir, "100%");
    assert!(said.contains("28 of 28 batches computed again") && said.contains("in 6 of 6 shards"), "{said}");
    let said = audit(0, &dir, "1%");
    assert!(said.contains("1 of 28 batches computed again") && said.contains("nothing is wrong"), "{said}");
    let batch = 2 * batches_of(0) + 3;
    let by_whom = format!("shard {SHARD}, batch {batch}, computed on bad: ");
    // One bit of one stored score of the fourth batch.
    forge(&dir, |tally| {
        let scores = kept(tally);
        let at = 3 * scores.bins as usize;
        flip(&mut scores.value[at]);
    });
    let said = audit(1, &dir, "100%");
    assert!(said.contains(&format!("{by_whom}the scores of table_height that are stored are others")), "{said}");
    assert!(said.contains("shard-000002.ckpt: "), "{said}");
    // One bit of a map's moments.
    computed().restore(&dir);
    forge(&dir, |tally| match &mut tally.sets[0] {
        SetTally::Moments(moments) => flip(&mut moments.bins.m2[17]),
        SetTally::Replicates(_) => panic!("a camera keeps moments"),
    });
    let said = audit(1, &dir, "100%");
    let wrong = "shard 2, computed on bad and good: view is not what its batches make together\n1 fault\n";
    assert!(said.contains(wrong), "{said}");
    // Scores that another program would compute: the digest of the second batch.
    computed().restore(&dir);
    forge(&dir, |tally| tally.digests[1][5] ^= 1);
    let said = audit(1, &dir, "100%");
    let wrong = format!("batch {}, computed on good: its scores are others than those computed here", batch - 2);
    assert!(said.contains(&wrong), "{said}");
    // The same inside a compaction, and a file that is damaged besides.
    expect(0, lampyris(&["compact"]).arg(&dir));
    fs::write(dir.join(checkpoint(5)), "no checkpoint at all").unwrap();
    let said = audit(1, &dir, "100%");
    assert!(said.contains(&format!("compacted.ckpt: shard {SHARD}, {wrong}")), "{said}");
    assert!(said.contains("shard-000005.ckpt: not a checkpoint of lampyris"), "{said}");
}
