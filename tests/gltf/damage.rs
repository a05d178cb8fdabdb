//! Damaged bytes: a model or an error, never a panic.

use rand_core::Rng;
use rand_pcg::Pcg64;

use crate::{load, sample};
use lampyris::scene::gltf;

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
