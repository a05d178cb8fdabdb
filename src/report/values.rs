//! From a merged tally to the numbers that are written, once, for every file.
//!
//! A tally holds the random part only. Here the part known without error is added, Student's quantile for the
//! number of batches is applied, and every bin gets its [`Status`]. Goals are judged by the same estimates
//! ([`Estimate::with_fixed`]).

use crate::farm::checkpoint::BLOCK;
use crate::farm::merge::{Blocks, Merged, SetResult};
use crate::farm::plan::Plan;
use crate::job::{ReceiverKind, SetShape};
use crate::tally::health::{Common, Counted, Examined, Health, Signs, health};
use crate::tally::statistics::student_quantile;
use crate::tally::{EveryBatch, Monitor};
use std::io;

/// What is known of a bin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Status {
    /// A value with an error; from a single batch the error is NaN.
    Estimated,
    /// The same in every batch: light seen without any reflection by a receiver.
    Exact,
    /// The receiver existed and no history reached it (or there is no batch at all): the error is NaN, never 0.
    NoInformation,
    /// No receiver there: inside a solid, or behind a surface. Every number is NaN.
    NoReceiver,
}

/// The numbers of one bin \[cd/m2 or lx, except where said\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bin {
    /// Mean of the batches, the fixed direct part included.
    pub value: f64,
    /// Of that mean.
    pub standard_error: f64,
    /// Standard error over the size of the value \[1\]; NaN where nothing is known.
    pub relative_error: f64,
    /// Lower end of the interval, not clamped at 0.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
    /// Direct light: the fixed part and the mean of the sampled one; contained in `value`.
    pub direct: f64,
    /// Largest single history over the sum of all \[1\], direct light at the receiver left out.
    pub peak: f64,
    /// Variance of the variance of the batch scores \[1\]; NaN where only moments are kept.
    pub vov: f64,
    /// Linear Rec.709 whose luminance is `value`.
    pub colour: [f64; 3],
    /// What is known.
    pub status: Status,
    /// Why the interval should not be trusted; None without receiver.
    pub health: Option<Health>,
}

impl Bin {
    fn unknown(status: Status) -> Self {
        let nan = f64::NAN;
        Bin {
            value: nan,
            standard_error: nan,
            relative_error: nan,
            low: nan,
            high: nan,
            direct: nan,
            peak: nan,
            vov: nan,
            colour: [nan; 3],
            status,
            health: None,
        }
    }

    /// All numbers in a fixed order, for a digest.
    pub fn numbers(&self) -> [f64; 11] {
        let [r, g, b] = self.colour;
        let health = self.health_code();
        [self.value, self.standard_error, self.low, self.high, self.direct, self.peak, self.vov, r, g, b, health]
    }

    /// Sum of the codes of its marks; NaN without receiver.
    pub fn health_code(&self) -> f64 {
        self.health.map_or(f64::NAN, |h| f64::from(h.code()))
    }
}

/// The numbers of one receiver set. Those of maps are made block by block each time they are asked for: a map need not fit
/// into memory.
pub(super) struct SetValues<'a> {
    /// Name, kind and size.
    pub shape: SetShape,
    /// The monitored bins, in ascending order.
    pub monitored: Vec<Examined>,
    source: Source<'a>,
}

/// Where the bins of a set come from.
enum Source<'a> {
    Held(Vec<Bin>),
    Streamed { rule: Rule, batches: u64, blocks: &'a Blocks, fixed_direct: &'a [f64] },
}

impl<'a> SetValues<'a> {
    /// The numbers of the receiver set `shape` of which `set` is the result and `monitors` are its monitored bins.
    ///
    /// # Errors
    /// Those of reading batch scores that are kept in a file.
    pub fn new(
        plan: &Plan,
        merged: &Merged,
        shape: &SetShape,
        set: &'a SetResult,
        monitors: &[Monitor],
    ) -> io::Result<Self> {
        let batches = merged.batches;
        let run = &plan.job.run;
        let (SetResult::Moments { fixed_direct, .. } | SetResult::Replicates { fixed_direct, .. }) = set;
        let fixed = |bin: u32| fixed_direct.get(bin as usize).copied().unwrap_or(0.0);
        let examine = |m: &Monitor| Examined::new(m, fixed(m.bin), run.sampling);
        let monitored: Vec<Examined> = monitors.iter().map(examine).collect();
        let histories = batches as f64 * run.histories_per_batch as f64;
        let rule = Rule {
            quantile: student_quantile(run.confidence, batches),
            common: Common { histories, narrowest_lobe: plan.scene.narrowest_lobe },
        };
        assert!(fixed_direct.is_empty() || fixed_direct.len() == shape.bins(), "direct light of another set");
        let source = match set {
            SetResult::Moments { bins: blocks, .. } => {
                assert_eq!(blocks.len(), shape.bins(), "the result of another set");
                Source::Streamed { rule, batches, blocks, fixed_direct }
            }
            SetResult::Replicates { scores, .. } => {
                assert_eq!((scores.bins(), scores.batches()), (shape.bins(), batches), "the result of another set");
                let mut bins = Vec::with_capacity(shape.bins());
                scores.each(&mut |first, group| {
                    let bin = |i| {
                        let counted = Counted::of_replicates(group, i);
                        rule.bin((counted, None), fixed_direct, first + i, find(&monitored, first + i))
                    };
                    bins.extend((0..group.bins as usize).map(bin));
                })?;
                Source::Held(bins)
            }
        };
        Ok(SetValues { shape: shape.clone(), monitored, source })
    }

    /// Gives every bin with its number to `take`, row by row.
    ///
    /// # Errors
    /// Those of `take`, and of reading a map that is kept in a file.
    pub fn each(&self, mut take: impl FnMut(usize, &Bin) -> io::Result<()>) -> io::Result<()> {
        match &self.source {
            Source::Held(bins) => bins.iter().enumerate().try_for_each(|(i, bin)| take(i, bin)),
            Source::Streamed { blocks, .. } => (0..blocks.count()).try_for_each(|number| {
                let bins = self.block(number)?;
                bins.iter().enumerate().try_for_each(|(i, bin)| take(number * BLOCK + i, bin))
            }),
        }
    }

    /// Bin `i` alone.
    ///
    /// # Errors
    /// Those of reading a map that is kept in a file.
    pub fn bin(&self, i: usize) -> io::Result<Bin> {
        match &self.source {
            Source::Held(bins) => Ok(bins[i]),
            Source::Streamed { .. } => Ok(self.block(i / BLOCK)?[i % BLOCK]),
        }
    }

    /// The only bin of a set that has one.
    ///
    /// # Errors
    /// As [`SetValues::bin`].
    pub fn single(&self) -> io::Result<Bin> {
        assert_eq!(self.shape.bins(), 1, "a set of more than one bin");
        self.bin(0)
    }

    /// The bins of a block of a map.
    fn block(&self, number: usize) -> io::Result<Vec<Bin>> {
        let Source::Streamed { rule, batches, blocks, fixed_direct } = &self.source else {
            unreachable!("only maps have blocks")
        };
        let block = blocks.read(number)?;
        let bin = |i: usize| {
            let raw = (Counted::of_moments(&block, i, *batches), block.colour.get(i).copied());
            let at = number * BLOCK + i;
            rule.bin(raw, fixed_direct, at, find(&self.monitored, at))
        };
        Ok((0..block.len()).map(bin).collect())
    }

    /// All receiver sets of `plan`, one at a time.
    pub fn all(plan: &'a Plan, merged: &'a Merged) -> impl Iterator<Item = io::Result<SetValues<'a>>> + 'a {
        let shapes = plan.job.sets();
        let lengths = [merged.sets.len(), merged.monitors.len()];
        assert_eq!(lengths, [shapes.len(); 2], "a result for each receiver set");
        let results = merged.sets.iter().zip(&merged.monitors);
        let values = |(shape, (set, monitors)): (SetShape, (&'a SetResult, &Vec<_>))| {
            SetValues::new(plan, merged, &shape, set, monitors)
        };
        shapes.into_iter().zip(results).map(values)
    }
}

/// The unit of what a receiver of this kind measures.
pub(super) fn unit(kind: ReceiverKind) -> &'static str {
    match kind {
        ReceiverKind::Camera | ReceiverKind::Gonio | ReceiverKind::Region => "cd/m2",
        ReceiverKind::Grid | ReceiverKind::Point => "lx",
    }
}

/// The word for a kind of receiver set, as in a job file.
pub(super) fn kind_name(kind: ReceiverKind) -> &'static str {
    match kind {
        ReceiverKind::Camera => "camera",
        ReceiverKind::Gonio => "gonio",
        ReceiverKind::Grid => "grid",
        ReceiverKind::Point => "point",
        ReceiverKind::Region => "region",
    }
}

/// What a tally says of a bin, and its colour where one is kept.
type Raw = (Counted, Option<[f64; 3]>);

/// What is the same for all bins of a set.
struct Rule {
    quantile: f64,
    common: Common,
}

/// What is known of bin `i` if it is monitored.
fn find(monitored: &[Examined], i: usize) -> Option<&Examined> {
    monitored.binary_search_by_key(&i, |e| e.bin as usize).ok().map(|at| &monitored[at])
}

impl Rule {
    fn bin(&self, (counted, colour): Raw, fixed_direct: &[f64], i: usize, examined: Option<&Examined>) -> Bin {
        let Some(estimate) = counted.estimate.with_fixed(fixed_direct, i) else {
            return Bin::unknown(Status::NoReceiver);
        };
        let fixed = fixed_direct.get(i).copied().unwrap_or(0.0);
        let signs = Signs::of(&self.common, &counted, fixed, examined);
        let health = Some(health(&signs));
        if estimate.n == 0 {
            return Bin { health, ..Bin::unknown(Status::NoInformation) };
        }
        let (low, high) = estimate.interval(self.quantile);
        Bin {
            value: estimate.mean,
            standard_error: estimate.standard_error,
            relative_error: signs.relative_error,
            low,
            high,
            direct: fixed + counted.direct,
            peak: signs.peak,
            vov: signs.vov,
            // Fixed light has no colour of its own in a tally: added as grey it keeps the luminance right.
            colour: colour.map_or([estimate.mean; 3], |c| c.map(|x| x + fixed)),
            status: status(signs.informed, estimate.standard_error),
            health,
        }
    }
}

fn status(informed: bool, standard_error: f64) -> Status {
    match standard_error {
        _ if !informed => Status::NoInformation,
        0.0 => Status::Exact,
        _ => Status::Estimated,
    }
}
