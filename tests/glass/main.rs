//! Glass: panes between lamps, surfaces and eyes, against closed forms and between estimators.

#[path = "../common/mod.rs"]
mod common;

mod panes;
