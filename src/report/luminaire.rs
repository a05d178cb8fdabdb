//! What a photometric file holds, in words.

use super::number::{label, short};
use crate::math::PI;
use crate::scene::photometric_web::{Kind, Lamp, Opening, Photometry, Shape, Symmetry};

/// The content of `photometry`, a line for each thing.
pub fn luminaire_text(photometry: &Photometry) -> String {
    let mut rows = vec![("format", photometry.format.clone())];
    rows.extend(photometry.labels.iter().map(|(keyword, value)| (keyword.as_str(), visible(value))));
    rows.extend(of_table(photometry));
    rows.extend(of_light(photometry));
    rows.extend(photometry.warnings.iter().map(|warning| ("warning", warning.clone())));
    rows.iter().map(|(name, value)| format!("{:<14} {value}\n", visible(name))).collect()
}

/// Angles, symmetry, shape and factors.
fn of_table(photometry: &Photometry) -> Vec<(&'static str, String)> {
    let measured = &photometry.measured;
    let range = |list: &[f64]| match list {
        [only] => format!("1, {}", label(*only)),
        _ => format!("{}, {} .. {}", list.len(), label(list[0]), label(list[list.len() - 1])),
    };
    let (planes, angles) = (range(&measured.planes), range(&measured.angles));
    let mut rows = vec![
        ("planes", format!("{planes} degrees")),
        ("angles", format!("{angles} degrees")),
        ("symmetry", symmetry(photometry.symmetry)),
        ("opening", opening(&photometry.opening)),
        ("factor", format!("{} on the numbers of the table", label(photometry.factor))),
    ];
    if let Some(tilt) = &photometry.tilt {
        let lamp = match tilt.lamp {
            Lamp::Upright => "an upright lamp",
            Lamp::Lying => "a lying lamp that stays so",
            Lamp::LyingAndTilting => "a lying lamp that tilts",
        };
        let [flat, half, full] = [0.0, 45.0, 90.0].map(|degrees| short(tilt.factor(degrees), 4));
        rows.push(("tilt", format!("{lamp}: factor {flat} at 0, {half} at 45, {full} at 90 degrees")));
    }
    rows
}

/// Flux, power and the brightest direction.
fn of_light(photometry: &Photometry) -> Vec<(&'static str, String)> {
    let flux = photometry.flux();
    let forward =
        photometry.forward_share().map(|share| format!(", {} % within 90 degrees of the aim", short(100.0 * share, 4)));
    let mut rows = vec![("flux", format!("{} lm{}", short(flux, 6), forward.unwrap_or_default()))];
    rows.push(match (photometry.lamps, photometry.light_output_ratio()) {
        (Some((count, lamps)), Some(ratio)) => {
            ("lamps", format!("{count} with {} lm; light output ratio {}", short(lamps, 6), short(ratio, 4)))
        }
        _ => ("lamps", "none apart: absolute photometry".to_owned()),
    });
    if let Some(stated) = photometry.stated_flux {
        let percent = 100.0 * (flux / stated - 1.0);
        rows.push(("stated", format!("{} lm: the web has {percent:+.2} %", short(stated, 6))));
    }
    if photometry.watts > 0.0 {
        let efficacy = short(flux / photometry.watts, 4);
        rows.push(("power", format!("{} W, {efficacy} lm/W", label(photometry.watts))));
    }
    let (t, p) = photometry.web.brightest();
    let (t, p) = (t * 180.0 / PI, (p * 180.0 / PI).rem_euclid(360.0));
    let signed = if p > 180.0 { p - 360.0 } else { p };
    let direction = match photometry.measured.kind {
        Kind::C => format!("C {}, G {}", label(p), label(t)),
        Kind::A | Kind::B => format!("horizontal {}, vertical {}", label(signed), label(90.0 - t)),
    };
    rows.push(("peak", format!("{} cd at {direction} degrees", short(photometry.web.peak(), 6))));
    rows
}

fn symmetry(symmetry: Symmetry) -> String {
    match symmetry {
        Symmetry::None => "none".to_owned(),
        Symmetry::Axial => "the same in all planes".to_owned(),
        Symmetry::Plane(angle) => format!("mirrored at C{}-C{}", label(angle), label(angle + 180.0)),
        Symmetry::Quadrants => "mirrored at C0-C180 and C90-C270".to_owned(),
        Symmetry::Mirrored { horizontal, vertical } => {
            let both = [(horizontal, "horizontal 0"), (vertical, "vertical 0")];
            let at: Vec<&str> = both.iter().filter(|(is, _)| *is).map(|(_, at)| *at).collect();
            format!("mirrored at {}", at.join(" and "))
        }
    }
}

fn opening(opening: &Opening) -> String {
    let shape = match opening.shape {
        Shape::Point => return "a point".to_owned(),
        Shape::Rectangle => "rectangle",
        Shape::Box => "box with shining sides",
        Shape::Disc => "circle or ellipse",
        Shape::UprightCylinder => "upright cylinder",
        Shape::Sphere => "sphere or ellipsoid",
        Shape::CylinderAlongLength => "cylinder along C0-C180",
        Shape::CylinderAlongWidth => "cylinder along C90-C270",
        Shape::UprightDisc => "upright circle or ellipse",
        Shape::Unknown => "unknown: signs that no edition of LM-63 has",
    };
    let [length, width, height] = [opening.length, opening.width, opening.height].map(|x| short(x, 4));
    format!("{shape}: {length} m along C0-C180, {width} m along C90-C270, {height} m high")
}

/// `text` with control characters made visible: a terminal would obey them.
fn visible(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { c.escape_default().to_string() } else { c.to_string() }).collect()
}
