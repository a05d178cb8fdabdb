//! Factors, emission, the means of textures that are not laid out.

use serde_json::{Value, json};

use crate::{Builder, CORNERS, SQUARE, good, load, refusal, warns};
use lampyris::math::pow;
use lampyris::photometry::Colour;
use lampyris::scene::{Delta, Dielectric, Model, Pane, Reflectance};

/// A square of `material`.
fn square(material: Value) -> Builder {
    let mut builder = Builder::new();
    let mesh = builder.mesh(&SQUARE, Some(&CORNERS));
    builder.push("/materials", material);
    builder.json["meshes"][mesh]["primitives"][0]["material"] = json!(0);
    builder.node(json!({ "mesh": mesh }));
    builder
}

/// A material without gloss whose base colour is texture 0.
fn textured() -> Value {
    let factors =
        json!({ "metallicFactor": 0.0, "baseColorTexture": { "index": 0 }, "baseColorFactor": [0.5, 1.0, 1.0, 1.0] });
    json!({ "name": "wall", "pbrMetallicRoughness": factors })
}

/// `builder` with its texture 0 made of the encoded image `bytes`.
fn with_image(mut builder: Builder, bytes: &[u8]) -> Builder {
    let view = builder.view(bytes);
    builder.push("/images", json!({ "name": "photo", "bufferView": view }));
    builder.push("/textures", json!({ "source": 0 }));
    builder
}

/// A PNG of `width` pixels in one row.
fn png(width: u32, colour: png::ColorType, depth: png::BitDepth, row: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, 1);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    encoder.write_header().and_then(|mut writer| writer.write_image_data(row)).expect("a vector takes all");
    bytes
}

/// Linear value of an 8-bit sRGB value.
fn linear(value: u8) -> f64 {
    let s = f64::from(value) / 255.0;
    if s <= 0.04045 { s / 12.92 } else { pow((s + 0.055) / 1.055, 2.4) }
}

/// Reflectance of the first surface, which is Lambert.
fn rho(model: &Model) -> Colour {
    model.surfaces[0].reflectance.lambert().expect("a matt surface")
}

/// Asserts that `found` is `wanted` within rounding.
fn assert_close(found: Colour, wanted: [f64; 3]) {
    for (f, w) in found.0.iter().zip(wanted) {
        assert!((f - w).abs() < 1e-12, "{found:?} is not {wanted:?}");
    }
}

#[test]
fn a_matt_material_is_lambert_with_its_base_colour() {
    let factors = json!({ "baseColorFactor": [0.1, 0.2, 0.3, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0 });
    let model = good(&square(json!({ "name": "paint", "doubleSided": true, "pbrMetallicRoughness": factors })));
    let surface = &model.surfaces[0];
    assert_eq!((surface.name.as_str(), surface.double_sided, surface.emission), ("paint", true, Colour::BLACK));
    assert_eq!(rho(&model), Colour([0.1, 0.2, 0.3]));
    assert!(model.warnings.is_empty());
}

#[test]
fn emission_is_factor_times_strength() {
    let strength = json!({ "KHR_materials_emissive_strength": { "emissiveStrength": 5000.0 } });
    let model = good(&square(json!({ "emissiveFactor": [1.0, 0.5, 0.25], "extensions": strength })));
    assert_eq!(model.surfaces[0].emission, Colour([5000.0, 2500.0, 1250.0]));
    assert!(!model.surfaces[0].double_sided);
    let plain = good(&square(json!({ "emissiveFactor": [1.0, 1.0, 1.0] })));
    assert_eq!(plain.surfaces[0].emission, Colour::WHITE);
}

#[test]
fn a_mesh_without_material_is_white_metal_with_a_warning() {
    let mut builder = square(json!({}));
    builder.remove("/meshes/0/primitives/0", "material");
    let model = good(&builder);
    assert!(warns(&model, "meshes[0] has no material: glTF's default is used"));
    assert_eq!(model.surfaces.len(), 1);
}

#[test]
fn normal_and_occlusion_textures_are_ignored_with_warnings() {
    let texture = json!({ "index": 9 });
    let material = json!({ "name": "leaf", "normalTexture": texture, "occlusionTexture": texture });
    let model = good(&square(material));
    for text in ["normalTexture is ignored", "occlusionTexture is ignored"] {
        assert!(warns(&model, text), "{text}");
    }
}

#[test]
fn a_colour_texture_counts_by_the_mean_of_its_linear_values() {
    let image = png(2, png::ColorType::Rgb, png::BitDepth::Eight, &[255, 128, 0, 0, 64, 200]);
    let model = good(&with_image(square(textured()), &image));
    let mean = |a, b| (linear(a) + linear(b)) / 2.0;
    assert_close(rho(&model), [0.5 * mean(255, 0), mean(128, 64), mean(0, 200)]);
    assert!(warns(&model, "meshes[0] has no TEXCOORD_0: the textures of material `wall` count by their means"));
}

#[test]
fn grey_alpha_sixteen_bit_and_palette_pngs_are_read() {
    let expected = linear(0x80);
    for image in [
        png(2, png::ColorType::Grayscale, png::BitDepth::Eight, &[0x80, 0x80]),
        png(1, png::ColorType::GrayscaleAlpha, png::BitDepth::Eight, &[0x80, 3]),
        png(1, png::ColorType::Rgba, png::BitDepth::Eight, &[0x80, 0x80, 0x80, 0]),
        png(1, png::ColorType::Rgb, png::BitDepth::Sixteen, &[0x80; 6]),
    ] {
        let model = good(&with_image(square(textured()), &image));
        assert_close(rho(&model), [0.5 * expected, expected, expected]);
    }
    let mut palette = Vec::new();
    let mut encoder = png::Encoder::new(&mut palette, 4, 1);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Two);
    encoder.set_palette(vec![255, 255, 255, 0x80, 0x80, 0x80]);
    encoder.write_header().and_then(|mut writer| writer.write_image_data(&[0b0101_0101])).expect("a vector takes all");
    assert_close(rho(&good(&with_image(square(textured()), &palette))), [0.5 * expected, expected, expected]);
}

#[test]
fn a_jpeg_texture_is_read() {
    let mut image = Vec::new();
    let encoder = jpeg_encoder::Encoder::new(&mut image, 100);
    let pixels = [200u8, 100, 50].repeat(256);
    encoder.encode(&pixels, 16, 16, jpeg_encoder::ColorType::Rgb).expect("a vector takes all");
    let model = good(&with_image(square(textured()), &image));
    let Colour([r, g, b]) = rho(&model);
    for (found, value) in [(2.0 * r, 200), (g, 100), (b, 50)] {
        // The colour transform of JPEG rounds to whole steps.
        assert!(found >= linear(value - 2) && found <= linear(value + 2), "{found} for {value}");
    }
}

#[test]
fn emissive_texture_is_a_colour_and_one_image_serves_twice() {
    let mut material = textured();
    material["emissiveTexture"] = json!({ "index": 0 });
    material["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
    let image = png(1, png::ColorType::Rgb, png::BitDepth::Eight, &[10, 100, 250]);
    let model = good(&with_image(square(material), &image));
    assert_close(model.surfaces[0].emission, [linear(10), linear(100), linear(250)]);
}

#[test]
fn an_image_beside_the_scene_is_fetched_once() {
    let mut builder = square(textured());
    builder.push("/images", json!({ "uri": "wood.png" }));
    builder.push("/textures", json!({ "source": 0 }));
    builder.push("/materials", textured());
    let primitive = builder.json["meshes"][0]["primitives"][0].clone();
    builder.push("/meshes/0/primitives", primitive);
    builder.set("/meshes/0/primitives/1/material", json!(1));
    let image = png(1, png::ColorType::Rgb, png::BitDepth::Eight, &[0, 0, 0]);
    let mut asked = Vec::new();
    let model = lampyris::scene::gltf::load("scene.glb", &builder.glb(), &mut |uri| {
        asked.push(uri.to_owned());
        Ok(image.clone())
    });
    assert_eq!((asked, model.unwrap().surfaces.len()), (vec!["wood.png".to_owned()], 2));
}

#[test]
fn a_material_that_nothing_shows_cannot_fail() {
    let mut builder = square(json!({}));
    builder.push("/materials", textured());
    assert_eq!(good(&builder).surfaces.len(), 1);
}

#[test]
fn what_transmits_is_glass() {
    let glass = |extensions: Value, roughness: f64| {
        let factors =
            json!({ "metallicFactor": 0.0, "roughnessFactor": roughness, "baseColorFactor": [0.9, 0.8, 0.7, 1.0] });
        square(json!({ "name": "window", "pbrMetallicRoughness": factors, "extensions": extensions }))
    };
    let clear =
        json!({ "KHR_materials_transmission": { "transmissionFactor": 1.0 }, "KHR_materials_ior": { "ior": 1.6 } });
    let model = good(&glass(clear.clone(), 0.0));
    let pane = Pane::new(1.6, Colour([0.9, 0.8, 0.7]));
    let surface = &model.surfaces[0];
    assert!(matches!(&surface.reflectance, Reflectance::Delta(Delta::Pane(found)) if *found == pane));
    assert!(surface.double_sided && surface.is_veil() && model.warnings.is_empty(), "{:?}", model.warnings);
    let frosted = good(&glass(clear.clone(), 0.5));
    assert!(warns(&frosted, "roughnessFactor is ignored") && warns(&frosted, "kind = \"opal\""));
    let mut veiled = glass(clear.clone(), 0.0);
    veiled.json["materials"][0]["alphaMode"] = json!("BLEND");
    assert!(warns(&good(&veiled), "alphaMode BLEND is ignored"));

    let mut thick = clear.clone();
    thick["KHR_materials_volume"] =
        json!({ "thicknessFactor": 0.1, "attenuationDistance": 2.0, "attenuationColor": [0.25, 1.0, 1.0] });
    let model = good(&glass(thick.clone(), 0.0));
    let Reflectance::Delta(Delta::Glass(body)) = &model.surfaces[0].reflectance else { panic!("a body of glass") };
    assert_close(body.left(1.0), [0.5, 1.0, 1.0]);
    assert!(!model.surfaces[0].is_veil());

    let mut lit = glass(clear.clone(), 0.0);
    lit.json["materials"][0]["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
    let model = good(&lit);
    assert!(warns(&model, "as it emits") && !model.surfaces[0].is_veil());

    let none = json!({ "KHR_materials_transmission": {} });
    assert!(good(&glass(none, 0.0)).warnings.is_empty());
    for (extensions, field) in [
        (json!({ "KHR_materials_transmission": { "transmissionFactor": 1.5 } }), "transmissionFactor"),
        (json!({ "KHR_materials_transmission": {}, "KHR_materials_ior": { "ior": 0.5 } }), "ior"),
    ] {
        refused(&glass(extensions, 0.0), field);
    }
    thick["KHR_materials_volume"]["attenuationDistance"] = json!(0.0);
    refused(&glass(thick, 0.0), "attenuationDistance");
}

/// A sheet of base colour (0.9, 0.8, 0.7) that transmits `share`.
fn sheet(share: f64, metallic: f64, roughness: f64) -> Builder {
    let factors = json!({ "metallicFactor": metallic, "roughnessFactor": roughness,
        "baseColorFactor": [0.9, 0.8, 0.7, 1.0] });
    let extensions = json!({ "KHR_materials_transmission": { "transmissionFactor": share } });
    square(json!({ "name": "blind", "pbrMetallicRoughness": factors, "extensions": extensions }))
}

/// Asserts that the surface of `model` reflects and transmits as the metallic-roughness law of base colour (0.9, 0.8, 0.7).
fn assert_sheet(model: &Model, metallic: f64, roughness: f64, transmission: f64) {
    let dielectric = Dielectric { transmission, ..Dielectric::PLAIN };
    let wanted = Reflectance::layered(Colour([0.9, 0.8, 0.7]), metallic, roughness, dielectric);
    let surface = &model.surfaces[0];
    assert!(surface.double_sided && surface.is_veil() && surface.reflectance.lambert().is_none());
    for cosine in [0.1, 0.5, 1.0] {
        let (found, wanted) = (surface.reflectance.shares(cosine), wanted.shares(cosine));
        assert_close(found.0, wanted.0.0);
        assert_close(found.1, wanted.1.0);
    }
}

#[test]
fn what_transmits_in_part_is_a_sheet() {
    let model = good(&sheet(0.5, 0.0, 0.0));
    assert_sheet(&model, 0.0, 0.0, 0.5);
    assert!(model.warnings.is_empty(), "{:?}", model.warnings);
    // At normal incidence the outer surface reflects 0.04, and half of the rest is tinted and goes on.
    assert_close(model.surfaces[0].reflectance.straight(1.0), [0.48 * 0.9, 0.48 * 0.8, 0.48 * 0.7]);

    let rough = good(&sheet(0.5, 0.0, 1.0));
    assert_sheet(&rough, 0.0, 1.0, 0.5);
    assert!(warns(&rough, "what it transmits goes straight on") && warns(&rough, "kind = \"opal\""));
    // A metal in part, and one with all that is no metal transmitting.
    assert_sheet(&good(&sheet(0.5, 0.25, 0.3)), 0.25, 0.3, 0.5);
    assert_sheet(&good(&sheet(1.0, 0.25, 0.3)), 0.25, 0.3, 1.0);

    let metal = good(&sheet(0.5, 1.0, 0.3));
    assert!(warns(&metal, "it is opaque: with metallicFactor 1") && metal.warnings.len() == 1);
    assert!(!metal.surfaces[0].is_veil() && !metal.surfaces[0].double_sided);

    let mut thick = sheet(0.5, 0.0, 0.0);
    thick.json["materials"][0]["extensions"]["KHR_materials_volume"] = json!({ "thicknessFactor": 0.1 });
    thick.json["materials"][0]["extensions"]["KHR_materials_ior"] = json!({ "ior": 2.0 });
    let thick = good(&thick);
    assert!(warns(&thick, "KHR_materials_volume is ignored"));
    assert_close(thick.surfaces[0].reflectance.delta_reflectance(1.0).expect("polished"), [1.0 / 9.0; 3]);

    let mut lit = sheet(0.5, 0.0, 1.0);
    lit.json["materials"][0]["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
    let lit = good(&lit);
    assert!(warns(&lit, "as it emits") && lit.warnings.len() == 1);
    assert_eq!((rho(&lit), lit.surfaces[0].double_sided), (Colour([0.9, 0.8, 0.7]), false));
    refused(&sheet(-0.5, 0.0, 0.0), "transmissionFactor");
}

#[test]
fn a_texture_of_transmission_counts_by_the_mean_of_its_red_where_it_is_not_laid_out() {
    let image = png(2, png::ColorType::Rgb, png::BitDepth::Eight, &[255, 9, 9, 51, 200, 9]);
    let textured = |share: f64, image: &[u8]| {
        let mut builder = sheet(share, 0.0, 0.0);
        builder.json["materials"][0]["extensions"]["KHR_materials_transmission"]["transmissionTexture"] =
            json!({ "index": 0 });
        with_image(builder, image)
    };
    let model = good(&textured(1.0, &image));
    assert_sheet(&model, 0.0, 0.0, 0.6);
    assert!(warns(&model, "has no TEXCOORD_0: the textures of material `blind` count by their means"));
    // A texture of nothing, and a factor of nothing, which asks for no texture.
    let black = png(1, png::ColorType::Rgb, png::BitDepth::Eight, &[0, 255, 255]);
    assert!(!good(&textured(1.0, &black)).surfaces[0].is_veil());
    let none = good(&textured(0.0, b"no image"));
    assert!(!none.surfaces[0].is_veil() && none.warnings.is_empty(), "{:?}", none.warnings);
}

/// Asserts that `builder` is refused for a field with the word `word`.
fn refused(builder: &Builder, word: &str) {
    let (field, ..) = refusal(load(&builder.glb()));
    assert!(field.contains(word), "{field}");
}

#[test]
fn ior_and_specular_change_the_outer_surface() {
    let material = |extensions: Value| {
        let factors = json!({ "metallicFactor": 0.0, "roughnessFactor": 0.0, "baseColorFactor": [0.5, 0.5, 0.5, 1.0] });
        json!({ "pbrMetallicRoughness": factors, "extensions": extensions })
    };
    let f0 = |extensions: Value| {
        let model = good(&square(material(extensions)));
        let mirror = model.surfaces[0].reflectance.delta_reflectance(1.0).expect("a mirror");
        mirror.0.map(|c| (c * 1e9).round() / 1e9)
    };
    let ior = |ior: f64| json!({ "KHR_materials_ior": { "ior": ior } });
    assert_eq!(
        (f0(json!({})), f0(ior(1.5)), f0(json!({ "KHR_materials_ior": {} }))),
        ([0.04; 3], [0.04; 3], [0.04; 3])
    );
    assert_eq!((f0(ior(3.0)), f0(ior(0.0))), ([0.25; 3], [1.0; 3]));
    let specular = |more: Value| json!({ "KHR_materials_ior": { "ior": 3.0 }, "KHR_materials_specular": more });
    assert_eq!(f0(specular(json!({ "specularFactor": 0.5 }))), [0.125; 3]);
    // The colour may take it to one, and the factor counts after that.
    assert_eq!(
        f0(specular(json!({ "specularFactor": 0.5, "specularColorFactor": [8.0, 1.0, 0.0] }))),
        [0.5, 0.125, 0.0]
    );
    let none = good(&square(material(json!({ "KHR_materials_specular": { "specularFactor": 0.0 } }))));
    assert_eq!(rho(&none), Colour([0.5; 3]));
    for (extension, field) in [
        (ior(0.5), "KHR_materials_ior.ior"),
        (json!({ "KHR_materials_specular": { "specularFactor": 1.5 } }), "KHR_materials_specular.specularFactor"),
    ] {
        let (refused, ..) = crate::refusal(crate::load(&square(material(extension)).glb()));
        assert!(refused.ends_with(field), "{refused}");
    }
}
