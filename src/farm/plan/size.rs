//! Memory and disk that a plan needs: estimates for its reader and for the choice of the number of workers, and
//! the limits beyond which a plan is refused.

use super::Plan;
use crate::error::{Error, Result};
use crate::job::{Kept, ReceiverKind, Run, SetShape};
use crate::tally::{FLUX_BINS, LARGEST};

/// Most that the batch scores kept by a whole job may take \[bytes\]: merging keeps them in a file.
pub const KEPT_LIMIT: u64 = 2 << 30;
/// Most shards of a job: each is a file, and one process start.
pub const MAX_SHARDS: u64 = 100_000;

/// Program, libraries and stacks of one worker \[bytes\].
const PROCESS: u64 = 32 << 20;
/// Vertices of one history, generously: roulette ends most within ten.
const VERTICES: u64 = 32;
/// One vertex with its weight and surface \[bytes\].
const VERTEX: u64 = 128;
/// Vertices from which is chosen at once, at most, and those of the trajectories traced meanwhile.
const WAITING: u64 = (1 << 20) + 1024 * VERTICES;
/// One receiver of a bin, placed anew in each batch \[bytes\].
const RECEIVER: u64 = 256;
/// One f64 \[bytes\].
const NUMBER: u64 = 8;
/// A batch score and its direct part \[bytes\].
const KEPT: u64 = 2 * NUMBER;
/// The digest by which a checkpoint remembers a batch \[bytes\].
const DIGEST: u64 = 16;
/// Score, number, mean and three power sums that a monitored bin keeps of a batch \[bytes\].
const WATCHED: u64 = 6 * NUMBER;

/// What a plan needs, estimated \[bytes\].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sizes {
    /// Memory of one worker.
    pub worker: u64,
    /// Disk of one checkpoint of a whole shard before it is packed; while it is replaced, twice that.
    pub checkpoint: u64,
    /// Disk of the checkpoints of all shards.
    pub checkpoints: u64,
    /// Batch scores kept by the whole job, in a file while merging where they are many.
    pub kept: u64,
}

impl Plan {
    /// Memory and disk this plan needs.
    pub fn sizes(&self) -> Sizes {
        let run = &self.job.run;
        let sets = self.sets();
        let of_shard = run.batches_per_shard.min(run.batches);
        let tally: u64 = sets.iter().map(|s| tally_bytes(s, of_shard)).fold(0, u64::saturating_add);
        let flux = kept_bytes(FLUX_BINS.len() as u64, of_shard).saturating_add(DIGEST * of_shard);
        let scores: u64 = sets.iter().map(|s| score_bytes(s, run.histories_per_batch)).fold(0, u64::saturating_add);
        let vertices = vertex_bytes(run);
        let checkpoint = tally.saturating_add(flux);
        let worker = [PROCESS, self.scene.bytes, checkpoint, scores, vertices].into_iter().fold(0, u64::saturating_add);
        let checkpoints = checkpoint.saturating_mul(self.shard_count());
        Sizes { worker, checkpoint, checkpoints, kept: self.kept_bytes() }
    }

    fn kept_bytes(&self) -> u64 {
        let sets = self.sets();
        let kept = sets.iter().filter(|s| s.kept == Kept::EveryBatch).map(|s| s.bins() as u64);
        let bins = kept.sum::<u64>() + FLUX_BINS.len() as u64;
        let batches = self.job.run.batches;
        let monitors = sets.iter().map(|s| monitor_bytes(s, batches)).fold(0, u64::saturating_add);
        kept_bytes(bins, batches).saturating_add(monitors)
    }

    /// Refuses a plan beyond the limits, naming the size and what would help.
    ///
    /// # Errors
    /// [`Error::Input`] naming the size and the limit.
    pub fn check_sizes(&self) -> Result<()> {
        let file = &self.job_file.name;
        let shards = self.shard_count();
        if shards > MAX_SHARDS {
            let value = format!("{} ({shards} shards)", self.job.run.batches_per_shard);
            let allowed = format!("large enough for at most {MAX_SHARDS} shards");
            return Err(Error::input(file, "run.batches_per_shard", value, allowed));
        }
        let kept = self.kept_bytes();
        if kept <= KEPT_LIMIT {
            return Ok(());
        }
        let limit = format!("at most {} of kept batch scores", human(KEPT_LIMIT));
        let grids = self.job.grids.iter().enumerate().filter(|(_, g)| g.keep_batches);
        match grids.max_by_key(|(_, g)| u64::from(g.columns) * u64::from(g.rows)) {
            Some((i, grid)) => {
                let field = format!("grid[{i}].keep_batches");
                let value = format!("true (\"{}\", with the others {} of batch scores)", grid.name, human(kept));
                Err(Error::input(file, field, value, format!("{limit}; set keep_batches = false")))
            }
            None => {
                let value = format!("{} ({} of batch scores)", self.job.run.batches, human(kept));
                Err(Error::input(
                    file,
                    self.job.batches_field(),
                    value,
                    format!("{limit}; take fewer batches of more histories"),
                ))
            }
        }
    }
}

fn kept_bytes(bins: u64, batches: u64) -> u64 {
    bins.saturating_mul(batches).saturating_mul(KEPT)
}

/// What the monitored bins of one set keep of `batches` batches.
fn monitor_bytes(set: &SetShape, batches: u64) -> u64 {
    let each = batches.saturating_mul(WATCHED).saturating_add(LARGEST as u64 * NUMBER);
    each.saturating_mul(set.monitored.len() as u64)
}

/// Tally of one set over a shard, its monitored bins and the direct light that is the same in every batch.
fn tally_bytes(set: &SetShape, batches: u64) -> u64 {
    let bins = set.bins() as u64;
    let kept = match set.kept {
        Kept::Moments { colour } => bins * NUMBER * if colour { 10 } else { 7 },
        Kept::EveryBatch => (4 * bins * NUMBER).saturating_add(kept_bytes(bins, batches)),
    };
    kept.saturating_add(monitor_bytes(set, batches))
}

/// Vertices of a batch that are connected, and those from which they are chosen: not all at once where they are many.
fn vertex_bytes(run: &Run) -> u64 {
    let connected = run.histories_per_batch.saturating_mul(VERTICES);
    let traced = if run.thinning > 1 { connected.saturating_mul(run.thinning).min(WAITING) } else { 0 };
    // As vertices, and as connectors with what a tile looks at.
    let kept = if run.thinning > 1 { connected.saturating_mul(2 * run.vertices_kept()) } else { 0 };
    connected.saturating_add(traced).saturating_add(kept).saturating_mul(VERTEX)
}

/// Scores, receivers and single histories of one batch.
fn score_bytes(set: &SetShape, histories: u64) -> u64 {
    let numbers = match set.kept {
        Kept::Moments { colour: true } => 8,
        Kept::Moments { colour: false } | Kept::EveryBatch => 5,
    };
    let placed = match set.kind {
        ReceiverKind::Camera | ReceiverKind::Gonio => RECEIVER,
        ReceiverKind::Grid | ReceiverKind::Point | ReceiverKind::Region => RECEIVER / 2,
    };
    let watched = histories.saturating_mul(NUMBER * set.monitored.len() as u64);
    (set.bins() as u64 * (numbers * NUMBER + placed)).saturating_add(watched)
}

/// A size as people read it.
pub fn human(bytes: u64) -> String {
    let units = ["B", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB"];
    let mut value = bytes as f64;
    let mut unit = 0;
    while value >= 1024.0 && unit + 1 < units.len() {
        value /= 1024.0;
        unit += 1;
    }
    if unit == 0 { format!("{bytes} B") } else { format!("{value:.1} {}", units[unit]) }
}
