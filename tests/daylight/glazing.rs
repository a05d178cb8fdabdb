//! Windows with panes: the sky lights, and is seen, through glass as much as the glass transmits.

use crate::common::scenes::{add_quad, lambert, point, spot_camera};
use crate::common::{Case, assert_all, compare, difference};
use crate::{Hole, room, sky};
use lampyris::math::DVec3;
use lampyris::photometry::Colour;
use lampyris::scene::{Delta, Model, Pane, Reflectance, Surface};
use lampyris::validate::daylight::through;
use lampyris::validate::scenes::run;

const UP: [f64; 3] = [0.0, 1.0, 0.0];

fn pane() -> Pane {
    Pane::new(1.52, Colour::grey(0.85))
}

/// The room with `surface` on its walls, a pane before its window.
fn glazed(surface: &Surface) -> Model {
    let mut model = room(Hole::Facade, surface);
    let reflectance = Reflectance::Delta(Delta::Pane(pane()));
    let glass = Surface { reflectance, double_sided: true, ..lambert(0.0, 0.0) };
    add_quad(&mut model, DVec3::new(0.9, 0.9, -0.01), DVec3::X * 2.2, DVec3::Y * 1.6, glass);
    model
}

fn overcast() -> String {
    sky("\"overcast\"", 3000.0, "ground_reflectance = 0.2\n")
}

#[test]
fn the_sky_component_is_that_of_what_the_pane_transmits() {
    let place = [2.2, 0.9, 2.0];
    let mut all = Vec::new();
    for opening in [String::new(), Hole::Facade.opening()] {
        let histories = if opening.is_empty() { 32768 } else { 2048 };
        let job = run(histories, 32) + &overcast() + &opening + &point("p", place, [0.0, 1.0, -1.0]);
        let case = Case::new(&job, glazed(&lambert(0.0, 0.0)));
        let seen = |w: DVec3| case.scene.beyond(w).luminance() * pane().transmittance(w.z.abs()).luminance();
        let normal = DVec3::new(0.0, 1.0, -1.0).normalize();
        let expected = through(Hole::Facade.rectangle(), place.into(), normal, seen);
        all.push(compare(format!("opening {}", !opening.is_empty()), case.values()[0], expected).within(1e-4));
    }
    assert_all(&all);
}

#[test]
fn an_eye_sees_the_sky_through_the_pane() {
    let job = "[run]\nbatches = 16384\nhistories_per_batch = 1\nsampling = \"random\"\nseed = 3\n".to_owned()
        + &overcast()
        + &spot_camera("straight", [2.0, 1.5, 4.0], [2.1, 1.9, 0.0], UP)
        + &spot_camera("aslant", [3.8, 1.5, 1.0], [1.6, 1.9, 0.0], UP);
    let case = Case::new(&job, glazed(&lambert(0.0, 0.0)));
    let expected = |eye: [f64; 3], target: [f64; 3]| {
        let w = (DVec3::from(target) - DVec3::from(eye)).normalize();
        case.scene.beyond(w).luminance() * pane().transmittance(w.z.abs()).luminance()
    };
    let values = case.values();
    assert_all(&[
        compare("straight", values[0], expected([2.0, 1.5, 4.0], [2.1, 1.9, 0.0])),
        compare("aslant", values[1], expected([3.8, 1.5, 1.0], [1.6, 1.9, 0.0])),
    ]);
}

/// Histories that came through the pane against paths that leave by it.
#[test]
fn local_and_reverse_agree_behind_a_pane() {
    let model = glazed(&lambert(0.5, 0.0));
    let of = |estimator: &str, histories: u32, opening: &str| {
        let run = format!("{}[transport]\nestimator = \"{estimator}\"\n", run(histories, 32));
        let receivers = point("desk", [0.7, 0.8, 1.5], UP) + &spot_camera("wall", [2.0, 1.5, 2.5], [4.0, 1.2, 3.0], UP);
        Case::new(&(run + &overcast() + opening + &receivers), model.clone()).values()
    };
    let local = of("local", 8192, &Hole::Facade.opening());
    let reverse = of("reverse", 32768, "");
    let pairs = local.iter().zip(&reverse).enumerate();
    assert_all(&pairs.map(|(i, (a, b))| difference(format!("receiver {i}"), *a, *b)).collect::<Vec<_>>());
}
