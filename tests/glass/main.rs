//! Glass: panes between lamps, surfaces and eyes, against closed forms and between estimators.

#[path = "../common/mod.rs"]
mod common;

mod materials;
mod opal;
mod panes;
mod sheets;
mod solid;

use lampyris::geometry::simd::Path;
use lampyris::scene::Model;
use lampyris::validate::Experiment;

/// All numbers of `job` in `model` have the same bits with all instructions that the processor has.
fn assert_same_bits_on_every_path(job: &str, model: &Model) {
    let scores = |path: Path| {
        let mut case = Experiment::new(job, model.clone()).unwrap();
        case.scene.geometry = std::mem::take(&mut case.scene.geometry).with_path(path);
        let (_, batches) = case.batches(1..u32::MAX);
        let bits = batches.iter().flat_map(|b| b.sets.iter().flat_map(|s| s.value.iter().map(|v| v.to_bits())));
        bits.collect::<Vec<_>>()
    };
    let plain = scores(Path::Scalar);
    for path in Path::ALL.into_iter().filter(|p| p.is_available()) {
        assert_eq!(scores(path), plain, "{path:?}");
    }
}

#[test]
fn the_battery_holds() {
    common::battery::assert_theme("glass/");
}
