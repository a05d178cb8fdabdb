use super::*;
use crate::job::Job;
use crate::photometry::Colour;
use crate::random::{Domain, Stream, sphere};
use crate::validate::scenes::{closed_box, lambert, point};

const THINNING: usize = 8;

fn scene() -> Scene {
    let job =
        Job::parse(&format!("scene = \"box.glb\"\n{}", point("meter", [0.5; 3], [0.0, 1.0, 0.0])), "test").unwrap();
    Scene::new(closed_box(DVec3::ONE, &lambert(0.5, 1.0)), &job).unwrap()
}

/// Vertices strewn over walls in a unit box about the origin, of all weights.
fn strewn(count: usize) -> Vec<Vertex> {
    let mut rng = Stream::new(3, Domain::Trajectory, "strewn").generator(0);
    let mut vertex = |_| {
        let normal = DVec3::AXES[rng.below(3) as usize];
        let position = (DVec3::ONE - normal) * DVec3::new(rng.uniform(), rng.uniform(), rng.uniform()) - 0.5;
        let weight = Colour([rng.uniform(), rng.uniform(), 100.0 * rng.uniform()]);
        let towards = sphere(rng.uniform2());
        let w_in = if towards.dot(normal) < 0.0 { towards } else { -towards };
        Vertex { position, normal, w_in, weight, primitive: rng.below(12), order: 1, after_delta: false, emphasis: 1.0 }
    };
    (0..count).map(&mut vertex).collect()
}

/// What is chosen from `vertices` with start number `index`.
fn choose(scene: &Scene, vertices: &[Vertex], index: u64) -> Vec<Vertex> {
    let mut thinning =
        Thinning::new(scene, (THINNING as u64, 1), Stream::new(5, Domain::Thinning, "").generator(index));
    thinning.take(vertices.iter().copied());
    thinning.choose();
    thinning.chosen
}

#[test]
fn what_is_chosen_reflects_the_flux_of_all() {
    let (scene, vertices) = (scene(), strewn(1001));
    let all: f64 = vertices.iter().map(|v| reflected(&scene, v)).sum();
    for index in 0..50 {
        let chosen = choose(&scene, &vertices, index);
        assert_eq!(chosen.len(), 1001usize.div_ceil(THINNING));
        let some: f64 = chosen.iter().map(|v| reflected(&scene, v)).sum();
        assert!((some * THINNING as f64 / all - 1.0).abs() < 1e-12, "start {index}: {some} for {all}");
    }
}

#[test]
fn every_vertex_counts_with_its_own_weight_on_average() {
    const STARTS: u64 = 20_000;
    let (scene, vertices) = (scene(), strewn(100));
    let mut found = vec![0.0; vertices.len()];
    for index in 0..STARTS {
        for v in choose(&scene, &vertices, index) {
            let place = vertices.iter().position(|w| w.position == v.position).unwrap();
            found[place] += v.weight.0[2] * THINNING as f64 / STARTS as f64;
        }
    }
    let all: f64 = vertices.iter().map(|v| reflected(&scene, v)).sum();
    let step = all / 100usize.div_ceil(THINNING) as f64;
    let mut worst = 0.0;
    for (v, found) in vertices.iter().zip(found) {
        // Chosen with probability p, or not: the error of a share.
        let p = reflected(&scene, v) / step;
        assert!(p < 1.0, "a case without vertices that are always chosen");
        let z = (found / v.weight.0[2] - 1.0) / ((1.0 - p) / (p * STARTS as f64)).sqrt();
        worst = f64::max(worst, z.abs());
    }
    assert!(worst < 4.5, "|z| {worst} of 100 vertices");
}

#[test]
fn a_vertex_with_more_than_its_share_is_chosen_again_and_again() {
    let (scene, mut vertices) = (scene(), strewn(80));
    vertices[17].weight = Colour::grey(1e6);
    let chosen = choose(&scene, &vertices, 0);
    let heavy = chosen.iter().filter(|v| v.position == vertices[17].position).count();
    assert!(heavy >= 9, "{heavy} of {}", chosen.len());
    let largest = chosen.iter().map(|v| reflected(&scene, v)).fold(0.0, f64::max);
    let share = chosen.iter().map(|v| reflected(&scene, v)).sum::<f64>() / chosen.len() as f64;
    assert!(largest < share * (1.0 + 1e-9), "no choice weighs more than another");
}

#[test]
fn neighbours_stand_for_each_other() {
    // Of vertices that lie evenly on a wall, those chosen do so too: each quarter of the wall gets its quarter.
    let scene = scene();
    let at = |i: usize| DVec3::new((i % 64) as f64 / 63.0, 0.0, (i / 64) as f64 / 63.0) - 0.5;
    let vertex =
        |i| Vertex { position: at(i), normal: DVec3::Y, w_in: -DVec3::Y, weight: Colour::WHITE, ..strewn(1)[0] };
    let vertices: Vec<Vertex> = (0..4096).map(vertex).collect();
    for index in 0..20 {
        let chosen = choose(&scene, &vertices, index);
        for quarter in 0..4 {
            let inside = |v: &&Vertex| {
                (usize::from(v.position.x > 0.0), usize::from(v.position.z > 0.0)) == (quarter % 2, quarter / 2)
            };
            let count = chosen.iter().filter(inside).count();
            assert!((127..=129).contains(&count), "start {index}: {count} of 512 in quarter {quarter}");
        }
    }
}

#[test]
fn histories_share_what_is_chosen_and_nothing_gives_nothing() {
    let (scene, vertices) = (scene(), strewn(1000));
    let connectors = |vertices: &[Vertex]| {
        let mut thinning =
            Thinning::new(&scene, (THINNING as u64, 1), Stream::new(5, Domain::Thinning, "").generator(0));
        thinning.take(vertices.iter().copied());
        thinning.finish(16).connectors
    };
    let counts = |c: Connectors| (c.histories(), c.vertices());
    assert_eq!(counts(connectors(&vertices)), (16, 125));
    assert_eq!(counts(connectors(&[])), (16, 0));
    // So little light that its share of a choice is no number ends, and is left out.
    let faint = |v: &Vertex| Vertex { weight: Colour([0.0, 0.0, f64::from_bits(1)]), ..*v };
    assert_eq!(counts(connectors(&vertices.iter().map(faint).collect::<Vec<_>>())), (16, 0));
}

#[test]
fn many_vertices_are_chosen_from_in_turn_and_none_is_lost() {
    let scene = scene();
    let vertices = strewn(TOGETHER / 4);
    let mut thinning = Thinning::new(&scene, (THINNING as u64, 1), Stream::new(5, Domain::Thinning, "").generator(0));
    for _ in 0..5 {
        thinning.take(vertices.iter().copied());
    }
    assert!(thinning.waiting.len() < TOGETHER && !thinning.chosen.is_empty());
    thinning.choose();
    let flux = |vertices: &[Vertex]| vertices.iter().map(|v| reflected(&scene, v)).sum::<f64>();
    let (some, all) = (flux(&thinning.chosen) * THINNING as f64, 5.0 * flux(&vertices));
    assert!((some / all - 1.0).abs() < 1e-9, "{some} for {all}");
}
