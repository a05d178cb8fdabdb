//! Sources and direct light: points, spots, parallel light, rectangles, a polygon, an even sky. Nothing reflects.

use super::closed_forms::{
    flux_through_rectangle, inverse_square, parallel_corner, perpendicular_corner, polygon, spot_solid_angle,
};
use super::experiment::{Experiment, flux};
use super::scenes::{
    UP, add_polygon, add_quad, closed_box, in_parallel_light, integrating_sphere, lambert, omni, point, points,
    rectangle, run,
};
use super::{Case, Comparison, Theme};
use crate::error::Result;
use crate::math::{DVec3, PI, acos, cos, sin_cos};
use crate::photometry::Colour;
use crate::scene::{Light, Model};
use crate::tally::statistics::Estimate;

const THEME: Theme = Theme("Sources and direct light");
/// Sizes of the rectangles: width, depth or height, distance \[m\].
const RECTANGLES: [(f64, f64, f64); 4] = [(1.0, 1.0, 1.0), (2.0, 1.0, 1.0), (3.0, 2.0, 0.5), (0.3, 0.3, 2.0)];

/// The cases, in order.
pub(super) fn cases() -> Vec<Case> {
    vec![
        THEME.case("direct/point-source", "inverse square and cosine law", "I h / d^3 and I x / d^3", point_source),
        THEME.case("direct/spot", "falloff and flux of a spot", "falloff of KHR_lights_punctual; its integral", spot),
        THEME.case("direct/parallel-light", "cosine law, nothing behind", "E cos(60 deg)", parallel_light),
        THEME.case(
            "direct/flux-through-rectangle",
            "flux of a point source through a rectangle, from a grid and from histories",
            "4 I atan(ab / (h sqrt(a^2 + b^2 + h^2)))",
            rectangle_flux,
        ),
        THEME.case(
            "direct/parallel-rectangle",
            "area light above corner, middle and a point outside",
            "configuration factor of a parallel rectangle, signed sums of it",
            parallel_rectangle,
        ),
        THEME.case(
            "direct/perpendicular-rectangle",
            "area light on a wall, a window above its sill",
            "configuration factor of a perpendicular rectangle",
            perpendicular_rectangle,
        ),
        THEME.case("direct/polygon", "area light with 32 sides", "Lambert's sum over the edges", thirty_two_sides),
        THEME.case("direct/even-sky", "the same luminance from everywhere above", "pi L and pi L / 2", even_sky),
    ]
}

/// A one-sided black quad far below everything, so that scenes without surfaces have one.
fn floor_far_below() -> Model {
    let mut model = Model::default();
    add_quad(&mut model, DVec3::new(-1.0, -50.0, -1.0), DVec3::Z, DVec3::X, lambert(0.0, 0.0));
    model
}

fn point_source() -> Result<Vec<Comparison>> {
    let distances = [0.0, 1.0, 3.0];
    let mut job = run(1, 16) + &omni([0.0, 2.0, 0.0], 100.0);
    for (i, x) in distances.iter().enumerate() {
        job += &point(&format!("horizontal{i}"), [*x, 0.0, 0.0], UP);
        job += &point(&format!("vertical{i}"), [*x, 0.0, 0.0], [-1.0, 0.0, 0.0]);
    }
    let values = Experiment::new(&job, floor_far_below())?.values();
    let mut all = Vec::new();
    for (x, found) in distances.iter().zip(values.chunks(2)) {
        for (i, direction) in ["horizontal", "vertical"].iter().enumerate() {
            all.push(Comparison::new(
                format!("{direction}, x = {x} m"),
                "lx",
                found[i],
                inverse_square(100.0, 2.0, *x)[i],
            ));
        }
    }
    Ok(all)
}

fn spot_model(mut model: Model, inner: f64, outer: f64) -> Model {
    let (position, direction) = (DVec3::ZERO, DVec3::NEG_Y);
    model.lights.push(Light::Spot { position, direction, intensity: Colour::grey(100.0), inner, outer });
    model
}

fn spot() -> Result<Vec<Comparison>> {
    let (inner, outer) = (0.3, 0.8);
    // Half way in the cosine the ramp is a quarter.
    let middle = acos(0.5 * (cos(inner) + cos(outer)));
    let angles = [("full", 0.1, 25.0), ("on the ramp", middle, 25.0 / 4.0), ("outside", 0.9, 0.0)];
    let towards_spot = |(_, angle, _)| {
        let (s, c) = sin_cos(angle);
        ([2.0 * s, -2.0 * c, 0.0], [-s, c, 0.0])
    };
    let job = run(1, 16) + &points("p", angles.map(towards_spot));
    let values = Experiment::new(&job, spot_model(floor_far_below(), inner, outer))?.values();
    let mut all: Vec<Comparison> =
        values.iter().zip(angles).map(|(e, (name, _, exact))| Comparison::new(name, "lx", *e, exact)).collect();
    // An omni beside it: the source of a history is chosen in proportion to flux.
    let job = run(2048, 32)
        + &integrating_sphere(0.5)
        + &omni([0.0; 3], 1.0)
        + &point("wall", [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]);
    let (_, batches) = Experiment::new(&job, spot_model(Model::default(), inner, outer))?.batches(1..u32::MAX);
    let emitted = 100.0 * spot_solid_angle(inner, outer) + 4.0 * PI;
    all.push(Comparison::new("emitted by spot and omni", "lm", flux(&batches, "emitted"), emitted));
    let indirect = super::experiment::estimates(&batches)[0][0];
    all.push(Comparison::new("indirect, spot and omni in a sphere", "lx", indirect, emitted / (4.0 * PI)));
    Ok(all)
}

fn parallel_light() -> Result<Vec<Comparison>> {
    let model = in_parallel_light(floor_far_below(), DVec3::new(0.75f64.sqrt(), -0.5, 0.0), 1000.0);
    let job = run(1, 16) + &point("before", [0.0; 3], UP) + &point("behind", [0.0; 3], [0.0, -1.0, 0.0]);
    let values = Experiment::new(&job, model)?.values();
    Ok(vec![
        Comparison::new("at 60 degrees", "lx", values[0], 500.0),
        Comparison::new("from behind", "lx", values[1], 0.0),
    ])
}

fn rectangle_flux() -> Result<Vec<Comparison>> {
    let found = |job: String| {
        let mut model = Model::default();
        add_quad(&mut model, DVec3::new(-3.0, 0.0, -2.0), DVec3::Z * 4.0, DVec3::X * 6.0, lambert(0.0, 0.0));
        let experiment = Experiment::new(&(job + &omni([0.0, 1.5, 0.0], 100.0)), model)?;
        Ok(experiment.batches(0..u32::MAX))
    };
    let grid = "[[grid]]\nname = \"floor\"\norigin = [-3, 0, 2]\nu = [6, 0, 0]\nv = [0, 0, -4]\n\
                normal = [0, 1, 0]\ncolumns = 300\nrows = 200\n";
    let (fixed, batches) = found(run(1, 16) + grid)?;
    let sum = fixed[0].iter().sum::<f64>() * 24.0 / fixed[0].len() as f64;
    let sum = Estimate { n: batches.len() as u64, mean: sum, standard_error: 0.0 };
    let (_, batches) = found(run(16384, 32) + &point("unused", [0.0; 3], UP))?;
    let exact = flux_through_rectangle(100.0, 1.5, 6.0, 4.0);
    Ok(vec![
        Comparison::new("sum over a grid of 300 x 200", "lm", sum, exact).within(1e-5),
        Comparison::new("absorbed by the rectangle", "lm", flux(&batches, "absorbed"), exact),
    ])
}

/// Illuminances at points under an emissive polygon.
fn luminaire(luminance: f64, corners: &[DVec3], meters: &str) -> Result<Vec<Estimate>> {
    let mut model = Model::default();
    add_polygon(&mut model, corners, lambert(0.0, luminance));
    Ok(Experiment::new(&(run(8192, 32) + meters), model)?.values())
}

fn parallel_rectangle() -> Result<Vec<Comparison>> {
    let meters = point("centre", [1.0, 0.0, 0.5], UP)
        + &point("corner", [0.0, 0.0, 0.0], UP)
        + &point("outside", [-1.0, 0.0, 0.0], UP);
    let e = luminaire(1000.0, &rectangle(DVec3::Y * 2.0, DVec3::X * 2.0, DVec3::Z), &meters)?;
    let corner = |a, b| 1000.0 * PI * parallel_corner(a, b, 2.0);
    let mut all = vec![
        Comparison::new("2 x 1 m, below its middle", "lx", e[0], 4.0 * corner(1.0, 0.5)),
        Comparison::new("2 x 1 m, below a corner", "lx", e[1], corner(2.0, 1.0)),
        Comparison::new("2 x 1 m, 1 m outside", "lx", e[2], corner(3.0, 1.0) - corner(1.0, 1.0)),
    ];
    for (a, b, c) in RECTANGLES {
        let e = luminaire(1.0, &rectangle(DVec3::Y * c, DVec3::X * a, DVec3::Z * b), &point("corner", [0.0; 3], UP))?;
        all.push(Comparison::new(format!("{a} x {b} m at {c} m"), "lx", e[0], PI * parallel_corner(a, b, c)));
    }
    Ok(all)
}

fn perpendicular_rectangle() -> Result<Vec<Comparison>> {
    let mut all = Vec::new();
    for (a, b, c) in RECTANGLES {
        // Receiver plane y = 0, rectangle in the plane z = -c, its front towards the receiver.
        let corners = rectangle(DVec3::Z * -c, DVec3::X * a, DVec3::Y * b);
        let e = luminaire(1.0, &corners, &point("corner", [0.0; 3], UP))?;
        all.push(Comparison::new(format!("{a} x {b} m at {c} m"), "lx", e[0], PI * perpendicular_corner(a, b, c)));
    }
    let window = rectangle(DVec3::new(-1.0, 0.0, -2.0), DVec3::X * 2.0, DVec3::Y * 1.5);
    let e = luminaire(2000.0, &window, &point("sill", [0.0; 3], UP))?;
    let exact = 2.0 * 2000.0 * PI * perpendicular_corner(1.0, 1.5, 2.0);
    all.push(Comparison::new("window 2 x 1.5 m at 2 m", "lx", e[0], exact));
    Ok(all)
}

fn thirty_two_sides() -> Result<Vec<Comparison>> {
    let corner = |i: u32| {
        let (sin, cos) = sin_cos(f64::from(i) * PI / 16.0);
        DVec3::new(cos, 2.0, sin)
    };
    let corners: Vec<DVec3> = (0..32).map(corner).collect();
    let at = |x: f64| [x, 0.0, 0.0];
    let distances = [0.0, 1.0, 3.0];
    let e = luminaire(1000.0, &corners, &points("p", distances.map(|x| (at(x), UP))))?;
    let exact = |x: f64| polygon(1000.0, DVec3::from(at(x)), DVec3::Y, &corners);
    let compare = |(&x, e): (&f64, &Estimate)| Comparison::new(format!("x = {x} m"), "lx", *e, exact(x));
    Ok(distances.iter().zip(&e).map(compare).collect())
}

fn even_sky() -> Result<Vec<Comparison>> {
    // A black box whose walls and ceiling all have 1000 cd/m2, its floor without light: the sky over a field.
    let mut model = closed_box(DVec3::new(2.0, 1.0, 2.0), &lambert(0.0, 1000.0));
    let floor = 2;
    model.surfaces[floor] = lambert(0.0, 0.0);
    let place = [0.8, 0.0, 0.9];
    let job = run(16384, 32) + &point("horizontal", place, UP) + &point("vertical", place, [1.0, 0.0, 0.0]);
    let e = Experiment::new(&job, model)?.values();
    Ok(vec![
        Comparison::new("horizontal", "lx", e[0], 1000.0 * PI),
        Comparison::new("vertical", "lx", e[1], 500.0 * PI),
    ])
}
