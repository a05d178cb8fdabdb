//! Clear glass: KHR_materials_transmission, with KHR_materials_ior and KHR_materials_volume.
//!
//! A material that transmits is a thin pane, whose base colour is what is left of light that crosses the glass once along the
//! normal; with a volume of some thickness it is the surface of a body, tinted by its attenuation. Roughness has no effect, and that
//! is said. What transmits in part, or is a metal, stays opaque.

use super::document::Material;
use super::problem::{File, Warnings};
use crate::error::Result;
use crate::math::log;
use crate::photometry::Colour;
use crate::scene::{Delta, Glass, Pane, Reflectance};

/// Greatest refractive index.
const MAX_INDEX: f64 = 10.0;

/// The glass of the material `name` at `path`, of base colour `base`; `None` where it is opaque.
pub(super) fn glass(
    file: File,
    material: &Material,
    (path, name): (&str, &str),
    base: Colour,
    warnings: &mut Warnings,
) -> Result<Option<Reflectance>> {
    let extensions = &material.extensions;
    let Some(transmission) = &extensions.transmission else { return Ok(None) };
    let field = format!("{path}.extensions.KHR_materials_transmission.transmissionFactor");
    let share = file.between(field, transmission.transmission_factor, 0.0, 1.0)?;
    let field = format!("{path}.extensions.KHR_materials_ior.ior");
    let index = file.between(field, extensions.ior.as_ref().map_or(1.5, |ior| ior.ior), 1.0, MAX_INDEX)?;
    let metal = material.pbr_metallic_roughness.metallic_factor > 0.0;
    if share < 1.0 || transmission.transmission_texture.is_some() || metal {
        if share > 0.0 {
            warnings.add(format!(
                "material `{name}`: it is opaque: only what transmits everything (transmissionFactor 1 without texture, metallicFactor 0) \
                 is glass; [[material]] may make it a pane or opal"
            ));
        }
        return Ok(None);
    }
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
