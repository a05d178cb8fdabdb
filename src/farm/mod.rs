//! Who does the work: plan <- realization <- worker; plan <- checkpoint <- worker, coordinator, merge.

pub mod merge;
pub mod plan;
pub mod realization;
