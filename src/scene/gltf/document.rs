//! The part of glTF 2.0 that is read, as it stands in the JSON.
//!
//! The `gltf` crate's own JSON types are not used: they hold numbers in `f32`, and they cut an index to 32 bits, so
//! that a mistyped 2^32 would silently name object 0. Here numbers are `f64`, indices are kept whole, and a value of
//! the wrong type is reported with its path. Nothing is checked here but
//! types: an index is proved where it is followed.

mod materials;
mod textures;

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;

pub use materials::{Material, Specular};
pub use textures::{Image, Sampler, Texture, TextureReference, TextureTransform};

use super::problem::File;
use crate::error::{Result, in_words};

/// The whole file.
#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub struct Document {
    pub asset: Asset,
    pub extensions_used: Vec<String>,
    pub extensions_required: Vec<String>,
    pub extensions: RootExtensions,
    pub scene: Option<usize>,
    pub scenes: Vec<SceneEntry>,
    pub nodes: Vec<Node>,
    pub meshes: Vec<Mesh>,
    pub accessors: Vec<Accessor>,
    pub buffer_views: Vec<BufferView>,
    pub buffers: Vec<Buffer>,
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub samplers: Vec<Sampler>,
    pub images: Vec<Image>,
    pub cameras: Vec<Camera>,
    pub animations: Vec<IgnoredAny>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub struct Asset {
    pub version: Option<String>,
    pub min_version: Option<String>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub struct RootExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub lights_punctual: Option<Lights>,
    #[serde(rename = "EXT_lights_ies")]
    pub lights_ies: Option<Profiles>,
}

#[derive(Deserialize)]
pub struct Profiles {
    pub lights: Vec<Profile>,
}

/// A photometric web of EXT_lights_ies.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Profile {
    pub uri: Option<String>,
    pub buffer_view: Option<usize>,
}

#[derive(Deserialize)]
pub struct Lights {
    pub lights: Vec<PunctualLight>,
}

/// A light of KHR_lights_punctual.
#[derive(Deserialize)]
pub struct PunctualLight {
    pub name: Option<String>,
    #[serde(rename = "type")]
    pub kind: LightKind,
    #[serde(default = "white")]
    pub color: [f64; 3],
    #[serde(default = "one")]
    pub intensity: f64,
    pub range: Option<f64>,
    pub spot: Option<Spot>,
}

#[derive(Deserialize, Clone, Copy, PartialEq)]
#[serde(rename_all = "lowercase")]
pub enum LightKind {
    Point,
    Spot,
    Directional,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Spot {
    #[serde(default)]
    pub inner_cone_angle: f64,
    #[serde(default = "quarter_pi")]
    pub outer_cone_angle: f64,
}

#[derive(Deserialize)]
pub struct SceneEntry {
    #[serde(default)]
    pub nodes: Vec<usize>,
}

#[derive(Deserialize)]
pub struct Node {
    pub name: Option<String>,
    #[serde(default)]
    pub children: Vec<usize>,
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
    pub mesh: Option<usize>,
    pub camera: Option<usize>,
    pub skin: Option<usize>,
    #[serde(default)]
    pub extensions: NodeExtensions,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub struct NodeExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub lights_punctual: Option<NodeLight>,
    #[serde(rename = "EXT_lights_ies")]
    pub lights_ies: Option<NodeProfile>,
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub instancing: Option<Instancing>,
}

/// Many places of the mesh of a node, by name of what is given of each.
#[derive(Deserialize)]
pub struct Instancing {
    #[serde(default)]
    pub attributes: BTreeMap<String, usize>,
}

/// A photometric web at a node.
#[derive(Deserialize)]
pub struct NodeProfile {
    pub light: usize,
    #[serde(default = "one")]
    pub multiplier: f64,
    #[serde(default = "white")]
    pub color: [f64; 3],
}

#[derive(Deserialize)]
pub struct NodeLight {
    pub light: usize,
}

#[derive(Deserialize)]
pub struct Mesh {
    pub name: Option<String>,
    pub primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
pub struct Primitive {
    pub attributes: BTreeMap<String, usize>,
    pub indices: Option<usize>,
    pub material: Option<usize>,
    #[serde(default = "triangles")]
    pub mode: u64,
    #[serde(default)]
    pub targets: Vec<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Accessor {
    pub buffer_view: Option<usize>,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u64,
    #[serde(default)]
    pub normalized: bool,
    pub count: u64,
    #[serde(rename = "type")]
    pub shape: String,
    pub sparse: Option<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct BufferView {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    pub byte_stride: Option<u64>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Buffer {
    pub uri: Option<String>,
    pub byte_length: u64,
}

#[derive(Deserialize)]
pub struct Camera {
    pub name: Option<String>,
    #[serde(rename = "type")]
    pub kind: CameraKind,
    pub perspective: Option<Perspective>,
}

#[derive(Deserialize, Clone, Copy, PartialEq)]
#[serde(rename_all = "lowercase")]
pub enum CameraKind {
    Perspective,
    Orthographic,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Perspective {
    pub yfov: Option<f64>,
    pub aspect_ratio: Option<f64>,
}

fn one() -> f64 {
    1.0
}

fn white() -> [f64; 3] {
    [1.0; 3]
}

fn quarter_pi() -> f64 {
    std::f64::consts::FRAC_PI_4
}

fn triangles() -> u64 {
    4
}

/// Reads the JSON text; a value of the wrong type is named by its path.
pub fn parse(file: File, json: &[u8]) -> Result<Document> {
    let mut text = serde_json::Deserializer::from_slice(json);
    let document: Document = serde_path_to_error::deserialize(&mut text).map_err(|error| {
        let field = Some(error.path().to_string()).filter(|path| path != "." && path != "?");
        let message = error.into_inner().to_string();
        let (message, place) = message.rsplit_once(" at line ").map_or((message.as_str(), ""), |(m, at)| (m, at));
        let (value, allowed) = match message.split_once(", expected ") {
            Some((value, expected)) => (value, in_words(expected)),
            None => (message, format!("as in glTF 2.0 (line {place})")),
        };
        let value =
            ["invalid type: ", "invalid value: "].iter().find_map(|kind| value.strip_prefix(kind)).unwrap_or(value);
        file.bad(field.as_deref().unwrap_or("JSON"), value, allowed)
    })?;
    text.end().map_err(|error| file.bad("JSON", error, "nothing after the closing brace"))?;
    let version = document.asset.version.as_deref().unwrap_or("missing");
    if !version.starts_with("2.") {
        return Err(file.bad("asset.version", version, "2.0"));
    }
    match document.asset.min_version.as_deref() {
        None | Some("2.0") => Ok(document),
        Some(newer) => Err(file.bad("asset.minVersion", newer, "2.0")),
    }
}
