//! Daylight: skies without obstruction, through openings of a black room, past masks, and between white surfaces.
//!
//! References are closed forms, or sums over the opening by midpoints of the luminance that comes from beyond it: they share no
//! code with the sky of a scene.

use super::closed_forms::{parallel_corner, perpendicular_corner};
use super::experiment::Experiment;
use super::glass::{self, WINDOW, transmittance};
use super::scenes::{UP, add_quad, add_quad_with_hole, box_walls, lambert, point, run};
use super::{Case, Comparison, Theme};
use crate::error::Result;
use crate::math::{DVec3, PI, acos, exp};
use crate::photometry::Colour;
use crate::scene::{Delta, Model, Pane, Reflectance, Surface};

const THEME: Theme = Theme("Daylight");
/// Luminance of the zenith \[cd/m2\].
const ZENITH: f64 = 1000.0;
/// Accuracy of sums over an opening where a mask cuts it.
const MIDPOINTS: f64 = 1e-3;

/// The cases, in order.
pub(super) fn cases() -> Vec<Case> {
    vec![
        THEME.case(
            "daylight/unobstructed",
            "horizontal and vertical plane under even, overcast and clear skies, and the sun",
            "pi L, 7 pi L/9 and their like; sums over the hemisphere; E_sun cos",
            unobstructed,
        ),
        THEME.case(
            "daylight/roof",
            "an opening in the roof, with and without a mask over half of it",
            "view factor of a parallel rectangle; sums over the opening",
            roof,
        ),
        THEME.case(
            "daylight/facade",
            "a window, free, below an overhang, and before a wall across the street",
            "view factor of a perpendicular rectangle; sums over the opening",
            facade,
        ),
        THEME.case(
            "daylight/sky-types",
            "an opening in the roof under clear and cloudy skies of the CIE standard, the sun aside",
            "sums over the opening of the formula of the standard, written once more",
            sky_types,
        ),
        THEME.case(
            "daylight/glazed",
            "panes in the roof and in a facade",
            "sums over the opening of overcast sky times Fresnel's transmittance",
            glazed,
        ),
        THEME.case(
            "daylight/outside",
            "what ground that reflects and a luminous wall across the street send through a window",
            "sums over the opening",
            outside,
        ),
        THEME.case(
            "daylight/white-furnace",
            "white surfaces in an even environment",
            "pi L: they cannot be told from it",
            white,
        ),
    ]
}

/// `[sky]` with this model and the luminance of its zenith.
pub fn sky(model: &str) -> String {
    format!("[sky]\nmodel = {model}\nzenith_luminance = {ZENITH}\n")
}

/// `[[opening]]` for a rectangle given by a corner and two edges.
pub fn opening([origin, u, v]: [DVec3; 3]) -> String {
    let corners = [origin, origin + u, origin + u + v, origin + v].map(|p| p.to_array());
    format!("[[opening]]\ncorners = {corners:?}\n")
}

/// Illuminance at `place` of a plane with `normal` through a rectangle, by the luminance that comes from beyond it along each unit
/// vector: midpoints \[lx\].
pub fn through([origin, u, v]: [DVec3; 3], place: DVec3, normal: DVec3, luminance: impl Fn(DVec3) -> f64) -> f64 {
    let (across, steps) = (u.cross(v), 400);
    let step = 1.0 / f64::from(steps);
    let mut sum = 0.0;
    for i in 0..steps {
        for j in 0..steps {
            let way = origin + (f64::from(i) + 0.5) * step * u + (f64::from(j) + 0.5) * step * v - place;
            let w = way.normalize();
            let area = across.dot(w).abs() * step * step;
            sum += luminance(w) * w.dot(normal).max(0.0) * area / way.length_squared();
        }
    }
    sum
}

/// Luminance of the traditional overcast sky over black ground \[cd/m2\].
fn overcast(w: DVec3) -> f64 {
    if w.y < 0.0 { 0.0 } else { ZENITH * (1.0 + 2.0 * w.y) / 3.0 }
}

/// A black room of 4 x 3 x 5 m with an opening of 1 x 1 m in the roof: x 1 .. 2, z 2 .. 3.
fn under_roof() -> (Model, [DVec3; 3]) {
    let hole = [DVec3::new(1.0, 3.0, 2.0), DVec3::X, DVec3::Z];
    (room(3, [0.25, 0.5], [0.4, 0.6], &lambert(0.0, 0.0)), hole)
}

/// The same with a window of 2 x 1.4 m in the wall z = 0: x 1 .. 3, y 1 .. 2.4.
fn behind_facade() -> (Model, [DVec3; 3]) {
    let hole = [DVec3::new(1.0, 1.0, 0.0), DVec3::X * 2.0, DVec3::Y * 1.4];
    (room(4, [0.25, 0.75], [1.0 / 3.0, 0.8], &lambert(0.0, 0.0)), hole)
}

/// A room of 4 x 3 x 5 m with the insides of its walls like `surface`, and a hole in the wall with this number.
pub fn room(open: usize, across: [f64; 2], along: [f64; 2], surface: &Surface) -> Model {
    let mut model = Model::default();
    for (i, wall) in box_walls(DVec3::new(4.0, 3.0, 5.0)).into_iter().enumerate() {
        match i == open {
            true => add_quad_with_hole(&mut model, wall, across, along, surface),
            false => add_quad(&mut model, wall[0], wall[1], wall[2], surface.clone()),
        }
    }
    model
}

fn unobstructed() -> Result<Vec<Comparison>> {
    let (side, meters) = ([1.0, 0.0, 0.0], point("up", [0.0; 3], UP));
    let meters = meters + &point("side", [0.0; 3], side);
    // The vertical plane below a gradation phi(z)/phi(1): int 2 phi(z) sqrt(1 - z^2) dz over the heights.
    let type_1 = |z: f64| (1.0 + 4.0 * exp(-0.7 / z)) / (1.0 + 4.0 * exp(-0.7));
    let steps = 100_000;
    let heights = || (0..steps).map(|i| (f64::from(i) + 0.5) / f64::from(steps));
    let sum = |of: &dyn Fn(f64) -> f64| heights().map(of).sum::<f64>() * ZENITH / f64::from(steps);
    let of_1 = [sum(&|z| 2.0 * PI * z * type_1(z)), sum(&|z| 2.0 * type_1(z) * (1.0 - z * z).sqrt())];
    let sun = "[sky.sun]\nazimuth_degrees = 90\nelevation_degrees = 30\nilluminance = 5000\n";
    let skies = [
        ("even sky", sky("\"uniform\""), [PI * ZENITH, 0.5 * PI * ZENITH]),
        ("overcast sky", sky("\"overcast\""), [7.0 * PI * ZENITH / 9.0, 0.968_043_220_043 * ZENITH]),
        ("CIE type 1", sky("1"), of_1),
        (
            "sun at 30 degrees in an even sky",
            sky("\"uniform\"") + sun,
            [PI * ZENITH + 2500.0, 0.5 * PI * ZENITH + 5000.0 * 0.75f64.sqrt()],
        ),
    ];
    let mut all = Vec::new();
    for (name, sky, expected) in skies {
        let mut model = Model::default();
        add_quad(&mut model, DVec3::new(-0.1, -9.0, -0.1), DVec3::Z * 0.2, DVec3::X * 0.2, lambert(0.0, 0.0));
        let found = Experiment::new(&(run(1024, 32) + &sky + &meters), model)?.values();
        for ((what, expected), found) in ["horizontal", "vertical"].iter().zip(expected).zip(found) {
            all.push(Comparison::new(format!("{name}, {what}"), "lx", found, expected).within(1e-8));
        }
    }
    Ok(all)
}

/// The horizontal illuminance at `place` in `model` under `sky`, with its opening told.
fn indoors(
    model: &Model,
    sky: String,
    hole: [DVec3; 3],
    place: [f64; 3],
) -> Result<crate::tally::statistics::Estimate> {
    let job = run(1024, 32) + &sky + &opening(hole) + &point("p", place, UP);
    Ok(Experiment::new(&job, model.clone())?.values()[0])
}

fn roof() -> Result<Vec<Comparison>> {
    let (model, hole) = under_roof();
    let corner = PI * ZENITH * parallel_corner(1.0, 1.0, 3.0);
    let found = indoors(&model, sky("\"uniform\""), hole, [1.0, 0.0, 2.0])?;
    let mut all = vec![Comparison::new("even sky, below a corner", "lx", found, corner)];
    let mut masked = model.clone();
    add_quad(&mut masked, DVec3::new(1.5, 3.5, -9.0), DVec3::X * 9.0, DVec3::Z * 20.0, lambert(0.0, 0.0));
    for (name, place) in [("below it", [1.5, 0.8, 2.5]), ("beside it", [3.0, 0.8, 4.0])] {
        let from = DVec3::from(place);
        let free = through(hole, from, DVec3::Y, overcast);
        let found = indoors(&model, sky("\"overcast\""), hole, place)?;
        all.push(Comparison::new(format!("overcast sky, {name}"), "lx", found, free).within(1e-4));
        let hidden = |w: DVec3| if (from + w * ((3.5 - from.y) / w.y)).x > 1.5 { 0.0 } else { overcast(w) };
        let found = indoors(&masked, sky("\"overcast\""), hole, place)?;
        let exact = through(hole, from, DVec3::Y, hidden);
        all.push(Comparison::new(format!("overcast sky, {name}, masked"), "lx", found, exact).within(MIDPOINTS));
    }
    Ok(all)
}

fn facade() -> Result<Vec<Comparison>> {
    let (model, hole) = behind_facade();
    let sill = 2.0 * PI * ZENITH * perpendicular_corner(1.0, 1.4, 2.0);
    let found = indoors(&model, sky("\"uniform\""), hole, [2.0, 1.0, 2.0])?;
    let mut all = vec![Comparison::new("even sky, 2 m before the sill", "lx", found, sill)];
    let mut street = model.clone();
    add_quad(&mut street, DVec3::new(-60.0, -40.0, -6.0), DVec3::X * 120.0, DVec3::Y * 44.0, lambert(0.0, 0.0));
    let mut overhang = model.clone();
    add_quad(&mut overhang, DVec3::new(-40.0, 2.5, -1.0), DVec3::X * 80.0, DVec3::Z, lambert(0.0, 0.0));
    for (name, place) in [("1 m inside", [2.0, 0.8, 1.0]), ("3 m inside", [0.7, 0.8, 3.0])] {
        let from = DVec3::from(place);
        let before = |w: DVec3| if (from + w * ((-6.0 - from.z) / w.z)).y < 4.0 { 0.0 } else { overcast(w) };
        let below =
            |w: DVec3| if w.y > 0.0 && (from + w * ((2.5 - from.y) / w.y)).z > -1.0 { 0.0 } else { overcast(w) };
        let free = through(hole, from, DVec3::Y, overcast);
        let found = indoors(&model, sky("\"overcast\""), hole, place)?;
        all.push(Comparison::new(format!("overcast sky, {name}"), "lx", found, free).within(1e-4));
        for (what, model, exact) in [
            ("wall across the street", &street, through(hole, from, DVec3::Y, before)),
            ("overhang", &overhang, through(hole, from, DVec3::Y, below)),
        ] {
            let found = indoors(model, sky("\"overcast\""), hole, place)?;
            all.push(Comparison::new(format!("overcast sky, {name}, {what}"), "lx", found, exact).within(MIDPOINTS));
        }
    }
    Ok(all)
}

/// a, b, c, d, e of some types of the CIE standard general sky (ISO 15469), by their numbers.
const TYPES: [(u32, [f64; 5]); 4] = [
    (4, [1.1, -0.8, 2.0, -1.5, 0.15]),
    (7, [0.0, -1.0, 5.0, -2.5, 0.3]),
    (12, [-1.0, -0.32, 10.0, -3.0, 0.45]),
    (15, [-1.0, -0.15, 24.0, -2.8, 0.15]),
];

/// Luminance of a type of the standard sky with the sun along `sun`, over that of the zenith.
fn relative([a, b, c, d, e]: [f64; 5], sun: DVec3, w: DVec3) -> f64 {
    let gradation = |height: f64| 1.0 + a * exp(b / height);
    let indicatrix = |cosine: f64| 1.0 + c * (exp(d * acos(cosine)) - exp(0.5 * PI * d)) + e * cosine * cosine;
    gradation(w.y) * indicatrix(w.dot(sun)) / (gradation(1.0) * indicatrix(sun.y))
}

fn sky_types() -> Result<Vec<Comparison>> {
    let (model, hole) = under_roof();
    let place = [1.8, 0.8, 2.3];
    // 30 degrees high in the east, so that it is in no opening.
    let sun = DVec3::new(0.75f64.sqrt(), 0.5, 0.0);
    let mut all = Vec::new();
    for (number, parameters) in TYPES {
        let sky = sky(&number.to_string()) + "[sky.sun]\nazimuth_degrees = 90\nelevation_degrees = 30\n";
        let exact = through(hole, place.into(), DVec3::Y, |w| ZENITH * relative(parameters, sun, w));
        let found = indoors(&model, sky, hole, place)?;
        all.push(Comparison::new(format!("type {number}, below an opening"), "lx", found, exact).within(1e-4));
    }
    Ok(all)
}

fn glazed() -> Result<Vec<Comparison>> {
    let pane = Reflectance::Delta(Delta::Pane(Pane::new(WINDOW.0, Colour::grey(WINDOW.1))));
    let mut all = Vec::new();
    for (name, (mut model, hole), out, place) in
        [("roof", under_roof(), DVec3::Y, [1.8, 0.8, 3.4]), ("facade", behind_facade(), DVec3::NEG_Z, [0.7, 0.8, 1.5])]
    {
        let [origin, u, v] = hole;
        add_quad(&mut model, origin + 0.01 * out - 0.1 * (u + v), 1.2 * u, 1.2 * v, glass::of(pane.clone()));
        let seen = |w: DVec3| overcast(w) * transmittance(acos(w.dot(out)));
        let exact = through(hole, place.into(), DVec3::Y, seen);
        let found = indoors(&model, sky("\"overcast\""), hole, place)?;
        all.push(Comparison::new(format!("pane in the {name}"), "lx", found, exact).within(1e-4));
    }
    Ok(all)
}

fn outside() -> Result<Vec<Comparison>> {
    let (model, hole) = behind_facade();
    let place = [2.2, 1.6, 1.0];
    let ground = 0.3;
    // Ground in the open reflects pi times its luminance of what the sky sends.
    let below = ground * 7.0 / 9.0 * ZENITH;
    let reflecting = sky("\"overcast\"") + &format!("ground_reflectance = {ground}\n");
    let of_ground = |w: DVec3| if w.y < 0.0 { below } else { overcast(w) };
    let luminous = 400.0;
    let mut street = model.clone();
    add_quad(&mut street, DVec3::new(-60.0, -40.0, -6.0), DVec3::X * 120.0, DVec3::Y * 44.0, lambert(0.0, luminous));
    let from = DVec3::from(place);
    let of_wall = |w: DVec3| if (from + w * ((-6.0 - from.z) / w.z)).y < 4.0 { luminous } else { overcast(w) };
    let towards = |model: &Model, sky: String| -> Result<_> {
        let job = run(1024, 32) + &sky + &opening(hole) + &point("p", place, [0.0, 0.0, -1.0]);
        Ok(Experiment::new(&job, model.clone())?.values()[0])
    };
    let exact = |seen: &dyn Fn(DVec3) -> f64| through(hole, from, DVec3::NEG_Z, seen);
    Ok(vec![
        Comparison::new("ground of reflectance 0.3", "lx", towards(&model, reflecting)?, exact(&of_ground))
            .within(1e-3),
        Comparison::new(
            "wall across the street of 400 cd/m2",
            "lx",
            towards(&street, sky("\"overcast\""))?,
            exact(&of_wall),
        )
        .within(MIDPOINTS),
    ])
}

fn white() -> Result<Vec<Comparison>> {
    let mut model = Model::default();
    let white = Surface { double_sided: true, ..lambert(1.0, 0.0) };
    for (u, v) in [(DVec3::X, DVec3::Z), (DVec3::Y, DVec3::X), (DVec3::Z, DVec3::Y)] {
        add_quad(&mut model, DVec3::ZERO, u, v, white.clone());
    }
    let even = sky("\"uniform\"") + "ground_reflectance = 1.0\n";
    let meters = point("floor", [0.3, 0.0, 0.4], UP) + &point("aslant", [0.6, 0.5, 0.5], [-1.0, 0.3, -0.5]);
    let found = Experiment::new(&(run(16384, 64) + &even + &meters), model)?.values();
    let compare = |(name, found)| Comparison::new(name, "lx", found, PI * ZENITH);
    Ok(["in a white corner, on its floor", "in a white corner, in the air"]
        .into_iter()
        .zip(found)
        .map(compare)
        .collect())
}
