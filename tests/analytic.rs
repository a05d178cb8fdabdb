//! The battery of `lampyris validate`, theme by theme, by the command itself: sources, direct light, form factors,
//! cavities, one reflection, the cube. Sobolev's problem is in `sobolev.rs`.

mod common;

use common::battery::assert_theme;

#[test]
fn sources_and_direct_light() {
    assert_theme("direct/");
}

#[test]
fn form_factors() {
    assert_theme("form-factor/");
}

#[test]
fn closed_cavities() {
    assert_theme("cavity/");
}

#[test]
fn one_reflection() {
    assert_theme("bounce/");
}

#[test]
fn cube_lit_from_its_middle() {
    assert_theme("cube/");
}

#[test]
fn luminaires_and_luminous_areas() {
    assert_theme("luminaire/");
}

#[test]
fn openings() {
    assert_theme("opening/");
}

#[test]
fn lit_walls_and_screens() {
    assert_theme("reflection/");
}
