//! Scene files: what a good one means, how a bad one is refused, and that no bytes whatever end in a panic.

#[path = "../common/gltf_builder.rs"]
mod gltf_builder;

mod bad;
mod damage;
mod foreign;
mod geometry;
mod lights_and_cameras;
mod materials;
mod textures;

use gltf_builder::Builder;
use lampyris::error::{Error, Result};
use lampyris::scene::{Model, gltf};
use serde_json::json;

/// Loads a file that needs nothing beside it.
fn load(bytes: &[u8]) -> Result<Model> {
    gltf::load("scene.glb", bytes, &mut |uri| panic!("nothing beside the scene is wanted, least of all {uri}"))
}

/// The model of a file that must be good.
fn good(builder: &Builder) -> Model {
    load(&builder.glb()).unwrap_or_else(|error| panic!("{error}"))
}

/// True when some warning of `model` contains `text`.
fn warns(model: &Model, text: &str) -> bool {
    model.warnings.iter().any(|warning| warning.contains(text))
}

/// A unit square facing +Z.
const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

/// Its two triangles.
const CORNERS: [u16; 6] = [0, 1, 2, 0, 2, 3];

/// A lit square before a camera: one of everything, for the tests that spoil it.
/// nodes[0] holds nodes[1] (mesh), nodes[2] (camera), nodes[3] (spot).
fn sample() -> Builder {
    let mut builder = Builder::new();
    let mesh = builder.mesh(&SQUARE, Some(&CORNERS));
    builder.push("/materials", json!({ "name": "paint", "pbrMetallicRoughness": { "metallicFactor": 0.0 } }));
    builder.json["meshes"][mesh]["primitives"][0]["material"] = json!(0);
    builder.push("/cameras", json!({ "type": "perspective", "perspective": { "yfov": 0.8, "znear": 0.1 } }));
    builder.light(json!({ "type": "spot", "intensity": 10.0, "spot": { "outerConeAngle": 0.5 } }));
    builder.node(json!({ "children": [1, 2, 3], "scale": [1.0, 2.0, 1.0] }));
    builder.node(json!({ "mesh": mesh }));
    builder.node(json!({ "camera": 0, "translation": [0.0, 0.0, 5.0] }));
    builder.node(json!({ "extensions": { "KHR_lights_punctual": { "light": 0 } } }));
    builder.json["scenes"] = json!([{ "nodes": [0] }]);
    builder
}

/// The field, value and allowed range of an input error.
fn refusal(result: Result<Model>) -> (String, String, String) {
    match result {
        Err(Error::Input { file, field, value, allowed }) => {
            assert_eq!(file, "scene.glb");
            (field, value, allowed)
        }
        Err(other) => panic!("another kind of error: {other}"),
        Ok(_) => panic!("it was accepted"),
    }
}
