//! Meshes of the scene as luminous surfaces; and the luminance of every shape in a picture.

use crate::gltf_builder::Builder;
use crate::openings::{SHAPES, sampled, shown};
use crate::photometry;
use crate::scenes::{IN_BOX, assert_near, boxed_with, luminaire, lux, planned};
use lampyris::farm::realization::Realization;
use lampyris::math::{DVec3, acos, atan2};
use lampyris::random::{Domain, Generator, Stream, sphere};
use lampyris::scene::photometric_web::Photometry;
use lampyris::scene::{Scene, gltf};
use lampyris::transport::direct::from_panels;
use lampyris::transport::receiver::{Receiver, Response};
use lampyris::validate::Experiment;
use lampyris::validate::scenes::spot_camera;
use serde_json::json;

/// Corners of a cube of edge 1 about the origin, and its triangles, counter-clockwise from outside.
const CORNERS: [[f32; 3]; 8] = [
    [-0.5, -0.5, -0.5],
    [0.5, -0.5, -0.5],
    [0.5, 0.5, -0.5],
    [-0.5, 0.5, -0.5],
    [-0.5, -0.5, 0.5],
    [0.5, -0.5, 0.5],
    [0.5, 0.5, 0.5],
    [-0.5, 0.5, 0.5],
];
const CUBE: [u16; 36] =
    [0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4, 3, 6, 2, 3, 7, 6, 0, 4, 7, 0, 7, 3, 1, 2, 6, 1, 6, 5];
/// Corners, triangles, and whether it is flat.
type Mesh<'a> = (&'a [[f32; 3]], &'a [u16], bool);
/// Size of the lamp \[m\].
const SIZE: [f64; 3] = [0.4, 0.1, 0.2];

fn random(name: &str) -> Generator {
    Stream::new(23, Domain::Trajectory, name).generator(0)
}

/// A scene whose node `lamp` has nothing but a child, and that a mesh, turned a quarter about the vertical and 1 m up.
fn with_mesh(corners: &[[f32; 3]], triangles: &[u16]) -> Vec<u8> {
    let mut builder = Builder::new();
    let far = builder.mesh(&[[0.0, 0.0, 0.0], [1e-3, 0.0, 0.0], [0.0, 1e-3, 0.0]], None);
    builder.node(json!({ "name": "far", "mesh": far, "translation": [0.0, -50.0, 0.0] }));
    let mesh = builder.mesh(corners, Some(triangles));
    let half = 0.5f64.sqrt();
    let child = json!({ "mesh": mesh, "rotation": [0.0, half, 0.0, half], "scale": [SIZE[2], SIZE[1], SIZE[0]] });
    let child = builder.node(child);
    builder.node(json!({ "name": "lamp", "children": [child], "translation": [0.0, 1.0, 0.0] }));
    builder.node(json!({ "name": "bare" }));
    builder.glb()
}

/// The job of a luminaire with that mesh.
fn job(more: &str) -> String {
    format!("scene = \"s.glb\"\n{}", luminaire("full.ies", more))
}

fn shining(corners: &[[f32; 3]], triangles: &[u16]) -> Scene {
    planned(&job("mesh = \"lamp\""), &[("s.glb", with_mesh(corners, triangles))]).unwrap_or_else(|e| panic!("{e}")).0
}

/// A closed box around a luminaire that is a box of the scene, askew to the web and so large that paths find it.
pub fn boxed_mesh(web: &Photometry, reflectance: f64, job: &str) -> Experiment {
    let mut builder = Builder::new();
    let mesh = builder.mesh(&CORNERS, Some(&CUBE));
    let (half, size) = (0.5f64.sqrt(), SIZE.map(|length| 3.0 * length));
    let turned = json!([0.3, half, 0.2, (0.5f64 - 0.13).sqrt()]);
    builder.node(json!({ "name": "lamp", "mesh": mesh, "translation": IN_BOX, "rotation": turned, "scale": size }));
    let model = gltf::load("lamp.glb", &builder.glb(), &mut |_| unreachable!("all is in one file")).unwrap();
    boxed_with(model, web, "mesh = \"lamp\"", reflectance, job)
}

/// Intensity of `file` towards `w`, aim down and C0 along +X \[cd\].
fn intensity(file: &str, w: DVec3) -> f64 {
    photometry(file).web.intensity(acos((-w.y).clamp(-1.0, 1.0)), atan2(-w.z, w.x))
}

#[test]
fn a_mesh_shines_with_intensity_over_the_area_it_shows() {
    let mut inside_out = CUBE;
    inside_out.chunks_mut(3).for_each(|t| t.swap(1, 2));
    let sheet = [[-0.5, 0.0, -0.5], [0.5, 0.0, -0.5], [0.5, 0.0, 0.5], [-0.5, 0.0, 0.5]];
    let flat: [u16; 6] = [0, 1, 2, 0, 2, 3];
    let meshes: [Mesh; 3] = [(&CORNERS, &CUBE, false), (&CORNERS, &inside_out, false), (&sheet, &flat, true)];
    for (corners, triangles, is_flat) in meshes {
        let scene = shining(corners, triangles);
        assert_eq!((scene.sources.len(), scene.sources.panels.len()), (1, 1));
        assert_near(scene.sources.flux(), photometry("full.ies").flux(), 1e-12);
        let area = |w: DVec3| {
            let [x, y, z] = SIZE;
            let sides = if is_flat { 0.0 } else { y * z * w.x.abs() + x * y * w.z.abs() };
            x * z * w.y.abs() + sides
        };
        let mut rng = random("eye");
        for _ in 0..20 {
            let w = sphere(rng.uniform2());
            let eye = scene.place([0.0, 1.0, 0.0]) + 3.0 * w + DVec3::splat(1e-3);
            let ray = lampyris::geometry::Ray { origin: eye, direction: -w };
            let seen = lampyris::transport::receiver::look(&scene, &ray, &mut rng).emitted.luminance();
            assert_near(seen, intensity("full.ies", w) / area(w), 1e-5);
        }
    }
}

#[test]
fn far_off_a_mesh_lights_as_a_point_in_its_middle() {
    let scene = shining(&CORNERS, &CUBE);
    let point = planned(&luminaire("full.ies", "position = [0.0, 1.0, 0.0]"), &[]).unwrap().0;
    let mut rng = random("far");
    for position in [[0.0, -14.0, 3.0], [12.0, -8.0, -6.0], [4.0, 18.0, 6.0]] {
        let normal = [-position[0], 1.0 - position[1], -position[2]];
        let receiver = Receiver {
            position: scene.place(position),
            normal: DVec3::from(normal).normalize(),
            response: Response::Cosine,
        };
        let (mean, error) = sampled(1024, || from_panels(&scene, &receiver, 64, &mut rng).luminance());
        let near = of_faces(&scene, &receiver);
        assert!((mean - near).abs() < 5.0 * error + 1e-6 * near, "{mean} +- {error}, not {near}");
        assert!(error < 1e-4 * near, "{error} of {near}");
        // The faces that are seen are up to 10 cm nearer than the middle.
        assert_near(near, lux(&point, position, normal), 3e-3);
    }
}

/// Illuminance by the first luminaire, faces cut into small pieces, where nothing stands between \[lx\].
fn of_faces(scene: &Scene, receiver: &Receiver) -> f64 {
    const PIECES: u32 = 32;
    let panel = &scene.sources.panels[0];
    let places =
        (0..PIECES * PIECES).map(|k| [k / PIECES, k % PIECES].map(|i| (f64::from(i) + 0.5) / f64::from(PIECES)));
    let places: Vec<_> = places.map(lampyris::math::DVec2::from).collect();
    let of = |face: &lampyris::scene::Emitter, place| {
        let way = receiver.position - face.point(place);
        let (w, d2) = (way.normalize(), way.length_squared());
        let cosines = face.normal.dot(w).max(0.0) * (-receiver.normal.dot(w)).max(0.0);
        panel.luminance(w).luminance() * cosines / d2 * face.area / places.len() as f64
    };
    panel.faces.iter().flat_map(|face| places.iter().map(move |&place| of(face, place))).sum()
}

#[test]
fn meshes_that_cannot_shine_are_refused_by_name() {
    let mut dented = CORNERS;
    dented[6] = [0.0, 0.0, 0.0];
    let refused =
        |more: &str, glb: Vec<u8>| planned(&job(more), &[("s.glb", glb)]).map(|_| ()).unwrap_err().to_string();
    let cube = || with_mesh(&CORNERS, &CUBE);
    let both = [0, 1, 2, 0, 2, 1];
    for (more, glb, expected) in [
        ("mesh = \"lantern\"", cube(), "luminaire[0].mesh = lantern: a node of the scene with a surface: far, lamp"),
        ("mesh = \"bare\"", cube(), "luminaire[0].mesh = bare: a node with a mesh of 1 .. 4096 triangles, not of 0"),
        (
            "mesh = \"lamp\"",
            with_mesh(&dented, &CUBE),
            "luminaire[0].mesh = lamp: a mesh that is convex and closed, or flat",
        ),
        (
            "mesh = \"lamp\"",
            with_mesh(&CORNERS, &CUBE[..30]),
            "luminaire[0].mesh = lamp: a mesh that is convex and closed",
        ),
        (
            "mesh = \"lamp\"",
            with_mesh(&CORNERS, &both),
            "luminaire[0].mesh = lamp: a flat mesh whose faces all look the same",
        ),
        ("mesh = \"lamp\"\nextent = \"opening\"", cube(), "luminaire[0].extent = opening: left out beside a mesh"),
        ("mesh = \"lamp\"\nextent = \"point\"", cube(), "luminaire[0].extent = point: left out beside a mesh"),
    ] {
        let error = refused(more, glb);
        assert!(error.contains(expected), "{expected}: {error}");
    }
    let error = planned(&luminaire("full.ies", "mesh = \"lamp\""), &[]).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("luminaire[0].mesh = lamp: a mesh only with a scene"), "{error}");
}

#[test]
fn two_luminaires_take_two_meshes() {
    let glb = with_mesh(&CORNERS, &CUBE);
    let two = format!(
        "scene = \"s.glb\"\n{}{}",
        luminaire("full.ies", "mesh = \"far\""),
        luminaire("full.ies", "mesh = \"lamp\"")
    );
    let scene = planned(&two, &[("s.glb", glb)]).unwrap_or_else(|e| panic!("{e}")).0;
    let faces: Vec<usize> = scene.sources.panels.iter().map(|panel| panel.faces.len()).collect();
    assert_eq!((faces, scene.triangles()), (vec![1, 12], 13));
}

#[test]
fn the_picture_of_every_shape_has_intensity_over_shown_area() {
    let mut rng = random("picture");
    let directions: Vec<DVec3> = (0..20).map(|_| sphere(rng.uniform2())).collect();
    let camera = |(i, w): (usize, &DVec3)| {
        // Towards a point near the middle, not on an edge between faces.
        let target = DVec3::new(1e-3, 2e-3, -1e-3);
        spot_camera(&format!("c{i}"), (target + 3.0 * *w).to_array(), target.to_array(), [0.3, 0.5, 0.8])
    };
    let cameras: String = directions.iter().enumerate().map(camera).collect();
    for shape in SHAPES {
        let file = format!("opening_{shape}.ies");
        let run = "[run]\nhistories_per_batch = 1\nbatches = 16\n";
        let entry = luminaire(&file, "position = [0.0, 0.0, 0.0]\nextent = \"opening\"");
        let (scene, plan) = planned(&format!("{run}{cameras}{entry}"), &[]).unwrap_or_else(|e| panic!("{e}"));
        let scores = Realization::new(&plan.job, &scene, &plan.bounds).batch(0);
        let tolerance = match shape {
            "sphere" => 5e-3,
            // A batch looks somewhere in the hundredth of a degree of a pixel, and 1/cos is steep where a flat shape is seen at a slant.
            "rectangle" | "box" => 1e-3,
            _ => 3e-3,
        };
        for (w, set) in directions.iter().zip(&scores.sets) {
            let expected = intensity(&file, *w) / shown(shape, [w.x, -w.z, -w.y]);
            assert_near(set.value[0], expected, tolerance);
        }
    }
}
