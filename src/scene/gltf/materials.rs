//! Metallic-roughness materials: factors, textures and vertex colours.
//!
//! A material is read when the first surface with it is met, so that what the scene does not show cannot fail.

use std::collections::HashMap;

use super::document::{Document, Material, Primitive, Specular, TextureReference};
use super::glass::{self, glass};
use super::images::Images;
use super::problem::{File, Warnings};
use crate::error::Result;
use crate::photometry::Colour;
use crate::scene::textures::{Coding, Coverage, Layer, Textured};
use crate::scene::{Dielectric, Reflectance, Surface};

/// Materials of the file and the surfaces made of them.
pub struct Materials<'a> {
    file: File<'a>,
    document: &'a Document,
    images: Images<'a>,
    /// The surface of each material (the last is that of no material), with vertex colours or without, and with its textures laid
    /// out or not.
    made: HashMap<(usize, bool, bool), u32>,
    surfaces: Vec<Surface>,
    textured: Vec<Option<Textured>>,
}

/// A material on its way to a surface.
struct Reading<'m> {
    material: &'m Material,
    path: String,
    name: String,
    /// True where each vertex has a colour.
    coloured: bool,
    /// True where its textures lie somewhere; else they count by their mean.
    mapped: bool,
}

/// A factor and its texture: the mean of both, and the texture where it is laid out.
struct Slot {
    mean: [f64; 4],
    layer: Option<Layer>,
}

impl Slot {
    /// Nothing of it.
    const NONE: Slot = Slot { mean: [0.0; 4], layer: None };
}

impl<'a> Materials<'a> {
    /// Nothing is read before it is asked for.
    pub fn new(file: File<'a>, document: &'a Document, images: Images<'a>) -> Self {
        Materials { file, document, images, made: HashMap::new(), surfaces: Vec::new(), textured: Vec::new() }
    }

    /// Index of the surface of `primitive`, which is at `path`, of the mesh called `mesh`.
    pub fn surface(&mut self, primitive: &Primitive, path: &str, mesh: &str, warnings: &mut Warnings) -> Result<u32> {
        let slot = primitive.material.unwrap_or(self.document.materials.len());
        let document = self.document;
        let default;
        let material = match primitive.material {
            Some(index) => self.file.item(&document.materials, "materials", index, format_args!("{path}.material"))?,
            None => {
                warnings.add(format!("{mesh} has no material: glTF's default is used, white metal of roughness 1"));
                default = Material::default();
                &default
            }
        };
        let name = material.name.clone().unwrap_or_else(|| match primitive.material {
            Some(index) => format!("material{index}"),
            None => "default".to_owned(),
        });
        let missing = sets(material).into_iter().find(|set| !primitive.attributes.contains_key(&texcoord(*set)));
        if let Some(set) = missing {
            let attribute = texcoord(set);
            warnings.add(format!("{mesh} has no {attribute}: the textures of material `{name}` count by their means"));
        }
        let key = (slot, primitive.attributes.contains_key("COLOR_0"), missing.is_none());
        if let Some(&surface) = self.made.get(&key) {
            return Ok(surface);
        }
        let reading = Reading { material, path: format!("materials[{slot}]"), name, coloured: key.1, mapped: key.2 };
        let (surface, textured) = self.convert(reading, warnings)?;
        let index = u32::try_from(self.surfaces.len()).expect("there are no more surfaces than triangles");
        self.surfaces.push(surface);
        self.textured.push(textured);
        self.made.insert(key, index);
        Ok(index)
    }

    /// What varies on `surface`, and the numbers n of its coordinates TEXCOORD_n.
    pub fn textured(&self, surface: u32, material: Option<usize>) -> Option<(&Textured, Vec<usize>)> {
        let textured = self.textured[surface as usize].as_ref()?;
        let sets = material.map_or(Vec::new(), |index| sets(&self.document.materials[index]));
        Some((textured, sets.into_iter().take(textured.sets).collect()))
    }

    /// The surfaces, in the order in which they were asked for, and what varies on them.
    pub fn into_surfaces(self) -> (Vec<Surface>, Vec<Option<Textured>>) {
        (self.surfaces, self.textured)
    }

    fn convert(&mut self, reading: Reading, warnings: &mut Warnings) -> Result<(Surface, Option<Textured>)> {
        let Reading { material, path, name, coloured, mapped } = &reading;
        note_ignored(material, name, warnings);
        let factors = &material.pbr_metallic_roughness;
        let inside = format!("{path}.pbrMetallicRoughness");
        let share = |field: &str, value| self.file.between(format_args!("{inside}.{field}"), value, 0.0, 1.0);
        let [r, g, b, alpha] =
            self.file.all_between(format_args!("{inside}.baseColorFactor"), factors.base_color_factor, 0.0, 1.0)?;
        let metallic = share("metallicFactor", factors.metallic_factor)?;
        let roughness = share("roughnessFactor", factors.roughness_factor)?;
        let (base_at, data_at) = (format!("{inside}.baseColorTexture"), format!("{inside}.metallicRoughnessTexture"));
        let base = self.slot(&factors.base_color_texture, &base_at, Coding::Srgb, &reading)?;
        let data = self.slot(&factors.metallic_roughness_texture, &data_at, Coding::Data, &reading)?;
        let emission = self.emission(material, path)?;
        let glow = self.slot(&material.emissive_texture, &format!("{path}.emissiveTexture"), Coding::Srgb, &reading)?;
        let outer = self.dielectric(material, path, name, warnings)?;
        let colour = Colour([r, g, b]);
        let [_, green, blue, _] = data.mean;
        let share = glass::factor(self.file, material, path)?;
        let glass = glass(self.file, material, (path, name), colour * rgb(base.mean), warnings)?;
        let emits = !(emission * rgb(glow.mean)).is_black();
        if emits && share > 0.0 {
            warnings.add(format!("material `{name}`: it is opaque, as it emits: glass does not"));
        }
        let glass = glass.filter(|_| !emits);
        let is_glass = glass.is_some();
        let sheet = match is_glass || emits {
            true => Slot::NONE,
            false => self.sheet(&reading, share, metallic * blue, warnings)?,
        };
        let [mean, ..] = sheet.mean;
        let reflectance = glass.unwrap_or_else(|| {
            let dielectric = Dielectric { transmission: mean, ..outer };
            Reflectance::layered(colour * rgb(base.mean), metallic * blue, roughness * green, dielectric)
        });
        if data.layer.is_some() {
            warnings.add(format!("material `{name}`: the roughness of its texture is rounded to steps of 1/255"));
        }
        let surface = Surface {
            name: name.clone(),
            reflectance,
            // Glass and sheets have no back.
            double_sided: material.double_sided || is_glass || mean > 0.0,
            emission: emission * rgb(glow.mean),
        };
        let coverage = self.coverage(&reading, alpha, &base, warnings)?;
        let is_laid = base.layer.is_some();
        let laid = [&base, &data, &sheet, &glow].iter().any(|slot| slot.layer.is_some());
        let varies = !is_glass && (*coloured || laid || coverage != Coverage::Whole);
        let textured = Textured {
            sets: if *mapped { sets(material).len() } else { 0 },
            coloured: *coloured,
            // A texture that is not laid out counts by its mean, and is part of the factor then.
            base: if is_laid { colour } else { colour * rgb(base.mean) },
            base_layer: base.layer,
            factors: if data.layer.is_some() { [metallic, roughness] } else { [metallic * blue, roughness * green] },
            data_layer: data.layer,
            dielectric: Dielectric { transmission: if sheet.layer.is_some() { share } else { mean }, ..outer },
            transmission_layer: sheet.layer,
            emission,
            emission_layer: glow.layer,
            uniform_law: false,
            coverage,
            alpha: if is_laid { alpha } else { alpha * base.mean[3] },
        };
        Ok((surface, varies.then_some(textured)))
    }

    /// The texture `reference`, which stands in `field`.
    fn slot(
        &mut self,
        reference: &Option<TextureReference>,
        field: &str,
        coding: Coding,
        reading: &Reading,
    ) -> Result<Slot> {
        let Some(reference) = reference else { return Ok(Slot { mean: [1.0; 4], layer: None }) };
        let mut layer = self.images.layer(reference, field, coding)?;
        let mean = layer.image.mean(coding);
        // A single texel is the same everywhere.
        if !reading.mapped || layer.image.size() == [1, 1] {
            return Ok(Slot { mean, layer: None });
        }
        let place = sets(reading.material).iter().position(|&set| set == layer.set);
        layer.set = place.expect("it is among the coordinates of its material");
        Ok(Slot { mean, layer: Some(layer) })
    }

    /// The share of the dielectric part that transmits, where that is no clear glass: `factor` by the mean of its texture, and the
    /// texture. `metallic` is the mean share of metal.
    fn sheet(&mut self, reading: &Reading, factor: f64, metallic: f64, warnings: &mut Warnings) -> Result<Slot> {
        let field = format!("{}.{}.transmissionTexture", reading.path, glass::EXTENSION);
        let slot = self.slot(glass::texture(reading.material), &field, Coding::Data, reading)?;
        let [red, ..] = slot.mean;
        let share = glass::share_of_sheet(reading.material, &reading.name, factor * red, metallic, warnings);
        Ok(Slot { mean: [share; 4], layer: slot.layer.filter(|_| share > 0.0) })
    }

    /// What the `alpha` of the base colour and of its texture `base` means.
    fn coverage(&self, reading: &Reading, alpha: f64, base: &Slot, warnings: &mut Warnings) -> Result<Coverage> {
        let Reading { material, path, name, coloured, .. } = reading;
        let cutoff = self.file.between(format_args!("{path}.alphaCutoff"), material.alpha_cutoff, 0.0, f64::MAX)?;
        let coverage = match material.alpha_mode.as_str() {
            "OPAQUE" => return Ok(Coverage::Whole),
            "MASK" => Coverage::Mask(cutoff),
            "BLEND" => Coverage::Blend,
            other => return Err(self.file.bad(format_args!("{path}.alphaMode"), other, "OPAQUE, MASK or BLEND")),
        };
        let least = base.layer.as_ref().map_or(base.mean[3], |layer| layer.image.range(3).0);
        let enough = if let Coverage::Mask(cutoff) = coverage { cutoff } else { 1.0 };
        // Many exporters ask for it everywhere.
        if !coloured && alpha * least >= enough {
            return Ok(Coverage::Whole);
        }
        let mode = &material.alpha_mode;
        if !self.emission(material, path)?.is_black() {
            warnings.add(format!("material `{name}`: alphaMode {mode} is ignored: the surface is opaque, as it emits"));
            return Ok(Coverage::Whole);
        }
        Ok(coverage)
    }

    /// Emitted luminance without texture \[cd/m2\].
    fn emission(&self, material: &Material, path: &str) -> Result<Colour> {
        let factor =
            self.file.all_between(format_args!("{path}.emissiveFactor"), material.emissive_factor, 0.0, 1.0)?;
        let extension = "extensions.KHR_materials_emissive_strength.emissiveStrength";
        let strength = material.extensions.emissive_strength.as_ref().map_or(1.0, |e| e.emissive_strength);
        let strength = self.file.between(format_args!("{path}.{extension}"), strength, 0.0, f64::MAX)?;
        Ok(Colour(factor) * strength)
    }

    /// The outer surface by KHR_materials_ior and KHR_materials_specular.
    fn dielectric(
        &mut self,
        material: &Material,
        path: &str,
        name: &str,
        warnings: &mut Warnings,
    ) -> Result<Dielectric> {
        let mut dielectric = Dielectric::PLAIN;
        if let Some(ior) = &material.extensions.ior {
            let field = format!("{path}.extensions.KHR_materials_ior.ior");
            if !(ior.ior == 0.0 || (ior.ior >= 1.0 && ior.ior.is_finite())) {
                return Err(self.file.bad(field, ior.ior, "0, which stands for infinity, or 1 or more"));
            }
            let root = if ior.ior == 0.0 { 1.0 } else { (ior.ior - 1.0) / (ior.ior + 1.0) };
            // 1.5 is what glTF has without the extension: the same bits.
            dielectric.f0 = if ior.ior == 1.5 { dielectric.f0 } else { Colour::grey(root * root) };
        }
        let Some(specular) = &material.extensions.specular else { return Ok(dielectric) };
        let field = format!("{path}.extensions.KHR_materials_specular");
        let Specular { specular_factor, specular_color_factor, specular_texture, specular_color_texture } = specular;
        let mut strength = self.file.between(format_args!("{field}.specularFactor"), *specular_factor, 0.0, 1.0)?;
        let colour = format_args!("{field}.specularColorFactor");
        let mut colour = Colour(self.file.all_between(colour, *specular_color_factor, 0.0, f64::MAX)?);
        if let Some(texture) = specular_texture {
            let [.., alpha] = self.images.mean(texture, &format!("{field}.specularTexture"), Coding::Data)?;
            strength *= alpha;
            warnings.add(format!("material `{name}`: specularTexture counts by its mean"));
        }
        if let Some(texture) = specular_color_texture {
            colour = colour * rgb(self.images.mean(texture, &format!("{field}.specularColorTexture"), Coding::Srgb)?);
            warnings.add(format!("material `{name}`: specularColorTexture counts by its mean"));
        }
        let f0 = (dielectric.f0 * colour).map(|f0| f0.min(1.0) * strength);
        Ok(Dielectric { f0, f90: strength, ..dielectric })
    }
}

fn rgb([r, g, b, _]: [f64; 4]) -> Colour {
    Colour([r, g, b])
}

/// The name of the coordinates number `set`.
pub fn texcoord(set: usize) -> String {
    format!("TEXCOORD_{set}")
}

/// Numbers of the coordinates that the textures of `material` use, each once.
fn sets(material: &Material) -> Vec<usize> {
    let factors = &material.pbr_metallic_roughness;
    let all = [
        &factors.base_color_texture,
        &factors.metallic_roughness_texture,
        glass::texture(material),
        &material.emissive_texture,
    ];
    let mut sets = Vec::new();
    for reference in all.into_iter().flatten() {
        let transform = reference.extensions.transform.as_ref();
        let set = transform.and_then(|t| t.tex_coord).unwrap_or(reference.tex_coord);
        if !sets.contains(&set) {
            sets.push(set);
        }
    }
    sets
}

/// Lists what of `material` has no effect.
fn note_ignored(material: &Material, name: &str, warnings: &mut Warnings) {
    if material.normal_texture.is_some() {
        warnings.add(format!("material `{name}`: normalTexture is ignored: the surface is as flat as its triangles"));
    }
    if material.occlusion_texture.is_some() {
        warnings.add(format!("material `{name}`: occlusionTexture is ignored: shadows are computed"));
    }
}
