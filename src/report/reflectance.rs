//! How much the materials of a scene reflect and transmit, by the angle of incidence.

use super::number::short;
use crate::math::{PI, cos};
use crate::photometry::Colour;
use crate::scene::{Scene, Surface};

/// Angles of incidence \[degrees\].
const ANGLES: [u32; 7] = [0, 15, 30, 45, 60, 75, 85];

/// A line for what each material reflects, and one for what it transmits, where it does: directional-hemispherical, mirrored light
/// included; luminous.
pub fn reflectance_text(scene: &Scene) -> String {
    let names = scene.used_surfaces().map(|s| label(s).chars().count()).max().unwrap_or(0).max(8);
    let mut text = format!("{:names$}  {:11}", "material", "");
    ANGLES.iter().for_each(|angle| text += &format!(" {angle:>7}"));
    text += "  degrees\n";
    for surface in scene.used_surfaces() {
        let shares = ANGLES.map(|angle| surface.reflectance.shares(cos(f64::from(angle) * PI / 180.0)));
        text += &row(label(surface), names, "reflects", shares.map(|(reflected, _)| reflected));
        if shares.iter().any(|(_, transmitted)| !transmitted.is_black()) {
            text += &row("", names, "transmits", shares.map(|(_, transmitted)| transmitted));
        }
    }
    text
}

fn label(surface: &Surface) -> &str {
    if surface.name.is_empty() { "(of the job)" } else { &surface.name }
}

fn row(name: &str, names: usize, what: &str, shares: [Colour; ANGLES.len()]) -> String {
    let numbers: String = shares.iter().map(|share| format!(" {:>7}", short(share.luminance(), 4))).collect();
    format!("{name:names$}  {what:11}{numbers}\n")
}
