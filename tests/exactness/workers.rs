//! Any number of workers and threads; two workers on one shard.

use crate::bits::Bits;
use crate::place::{Place, SHARDS, assert_shards, batches, straight};
use crate::process::{expect, lampyris, run_quietly, start, work};

#[test]
fn one_two_and_five_workers_give_the_same_bits() {
    let place = Place::new();
    for workers in [1, 2, 5] {
        let dir = place.path(&format!("by-{workers}"));
        expect(0, &mut run_quietly(&place.path("job.toml"), &dir, workers));
        Bits::of(&dir).assert_same(&straight().bits);
    }
}

#[test]
fn one_and_two_threads_give_the_same_bits() {
    let place = Place::new();
    for threads in ["1", "2"] {
        let dir = place.planned(threads);
        // In an order of shards that a coordinator would not take.
        for shard in (0..SHARDS).rev() {
            let said = expect(
                0,
                lampyris(&["work", "--threads", threads]).arg(&dir).env("SLURM_ARRAY_TASK_ID", shard.to_string()),
            );
            assert_eq!(said, format!("shard {shard}: done\n"));
        }
        expect(0, lampyris(&["merge"]).arg(&dir));
        Bits::of(&dir).assert_same(&straight().bits);
    }
}

#[test]
fn two_workers_on_one_shard_do_no_harm() {
    let place = Place::new();
    let dir = place.planned("dir");
    for shard in [0, SHARDS - 1] {
        let mut pair = [start(&mut work(&dir, shard)), start(&mut work(&dir, shard))];
        for worker in &mut pair {
            assert_eq!(worker.wait().unwrap().code(), Some(0));
        }
    }
    assert_shards(&dir, [0, SHARDS - 1]);
    // A third one comes late and ends at once; a run shares a shard with a worker of nobody.
    expect(0, &mut work(&dir, 0));
    assert_eq!(batches(&dir, 1), 0);
    let mut stray = start(&mut work(&dir, 1));
    place.finish(&dir);
    assert_eq!(stray.wait().unwrap().code(), Some(0));
    assert_shards(&dir, 0..SHARDS);
}
