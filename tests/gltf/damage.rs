//! Damaged bytes: a model or an error, never a panic.

use rand_core::Rng;
use rand_pcg::Pcg64;
use serde_json::{Value, json};

use crate::textures::png;
use crate::{Builder, load, sample};
use lampyris::geometry::Ray;
use lampyris::job::Job;
use lampyris::math::DVec3;
use lampyris::scene::{Scene, gltf};

/// A number below `end`.
fn below(rng: &mut Pcg64, end: usize) -> usize {
    (rng.next_u64() % end as u64) as usize
}

/// A few bytes of `bytes` changed, or its end cut off.
fn damaged(bytes: &[u8], rng: &mut Pcg64) -> Vec<u8> {
    let mut copy = bytes.to_vec();
    if rng.next_u64().is_multiple_of(8) {
        copy.truncate(below(rng, bytes.len()));
    }
    for _ in 0..=below(rng, 4) {
        if copy.is_empty() {
            break;
        }
        let at = below(rng, copy.len());
        copy[at] = match rng.next_u64() % 3 {
            0 => copy[at] ^ (1 << below(rng, 8)),
            1 => b"0123456789-.[]{},\""[below(rng, 18)],
            _ => rng.next_u64() as u8,
        };
    }
    copy
}

/// Loads `times` damaged copies of `bytes`; how many were still accepted.
fn survivors(bytes: &[u8], seed: u128, times: u64) -> u64 {
    let mut rng = Pcg64::new(seed, 1);
    let accepted = |bytes: &[u8]| gltf::load("scene.glb", bytes, &mut |_| Ok(vec![0; 64])).is_ok();
    (0..times).map(|_| u64::from(accepted(&damaged(bytes, &mut rng)))).sum()
}

#[test]
fn damaged_glb_and_gltf_never_panic() {
    let mut builder = sample();
    let mut image = Vec::new();
    let encoder = jpeg_encoder::Encoder::new(&mut image, 90);
    encoder.encode(&[90; 192], 8, 8, jpeg_encoder::ColorType::Rgb).expect("a vector takes all");
    let view = builder.view(&image);
    builder.push("/images", serde_json::json!({ "bufferView": view }));
    builder.push("/textures", serde_json::json!({ "source": 0 }));
    builder.set("/materials/0/pbrMetallicRoughness/baseColorTexture", serde_json::json!({ "index": 0 }));
    load(&builder.glb()).expect("undamaged it is good");
    for (bytes, seed) in [(builder.glb(), 1), (builder.embedded(), 2)] {
        let accepted = survivors(&bytes, seed, 4000);
        // Both outcomes must be met, or the damage tests nothing.
        assert!((100..3900).contains(&accepted), "{accepted} of 4000 were accepted");
    }
}

#[test]
fn every_truncation_of_a_glb_is_refused() {
    let glb = sample().glb();
    for length in 0..glb.len() {
        assert!(load(&glb[..length]).is_err(), "{length} of {} bytes were accepted", glb.len());
    }
}

/// The sample with textures of every kind and every extension of materials, on two squares.
fn furnished() -> Builder {
    let mut builder = sample();
    let uv: Vec<u8> = [0.0f32, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let uv = builder.accessor(&uv, 5126, 4, "VEC2");
    let colours = builder.accessor(&[200; 16], 5121, 4, "VEC4");
    builder.json["accessors"][colours]["normalized"] = json!(true);
    let attributes = &mut builder.json["meshes"][0]["primitives"][0]["attributes"];
    (attributes["TEXCOORD_0"], attributes["COLOR_0"]) = (json!(uv), json!(colours));
    let view = builder.view(&png(2, &[255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255]));
    builder.push("/images", json!({ "bufferView": view }));
    builder.push("/textures", json!({ "source": 0, "sampler": 0 }));
    builder.json["samplers"] = json!([{ "magFilter": 9728, "wrapS": 33071, "wrapT": 33648 }]);
    let texture = json!({ "index": 0, "texCoord": 0, "extensions": {
        "KHR_texture_transform": { "offset": [0.5, 0.0], "rotation": 0.1, "scale": [2.0, 1.0] } } });
    builder.set(
        "/materials/0",
        json!({ "name": "paint", "alphaMode": "MASK", "alphaCutoff": 0.3, "doubleSided": true,
            "emissiveTexture": texture, "emissiveFactor": [0.0, 0.0, 0.0],
            "pbrMetallicRoughness": { "baseColorTexture": texture, "metallicFactor": 0.0, "roughnessFactor": 1.0 },
            "extensions": { "KHR_materials_specular": { "specularFactor": 0.0, "specularColorFactor": [1.0, 0.5, 2.0] },
                "KHR_materials_ior": { "ior": 1.4 }, "KHR_materials_emissive_strength": { "emissiveStrength": 2.0 } } }),
    );
    builder.push(
        "/materials",
        json!({ "name": "glass", "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.0 },
            "extensions": { "KHR_materials_transmission": { "transmissionFactor": 1.0 }, "KHR_materials_ior": { "ior": 1.6 },
                "KHR_materials_volume": { "thicknessFactor": 0.0, "attenuationDistance": 2.0, "attenuationColor": [0.5, 1.0, 1.0] } } }),
    );
    let mut pane = builder.json["meshes"][0].clone();
    pane["primitives"][0]["material"] = json!(1);
    let pane = builder.push("/meshes", pane);
    builder.node(json!({ "mesh": pane, "translation": [0.0, 0.0, 1.0] }));
    builder.push("/nodes/0/children", json!(4));
    builder
}

/// All values of `json` that hold no others.
fn leaves<'a>(json: &'a mut Value, found: &mut Vec<&'a mut Value>) {
    match json {
        Value::Array(list) => list.iter_mut().for_each(|value| leaves(value, found)),
        Value::Object(map) => map.values_mut().for_each(|value| leaves(value, found)),
        leaf => found.push(leaf),
    }
}

#[test]
fn materials_and_textures_with_odd_values_never_panic() {
    let job = "scene = \"scene.glb\"\n[[point]]\nname = \"p\"\nposition = [0.0, 0.0, 2.0]\nnormal = [0.0, 0.0, -1.0]\n";
    let job = Job::parse(job, "job.toml").unwrap();
    let whole = furnished();
    Scene::new(load(&whole.glb()).expect("unchanged it is good"), &job).expect("unchanged it is a scene");
    let odd = [
        json!(null),
        json!(-1),
        json!(0),
        json!(1),
        json!(0.37),
        json!(7),
        json!(1e300),
        json!("x"),
        json!([]),
        json!(4294967296u64),
    ];
    let mut rng = Pcg64::new(3, 1);
    let (mut accepted, times) = (0, 1500);
    for _ in 0..times {
        let mut builder = whole.clone();
        for part in ["materials", "textures", "samplers", "images", "meshes"] {
            let mut values = Vec::new();
            leaves(&mut builder.json[part], &mut values);
            if rng.next_u64().is_multiple_of(4) {
                let at = below(&mut rng, values.len());
                *values[at] = odd[below(&mut rng, odd.len())].clone();
            }
        }
        let Ok(model) = gltf::load("scene.glb", &builder.glb(), &mut |_| Ok(vec![0; 64])) else { continue };
        let Ok(scene) = Scene::new(model, &job) else { continue };
        accepted += 1;
        for at in [[0.2, 0.3], [0.7, 1.5]] {
            let ray = Ray { origin: scene.place([at[0], at[1], 0.5]), direction: DVec3::NEG_Z };
            let Some(hit) = scene.geometry.closest_hit(&ray) else { continue };
            let law = scene.reflectance(hit.primitive, hit.position);
            let f = law.evaluate(hit.normal, ray.direction, DVec3::new(0.6, 0.0, 0.8)).max();
            assert!(f.is_finite() && f >= 0.0 && law.albedo(0.6).max() <= 1.0 + 1e-9, "{f}");
        }
    }
    assert!((200..times - 200).contains(&accepted), "{accepted} of {times} were accepted");
}
