//! Malformed scenes, each refused with the field, the value and what was allowed.

use serde_json::{Value, json};

use crate::{load, refusal, sample};
use lampyris::scene::gltf;

/// Spoils the sample by putting a value at a pointer; what the refusal must say.
type Case = (&'static str, Value, [&'static str; 3]);

/// Asserts each case.
fn check(cases: Vec<Case>) {
    for (pointer, value, [field, shown, allowed]) in cases {
        let mut builder = sample();
        builder.set(pointer, value);
        let found = refusal(load(&builder.glb()));
        assert_eq!(found.0, field, "{found:?}");
        assert!(found.1.contains(shown), "{shown} is not in {found:?}");
        assert!(found.2.contains(allowed), "{allowed} is not in {found:?}");
    }
}

#[test]
fn indices_that_lead_nowhere() {
    check(vec![
        ("/nodes/1/mesh", json!(7), ["nodes[1].mesh", "7", "`meshes`, which has 1"]),
        ("/nodes/1/mesh", json!(4294967296u64), ["nodes[1].mesh", "4294967296", "`meshes`"]),
        ("/nodes/1/mesh", json!(-1), ["nodes[1].mesh", "-1", "a whole number"]),
        ("/nodes/2/camera", json!(3), ["nodes[2].camera", "3", "`cameras`, which has 1"]),
        ("/scene", json!(4), ["scene", "4", "`scenes`, which has 1"]),
        ("/scenes/0/nodes/0", json!(99), ["scenes[0].nodes[0]", "99", "`nodes`, which has 4"]),
        ("/nodes/0/children/1", json!(44), ["nodes[0].children[1]", "44", "`nodes`"]),
        (
            "/nodes/3/extensions/KHR_lights_punctual/light",
            json!(5),
            ["nodes[3].extensions.KHR_lights_punctual.light", "5", "which has 1"],
        ),
        (
            "/meshes/0/primitives/0/attributes/POSITION",
            json!(9),
            ["meshes[0].primitives[0].attributes.POSITION", "9", "`accessors`, which has 2"],
        ),
        ("/meshes/0/primitives/0/indices", json!(9), ["meshes[0].primitives[0].indices", "9", "`accessors`"]),
        ("/meshes/0/primitives/0/material", json!(9), ["meshes[0].primitives[0].material", "9", "`materials`"]),
        ("/accessors/0/bufferView", json!(9), ["accessors[0].bufferView", "9", "`bufferViews`, which has 2"]),
        ("/bufferViews/0/buffer", json!(9), ["bufferViews[0].buffer", "9", "`buffers`, which has 1"]),
    ]);
}

#[test]
fn accessors_outside_their_data() {
    check(vec![
        ("/accessors/0/count", json!(5), ["accessors[0].count", "5", "1 .. 4, the elements its view holds"]),
        ("/accessors/0/count", json!(0), ["accessors[0].count", "0", "1 .. 4"]),
        ("/accessors/0/count", json!(u64::MAX), ["accessors[0].count", "18446744073709551615", "1 .. 4"]),
        ("/accessors/0/byteOffset", json!(4), ["accessors[0].count", "4", "1 .. 3"]),
        (
            "/accessors/0/byteOffset",
            json!(u64::MAX - 3),
            ["accessors[0].byteOffset", "18446744073709551612", "0 .. 48"],
        ),
        ("/accessors/0/byteOffset", json!(2), ["accessors[0].byteOffset", "2 + 0", "multiples of 4"]),
        ("/accessors/0/type", json!("VEC4"), ["accessors[0].type", "VEC4", "VEC3"]),
        ("/accessors/0/componentType", json!(5130), ["accessors[0].componentType", "5130", "5126"]),
        ("/accessors/0/componentType", json!(5125), ["accessors[0].componentType", "5125", "for a position"]),
        ("/accessors/1/componentType", json!(5122), ["accessors[1].componentType", "5122", "unsigned"]),
        ("/accessors/0/sparse", json!({ "count": 1 }), ["accessors[0].sparse", "present", "not supported"]),
        ("/accessors/1/count", json!(5), ["meshes[0].primitives[0]", "5", "a multiple of 3"]),
        ("/bufferViews/0/byteStride", json!(8), ["bufferViews[0].byteStride", "8", "multiple of 4 in 12 .. 252"]),
        ("/bufferViews/0/byteStride", json!(0), ["bufferViews[0].byteStride", "0", "12 .. 252"]),
        ("/bufferViews/0/byteStride", json!(16), ["accessors[0].count", "4", "1 .. 3"]),
        ("/bufferViews/1/byteStride", json!(4), ["bufferViews[1].byteStride", "4", "none, for indices"]),
        ("/bufferViews/0/byteLength", json!(1000), ["bufferViews[0].byteLength", "1000", "1 .. 60"]),
        ("/bufferViews/0/byteOffset", json!(61), ["bufferViews[0].byteOffset", "61", "0 .. 60"]),
        (
            "/bufferViews/0/byteOffset",
            json!(u64::MAX),
            ["bufferViews[0].byteOffset", "18446744073709551615", "0 .. 60"],
        ),
        ("/buffers", json!([{ "byteLength": 61 }]), ["buffers[0].byteLength", "61", "1 .. 60"]),
        ("/buffers", json!([{ "byteLength": 60 }, { "byteLength": 60 }]), ["buffers[1].uri", "none", "a URI"]),
    ]);
}

#[test]
fn an_index_beyond_the_vertices_and_a_position_that_is_no_number() {
    let mut builder = sample();
    builder.binary[48..50].copy_from_slice(&4u16.to_le_bytes());
    let (field, value, allowed) = refusal(load(&builder.glb()));
    assert_eq!((field.as_str(), value.as_str()), ("accessors[1], element 0", "4"));
    assert!(allowed.contains("below 4"));
    let mut builder = sample();
    builder.binary[12..16].copy_from_slice(&f32::NAN.to_le_bytes());
    let (field, value, _) = refusal(load(&builder.glb()));
    assert!(field == "accessors[0], element 1" && value.contains("NaN"));
}

#[test]
fn node_hierarchies_that_are_no_forest() {
    check(vec![
        ("/nodes/1/children", json!([2]), ["nodes[1].children[0]", "2", "nodes[0] has it too"]),
        ("/nodes/0/children", json!([1, 1]), ["nodes[0].children[1]", "1", "without another parent"]),
        ("/nodes/1/children", json!([0]), ["nodes[0].children", "[1, 2, 3]", "no cycle"]),
        ("/nodes/0/children", json!([0]), ["nodes[0].children", "[0]", "no cycle"]),
        ("/scenes/0/nodes", json!([0, 2]), ["scenes[0].nodes[1]", "2", "without parent"]),
        ("/scenes/0/nodes", json!([0, 0]), ["scenes[0].nodes[1]", "0", "listed once"]),
    ]);
}

#[test]
fn transforms_that_place_nothing() {
    check(vec![
        ("/nodes/1/rotation", json!([0, 0, 0, 0]), ["nodes[1].rotation", "0.0", "length 1"]),
        ("/nodes/1/rotation", json!([0, 0, 1]), ["nodes[1].rotation", "invalid length 3", "4 numbers"]),
        ("/nodes/1/translation", json!([0, 1e300, 0]), ["nodes[1]", "beyond all bounds", "1e12 m"]),
        ("/nodes/1/scale", json!([1e13, 1, 1]), ["accessors[0], element 1", "1", "within 1e12 m"]),
        (
            "/nodes/0/matrix",
            json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
            ["nodes[0].matrix", "beside", "one or"],
        ),
        (
            "/nodes/1/matrix",
            json!([1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
            ["nodes[1].matrix", "0.5", "last row"],
        ),
        ("/nodes/2/scale", json!([1, 1, 0]), ["nodes[2].scale", "0", "keeps directions"]),
        ("/nodes/3/scale", json!([0, 0, 0]), ["nodes[3].scale", "0", "keeps directions"]),
    ]);
}

#[test]
fn cameras_and_lights_out_of_range() {
    let light = "extensions.KHR_lights_punctual.lights[0]";
    let field = |name: &str| -> &'static str { Box::leak(format!("{light}.{name}").into_boxed_str()) };
    let at = |name: &str| -> &'static str {
        Box::leak(format!("/extensions/KHR_lights_punctual/lights/0/{name}").into_boxed_str())
    };
    check(vec![
        ("/cameras/0/perspective", json!({ "znear": 1 }), ["cameras[0].perspective.yfov", "none", "below pi"]),
        ("/cameras/0/perspective/yfov", json!(0), ["cameras[0].perspective.yfov", "0", "above 0"]),
        ("/cameras/0/perspective/yfov", json!(3.2), ["cameras[0].perspective.yfov", "3.2", "below pi"]),
        ("/cameras/0/perspective/aspectRatio", json!(-1), ["cameras[0].perspective.aspectRatio", "-1", "above 0"]),
        ("/cameras/0/type", json!("fisheye"), ["cameras[0].type", "fisheye", "perspective"]),
        (at("intensity"), json!(-1), [field("intensity"), "-1", "0 or more"]),
        (at("intensity"), json!("bright"), [field("intensity"), "bright", "a number"]),
        (at("color"), json!([1, -0.5, 1]), [field("color[1]"), "-0.5", "0 or more"]),
        (at("type"), json!("area"), [field("type"), "area", "directional"]),
        (at("spot"), json!(null), [field("spot"), "none", "cones"]),
        (at("spot"), json!({ "outerConeAngle": 1.7 }), [field("spot.outerConeAngle"), "1.7", "to pi/2"]),
        (at("spot"), json!({ "outerConeAngle": 0 }), [field("spot.outerConeAngle"), "0", "above 0"]),
        (at("spot"), json!({ "innerConeAngle": 0.9 }), [field("spot.innerConeAngle"), "0.9", "0 .. 0.78"]),
    ]);
}

#[test]
fn materials_out_of_range() {
    let factors = "materials[0].pbrMetallicRoughness";
    let field = |name: &str| -> &'static str { Box::leak(format!("{factors}.{name}").into_boxed_str()) };
    let base = "/materials/0/pbrMetallicRoughness";
    let strength = json!({ "KHR_materials_emissive_strength": { "emissiveStrength": -3 } });
    let strength_field = "materials[0].extensions.KHR_materials_emissive_strength.emissiveStrength";
    check(vec![
        (base, json!({ "metallicFactor": 1.5 }), [field("metallicFactor"), "1.5", "0 .. 1"]),
        (base, json!({ "roughnessFactor": -0.1 }), [field("roughnessFactor"), "-0.1", "0 .. 1"]),
        (base, json!({ "baseColorFactor": [1, 1, 2, 1] }), [field("baseColorFactor[2]"), "2", "0 .. 1"]),
        ("/materials/0/emissiveFactor", json!([9, 0, 0]), ["materials[0].emissiveFactor[0]", "9", "0 .. 1"]),
        ("/materials/0/extensions", strength, [strength_field, "-3", "0 or more"]),
        (base, json!({ "baseColorTexture": { "index": 2 } }), [field("baseColorTexture.index"), "2", "`textures`"]),
        ("/materials/0/name", json!(5), ["materials[0].name", "5", "text in quotation marks"]),
        ("/meshes/0/primitives/0/mode", json!(7), ["meshes[0].primitives[0].mode", "7", "0 .. 6"]),
    ]);
}

#[test]
fn extensions_and_versions_not_understood() {
    check(vec![
        (
            "/extensionsRequired",
            json!(["KHR_lights_punctual", "KHR_draco_mesh_compression"]),
            ["extensionsRequired[1]", "KHR_draco_mesh_compression", "KHR_lights_punctual"],
        ),
        (
            "/extensionsRequired",
            json!(["EXT_meshopt_compression"]),
            ["extensionsRequired[0]", "EXT_meshopt_compression", "can be required"],
        ),
        ("/asset/version", json!("1.0"), ["asset.version", "1.0", "2.0"]),
        ("/asset/minVersion", json!("2.1"), ["asset.minVersion", "2.1", "2.0"]),
    ]);
}

#[test]
fn references_that_leave_the_folder_are_never_fetched() {
    for (uri, why) in [
        ("../secret.bin", "`..` is refused"),
        ("a/%2e%2e/%2E%2E/secret.bin", "`..` is refused"),
        ("/etc/passwd", "absolute"),
        ("%2Fetc/passwd", "absolute"),
        ("C:\\scene.bin", "schemes and drives"),
        ("sub\\..\\secret.bin", "backslashes"),
        ("http://example.org/scene.bin", "schemes and drives"),
        ("FILE:///etc/passwd", "schemes and drives"),
        ("", "names no file"),
        ("a%00.bin", "control characters"),
        ("%ff.bin", "not UTF-8"),
        ("data:application/octet-stream,abc", "in base64"),
        ("data:;base64,!!!!", "valid base64"),
        ("data:;base64", "data:<media type>"),
    ] {
        let (field, _, allowed) = refusal(load(&sample().text(Some(uri))));
        assert_eq!(field, "buffers[0].uri", "{uri}");
        assert!(allowed.contains(why), "{uri}: {allowed}");
    }
}

#[test]
fn a_failing_fetch_and_a_short_file_are_reported() {
    let text = sample().text(Some("scene.bin"));
    let (field, value, allowed) = refusal(gltf::load("scene.glb", &text, &mut |_| Ok(vec![0; 10])));
    assert_eq!((field.as_str(), value.as_str()), ("buffers[0].byteLength", "60"));
    assert!(allowed.contains("1 .. 10"));
    let beside = |uri: &str| Err(lampyris::error::Error::input("scene.glb", "uri", uri, "a file that can be read"));
    let (field, value, _) = refusal(gltf::load("scene.glb", &text, &mut |uri| beside(uri)));
    assert_eq!((field.as_str(), value.as_str()), ("buffers[0].uri", "scene.bin"));
    let missing = std::io::Error::from(std::io::ErrorKind::NotFound);
    let mut missing = Some(lampyris::error::Error::io(std::path::Path::new("scene.bin"))(missing));
    let error = gltf::load("scene.glb", &text, &mut |_| Err(missing.take().expect("asked once"))).unwrap_err();
    assert!(error.to_string().starts_with("scene.bin: "));
}

#[test]
fn images_that_cannot_be_read_are_named() {
    for (bytes, why) in [
        (&b"RIFF-and-rubbish"[..], "another format"),
        (b"\x89PNG\r\n\x1a\nrubbish", "PNG or JPEG"),
        (b"\xff\xd8\xff\xe0rubbish", "PNG or JPEG"),
    ] {
        let mut builder = sample();
        let view = builder.view(bytes);
        builder.push("/images", json!({ "name": "bark", "bufferView": view }));
        builder.push("/textures", json!({ "source": 0 }));
        builder.set("/materials/0/pbrMetallicRoughness/baseColorTexture", json!({ "index": 0 }));
        let (field, value, allowed) = refusal(load(&builder.glb()));
        assert_eq!((field.as_str(), value.as_str()), ("images[0]", "bark"));
        assert!(allowed.contains(why), "{allowed}");
    }
}

#[test]
fn files_that_are_not_gltf() {
    let glb = sample().glb();
    let mut version = glb.clone();
    version[4] = 1;
    let mut short = glb.clone();
    short[8..12].copy_from_slice(&3u32.to_le_bytes());
    for (bytes, field) in [
        (&b"not json"[..], "content"),
        (b"", "content"),
        (b"{\"asset\"", "JSON"),
        (b"{}", "asset.version"),
        (b"glTF", "content"),
        (&glb[..glb.len() - 4], "GLB length"),
        (&version, "GLB"),
        (&short, "GLB length"),
    ] {
        assert_eq!(refusal(load(bytes)).0, field);
    }
    let mut text = sample().embedded();
    text.push(b'}');
    assert_eq!(refusal(load(&text)).0, "JSON");
}

#[test]
fn instances_without_end_are_refused_before_they_fill_the_memory() {
    let mut builder = sample();
    let positions = vec![[0.0f32, 0.0, 0.0]; 3 << 16];
    let mesh = builder.mesh(&positions, None);
    for _ in 0..(1 << 11) {
        let node = builder.node(json!({ "mesh": mesh }));
        builder.push("/scenes/0/nodes", json!(node));
    }
    let (_, value, allowed) = refusal(load(&builder.glb()));
    assert!(value.contains("196608 vertices, shown by 2048 nodes") && allowed.contains("at most 67108864"), "{value}");
}
