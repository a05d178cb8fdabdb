//! Containers, transforms, triangles.

use serde_json::json;

use crate::{Builder, CORNERS, SQUARE, good, load, sample, warns};
use lampyris::math::DVec3;
use lampyris::scene::{Model, gltf};

/// The corners of triangle `i`.
fn triangle(model: &Model, i: usize) -> [DVec3; 3] {
    model.triangles[i].map(|corner| model.positions[corner as usize])
}

/// Twice the area times the front normal of triangle `i`.
fn normal(model: &Model, i: usize) -> DVec3 {
    let [a, b, c] = triangle(model, i);
    (b - a).cross(c - a)
}

#[test]
fn glb_gltf_with_bin_and_data_uri_are_the_same_scene() {
    let builder = sample();
    let glb = good(&builder);
    let embedded = load(&builder.embedded()).unwrap();
    let mut asked = Vec::new();
    let beside = gltf::load("scene.gltf", &builder.text(Some("data/the%20room.bin")), &mut |uri| {
        asked.push(uri.to_owned());
        Ok(builder.binary.clone())
    });
    assert_eq!(asked, ["data/the room.bin"]);
    for other in [embedded, beside.unwrap()] {
        assert_eq!((&other.positions, &other.triangles), (&glb.positions, &glb.triangles));
        assert_eq!((other.lights, other.warnings), (glb.lights.clone(), glb.warnings.clone()));
    }
    assert_eq!((glb.triangles.len(), glb.positions.len(), glb.surface_of.as_slice()), (2, 4, &[0, 0][..]));
}

#[test]
fn nested_non_uniform_scales_and_rotations_compose() {
    let mut builder = Builder::new();
    let mesh = builder.mesh(&SQUARE, Some(&CORNERS));
    let half = 0.5f64.sqrt();
    builder.node(json!({ "children": [1], "scale": [1.0, 3.0, 5.0], "translation": [10.0, 0.0, 0.0] }));
    // A quarter turn about Z: x -> y, y -> -x; then a column-major matrix that scales x by 2 and moves by 1 in z.
    builder.node(json!({ "children": [2], "rotation": [0.0, 0.0, half, half] }));
    let matrix = [2.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0];
    builder.node(json!({ "mesh": mesh, "matrix": matrix }));
    let model = good(&builder);
    let expected = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [0.0, 1.0, 0.0]]
        .map(|[x, y, z]: [f64; 3]| DVec3::new(10.0 - y, 3.0 * x, 5.0 * (z + 1.0)));
    for (found, wanted) in model.positions.iter().zip(expected) {
        assert!((*found - wanted).length() < 1e-14, "{found} is not {wanted}");
    }
    assert!(normal(&model, 0).z > 0.0);
}

#[test]
fn instances_are_baked_and_mirroring_keeps_the_front() {
    let mut builder = Builder::new();
    let mesh = builder.mesh(&SQUARE, Some(&CORNERS));
    builder.node(json!({ "mesh": mesh }));
    builder.node(json!({ "mesh": mesh, "scale": [-1.0, 1.0, 1.0], "translation": [0.0, 0.0, 2.0] }));
    builder.node(json!({ "mesh": mesh, "scale": [-1.0, -1.0, 1.0] }));
    let model = good(&builder);
    assert_eq!((model.triangles.len(), model.positions.len()), (6, 12));
    for i in 0..6 {
        assert_eq!(normal(&model, i), DVec3::Z, "triangle {i}");
    }
    assert_eq!(model.surfaces.len(), 1);
}

#[test]
fn a_triangle_mirrored_in_z_faces_the_other_way() {
    let mut builder = Builder::new();
    let mesh = builder.mesh(&SQUARE, Some(&CORNERS));
    builder.node(json!({ "mesh": mesh, "scale": [1.0, 1.0, -1.0] }));
    assert_eq!(normal(&good(&builder), 0), DVec3::NEG_Z);
}

#[test]
fn plain_triangles_strips_and_fans() {
    let outline = [SQUARE[0], SQUARE[1], SQUARE[3], SQUARE[2]];
    for (mode, positions) in [(5, outline), (6, SQUARE)] {
        let mut builder = Builder::new();
        let mesh = builder.mesh(&positions, None);
        builder.json["meshes"][mesh]["primitives"][0]["mode"] = json!(mode);
        builder.node(json!({ "mesh": mesh }));
        let model = good(&builder);
        assert_eq!(model.triangles.len(), 2, "mode {mode}");
        assert!((0..2).all(|i| normal(&model, i) == DVec3::Z), "mode {mode}");
    }
    let mut builder = Builder::new();
    let mesh = builder.mesh(&SQUARE[..3], None);
    builder.node(json!({ "mesh": mesh }));
    assert_eq!(good(&builder).triangles, [[0, 1, 2]]);
}

#[test]
fn triangles_without_area_and_unused_vertices_are_dropped() {
    let mut builder = Builder::new();
    let far = [[9.0, 9.0, 9.0], SQUARE[0], SQUARE[1], SQUARE[2], [0.5, 0.0, 0.0]];
    let mesh = builder.mesh(&far, Some(&[1, 2, 3, 1, 1, 2, 1, 4, 2]));
    builder.node(json!({ "mesh": mesh }));
    let model = good(&builder);
    assert_eq!((model.triangles.as_slice(), model.positions.len()), (&[[0, 1, 2]][..], 3));
    assert!(warns(&model, "2 triangles without area were dropped"));
}

#[test]
fn vertices_that_coincide_in_the_file_coincide_bit_for_bit() {
    let mut builder = Builder::new();
    let corner = [0.1, 0.7, 0.3];
    let mesh = builder.mesh(&[corner, SQUARE[1], SQUARE[2], SQUARE[3], corner, SQUARE[2]], None);
    builder.node(json!({ "mesh": mesh, "rotation": [0.1, 0.2, 0.3, 0.927_361_849_5], "scale": [0.3, 1.7, 2.9] }));
    let model = good(&builder);
    assert_eq!(model.positions[0].to_array().map(f64::to_bits), model.positions[4].to_array().map(f64::to_bits));
}

#[test]
fn strided_offset_and_quantized_positions_are_read() {
    let mut builder = Builder::new();
    let bytes: Vec<u8> = [[0i16, 0], [i16::MAX, 0], [0, i16::MAX]]
        .iter()
        .flat_map(|[x, y]| [*x, *y, 0, 77].map(i16::to_le_bytes).concat())
        .collect();
    let view = builder.view(&[&[0; 8], bytes.as_slice()].concat());
    builder.json["bufferViews"][view]["byteStride"] = json!(8);
    let position = json!({ "bufferView": view, "byteOffset": 8, "componentType": 5122, "normalized": true, "count": 3,
        "type": "VEC3" });
    builder.push("/accessors", position);
    builder.push("/meshes", json!({ "primitives": [{ "attributes": { "POSITION": 0 } }] }));
    builder.node(json!({ "mesh": 0 }));
    builder.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    assert_eq!(good(&builder).positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
}

#[test]
fn the_default_scene_else_the_first_else_every_root_is_shown() {
    let mut builder = Builder::new();
    let mesh = builder.mesh(&SQUARE, Some(&CORNERS));
    for x in 0..3 {
        builder.node(json!({ "mesh": mesh, "translation": [x as f64, 0.0, 0.0] }));
    }
    let first_x = |builder: &Builder| good(builder).positions.iter().map(|p| p.x).collect::<Vec<_>>()[0];
    assert_eq!(good(&builder).triangles.len(), 6);
    builder.json["scenes"] = json!([{ "nodes": [1] }, { "nodes": [2] }]);
    assert_eq!(first_x(&builder), 1.0);
    builder.json["scene"] = json!(1);
    assert_eq!(first_x(&builder), 2.0);
}

#[test]
fn a_chain_of_a_hundred_thousand_nodes_is_walked() {
    let mut builder = Builder::new();
    let mesh = builder.mesh(&SQUARE, Some(&CORNERS));
    let last = 100_000;
    for i in 0..last {
        builder.node(json!({ "children": [i + 1], "translation": [0.5, 0.0, 0.0] }));
    }
    builder.node(json!({ "mesh": mesh }));
    assert_eq!(good(&builder).positions[0].x, 50_000.0);
}

#[test]
fn what_is_ignored_is_listed() {
    let mut builder = sample();
    builder.json["extensionsUsed"] = json!(["KHR_lights_punctual", "KHR_materials_clearcoat", "VENDOR_thing"]);
    builder.json["animations"] = json!([{}]);
    let primitive = &mut builder.json["meshes"][0]["primitives"][0];
    primitive["targets"] = json!([{ "POSITION": 0 }]);
    for name in ["NORMAL", "COLOR_1"] {
        primitive["attributes"][name] = json!(0);
    }
    builder.set("/nodes/1/skin", json!(0));
    let lines = json!({ "attributes": { "POSITION": 0 }, "mode": 1 });
    builder.push("/meshes/0/primitives", lines);
    let model = good(&builder);
    for text in [
        "KHR_materials_clearcoat is ignored: no clear coat",
        "VENDOR_thing is ignored",
        "animations",
        "morph targets",
        "interpolated normals are not used",
        "vertex colours beyond COLOR_0",
        "nodes[1]: its skin",
        "points and lines",
    ] {
        assert!(warns(&model, text), "{text} is not in {:?}", model.warnings);
    }
    assert!(!warns(&model, "KHR_lights_punctual"));
}

/// Bytes of floats.
fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

#[test]
fn instances_stand_where_their_own_nodes_would() {
    let mut nodes = Builder::new();
    let mesh = nodes.mesh(&SQUARE, Some(&CORNERS));
    nodes.node(json!({ "children": [1, 2], "translation": [0.0, 5.0, 0.0], "scale": [2.0, 1.0, 1.0] }));
    let half = std::f32::consts::FRAC_1_SQRT_2;
    nodes.node(json!({ "mesh": mesh, "translation": [1.0, 2.0, 3.0], "rotation": [half, 0.0, 0.0, half], "scale": [1.0, 1.0, 4.0] }));
    nodes.node(json!({ "mesh": mesh, "translation": [-4.0, 0.5, 0.0], "scale": [-1.0, 1.0, 1.0] }));
    nodes.json["scenes"] = json!([{ "nodes": [0] }]);

    let mut instanced = Builder::new();
    let mesh = instanced.mesh(&SQUARE, Some(&CORNERS));
    let translation = instanced.accessor(&floats(&[1.0, 2.0, 3.0, -4.0, 0.5, 0.0]), 5126, 2, "VEC3");
    let rotation = instanced.accessor(&floats(&[half, 0.0, 0.0, half, 0.0, 0.0, 0.0, 1.0]), 5126, 2, "VEC4");
    let scale = instanced.accessor(&floats(&[1.0, 1.0, 4.0, -1.0, 1.0, 1.0]), 5126, 2, "VEC3");
    let attributes = json!({ "TRANSLATION": translation, "ROTATION": rotation, "SCALE": scale });
    let extensions = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    instanced.node(
        json!({ "mesh": mesh, "translation": [0.0, 5.0, 0.0], "scale": [2.0, 1.0, 1.0], "extensions": extensions }),
    );
    instanced.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);

    let (one, other) = (good(&nodes), good(&instanced));
    assert_eq!(one.triangles.len(), 4);
    assert_eq!((&one.positions, &one.triangles), (&other.positions, &other.triangles));
}

#[test]
fn instances_that_do_not_fit_are_refused() {
    let with = |attributes: &dyn Fn(&mut Builder) -> serde_json::Value| {
        let mut builder = Builder::new();
        let mesh = builder.mesh(&SQUARE, Some(&CORNERS));
        let attributes = attributes(&mut builder);
        let extensions = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
        builder.node(json!({ "mesh": mesh, "extensions": extensions }));
        crate::refusal(crate::load(&builder.glb()))
    };
    let (field, ..) = with(&|_| json!({}));
    assert_eq!(field, "nodes[0].extensions.EXT_mesh_gpu_instancing.attributes");
    let (_, value, _) = with(&|b| {
        let one = b.accessor(&floats(&[0.0; 3]), 5126, 1, "VEC3");
        let two = b.accessor(&floats(&[1.0; 6]), 5126, 2, "VEC3");
        json!({ "TRANSLATION": one, "SCALE": two })
    });
    assert_eq!(value, "1 and 2 instances");
    let (field, ..) = with(&|b| json!({ "ROTATION": b.accessor(&floats(&[0.0; 4]), 5126, 1, "VEC4") }));
    assert!(field.ends_with("ROTATION, element 0"), "{field}");
    // Twelve bytes may claim no more instances than they hold, and no more of a mesh than a scene may have.
    let (field, ..) = with(&|b| json!({ "TRANSLATION": b.accessor(&floats(&[0.0; 3]), 5126, 1 << 30, "VEC3") }));
    assert!(field.ends_with(".count"), "{field}");
}

#[test]
fn quantized_positions_are_those_that_they_stand_for() {
    let plain = {
        let mut builder = Builder::new();
        let mesh = builder.mesh(&SQUARE, Some(&CORNERS));
        builder.node(json!({ "mesh": mesh }));
        good(&builder)
    };
    // Signed 16-bit normalized, each on a multiple of four bytes; and unsigned bytes as they are, which the node scales back.
    for (component, normalized, full, stride) in [(5122, true, 32767.0, 8), (5121, false, 200.0, 4)] {
        let mut builder = Builder::new();
        let mesh = builder.mesh(&SQUARE, Some(&CORNERS));
        let mut bytes = Vec::new();
        for corner in SQUARE {
            let start = bytes.len();
            for x in corner.map(|x| f64::from(x) * full) {
                match component {
                    5122 => bytes.extend((x as i16).to_le_bytes()),
                    _ => bytes.push(x as u8),
                }
            }
            bytes.resize(start + stride, 0);
        }
        let accessor = builder.accessor(&bytes, component, 4, "VEC3");
        builder.json["accessors"][accessor]["normalized"] = json!(normalized);
        let view = builder.json["accessors"][accessor]["bufferView"].as_u64().unwrap() as usize;
        builder.json["bufferViews"][view]["byteStride"] = json!(stride);
        builder.json["meshes"][mesh]["primitives"][0]["attributes"]["POSITION"] = json!(accessor);
        builder.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        let scale = if normalized { 1.0 } else { 1.0 / full };
        builder.node(json!({ "mesh": mesh, "scale": [scale, scale, scale] }));
        let quantized = good(&builder);
        assert_eq!((&plain.positions, &plain.triangles), (&quantized.positions, &quantized.triangles));
    }
}
