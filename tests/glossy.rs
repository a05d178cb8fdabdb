//! Double local estimation with lobes at both ends: order by order against an independent backward path tracer that
//! shares only geometry and reflectance; with Lambert and with a glossy receiver in a white furnace.

mod common;

use common::scenes::{add_quad, closed_box, lambert, omni, point, spot_camera};
use common::{Case, Estimate, assert_all, compare, difference};
use lampyris::geometry::Ray;
use lampyris::math::{DVec3, PI, to_world};
use lampyris::photometry::Colour;
use lampyris::random::{Domain, Generator, Stream, cosine_hemisphere, sphere};
use lampyris::scene::{Model, Reflectance, Scene, Surface};
use lampyris::transport::connection::{Connectors, Link, Rule, TILE, Tile, connect};
use lampyris::transport::receiver::{Receiver, Response};
use lampyris::transport::trajectory::{Vertex, trace};

fn glossy(emission: f64) -> Surface {
    Surface {
        name: "glossy".into(),
        reflectance: Reflectance::metallic_roughness(Colour::grey(0.7), 0.4, 0.6),
        double_sided: false,
        emission: Colour::grey(emission),
    }
}

/// A closed unit cube with glossy walls; only the ceiling emits.
fn glossy_cube() -> Model {
    let mut model = closed_box(DVec3::ONE, &glossy(0.0));
    // closed_box adds the wall at y = 1 as its fourth quad.
    model.surfaces[3] = glossy(1.0);
    model
}

/// Luminance along `ray` of light reflected exactly n times, n = 1 .. `totals.len()`: one backward path, which
/// counts the emission that it meets after each reflection.
fn backward(scene: &Scene, mut ray: Ray, rng: &mut Generator, totals: &mut [f64]) {
    let mut weight = 1.0;
    let Some(mut hit) = scene.geometry.closest_hit(&ray) else { return };
    for total in totals {
        // Reciprocity: the lobe around the direction of the eye path is the lobe of the light that goes back along it.
        let law = &scene.surface(hit.primitive).reflectance;
        let Some(next) = law.sample(hit.normal, ray.direction, rng) else { return };
        weight *= next.factor.luminance();
        ray = Ray { origin: scene.geometry.lift(hit.position, hit.normal), direction: next.direction };
        let Some(met) = scene.geometry.closest_hit(&ray) else { return };
        hit = met;
        *total += weight * scene.surface(hit.primitive).emission.luminance();
    }
}

fn backward_estimates(scene: &Scene, eye: DVec3, target: DVec3, orders: usize) -> Vec<Estimate> {
    const BATCHES: u64 = 64;
    const PATHS: u64 = 8192;
    let stream = Stream::new(41, Domain::Receiver, "backward");
    let direction = (target - eye).normalize();
    let scores: Vec<Vec<f64>> = (0..BATCHES)
        .map(|batch| {
            let mut totals = vec![0.0; orders];
            let mut rng = stream.generator(batch);
            (0..PATHS).for_each(|_| backward(scene, Ray { origin: eye, direction }, &mut rng, &mut totals));
            totals.iter().map(|t| t / PATHS as f64).collect()
        })
        .collect();
    (0..orders).map(|n| Estimate::from_scores(scores.iter().map(|s| s[n]))).collect()
}

#[test]
fn orders_agree_with_a_backward_path_tracer() {
    let eyes = [[0.35, 0.9, 0.45], [0.8, 0.5, 0.45], [0.5, 0.2, 0.9]];
    let target = [0.35, 0.0, 0.45];
    let mut job = "[run]\nhistories_per_batch = 8192\nbatches = 64\nseed = 42\n".to_owned();
    for (i, eye) in eyes.iter().enumerate() {
        job += &spot_camera(&format!("c{i}"), *eye, target, [0.1, 0.2, 1.0]);
    }
    let case = Case::new(&job, glossy_cube());
    let direct = case.estimates_of_orders(0..0);
    let place = |p: [f64; 3]| case.scene.place(p);
    let references: Vec<_> =
        eyes.iter().map(|&eye| backward_estimates(&case.scene, place(eye), place(target), 4)).collect();
    let mut all = Vec::new();
    for (i, reference) in references.iter().enumerate() {
        all.push(difference(format!("eye {i}: K L0"), direct[i][0], reference[0]));
    }
    for order in 2..=4u32 {
        // K^n L0 comes from vertex x_(n-1); the direct part is in every score.
        let estimates = case.estimates_of_orders(order - 1..order);
        for (i, reference) in references.iter().enumerate() {
            let reflected = estimates[i][0].shifted(-direct[i][0].mean);
            all.push(difference(format!("eye {i}: K^{order} L0"), reflected, reference[order as usize - 1]));
        }
    }
    assert_all(&all);
}

#[test]
fn lambert_receiver_is_rho_over_pi_times_the_lux_meter() {
    let run = "[run]\nhistories_per_batch = 64\nbatches = 16\n[transport]\nbounded = false\n";
    let job = run.to_owned()
        + &spot_camera("l", [0.4, 0.9, 0.4], [0.4, 0.0, 0.4], [1.0, 0.0, 0.0])
        + &point("e", [0.4, 0.0, 0.4], [0.0, 1.0, 0.0]);
    let case = Case::new(&job, glossy_cube_with_lambert_floor());
    let (_, batches) = case.batches(0..u32::MAX);
    for batch in &batches {
        let indirect = |set: usize| batch.sets[set].value[0] - batch.sets[set].direct[0];
        let ratio = indirect(0) / (0.37 / PI * indirect(1));
        // The pixel is not quite a point: 1.6e-4 m wide.
        assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
    }
    let point = Receiver { position: DVec3::new(-0.1, -0.5, -0.1), normal: DVec3::Y, response: Response::Cosine };
    assert_same_point_is_exact(&case, point);
}

fn glossy_cube_with_lambert_floor() -> Model {
    let mut model = glossy_cube();
    // The floor is the third quad.
    model.surfaces[2] = lambert(0.37, 0.0);
    model
}

/// At one and the same point the two responses differ by exactly rho / pi.
fn assert_same_point_is_exact(case: &Case, meter: Receiver) {
    let down = Ray { origin: meter.position + 0.1 * DVec3::Y, direction: DVec3::NEG_Y };
    let floor = case.scene.geometry.closest_hit(&down).unwrap();
    let to_eye = DVec3::new(0.3, 0.8, 0.1).normalize();
    let response =
        Response::reflectance(&case.scene, (floor.primitive, floor.position, floor.normal), to_eye, Colour::WHITE, 0.0);
    let histories = histories(case, 256);
    let connected = common::connect(&case.scene, &histories, f64::INFINITY, &[meter, Receiver { response, ..meter }]);
    let (e, l) = (connected[0].sum.luminance(), connected[1].sum.luminance());
    assert!(e > 0.0 && (l / (0.37 / PI * e) - 1.0).abs() < 1e-14, "{l} and {e}");
}

fn histories(case: &Case, count: u64) -> Connectors {
    let stream = Stream::new(43, Domain::Trajectory, "");
    let mut connectors = Connectors::default();
    for history in 0..count {
        let mut vertices = Vec::new();
        trace(&case.scene, &case.job.transport, &mut stream.generator(history), &mut vertices);
        connectors.push(&case.scene, &vertices);
    }
    connectors
}

/// Directional albedo of `law` towards `to_eye`, by quadrature: the integral of f(w -> to_eye) cos over arriving
/// directions.
fn albedo(law: &Reflectance, to_eye: DVec3) -> f64 {
    const SIDE: u32 = 1500;
    let cells = (0..SIDE).flat_map(|i| (0..SIDE).map(move |j| (i, j)));
    let value = |(i, j): (u32, u32)| {
        let u = lampyris::math::DVec2::new(f64::from(i) + 0.5, f64::from(j) + 0.5) / f64::from(SIDE);
        let arriving = -to_world(DVec3::Y, cosine_hemisphere(u));
        PI * law.evaluate(DVec3::Y, arriving, to_eye).luminance()
    };
    cells.map(value).sum::<f64>() / f64::from(SIDE * SIDE)
}

#[test]
fn glossy_receiver_in_a_white_furnace() {
    // A virtual patch of glossy law in a furnace of Lambert walls (exitance 1, reflectance 1/2):
    // DLE = a(l) rho M0 / (pi (1 - rho)). The patch hangs outside and is never hit; its law is sensed inside.
    let mut model = closed_box(DVec3::ONE, &lambert(0.5, 1.0 / PI));
    let law = Reflectance::metallic_roughness(Colour::grey(0.8), 0.5, 0.45);
    add_quad(&mut model, DVec3::Y * 5.0, DVec3::Z, DVec3::X, Surface { reflectance: law.clone(), ..lambert(0.0, 0.0) });
    let case = Case::new(&point("unused", [0.5; 3], [0.0, 1.0, 0.0]), model);
    let patch = case.scene.place([0.5, 6.0, 0.5]);
    let primitive = case.scene.geometry.closest_hit(&Ray { origin: patch, direction: DVec3::NEG_Y }).unwrap().primitive;
    let directions = [DVec3::Y, DVec3::new(0.6, 0.8, 0.0), DVec3::new(0.3, 0.25, -0.9).normalize()];
    let receiver = |&to_eye: &DVec3| Receiver {
        position: case.scene.place([0.35, 0.0, 0.45]),
        normal: DVec3::Y,
        response: Response::reflectance(&case.scene, (primitive, patch, DVec3::Y), to_eye, Colour::WHITE, 0.0),
    };
    let receivers: Vec<Receiver> = directions.iter().map(receiver).collect();
    let stream = Stream::new(44, Domain::Trajectory, "");
    let (batches, count) = (32u64, 16384u64);
    let batch = |index: u64| {
        let mut connectors = Connectors::default();
        for history in index * count..(index + 1) * count {
            let mut vertices = Vec::new();
            trace(&case.scene, &case.job.transport, &mut stream.generator(history), &mut vertices);
            connectors.push(&case.scene, &vertices);
        }
        let connected = common::connect(&case.scene, &connectors, f64::INFINITY, &receivers);
        connected.iter().map(|c| c.sum.luminance() / count as f64).collect::<Vec<_>>()
    };
    let scores: Vec<Vec<f64>> = (0..batches).map(batch).collect();
    let all = directions.iter().enumerate().map(|(i, &to_eye)| {
        let exact = albedo(&law, to_eye) / PI;
        compare(format!("direction {i}"), Estimate::from_scores(scores.iter().map(|s| s[i])), exact)
    });
    assert_all(&all.collect::<Vec<_>>());
}

#[test]
fn connections_in_lanes_are_those_of_single_pairs() {
    // Walls of four laws: peaked metal, plastic, a mirror over a matt ground, and matt.
    let laws = [(1.0, 0.2), (0.0, 0.5), (0.0, 0.0), (0.0, 1.0), (0.4, 0.6), (1.0, 0.7)];
    let mut model = closed_box(DVec3::ONE, &lambert(0.5, 0.0));
    for (surface, (metallic, roughness)) in model.surfaces.iter_mut().zip(laws) {
        surface.reflectance = Reflectance::metallic_roughness(Colour([0.7, 0.5, 0.2]), metallic, roughness);
    }
    let job =
        "[run]\nchannels = \"rgb\"\n".to_owned() + &omni([0.5, 0.6, 0.4], 1.0) + &point("p", [0.5; 3], [0.0, 1.0, 0.0]);
    let case = Case::new(&job, model);
    let scene = &case.scene;
    let mut rng = Stream::new(3, Domain::Receiver, "pairs").generator(0);
    let (mut vertices, mut receivers) = (Vec::<Vertex>::new(), Vec::new());
    for i in 0..TILE {
        let origin = scene.place([0.3, 0.4, 0.55]);
        let hit = scene.geometry.closest_hit(&Ray { origin, direction: sphere(rng.uniform2()) }).expect("a wall");
        let to_eye = to_world(hit.normal, cosine_hemisphere(rng.uniform2()));
        let attenuation = Colour([1.0, 0.5, 0.25]);
        let carried = [0.0, 0.3, 2.0][i % 3];
        let response =
            Response::reflectance(scene, (hit.primitive, hit.position, hit.normal), to_eye, attenuation, carried);
        receivers.push(Receiver { position: hit.position.as_vec3().as_dvec3(), normal: hit.normal, response });
        trace(scene, &case.job.transport, &mut rng, &mut vertices);
    }
    for vertex in &mut vertices {
        vertex.position = vertex.position.as_vec3().as_dvec3();
    }
    vertices.truncate(64);
    for bound in [0.7, f64::INFINITY] {
        for vertex in &vertices {
            let mut histories = Connectors::default();
            histories.push(scene, &[*vertex]);
            let link = |(owner, &receiver)| Link { owner, receiver, start: Colour::BLACK, watched: false };
            let tile = Tile::new(scene, (0..).zip(&receivers).map(link).collect(), 0);
            let connected = connect(scene, &histories, 0..1, &tile, &Rule { bound, channels: 3, orders: 0..u32::MAX });
            for (receiver, connected) in receivers.iter().zip(connected) {
                let expected = pair(scene, vertex, receiver, bound);
                for (one, other) in connected.sum.0.into_iter().zip(expected.0) {
                    assert!((one - other).abs() <= 1e-4 * other + 1e-9, "{one} {other}: {vertex:?} {receiver:?}");
                }
            }
        }
    }
}

/// The light that `vertex` sends to `receiver` in an empty convex room, up to the bound, in f64.
fn pair(scene: &Scene, vertex: &Vertex, receiver: &Receiver, bound: f64) -> Colour {
    let to = receiver.position - vertex.position;
    let (w, squared) = (to.normalize(), to.length_squared());
    let factor = vertex.normal.dot(w).max(0.0) * (-receiver.normal.dot(w)).max(0.0) / squared;
    if factor <= 1e-12 {
        return Colour::BLACK;
    }
    let reflectance = &scene.surface(vertex.primitive).reflectance;
    let f = reflectance.evaluate(vertex.normal, vertex.w_in, w);
    let (response, peak) = receiver.response.with_peak(scene, receiver.normal, w);
    let bound = if vertex.after_delta { f64::INFINITY } else { bound };
    vertex.weight * f * response * factor.min(bound / (peak * reflectance.peak(f)))
}
