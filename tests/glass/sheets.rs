//! Sheets that transmit in part: light straight through them against closed forms, and between estimators.

use crate::assert_same_bits_on_every_path;
use crate::common::scenes::{add_quad, closed_box, lambert, omni, point, spot_camera};
use crate::common::{Case, Estimate, assert_all, compare, difference, flux};
use lampyris::math::{DVec3, PI};
use lampyris::photometry::Colour;
use lampyris::scene::{Dielectric, Model, Reflectance, Surface};
use lampyris::validate::scenes::UP;

/// A sheet of `base` of which the share `t` transmits.
fn sheet(base: Colour, metallic: f64, roughness: f64, t: f64) -> Surface {
    let dielectric = Dielectric { transmission: t, ..Dielectric::PLAIN };
    let reflectance = Reflectance::layered(base, metallic, roughness, dielectric);
    Surface { reflectance, double_sided: true, ..lambert(0.0, 0.0) }
}

/// Schlick's factor of F0 = 0.04 with so much of a metal of reflectance `base`, by powers.
fn schlick(base: f64, metallic: f64, cosine: f64) -> f64 {
    let f0 = 0.04 * (1.0 - metallic) + base * metallic;
    f0 + (1.0 - f0) * lampyris::math::pow(1.0 - cosine, 5.0)
}

/// Meters on y = 0 along x and along the diagonal, 2 m below a lamp.
fn under_a_lamp() -> (String, Vec<f64>) {
    let places: Vec<f64> = (0..40).map(|i| 0.1 * f64::from(i)).collect();
    let job = "[run]\nbatches = 16\nhistories_per_batch = 16\n".to_owned()
        + &omni([0.0, 2.0, 0.0], 100.0)
        + &places.iter().enumerate().map(|(i, &x)| point(&format!("p{i}"), [x, 0.0, 0.0], UP)).collect::<String>()
        + &places.iter().enumerate().map(|(i, &x)| point(&format!("d{i}"), [x, 0.0, x], UP)).collect::<String>();
    let x2 = places.iter().map(|x| x * x).chain(places.iter().map(|x| 2.0 * x * x)).collect();
    (job, x2)
}

#[test]
fn lux_behind_a_sheet_is_lux_without_it_times_what_goes_straight_on() {
    for (rho, metallic, t) in [(0.8, 0.0, 0.5), (1.0, 0.0, 1.0), (0.6, 0.4, 0.7)] {
        let (job, x2) = under_a_lamp();
        let mut model = Model::default();
        let corner = DVec3::new(-8.0, 1.0, -8.0);
        add_quad(&mut model, corner, DVec3::Z * 16.0, DVec3::X * 16.0, sheet(Colour::grey(rho), metallic, 0.0, t));
        let estimates = Case::new(&job, model).estimates();
        for (estimate, x2) in estimates.iter().zip(x2) {
            let d2 = 4.0 + x2;
            let cosine = 2.0 / d2.sqrt();
            let straight = (1.0 - metallic) * t * rho * (1.0 - schlick(rho, metallic, cosine));
            let exact = 100.0 * cosine / d2 * straight;
            // As of a pane: what coordinates in f32 cost.
            assert!((estimate[0].mean / exact - 1.0).abs() < 1e-5, "{x2}: {} {exact}", estimate[0].mean);
            assert_eq!(estimate[0].standard_error, 0.0);
        }
    }
}

#[test]
fn lux_of_a_rough_sheet_is_less_by_what_its_outer_surface_reflects() {
    // What is under it reflects and transmits the rest in the shares 1 - t and t: the law itself, integrated, says how much that is.
    let (rho, roughness, t) = (0.8, 0.7, 0.5);
    let (job, x2) = under_a_lamp();
    let surface = sheet(Colour::grey(rho), 0.0, roughness, t);
    let black = sheet(Colour::BLACK, 0.0, roughness, 0.0).reflectance;
    let mut model = Model::default();
    add_quad(&mut model, DVec3::new(-8.0, 1.0, -8.0), DVec3::Z * 16.0, DVec3::X * 16.0, surface);
    let estimates = Case::new(&job, model).estimates();
    for (estimate, x2) in estimates.iter().zip(x2) {
        let d2 = 4.0 + x2;
        let cosine = 2.0 / d2.sqrt();
        let exact = 100.0 * cosine / d2 * t * rho * (1.0 - integral(&black, cosine));
        // The table of the albedo is exact to 5e-4.
        assert!((estimate[0].mean / exact - 1.0).abs() < 5e-4, "{x2}: {} {exact}", estimate[0].mean);
    }
}

/// What `law` reflects of light from `cosine`, by a midpoint rule over the directions.
fn integral(law: &Reflectance, cosine: f64) -> f64 {
    const SIDE: u32 = 400;
    let w_in = -DVec3::new((1.0 - cosine * cosine).sqrt(), cosine, 0.0);
    let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(SIDE);
    let value = |(i, j): (u32, u32)| {
        let (up, (sin, cos)) = ((1.0 - middle(i)).sqrt(), lampyris::math::sin_cos(2.0 * PI * middle(j)));
        let across = middle(i).sqrt();
        PI * law.evaluate(DVec3::Y, w_in, DVec3::new(across * cos, up, across * sin)).0[0]
    };
    (0..SIDE).flat_map(|i| (0..SIDE).map(move |j| (i, j))).map(value).sum::<f64>() / f64::from(SIDE * SIDE)
}

#[test]
fn a_sheet_that_absorbs_nothing_is_as_bright_as_an_even_room() {
    // Walls of 1 cd/m2 that reflect a half: 2 cd/m2 everywhere, and on a white sheet, whatever its parts.
    for t in [0.3, 1.0] {
        let mut model = closed_box(DVec3::ONE, &lambert(0.5, 1.0));
        let white = sheet(Colour::WHITE, 0.0, 0.8, t);
        add_quad(&mut model, DVec3::new(0.2, 0.5, 0.2), DVec3::X * 0.6, DVec3::Z * 0.6, white);
        let job = "[run]\nbatches = 4096\nhistories_per_batch = 64\nseed = 14\n".to_owned()
            + &spot_camera("above", [0.3, 0.9, 0.5], [0.5, 0.5, 0.5], [1.0, 0.0, 0.0])
            + &spot_camera("below", [0.3, 0.1, 0.5], [0.5, 0.5, 0.5], [1.0, 0.0, 0.0])
            + &spot_camera("wall", [0.5, 0.9, 0.5], [1.0, 0.4, 0.5], UP)
            + &point("meter", [0.5, 0.45, 0.5], UP);
        let case = Case::new(&job, model);
        let wanted = [("above", 2.0), ("below", 2.0), ("wall", 2.0), ("meter", 2.0 * PI)];
        let pairs = wanted.iter().zip(case.values());
        let mut all: Vec<_> =
            pairs.map(|((name, exact), found)| compare(format!("{t} {name}"), found, *exact)).collect();
        let (_, batches) = case.batches(0..u32::MAX);
        all.push(compare(format!("{t} absorbed"), flux(&batches, "absorbed"), 6.0 * PI));
        assert_all(&all);
    }
}

#[test]
fn a_cover_of_sheets_that_absorb_nothing_lets_out_all_light() {
    let job = "[run]\nbatches = 64\nhistories_per_batch = 2048\nseed = 15\n".to_owned()
        + &omni([0.4, 0.5, 0.6], 10.0)
        + &point("far", [3.0, 0.0, 0.0], UP);
    for (roughness, t) in [(0.0, 0.5), (0.6, 0.2), (1.0, 1.0)] {
        let case = Case::new(&job, closed_box(DVec3::ONE, &sheet(Colour::WHITE, 0.0, roughness, t)));
        let (_, batches) = case.batches(1..u32::MAX);
        let [emitted, escaped, absorbed] = ["emitted", "escaped", "absorbed"].map(|name| flux(&batches, name));
        assert_all(&[compare(format!("{roughness} {t} escaped"), escaped, emitted.mean)]);
        assert!(absorbed.mean.abs() <= 5.0 * absorbed.standard_error + 1e-9 * emitted.mean, "{absorbed:?}");
    }
}

/// A room of two halves with a sheet between them, a lamp in one and meters in both.
fn parted_room(estimator: &str, histories: u32) -> String {
    format!(
        "[run]\nbatches = 64\nhistories_per_batch = {histories}\nseed = 19\nchannels = \"rgb\"\n\
         [transport]\nestimator = \"{estimator}\"\n"
    ) + &point("lit", [0.6, 0.0, 0.4], UP)
        + &point("behind", [1.5, 0.0, 0.5], UP)
        + &point("corner", [1.97, 0.0, 0.5], UP)
        + &point("beside-the-sheet", [1.02, 0.4, 0.5], [1.0, 0.2, 0.0])
        + &spot_camera("wall", [1.5, 0.5, 0.5], [2.0, 0.7, 0.6], UP)
}

fn parted(surface: Surface) -> Model {
    let mut model = closed_box(DVec3::new(2.0, 1.0, 1.0), &lambert(0.6, 0.0));
    add_quad(&mut model, DVec3::X, DVec3::Y, DVec3::Z, surface);
    // The lamp has an extent: reverse paths never find one without by way of a mirror.
    add_quad(&mut model, DVec3::new(0.1, 0.95, 0.1), DVec3::X * 0.8, DVec3::Z * 0.8, lambert(0.0, 100.0));
    model
}

const TINT: Colour = Colour([0.9, 0.8, 0.3]);

#[test]
fn estimators_agree_in_a_room_parted_by_a_sheet() {
    for (finish, metallic, roughness, t) in [("polished", 0.0, 0.0, 0.5), ("metal", 0.4, 0.5, 0.8)] {
        let case = |estimator: &str, histories: u32| {
            Case::new(&parted_room(estimator, histories), parted(sheet(TINT, metallic, roughness, t)))
        };
        let (local, reverse) = (case("local", 4096), case("reverse", 16384));
        let names = local.job.sets().into_iter().map(|s| s.name);
        let pairs = names.zip(local.values().into_iter().zip(reverse.values()));
        assert_all(&pairs.map(|(name, (a, b))| difference(format!("{finish} {name}"), a, b)).collect::<Vec<_>>());
    }
}

#[test]
fn estimators_agree_on_what_an_eye_sees_of_a_sheet_and_through_it() {
    let case = |estimator: &str, histories: u32| {
        let seen = |name: &str, x: f64| {
            let camera = spot_camera(name, [x, 0.5, 0.5], [1.0, 0.4, 0.6], UP);
            // Each position of a pixel sees one or the other.
            camera.replace("samples = 1", "samples = 16")
        };
        let job = format!(
            "[run]\nbatches = 12288\nhistories_per_batch = {histories}\nseed = 20\n[transport]\nestimator = \"{estimator}\"\n"
        );
        let job = job + &seen("from-behind", 1.5) + &seen("from-the-lit-side", 0.5);
        Case::new(&job, parted(sheet(TINT, 0.0, 0.6, 0.5))).values()
    };
    let pairs = case("local", 32).into_iter().zip(case("reverse", 64));
    let named = ["from-behind", "from-the-lit-side"].iter().zip(pairs);
    assert_all(&named.map(|(name, (a, b))| difference(name, a, b)).collect::<Vec<_>>());
}

#[test]
fn flux_is_emitted_absorbed_and_nothing_else() {
    for surface in [sheet(TINT, 0.0, 0.7, 0.5), sheet(TINT, 0.3, 0.0, 0.8), sheet(Colour::WHITE, 0.0, 1.0, 1.0)] {
        let case = Case::new(&parted_room("local", 256), parted(surface));
        let (_, batches) = case.batches(1..u32::MAX);
        let [emitted, absorbed, escaped, lost] =
            ["emitted", "absorbed", "escaped", "lost"].map(|name| flux(&batches, name));
        assert_eq!((escaped.mean, lost.mean), (0.0, 0.0));
        assert!((emitted.mean - absorbed.mean).abs() < 5.0 * absorbed.standard_error + 1e-9, "{absorbed:?}");
    }
}

#[test]
fn a_sheet_that_neither_reflects_nor_absorbs_changes_nothing() {
    let nothing = Dielectric { f0: Colour::BLACK, f90: 0.0, transmission: 1.0 };
    let reflectance = Reflectance::layered(Colour::WHITE, 0.0, 0.5, nothing);
    let air = Surface { reflectance, double_sided: true, ..lambert(0.0, 0.0) };
    let job = parted_room("local", 256);
    let mut model = parted(air.clone());
    model.triangles.drain(12..14);
    model.surface_of.drain(12..14);
    let means = |model: Model| -> Vec<Estimate> { Case::new(&job, model).values() };
    for (a, b) in means(model).into_iter().zip(means(parted(air))) {
        assert!((a.mean / b.mean - 1.0).abs() < 1e-4, "{a:?} {b:?}");
    }
}

#[test]
fn every_path_gives_the_same_bits() {
    assert_same_bits_on_every_path(&parted_room("local", 64), &parted(sheet(TINT, 0.0, 0.6, 0.5)));
}
