//! Surfaces that vary from place to place: light reflected and emitted by textures against exact values, and local against reverse
//! estimation of all of it.

mod common;

use common::scenes::{add_quad, closed_box, lambert, point, spot_camera};
use common::{Case, assert_all, compare, difference, flux};
use lampyris::math::{DVec2, DVec3, PI};
use lampyris::photometry::Colour;
use lampyris::scene::textures::{
    Charts, Coding, Coverage, Filter, Image, Layer, Texels, Textured, Textures, Transform, Wrap,
};
use lampyris::scene::{Dielectric, Light, Model, Reflectance, Surface};
use lampyris::validate::closed_forms::polygon;
use std::sync::Arc;

/// A texture of `width` columns with these texels.
fn layer(width: usize, texels: &[[u8; 3]], filter: Filter, coding: Coding) -> Layer {
    let texels = texels.iter().map(|&[r, g, b]| [r, g, b, 255]).collect();
    let image = Arc::new(Image::new(width, Texels::Eight(texels)).expect("whole rows"));
    Layer { image, coding, filter, wrap: [Wrap::Clamp; 2], set: 0, transform: Transform::IDENTITY }
}

/// A matt grey material that emits nothing, to be varied.
fn plain(base: f64) -> Textured {
    Textured {
        sets: 1,
        coloured: false,
        base: Colour::grey(base),
        base_layer: None,
        factors: [0.0, 1.0],
        data_layer: None,
        dielectric: Dielectric::PLAIN,
        transmission_layer: None,
        emission: Colour::BLACK,
        emission_layer: None,
        uniform_law: false,
        coverage: Coverage::Whole,
        alpha: 1.0,
    }
}

/// The model made of quads, with those that are named varying: (0, 0) is the corner of each and u, v run along its edges.
fn varied(mut model: Model, textured: Vec<(usize, Textured)>) -> Model {
    let mut of_surface = vec![None; model.surfaces.len()];
    let mut charts = Charts::default();
    for (quad, textured) in textured {
        for (triangle, corners) in
            [(2 * quad, [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]), (2 * quad + 1, [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]])]
        {
            charts.push(triangle, [&corners[0], &corners[1], &corners[2]]);
        }
        of_surface[quad] = Some(textured);
    }
    model.textures = Textures::new(of_surface, charts);
    model
}

/// Values of an 8-bit image that stand for themselves.
fn stored(value: u8) -> f64 {
    f64::from(value) / 255.0
}

/// Eight by four texels, all different.
fn chequers() -> Vec<[u8; 3]> {
    (0..32u8).map(|i| [if (i + i / 8) % 2 == 0 { 230 - 3 * i } else { 2 * i }; 3]).collect()
}

/// Illuminance at `at` with `normal` of the chequers of 8 x 4 on the rectangle of 2 x 1 m in the plane y = `height`, of the luminance
/// `of` each value \[lx\].
fn of_chequers(height: f64, at: DVec3, normal: DVec3, of: impl Fn(u8) -> f64) -> f64 {
    let texel = |i: usize| {
        let (x, z) = ((i % 8) as f64 * 0.25, (i / 8) as f64 * 0.25);
        let corner = |dx: f64, dz: f64| DVec3::new(x + dx * 0.25, height, z + dz * 0.25);
        [corner(0.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0), corner(1.0, 0.0)]
    };
    let seen = |(i, value): (usize, &[u8; 3])| polygon(of(value[0]), at, normal, &texel(i)).abs();
    chequers().iter().enumerate().map(seen).sum()
}

const METER: [f64; 3] = [0.7, 0.4, 0.3];

#[test]
fn a_chequered_floor_reflects_texel_by_texel() {
    let mut model = Model::default();
    add_quad(&mut model, DVec3::ZERO, DVec3::Z, DVec3::X * 2.0, lambert(0.5, 0.0));
    // u runs along Z, so the image is laid by a transform: (u, v) of the image is (x, z) of the floor.
    let turned = Transform { u: DVec2::Y, v: DVec2::X, ..Transform::IDENTITY };
    let base = Layer { transform: turned, ..layer(8, &chequers(), Filter::Nearest, Coding::Data) };
    let mut model = varied(model, vec![(0, Textured { base_layer: Some(base), ..plain(0.9) })]);
    model.lights.push(Light::Directional { direction: DVec3::NEG_Y, illuminance: Colour::grey(100.0) });
    let luminance = |value: u8| 0.9 * stored(value) * 100.0 / PI;
    let mut job =
        "[run]\nhistories_per_batch = 4096\nbatches = 64\nseed = 3\n".to_owned() + &point("e", METER, [0.0, -1.0, 0.0]);
    let texels = [(0usize, 0usize), (5, 1), (6, 1), (7, 3)];
    for (i, (column, row)) in texels.iter().enumerate() {
        let at = [0.25 * *column as f64 + 0.07, 0.0, 0.25 * *row as f64 + 0.2];
        job += &spot_camera(&format!("t{i}"), [1.0, 1.0, 0.5], at, [0.0, 0.0, 1.0]);
    }
    let values = Case::new(&job, model).values();
    // Sets are cameras first, then points.
    let mut all = Vec::new();
    for (i, (column, row)) in texels.into_iter().enumerate() {
        all.push(compare(format!("texel {column} {row}"), values[i], luminance(chequers()[8 * row + column][0])));
    }
    let exact = of_chequers(0.0, METER.into(), DVec3::NEG_Y, luminance);
    all.push(compare("lux above the floor", values[texels.len()], exact));
    assert_all(&all);
}

/// A black box of 2 x 1 x 1 m whose ceiling has a texture that emits 1000 cd/m2 where it is white.
fn lit_ceiling(filter: Filter) -> Model {
    // The quad of the ceiling is [y, x, z]: u along x, v along z.
    let model = closed_box(DVec3::new(2.0, 1.0, 1.0), &lambert(0.0, 0.0));
    let glow = layer(8, &chequers(), filter, Coding::Data);
    let mut model =
        varied(model, vec![(3, Textured { emission: Colour::grey(1000.0), emission_layer: Some(glow), ..plain(0.0) })]);
    model.surfaces[3] = lambert(0.0, 500.0);
    model
}

#[test]
fn a_texture_that_emits_gives_the_lux_of_its_texels_and_the_flux_of_their_mean() {
    let luminance = |value: u8| 1000.0 * stored(value);
    let near = [0.6, 0.93, 0.4];
    let job = "[run]\nhistories_per_batch = 4096\nbatches = 64\nseed = 4\n".to_owned()
        + &point("far", METER, [0.0, 1.0, 0.0])
        + &point("near", near, [0.0, 1.0, 0.0])
        + &point("side", [0.0, 0.5, 0.5], [1.0, 0.0, 0.0]);
    let case = Case::new(&job, lit_ceiling(Filter::Nearest));
    let values = case.values();
    let exact = |at: [f64; 3], normal| of_chequers(1.0, at.into(), normal, luminance);
    let mut all = vec![
        compare("far", values[0], exact(METER, DVec3::Y)),
        compare("near", values[1], exact(near, DVec3::Y)),
        compare("side", values[2], exact([0.0, 0.5, 0.5], DVec3::X)),
    ];
    let mean = chequers().iter().map(|t| luminance(t[0])).sum::<f64>() / 32.0;
    for filter in [Filter::Nearest, Filter::Bilinear] {
        let case = Case::new(&job, lit_ceiling(filter));
        // Bilinear and clamped, every texel counts the same as well.
        let (_, batches) = case.batches(0..u32::MAX);
        all.push(compare(format!("{filter:?} emitted"), flux(&batches, "emitted"), PI * 2.0 * mean));
        all.push(compare(format!("{filter:?} absorbed"), flux(&batches, "absorbed"), PI * 2.0 * mean));
    }
    assert_all(&all);
    let chosen = case.scene.sources.flux();
    assert!((chosen / (PI * 2.0 * mean) - 1.0).abs() < 5e-3, "the flux by which it is chosen: {chosen}");
}

#[test]
fn triangles_on_a_black_part_of_a_texture_are_no_emitters() {
    let mut texels = vec![[0; 3]; 64 * 64];
    texels[64 * 10 + 50] = [255; 3];
    let glow = layer(64, &texels, Filter::Nearest, Coding::Data);
    let part = Transform { u: 0.25 * DVec2::X, v: 0.25 * DVec2::Y, ..Transform::IDENTITY };
    let dark = Layer { transform: part, ..glow.clone() };
    let textured = |layer| Textured { emission: Colour::WHITE, emission_layer: Some(layer), ..plain(0.0) };
    let mut model = Model::default();
    add_quad(&mut model, DVec3::ZERO, DVec3::X, DVec3::Z, lambert(0.0, 0.5));
    add_quad(&mut model, DVec3::Y, DVec3::X, DVec3::Z, lambert(0.0, 0.5));
    let model = varied(model, vec![(0, textured(dark)), (1, textured(glow))]);
    let case = Case::new(&point("p", METER, [0.0, 1.0, 0.0]), model);
    let emitters = &case.scene.sources.emitters;
    // The bright texel has u = 50.5/64 > v = 10.5/64: it lies on the first triangle of the second quad. That the other is dark is known
    // when all its texels are looked at, but not from the parts of the image that it touches.
    assert_eq!(emitters.iter().map(|e| e.primitive).collect::<Vec<_>>(), [2, 3]);
    let [bright, unknown] = [0, 1].map(|i| emitters[i].luminance.luminance());
    assert!((bright - 2.0 / 4096.0).abs() < 1.2e-3 && unknown <= 1e-3, "{bright} {unknown}");
}

/// A cube with a ceiling that glows in a pattern, matt walls with a texture, and a floor of varying colour, roughness and metallic.
fn room() -> Model {
    let mut model = closed_box(DVec3::ONE, &lambert(0.6, 0.0));
    let floor = [[0, 90, 0], [0, 160, 255], [0, 255, 0], [0, 120, 128]];
    let colours = [[240, 120, 60], [60, 200, 90], [30, 80, 250], [250, 250, 120]];
    let glossy = Textured {
        base_layer: Some(layer(2, &colours, Filter::Bilinear, Coding::Srgb)),
        factors: [1.0, 1.0],
        data_layer: Some(layer(2, &floor, Filter::Nearest, Coding::Data)),
        ..plain(1.0)
    };
    let wall = Textured { base_layer: Some(layer(8, &chequers(), Filter::Bilinear, Coding::Srgb)), ..plain(1.0) };
    let glow = layer(4, &[[255, 200, 90], [10, 10, 10], [120, 130, 255], [0, 0, 0]], Filter::Bilinear, Coding::Srgb);
    let lamp = Textured { emission: Colour::grey(200.0), emission_layer: Some(glow), ..plain(0.5) };
    model.surfaces[2] =
        Surface { reflectance: Reflectance::metallic_roughness(Colour::grey(0.4), 0.4, 0.6), ..lambert(0.0, 0.0) };
    model.surfaces[3] = lambert(0.5, 60.0);
    varied(model, vec![(0, wall), (2, glossy), (3, lamp)])
}

#[test]
fn local_and_reverse_agree_where_everything_varies() {
    let receivers = point("air", [0.3, 0.2, 0.4], [1.0, 0.2, 0.3])
        + &point("under", [0.8, 0.95, 0.6], [0.0, 1.0, 0.0])
        + &spot_camera("matt", [0.7, 0.5, 0.5], [0.0, 0.3, 0.7], [0.0, 1.0, 0.0])
        + &spot_camera("metal", [0.3, 0.7, 0.4], [0.3, 0.0, 0.8], [1.0, 0.0, 0.0])
        + &spot_camera("gloss", [0.6, 0.8, 0.4], [0.2, 0.0, 0.2], [1.0, 0.0, 0.0])
        + &spot_camera("flat", [0.6, 0.8, 0.4], [0.8, 0.0, 0.3], [1.0, 0.0, 0.0])
        + &spot_camera("lamp", [0.5, 0.1, 0.5], [0.3, 1.0, 0.4], [1.0, 0.0, 0.0]);
    let case = |estimator: &str, histories: u32| {
        let run = format!(
            "[run]\nhistories_per_batch = {histories}\nbatches = 64\nseed = 62\n[transport]\nestimator = \"{estimator}\"\n"
        );
        Case::new(&(run + &receivers), room())
    };
    let (local, reverse) = (case("local", 1024), case("reverse", 4096));
    let names = local.job.sets().into_iter().map(|s| s.name);
    let all: Vec<_> = names
        .zip(local.values().into_iter().zip(reverse.values()))
        .map(|(name, (a, b))| difference(name, a, b))
        .collect();
    assert_all(&all);
}

/// White texels with an alpha of 255 or less where the chequers are dark.
fn holes(alpha: u8) -> Layer {
    let texels = chequers().iter().map(|t| [255, 255, 255, if t[0] > 100 { 255 } else { alpha }]).collect();
    let image = Arc::new(Image::new(8, Texels::Eight(texels)).expect("whole rows"));
    Layer { image, ..layer(1, &[[0; 3]], Filter::Nearest, Coding::Srgb) }
}

/// A two-sided screen of reflectance 0.6 with holes, of 2 x 1 m in the plane y = 1/2.
fn screen(mut model: Model, coverage: Coverage, alpha: u8) -> Model {
    let quad = model.surfaces.len();
    let both = Surface { double_sided: true, ..lambert(0.5, 0.0) };
    add_quad(&mut model, DVec3::new(0.0, 0.5, 0.0), DVec3::X * 2.0, DVec3::Z, both);
    varied(model, vec![(quad, Textured { base_layer: Some(holes(alpha)), coverage, ..plain(0.6) })])
}

#[test]
fn light_falls_through_the_holes_of_a_mask_and_a_share_of_it_through_a_veil() {
    // Column 0 of row 0 is bright, and so opaque; column 1 is a hole.
    let (opaque, hole) = ([0.12, 0.1, 0.13], [0.37, 0.1, 0.13]);
    let eye = |at: [f64; 3]| [at[0], 2.0, at[2] + 1e-3];
    let on = |at: [f64; 3]| [at[0], 0.5, at[2]];
    let job = "[run]\nhistories_per_batch = 256\nbatches = 16\nseed = 5\n".to_owned()
        + &spot_camera("sunny", eye(opaque), on(opaque), [1.0, 0.0, 0.0])
        + &point("shadow", opaque, [0.0, 1.0, 0.0])
        + &point("hole", hole, [0.0, 1.0, 0.0]);
    for (coverage, alpha, through) in
        [(Coverage::Mask(0.5), 0, 1.0), (Coverage::Blend, 51, 0.8), (Coverage::Mask(0.1), 51, 0.0)]
    {
        let mut model = screen(Model::default(), coverage, alpha);
        model.lights.push(Light::Directional { direction: DVec3::NEG_Y, illuminance: Colour::grey(100.0) });
        let values = Case::new(&job, model).values();
        let names = ["sunny", "shadow", "hole"];
        for ((name, value), exact) in names.iter().zip(&values).zip([60.0 / PI, 0.0, 100.0 * through]) {
            assert!((value.mean - exact).abs() < 1e-4, "{name} with {coverage:?}: {} against {exact}", value.mean);
        }
    }
}

/// Local estimation of so many histories a batch agrees with reverse paths of four times as many at `receivers` in a `room` lit by a wall of 1 m2 and
/// 60 cd/m2, and all of its light is absorbed.
fn assert_agree(room: &Model, receivers: &str, what: &str, (seed, histories): (u64, u32)) {
    let case = |estimator: &str, histories: u32| {
        let run = format!(
            "[run]\nhistories_per_batch = {histories}\nbatches = 64\nseed = {seed}\n[transport]\nestimator = \"{estimator}\"\n"
        );
        Case::new(&(run + receivers), room.clone())
    };
    let (local, reverse) = (case("local", histories), case("reverse", 4 * histories));
    let names = local.job.sets().into_iter().map(|s| s.name);
    let pairs = names.zip(local.values().into_iter().zip(reverse.values()));
    let mut all: Vec<_> = pairs.map(|(name, (a, b))| difference(format!("{what} {name}"), a, b)).collect();
    let (_, batches) = local.batches(0..u32::MAX);
    all.push(compare(format!("{what} absorbed"), flux(&batches, "absorbed"), PI * 60.0));
    assert_all(&all);
}

#[test]
fn local_and_reverse_agree_around_screens_and_no_light_is_lost() {
    for (coverage, alpha) in [(Coverage::Mask(0.5), 0), (Coverage::Blend, 80)] {
        let mut room = closed_box(DVec3::new(2.0, 1.0, 1.0), &lambert(0.6, 0.0));
        // The wall at x = 0 lights both sides.
        room.surfaces[0] = lambert(0.5, 60.0);
        let room = screen(room, coverage, alpha);
        let receivers = point("below", [0.6, 0.2, 0.4], [-1.0, 0.3, 0.1])
            + &point("beside", [0.9, 0.7, 0.6], [-1.0, -0.3, 0.0])
            + &spot_camera("upper", [0.8, 0.9, 0.5], [0.12, 0.5, 0.13], [1.0, 0.0, 0.0]);
        assert_agree(&room, &receivers, &format!("{coverage:?}"), (64, 512));
    }
}

/// A two-sided sheet that transmits as the chequers say, with holes, of 2 x 1 m in the plane y = 1/2.
fn sheet(mut model: Model, roughness: f64, coverage: Coverage, alpha: u8) -> Model {
    let dielectric = Dielectric { transmission: 0.8, ..Dielectric::PLAIN };
    let quad = model.surfaces.len();
    let uniform = Reflectance::layered(Colour::grey(0.6), 0.0, roughness, dielectric);
    let both = Surface { reflectance: uniform, double_sided: true, ..lambert(0.0, 0.0) };
    add_quad(&mut model, DVec3::new(0.0, 0.5, 0.0), DVec3::X * 2.0, DVec3::Z, both);
    let textured = Textured {
        base_layer: Some(holes(alpha)),
        factors: [0.0, roughness],
        dielectric,
        transmission_layer: Some(layer(8, &chequers(), Filter::Nearest, Coding::Data)),
        coverage,
        ..plain(0.6)
    };
    varied(model, vec![(quad, textured)])
}

#[test]
fn light_goes_through_a_sheet_as_its_transmission_and_its_alpha_say() {
    // The first texel is bright and covers; the second is dark, and covers a fifth where alpha counts.
    let (bright, dark) = ([0.12, 0.1, 0.13], [0.37, 0.1, 0.13]);
    let job = "[run]\nhistories_per_batch = 16\nbatches = 16\nseed = 5\n".to_owned()
        + &point("bright", bright, [0.0, 1.0, 0.0])
        + &point("dark", dark, [0.0, 1.0, 0.0]);
    let straight = |value: u8| 0.8 * stored(value) * 0.6 * 0.96;
    for (coverage, cover) in [(Coverage::Whole, 1.0), (Coverage::Blend, 0.2), (Coverage::Mask(0.5), 0.0)] {
        let mut model = sheet(Model::default(), 0.0, coverage, 51);
        model.lights.push(Light::Directional { direction: DVec3::NEG_Y, illuminance: Colour::grey(100.0) });
        let values = Case::new(&job, model).values();
        let exact = [straight(chequers()[0][0]), 1.0 - cover + cover * straight(chequers()[1][0])];
        for (value, exact) in values.iter().zip(exact) {
            assert!((value.mean - 100.0 * exact).abs() < 1e-4, "{coverage:?}: {} against {exact}", value.mean);
        }
    }
}

#[test]
fn local_and_reverse_agree_around_sheets_that_vary_and_no_light_is_lost() {
    for (coverage, alpha) in [(Coverage::Whole, 255), (Coverage::Blend, 80)] {
        let mut room = closed_box(DVec3::new(2.0, 1.0, 1.0), &lambert(0.6, 0.0));
        // The wall at x = 0 lights both sides.
        room.surfaces[0] = lambert(0.5, 60.0);
        let room = sheet(room, 0.6, coverage, alpha);
        let receivers =
            point("below", [0.6, 0.2, 0.4], [-1.0, 0.3, 0.1]) + &point("beside", [0.9, 0.7, 0.6], [-1.0, -0.3, 0.0]);
        assert_agree(&room, &receivers, &format!("{coverage:?}"), (65, 1024));
    }
}
