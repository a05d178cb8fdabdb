//! Which extensions are understood, and what it means that another is not.

use super::document::Document;
use super::problem::{File, Warnings};
use crate::error::Result;

/// Extensions whose meaning is followed.
const SUPPORTED: [&str; 10] = [
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "EXT_lights_ies",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Refuses a file that needs an extension not understood; lists those it merely uses, with the effect.
pub fn check(file: File, document: &Document, warnings: &mut Warnings) -> Result<()> {
    for (i, name) in document.extensions_required.iter().enumerate() {
        if !SUPPORTED.contains(&name.as_str()) {
            let allowed = format!("only {} can be required{}", SUPPORTED.join(", "), remedy(name));
            return Err(file.bad(format_args!("extensionsRequired[{i}]"), name, allowed));
        }
    }
    for name in document.extensions_used.iter().filter(|name| !SUPPORTED.contains(&name.as_str())) {
        if let Some(effect) = effect(name) {
            warnings.add(format!("extension {name} is ignored: {effect}"));
        }
    }
    Ok(())
}

/// What to do about a file that needs the extension `name`.
fn remedy(name: &str) -> &'static str {
    match name {
        "KHR_draco_mesh_compression" | "EXT_meshopt_compression" | "KHR_meshopt_compression" => {
            "; export the scene without compression of its meshes"
        }
        "KHR_texture_basisu" | "EXT_texture_webp" | "EXT_texture_avif" | "MSFT_texture_dds" => {
            "; export the scene with PNG or JPEG textures"
        }
        _ => "",
    }
}

/// What ignoring the extension `name` changes; `None` where it changes nothing at all.
fn effect(name: &str) -> Option<&'static str> {
    Some(match name {
        // Metadata carries no light.
        "KHR_xmp" | "KHR_xmp_json_ld" => return None,
        // How the triangles of a polygon belong together.
        "FB_ngon_encoding" => return None,
        "KHR_materials_unlit" => "its materials reflect by their metallic-roughness factors",
        "KHR_materials_diffuse_transmission" => "its materials are opaque",
        "KHR_materials_dispersion" => "glass refracts all colours alike",
        "KHR_materials_subsurface" | "KHR_materials_volume_scatter" => {
            "its materials scatter light at their surface only"
        }
        "KHR_materials_clearcoat" => "no clear coat lies over its materials",
        "KHR_materials_sheen" => "its materials have no sheen",
        "KHR_materials_anisotropy" => "reflection is isotropic",
        "KHR_materials_iridescence" => "its materials have no thin film",
        "KHR_materials_variants" => "the default material of each surface is used",
        "KHR_materials_pbrSpecularGlossiness" => "its materials reflect by their metallic-roughness factors",
        "KHR_draco_mesh_compression" | "EXT_meshopt_compression" | "KHR_meshopt_compression" => {
            "the uncompressed copy of its data is read"
        }
        "KHR_texture_basisu" | "EXT_texture_webp" | "EXT_texture_avif" | "MSFT_texture_dds" => {
            "the PNG or JPEG copy of an image is read"
        }
        "EXT_lights_image_based" | "KHR_lights_environment" => "these lights are dark",
        "KHR_node_visibility" => "hidden nodes are rendered",
        "KHR_animation_pointer" => "the scene is rendered as it stands without animation",
        "MSFT_lod" | "MSFT_screencoverage" => "only the finest level of detail is rendered",
        _ => "what it describes is not rendered",
    })
}
