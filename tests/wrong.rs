//! Estimators that are wrong on purpose are rejected by the very comparisons that the right one passes.

mod common;

use common::scenes::{add_quad, closed_box, lambert, point, sobolev};
use common::{Case, Comparison, Estimate, compare, failures, number, table, verdict};
use lampyris::geometry::Hit;
use lampyris::math::{DVec3, PI};
use lampyris::random::{Domain, Stream};
use lampyris::scene::{Model, Scene};
use lampyris::transport::connection::Connectors;
use lampyris::transport::receiver::{Receiver, Response};
use lampyris::transport::trajectory::{Vertex, trace};

const HISTORIES: u64 = 8192;
const BATCHES: u64 = 32;

/// Local estimation at `receiver` of the vertices that `change` leaves of each history.
fn estimate(case: &Case, receiver: Receiver, change: impl Fn(&Scene, &mut Vec<Vertex>)) -> Estimate {
    estimate_bounded(case, receiver, f64::INFINITY, change)
}

/// The same with connections bounded by `bound`, and nothing to carry what they leave.
fn estimate_bounded(
    case: &Case,
    receiver: Receiver,
    bound: f64,
    change: impl Fn(&Scene, &mut Vec<Vertex>),
) -> Estimate {
    let stream = Stream::new(31, Domain::Trajectory, "");
    let batch = |index: u64| {
        let mut connectors = Connectors::default();
        for history in index * HISTORIES..(index + 1) * HISTORIES {
            let mut vertices = Vec::new();
            trace(&case.scene, &case.job.transport, &mut stream.generator(history), &mut vertices);
            change(&case.scene, &mut vertices);
            connectors.push(&case.scene, &vertices);
        }
        common::connect(&case.scene, &connectors, bound, &[receiver])[0].sum.luminance() / HISTORIES as f64
    };
    Estimate::from_scores((0..BATCHES).map(batch))
}

fn reflectance(scene: &Scene, vertex: &Vertex) -> f64 {
    scene.surface(vertex.primitive).reflectance.lambert().unwrap().luminance()
}

fn meter(position: DVec3, normal: DVec3) -> Receiver {
    Receiver { position, normal, response: Response::Cosine }
}

/// Indirect illuminance in Sobolev's case A at r = 0.5, with `change` made to the vertices.
fn sobolev_a(roulette: &str, change: impl Fn(&Scene, &mut Vec<Vertex>)) -> Comparison {
    let run = format!("[transport]\nroulette_below = {roulette}\n");
    let toml = sobolev(&run, 0.5, 0.5, 0.5) + &point("unused", [0.0; 3], [0.0, 1.0, 0.0]);
    let case = Case::new(&toml, Model::default());
    let rows = table("sobolev_tables.csv");
    let row = rows.iter().find(|r| r["case"] == "A" && number(r, "r") == 0.5).unwrap();
    let exact = number(row, "E1") - number(row, "E1_direct");
    compare("A r = 0.5", estimate(&case, meter(DVec3::X * 0.5, DVec3::Y), change), exact)
}

#[test]
fn right_estimator_passes() {
    assert!(failures(&[sobolev_a("0.05", |_, _| ())]).is_empty());
    assert!(failures(&[sobolev_a("\"analog\"", |_, _| ())]).is_empty());
}

#[test]
fn reflectance_applied_twice_is_rejected() {
    let twice = |scene: &Scene, vertices: &mut Vec<Vertex>| {
        vertices.iter_mut().for_each(|v| v.weight *= reflectance(scene, v));
    };
    assert!(!failures(&[sobolev_a("0.05", twice)]).is_empty());
}

#[test]
fn survivors_without_their_factor_are_rejected() {
    // Analog absorption keeps the weight because reflectance over survival probability is one; without the division
    // the n-th vertex carries rho^(n-1).
    let undivided = |scene: &Scene, vertices: &mut Vec<Vertex>| {
        let mut share = 1.0;
        for v in vertices {
            v.weight *= share;
            share *= reflectance(scene, v);
        }
    };
    assert!(!failures(&[sobolev_a("\"analog\"", undivided)]).is_empty());
}

/// Illuminance without order 0 in a white furnace of exitance 1 and reflectance 1/2: exactly 1.
fn furnace(change: impl Fn(&Scene, &mut Vec<Vertex>)) -> Comparison {
    let toml = point("unused", [0.0; 3], [0.0, 1.0, 0.0]);
    let case = Case::new(&toml, closed_box(DVec3::ONE, &lambert(0.5, 1.0 / PI)));
    let place = case.scene.place([0.4, 0.0, 0.55]);
    compare("furnace", estimate(&case, meter(place, DVec3::Y), change), 1.0)
}

#[test]
fn source_vertex_scored_is_rejected() {
    assert!(failures(&[furnace(|_, _| ())]).is_empty());
    let scored = |scene: &Scene, vertices: &mut Vec<Vertex>| {
        // The emission point lies where the first ray came from; as a Lambert emitter it would score W / pi.
        let first = vertices[0];
        let back = lampyris::geometry::Ray {
            origin: scene.geometry.lift(first.position, first.normal),
            direction: -first.w_in,
        };
        let Hit { position, normal, primitive, .. } = scene.geometry.closest_hit(&back).unwrap();
        let weight = first.weight / reflectance(scene, &first);
        vertices.insert(
            0,
            Vertex { position, normal, primitive, weight, w_in: -normal, order: 0, after_delta: false, emphasis: 1.0 },
        );
    };
    assert!(!failures(&[furnace(scored)]).is_empty());
}

#[test]
fn area_light_counted_by_hits_is_rejected() {
    let hits = |scene: &Scene, vertices: &mut Vec<Vertex>| {
        // Every wall emits here: a hit on an emitter wrongly sends out its emission once more.
        let emitted = vertices[0].weight;
        for v in vertices.iter_mut() {
            v.weight += emitted / reflectance(scene, v);
        }
    };
    assert!(!failures(&[furnace(hits)]).is_empty());
}

#[test]
fn error_bars_from_histories_inside_a_batch_are_rejected() {
    // One pixel, 0.35 of it on an emitter: what differs from batch to batch are its positions, shared by all
    // histories of the batch. Taking histories for independent shrinks the error bar by the root of their number.
    const SHARE: f64 = 0.35;
    let edge = (1.0 - 2.0 * SHARE) * (1.0f64 / 3.0).sqrt();
    let mut model = Model::default();
    add_quad(&mut model, DVec3::new(edge, -1.0, -1.0), DVec3::X, DVec3::Y * 2.0, lambert(0.0, 1.0));
    let camera = "[[camera]]\nname = \"c\"\neye = [0, 0, 0]\ntarget = [0, 0, -1]\nvertical_fov_degrees = 60\n\
                  width = 1\nheight = 1\npixel_samples = 1\n";
    let run = "[run]\nhistories_per_batch = 256\nbatches = 4096\n";
    let case = Case::new(&format!("{run}{camera}"), model);
    let (_, batches) = case.batches(0..u32::MAX);
    let by_batch = common::estimates(&batches)[0][0];
    let by_history = batches.iter().flat_map(|b| std::iter::repeat_n(b.sets[0].value[0], 256));
    let by_history = Estimate::from_scores(by_history);
    // The right error bar holds; judged by its own error bar alone, the wrong one does not.
    let z = |e: Estimate| (e.mean - SHARE) / e.standard_error;
    assert!(z(by_batch).abs() < 5.0, "{by_batch:?}");
    assert!(z(by_history).abs() > 5.0, "{by_history:?}");
    assert!(verdict(&compare("pixel", by_history, SHARE), 1).is_some());
}

#[test]
fn clamping_without_continuation_is_rejected() {
    // 3 cm from a wall of the furnace, b = 4: a third of the light comes from where G > b, by quadrature over the wall. What
    // the right estimator makes of a bound there is in tests/bounded.rs.
    let case = Case::new(&point("unused", [0.0; 3], [0.0, 1.0, 0.0]), closed_box(DVec3::ONE, &lambert(0.5, 1.0 / PI)));
    let meter = meter(case.scene.place([0.03, 0.0, 0.5]), DVec3::Y);
    let clamped = estimate_bounded(&case, meter, 4.0, |_, _| ());
    assert!((clamped.mean - 0.66).abs() < 0.02, "by quadrature 0.660: {clamped:?}");
    assert!(verdict(&compare("clamped", clamped, 1.0), 1).is_some());
}
