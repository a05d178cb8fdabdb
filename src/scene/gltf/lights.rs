//! KHR_lights_punctual: point, spot \[cd\] and directional \[lx\] lights at nodes.

use std::f64::consts::FRAC_PI_2;

use super::document::{Document, LightKind, PunctualLight};
use super::nodes::Placed;
use super::problem::{File, Warnings};
use crate::error::Result;
use crate::math::{DVec3, acos, cos};
use crate::photometry::Colour;
use crate::scene::Light;

/// Least difference of the cosines of a spot's two cones, as in the extension's implementation note.
const CONE_EDGE: f64 = 1e-3;

/// The light `index` of the extension, at node `placed`.
pub fn light(file: File, document: &Document, placed: &Placed, index: usize, warnings: &mut Warnings) -> Result<Light> {
    let lights = document.extensions.lights_punctual.as_ref().map_or(&[][..], |extension| &extension.lights);
    let name = "extensions.KHR_lights_punctual.lights";
    let field = format_args!("nodes[{}].extensions.KHR_lights_punctual.light", placed.index);
    let light = file.item(lights, name, index, field)?;
    let path = format!("{name}[{index}]");
    if light.range.is_some() {
        let label = light.name.as_ref().map_or_else(|| path.clone(), |name| format!("light `{name}`"));
        warnings
            .add(format!("{label}: `range` is ignored: light falls with the square of the distance and never ends"));
    }
    let value = value(file, light, &path)?;
    let position = placed.position();
    Ok(match light.kind {
        LightKind::Point => Light::Omni { position, intensity: value },
        LightKind::Directional => {
            Light::Directional { direction: placed.direction(file, DVec3::NEG_Z)?, illuminance: value }
        }
        LightKind::Spot => {
            let (inner, outer) = cones(file, light, &path, warnings)?;
            Light::Spot { position, direction: placed.direction(file, DVec3::NEG_Z)?, intensity: value, inner, outer }
        }
    })
}

/// Intensity \[cd\] or illuminance \[lx\]: the colour is a factor on it, so that the photometric value is
/// I x Y(colour).
fn value(file: File, light: &PunctualLight, path: &str) -> Result<Colour> {
    let intensity = file.between(format_args!("{path}.intensity"), light.intensity, 0.0, f64::MAX)?;
    let colour = file.all_between(format_args!("{path}.color"), light.color, 0.0, f64::MAX)?;
    let value = Colour(colour) * intensity;
    match value.max().is_finite() {
        true => Ok(value),
        false => Err(file.bad(format_args!("{path}.intensity"), light.intensity, "a finite product with the colour")),
    }
}

/// Half angles \[rad\] of the inner and the outer cone, inner < outer.
fn cones(file: File, light: &PunctualLight, path: &str, warnings: &mut Warnings) -> Result<(f64, f64)> {
    let Some(spot) = &light.spot else { return Err(file.bad(format_args!("{path}.spot"), "none", "its cones")) };
    let (inner, outer) = (spot.inner_cone_angle, spot.outer_cone_angle);
    // pi/2 written in f32 lies above pi/2.
    let outer_field = format_args!("{path}.spot.outerConeAngle");
    if !(outer > 0.0 && outer <= f64::from(FRAC_PI_2 as f32)) {
        return Err(file.bad(outer_field, outer, "above 0, to pi/2"));
    }
    file.between(format_args!("{path}.spot.innerConeAngle"), inner, 0.0, outer)?;
    let outer = outer.min(FRAC_PI_2);
    if inner < outer {
        return Ok((inner, outer));
    }
    // Blender writes equal angles for a sharp cone; the implementation note keeps a narrow edge inside it.
    warnings.add(format!("{path}: a spot with equal cone angles is given an edge of {CONE_EDGE} in the cosine"));
    Ok((acos((cos(outer) + CONE_EDGE).min(1.0)), outer))
}
