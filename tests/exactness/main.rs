//! Same job, same bits, on real processes: whatever the workers, threads, CPU, interruptions and order of merging, the
//! decoded results are those of one straight run by one worker; or something is refused by name and nothing changes.
//!
//! Nothing here waits for luck. Kills and signals are sent at instants drawn from a recorded seed, each is counted only
//! when it is proved to have hit a worker at work, and a test goes on, with fresh folders where needed, until it has
//! enough of them.

mod auditing;
mod bits;
mod changes;
mod compacting;
#[cfg(all(target_arch = "x86_64", target_env = "gnu"))]
mod cpu;
mod disk;
mod engines;
mod extending;
mod faults;
mod kills;
mod late;
mod merging;
mod place;
mod process;
mod refusals;
mod signals;
mod stopping;
mod variants;
mod workers;
