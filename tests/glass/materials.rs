//! `[[material]]`: what a job puts in the place of the materials of a scene, by the commands a user runs.

use lampyris::job::Job;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn scenes() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes")
}

fn lampyris(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lampyris")).args(arguments).output().unwrap()
}

/// A small job in the room with a globe, a screen and a ball, with `materials`.
fn job(materials: &str) -> String {
    let scene = scenes().join("glass.glb");
    format!(
        "scene = {:?}\n[run]\nbatches = 16\nhistories_per_batch = 8\n[[point]]\nname = \"p\"\n\
         position = [1.0, 0.8, -1.5]\nnormal = [0.0, 1.0, 0.0]\n{materials}",
        scene.display().to_string()
    )
}

/// A material of the given kind for the globe.
fn globe(rest: &str) -> String {
    format!("[[material]]\nname = \"globe\"\n{rest}\n")
}

/// Runs `command` on a job with `materials` in a folder with a flat table and an r-table.
fn run(command: &str, materials: &str) -> (Option<i32>, String, String) {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    fs::write(at("flat.brdf"), "lampyris-brdf 1\nchannels 1\ntheta 0\nphi 0\n0.1\n").unwrap();
    fs::write(at("much.brdf"), "lampyris-brdf 1\nchannels 1\ntheta 0\nphi 0\n0.4\n").unwrap();
    fs::write(at("job.toml"), job(materials)).unwrap();
    let output = match command {
        "run" => lampyris(&["run", &at("job.toml"), "-o", &at("out"), "-w", "1", "-q"]),
        other => lampyris(&[other, &at("job.toml")]),
    };
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[test]
fn materials_out_of_range_are_refused_by_field_and_value() {
    for (rest, words) in [
        ("kind = \"lambert\"\nreflectance = 1.1", "material[0].reflectance"),
        ("kind = \"mirror\"\nreflectance = [0.5, -0.1, 0.5]", "material[0].reflectance"),
        ("kind = \"phong\"\ndiffuse = 0.6\nspecular = 0.5\nexponent = 10.0", "material[0].specular"),
        ("kind = \"phong\"\ndiffuse = 0.6\nspecular = 0.1\nexponent = -1.0", "material[0].exponent"),
        ("kind = \"opal\"\nreflectance = 0.5\ntransmittance = 0.6", "material[0].transmittance"),
        ("kind = \"pane\"\nior = 0.9", "material[0].ior"),
        ("kind = \"glass\"\ntransmittance_per_metre = 0.0", "transmittance_per_metre"),
        ("kind = \"velvet\"", "velvet"),
        ("kind = \"opal\"\nreflectance = 0.5\ntransmittance = 0.4\nshine = 1.0", "shine"),
        ("kind = \"lambert\"", "reflectance"),
    ] {
        let error = Job::parse(&job(&globe(rest)), "job").unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    let twice = globe("kind = \"pane\"") + &globe("kind = \"pane\"");
    assert!(Job::parse(&job(&twice), "job").unwrap_err().to_string().contains("once"));
}

#[test]
fn what_only_the_scene_can_refuse_is_refused_when_it_is_planned() {
    for (materials, words) in [
        (globe("kind = \"pane\"\ntransmittance = 0.95"), "0.923077"),
        (globe("kind = \"pane\"").replace("globe", "lens"), "screen"),
        (globe("kind = \"tabulated\"\nfile = \"missing.brdf\""), "material[0].file"),
        (globe("kind = \"tabulated\"\nfile = \"much.brdf\""), "reflects more"),
    ] {
        let (code, _, said) = run("reflectance", &materials);
        assert_eq!(code, Some(2), "{said}");
        assert!(said.contains(words), "{said}");
    }
}

#[test]
fn every_kind_runs_and_says_what_it_reflects() {
    let materials = globe("kind = \"opal\"\nreflectance = 0.45\ntransmittance = 0.5")
        + &globe("kind = \"glass\"").replace("globe", "ball")
        + &globe("kind = \"phong\"\ndiffuse = 0.25\nspecular = 0.15\nexponent = 30.0").replace("globe", "floor")
        + &globe("kind = \"tabulated\"\nfile = \"flat.brdf\"").replace("globe", "walls");
    let (code, text, said) = run("reflectance", &materials);
    assert_eq!(code, Some(0), "{said}");
    let row = |name: &str| text.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{name}: {text}"));
    assert!(row("globe").contains(" 0.4500") && text.contains("transmits    0.5000"), "{text}");
    assert!(row("walls").contains(" 0.3142") && row("ball").contains(" 0.04000"), "{text}");
    assert!(row("screen").contains("reflects"), "{text}");
    let (code, text, said) = run("run", &materials);
    assert_eq!(code, Some(0), "{said}");
    assert!(text.contains("flux [lm]"), "{text}");
}

#[test]
fn an_r_table_becomes_a_table_that_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    fs::write(at("r.txt"), "beta 0 90 180\n0 700 700 700\n2 90 40 30\n").unwrap();
    let output = lampyris(&["brdf", &at("r.txt"), "-o", &at("r.brdf")]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert!(fs::read_to_string(at("r.brdf")).unwrap().starts_with("lampyris-brdf 1\n"));
    fs::write(at("r.txt"), "beta 0 90\n").unwrap();
    assert_eq!(lampyris(&["brdf", &at("r.txt"), "-o", &at("r.brdf")]).status.code(), Some(2));
}
