//! Mirrors: followed by eye rays and by trajectories, never scored; the flux that met them is told. And the guard
//! against trajectories that never end.

mod common;

use common::scenes::{add_quad, closed_box, lambert, mirror, omni, point, spot_camera};
use common::{Case, Estimate, assert_all, difference, flux};
use lampyris::math::{DVec3, PI};
use lampyris::photometry::Colour;
use lampyris::random::{Domain, Stream};
use lampyris::scene::{Model, Reflectance, Surface};
use lampyris::transport::connection::Connectors;
use lampyris::transport::receiver::{Receiver, Response};
use lampyris::transport::trajectory::{Vertex, trace};

/// A square mirror of half side `half` in the plane y = 0.
fn mirror_floor(model: &mut Model, half: f64, base: f64) {
    add_quad(model, DVec3::new(-half, 0.0, -half), DVec3::Z * 2.0 * half, DVec3::X * 2.0 * half, mirror(base));
}

#[test]
fn emission_seen_in_mirrors_is_seen_light() {
    // Down into one mirror, up into another, down again onto a panel: two reflections of 0.9 at normal incidence.
    let mut model = Model::default();
    mirror_floor(&mut model, 1.0, 0.9);
    add_quad(&mut model, DVec3::new(-1.0, 2.0, -1.0), DVec3::X * 2.0, DVec3::Z * 2.0, mirror(0.9));
    // The eye sits above a small panel that faces up and hides the first mirror from straight below it.
    add_quad(&mut model, DVec3::new(-0.1, 0.5, -0.1), DVec3::Z * 0.2, DVec3::X * 0.2, lambert(0.0, 7.0));
    let job = "[run]\nbatches = 16\nhistories_per_batch = 16\n".to_owned()
        + &spot_camera("one", [0.0, 1.0, 0.0], [0.0, 2.0, 0.0], [1.0, 0.0, 0.0])
        + &spot_camera("none", [0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
        + &spot_camera("dark", [0.5, 1.0, 0.5], [0.5, 2.0, 0.5], [1.0, 0.0, 0.0]);
    let estimates = Case::new(&job, model).estimates();
    // Schlick's factor at normal incidence is the base colour.
    assert!((estimates[0][0].mean - 0.9 * 7.0).abs() < 1e-6, "{:?}", estimates[0][0]);
    assert!((estimates[1][0].mean - 7.0).abs() < 1e-12, "{:?}", estimates[1][0]);
    // Between the mirrors alone nothing is seen, for ever.
    assert_eq!(estimates[2][0].mean, 0.0);
}

/// Indirect illuminance by the wall x = 2 (y from 0 to 3) at a meter that faces it.
fn wall_case(model: &mut Model, sources: &str) -> Case {
    add_quad(model, DVec3::new(2.0, 0.0, -2.0), DVec3::Z * 4.0, DVec3::Y * 3.0, lambert(0.6, 0.0));
    let job = "[run]\nbatches = 64\nhistories_per_batch = 16384\nseed = 51\n".to_owned()
        + sources
        + &point("meter", [0.5, 1.5, 0.0], [1.0, 0.0, 0.0]);
    Case::new(&job, std::mem::take(model))
}

#[test]
fn trajectories_follow_a_mirror_like_its_image_source() {
    let mut model = Model::default();
    // Points are lifted in proportion to the scene: a mirrored ray starts that much higher, 0.7 mm in a scene of 200 m.
    mirror_floor(&mut model, 20.0, 1.0);
    let case = wall_case(&mut model, &omni([0.0, 1.0, 0.0], 100.0));
    // Order 2 is source -> mirror -> wall -> meter: the mirror reflects but does not score.
    let (_, batches) = case.batches(1..3);
    let mirrored = common::estimates(&batches)[0][0];
    // The same without the mirror: the image source lights the wall from below.
    let sources = omni([0.0, 1.0, 0.0], 100.0) + &omni([0.0, -1.0, 0.0], 100.0);
    let image = wall_case(&mut Model::default(), &sources).estimates_of_orders(1..2)[0][0];
    // Of the lower half of the sphere all but what leaves beyond 20 m meets the mirror, and so does what the wall
    // sends down; that part is not known in closed form, the first is a lower bound.
    let met = flux(&batches, "met_delta").mean;
    assert!(met > 0.47 * 400.0 * PI && met < 400.0 * PI, "{met}");
    assert_all(&[difference("mirror against image source", mirrored, image)]);
}

#[test]
fn light_from_a_mirror_above_the_bound_is_told() {
    // A mirror wall at x = 0 of a cube, and meters on the matt floor, in its middle and beside the matt wall x = 1.
    let places = [0.5, 0.99, 0.9999].map(|x| [x, 0.0, 0.4]);
    let meters = places.iter().enumerate().map(|(i, &p)| point(&format!("p{i}"), p, [0.0, 1.0, 0.0]));
    let mut model = closed_box(DVec3::ONE, &lambert(0.5, 0.0));
    model.surfaces[0] = mirror(0.9);
    let job = "[run]\nbatches = 16\nhistories_per_batch = 256\n".to_owned()
        + &omni([0.4, 0.6, 0.5], 100.0)
        + &meters.collect::<String>();
    let case = Case::new(&job, model);
    assert_eq!(case.scene.narrowest_lobe(), 0.0);
    let batches = case.batches(0..u32::MAX).1;
    let told = |set: usize| Estimate::from_scores(batches.iter().map(|b| b.sets[set].caustic[0])).mean;
    assert_eq!(told(0), 0.0, "nothing above the bound in the middle");
    assert!(batches.iter().all(|b| b.sets[2].caustic[0] > 0.0), "known from few histories, however near the wall");
    let excess = mirrored_above_the_bound(&case, case.scene.place(places[1]));
    assert!((0.5..2.0).contains(&(told(1) / excess)), "{} for {excess}", told(1));
}

/// What connections to a lux-meter on the floor bring of light that a mirror sent, less what the bound would let through.
fn mirrored_above_the_bound(case: &Case, position: DVec3) -> f64 {
    const HISTORIES: u64 = 1 << 18;
    let stream = Stream::new(43, Domain::Trajectory, "");
    let [mut carried, mut bounded] = [Connectors::default(), Connectors::default()];
    for history in 0..HISTORIES {
        let mut vertices: Vec<Vertex> = Vec::new();
        trace(&case.scene, &case.job.transport, &mut stream.generator(history), &mut vertices);
        vertices.retain(|v| v.after_delta);
        carried.push(&case.scene, &vertices);
        vertices.iter_mut().for_each(|v| v.after_delta = false);
        bounded.push(&case.scene, &vertices);
    }
    let meter = Receiver { position, normal: DVec3::Y, response: Response::Cosine };
    let sum = |histories| common::connect(&case.scene, histories, case.bounds[0], &[meter])[0].sum.luminance();
    (sum(&carried) - sum(&bounded)) / HISTORIES as f64
}

#[test]
fn polished_dielectric_is_mirror_and_diffuse_at_once() {
    // Lambert-like coat under a delta Fresnel layer: seen from above, it shows the panel in its mirror and the light
    // that its diffuse part reflects. What the eye sees is the sum, whichever the eye ray draws.
    let mut model = Model::default();
    let law = Reflectance::metallic_roughness(Colour::grey(0.5), 0.0, 0.0);
    let polished = Surface { reflectance: law.clone(), ..lambert(0.0, 0.0) };
    add_quad(&mut model, DVec3::new(-5.0, 0.0, -5.0), DVec3::Z * 10.0, DVec3::X * 10.0, polished);
    add_quad(&mut model, DVec3::new(1.0, 2.0, -1.0), DVec3::X * 2.0, DVec3::Z * 2.0, lambert(0.0, 50.0));
    let eye = [-2.0, 2.0, 0.0];
    let job = "[run]\nbatches = 4096\nhistories_per_batch = 4\nseed = 52\n".to_owned()
        + &omni([0.0, 3.0, 3.0], 100.0)
        + &spot_camera("c", eye, [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]).replace("samples = 1", "samples = 16")
        + &point("e", [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let estimates = Case::new(&job, model).estimates();
    let to_eye = DVec3::new(-1.0, 1.0, 0.0).normalize();
    let from_lamp = DVec3::new(0.0, -1.0, -1.0).normalize();
    let lamp = 100.0 / 18.0 * (0.5f64).sqrt();
    let mirrored = law.delta_reflectance((0.5f64).sqrt()).unwrap().luminance() * 50.0;
    let of_lamp = law.evaluate(DVec3::Y, from_lamp, to_eye).luminance() * lamp;
    // The panel's own light, reflected diffusely, is what is left: close to f times its illuminance.
    let panel = estimates[1][0].mean - lamp;
    let of_panel = law.evaluate(DVec3::Y, DVec3::new(-1.0, -1.0, 0.0).normalize(), to_eye).luminance() * panel;
    let expected = mirrored + of_lamp + of_panel;
    // 1 % for the directions of the panel's light, which are not all the one put in here.
    let seen = estimates[0][0];
    let near = (seen.mean - expected).abs() < 4.0 * seen.standard_error + 0.01 * expected;
    assert!(near && seen.relative_error() < 0.006, "{estimates:?} against {expected}");
}

#[test]
fn trajectories_that_never_end_are_lost_and_told() {
    let job = "[run]\nbatches = 1\nhistories_per_batch = 1\nsampling = \"random\"\n".to_owned()
        + &omni([0.5, 0.4, 0.6], 100.0)
        + &point("e", [0.5, 0.0, 0.5], [0.0, 1.0, 0.0]);
    let (_, batches) = Case::new(&job, closed_box(DVec3::ONE, &lambert(1.0, 0.0))).batches(1..2);
    assert_eq!(flux(&batches, "lost").mean, flux(&batches, "emitted").mean);
}
