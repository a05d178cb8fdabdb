//! How many workers this machine carries. Nothing here changes a number: shards come from the plan.

use crate::error::{Error, Result};
use crate::farm::plan::{Plan, human};

/// Cores that this process may use.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Number of workers: `asked`, or the cores, or fewer if their memory does not fit; at most one for each shard.
pub fn workers_that_fit(plan: &Plan, asked: Option<usize>) -> usize {
    let shards = usize::try_from(plan.shard_count()).unwrap_or(usize::MAX);
    let workers = asked.unwrap_or_else(|| fit(cores(), plan.sizes().worker, available_memory()));
    workers.min(shards).max(1)
}

fn fit(cores: usize, worker: u64, available: Option<u64>) -> usize {
    let by_memory = available.map_or(u64::MAX, |bytes| bytes / worker.max(1));
    cores.min(usize::try_from(by_memory).unwrap_or(usize::MAX)).max(1)
}

/// Refuses a plan of which not even one worker fits into this machine.
///
/// # Errors
/// [`Error::Input`] with both sizes.
pub fn check_memory(plan: &Plan) -> Result<()> {
    match memory("MemTotal:") {
        Some(all) if plan.sizes().worker > all => {
            let allowed = format!("at most the {} of this machine: fewer pixels or histories_per_batch", human(all));
            let value = format!("about {}", human(plan.sizes().worker));
            Err(Error::input(&plan.job_file.name, "memory of one worker", value, allowed))
        }
        _ => Ok(()),
    }
}

/// Memory that can be had without swapping \[bytes\]; None where the kernel does not say.
fn available_memory() -> Option<u64> {
    memory("MemAvailable:")
}

fn memory(what: &str) -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(what))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kib.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fewer_workers_when_memory_is_short_but_never_none() {
        assert_eq!(fit(8, 100, None), 8);
        assert_eq!(fit(8, 100, Some(1000)), 8);
        assert_eq!(fit(8, 100, Some(350)), 3);
        assert_eq!(fit(8, 100, Some(50)), 1);
    }
}
