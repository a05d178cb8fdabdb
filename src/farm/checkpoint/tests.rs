use super::write::frame;
use super::*;
use crate::error::{Error, Result};
use crate::farm::folder::Folder;
use crate::farm::plan::Plan;
use crate::farm::testing::{JOB, fixed_direct, plan, plan_of, save, save_tally, tally};
use crate::tally::{BatchScores, Monitor, Scores, Tally};
use std::fs;
use std::path::Path;

/// A plan whose checkpoints are small enough to damage at every byte.
fn small() -> Plan {
    let text = JOB.replace("columns = 65\nrows = 64", "columns = 2\nrows = 1");
    plan_of(&text).unwrap()
}

fn folder() -> (tempfile::TempDir, Folder) {
    let temp = tempfile::tempdir().unwrap();
    let folder = Folder::new(temp.path());
    (temp, folder)
}

/// Everything in the file; an error where any byte of it is refused.
fn read_all(path: &Path, plan: &Plan) -> Result<(Tally, Vec<Vec<f64>>)> {
    let reader = Reader::open(path, plan, 1)?.expect("the file exists");
    let fixed = (0..plan.sets().len()).map(|set| reader.fixed_direct(set)).collect::<Result<_>>()?;
    Ok((reader.tally()?, fixed))
}

fn refusal<T: std::fmt::Debug>(result: Result<T>) -> String {
    match result {
        Err(Error::Refused { reason, .. }) => reason,
        other => panic!("not refused: {other:?}"),
    }
}

#[test]
fn what_is_written_is_read_bit_for_bit() {
    let (_temp, folder) = folder();
    let plan = plan();
    let path = folder.shard_path(1);
    assert!(Reader::open(&path, &plan, 1).unwrap().is_none());
    assert!(save(&folder, &plan, 1, 3).unwrap());
    let (read, fixed) = read_all(&path, &plan).unwrap();
    assert_eq!(read, tally(&plan, 1, 3));
    assert_eq!(fixed, fixed_direct(&plan));
    let header = read_header(&path, &plan, 1).unwrap().unwrap();
    assert_eq!((header.batches(), header.span, header.seconds()), (3, Span::Shard(1), 1.5));
    assert_eq!((header.host_of(2), header.written, header.relative_error), ("test", 1_700_000_000, 0.25));
    // 65 x 64 bins are two blocks.
    let blocks = header.sections.iter().filter(|s| matches!(s.content, Content::Moments { set: 1, .. })).count();
    assert_eq!(blocks, 2);
    assert!(fs::metadata(&path).unwrap().len() <= plan.sizes().checkpoint + 1024);
}

#[test]
fn truncated_at_every_length_is_refused() {
    let (_temp, folder) = folder();
    let plan = small();
    save(&folder, &plan, 1, 2).unwrap();
    let path = folder.shard_path(1);
    let whole = fs::read(&path).unwrap();
    for length in 0..whole.len() {
        fs::write(&path, &whole[..length]).unwrap();
        refusal(read_all(&path, &plan));
    }
    let longer = [whole.clone(), vec![0]].concat();
    fs::write(&path, longer).unwrap();
    assert_eq!(refusal(read_all(&path, &plan)), "damaged: 1 trailing bytes");
}

#[test]
fn any_flipped_byte_is_refused() {
    let (_temp, folder) = folder();
    let plan = small();
    save(&folder, &plan, 1, 2).unwrap();
    let path = folder.shard_path(1);
    let mut bytes = fs::read(&path).unwrap();
    for i in 0..bytes.len() {
        let mask = 1 << (i % 8);
        bytes[i] ^= mask;
        fs::write(&path, &bytes).unwrap();
        refusal(read_all(&path, &plan));
        bytes[i] ^= mask;
    }
    fs::write(&path, &bytes).unwrap();
    assert!(read_all(&path, &plan).is_ok());
}

#[test]
fn newer_versions_other_plans_and_other_shards_are_named() {
    let (_temp, folder) = folder();
    let plan = small();
    save(&folder, &plan, 1, 2).unwrap();
    let path = folder.shard_path(1);
    assert_eq!(refusal(read_header(&path, &plan, 0)), "holds shard 1, not 0");
    let other = plan_of(&JOB.replace("seed = 7", "seed = 8")).unwrap();
    assert!(refusal(read_header(&path, &other, 1)).starts_with("of another plan: digest "));
    let header = read_header(&path, &plan, 1).unwrap().unwrap();
    fs::write(&path, frame(&header, VERSION + 1)).unwrap();
    assert_eq!(refusal(read_header(&path, &plan, 1)), "format version 6 is newer; this program reads version 5");
    fs::write(&path, "a letter to my aunt, long enough").unwrap();
    assert_eq!(refusal(read_header(&path, &plan, 1)), "not a checkpoint of lampyris");
}

/// A file made by somebody who knows the checksums: `edit` changes the header of a valid one.
fn forged(edit: impl Fn(&mut Header, &mut Vec<u8>)) -> String {
    let (_temp, folder) = folder();
    let plan = small();
    save(&folder, &plan, 1, 2).unwrap();
    let path = folder.shard_path(1);
    let mut header = read_header(&path, &plan, 1).unwrap().unwrap();
    let whole = fs::read(&path).unwrap();
    let mut sections = whole[frame(&header, VERSION).len()..].to_vec();
    edit(&mut header, &mut sections);
    fs::write(&path, [frame(&header, VERSION), sections].concat()).unwrap();
    refusal(read_all(&path, &plan))
}

#[test]
fn hostile_headers_are_refused_without_allocating_what_they_claim() {
    let huge = u64::MAX - 7;
    assert!(forged(|h, _| h.sections[0].bytes = huge).contains("sections do not lie end to end"));
    let last = |h: &Header| h.sections.len() - 1;
    assert!(
        forged(|h, _| {
            let i = last(h);
            h.sections[i].bytes = huge
        })
        .contains("impossible section length")
    );
    assert!(
        forged(|h, _| {
            let i = last(h);
            h.sections[i].bytes += 1
        })
        .contains("truncated")
    );
    assert!(forged(|h, _| h.sections[1].offset = huge).contains("sections do not lie end to end"));
    assert!(forged(|h, _| h.sections.clear()).contains("not those of the plan"));
    assert!(forged(|h, _| h.sections.swap(0, 1)).contains("not those of the plan"));
    assert!(forged(|h, _| h.digests = vec![[0; 16]; 5]).contains("5 batches in a shard of 4"));
    assert!(forged(|h, _| h.span = Span::Before(1)).contains("holds the first shards together, not shard 1"));
    assert!(forged(|h, _| h.runs[0].batches = 1).contains("its runs are not its batches"));
    assert!(forged(|h, _| h.runs[0].seconds = f64::NAN).contains("not a time"));
    assert!(forged(|h, _| h.runs[0].seconds = -1.0).contains("not a time"));
    assert!(forged(|h, _| h.runs[0].instructions = "avx\u{7}".into()).contains("no such name"));
    assert!(forged(|h, _| h.runs[0].instructions = "a".repeat(17)).contains("no such name"));
    assert!(forged(|h, _| h.runs[0].host = "a\u{1b}[2J".into()).contains("no such name"));
    assert!(forged(|h, _| h.runs[0].host = "a".repeat(10_000)).contains("longer than any of this plan"));
    // One batch more than the replicates hold.
    let more = |h: &mut Header| {
        h.digests.push([1; 16]);
        h.runs[0].batches += 1;
    };
    assert!(forged(|h, _| more(h)).contains("not of the plan's shape"));
}

#[test]
fn hostile_lengths_inside_a_section_are_refused() {
    // The first list of what all batches keep together claims 2^63 entries.
    let claim = |h: &mut Header, sections: &mut Vec<u8>| {
        let extremes = h.sections.iter_mut().find(|s| matches!(s.content, Content::Extremes { .. })).unwrap();
        let bytes = &mut sections[extremes.offset as usize..][..extremes.bytes as usize];
        bytes[..10].copy_from_slice(&[0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x01]);
        extremes.checksum = checksum(bytes);
    };
    assert!(forged(claim).contains("not of the plan's shape"));
    // A packed block that would be longer than a block of the plan.
    let long = |h: &mut Header, sections: &mut Vec<u8>| {
        let (old, new) = (h.sections[0].bytes, lz4_flex::block::compress(&vec![0; 1 << 20]));
        sections.splice(..old as usize, new.iter().copied());
        (h.sections[0].bytes, h.sections[0].checksum) = (new.len() as u64, checksum(&new));
        h.sections[1..].iter_mut().for_each(|s| s.offset = s.offset - old + new.len() as u64);
    };
    assert!(forged(long).contains("not of the plan's shape"));
    // A header whose own list claims 2^60 digests.
    let (_temp, folder) = folder();
    let path = folder.shard_path(1);
    save(&folder, &small(), 1, 2).unwrap();
    let mut body = vec![0u8; 33];
    body.extend([0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x0f]);
    let mut bytes = [&MAGIC[..], &VERSION.to_le_bytes(), &(body.len() as u32).to_le_bytes(), &body].concat();
    bytes.extend(checksum(&bytes));
    fs::write(&path, bytes).unwrap();
    assert_eq!(refusal(read_all(&path, &small())), "damaged: the header cannot be decoded");
}

#[test]
fn never_replaced_by_fewer_batches_nor_by_others() {
    let (_temp, folder) = folder();
    let plan = small();
    let path = folder.shard_path(1);
    assert!(save(&folder, &plan, 1, 2).unwrap());
    assert!(save(&folder, &plan, 1, 3).unwrap());
    assert!(!save(&folder, &plan, 1, 2).unwrap());
    assert_eq!(read_header(&path, &plan, 1).unwrap().unwrap().batches(), 3);
    // Batches of another machine that disagrees: refused, kept.
    let kept = fs::read(&path).unwrap();
    let foreign = tally(&plan, 0, 4);
    let reason = refusal(save_tally(&folder, &plan, 1, &foreign, &fixed_direct(&plan)));
    assert!(reason.contains("its batch 0 is another"), "{reason}");
    assert_eq!(fs::read(&path).unwrap(), kept);
    // A file that is not ours: refused, kept.
    fs::write(&path, "precious").unwrap();
    refusal(save(&folder, &plan, 1, 4));
    assert_eq!(fs::read(&path).unwrap(), b"precious");
}

#[test]
fn monitored_bins_are_stored_in_sections_of_their_own() {
    let (_temp, folder) = folder();
    let watched = JOB
        .replace("width = 5\n", "width = 5\nmonitor = [[4, 2], [0, 1]]\n")
        .replace("columns = 65\n", "columns = 65\nmonitor = [[64, 63]]\n");
    let plan = plan_of(&watched).unwrap();
    save(&folder, &plan, 1, 3).unwrap();
    let path = folder.shard_path(1);
    let (read, _) = read_all(&path, &plan).unwrap();
    let written = tally(&plan, 1, 3);
    assert_eq!(read.monitors, written.monitors);
    let bins: Vec<Vec<u32>> = read.monitors.iter().map(|set| set.iter().map(|m| m.bin).collect()).collect();
    assert_eq!(bins, [vec![5, 14], vec![65 * 64 - 1], vec![], vec![0]]);
    assert_eq!(read.monitors[1][0].scores.len(), 3);
    assert_eq!(read.monitors[1][0].histories[2].n, 64);
    assert!((50..150).contains(&read.monitors[1][0].largest.len()));
    let header = read_header(&path, &plan, 1).unwrap().unwrap();
    let monitors: Vec<Content> = header.sections.iter().rev().take(3).map(|s| s.content).collect();
    assert_eq!(monitors, [3, 1, 0].map(|set| Content::Monitors { set }));
}

/// A file whose last section, the monitors of the lux-meter, is replaced by `monitors`, with the right checksum.
fn forged_monitors(edit: impl Fn(&mut Vec<Monitor>)) -> String {
    forged(|h, sections| {
        let last = h.sections.last_mut().unwrap();
        assert_eq!(last.content, Content::Monitors { set: 3 });
        let mut monitors: Vec<Monitor> = postcard::from_bytes(&sections[last.offset as usize..]).unwrap();
        edit(&mut monitors);
        let bytes = postcard::to_stdvec(&monitors).unwrap();
        sections.truncate(last.offset as usize);
        sections.extend(&bytes);
        (last.bytes, last.checksum) = (bytes.len() as u64, checksum(&bytes));
    })
}

#[test]
fn monitors_that_are_not_the_plans_are_refused() {
    let shape = |edit: fn(&mut Vec<Monitor>)| {
        assert!(forged_monitors(edit).contains("Monitors { set: 3 } is not of the plan's shape"));
    };
    shape(|m| m.clear());
    shape(|m| m.push(Monitor::new(0)));
    shape(|m| m[0].bin = 1);
    shape(|m| m[0].scores.push(1.0));
    shape(|m| m[0].histories.clear());
    shape(|m| m[0].largest.reverse());
    shape(|m| m[0].largest = vec![1.0; 201]);
    shape(|m| m[0].largest[0] = f64::NAN);
}

/// The tally of the golden file: simple fractions, so that it depends on no generator.
fn golden_tally(plan: &Plan) -> Tally {
    let mut tally = Tally::new(&plan.sets());
    for batch in 0..3 {
        let fraction = |i: usize, k: usize| ((7 * i + 13 * batch + k) % 32) as f64 / 32.0;
        let fill = |shape: &SetShape| {
            let mut s = Scores::zero(shape);
            for i in 0..shape.bins() {
                (s.value[i], s.direct[i], s.peak[i]) = (fraction(i, 1), fraction(i, 2), fraction(i, 3));
                s.caustic[i] = fraction(i, 8);
                s.existed[i] = (i + batch) % 3 > 0;
            }
            s.colour.iter_mut().enumerate().for_each(|(i, c)| *c = [fraction(i, 4), fraction(i, 5), fraction(i, 6)]);
            let totals = |bin: usize| (0..4).map(|k| fraction(bin, k)).collect();
            s.watched.iter_mut().enumerate().for_each(|(bin, w)| w.totals = totals(bin));
            s
        };
        let sets = plan.sets().iter().map(fill).collect();
        tally.accumulate(&BatchScores { sets, flux: [1.0, 0.5, 0.25, 0.0, fraction(0, 7)] });
    }
    tally
}

#[test]
fn the_golden_file_of_version_5_is_read_and_written_bit_for_bit() {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/shard-v5.ckpt");
    // The numbers of the program may change without changing the format.
    let plan = Plan { numerics: 1, ..small() };
    let (_temp, folder) = folder();
    let expected = golden_tally(&plan);
    save_tally(&folder, &plan, 1, &expected, &fixed_direct(&plan)).unwrap();
    let written = fs::read(folder.shard_path(1)).unwrap();
    let stored = fs::read(&golden).unwrap_or_default();
    if written != stored {
        let new = std::env::temp_dir().join("shard-v5.ckpt");
        fs::write(&new, &written).unwrap();
        panic!("the bytes have changed: raise VERSION if that is meant; the new file is {}", new.display());
    }
    let (read, fixed) = read_all(&golden, &plan).unwrap();
    assert_eq!((read, fixed), (expected, fixed_direct(&plan)));
}
