//! Every kind of surface through every estimator: in an even room it shows its albedo, and local and reverse estimation agree on it.

mod common;

use common::scenes::{add_quad, bumpy_sphere, closed_box, lambert, point, spot_camera};
use common::{Case, Comparison, assert_all, compare, difference};
use lampyris::math::{DVec2, DVec3, PI, to_world};
use lampyris::photometry::Colour;
use lampyris::random::cosine_hemisphere;
use lampyris::scene::{Delta, Dielectric, Glass, Model, Pane, Reflectance, Surface, Tabulated};

/// A measured law that throws light forward: every 30 and 90 degrees.
fn tabulated() -> Reflectance {
    let row = |i: u32, j: u32| (0..3).map(|k| format!("{} ", 0.06 + 0.03 * f64::from(i * j * k))).collect::<String>();
    let rows: String = (0..4).flat_map(|i| (0..4).map(move |j| row(i, j) + "\n")).collect();
    let text = format!("lampyris-brdf 1\nchannels 1\ntheta 0 30 60 90\nphi 0 90 180\n{rows}");
    Reflectance::tabulated(Tabulated::parse("table", text.as_bytes()).unwrap())
}

/// A dielectric as KHR_materials_ior and KHR_materials_specular make it.
fn specular(metallic: f64, roughness: f64) -> Reflectance {
    let dielectric = Dielectric { f0: Colour::grey(0.12), f90: 0.8, ..Dielectric::PLAIN };
    Reflectance::layered(Colour::grey(0.5), metallic, roughness, dielectric)
}

/// A dielectric of which the share `t` transmits.
fn transmitting(t: f64, metallic: f64, roughness: f64) -> Reflectance {
    Reflectance::layered(Colour::grey(0.7), metallic, roughness, Dielectric { transmission: t, ..Dielectric::PLAIN })
}

/// Every law that a flat surface may have.
fn laws() -> Vec<(&'static str, Reflectance)> {
    let share = Colour::grey;
    let glossy = |base, metallic, roughness| Reflectance::metallic_roughness(share(base), metallic, roughness);
    vec![
        ("lambert", Reflectance::Lambert(share(0.6))),
        ("dielectric", glossy(0.6, 0.0, 0.3)),
        ("rough metal", glossy(0.8, 1.0, 0.7)),
        ("polished metal", glossy(0.8, 1.0, 0.0)),
        ("polished dielectric", glossy(0.6, 0.0, 0.0)),
        ("ior and specular", specular(0.0, 0.5)),
        ("ior and specular, half metal", specular(0.5, 0.35)),
        ("phong", Reflectance::phong(share(0.2), share(0.6), 20.0)),
        ("mirror", Reflectance::Delta(Delta::Mirror(share(0.85)))),
        ("tabulated", tabulated()),
        ("opal", Reflectance::opal(share(0.4), share(0.5))),
        ("pane", Reflectance::Delta(Delta::Pane(Pane::new(1.5, share(0.9))))),
        ("rough sheet", transmitting(0.5, 0.0, 0.6)),
        ("polished sheet", transmitting(0.4, 0.0, 0.0)),
        ("sheet with some metal", transmitting(0.7, 0.3, 0.4)),
        ("sheet without a base", transmitting(1.0, 0.0, 1.0)),
    ]
}

fn sheet(reflectance: Reflectance) -> Surface {
    Surface { reflectance, double_sided: true, ..lambert(0.0, 0.0) }
}

/// The share of an even luminance that a surface shows under the cosine `mu`: the integral of its law, and what is no part of it.
fn shown(law: &Reflectance, mu: f64) -> f64 {
    const SIDE: u32 = 600;
    if law.sides().is_some() || matches!(law, Reflectance::Delta(_)) {
        let (reflected, transmitted) = law.shares(mu);
        return (reflected + transmitted).luminance();
    }
    let to_eye = DVec3::new((1.0 - mu * mu).sqrt(), mu, 0.0);
    let value = |(i, j): (u32, u32)| {
        let u = DVec2::new(f64::from(i) + 0.5, f64::from(j) + 0.5) / f64::from(SIDE);
        PI * law.evaluate(DVec3::Y, -to_world(DVec3::Y, cosine_hemisphere(u)), to_eye).luminance()
    };
    let finite: f64 = (0..SIDE).flat_map(|i| (0..SIDE).map(move |j| (i, j))).map(value).sum();
    let unscattered = law.delta_reflectance(mu).unwrap_or(Colour::BLACK) + law.straight(mu);
    finite / f64::from(SIDE * SIDE) + unscattered.luminance()
}

#[test]
fn in_an_even_room_every_surface_shows_what_it_reflects_and_lets_through() {
    // Black walls of 3 cd/m2 and a sheet that sees nothing else, from above and, flatter, from below.
    let eyes = [("above", [0.2, 0.9, 0.5], 0.8), ("below", [0.2, 0.3, 0.5], (4.0f64 / 13.0).sqrt())];
    let run = |batches: u32, histories: u32| {
        format!("[run]\nbatches = {batches}\nhistories_per_batch = {histories}\nseed = 71\n")
    };
    let mut all: Vec<Comparison> = Vec::new();
    for (name, law) in laws() {
        let mut model = closed_box(DVec3::ONE, &lambert(0.0, 3.0));
        add_quad(&mut model, DVec3::new(0.3, 0.5, 0.3), DVec3::Z * 0.4, DVec3::X * 0.4, sheet(law.clone()));
        let cameras = eyes.iter().map(|(name, eye, _)| spot_camera(name, *eye, [0.5, 0.5, 0.5], [0.0, 0.0, 1.0]));
        // Of an eye ray that is mirrored or goes on by chance each batch sees one or the other.
        let run = match law.has_delta() || law.is_veil() {
            true => run(if law.is_sheet() { 16384 } else { 4096 }, 1) + "sampling = \"random\"\n",
            false => run(64, 512),
        };
        let values = Case::new(&(run + &cameras.collect::<String>()), model).values();
        for ((from, _, mu), value) in eyes.iter().zip(values) {
            all.push(compare(format!("{name} {from}"), value, 3.0 * shown(&law, *mu)).within(1e-4));
        }
    }
    assert_all(&all);
}

/// A cube under a bright ceiling whose walls are of every kind, with a ball of glass in it.
fn room() -> Model {
    let mut model = closed_box(DVec3::ONE, &lambert(0.5, 0.0));
    let wall = |reflectance| Surface { reflectance, ..lambert(0.0, 0.0) };
    // The walls x = 0 and x = 1, floor and ceiling, z = 0 and z = 1.
    model.surfaces[0] = wall(Reflectance::phong(Colour::grey(0.2), Colour::grey(0.5), 20.0));
    model.surfaces[1] = wall(tabulated());
    model.surfaces[2] = wall(specular(0.2, 0.6));
    model.surfaces[3] = lambert(0.5, 100.0);
    model.surfaces[4] = wall(Reflectance::Delta(Delta::Mirror(Colour::grey(0.8))));
    let number = model.surfaces.len() as u32;
    model.surfaces.push(sheet(Reflectance::Delta(Delta::Glass(Glass::new(1.5, Colour::grey(0.5))))));
    for face in bumpy_sphere(1) {
        let first = model.positions.len() as u32;
        model.positions.extend(face.map(|p| 0.12 * p.as_dvec3() + DVec3::new(0.5, 0.3, 0.5)));
        model.triangles.push([first, first + 1, first + 2]);
        model.surface_of.push(number);
    }
    model
}

#[test]
fn local_and_reverse_agree_on_walls_of_every_kind_around_a_ball_of_glass() {
    let eye = [0.7, 0.6, 0.8];
    let seen = [
        ("phong", [0.0, 0.4, 0.6]),
        ("tabulated", [1.0, 0.3, 0.3]),
        ("specular", [0.3, 0.0, 0.6]),
        ("mirror", [0.6, 0.5, 0.0]),
    ];
    let receivers = point("air", [0.4, 0.6, 0.3], [-1.0, 0.2, 0.3])
        + &seen.map(|(name, at)| spot_camera(name, eye, at, [0.1, 1.0, 0.0])).concat()
        // Through glass each position of a pixel goes one way of many.
        + &spot_camera("glass", eye, [0.52, 0.32, 0.5], [0.1, 1.0, 0.0]).replace("samples = 1", "samples = 16");
    let case = |estimator: &str, histories: u32, batches: u32| {
        let run = format!(
            "[run]\nhistories_per_batch = {histories}\nbatches = {batches}\nseed = 72\n[transport]\nestimator = \"{estimator}\"\n"
        );
        Case::new(&(run + &receivers), room())
    };
    let (local, reverse) = (case("local", 128, 704), case("reverse", 2048, 128));
    let names = local.job.sets().into_iter().map(|s| s.name);
    let pairs = names.zip(local.values().into_iter().zip(reverse.values()));
    assert_all(&pairs.map(|(name, (a, b))| difference(name, a, b)).collect::<Vec<_>>());
}
