//! Polar curves of a photometric web: intensity against the angle from the aim, which points down, in two planes and in
//! that of the brightest direction.

use super::canvas::{Canvas, Font, Rgb};
use super::number::{label, short};
use super::scale::Scale;
use crate::error::Result;
use crate::farm::durable::replace;
use crate::math::{DMat3, DVec3, PI, atan2, sin_cos};
use crate::photometry::Colour;
use crate::scene::photometric_web::{Kind, Luminaire, Photometry, Placement, Symmetry};
use std::path::Path;

const WIDTH: u32 = 680;
const HEIGHT: u32 = 760;
/// Where the curves start, and the length of the largest intensity on the scale \[pixels\].
const MIDDLE: [f64; 2] = [340.0, 370.0];
const RADIUS: f64 = 270.0;
/// Steps of a full turn.
const STEPS: u32 = 720;
const GREY: Rgb = [205, 205, 205];
/// Of C0-C180, C90-C270 and the brightest plane.
const COLOURS: [Rgb; 3] = [[200, 40, 40], [30, 80, 190], [40, 140, 60]];

/// Writes the curves of `photometry` as a PNG to `path`.
///
/// # Errors
/// [`crate::error::Error::Io`].
pub fn write_polar(path: &Path, title: &str, photometry: &Photometry) -> Result<()> {
    let mut canvas = Canvas::new(WIDTH, HEIGHT);
    canvas.text([12, 12], title, Font::Title);
    let peak = photometry.web.peak();
    let subtitle = format!("{} lm, largest intensity {} cd", short(photometry.flux(), 6), short(peak, 6));
    canvas.text([12, 34], &subtitle, Font::Small);
    let scale = Scale::up_to(peak, colorous::GREYS);
    draw_web(&mut canvas, &scale);
    let luminaire = hanging(photometry);
    for (k, (azimuth, colour)) in planes(photometry, &luminaire).into_iter().zip(COLOURS).enumerate() {
        canvas.stroke(&curve(&luminaire, &scale, azimuth), 2.0, colour);
        let text = halves(photometry, azimuth);
        legend(&mut canvas, k as u32, &text, colour);
    }
    replace(path, |to| canvas.write_png(to))
}

/// The luminaire at the origin, its aim down and C0 on the right.
fn hanging(photometry: &Photometry) -> Luminaire {
    let placement = Placement::new(DVec3::ZERO, DMat3::IDENTITY, DVec3::NEG_Y, DVec3::X);
    Luminaire::new(photometry, &placement.expect("down and right are not parallel"), Colour::WHITE)
}

/// The point of the picture in the direction `angle` from the aim at `share` of the radius.
fn place(angle: f64, share: f64) -> [f64; 2] {
    let (sin, cos) = sin_cos(angle);
    [MIDDLE[0] + RADIUS * share * sin, MIDDLE[1] + RADIUS * share * cos]
}

fn turn() -> impl Iterator<Item = f64> {
    (0..=STEPS).map(|k| 2.0 * PI * f64::from(k) / f64::from(STEPS))
}

/// Circles of equal intensity and rays of equal angle.
fn draw_web(canvas: &mut Canvas, scale: &Scale) {
    for tick in scale.ticks() {
        let share = scale.position(tick);
        let circle: Vec<_> = turn().map(|angle| place(angle, share)).collect();
        canvas.stroke(&circle, 1.0, GREY);
        let [x, y] = place(PI, share);
        if share > 0.0 {
            let unit = if share < 1.0 { "" } else { " cd" };
            canvas.text([x as u32 + 4, y as u32 + 2], &format!("{}{unit}", label(tick)), Font::Small);
        }
    }
    for k in 0..12 {
        let angle = PI * f64::from(k) / 6.0;
        canvas.stroke(&[place(angle, 0.0), place(angle, 1.0)], 1.0, GREY);
        let text = format!("{}", if k <= 6 { 30 * k } else { 360 - 30 * k });
        let [x, y] = place(angle, 1.06);
        let (wide, tall) = (Font::Small.width(&text), Font::Small.height());
        canvas.text([x as u32 - wide / 2, y as u32 - tall / 2], &text, Font::Small);
    }
}

/// Azimuths of the planes to draw \[rad\].
fn planes(photometry: &Photometry, luminaire: &Luminaire) -> Vec<f64> {
    if photometry.symmetry == Symmetry::Axial {
        return vec![0.0];
    }
    let (t, p) = photometry.web.brightest();
    let brightest = luminaire.direction(t, p);
    let (x, y) = (brightest.x, -brightest.z);
    let azimuth = atan2(y, x).rem_euclid(PI);
    let near = |other: f64| (azimuth - other).abs() < 0.01;
    let along_aim = x * x + y * y < 1e-6;
    let mut planes = vec![0.0, 0.5 * PI];
    if !along_aim && !near(0.0) && !near(0.5 * PI) && !near(PI) {
        planes.push(azimuth);
    }
    planes
}

/// The intensities around the plane of the azimuth `azimuth`, which lies on the right.
fn curve(luminaire: &Luminaire, scale: &Scale, azimuth: f64) -> Vec<[f64; 2]> {
    turn().map(|angle| place(angle, scale.position(intensity(luminaire, azimuth, angle)))).collect()
}

/// Intensity at `angle` from the aim in the plane of the azimuth `azimuth`; from 0 to pi it lies on the right \[cd\].
fn intensity(luminaire: &Luminaire, azimuth: f64, angle: f64) -> f64 {
    let ((sin, cos), (across, along)) = (sin_cos(azimuth), sin_cos(angle));
    luminaire.intensity(DVec3::new(across * cos, -along, -across * sin)).luminance()
}

/// What lies to the left and to the right in the plane of the azimuth `azimuth`, by the angles of the file.
fn halves(photometry: &Photometry, azimuth: f64) -> String {
    let right = azimuth * 180.0 / PI;
    let (left, right) = match photometry.measured.kind {
        Kind::C => (format!("C{}", label(right + 180.0)), format!("C{}", label(right))),
        // Vertical 90 is the C0 direction, and horizontal angles run clockwise: C90 is horizontal -90.
        Kind::A | Kind::B if right == 0.0 => ("vertical -90".to_owned(), "vertical 90".to_owned()),
        Kind::A | Kind::B if right == 90.0 => ("horizontal 90".to_owned(), "horizontal -90".to_owned()),
        Kind::A | Kind::B => return "the plane through the aim and the largest intensity".to_owned(),
    };
    format!("{left} on the left, {right} on the right")
}

/// A line and what it shows.
fn legend(canvas: &mut Canvas, row: u32, text: &str, colour: Rgb) {
    let y = HEIGHT - 70 + 20 * row;
    canvas.stroke(&[[20.0, f64::from(y) + 7.0], [60.0, f64::from(y) + 7.0]], 2.0, colour);
    canvas.text([70, y], text, Font::Small);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_legend_says_which_side_is_which() {
        let file = include_bytes!("../../tests/luminaires/type_b.ies");
        let photometry = Photometry::parse("type_b.ies", file).unwrap();
        let measured = &photometry.measured;
        let at = |list: &[f64], angle: f64| list.iter().position(|a| *a == angle).unwrap();
        let given = |horizontal: f64, vertical: f64| {
            measured.candela[at(&measured.planes, horizontal) * measured.angles.len() + at(&measured.angles, vertical)]
        };
        assert_ne!(given(30.0, 0.0), given(-30.0, 0.0));
        let luminaire = hanging(&photometry);
        let drawn = |azimuth: f64, degrees: f64| intensity(&luminaire, azimuth * PI / 180.0, degrees * PI / 180.0);
        let words = [
            "vertical -90 on the left, vertical 90 on the right",
            "horizontal 90 on the left, horizontal -90 on the right",
        ];
        assert_eq!([0.0, 0.5 * PI].map(|azimuth| halves(&photometry, azimuth)), words);
        for (is, shall_be) in [
            (drawn(0.0, 30.0), given(0.0, 30.0)),
            (drawn(0.0, -30.0), given(0.0, -30.0)),
            (drawn(90.0, 30.0), given(-30.0, 0.0)),
            (drawn(90.0, -30.0), given(30.0, 0.0)),
        ] {
            assert!((is / shall_be - 1.0).abs() < 1e-9, "{is} is not {shall_be}");
        }
    }
}
