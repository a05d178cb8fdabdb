//! Who does the work. Each module knows the ones above it only; `worker`, `coordinator` and `merge` do not know each
//! other: they meet in checkpoint files.
//!
//! ```text
//! plan          job -> shards, pure arithmetic
//! durable       replace a file so that a crash leaves the old or the new one
//! folder        what lies where in the folder of a plan
//! inputs        files -> plan, scene
//! receivers     bins of a job -> receivers in a scene
//! regions       parts of maps, one number a batch
//! pilot         the bound of the kernel, fixed before the run
//! local         histories of a batch x receivers of a set -> scores, in parallel
//! thinning      vertices of many trajectories -> those that are connected
//! realization   batch index -> scores, in parallel
//! checkpoint    one durable file for each shard
//! attempts      who has begun which shard, for those who watch
//! status        headers and attempts -> progress
//! worker        computes one shard
//! coordinator   starts, watches, restarts worker processes
//! merge         checkpoints -> one result, in parallel; the first of them -> one checkpoint
//! audit         batches computed again, and compared with checkpoints
//! engines       carry shards to many machines: Slurm, ssh
//! ```

pub mod attempts;
pub mod audit;
pub mod checkpoint;
pub mod coordinator;
mod degree;
pub mod durable;
pub mod engines;
pub mod folder;
pub mod inputs;
mod local;
pub mod merge;
pub mod pilot;
pub mod plan;
pub mod realization;
mod receivers;
mod regions;
pub mod status;
mod thinning;
pub mod worker;

#[cfg(test)]
mod testing;
