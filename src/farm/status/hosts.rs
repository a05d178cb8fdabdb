//! The machines of a run, from the shards that they wrote last.

use super::ShardStatus;
use serde::Serialize;
use std::collections::BTreeMap;

/// What one machine does and has done.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct HostStatus {
    /// Its name.
    pub host: String,
    /// Shards that seem to be at work there.
    pub shards_active: u64,
    /// Shards whose last batches it computed.
    pub shards_done: u64,
    /// Batches of the shards that it wrote last.
    pub batches: u64,
    /// Batches per second of its workers now; None when none is at work, or before their first batch.
    pub rate: Option<f64>,
    /// Time since it was last heard of \[s\].
    pub age_seconds: u64,
}

/// Every machine among `shards`, by name.
pub(super) fn of(shards: &[ShardStatus]) -> Vec<HostStatus> {
    let mut hosts: BTreeMap<&str, HostStatus> = BTreeMap::new();
    for shard in shards.iter().filter(|s| !s.host.is_empty()) {
        let new = || HostStatus { host: shard.host.clone(), age_seconds: u64::MAX, ..HostStatus::default() };
        let host = hosts.entry(&shard.host).or_insert_with(new);
        host.shards_active += u64::from(shard.active);
        host.shards_done += u64::from(shard.batches >= shard.of);
        host.batches += shard.batches;
        host.age_seconds = host.age_seconds.min(shard.age_seconds);
        if let Some(rate) = shard.rate().filter(|_| shard.active) {
            host.rate = Some(host.rate.unwrap_or(0.0) + rate);
        }
    }
    hosts.into_values().collect()
}
