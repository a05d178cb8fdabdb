//! Bodies of glass: a slab lets through what a pane does, but for the polarisation that is forgotten at each surface, and a clear body
//! before an even background is not seen.

use crate::common::scenes::{add_quad, box_walls, bumpy_sphere, closed_box, lambert, point, spot_camera};
use crate::common::{Case, assert_all, compare, flux};
use lampyris::math::{DVec3, cos, sin};
use lampyris::photometry::Colour;
use lampyris::scene::{Delta, Glass, Model, Pane, Reflectance, Surface};
use lampyris::validate::Experiment;
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
    // Light is unpolarised at each surface anew: the sum over reflections of the mean reflectance, not the mean of two sums.
    let shares = |angle: f64| {
        let inside = (1.0 - sin(angle) * sin(angle) / (index * index)).sqrt();
        let square = |x: f64| x * x;
        let s = square((cos(angle) - index * inside) / (cos(angle) + index * inside));
        let p = square((index * cos(angle) - inside) / (index * cos(angle) + inside));
        let (rho, t) = (0.5 * (s + p), lampyris::math::exp(-absorption * thickness / inside));
        let through = (1.0 - rho) * (1.0 - rho) * t / (1.0 - rho * rho * t * t);
        (through, rho * (1.0 + t * through))
    };
    let pane = Pane::new(index, Colour::grey(lampyris::math::exp(-absorption * thickness)));
    assert!((shares(1e-9).0 - pane.transmittance(1.0).0[0]).abs() < 1e-9);
    assert!((shares(0.6).0 / pane.transmittance(cos(0.6)).0[0] - 1.0).abs() < 2e-3);
    let all = angles.iter().zip(values).map(|(&angle, found)| {
        let (through, mirrored) = shares(angle);
        compare(format!("at {angle}"), found, 50.0 * through + 20.0 * mirrored)
    });
    assert_all(&all.collect::<Vec<_>>());
}

/// A clear bumpy body in a cube whose walls are like `wall`.
fn with_body(wall: &Surface) -> Model {
    let mut model = closed_box(DVec3::ONE, wall);
    let number = model.surfaces.len() as u32;
    model.surfaces.push(glass(1.6, 0.0));
    for face in bumpy_sphere(2) {
        let first = model.positions.len() as u32;
        model.positions.extend(face.map(|p| 0.25 * p.as_dvec3() + 0.5));
        model.triangles.push([first, first + 1, first + 2]);
        model.surface_of.push(number);
    }
    model
}

#[test]
fn a_clear_body_before_an_even_background_is_not_seen() {
    let job = "[run]\nbatches = 256\nhistories_per_batch = 16\nseed = 9\n".to_owned()
        + &spot_camera("middle", [0.1, 0.5, 0.4], [0.5, 0.5, 0.5], UP)
        + &spot_camera("rim", [0.1, 0.5, 0.5], [0.5, 0.71, 0.5], UP);
    for value in Case::new(&job, with_body(&lambert(0.0, 3.0))).values() {
        assert!((value.mean / 3.0 - 1.0).abs() < 1e-3, "{value:?}");
    }
}

#[test]
fn a_clear_body_keeps_the_flux() {
    let job =
        "[run]\nbatches = 64\nhistories_per_batch = 256\nseed = 9\n".to_owned() + &point("meter", [0.5, 0.1, 0.5], UP);
    let (_, batches) = Case::new(&job, with_body(&lambert(0.5, 1.0))).batches(1..u32::MAX);
    let (emitted, absorbed) = (flux(&batches, "emitted"), flux(&batches, "absorbed"));
    assert_eq!((flux(&batches, "escaped").mean, flux(&batches, "lost").mean), (0.0, 0.0));
    assert_all(&[compare("absorbed", absorbed, emitted.mean)]);
    assert!(flux(&batches, "met_delta").mean > 0.05 * emitted.mean);
}

/// What is said of the clear body when `change` was done to its scene.
fn refusal(change: impl Fn(&mut Model)) -> String {
    let mut model = with_body(&lambert(0.5, 1.0));
    change(&mut model);
    Experiment::new(&point("meter", [0.5, 0.1, 0.5], UP), model).map(|_| ()).unwrap_err().to_string()
}

#[test]
fn a_body_that_is_open_or_inside_out_is_refused() {
    let walls = 12;
    let open = refusal(|model| {
        model.triangles.truncate(model.triangles.len() - 1);
        model.surface_of.pop();
    });
    assert!(open.contains("material wall, a body of glass = open from [") && open.contains("closed mesh"), "{open}");
    // Closed all round, but one triangle shows its back.
    let turned = refusal(|model| model.triangles[walls + 3].swap(0, 1));
    assert!(turned.contains("open from"), "{turned}");
    let inside_out = refusal(|model| model.triangles[walls..].iter_mut().for_each(|t| t.swap(0, 1)));
    assert!(inside_out.contains("inside out"), "{inside_out}");
    // The place is that of the file: the last triangle has its corners there.
    let model = with_body(&lambert(0.5, 1.0));
    let last = model.triangles.last().unwrap().map(|corner| model.positions[corner as usize].as_vec3().to_array());
    let told = last.iter().filter(|corner| open.contains(&format!("{corner:?}"))).count();
    assert_eq!(told, 2, "{open} {last:?}");
}
