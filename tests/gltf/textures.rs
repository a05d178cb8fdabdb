//! Textures where they lie: texels, wrapping, transforms, vertex colours, and the law of reflection that follows.

use serde_json::{Value, json};

use crate::{Builder, CORNERS, SQUARE, good, load, refusal, warns};
use lampyris::job::Job;
use lampyris::math::{DVec3, PI, pow};
use lampyris::photometry::Colour;
use lampyris::scene::{Model, Reflectance, Scene};

/// Texture coordinates of the square's corners, the image upright on it.
const UPRIGHT: [[f32; 2]; 4] = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];

/// sRGB values of a 2 x 2 image: red, green above blue, white.
const FOUR: [u8; 12] = [255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255];

/// A PNG of `width` columns with `pixels` of 8-bit RGB.
pub fn png(width: u32, pixels: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, pixels.len() as u32 / 3 / width);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header().and_then(|mut writer| writer.write_image_data(pixels)).expect("a vector takes all");
    bytes
}

/// A square of `material` with `coordinates`, and its texture 0, read by `sampler`.
fn square(material: Value, coordinates: &[[f32; 2]; 4], sampler: Value, image: &[u8]) -> Builder {
    let mut builder = Builder::new();
    let mesh = builder.mesh(&SQUARE, Some(&CORNERS));
    texcoord(&mut builder, "TEXCOORD_0", coordinates);
    builder.push("/materials", material);
    builder.json["meshes"][mesh]["primitives"][0]["material"] = json!(0);
    builder.node(json!({ "mesh": mesh }));
    builder.light(json!({ "type": "point", "intensity": 1.0 }));
    builder.node(json!({ "extensions": { "KHR_lights_punctual": { "light": 0 } }, "translation": [0.5, 0.5, 2.0] }));
    texture(&mut builder, image, sampler);
    builder
}

/// Gives the square coordinates called `name`.
fn texcoord(builder: &mut Builder, name: &str, coordinates: &[[f32; 2]; 4]) {
    let bytes: Vec<u8> = coordinates.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    let accessor = builder.accessor(&bytes, 5126, 4, "VEC2");
    builder.json["meshes"][0]["primitives"][0]["attributes"][name] = json!(accessor);
}

/// Adds a texture.
fn texture(builder: &mut Builder, image: &[u8], sampler: Value) {
    let view = builder.view(image);
    let source = builder.push("/images", json!({ "bufferView": view }));
    builder.push("/textures", json!({ "source": source, "sampler": 0 }));
    builder.json["samplers"] = json!([sampler]);
}

/// A matt material whose base colour is texture 0, with more about the texture.
fn matt(more: Value) -> Value {
    let mut texture = json!({ "index": 0 });
    texture.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    json!({ "pbrMetallicRoughness": { "metallicFactor": 0.0, "baseColorTexture": texture } })
}

const NEAREST: u32 = 9728;

/// The model in a scene of three channels.
fn scene(model: Model) -> Scene {
    let job = "scene = \"in memory\"\n[run]\nchannels = \"rgb\"\n[[point]]\nname = \"p\"\nposition = [0.5, 0.5, 1]\nnormal = [0, 0, -1]\n";
    Scene::new(model, &Job::parse(job, "in memory").unwrap()).unwrap()
}

/// The law at the place (x, y) of the square.
fn law(scene: &Scene, x: f64, y: f64) -> Reflectance {
    let above = scene.place([x, y, 0.5]);
    let ray = lampyris::geometry::Ray { origin: above, direction: DVec3::NEG_Z };
    let hit = scene.geometry.closest_hit(&ray).expect("a place on the square");
    scene.reflectance(hit.primitive, hit.position).into_owned()
}

/// Base colour of a matt square at the centre of each quarter: above left, above right, below left, below right.
fn quarters(builder: &Builder) -> [[f64; 3]; 4] {
    let scene = scene(good(builder));
    [[0.25, 0.75], [0.75, 0.75], [0.25, 0.25], [0.75, 0.25]].map(|[x, y]| {
        let rho = law(&scene, x, y).lambert().expect("a matt surface");
        rho.map(|c| (c * 1e6).round() / 1e6).0
    })
}

const RED: [f64; 3] = [1.0, 0.0, 0.0];
const GREEN: [f64; 3] = [0.0, 1.0, 0.0];
const BLUE: [f64; 3] = [0.0, 0.0, 1.0];
const WHITE: [f64; 3] = [1.0; 3];

/// The quarters with one kind of wrapping and a transform.
fn laid(wrap: u32, transform: Value) -> [[f64; 3]; 4] {
    let material = matt(json!({ "extensions": { "KHR_texture_transform": transform } }));
    let sampler = json!({ "magFilter": NEAREST, "wrapS": wrap, "wrapT": wrap });
    quarters(&square(material, &UPRIGHT, sampler, &png(2, &FOUR)))
}

#[test]
fn the_first_row_of_an_image_is_at_v_0() {
    assert_eq!(laid(10497, json!({})), [RED, GREEN, BLUE, WHITE]);
}

#[test]
fn transforms_turn_counter_clockwise_after_they_scale_and_before_they_shift() {
    assert_eq!(laid(10497, json!({ "offset": [0.5, 0.0] })), [GREEN, RED, WHITE, BLUE]);
    assert_eq!(laid(10497, json!({ "scale": [1.0, -1.0] })), [BLUE, WHITE, RED, GREEN]);
    // (u, v) goes to (v, -u): what was on the right is now above.
    assert_eq!(laid(10497, json!({ "rotation": PI / 2.0 })), [BLUE, RED, WHITE, GREEN]);
    let all = json!({ "offset": [0.0, 0.5], "rotation": PI / 2.0, "scale": [2.0, 1.0] });
    // Of (2 u, v), turned and shifted: (v, 1/2 - 2 u), the same in both columns.
    assert_eq!(laid(10497, all), [RED, RED, GREEN, GREEN]);
}

#[test]
fn images_repeat_turn_round_or_end() {
    // u and v from 3/4 to 7/4 have their quarters' centres at 1 and 3/2, shifted off the edges a little.
    let shift = json!({ "offset": [0.76, 0.76] });
    assert_eq!(laid(10497, shift.clone()), [RED, GREEN, BLUE, WHITE]);
    assert_eq!(laid(33071, shift.clone()), [WHITE, WHITE, WHITE, WHITE]);
    assert_eq!(laid(33648, shift), [WHITE, BLUE, GREEN, RED]);
    let negative = json!({ "offset": [-1.24, -0.24] });
    assert_eq!(laid(10497, negative.clone()), [RED, GREEN, BLUE, WHITE]);
    assert_eq!(laid(33648, negative.clone()), [GREEN, RED, WHITE, BLUE]);
    assert_eq!(laid(33071, negative), [RED, RED, BLUE, BLUE]);
}

#[test]
fn between_texels_linear_values_are_mixed() {
    let image = png(2, &[255, 0, 0, 0, 128, 0]);
    let scene = scene(good(&square(matt(json!({})), &UPRIGHT, json!({ "wrapS": 33071 }), &image)));
    let green = pow((128.0 / 255.0 + 0.055) / 1.055, 2.4);
    for (x, share) in [(0.1, 0.0), (0.25, 0.0), (0.4, 0.3), (0.5, 0.5), (0.75, 1.0), (0.9, 1.0)] {
        let Colour([r, g, b]) = law(&scene, x, 0.3).lambert().unwrap();
        assert!((r - (1.0 - share)).abs() < 1e-6 && (g - share * green).abs() < 1e-6 && b == 0.0, "{x}: {r} {g}");
    }
}

#[test]
fn other_coordinates_are_named_by_the_reference_or_by_its_transform() {
    let mirrored = [[1.0, 1.0], [0.0, 1.0], [0.0, 0.0], [1.0, 0.0]];
    let transform = json!({ "texCoord": 2, "extensions": { "KHR_texture_transform": { "texCoord": 1 } } });
    for more in [json!({ "texCoord": 1 }), transform] {
        let mut builder = square(matt(more), &UPRIGHT, json!({ "magFilter": NEAREST }), &png(2, &FOUR));
        texcoord(&mut builder, "TEXCOORD_1", &mirrored);
        assert_eq!(quarters(&builder), [GREEN, RED, WHITE, BLUE]);
    }
}

#[test]
fn quantized_coordinates_are_the_same() {
    let mut builder = square(matt(json!({})), &UPRIGHT, json!({ "magFilter": NEAREST }), &png(2, &FOUR));
    // Pairs of bytes, each on a multiple of four.
    let bytes: Vec<u8> = UPRIGHT.iter().flat_map(|[u, v]| [(u * 255.0) as u8, (v * 255.0) as u8, 0, 0]).collect();
    let accessor = builder.accessor(&bytes, 5121, 4, "VEC2");
    builder.json["accessors"][accessor]["normalized"] = json!(true);
    let view = builder.json["accessors"][accessor]["bufferView"].as_u64().unwrap() as usize;
    builder.json["bufferViews"][view]["byteStride"] = json!(4);
    builder.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(accessor);
    assert_eq!(quarters(&builder), [RED, GREEN, BLUE, WHITE]);
}

#[test]
fn a_mirrored_node_keeps_its_texture_on_its_corners() {
    let mut builder = square(matt(json!({})), &UPRIGHT, json!({ "magFilter": NEAREST }), &png(2, &FOUR));
    builder.json["nodes"][0]["scale"] = json!([-1.0, 1.0, -1.0]);
    builder.json["nodes"][0]["translation"] = json!([1.0, 0.0, 0.0]);
    builder.json["materials"][0]["doubleSided"] = json!(true);
    assert_eq!(quarters(&builder), [GREEN, RED, WHITE, BLUE]);
}

#[test]
fn vertex_colours_multiply_factor_and_texture_and_are_blended_over_triangles() {
    let mut material = matt(json!({}));
    material["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.5, 1.0, 1.0, 1.0]);
    let mut builder = square(material, &UPRIGHT, json!({}), &png(1, &[255, 255, 255]));
    // Red falls from left to right; alpha has no say.
    let colours = [[255u8, 255, 0, 7], [0, 255, 0, 7], [0, 255, 0, 7], [255, 255, 0, 7]];
    let accessor = builder.accessor(colours.as_flattened(), 5121, 4, "VEC4");
    builder.json["accessors"][accessor]["normalized"] = json!(true);
    builder.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(accessor);
    let scene = scene(good(&builder));
    for (x, y) in [(0.1, 0.3), (0.5, 0.5), (0.9, 0.2)] {
        let Colour([r, g, b]) = law(&scene, x, y).lambert().unwrap();
        assert!((r - 0.5 * (1.0 - x)).abs() < 1e-6 && (g - 1.0).abs() < 1e-6 && b == 0.0, "{r} {g} {b}");
    }
}

#[test]
fn metallic_and_roughness_make_the_law_of_the_place() {
    // Roughness in green, metallic in blue: matt, rough metal, smooth dielectric, mirror.
    let data = png(2, &[9, 255, 0, 9, 153, 255, 9, 102, 0, 9, 0, 255]);
    let mut material = matt(json!({}));
    material["pbrMetallicRoughness"]["metallicFactor"] = json!(1.0);
    material["pbrMetallicRoughness"]["metallicRoughnessTexture"] = json!({ "index": 1 });
    let mut builder = square(material, &UPRIGHT, json!({ "magFilter": NEAREST }), &png(2, &FOUR));
    let view = builder.view(&data);
    builder.push("/images", json!({ "bufferView": view }));
    builder.push("/textures", json!({ "source": 1, "sampler": 0 }));
    let model = good(&builder);
    assert!(warns(&model, "the roughness of its texture is rounded to steps of 1/255"));
    let scene = scene(model);
    assert!(scene.has_peaks() && scene.narrowest_lobe() == 0.0);
    let places = [(0.25, 0.75, RED, 0.0, 1.0), (0.75, 0.75, GREEN, 1.0, 0.6), (0.25, 0.25, BLUE, 0.0, 0.4)];
    let (w_in, w_out) = (DVec3::new(0.6, 0.0, -0.8), DVec3::new(0.48, 0.6, 0.64));
    for (x, y, base, metallic, roughness) in places {
        let expected = Reflectance::metallic_roughness(Colour(base), metallic, roughness);
        let found = law(&scene, x, y);
        assert_eq!(found.evaluate(DVec3::Z, w_in, w_out), expected.evaluate(DVec3::Z, w_in, w_out));
        assert_eq!((found.lambert(), found.is_peaked()), (expected.lambert(), expected.is_peaked()));
    }
    let mirror = law(&scene, 0.75, 0.25);
    assert_eq!(mirror.delta_reflectance(0.7), Some(Colour::WHITE));
}

#[test]
fn textures_without_coordinates_count_by_their_means() {
    let mut builder = square(matt(json!({ "texCoord": 1 })), &UPRIGHT, json!({}), &png(2, &FOUR));
    let model = good(&builder);
    assert!(warns(&model, "has no TEXCOORD_1"));
    assert_eq!(model.surfaces[0].reflectance.lambert(), Some(Colour([0.5; 3])));
    builder.remove("/meshes/0/primitives/0/attributes", "TEXCOORD_0");
    assert_eq!(quarters(&builder), [[0.5; 3]; 4]);
}

/// The field and the allowed range of what is refused after `change`.
fn refused(change: impl Fn(&mut Builder)) -> (String, String) {
    let mut builder = square(matt(json!({})), &UPRIGHT, json!({}), &png(2, &FOUR));
    change(&mut builder);
    let (field, _, allowed) = refusal(load(&builder.glb()));
    (field, allowed)
}

#[test]
fn what_is_wrong_with_a_texture_is_named() {
    let (field, allowed) = refused(|b| b.json["samplers"][0]["wrapS"] = json!(5));
    assert_eq!((field.as_str(), allowed.as_str()), ("samplers[0].wrapS", "33071, 33648 or 10497"));
    assert_eq!(refused(|b| b.json["samplers"][0]["magFilter"] = json!(9987)).0, "samplers[0].magFilter");
    assert_eq!(refused(|b| b.json["textures"][0]["sampler"] = json!(1)).0, "textures[0].sampler");
    assert_eq!(refused(|b| b.json["textures"][0]["source"] = json!(9)).0, "textures[0].source");
    let transform = |b: &mut Builder, t: Value| {
        b.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
            json!({ "KHR_texture_transform": t });
    };
    let far = refused(|b| transform(b, json!({ "offset": [0.0, 1e9] })));
    assert!(far.0.ends_with("KHR_texture_transform.offset[1]"), "{far:?}");
    let (field, allowed) = refused(|b| texcoord(b, "TEXCOORD_0", &[[f32::NAN, 0.0]; 4]));
    assert!(field.starts_with("accessors[") && allowed == "finite numbers", "{field}: {allowed}");
    let (field, allowed) = refused(|b| {
        let accessor = b.accessor(&[0; 24], 5126, 3, "VEC2");
        b.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(accessor);
    });
    assert_eq!(
        (field.as_str(), allowed.as_str()),
        ("meshes[0].primitives[0].attributes.TEXCOORD_0", "4 elements, as POSITION has")
    );
}

#[test]
fn images_in_other_formats_are_refused_by_name() {
    let with = |bytes: &'static [u8]| {
        refused(move |b| {
            let view = b.view(bytes);
            b.json["images"][0]["bufferView"] = json!(view);
        })
    };
    for (bytes, name) in [(&b"\xabKTX 20\xbb"[..], "KTX2"), (b"RIFF\0\0\0\0WEBPVP8 ", "WebP"), (b"DDS |", "DDS")] {
        let (field, allowed) = with(bytes);
        assert_eq!(field, "images[0]");
        assert!(allowed.contains(&format!("it is {name}: export the scene with PNG or JPEG textures")), "{allowed}");
    }
    let (field, allowed) = refused(|b| {
        b.json["textures"][0] = json!({ "extensions": { "KHR_texture_basisu": { "source": 0 } } });
    });
    assert_eq!(field, "textures[0].source");
    assert!(allowed.contains("beside that of KHR_texture_basisu"), "{allowed}");
    let (field, allowed) = refused(|b| b.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]));
    assert_eq!(field, "extensionsRequired[0]");
    assert!(allowed.ends_with("export the scene without compression of its meshes"), "{allowed}");
}

/// A square whose texture is white with these values of alpha in its four quarters, in `mode`.
fn cut(mode: &str, alpha: [u8; 4], more: Value) -> Builder {
    let mut image = Vec::new();
    let mut encoder = png::Encoder::new(&mut image, 2, 2);
    encoder.set_color(png::ColorType::GrayscaleAlpha);
    let pixels: Vec<u8> = alpha.into_iter().flat_map(|a| [255, a]).collect();
    encoder.write_header().and_then(|mut writer| writer.write_image_data(&pixels)).expect("a vector takes all");
    let mut material = matt(json!({}));
    material["alphaMode"] = json!(mode);
    material.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    square(material, &UPRIGHT, json!({ "magFilter": NEAREST }), &image)
}

/// What goes straight on through the quarters of the square.
fn through(builder: &Builder) -> [f64; 4] {
    let scene = scene(good(builder));
    [[0.25, 0.75], [0.75, 0.75], [0.25, 0.25], [0.75, 0.25]].map(|[x, y]| {
        let [above, below] = [0.5, -0.5].map(|z| scene.place([x, y, z]).as_vec3());
        scene.transmittance(above, below).0[0]
    })
}

#[test]
fn alpha_is_a_mask_or_a_share() {
    let alpha = [0, 102, 153, 255];
    assert_eq!(through(&cut("MASK", alpha, json!({}))), [1.0, 1.0, 0.0, 0.0]);
    assert_eq!(through(&cut("MASK", alpha, json!({ "alphaCutoff": 0.4 }))), [1.0, 0.0, 0.0, 0.0]);
    assert_eq!(through(&cut("MASK", alpha, json!({ "alphaCutoff": 2.0 }))), [1.0; 4]);
    assert_eq!(through(&cut("BLEND", alpha, json!({}))), [1.0, 0.6, 0.4, 0.0]);
    assert_eq!(through(&cut("OPAQUE", alpha, json!({}))), [0.0; 4]);
    // What is opaque all over is no veil.
    let opaque = scene(good(&cut("BLEND", [255; 4], json!({}))));
    assert!(!opaque.geometry.has_veils());
    let lit = cut("BLEND", alpha, json!({ "emissiveFactor": [1.0, 1.0, 1.0] }));
    assert!(warns(&good(&lit), "alphaMode BLEND is ignored: the surface is opaque, as it emits"));
    assert_eq!(through(&lit), [0.0; 4]);
    let (field, _, allowed) = refusal(load(&cut("CUTOUT", alpha, json!({})).glb()));
    assert_eq!((field.as_str(), allowed.as_str()), ("materials[0].alphaMode", "OPAQUE, MASK or BLEND"));
}

#[test]
fn alpha_of_factor_and_vertices_multiply() {
    let mut builder = cut("BLEND", [255; 4], json!({}));
    builder.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([1.0, 1.0, 1.0, 0.75]);
    assert_eq!(through(&builder), [0.25; 4]);
    let accessor = builder.accessor(&[255u8, 255, 255, 51].repeat(4), 5121, 4, "VEC4");
    builder.json["accessors"][accessor]["normalized"] = json!(true);
    builder.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(accessor);
    through(&builder).into_iter().for_each(|share| assert!((share - 0.85).abs() < 1e-6, "{share}"));
}

/// A square of which texture 0 says where it transmits, on white.
fn sheet(more: Value) -> Builder {
    let transmission = json!({ "transmissionFactor": 0.5, "transmissionTexture": { "index": 0 } });
    let mut material = json!({ "name": "blind", "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.0 },
        "extensions": { "KHR_materials_transmission": transmission } });
    material["pbrMetallicRoughness"].as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    // Red is all above left, none above right, 3/5 and 1/5 below; the rest has no say.
    let image = png(2, &[255, 0, 0, 0, 255, 255, 153, 77, 0, 51, 200, 3]);
    square(material, &UPRIGHT, json!({ "magFilter": NEAREST }), &image)
}

fn assert_shares(found: [f64; 4], wanted: [f64; 4]) {
    for (f, w) in found.into_iter().zip(wanted) {
        assert!((f - w).abs() < 1e-9, "{found:?} is not {wanted:?}");
    }
}

#[test]
fn red_says_how_much_transmits_and_base_colour_metal_and_alpha_have_their_say() {
    let clear = sheet(json!({}));
    assert_shares(through(&clear), [0.48, 0.0, 0.288, 0.096]);
    let model = good(&clear);
    assert!(model.warnings.is_empty() && model.surfaces[0].double_sided, "{:?}", model.warnings);
    // Where nothing transmits it is what it would be without.
    let opaque = Reflectance::metallic_roughness(Colour::WHITE, 0.0, 0.0);
    assert_eq!(law(&scene(model), 0.75, 0.75).albedo(0.3), opaque.albedo(0.3));

    // The report is of the means: 0.45 of the texture.
    let text = lampyris::report::reflectance_text(&scene(good(&clear)));
    assert!(text.lines().any(|line| line.contains("transmits") && line.contains(" 0.2160 ")), "{text}");

    let tinted = sheet(json!({ "baseColorFactor": [0.5, 1.0, 1.0, 1.0] }));
    assert_shares(through(&tinted), [0.24, 0.0, 0.144, 0.048]);
    let metal = sheet(json!({ "metallicFactor": 0.25 }));
    // F0 = 0.04 x 3/4 + 1/4.
    assert_shares(through(&metal), [0.5, 0.0, 0.3, 0.1].map(|t| t * 0.75 * 0.72));
    let mut veiled = sheet(json!({ "baseColorFactor": [1.0, 1.0, 1.0, 0.75] }));
    veiled.json["materials"][0]["alphaMode"] = json!("BLEND");
    assert_shares(through(&veiled), [0.48, 0.0, 0.288, 0.096].map(|s| 0.25 + 0.75 * s));
}

#[test]
fn metal_by_a_texture_hides_what_transmits() {
    // Roughness in green, metallic in blue: none above left, all above right, 3/5 and 1/5 below.
    let mut builder = sheet(json!({ "metallicFactor": 1.0, "metallicRoughnessTexture": { "index": 1 } }));
    let view = builder.view(&png(2, &[0, 0, 0, 0, 0, 255, 0, 0, 153, 0, 0, 51]));
    builder.push("/images", json!({ "bufferView": view }));
    builder.push("/textures", json!({ "source": 1, "sampler": 0 }));
    let transmission = "/materials/0/extensions/KHR_materials_transmission";
    builder.remove(transmission, "transmissionTexture");
    let left = |metallic: f64| 0.5 * (1.0 - metallic) * (1.0 - 0.04 * (1.0 - metallic) - metallic);
    assert_shares(through(&builder), [left(0.0), 0.0, left(0.6), left(0.2)]);
    // All that is no metal transmits: still no pane.
    builder.set(&format!("{transmission}/transmissionFactor"), json!(1.0));
    assert_shares(through(&builder), [0.0, 1.0, 0.6, 0.2].map(|metallic| 2.0 * left(metallic)));
}
