//! What transmits: KHR_materials_transmission, with KHR_materials_ior and KHR_materials_volume.
//!
//! A material that transmits all over (transmissionFactor 1 without texture, metallicFactor 0) is clear glass: a thin pane, whose base
//! colour is what is left of light that crosses the glass once along the normal; with a volume of some thickness it is the surface of a
//! body, tinted by its attenuation. Roughness has no effect, and that is said. What transmits in part is a thin sheet: the
//! metallic-roughness law, of whose layer under the outer surface a share lets light straight through.

use super::document::{Material, TextureReference};
use super::problem::{File, Warnings};
use crate::error::Result;
use crate::math::log;
use crate::photometry::Colour;
use crate::scene::{Delta, Glass, Pane, Reflectance};

/// Greatest refractive index.
const MAX_INDEX: f64 = 10.0;
/// Where a material says how much it transmits.
pub(super) const EXTENSION: &str = "extensions.KHR_materials_transmission";

/// The transmissionFactor of `material` at `path`; 0 where it has none.
pub(super) fn factor(file: File, material: &Material, path: &str) -> Result<f64> {
    let Some(transmission) = &material.extensions.transmission else { return Ok(0.0) };
    let field = format!("{path}.{EXTENSION}.transmissionFactor");
    file.between(field, transmission.transmission_factor, 0.0, 1.0)
}

/// The texture that multiplies the transmissionFactor of `material`, where anything of it can transmit.
pub(super) fn texture(material: &Material) -> &Option<TextureReference> {
    let strength = material.extensions.emissive_strength.as_ref().map_or(1.0, |e| e.emissive_strength);
    let emits = strength != 0.0 && material.emissive_factor != [0.0; 3];
    match &material.extensions.transmission {
        Some(transmission)
            if transmission.transmission_factor > 0.0
                && material.pbr_metallic_roughness.metallic_factor < 1.0
                && !emits =>
        {
            &transmission.transmission_texture
        }
        _ => &None,
    }
}

/// Says what of the material `name`, of which a part is a metal and a part transmits, is not followed; the share of the rest that
/// transmits, of what the file says, `share`.
pub(super) fn share_of_sheet(
    material: &Material,
    name: &str,
    share: f64,
    metallic: f64,
    warnings: &mut Warnings,
) -> f64 {
    if share == 0.0 {
        return 0.0;
    }
    if metallic == 1.0 {
        warnings.add(format!("material `{name}`: it is opaque: with metallicFactor 1 nothing of it transmits"));
        return 0.0;
    }
    if material.pbr_metallic_roughness.roughness_factor > 0.0 {
        warnings.add(format!(
            "material `{name}`: what it transmits goes straight on: its roughness scatters what it reflects alone; frosted glass is near \
             to [[material]] with kind = \"opal\""
        ));
    }
    if material.extensions.volume.as_ref().is_some_and(|volume| volume.thickness_factor > 0.0) {
        warnings.add(format!(
            "material `{name}`: KHR_materials_volume is ignored: what transmits in part is a thin sheet that neither refracts nor absorbs"
        ));
    }
    share
}

/// The clear glass of the material `name` at `path`, of base colour `base`; `None` where it does not transmit all over.
pub(super) fn glass(
    file: File,
    material: &Material,
    (path, name): (&str, &str),
    base: Colour,
    warnings: &mut Warnings,
) -> Result<Option<Reflectance>> {
    let extensions = &material.extensions;
    let metal = material.pbr_metallic_roughness.metallic_factor > 0.0;
    if factor(file, material, path)? < 1.0 || texture(material).is_some() || metal {
        return Ok(None);
    }
    let field = format!("{path}.extensions.KHR_materials_ior.ior");
    let index = file.between(field, extensions.ior.as_ref().map_or(1.5, |ior| ior.ior), 1.0, MAX_INDEX)?;
    if material.pbr_metallic_roughness.roughness_factor > 0.0 {
        warnings.add(format!(
            "material `{name}`: roughnessFactor is ignored: glass is polished; frosted glass is near to [[material]] with kind = \"opal\""
        ));
    }
    if material.alpha_mode != "OPAQUE" {
        warnings.add(format!("material `{name}`: alphaMode {} is ignored: it is glass all over", material.alpha_mode));
    }
    let Some(volume) = extensions.volume.as_ref().filter(|volume| volume.thickness_factor > 0.0) else {
        if material.pbr_metallic_roughness.base_color_texture.is_some() {
            warnings
                .add(format!("material `{name}`: baseColorTexture counts by its mean: a pane is the same all over"));
        }
        return Ok(Some(Reflectance::Delta(Delta::Pane(Pane::new(index, base)))));
    };
    if base != Colour::WHITE {
        warnings.add(format!(
            "material `{name}`: the base colour of a body of glass is ignored: attenuationColor tints it"
        ));
    }
    let field = format!("{path}.extensions.KHR_materials_volume.attenuationColor");
    let colour = Colour(file.all_between(field, volume.attenuation_color, f64::MIN_POSITIVE, 1.0)?);
    let field = format!("{path}.extensions.KHR_materials_volume.attenuationDistance");
    let distance = file.between(field, volume.attenuation_distance.unwrap_or(f64::MAX), f64::MIN_POSITIVE, f64::MAX)?;
    let absorption = colour.map(|c| if c == 1.0 { 0.0 } else { -log(c) / distance });
    Ok(Some(Reflectance::Delta(Delta::Glass(Glass::new(index, absorption)))))
}
