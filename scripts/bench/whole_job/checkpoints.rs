//! One checkpoint of a map of 1 megapixel: the whole of it, and its steps one by one.

use super::maps::{plan, scores, snapshot, tally};
use super::median_of;
use lampyris::farm::checkpoint::{BLOCK, Reader, write};
use lampyris::farm::durable::replace;
use lampyris::tally::{SetTally, Tally};
use std::hint::black_box;
use std::io::Write;

const RUNS: usize = 7;

/// Both kinds of map.
pub fn bench() {
    for channels in ["luminance", "rgb"] {
        let plan = plan(channels, 1);
        let tally = tally(&plan, 0);
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("shard.ckpt");
        let snapshot = snapshot(&plan, 0, &tally);
        let whole = median_of(RUNS, || assert!(write(&path, &snapshot).expect("the disk has room")));
        let bytes = std::fs::metadata(&path).expect("it was written").len();
        let sections = encoded(&tally);
        let hash = median_of(RUNS, || sections.iter().for_each(|s| _ = black_box(blake3::hash(s))));
        let to = folder.path().join("plain");
        let disk = median_of(RUNS, || {
            replace(&to, |w| sections.iter().try_for_each(|s| w.write_all(s))).expect("the disk has room");
        });
        let read = median_of(RUNS, || {
            let reader = Reader::open(&path, &plan, 0).expect("it is whole").expect("it is there");
            drop(black_box({ reader }.tally().expect("it is whole")));
        });
        println!(
            "{channels}: {bytes} bytes, whole {whole} ms = {:.2} % of 60 s; of it hash {hash}, write and sync {disk} ms; read again {read} ms",
            whole.wall / 600.0
        );
        let batch = scores(&plan, 0);
        let mut sum = Tally::new(&plan.sets());
        let accumulate = median_of(RUNS, || sum.accumulate(&batch));
        let digest = median_of(RUNS, || _ = black_box(batch.digest()));
        println!("{channels}: a batch into the tally {accumulate} ms, its digest {digest} of them");
    }
}

/// The bytes of the map's sections.
fn encoded(tally: &Tally) -> Vec<Vec<u8>> {
    let SetTally::Moments(moments) = &tally.sets[0] else { panic!("the job has a map") };
    let blocks = (0..moments.bins.len()).step_by(BLOCK);
    let slice = |start: usize| moments.bins.slice(start..(start + BLOCK).min(moments.bins.len()));
    blocks.map(|start| postcard::to_stdvec(&slice(start)).expect("plain data has a postcard form")).collect()
}
