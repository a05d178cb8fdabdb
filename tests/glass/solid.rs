//! Bodies of glass: a slab lets through what a pane does, and a ball in an even room is not seen.

use crate::common::scenes::{add_quad, box_walls, bumpy_sphere, closed_box, lambert, point, spot_camera};
use crate::common::{Case, assert_all, compare, flux};
use lampyris::math::{DVec3, cos, sin};
use lampyris::photometry::Colour;
use lampyris::scene::{Delta, Glass, Model, Pane, Reflectance, Surface};
use lampyris::validate::scenes::UP;

fn glass(index: f64, absorption: f64) -> Surface {
    let reflectance = Reflectance::Delta(Delta::Glass(Glass::new(index, Colour::grey(absorption))));
    Surface { reflectance, double_sided: true, ..lambert(0.0, 0.0) }
}

#[test]
fn a_slab_lets_through_what_a_pane_of_its_absorption_does() {
    // A slab of 0.1 m from y = 1 on, a panel of 50 cd/m2 above, one of 20 cd/m2 below, and eyes in between.
    let (index, absorption, thickness) = (1.5, 3.0, 0.1);
    let mut model = Model::default();
    let corner = DVec3::new(-20.0, 1.0, -20.0);
    for [origin, u, v] in box_walls(DVec3::new(40.0, thickness, 40.0)) {
        // Walls of a room face inwards; the front of glass is outside.
        add_quad(&mut model, corner + origin, v, u, glass(index, absorption));
    }
    add_quad(&mut model, DVec3::new(-60.0, 3.0, -60.0), DVec3::X * 120.0, DVec3::Z * 120.0, lambert(0.0, 50.0));
    add_quad(&mut model, DVec3::new(-60.0, -1.0, -60.0), DVec3::Z * 120.0, DVec3::X * 120.0, lambert(0.0, 20.0));
    let angles = [0.0, 0.6, 1.1, 1.35];
    let cameras = angles
        .iter()
        .enumerate()
        .map(|(i, &angle)| spot_camera(&format!("c{i}"), [0.0; 3], [sin(angle), cos(angle), 0.0], [0.0, 0.0, 1.0]));
    let job = "[run]\nbatches = 32768\nhistories_per_batch = 1\nsampling = \"random\"\nseed = 8\n".to_owned()
        + &cameras.collect::<String>();
    let values = Case::new(&job, model).values();
    let pane = Pane::new(index, Colour::grey(lampyris::math::exp(-absorption * thickness)));
    let all = angles.iter().zip(values).map(|(&angle, found)| {
        let (through, mirrored) = pane.shares(cos(angle));
        compare(format!("at {angle}"), found, 50.0 * through.0[0] + 20.0 * mirrored.0[0])
    });
    assert_all(&all.collect::<Vec<_>>());
}

#[test]
fn a_clear_body_in_an_even_room_is_not_seen_and_keeps_the_flux() {
    let mut model = closed_box(DVec3::ONE, &lambert(0.5, 1.0));
    let number = model.surfaces.len() as u32;
    model.surfaces.push(glass(1.6, 0.0));
    for face in bumpy_sphere(2) {
        let first = model.positions.len() as u32;
        model.positions.extend(face.map(|p| 0.25 * p.as_dvec3() + 0.5));
        model.triangles.push([first, first + 1, first + 2]);
        model.surface_of.push(number);
    }
    let job = "[run]\nbatches = 64\nhistories_per_batch = 256\nseed = 9\n".to_owned()
        + &spot_camera("middle", [0.1, 0.5, 0.4], [0.5, 0.5, 0.5], UP)
        + &spot_camera("rim", [0.1, 0.5, 0.5], [0.5, 0.71, 0.5], UP)
        + &point("meter", [0.5, 0.1, 0.5], UP);
    let case = Case::new(&job, model);
    let values = case.values();
    // Emission is seen in every batch alike; what is reflected beyond has its error.
    assert_all(&[compare("middle", values[0], 2.0), compare("rim", values[1], 2.0)]);
    let (_, batches) = case.batches(1..u32::MAX);
    let (emitted, absorbed) = (flux(&batches, "emitted"), flux(&batches, "absorbed"));
    assert_eq!((flux(&batches, "escaped").mean, flux(&batches, "lost").mean), (0.0, 0.0));
    assert_all(&[compare("absorbed", absorbed, emitted.mean)]);
    assert!(flux(&batches, "met_delta").mean > 0.05 * emitted.mean);
}
