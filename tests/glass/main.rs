//! Glass: panes between lamps, surfaces and eyes, against closed forms and between estimators.

#[path = "../common/mod.rs"]
mod common;

mod materials;
mod opal;
mod panes;
mod sheets;
mod solid;

#[test]
fn the_battery_holds() {
    common::battery::assert_theme("glass/");
}
