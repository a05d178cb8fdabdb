//! Files that are not what they should be: 17,000 checkpoints, compactions, plans, jobs and tables, changed by a seeded mutator, are
//! read by a process that counts what it allocates. Nothing panics, nothing hangs, no memory beyond twice the file and a
//! constant, and no number that was written is read as another.

use lampyris::error::{Error, Result};
use lampyris::farm::checkpoint::{Header, MAGIC, Reader, Run, Snapshot, VERSION, write};
use lampyris::farm::folder::Folder;
use lampyris::farm::merge::compact::compact;
use lampyris::farm::plan::{Input, Plan, SceneSummary};
use lampyris::job::Job;
use lampyris::random::{Domain, Generator, Stream};
use lampyris::scene::{Tabulated, law_of_road};
use lampyris::tally::{BatchScores, Scores, Tally};
use std::alloc::{GlobalAlloc, Layout, System};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// The system's allocator, with the bytes in use and their largest number.
struct Counting;

static USED: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

fn took(bytes: usize) {
    let used = USED.fetch_add(bytes, Ordering::Relaxed) + bytes;
    MOST.fetch_max(used, Ordering::Relaxed);
}

// SAFETY: all work is the system's; only sizes are counted beside it.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        took(layout.size());
        // SAFETY: the caller keeps the rules of this function.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        USED.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Memory that reading may take beside twice the file: a block of the plan, unpacked, and what parsing takes \[bytes\].
const CONSTANT: usize = 2 << 20;
/// Reading takes less than a millisecond; whoever takes this long hangs.
const PATIENCE: Duration = Duration::from_secs(10);

/// Only one of these tests at a time counts.
static ALONE: Mutex<()> = Mutex::new(());

/// `read` of a file of `bytes`, its memory and time within the bounds.
#[track_caller]
fn bounded<T>(bytes: usize, case: usize, read: impl FnOnce() -> T) -> T {
    let before = USED.load(Ordering::Relaxed);
    MOST.store(before, Ordering::Relaxed);
    let begun = Instant::now();
    let result = read();
    let most = MOST.load(Ordering::Relaxed).saturating_sub(before);
    assert!(most <= 2 * bytes + CONSTANT, "case {case}: {most} bytes for a file of {bytes}");
    assert!(begun.elapsed() < PATIENCE, "case {case} took {:?}", begun.elapsed());
    result
}

const JOB: &str = r#"
[run]
seed = 7
sampling = "random"
batches = 14
batches_per_shard = 4
channels = "rgb"
[[camera]]
name = "view"
eye = [0.0, 1.0, 3.0]
target = [0.0, 1.0, 0.0]
vertical_fov_degrees = 40.0
width = 12
height = 5
monitor = [[4, 2]]
[[grid]]
name = "desk"
origin = [0.0, 0.8, 0.0]
u = [1.0, 0.0, 0.0]
v = [0.0, 0.0, -1.0]
normal = [0.0, 1.0, 0.0]
columns = 2
rows = 2
[[ratio]]
name = "contrast"
numerator = "meter"
denominator = "desk"
[[point]]
name = "meter"
position = [0.0, 0.8, 0.0]
normal = [0.0, 1.0, 0.0]
[[source]]
kind = "omni"
position = [0.0, 2.0, 0.0]
intensity = 100.0
"#;

fn plan() -> Plan {
    let job = Job::parse(JOB, "job.toml").unwrap();
    let scene =
        SceneSummary { triangles: 0, sources: 1, flux_lm: 1.0, bytes: 0, narrowest_lobe: 1.0, warnings: Vec::new() };
    let bounds = vec![1.0; job.sets().len()];
    Plan::new("job", job, Input::of("job.toml", JOB.as_bytes()), Vec::new(), scene).unwrap().bounded(bounds)
}

fn tally(plan: &Plan, shard: u64) -> Tally {
    let mut tally = Tally::new(&plan.sets());
    for batch in plan.shard(shard) {
        let fill = |shape| {
            let mut draws = Stream::new(7, Domain::Receiver, "scores").generator(batch);
            let mut scores = Scores::zero(shape);
            scores.value.iter_mut().for_each(|x| *x = draws.uniform());
            scores.peak.iter_mut().for_each(|x| *x = draws.uniform());
            scores.existed.iter_mut().for_each(|x| *x = draws.uniform() < 0.9);
            scores.watched.iter_mut().for_each(|w| w.totals = (0..16).map(|_| draws.uniform()).collect());
            scores
        };
        let sets = plan.sets().iter().map(fill).collect();
        tally.accumulate(&BatchScores { sets, flux: [1.0, 0.75, 0.25, 0.0, batch as f64] });
    }
    tally
}

fn save(folder: &Folder, plan: &Plan, shard: u64) {
    let tally = tally(plan, shard);
    let fixed_direct: Vec<Vec<f64>> = plan.sets().iter().map(|_| Vec::new()).collect();
    let run = Run { batches: tally.batches(), host: "a".into(), instructions: "scalar".into(), seconds: 1.0 };
    let (tally, fixed_direct) = (&tally, &fixed_direct[..]);
    let snapshot = Snapshot { plan, shard, tally, fixed_direct, runs: &[run], written: 1, relative_error: 0.1 };
    assert!(write(&folder.shard_path(shard), &snapshot).unwrap());
}

/// A folder with the first two shards compacted and the last two by themselves.
fn place() -> (TempDir, Folder, Plan) {
    let temp = tempfile::tempdir().unwrap();
    let (folder, plan) = (Folder::new(temp.path()), plan());
    folder.establish(&plan, &[]).unwrap();
    (0..2).for_each(|shard| save(&folder, &plan, shard));
    assert_eq!(compact(&folder, 0).unwrap().shards, 2);
    (2..4).for_each(|shard| save(&folder, &plan, shard));
    (temp, folder, plan)
}

/// The files that a plan's checkpoints are: with the shard, or none of a compaction.
fn files(folder: &Folder) -> [(Option<u64>, PathBuf); 3] {
    [(None, folder.compaction_path()), (Some(2), folder.shard_path(2)), (Some(3), folder.shard_path(3))]
}

/// All that a file says, every section read: postcard of it, so that NaN equals itself.
fn content(path: &Path, plan: &Plan, shard: Option<u64>) -> Result<Vec<u8>> {
    let reader = match shard {
        Some(shard) => Reader::open(path, plan, shard)?,
        None => Reader::open_compaction(path, plan)?,
    };
    let reader = reader.expect("the file was written");
    let tally = reader.tally()?;
    let mut all = format!("{:?} {:?} {:?}", tally.sets, tally.monitors, tally.flux).into_bytes();
    all.extend(tally.digests.as_flattened());
    for set in 0..plan.sets().len() {
        reader.fixed_direct(set)?.iter().for_each(|x| all.extend(x.to_le_bytes()));
    }
    Ok(all)
}

/// Changes `bytes` once or more: a bit, a byte, a number, a range cut, doubled, moved, blanked or taken from `other`.
fn mutate(bytes: &mut Vec<u8>, other: &[u8], draws: &mut Generator) {
    for _ in 0..1 + draws.below(3) {
        let length = bytes.len() as u32;
        if length == 0 {
            bytes.push(draws.below(256) as u8);
            continue;
        }
        let at = draws.below(length) as usize;
        let end = at + (1 + draws.below(64) as usize).min(bytes.len() - at);
        match draws.below(10) {
            0 => bytes[at] ^= 1 << draws.below(8),
            1 => bytes[at] = draws.below(256) as u8,
            2 => bytes.truncate(at),
            3 => drop(bytes.drain(at..end)),
            4 => {
                let copy = bytes[at..end].to_vec();
                bytes.splice(at..at, copy);
            }
            5 => bytes[at..end].fill(0),
            6 => bytes[at..end].fill(0xff),
            7 => bytes.extend((0..1 + draws.below(64)).map(|i| i as u8)),
            8 => {
                let from = draws.below(other.len() as u32) as usize;
                let taken = other[from..(from + end - at).min(other.len())].to_vec();
                bytes.splice(at..end, taken);
            }
            _ => {
                // A length beyond all bounds, as postcard and as the preamble would write it.
                let huge = [&[0xff; 9][..], &[0x01], &u32::MAX.to_le_bytes()].concat();
                bytes.splice(at..end, huge);
            }
        }
    }
}

/// Writes another digit somewhere: another number, which is more often another file than none.
fn another_digit(bytes: &mut [u8], draws: &mut Generator) {
    let digits: Vec<usize> = (0..bytes.len()).filter(|&i| bytes[i].is_ascii_digit()).collect();
    bytes[digits[draws.below(digits.len() as u32) as usize]] = b'0' + draws.below(10) as u8;
}

/// Writes a file anew: a file that is cut and written again is flushed to the disk by some systems, which takes long.
fn put(path: &Path, bytes: &[u8]) {
    fs::remove_file(path).unwrap();
    fs::write(path, bytes).unwrap();
}

/// Demands what was written, or a refusal by name.
#[track_caller]
fn written_or_refused<T: PartialEq>(read: Result<T>, written: &T, case: usize) -> bool {
    match read {
        Ok(read) => {
            assert!(read == *written, "case {case}: accepted with other numbers");
            true
        }
        Err(Error::Refused { .. } | Error::Input { .. }) => false,
        Err(e) => panic!("case {case}: {e}"),
    }
}

#[test]
fn six_thousand_changed_checkpoints_are_refused() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let (_temp, folder, plan) = place();
    let mut draws = Stream::new(13, Domain::Receiver, "checkpoints").generator(0);
    let files = files(&folder);
    let originals = files.each_ref().map(|(_, path)| fs::read(path).unwrap());
    let mut same = 0;
    for ((shard, path), (original, other)) in files.iter().zip(originals.iter().zip(originals.iter().rev())) {
        let written = content(path, &plan, *shard).unwrap();
        for case in 0..2000 {
            let mut bytes = original.clone();
            mutate(&mut bytes, other, &mut draws);
            put(path, &bytes);
            let read = bounded(bytes.len(), case, || content(path, &plan, *shard));
            let accepted = written_or_refused(read, &written, case);
            assert_eq!(accepted, bytes == *original, "case {case}");
            same += usize::from(accepted);
        }
    }
    assert!(same < 200, "{same} of the changes changed nothing");
}

/// Header and sections of a checkpoint.
fn parts(bytes: &[u8]) -> (Vec<u8>, Vec<u8>) {
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    (bytes[16..16 + length].to_vec(), bytes[32 + length..].to_vec())
}

/// A checkpoint of this header and these sections, the checksum of the header right.
fn framed(header: &[u8], sections: &[u8]) -> Vec<u8> {
    let mut bytes = [&MAGIC[..], &VERSION.to_le_bytes(), &(header.len() as u32).to_le_bytes(), header].concat();
    let sum = blake3::hash(&bytes);
    bytes.extend(&sum.as_bytes()[..16]);
    bytes.extend(sections);
    bytes
}

#[test]
fn three_thousand_forged_checkpoints_do_no_harm() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let (_temp, folder, plan) = place();
    let mut draws = Stream::new(13, Domain::Receiver, "forged").generator(0);
    let (mut refused, mut read_on) = (0, 0);
    for (shard, path) in files(&folder) {
        let original = fs::read(&path).unwrap();
        let (header, sections) = parts(&original);
        for case in 0..1000 {
            // Either the bytes of the header, or those of a section whose checksum is then made right.
            let bytes = if draws.below(2) == 0 {
                let mut header = header.clone();
                mutate(&mut header, &sections, &mut draws);
                framed(&header, &sections)
            } else {
                let mut header: Header = postcard::from_bytes(&header).unwrap();
                let number = draws.below(header.sections.len() as u32) as usize;
                let section = header.sections[number];
                let range = section.offset as usize..(section.offset + section.bytes) as usize;
                let mut changed = sections[range.clone()].to_vec();
                mutate(&mut changed, &sections, &mut draws);
                let sum = blake3::hash(&changed);
                header.sections[number].bytes = changed.len() as u64;
                header.sections[number].checksum.copy_from_slice(&sum.as_bytes()[..16]);
                let moved = |offset: u64| offset - section.bytes + changed.len() as u64;
                header.sections[number + 1..].iter_mut().for_each(|s| s.offset = moved(s.offset));
                let sections = [&sections[..range.start], &changed, &sections[range.end..]].concat();
                framed(&postcard::to_stdvec(&header).unwrap(), &sections)
            };
            put(&path, &bytes);
            match bounded(bytes.len(), case, || content(&path, &plan, shard)) {
                // Somebody who knows the checksums may write what he likes: that is for an audit to find.
                Ok(_) => read_on += 1,
                Err(Error::Refused { .. }) => refused += 1,
                Err(e) => panic!("case {case}: {e}"),
            }
        }
        fs::write(&path, original).unwrap();
    }
    assert!(refused > 1000 && read_on > 100, "{refused} refused, {read_on} read");
}

#[test]
fn two_thousand_changed_plans_are_refused() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let (_temp, folder, plan) = place();
    let mut draws = Stream::new(13, Domain::Receiver, "plans").generator(0);
    let path = folder.plan_path();
    let original = fs::read(&path).unwrap();
    for case in 0..2000 {
        let mut bytes = original.clone();
        mutate(&mut bytes, JOB.as_bytes(), &mut draws);
        put(&path, &bytes);
        let read = bounded(bytes.len(), case, || folder.read_plan());
        assert_eq!(written_or_refused(read, &plan, case), bytes == original, "case {case}");
    }
}

#[test]
fn two_thousand_changed_jobs_are_read_or_refused() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let mut draws = Stream::new(13, Domain::Receiver, "jobs").generator(0);
    let (mut accepted, mut refused, digest) = (0, 0, plan().digest);
    for case in 0..2000 {
        let mut bytes = JOB.as_bytes().to_vec();
        if case % 2 == 0 {
            mutate(&mut bytes, digest.as_bytes(), &mut draws);
        } else {
            another_digit(&mut bytes, &mut draws);
        }
        let text = String::from_utf8_lossy(&bytes).into_owned();
        match bounded(text.len(), case, || Job::parse(&text, "job.toml")) {
            Ok(_) => accepted += 1,
            Err(Error::Input { .. }) => refused += 1,
            Err(e) => panic!("case {case}: {e}"),
        }
    }
    assert!(refused > 1000 && accepted > 500, "{refused} refused, {accepted} accepted");
}

#[test]
fn four_thousand_changed_tables_are_read_or_refused() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let mut draws = Stream::new(13, Domain::Receiver, "tables").generator(0);
    let row = "0.1 0.12 0.15 0.2\n";
    let brdf =
        format!("lampyris-brdf 1 # a comment\nchannels 1\ntheta 0 30 60 80\nphi 0 60 120 180\n{}", row.repeat(16));
    let road = "beta 0 10 90 180\n0 700 700 700 700\n1 300 200 150 100\n4 90 9 - 3\n";
    // All angles that a table may have, and not one value.
    let angles = |end: u32| (0..256).map(|i| format!(" {}", f64::from(i * end) / 255.0)).collect::<String>();
    let promise = format!("lampyris-brdf 1\nchannels 3\ntheta{}\nphi{}\n", angles(90), angles(180));
    assert!(bounded(promise.len(), 0, || Tabulated::parse("promise.brdf", promise.as_bytes())).is_err());
    let (mut accepted, mut refused) = (0, 0);
    for case in 0..4000 {
        let original = if case % 2 == 0 { &brdf[..] } else { road };
        let mut bytes = original.as_bytes().to_vec();
        if case % 4 < 2 {
            mutate(&mut bytes, b"180 90 1e6 -1 nan 0.3 5", &mut draws);
        } else {
            another_digit(&mut bytes, &mut draws);
        }
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let read = bounded(text.len(), case, || match case % 2 {
            0 => Tabulated::parse("law.brdf", &bytes).map(drop),
            _ => {
                law_of_road("road.txt", &text).and_then(|text| Tabulated::parse("law.brdf", text.as_bytes())).map(drop)
            }
        });
        match read {
            Ok(()) => accepted += 1,
            Err(Error::Input { .. }) => refused += 1,
            Err(e) => panic!("case {case}: {e}"),
        }
    }
    assert!(refused > 1500 && accepted > 300, "{refused} refused, {accepted} accepted");
}
