//! Lampyris

pub mod error;
pub mod farm;
pub mod geometry;
pub mod job;
pub mod math;
pub mod photometry;
pub mod random;
pub mod report;
pub mod scene;
pub mod tally;
pub mod transport;
