//! Batches drawn at random are computed again and compared with what checkpoints say of them, bit for bit.
//!
//! Checksums show that a file is as it was written. Whether what was written is right, only computing it again can show: a
//! machine with bad memory, a forged file. Of a batch its digest is compared, which covers every score of every receiver, and
//! the scores that are stored batch by batch: grids, points, regions, flux. The moments of maps belong to no single batch: they
//! are compared where the draw holds all batches of a shard.

use super::checkpoint::{Header, Reader, Span, read_compaction, read_header};
use super::folder::Folder;
use super::inputs;
use super::plan::Plan;
use super::realization::Realization;
use crate::error::{Error, Result};
use crate::job::Kept;
use crate::random::{Domain, Stream};
use crate::tally::{BatchScores, FLUX_BINS, Replicates, SetTally, Tally};
use std::collections::BTreeSet;
use std::path::PathBuf;

/// What shall be audited.
#[derive(Clone, Debug)]
pub struct Order {
    /// The folder of the plan.
    pub folder: Folder,
    /// Share of the batches in checkpoints that are computed again; above 0, at most 1.
    pub share: f64,
    /// Another seed draws other batches.
    pub seed: u64,
}

/// What an audit found.
#[derive(Clone, Debug, PartialEq)]
pub struct Audited {
    /// Batches computed again.
    pub batches: u64,
    /// Batches in checkpoints.
    pub of: u64,
    /// Shards whose moments were compared.
    pub whole_shards: u64,
    /// Shards with checkpoints of their own.
    pub shards: u64,
    /// Everything that is wrong.
    pub faults: Vec<Fault>,
}

/// Something that is wrong with a checkpoint.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// The file.
    pub path: PathBuf,
    /// Shard, batch and host as far as they are known, and what is wrong.
    pub what: String,
}

/// Computes a share of the batches in a folder again.
///
/// # Errors
/// Whatever reading the plan and the scene says; what is wrong with checkpoints is among the faults instead.
pub fn audit(order: &Order) -> Result<Audited> {
    let plan = order.folder.read_plan()?;
    let mut faults = Vec::new();
    let files = files(&order.folder, &plan, &mut faults)?;
    let held: BTreeSet<u64> = files.iter().flat_map(|file| file.range(&plan)).collect();
    let drawn = draw(held.iter().copied().collect(), order.share, order.seed);
    let scene = inputs::load_scene(&order.folder, &plan)?;
    let realization = Realization::new(&plan.job, &scene, &plan.bounds);
    let mut audited = Audited { batches: 0, of: held.len() as u64, whole_shards: 0, shards: 0, faults };
    for file in &files {
        let batches: Vec<u64> = file.range(&plan).filter(|batch| drawn.contains(batch)).collect();
        let own = matches!(file.header.span, Span::Shard(_));
        let whole = own && batches.len() as u64 == file.header.batches() && !batches.is_empty();
        audited.shards += u64::from(own);
        audited.whole_shards += u64::from(whole);
        audited.batches += batches.len() as u64;
        let examined = Examination { plan: &plan, file, realization: &realization }.examine(&batches, whole);
        match examined {
            Err(Error::Refused { path, reason }) => audited.faults.push(Fault { path, what: reason }),
            other => audited.faults.extend(other?),
        }
    }
    Ok(audited)
}

/// A checkpoint that can be read.
struct File {
    path: PathBuf,
    header: Header,
}

impl File {
    fn range(&self, plan: &Plan) -> std::ops::Range<u64> {
        let start = self.header.span.start(plan);
        start..start + self.header.batches()
    }

    fn open(&self, plan: &Plan) -> Result<Reader> {
        let reader = match self.header.span {
            Span::Shard(k) => Reader::open(&self.path, plan, k)?,
            Span::Before(_) => Reader::open_compaction(&self.path, plan)?,
        };
        reader.ok_or_else(|| Error::refused(&self.path, "gone while it was audited"))
    }
}

/// The checkpoints in `folder`; what is refused is a fault.
fn files(folder: &Folder, plan: &Plan, faults: &mut Vec<Fault>) -> Result<Vec<File>> {
    let mut found = Vec::new();
    let mut take = |path: PathBuf, read: Result<Option<Header>>| match read {
        Ok(header) => {
            found.extend(header.map(|header| File { path, header }));
            Ok(())
        }
        Err(Error::Refused { path, reason }) => {
            faults.push(Fault { path, what: reason });
            Ok(())
        }
        Err(e) => Err(e),
    };
    take(folder.compaction_path(), read_compaction(folder, plan))?;
    for (shard, path) in folder.checkpoints()? {
        let read = read_header(&path, plan, shard);
        take(path, read)?;
    }
    Ok(found)
}

/// A share of `batches`, one at least where there are any.
fn draw(mut batches: Vec<u64>, share: f64, seed: u64) -> BTreeSet<u64> {
    let wanted = ((share * batches.len() as f64).ceil() as usize).min(batches.len());
    let mut draws = Stream::new(seed, Domain::Audit, "").generator(0);
    for i in 0..wanted {
        let left = u32::try_from(batches.len() - i).unwrap_or(u32::MAX);
        batches.swap(i, i + draws.below(left) as usize);
    }
    batches.truncate(wanted);
    batches.into_iter().collect()
}

/// The comparison of one file.
struct Examination<'a> {
    plan: &'a Plan,
    file: &'a File,
    realization: &'a Realization<'a>,
}

impl Examination<'_> {
    /// Compares `batches`, and with `whole` what is made of all of them.
    fn examine(&self, batches: &[u64], whole: bool) -> Result<Vec<Fault>> {
        if batches.is_empty() {
            return Ok(Vec::new());
        }
        let reader = self.file.open(self.plan)?;
        let stored = Stored::read(&reader, self.plan)?;
        let mut faults = self.compare_fixed(&reader)?;
        let mut tally = Tally::new(&self.plan.sets());
        for &batch in batches {
            let scores = self.realization.batch(batch);
            let at = batch - self.file.range(self.plan).start;
            let mut wrong = stored.differences(&scores, at as usize);
            if self.file.header.digests.get(at as usize) != Some(&scores.digest()) {
                wrong.push("its scores are others than those computed here".to_owned());
            }
            faults.extend(wrong.into_iter().map(|what| self.fault(batch, &what)));
            if whole {
                tally.accumulate(&scores);
            }
        }
        if whole {
            faults.extend(self.compare_tally(&reader, &tally)?);
        }
        Ok(faults)
    }

    fn fault(&self, batch: u64, what: &str) -> Fault {
        let shard = batch / self.plan.job.run.batches_per_shard;
        let host = self.file.header.host_of(batch - self.file.range(self.plan).start);
        let what = format!("shard {shard}, batch {batch}, computed on {host}: {what}");
        Fault { path: self.file.path.clone(), what }
    }

    fn compare_fixed(&self, reader: &Reader) -> Result<Vec<Fault>> {
        let mut faults = Vec::new();
        for (set, (shape, here)) in self.plan.sets().iter().zip(self.realization.fixed_direct()).enumerate() {
            if !same(&reader.fixed_direct(set)?, here) {
                let what = format!("direct light of {} is another than the one computed here", shape.name);
                faults.push(Fault { path: self.file.path.clone(), what });
            }
        }
        Ok(faults)
    }

    /// Compares what all batches of a shard make together.
    fn compare_tally(&self, reader: &Reader, here: &Tally) -> Result<Vec<Fault>> {
        let there = reader.tally()?;
        let shard = self.file.range(self.plan).start / self.plan.job.run.batches_per_shard;
        let hosts: BTreeSet<&str> = self.file.header.runs.iter().map(|run| run.host.as_str()).collect();
        let hosts = Vec::from_iter(hosts).join(" and ");
        let mut faults = Vec::new();
        let mut wrong = |of: &str| {
            let what = format!("shard {shard}, computed on {hosts}: {of} is not what its batches make together");
            faults.push(Fault { path: self.file.path.clone(), what });
        };
        for (shape, (a, b)) in self.plan.sets().iter().zip(there.sets.iter().zip(&here.sets)) {
            let equal = match (a, b) {
                (SetTally::Moments(a), SetTally::Moments(b)) => bits_of(&a.bins) == bits_of(&b.bins),
                (SetTally::Replicates(a), SetTally::Replicates(b)) => bits_of(a) == bits_of(b),
                _ => false,
            };
            if !equal {
                wrong(&shape.name);
            }
        }
        if bits_of(&there.flux) != bits_of(&here.flux) {
            wrong("the flux balance");
        }
        if bits_of(&there.monitors) != bits_of(&here.monitors) {
            wrong("what is kept of monitored receivers");
        }
        Ok(faults)
    }
}

/// All bits of `numbers`, for which a comparison of numbers would not do: NaN equals nothing, and -0 equals 0.
fn bits_of(numbers: &impl serde::Serialize) -> blake3::Hash {
    let bytes = postcard::to_stdvec(numbers).expect("plain data of known length always has a postcard form");
    blake3::hash(&bytes)
}

fn same(a: &[f64], b: &[f64]) -> bool {
    a.iter().map(|x| x.to_bits()).eq(b.iter().map(|x| x.to_bits()))
}

/// What a file holds batch by batch.
struct Stored {
    /// Name, number and scores of the sets that keep their batches.
    sets: Vec<(String, usize, Replicates)>,
    flux: Replicates,
}

impl Stored {
    fn read(reader: &Reader, plan: &Plan) -> Result<Stored> {
        let kept = plan.sets().into_iter().enumerate().filter(|(_, s)| s.kept == Kept::EveryBatch);
        let sets = kept.map(|(set, shape)| Ok((shape.name, set, reader.replicates(set)?))).collect::<Result<_>>()?;
        Ok(Stored { sets, flux: reader.flux()? })
    }

    /// Where batch number `at` of the file is not `scores`.
    fn differences(&self, scores: &BatchScores, at: usize) -> Vec<String> {
        let row = |column: &[f64], bins: usize| column[at * bins..(at + 1) * bins].to_vec();
        let mut wrong = Vec::new();
        for (name, set, there) in &self.sets {
            let (here, bins) = (&scores.sets[*set], there.bins as usize);
            if !(same(&row(&there.value, bins), &here.value) && same(&row(&there.direct, bins), &here.direct)) {
                wrong.push(format!("the scores of {name} that are stored are others than those computed here"));
            }
        }
        if !same(&row(&self.flux.value, FLUX_BINS.len()), &scores.flux) {
            wrong.push("the flux balance that is stored is another than the one computed here".to_owned());
        }
        wrong
    }
}

impl std::fmt::Display for Audited {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        writeln!(f, "{} of {} batches computed again", self.batches, self.of)?;
        let Audited { whole_shards, shards, .. } = self;
        writeln!(
            f,
            "moments of maps compared in {whole_shards} of {shards} shards: in those of which all batches were drawn"
        )?;
        self.faults.iter().try_for_each(|fault| writeln!(f, "{}: {}", fault.path.display(), fault.what))?;
        match self.faults.len() {
            0 => writeln!(f, "nothing is wrong"),
            1 => writeln!(f, "1 fault"),
            n => writeln!(f, "{n} faults"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_of_the_batches_is_drawn_without_repetition() {
        let all: Vec<u64> = (100..300).collect();
        let some = draw(all.clone(), 0.1, 7);
        assert_eq!(some.len(), 20);
        assert!(some.iter().all(|batch| (100..300).contains(batch)));
        assert_eq!(some, draw(all.clone(), 0.1, 7));
        assert_ne!(some, draw(all.clone(), 0.1, 8));
        assert_eq!(draw(all.clone(), 1e-9, 7).len(), 1);
        assert_eq!(draw(all, 1.0, 7).len(), 200);
        assert!(draw(Vec::new(), 1.0, 7).is_empty());
    }
}
