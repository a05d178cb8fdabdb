//! Who does the work: plan <- realization <- worker; plan <- checkpoint <- worker, coordinator, merge.

pub mod merge;
mod ordering;
pub mod plan;
pub mod realization;
pub mod receivers;
