//! Textures, their images and samplers, as they stand in the JSON.

use serde::Deserialize;

/// A texture as a material names it.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct TextureReference {
    pub index: usize,
    #[serde(default)]
    pub tex_coord: usize,
    #[serde(default)]
    pub extensions: ReferenceExtensions,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub struct ReferenceExtensions {
    #[serde(rename = "KHR_texture_transform")]
    pub transform: Option<TextureTransform>,
}

#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub struct TextureTransform {
    pub offset: [f64; 2],
    pub rotation: f64,
    pub scale: [f64; 2],
    pub tex_coord: Option<usize>,
}

impl Default for TextureTransform {
    fn default() -> Self {
        TextureTransform { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2], tex_coord: None }
    }
}

#[derive(Deserialize)]
pub struct Texture {
    pub name: Option<String>,
    pub source: Option<usize>,
    pub sampler: Option<usize>,
    /// Names of its extensions are all that is wanted: an image in another format may stand there.
    #[serde(default)]
    pub extensions: std::collections::BTreeMap<String, serde::de::IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Sampler {
    pub mag_filter: Option<u64>,
    #[serde(default = "repeat")]
    pub wrap_s: u64,
    #[serde(default = "repeat")]
    pub wrap_t: u64,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Image {
    pub name: Option<String>,
    pub uri: Option<String>,
    pub buffer_view: Option<usize>,
}

fn repeat() -> u64 {
    10497
}
