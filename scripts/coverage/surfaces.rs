//! A cube with surfaces of every kind that is neither matt nor glossy: what is seen on them, by way of them, and what they light.

use super::cases::{camera, measured, tables};
use super::count::{Counted, count};
use super::replicate::Kind;
use lampyris::error::Result;
use lampyris::math::{DVec2, DVec3};
use lampyris::photometry::Colour;
use lampyris::scene::textures::{
    Charts, Coding, Coverage, Filter, Image, Layer, Texels, Textured, Textures, Transform, Wrap,
};
use lampyris::scene::{Delta, Dielectric, Glass, Model, Pane, Reflectance, Surface, Tabulated};
use lampyris::validate::experiment::Experiment;
use lampyris::validate::scenes::{UP, add_quad, box_walls, closed_box, lambert, point};
use std::sync::Arc;

/// Where things hang: the middle of the cube.
const MIDDLE: [f64; 3] = [0.5, 0.5, 0.5];

/// All cases, printed as they come.
pub fn run(replicates: u64, mut done: impl FnMut(&[Counted])) -> Result<Vec<Counted>> {
    let mut all = Vec::new();
    for case in [globe, pane, mirror, glass, phong, tabulated, texture, veil] {
        let counted = case(replicates)?;
        done(&counted);
        all.extend(counted);
    }
    Ok(all)
}

/// A cube under a ceiling of 100 cd/m2, walls, floor and ceiling of reflectance 0.5.
fn cube() -> Model {
    let mut model = closed_box(DVec3::ONE, &lambert(0.5, 0.0));
    model.surfaces[3] = lambert(0.5, 100.0);
    model
}

fn surface(reflectance: Reflectance) -> Surface {
    Surface { name: "sheet".into(), reflectance, double_sided: true, ..lambert(0.0, 0.0) }
}

/// An upright sheet across the middle of the cube, a third of it.
fn sheet(reflectance: Reflectance) -> Model {
    let mut model = cube();
    add_quad(&mut model, DVec3::new(0.5, 0.2, 0.2), DVec3::Y * 0.6, DVec3::Z * 0.6, surface(reflectance));
    model
}

/// The floor of the cube.
fn floor(reflectance: Reflectance) -> Model {
    let mut model = cube();
    model.surfaces[2] = Surface { double_sided: false, ..surface(reflectance) };
    model
}

/// A box, its fronts outside.
fn add_box(model: &mut Model, origin: DVec3, size: DVec3, reflectance: Reflectance) {
    let number = model.surfaces.len() as u32;
    model.surfaces.push(surface(reflectance));
    for [corner, u, v] in box_walls(size) {
        let first = model.positions.len() as u32;
        model.positions.extend([corner, corner + v, corner + u + v, corner + u].map(|p| origin + p));
        model.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        model.surface_of.extend([number; 2]);
    }
}

/// A pixel on `target`, a lux-meter beside a wall and one behind what hangs in the middle; by few histories.
fn case(name: &str, model: Model, views: [[f64; 3]; 2], n: u64) -> Result<Vec<Counted>> {
    case_of(32, name, model, views, n)
}

/// The same by so many histories a batch.
fn case_of(histories: u32, name: &str, model: Model, views: [[f64; 3]; 2], n: u64) -> Result<Vec<Counted>> {
    let [eye, target] = views;
    let job = tables("rqmc", 32, histories)
        + &camera("view", eye, target, 6.0, [2, 1])
        + "[[region]]\nname = \"both\"\ncamera = \"view\"\nrectangle = [0, 0, 2, 1]\n"
        + &point("near", [0.97, 0.3, 0.4], [-1.0, 0.0, 0.0])
        + &point("behind", [0.6, 0.1, 0.5], UP);
    let experiment = Experiment::new(&job, model)?;
    let wanted = [
        ("L of a pixel", Kind::Total(0, 0)),
        ("region of 2 pixels", Kind::Total(3, 0)),
        ("E 3 cm from a wall", Kind::Total(1, 0)),
        ("E behind or below", Kind::Total(2, 0)),
    ];
    let quantities = measured(&experiment, &wanted);
    Ok(count(&format!("{name}, rqmc, 32 x {histories}"), &experiment, quantities, n))
}

/// A bright panel in an opal box is all the light there is.
fn globe(n: u64) -> Result<Vec<Counted>> {
    let mut model = closed_box(DVec3::ONE, &lambert(0.5, 0.0));
    let opal = Reflectance::opal(Colour::grey(0.4), Colour::grey(0.5));
    add_box(&mut model, DVec3::splat(0.35), DVec3::splat(0.3), opal);
    add_quad(&mut model, DVec3::new(0.4, 0.5, 0.4), DVec3::X * 0.2, DVec3::Z * 0.2, lambert(0.5, 1000.0));
    case("lamp in an opal box", model, [[0.9, 0.1, 0.6], [0.5, 0.35, 0.5]], n)
}

fn pane(n: u64) -> Result<Vec<Counted>> {
    let glass = Reflectance::Delta(Delta::Pane(Pane::new(1.5, Colour::grey(0.8))));
    case("wall behind a pane", sheet(glass), [[0.9, 0.4, 0.6], [0.0, 0.5, 0.4]], n)
}

fn mirror(n: u64) -> Result<Vec<Counted>> {
    let law = Reflectance::Delta(Delta::Mirror(Colour::grey(0.85)));
    case("wall in a mirror", sheet(law), [[0.9, 0.4, 0.6], MIDDLE], n)
}

fn glass(n: u64) -> Result<Vec<Counted>> {
    let mut model = cube();
    let law = Reflectance::Delta(Delta::Glass(Glass::new(1.5, Colour::grey(1.0))));
    add_box(&mut model, DVec3::splat(0.35), DVec3::splat(0.3), law);
    case("wall through a block of glass", model, [[0.9, 0.4, 0.6], MIDDLE], n)
}

/// Peaked: few histories do not suffice, and say so.
fn phong(n: u64) -> Result<Vec<Counted>> {
    let law = || Reflectance::phong(Colour::grey(0.2), Colour::grey(0.5), 40.0);
    let views = [[0.9, 0.3, 0.5], [0.3, 0.0, 0.45]];
    let of = |histories| case_of(histories, "Phong floor, exponent 40", floor(law()), views, n);
    let mut counted = of(32)?;
    counted.extend(of(256)?);
    Ok(counted)
}

/// f = 0.05 + 0.25 sin sin' (1 - cos(phi))^2 / 4: light is thrown forward.
fn tabulated(n: u64) -> Result<Vec<Counted>> {
    let degrees = |x: u32| f64::from(x) * lampyris::math::PI / 180.0;
    let sine = |i: u32| lampyris::math::sin(degrees(10 * i));
    let forward = |k: u32| 0.5 * (1.0 - lampyris::math::cos(degrees(20 * k)));
    let f = |i: u32, j: u32, k: u32| 0.05 + 0.25 * sine(i) * sine(j) * forward(k) * forward(k);
    let row = |i: u32, j: u32| (0..10).map(|k| format!("{} ", f(i, j, k))).collect::<String>() + "\n";
    let rows: String = (0..10).flat_map(|i| (0..10).map(move |j| (i, j))).map(|(i, j)| row(i, j)).collect();
    let angles = |step: u32| (0..10).map(|i| format!(" {}", step * i)).collect::<String>();
    let text = format!("lampyris-brdf 1\nchannels 1\ntheta{}\nphi{}\n{rows}", angles(10), angles(20));
    let law = Reflectance::tabulated(Tabulated::parse("forward", text.as_bytes())?);
    case("tabulated floor", floor(law), [[0.9, 0.3, 0.5], [0.3, 0.0, 0.45]], n)
}

/// Makes the quad that was added as number `quad` vary with `textured`.
fn varying(mut model: Model, quad: usize, textured: Textured) -> Model {
    let mut of_surface = vec![None; model.surfaces.len()];
    of_surface[quad] = Some(textured);
    let mut charts = Charts::default();
    charts.push(2 * quad, [&[0.0, 0.0], &[1.0, 0.0], &[1.0, 1.0]]);
    charts.push(2 * quad + 1, [&[0.0, 0.0], &[1.0, 1.0], &[0.0, 1.0]]);
    model.textures = Textures::new(of_surface, charts);
    model
}

/// A chequered image of 8 x 8 texels, bright and dark, opaque or not, laid on a whole quad.
fn chequers(bright: [u8; 4], dark: [u8; 4]) -> Layer {
    let texels = (0..64).map(|i| if (i + i / 8) % 2 == 0 { bright } else { dark }).collect();
    let image = Arc::new(Image::new(8, Texels::Eight(texels)).expect("whole rows"));
    let transform = Transform { u: DVec2::X, v: DVec2::Y, offset: DVec2::ZERO };
    Layer { image, coding: Coding::Data, filter: Filter::Bilinear, wrap: [Wrap::Clamp; 2], set: 0, transform }
}

fn textured(base_layer: Layer, data_layer: Option<Layer>, coverage: Coverage) -> Textured {
    Textured {
        sets: 1,
        coloured: false,
        base: Colour::WHITE,
        base_layer: Some(base_layer),
        factors: [0.0, 1.0],
        data_layer,
        dielectric: Dielectric::PLAIN,
        transmission_layer: None,
        emission: Colour::BLACK,
        emission_layer: None,
        uniform_law: false,
        coverage,
        alpha: 1.0,
    }
}

/// A floor whose colour and roughness change from texel to texel.
fn texture(n: u64) -> Result<Vec<Counted>> {
    let colours = chequers([220, 220, 220, 255], [30, 30, 30, 255]);
    let roughness = chequers([0, 255, 0, 255], [0, 100, 0, 255]);
    let law = Reflectance::metallic_roughness(Colour::grey(0.5), 0.0, 0.7);
    let model = varying(floor(law), 2, textured(colours, Some(roughness), Coverage::Whole));
    case("floor with textures", model, [[0.9, 0.3, 0.5], [0.3, 0.0, 0.45]], n)
}

/// A screen that covers a half in the mean.
fn veil(n: u64) -> Result<Vec<Counted>> {
    let screen = chequers([180, 180, 180, 230], [180, 180, 180, 20]);
    let model = varying(sheet(Reflectance::Lambert(Colour::grey(0.7))), 6, textured(screen, None, Coverage::Blend));
    case("wall behind a screen", model, [[0.9, 0.4, 0.6], [0.0, 0.5, 0.4]], n)
}
