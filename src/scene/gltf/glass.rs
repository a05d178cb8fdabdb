//! Clear glass: KHR_materials_transmission, with KHR_materials_ior and KHR_materials_volume.
//!
//! A material that transmits is a thin pane. The base colour is what is left of light that crosses the glass once along the
//! normal; roughness, texture and volume have no effect, and that is said. What transmits in part, or is a metal, stays opaque.

use super::document::Material;
use super::problem::{File, Warnings};
use crate::error::Result;
use crate::photometry::Colour;
use crate::scene::{Delta, Pane, Reflectance};

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
                "material `{name}`: it is opaque: only what transmits everything (transmissionFactor 1 without texture, metallicFactor 0) is glass"
            ));
        }
        return Ok(None);
    }
    if material.pbr_metallic_roughness.roughness_factor > 0.0 {
        warnings.add(format!("material `{name}`: roughnessFactor is ignored: glass is polished"));
    }
    if extensions.volume.as_ref().is_some_and(|volume| volume.thickness_factor > 0.0) {
        warnings.add(format!("material `{name}`: KHR_materials_volume is ignored: each surface is a thin pane"));
    }
    Ok(Some(Reflectance::Delta(Delta::Pane(Pane::new(index, base)))))
}
