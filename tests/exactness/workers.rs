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
fn quasi_random_batches_are_as_exact_as_random_ones() {
    let place = Place::new();
    let job = place.edited_job("rqmc.toml", "sampling = \"random\"", "sampling = \"rqmc\"");
    let by = |workers| {
        let dir = place.path(&format!("rqmc-{workers}"));
        expect(0, &mut run_quietly(&job, &dir, workers));
        Bits::of(&dir)
    };
    let bits = by(1);
    bits.assert_same(&by(3));
    assert_ne!(bits.digest, straight().bits.digest);
    // Deaths after a first checkpoint of every shard, then one thread.
    let dir = place.plan(&job, "resumed");
    for shard in 0..SHARDS {
        work(&dir, shard).env("LAMPYRIS_FAULT", "after-rename:1").output().unwrap();
        assert!(batches(&dir, shard) > 0);
        expect(0, lampyris(&["work", "--threads", "1"]).arg(&dir).args(["--shard", &shard.to_string()]));
    }
    expect(0, lampyris(&["merge"]).arg(&dir));
    Bits::of(&dir).assert_same(&bits);
    // Extended from 17 batches, which end inside a shard.
    let text = std::fs::read_to_string(&job).unwrap().replace("batches = 28", "batches = 17");
    std::fs::write(place.path("short.toml"), text).unwrap();
    let dir = place.path("extended");
    expect(0, &mut run_quietly(&place.path("short.toml"), &dir, 2));
    expect(0, &mut run_quietly(&job, &dir, 2));
    Bits::of(&dir).assert_same(&bits);
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

#[test]
fn two_runs_of_one_job_in_one_folder_at_once_do_no_harm() {
    let place = Place::new();
    let (job, dir) = (place.path("job.toml"), place.path("dir"));
    let mut pair = [start(&mut run_quietly(&job, &dir, 2)), start(&mut run_quietly(&job, &dir, 2))];
    for run in &mut pair {
        assert_eq!(run.wait().unwrap().code(), Some(0));
    }
    assert_shards(&dir, 0..SHARDS);
    Bits::of(&dir).assert_same(&straight().bits);
}
