//! The part of glTF 2.0 that is read, as it stands in the JSON.
//!
//! The `gltf` crate's own JSON types are not used: they hold numbers in `f32`, and they cut an index to 32 bits, so
//! that a mistyped 2^32 would silently name object 0. Here numbers are `f64`, indices are kept whole, and a value of
//! the wrong type is reported with its path. Nothing is checked here but
//! types: an index is proved where it is followed.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;

use super::problem::File;
use crate::error::Result;

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
#[serde(rename_all = "camelCase")]
pub struct Material {
    pub name: Option<String>,
    #[serde(default)]
    pub pbr_metallic_roughness: MetallicRoughness,
    pub normal_texture: Option<TextureReference>,
    pub occlusion_texture: Option<TextureReference>,
    pub emissive_texture: Option<TextureReference>,
    #[serde(default)]
    pub emissive_factor: [f64; 3],
    #[serde(default = "opaque")]
    pub alpha_mode: String,
    #[serde(default)]
    pub double_sided: bool,
    #[serde(default)]
    pub extensions: MaterialExtensions,
}

#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub struct MetallicRoughness {
    pub base_color_factor: [f64; 4],
    pub base_color_texture: Option<TextureReference>,
    pub metallic_factor: f64,
    pub roughness_factor: f64,
    pub metallic_roughness_texture: Option<TextureReference>,
}

impl Default for MetallicRoughness {
    fn default() -> Self {
        MetallicRoughness {
            base_color_factor: [1.0; 4],
            base_color_texture: None,
            metallic_factor: 1.0,
            roughness_factor: 1.0,
            metallic_roughness_texture: None,
        }
    }
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub struct MaterialExtensions {
    #[serde(rename = "KHR_materials_emissive_strength")]
    pub emissive_strength: Option<EmissiveStrength>,
    #[serde(rename = "KHR_materials_transmission")]
    pub transmission: Option<Transmission>,
    #[serde(rename = "KHR_materials_ior")]
    pub ior: Option<Ior>,
    #[serde(rename = "KHR_materials_volume")]
    pub volume: Option<Volume>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Transmission {
    #[serde(default)]
    pub transmission_factor: f64,
    pub transmission_texture: Option<TextureReference>,
}

#[derive(Deserialize)]
pub struct Ior {
    #[serde(default = "index_of_glass")]
    pub ior: f64,
}

fn index_of_glass() -> f64 {
    1.5
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Volume {
    #[serde(default)]
    pub thickness_factor: f64,
    pub attenuation_distance: Option<f64>,
    #[serde(default = "white")]
    pub attenuation_color: [f64; 3],
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct EmissiveStrength {
    #[serde(default = "one")]
    pub emissive_strength: f64,
}

#[derive(Deserialize)]
pub struct TextureReference {
    pub index: usize,
}

#[derive(Deserialize)]
pub struct Texture {
    pub name: Option<String>,
    pub source: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Image {
    pub name: Option<String>,
    pub uri: Option<String>,
    pub buffer_view: Option<usize>,
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

fn opaque() -> String {
    "OPAQUE".to_owned()
}

/// Reads the JSON text; a value of the wrong type is named by its path.
pub fn parse(file: File, json: &[u8]) -> Result<Document> {
    let mut text = serde_json::Deserializer::from_slice(json);
    let document: Document = serde_path_to_error::deserialize(&mut text).map_err(|error| {
        let field = error.path().to_string();
        let message = error.into_inner().to_string();
        let (value, allowed) = message.split_once(", ").unwrap_or((message.as_str(), "as in glTF 2.0"));
        file.bad(field, value, allowed)
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
