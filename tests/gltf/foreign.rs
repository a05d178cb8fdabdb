//! Files that other programs wrote (scripts/foreign_gltf): the same scene plain, and with instances and quantized numbers.

use crate::{load, warns};
use lampyris::geometry::Ray;
use lampyris::job::Job;
use lampyris::math::DVec3;
use lampyris::photometry::Colour;
use lampyris::scene::{Model, Scene};

fn model(file: &str) -> Model {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/gltf/foreign/");
    load(&std::fs::read(format!("{folder}{file}")).unwrap()).unwrap_or_else(|error| panic!("{error}"))
}

fn scene(model: Model) -> Scene {
    let job = "scene = \"in memory\"\n[run]\nchannels = \"rgb\"\n[[source]]\nkind = \"omni\"\nposition = [0, 3, 0]\nintensity = 1\n\
               [[point]]\nname = \"p\"\nposition = [0, 1, 0]\nnormal = [0, 1, 0]\n";
    Scene::new(model, &Job::parse(job, "in memory").unwrap()).unwrap()
}

/// What is seen along a ray: where, how much it reflects at 60 degrees, what it emits.
fn seen(scene: &Scene, from: [f64; 3], to: [f64; 3]) -> (DVec3, Colour, Colour) {
    let (from, to) = (scene.place(from), scene.place(to));
    let direction = (to - from).normalize();
    let hit = scene.geometry.closest_hit(&Ray { origin: from, direction }).expect("something is seen");
    let albedo = scene.reflectance(hit.primitive, hit.position).albedo(0.5);
    (hit.position, albedo, scene.emitted(&hit, -direction))
}

#[test]
fn instances_and_quantized_numbers_show_the_same_scene() {
    let (plain, packed) = (model("gltf_transform.glb"), model("gltf_transform_packed.glb"));
    assert_eq!((plain.triangles.len(), packed.triangles.len()), (18, 18));
    assert_eq!(plain.warnings, packed.warnings);
    assert!(plain.warnings.len() == 1 && warns(&plain, "rounded to steps of 1/255"));
    let (plain, packed) = (scene(plain), scene(packed));
    let eye = [2.0, 2.0, 2.6];
    // Tiles, three of the plates, the lamp and the varnished board.
    let targets = [[0.1, 0.0, 0.1], [-1.1, 0.0, 0.4], [-1.0, 0.15, 0.8], [-0.25, 0.15, 0.82], [0.95, 0.15, 0.78]];
    for to in targets.into_iter().chain([[-0.8, 0.7, -0.4], [-0.5, 0.45, -0.4], [0.5, 0.6, -0.8]]) {
        let ((p, a, e), (q, b, f)) = (seen(&plain, eye, to), seen(&packed, eye, to));
        assert!((p - q).length() < 2e-3, "{p} and {q}");
        let difference = |x: Colour, y: Colour| (0..3).map(|i| (x.0[i] - y.0[i]).abs()).fold(0.0, f64::max);
        assert!(difference(a, b) < 5e-3 && difference(e, f) < 1.0, "{to:?}: {a:?} {b:?}, {e:?} {f:?}");
    }
    let (_, _, lit) = seen(&plain, eye, [-0.45, 0.45, -0.4]);
    assert!(lit.0[0] > 100.0, "the lamp shines: {lit:?}");
}

#[test]
fn an_image_stands_upright_on_a_box_that_was_an_obj() {
    let scene = scene(model("obj2gltf.glb"));
    // The front of the box from (-0.4, 0) to (0.4, 0.8): the stroke of the F is in its second column, dark on light.
    let brightness = |x: f64, y: f64| seen(&scene, [x, y, 3.0], [x, y, 0.0]).1.luminance();
    let (stroke, right, foot) = (brightness(-0.25, 0.4), brightness(0.3, 0.4), brightness(-0.25, 0.03));
    let (upper, lower) = (brightness(0.0, 0.65), brightness(0.0, 0.15));
    assert!(stroke < 0.1 && right > 0.3 && foot > 0.3 && upper < 0.1 && lower > 0.3);
}
