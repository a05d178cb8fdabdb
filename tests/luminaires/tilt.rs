//! What a lamp gives in a luminaire that is tilted: the three geometries of LM-63, by a second reading.

use crate::scenes::{UP, assert_near, luminaire, lux, planned};
use crate::{bytes, photometry};
use lampyris::math::{PI, sin_cos};
use lampyris::scene::Scene;

/// Angles of tilt and factors: up to 90 degrees, up to 180, one that ends before, and a single one.
const TABLES: [&[(f64, f64)]; 4] = [
    &[(0.0, 1.0), (45.0, 0.9), (90.0, 0.7)],
    &[(0.0, 0.95), (30.0, 1.0), (90.0, 0.8), (120.0, 0.6), (180.0, 0.5)],
    &[(0.0, 1.0), (60.0, 0.4)],
    &[(0.0, 0.8)],
];

/// What is left of the light, `tilt` degrees from straight down, as plainly as it can be read. Geometry 1 is a lamp that stands when the
/// luminaire looks down, 3 one that lies, and both turn with it; 2 is one that lies and stays so, and so never turns.
fn left(geometry: u32, table: &[(f64, f64)], tilt: f64) -> f64 {
    let (last, factor) = *table.last().unwrap();
    let turned = match geometry {
        2 => 0.0,
        // Half a table: the lamp upside down is as the lamp upright.
        _ if last <= 90.0 => 90.0 - (90.0 - tilt).abs(),
        _ => tilt,
    };
    let piece = table.windows(2).find(|ends| turned <= ends[1].0);
    piece.map_or(factor, |ends| {
        let [(a, low), (b, high)] = [ends[0], ends[1]];
        (low * (b - turned) + high * (turned - a)) / (b - a)
    })
}

/// The lamp `full.ies` with that table, hung as `how` says.
fn hung(geometry: u32, table: &[(f64, f64)], how: &str) -> lampyris::error::Result<Scene> {
    let list = |of: fn(&(f64, f64)) -> f64| table.iter().map(|pair| format!("{} ", of(pair))).collect::<String>();
    let (angles, factors) = (list(|pair| pair.0), list(|pair| pair.1));
    let tilt = format!("TILT=INCLUDE\n{geometry}\n{}\n{angles}\n{factors}", table.len());
    let text = String::from_utf8(bytes("full.ies")).unwrap().replace("TILT=NONE", &tilt);
    planned(&luminaire("tilting.ies", how), &[("tilting.ies", text.into_bytes())]).map(|(scene, _)| scene)
}

#[test]
fn a_tilted_lamp_gives_what_its_table_says() {
    let tilt = photometry("tilt_include.ies").tilt.unwrap();
    for (degrees, factor) in
        [(0.0, 1.0), (22.5, 0.95), (45.0, 0.9), (67.5, 0.8), (90.0, 0.7), (135.0, 0.9), (180.0, 1.0)]
    {
        assert!((tilt.factor(degrees) - factor).abs() < 1e-12, "{degrees}");
    }
}

#[test]
fn a_tilted_luminaire_has_the_factor_of_its_lamp_once() {
    let tilted = "position = [0.0, 0.0, 0.0]\naim = [1.0, -1.0, 0.0]\nc0 = [1.0, 1.0, 0.0]";
    let scene = |file: &str, how: &str| planned(&luminaire(file, how), &[]).unwrap_or_else(|e| panic!("{e}")).0;
    let flux = |file: &str, how: &str| scene(file, how).sources.flux();
    assert_near(flux("tilt_include.ies", tilted), 0.9 * flux("full.ies", tilted), 1e-12);
    assert_near(flux("tilt_include.ies", "position = [0.0, 0.0, 0.0]"), flux("full.ies", tilted), 1e-12);
}

#[test]
fn the_three_geometries_of_a_lamp_are_those_of_a_second_reading() {
    let meter = [0.7, -2.0, 0.4];
    for degrees in [0.0, 10.0, 45.0, 60.0, 75.0, 90.0, 100.0, 135.0, 180.0] {
        let (sin, cos) = sin_cos(degrees * PI / 180.0);
        // Whichever way it is tilted, along C0 or across.
        for aim in [[sin, -cos, 0.0], [0.0, -cos, sin]] {
            let how = format!("position = [0, 0, 0]\naim = {aim:?}\nc0 = [{cos}, {sin}, 0.01]");
            let untilted = planned(&luminaire("full.ies", &how), &[]).unwrap_or_else(|e| panic!("{e}")).0;
            for (geometry, table) in (1..=3).flat_map(|geometry| TABLES.map(|table| (geometry, table))) {
                let scene = hung(geometry, table, &how).unwrap_or_else(|e| panic!("{e}"));
                let expected = left(geometry, table, degrees);
                assert_near(scene.sources.flux() / untilted.sources.flux(), expected, 1e-9);
                // The factor is one of the whole web: it turns with the luminaire, and keeps its shape.
                assert_near(lux(&scene, meter, UP) / lux(&untilted, meter, UP), expected, 1e-9);
            }
        }
    }
}

#[test]
fn other_geometries_are_refused() {
    for geometry in [0, 4] {
        let error = hung(geometry, TABLES[0], "position = [0, 0, 0]").err().unwrap().to_string();
        let expected = format!("lamp-to-luminaire geometry (line 5) = {geometry}: 1 .. 3");
        assert!(error.contains(&expected), "{expected}: {error}");
    }
}
