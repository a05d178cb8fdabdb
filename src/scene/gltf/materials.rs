//! Metallic-roughness materials: constant factors, textures by their mean.
//!
//! A material is read when the first surface with it is met, so that what the scene does not show cannot fail.

use super::document::{Document, Material, TextureReference};
use super::glass::glass;
use super::images::{Images, Mean};
use super::problem::{File, Warnings};
use crate::error::Result;
use crate::photometry::Colour;
use crate::scene::{Reflectance, Surface};

/// Materials of the file and the surfaces made of them.
pub struct Materials<'a> {
    file: File<'a>,
    document: &'a Document,
    images: Images<'a>,
    /// Surface of each material, and last that of no material.
    made: Vec<Option<u32>>,
    surfaces: Vec<Surface>,
}

impl<'a> Materials<'a> {
    /// Nothing is read before it is asked for.
    pub fn new(file: File<'a>, document: &'a Document, images: Images<'a>) -> Self {
        let made = vec![None; document.materials.len() + 1];
        Materials { file, document, images, made, surfaces: Vec::new() }
    }

    /// Index of the surface of `material`, which stands in `field` of the mesh called `mesh`.
    pub fn surface(
        &mut self,
        material: Option<usize>,
        field: &str,
        mesh: &str,
        warnings: &mut Warnings,
    ) -> Result<u32> {
        if let Some(index) = material {
            self.file.item(&self.document.materials, "materials", index, field)?;
        } else {
            warnings.add(format!("{mesh} has no material: glTF's default is used, white metal of roughness 1"));
        }
        let slot = material.unwrap_or(self.document.materials.len());
        if let Some(surface) = self.made[slot] {
            return Ok(surface);
        }
        let surface = match material {
            Some(index) => self.convert(index, warnings)?,
            None => default_surface(),
        };
        let index = u32::try_from(self.surfaces.len()).expect("there are no more surfaces than triangles");
        self.surfaces.push(surface);
        self.made[slot] = Some(index);
        Ok(index)
    }

    /// The surfaces, in the order in which they were asked for.
    pub fn into_surfaces(self) -> Vec<Surface> {
        self.surfaces
    }

    /// The surface of material `index`.
    fn convert(&mut self, index: usize, warnings: &mut Warnings) -> Result<Surface> {
        let material = &self.document.materials[index];
        let path = format!("materials[{index}]");
        let name = material.name.clone().unwrap_or_else(|| format!("material{index}"));
        note_ignored(material, &name, warnings);
        let reflectance = self.reflectance(material, &path, &name, warnings)?;
        let emission = self.emission(material, &path, &name, warnings)?;
        // Glass has no back.
        let double_sided = material.double_sided || matches!(reflectance, Reflectance::Delta(_));
        Ok(Surface { name, reflectance, double_sided, emission })
    }

    /// Law of reflection by the factors times the means of the textures.
    fn reflectance(
        &mut self,
        material: &Material,
        path: &str,
        name: &str,
        warnings: &mut Warnings,
    ) -> Result<Reflectance> {
        let factors = &material.pbr_metallic_roughness;
        let path = format!("{path}.pbrMetallicRoughness");
        let [r, g, b, _] =
            self.file.all_between(format_args!("{path}.baseColorFactor"), factors.base_color_factor, 0.0, 1.0)?;
        let metallic = self.file.between(format_args!("{path}.metallicFactor"), factors.metallic_factor, 0.0, 1.0)?;
        let roughness =
            self.file.between(format_args!("{path}.roughnessFactor"), factors.roughness_factor, 0.0, 1.0)?;
        let base = self.mean(&factors.base_color_texture, &path, "baseColorTexture", name, warnings)?;
        let data = self.mean(&factors.metallic_roughness_texture, &path, "metallicRoughnessTexture", name, warnings)?;
        let [_, rough, metal] = data.stored;
        let colour = Colour([r, g, b]) * Colour(base.colour);
        let place = (path.trim_end_matches(".pbrMetallicRoughness"), name);
        if let Some(glass) = glass(self.file, material, place, colour, warnings)? {
            return Ok(glass);
        }
        Ok(Reflectance::metallic_roughness(colour, metallic * metal, roughness * rough))
    }

    /// Emitted luminance \[cd/m2\].
    fn emission(&mut self, material: &Material, path: &str, name: &str, warnings: &mut Warnings) -> Result<Colour> {
        let factor =
            self.file.all_between(format_args!("{path}.emissiveFactor"), material.emissive_factor, 0.0, 1.0)?;
        let extension = "extensions.KHR_materials_emissive_strength.emissiveStrength";
        let strength = material.extensions.emissive_strength.as_ref().map_or(1.0, |e| e.emissive_strength);
        let strength = self.file.between(format_args!("{path}.{extension}"), strength, 0.0, f64::MAX)?;
        let texture = self.mean(&material.emissive_texture, path, "emissiveTexture", name, warnings)?;
        Ok(Colour(factor) * Colour(texture.colour) * strength)
    }

    /// Mean of the texture in `slot` of the material at `path`; ones where there is none.
    fn mean(
        &mut self,
        texture: &Option<TextureReference>,
        path: &str,
        slot: &str,
        material: &str,
        warnings: &mut Warnings,
    ) -> Result<Mean> {
        let Some(texture) = texture else { return Ok(Mean { colour: [1.0; 3], stored: [1.0; 3] }) };
        let (mean, image) = self.images.mean(texture.index, &format!("{path}.{slot}.index"))?;
        warnings.add(format!("material `{material}`: {slot} `{image}` is replaced by its mean"));
        Ok(mean)
    }
}

/// What glTF says of a surface without material.
fn default_surface() -> Surface {
    Surface {
        name: "default".to_owned(),
        reflectance: Reflectance::metallic_roughness(Colour::WHITE, 1.0, 1.0),
        double_sided: false,
        emission: Colour::BLACK,
    }
}

/// Lists what of `material` has no effect.
fn note_ignored(material: &Material, name: &str, warnings: &mut Warnings) {
    if material.normal_texture.is_some() {
        warnings.add(format!("material `{name}`: normalTexture is ignored: the surface is as flat as its triangles"));
    }
    if material.occlusion_texture.is_some() {
        warnings.add(format!("material `{name}`: occlusionTexture is ignored: shadows are computed"));
    }
    if material.alpha_mode != "OPAQUE" {
        warnings.add(format!("material `{name}`: alphaMode {} is ignored: the surface is opaque", material.alpha_mode));
    }
}
