//! Luminaires by their files and luminous areas, near and far: cases like 5.2 to 5.5 of CIE 171:2006. The files are written here, so
//! that every intensity is known; nothing reflects.

use super::clipping::factor;
use super::experiment::{Experiment, flux};
use super::scenes::{UP, add_quad, closed_box, lambert, point, points, rectangle, run};
use super::{Case, Comparison, Theme};
use crate::error::Result;
use crate::job::Job;
use crate::math::{DVec3, PI, cos, sin, sin_cos};
use crate::scene::Model;
use crate::scene::photometric_web::Photometry;
use crate::tally::statistics::Estimate;

const THEME: Theme = Theme("Luminaires and luminous areas");
/// Planes and angles of the asymmetric web \[degrees\].
const PLANES: [f64; 5] = [0.0, 90.0, 180.0, 270.0, 360.0];
const ANGLES: [f64; 7] = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0];

/// The cases, in order.
pub(super) fn cases() -> Vec<Case> {
    vec![
        THEME.case(
            "luminaire/asymmetric-web",
            "lux under an IES file, plane by plane, on and between its angles",
            "I cos / d^2 with the intensity of the file",
            asymmetric_web,
        ),
        THEME.case(
            "luminaire/asymmetric-flux",
            "what a closed box absorbs of it",
            "midpoint rule over the file's intensities",
            asymmetric_flux,
        ),
        THEME.case(
            "luminaire/disc-near-and-far",
            "a disc of 100 lm as a point and with its extent",
            "I / d^2; M r^2 / (r^2 + d^2)",
            disc,
        ),
        THEME.case(
            "luminaire/area-on-floor",
            "a luminous rectangle in the ceiling, horizontal meters",
            "configuration factor by Lambert's sum over the edges",
            || area(UP),
        ),
        THEME.case(
            "luminaire/area-on-walls",
            "the same on vertical meters that see a part of it",
            "the same, what lies below the horizon cut off",
            || area([-1.0, 0.0, 0.0]),
        ),
    ]
}

/// Intensity of the asymmetric web in a plane of its file, at one of its angles \[cd\].
fn intensity(plane: usize, angle: usize) -> f64 {
    let t = ANGLES[angle] * PI / 180.0;
    let strength = [400.0, 250.0, 100.0, 550.0, 400.0][plane];
    // The planes agree straight below.
    let value = 300.0 + (strength - 300.0) * sin(t) * sin(t) - 50.0 * sin(t) * sin(t) * sin(t);
    (10.0 * value).round() / 10.0
}

/// An IES file of a web and an opening, which hangs in `model` as the TOML of its entry says.
fn hang(mut model: Model, file: &str, entry: &str) -> Result<Model> {
    let web = Photometry::parse("file", file.as_bytes())?;
    let job = Job::parse(
        &format!("scene = \"in memory\"\n[[luminaire]]\nfile = \"x\"\n{entry}{}", point("p", [0.0; 3], UP)),
        "in memory",
    )?;
    model.hang(("in memory", "luminaire[0]"), &job.luminaires[0], &web)?;
    Ok(model)
}

fn asymmetric_file() -> String {
    let list = |values: &[f64]| values.iter().map(|v| format!("{v} ")).collect::<String>();
    let row = |plane: usize| list(&(0..ANGLES.len()).map(|angle| intensity(plane, angle)).collect::<Vec<_>>());
    let rows: Vec<String> = (0..PLANES.len()).map(row).collect();
    let (angles, planes) = (list(&ANGLES), list(&PLANES));
    format!("IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 7 5 1 2 0 0 0\n1 1 20\n{angles}\n{planes}\n{}\n", rows.join("\n"))
}

/// The web at `position`, C0 along +X, C90 along -Z.
fn asymmetric(model: Model, position: [f64; 3]) -> Result<Model> {
    hang(model, &asymmetric_file(), &format!("position = {position:?}\n"))
}

fn floor() -> Model {
    let mut model = Model::default();
    add_quad(&mut model, DVec3::new(-9.0, -1.0, -9.0), DVec3::Z * 18.0, DVec3::X * 18.0, lambert(0.0, 0.0));
    model
}

fn asymmetric_web() -> Result<Vec<Comparison>> {
    // 3 m below, in every plane at every other angle; and half way between two planes and two angles.
    let mut asked: Vec<(String, f64, f64, f64)> = Vec::new();
    for (plane, c) in PLANES.into_iter().enumerate().take(4) {
        for angle in [0, 2, 3, 4] {
            let name = format!("C {c}, gamma {}", ANGLES[angle]);
            asked.push((name, c, ANGLES[angle], intensity(plane, angle)));
        }
    }
    let corners = [(3, 2), (3, 3), (4, 2), (4, 3)];
    let between = corners.iter().map(|&(plane, angle)| intensity(plane, angle)).sum::<f64>() / 4.0;
    asked.push(("C 315, gamma 37.5".to_owned(), 315.0, 37.5, between));
    let degrees = PI / 180.0;
    let foot = |c: f64, gamma: f64| {
        let ((sin_c, cos_c), (sin, cos)) = (sin_cos(c * degrees), sin_cos(gamma * degrees));
        [3.0 * sin / cos * cos_c, 0.0, -3.0 * sin / cos * sin_c]
    };
    let job = run(1, 16) + &points("p", asked.iter().map(|&(_, c, gamma, _)| (foot(c, gamma), UP)));
    let found = Experiment::new(&job, asymmetric(floor(), [0.0, 3.0, 0.0])?)?.values();
    let exact = |gamma: f64, intensity: f64| {
        let c = cos(gamma * degrees);
        intensity * c * c * c / 9.0
    };
    let compare = |((name, _, gamma, i), e): (&(String, f64, f64, f64), &Estimate)| {
        Comparison::new(name, "lx", *e, exact(*gamma, *i))
    };
    Ok(asked.iter().zip(&found).map(compare).collect())
}

fn asymmetric_flux() -> Result<Vec<Comparison>> {
    // The planes are a quarter turn apart, so that the mean over azimuth is that of the four.
    let mean = |angle: usize| (0..4).map(|plane| intensity(plane, angle)).sum::<f64>() / 4.0;
    let (cells, width) = (3600, 0.5 * PI / 3600.0);
    let cell = |k: usize| {
        let t = (k as f64 + 0.5) * width;
        let place = t / (15.0 * PI / 180.0);
        let (low, share) = (place as usize, place.fract());
        2.0 * PI * width * sin(t) * (mean(low) * (1.0 - share) + mean(low + 1) * share)
    };
    let exact = (0..cells).map(cell).sum();
    let walls = closed_box(DVec3::new(4.0, 4.0, 4.0), &lambert(0.0, 0.0));
    let job = run(64, 16) + &point("p", UP, UP);
    let (_, batches) = Experiment::new(&job, asymmetric(walls, [1.5, 3.0, 2.2])?)?.batches(1..2);
    Ok(vec![Comparison::new("absorbed by the walls", "lm", flux(&batches, "absorbed"), exact).within(1e-6)])
}

fn disc() -> Result<Vec<Comparison>> {
    // 100/pi cd on the axis, by single degrees, round with a diameter of 0.2 m.
    let angles: String = (0..=90).map(|k| format!("{k} ")).collect();
    let values: String =
        (0..=90).map(|k| format!("{} ", 100.0 / PI * cos(f64::from(k) * PI / 180.0).max(0.0))).collect();
    let file = format!("IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 91 1 1 2 -0.2 -0.2 0\n1 1 20\n{angles}\n0\n{values}\n");
    let distances = [0.05, 0.1, 0.3, 1.0];
    let meters = points("p", distances.map(|d| ([0.0, -d, 0.0], UP)));
    let mut all = Vec::new();
    for extent in ["point", "opening"] {
        let entry = format!("position = [0.0, 0.0, 0.0]\nextent = \"{extent}\"\n");
        let found = Experiment::new(&(run(2048, 64) + &meters), hang(floor(), &file, &entry)?)?.values();
        for (d, e) in distances.iter().zip(found) {
            let r2 = if extent == "point" { 0.0 } else { 0.01 };
            let exact = 100.0 / PI / (r2 + d * d);
            // Cosines by single degrees, 64 sides for a circle.
            all.push(Comparison::new(format!("{extent}, {d} m below"), "lx", e, exact).within(1e-3));
        }
    }
    Ok(all)
}

/// Lux under a luminous ceiling of 2 x 1 m, 2 m up, on meters that look along `normal`.
fn area(normal: [f64; 3]) -> Result<Vec<Comparison>> {
    let corners = rectangle(DVec3::new(-1.0, 2.0, -0.5), DVec3::X * 2.0, DVec3::Z);
    let mut model = Model::default();
    add_quad(&mut model, corners[0], DVec3::X * 2.0, DVec3::Z, lambert(0.0, 1000.0));
    let places = [0.0, 0.5, 0.9, 2.0, 4.0].map(|x| [x, 0.0, 0.3]);
    let job = run(16384, 32) + &points("p", places.map(|place| (place, normal)));
    let found = Experiment::new(&job, model)?.values();
    let exact = |place: [f64; 3]| 1000.0 * PI * factor(place.into(), normal.into(), &corners);
    let compare =
        |(&place, e): (&[f64; 3], &Estimate)| Comparison::new(format!("x = {} m", place[0]), "lx", *e, exact(place));
    Ok(places.iter().zip(&found).map(compare).collect())
}
