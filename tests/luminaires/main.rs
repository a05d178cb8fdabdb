//! Photometric files: what they mean, against a second reading; how they hang in a scene; how bad ones are refused.

#[path = "../common/gltf_builder.rs"]
#[allow(dead_code, reason = "each test binary uses its own part")]
mod gltf_builder;

mod bad;
mod meshes;
mod naive;
mod openings;
mod reading;
mod sampling;
mod scenes;
mod tilt;

use lampyris::math::{DMat3, DVec3};
use lampyris::photometry::Colour;
use lampyris::scene::photometric_web::{Luminaire, Photometry, Placement};
use std::fs;
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/luminaires")
}

/// Names of the photometric files of the tests.
fn names() -> Vec<String> {
    let entries = fs::read_dir(folder()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = entries.filter(|n| n.ends_with(".ies") || n.ends_with(".ldt")).collect();
    names.sort();
    assert!(names.len() >= 25, "{names:?}");
    names
}

fn bytes(name: &str) -> Vec<u8> {
    fs::read(folder().join(name)).unwrap()
}

fn photometry(name: &str) -> Photometry {
    Photometry::parse(name, &bytes(name)).unwrap_or_else(|e| panic!("{e}"))
}

/// A luminaire at the origin that looks down, with C0 along +X.
fn hanging(photometry: &Photometry) -> Luminaire {
    let placement = Placement::new(DVec3::ZERO, DMat3::IDENTITY, DVec3::NEG_Y, DVec3::X).unwrap();
    Luminaire::new(photometry, &placement, Colour::WHITE)
}
