//! Materials as they stand in the JSON.

use super::textures::TextureReference;
use super::{one, white};
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub struct Material {
    pub name: Option<String>,
    pub pbr_metallic_roughness: MetallicRoughness,
    pub normal_texture: Option<TextureReference>,
    pub occlusion_texture: Option<TextureReference>,
    pub emissive_texture: Option<TextureReference>,
    pub emissive_factor: [f64; 3],
    pub alpha_mode: String,
    pub alpha_cutoff: f64,
    pub double_sided: bool,
    pub extensions: MaterialExtensions,
}

impl Default for Material {
    fn default() -> Self {
        Material {
            name: None,
            pbr_metallic_roughness: MetallicRoughness::default(),
            normal_texture: None,
            occlusion_texture: None,
            emissive_texture: None,
            emissive_factor: [0.0; 3],
            alpha_mode: "OPAQUE".to_owned(),
            alpha_cutoff: 0.5,
            double_sided: false,
            extensions: MaterialExtensions::default(),
        }
    }
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
    #[serde(rename = "KHR_materials_ior")]
    pub ior: Option<Ior>,
    #[serde(rename = "KHR_materials_specular")]
    pub specular: Option<Specular>,
    #[serde(rename = "KHR_materials_transmission")]
    pub transmission: Option<Transmission>,
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
#[serde(rename_all = "camelCase")]
pub struct Volume {
    #[serde(default)]
    pub thickness_factor: f64,
    pub attenuation_distance: Option<f64>,
    #[serde(default = "white")]
    pub attenuation_color: [f64; 3],
}

#[derive(Deserialize)]
pub struct Ior {
    #[serde(default = "glass")]
    pub ior: f64,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Specular {
    #[serde(default = "one")]
    pub specular_factor: f64,
    pub specular_texture: Option<TextureReference>,
    #[serde(default = "white")]
    pub specular_color_factor: [f64; 3],
    pub specular_color_texture: Option<TextureReference>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct EmissiveStrength {
    #[serde(default = "one")]
    pub emissive_strength: f64,
}

fn glass() -> f64 {
    1.5
}
