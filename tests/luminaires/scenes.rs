//! Luminaires in scenes: where their light falls, through the plan and back, and that what leaves them arrives.

use crate::gltf_builder::Builder;
use crate::{bytes, folder, photometry};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use lampyris::error::Result;
use lampyris::farm::folder::Folder;
use lampyris::farm::inputs::{load_scene, prepare};
use lampyris::farm::plan::Plan;
use lampyris::math::{DVec3, PI};
use lampyris::scene::photometric_web::Photometry;
use lampyris::scene::{Model, Scene, gltf};
use lampyris::transport::direct::from_lights;
use lampyris::transport::receiver::{Receiver, Response};
use lampyris::validate::Experiment;
use lampyris::validate::scenes::{add_quad, box_walls, closed_box, lambert, point};
use serde_json::{Value, json};
use std::fs;
use std::process::Command;
use tempfile::TempDir;

/// A receiver far away, so that a job has one.
pub const SOMEWHERE: &str = "[[point]]\nname = \"p\"\nposition = [0.0, 9.0, 0.0]\nnormal = [0.0, 1.0, 0.0]\n";

/// A folder with the job and the files of the tests that it names, and others.
fn place(job: &str, others: &[(&str, Vec<u8>)]) -> TempDir {
    let temp = tempfile::tempdir().unwrap();
    for entry in fs::read_dir(folder()).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        if job.contains(&name) {
            fs::write(temp.path().join(&name), bytes(&name)).unwrap();
        }
    }
    others.iter().for_each(|(name, content)| fs::write(temp.path().join(name), content).unwrap());
    fs::write(temp.path().join("job.toml"), format!("{job}{SOMEWHERE}")).unwrap();
    temp
}

/// The scene of a job as a worker builds it, from nothing but the planned folder.
pub fn planned(job: &str, others: &[(&str, Vec<u8>)]) -> Result<(Scene, Plan)> {
    let temp = place(job, others);
    let prepared = prepare(&temp.path().join("job.toml"))?;
    let kept = tempfile::tempdir().unwrap();
    let folder = Folder::new(&kept.path().join("out"));
    folder.establish(&prepared.plan, &prepared.files).unwrap();
    drop(temp);
    Ok((load_scene(&folder, &prepared.plan)?, prepared.plan))
}

fn scene(job: &str) -> Scene {
    planned(job, &[]).unwrap_or_else(|e| panic!("{e}")).0
}

/// Illuminance at `position` on a surface with `normal` \[lx\].
pub fn lux(scene: &Scene, position: [f64; 3], normal: [f64; 3]) -> f64 {
    let receiver = Receiver {
        position: scene.place(position),
        normal: DVec3::from(normal).normalize(),
        response: Response::Cosine,
    };
    from_lights(scene, &receiver).luminance()
}

/// Illuminance at `position` on a surface that faces `from`.
fn lux_across(scene: &Scene, position: [f64; 3], from: [f64; 3]) -> f64 {
    lux(scene, position, (DVec3::from(from) - DVec3::from(position)).to_array())
}

pub fn luminaire(file: &str, more: &str) -> String {
    format!("[[luminaire]]\nfile = \"{file}\"\n{more}\n")
}

pub const UP: [f64; 3] = [0.0, 1.0, 0.0];

#[track_caller]
pub fn assert_near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance * expected.abs(), "{found}, not {expected}");
}

#[test]
fn lamps_of_a_thousand_and_of_a_hundred_lumens() {
    let omni = scene(&luminaire("omni_1000lm.ies", "position = [0.0, 5.0, 0.0]"));
    for d in [0.5, 1.0, 2.0, 5.0] {
        assert_near(lux(&omni, [0.0, 5.0 - d, 0.0], UP), 1000.0 / (4.0 * PI * d * d), 1e-12);
    }
    assert_near(lux(&omni, [0.0, 4.0, 0.0], UP), 79.58, 1e-4);
    // A Lambertian disc of 100 lm as a point: 100/pi lx on its axis at 1 m.
    let disc = scene(&luminaire("lambert_100lm.ies", "position = [0.0, 1.0, 0.0]\nextent = \"point\""));
    assert_near(lux(&disc, [0.0; 3], UP), 31.83, 1e-4);
    assert_near(lux(&disc, [0.0; 3], UP), 100.0 / PI, 1e-9);
    // At 45 degrees from the axis, 1.414 m away: I cos^2 of the angle over d^2.
    assert_near(lux(&disc, [1.0, 0.0, 0.0], UP), 100.0 / PI * 0.25, 1e-9);
}

/// The one bright direction of the wedge, C90 and G45: 1000 cd.
const WEDGE: f64 = 1000.0;

#[test]
fn c90_lies_a_quarter_turn_from_c0_counter_clockwise_from_above() {
    for file in ["wedge.ies", "wedge.ldt"] {
        // 2 m above the floor, aim down, C0 along +X: C90 along -Z.
        let hung = scene(&luminaire(file, "position = [0.0, 2.0, 0.0]"));
        assert_near(lux(&hung, [0.0, 0.0, -2.0], UP), WEDGE * 0.5f64.sqrt() / 8.0, 1e-6);
        for dark in [[0.0, 0.0, 2.0], [2.0, 0.0, 0.0], [-2.0, 0.0, 0.0]] {
            assert_eq!(lux(&hung, dark, UP), 0.0, "{file} {dark:?}");
        }
        // Turned about the vertical: C0 along -Z takes C90 to -X. The length of the directions does not count, nor what of
        // C0 lies along the aim.
        let turned =
            scene(&luminaire(file, "position = [0.0, 2.0, 0.0]\naim = [0.0, -3.0, 0.0]\nc0 = [0.0, 5.0, -0.2]"));
        assert_near(lux(&turned, [-2.0, 0.0, 0.0], UP), WEDGE * 0.5f64.sqrt() / 8.0, 1e-6);
        // Aimed along +X with C0 down: C90, a quarter turn counter-clockwise for whoever looks along the aim, is c0 x aim.
        let aimed = scene(&luminaire(file, "position = [0.0, 0.0, 0.0]\naim = [1.0, 0.0, 0.0]\nc0 = [0.0, -1.0, 0.0]"));
        assert_near(lux_across(&aimed, [2.0, 0.0, 2.0], [0.0; 3]), WEDGE / 8.0, 1e-6);
        assert_eq!(lux_across(&aimed, [2.0, 0.0, -2.0], [0.0; 3]), 0.0);
    }
}

#[test]
fn types_a_and_b_have_positive_horizontal_angles_on_the_right() {
    // The beam grows with the horizontal and the vertical angle. As LM-63 draws type A: forward, and up.
    for file in ["type_a.ies", "type_b.ies"] {
        let lamp = scene(&luminaire(file, "position = [0.0, 0.0, 0.0]\naim = [0.0, 0.0, -1.0]\nc0 = [0.0, 1.0, 0.0]"));
        let at = |horizontal: f64, vertical: f64| {
            let ((sh, ch), (sv, cv)) =
                (lampyris::math::sin_cos(horizontal * PI / 180.0), lampyris::math::sin_cos(vertical * PI / 180.0));
            // Looking along -Z with +Y up, the right is +X.
            lux_across(&lamp, [10.0 * cv * sh, 10.0 * sv, -10.0 * cv * ch], [0.0; 3]) * 100.0
        };
        let beam = |h: f64, v: f64| {
            let falls = lampyris::math::cos(h * PI / 180.0) * lampyris::math::cos(v * PI / 180.0);
            1000.0 * falls * falls * (1.0 + 0.004 * h + 0.002 * v)
        };
        for (h, v) in [(30.0, 0.0), (-30.0, 0.0), (0.0, 15.0), (0.0, -15.0), (15.0, -15.0)] {
            assert_near(at(h, v), beam(h, v), 1e-5);
        }
    }
}

#[test]
fn ies_and_eulumdat_of_one_luminaire_give_one_lux_map() {
    // The far field of points: one of the files has an opening.
    let hung = "position = [0.3, 2.5, -0.2]\naim = [0.2, -1.0, 0.1]\nc0 = [0.0, 0.3, -1.0]\nextent = \"point\"";
    for (ies, ldt) in [
        ("full.ies", "symmetry_0.ldt"),
        ("half_0_180.ies", "symmetry_2.ldt"),
        ("half_90_270.ies", "symmetry_3.ldt"),
        ("half_minus90_90.ies", "symmetry_3.ldt"),
        ("full.ies", "comma.ldt"),
        ("full.ies", "absolute.ldt"),
        ("full.ies", "conversion.ldt"),
    ] {
        let (ies, ldt) = (scene(&luminaire(ies, hung)), scene(&luminaire(ldt, hung)));
        let mut values = Vec::new();
        for k in 0..256 {
            let position = [f64::from(k % 16) * 0.5 - 4.0, 0.0, f64::from(k / 16) * 0.5 - 4.0];
            let (a, b) = (lux(&ies, position, UP), lux(&ldt, position, UP));
            assert_near(a, b, 1e-6);
            values.push(a);
        }
        // Asymmetric: a map and its mirror image differ.
        assert!((values[0] / values[15] - 1.0).abs() > 0.05 && (values[0] / values[240] - 1.0).abs() > 0.02);
    }
}

#[test]
fn factors_and_a_stated_flux_scale_the_web() {
    let at = "position = [0.0, 2.0, 0.0]\n";
    let one = lux(&scene(&luminaire("full.ies", at)), [0.5, 0.0, 0.5], UP);
    let both =
        lux(&scene(&luminaire("full.ies", &format!("{at}multiplier = 3.0\ndimming = 0.25"))), [0.5, 0.0, 0.5], UP);
    assert_near(both, 0.75 * one, 1e-12);
    let (stated, plan) = planned(&luminaire("full.ies", &format!("{at}flux = 1000.0\nmultiplier = 2.0")), &[]).unwrap();
    assert_near(stated.sources.flux(), 2000.0, 1e-12);
    assert!(
        plan.scene.warnings.iter().any(|w| w.contains("2513.3 lm is scaled to 1000.0 lm")),
        "{:?}",
        plan.scene.warnings
    );
    let (_, odd) = planned(&luminaire("wrong_ratio.ldt", at), &[]).unwrap();
    assert!(odd.scene.warnings.iter().any(|w| w.contains("the file states 8000.0 lm")), "{:?}", odd.scene.warnings);
}

/// A scene of one small triangle far below, and a node with `node`.
fn gltf_scene(extension: Option<Value>, mut node: Value) -> Builder {
    let mut builder = Builder::new();
    let mesh = builder.mesh(&[[0.0, 0.0, 0.0], [1e-3, 0.0, 0.0], [0.0, 1e-3, 0.0]], None);
    builder.node(json!({ "mesh": mesh, "translation": [0.0, -50.0, 0.0] }));
    node["name"] = json!("lamp");
    builder.node(node);
    if let Some(extension) = extension {
        builder.json["extensionsUsed"] = json!(["EXT_lights_ies"]);
        builder.json["extensions"] = json!({ "EXT_lights_ies": extension });
    }
    builder
}

#[test]
fn a_luminaire_hangs_at_a_node_in_its_coordinates() {
    // A quarter turn about X takes -Y to -Z; a scale does not change the light.
    let half = 0.5f64.sqrt();
    let node = json!({ "translation": [1.0, 2.0, 3.0], "rotation": [half, 0.0, 0.0, half], "scale": [2.0, 2.0, 2.0] });
    let glb = gltf_scene(None, node).glb();
    let job = format!("scene = \"s.glb\"\n{}", luminaire("wedge.ies", "node = \"lamp\"\nposition = [0.0, 0.5, 0.0]"));
    let (scene, _) = planned(&job, &[("s.glb", glb.clone())]).unwrap();
    // Half a metre up in the node, doubled and turned: a metre along +Z. The aim is -Z, C90 = c0 x aim = +Y.
    let lamp = [1.0, 2.0, 4.0];
    assert_near(lux_across(&scene, [1.0, 4.0, 2.0], lamp), WEDGE / 8.0, 1e-6);
    assert_eq!(lux_across(&scene, [1.0, 0.0, 2.0], lamp), 0.0);
    for (more, expected) in [
        ("node = \"lantern\"", "luminaire[0].node = lantern: a node of the scene: lamp"),
        ("node = \"lamp\"\naim = [1.0, 0.0, 0.0]\nc0 = [2.0, 0.0, 0.0]", "luminaire[0].c0"),
    ] {
        let job = format!("scene = \"s.glb\"\n{}", luminaire("wedge.ies", more));
        let error = planned(&job, &[("s.glb", glb.clone())]).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn ext_lights_ies_shines_along_minus_z_with_c0_along_x() {
    let uri = format!("data:application/x-ies-lm-63;base64,{}", STANDARD.encode(bytes("wedge.ies")));
    let sources = [
        json!({ "uri": "wedge.ies" }),
        json!({ "uri": uri }),
        json!({ "bufferView": 1, "mimeType": "application/x-ies-lm-63" }),
    ];
    for source in sources {
        let light = json!({ "EXT_lights_ies": { "light": 0, "multiplier": 3.0, "color": [0.5, 0.5, 0.5] } });
        let mut builder = gltf_scene(
            Some(json!({ "lights": [source] })),
            json!({ "translation": [0.0, 1.0, 0.0], "extensions": light }),
        );
        assert_eq!(builder.view(&bytes("wedge.ies")), 1);
        builder.json["extensionsRequired"] = json!(["EXT_lights_ies"]);
        // `wedge.ies` in a comment brings the file into the folder.
        let job = "# wedge.ies\nscene = \"s.glb\"\n";
        let (scene, plan) = planned(job, &[("s.glb", builder.glb())]).unwrap();
        let lamp = [0.0, 1.0, 0.0];
        assert_near(lux_across(&scene, [0.0, 3.0, -2.0], lamp), 1.5 * WEDGE / 8.0, 1e-6);
        assert_eq!(lux_across(&scene, [0.0, -1.0, -2.0], lamp), 0.0);
        assert_eq!(lux_across(&scene, [2.0, 1.0, -2.0], lamp), 0.0);
        let names: Vec<&str> = plan.inputs.iter().map(|i| i.name.as_str()).collect();
        assert!(source_is_kept(&names, &builder), "{names:?}");
    }
    // A point, even of a file with an opening.
    let light = json!({ "EXT_lights_ies": { "light": 0 } });
    let builder = gltf_scene(Some(json!({ "lights": [{ "uri": "opening_box.ies" }] })), json!({ "extensions": light }));
    let (scene, _) = planned("# opening_box.ies\nscene = \"s.glb\"\n", &[("s.glb", builder.glb())]).unwrap();
    assert_eq!((scene.sources.lights.len(), scene.sources.panels.len()), (1, 0));
    // A mirrored node mirrors the light: C90 to -Y.
    let light = json!({ "EXT_lights_ies": { "light": 0 } });
    let node = json!({ "scale": [1.0, -1.0, 1.0], "extensions": light });
    let builder = gltf_scene(Some(json!({ "lights": [{ "uri": "wedge.ies" }] })), node);
    let (scene, _) = planned("# wedge.ies\nscene = \"s.glb\"\n", &[("s.glb", builder.glb())]).unwrap();
    assert_near(lux_across(&scene, [0.0, -2.0, -2.0], [0.0; 3]), WEDGE / 8.0, 1e-6);
}

/// True when a file beside the scene is an input of the plan, and where there is none, the scene alone is.
fn source_is_kept(names: &[&str], builder: &Builder) -> bool {
    let beside = builder.json["extensions"]["EXT_lights_ies"]["lights"][0]["uri"] == json!("wedge.ies");
    if beside { names == ["s.glb", "wedge.ies"] } else { names == ["s.glb"] }
}

#[test]
fn what_hangs_as_if_lengths_were_millimetres_is_mentioned() {
    let glb = gltf_scene(None, json!({ "mesh": 0, "scale": [3e3, 3e3, 3e3], "translation": [0.0, -50.0, 0.0] })).glb();
    for (height, expected) in [("2.8", None), ("2800.0", Some("luminaire[0].position lies 2849 m from the middle"))] {
        let hung = luminaire("wedge.ies", &format!("position = [0.0, {height}, 0.0]"));
        let (_, plan) = planned(&format!("scene = \"s.glb\"\n{hung}"), &[("s.glb", glb.clone())]).unwrap();
        let said = plan.scene.warnings.iter().find(|warning| warning.contains("are lengths in metres?"));
        assert_eq!(said.map(|said| said.contains(expected.unwrap_or("nothing"))), expected.map(|_| true), "{said:?}");
    }
}

#[test]
fn what_is_wrong_in_ext_lights_ies_is_named() {
    let refusal = |extension: Value, node: Value| {
        let builder = gltf_scene(Some(extension), json!({ "extensions": { "EXT_lights_ies": node } }));
        let mut fetch = |uri: &str| if uri == "bad.ies" { Ok(b"TILT=NONE 1".to_vec()) } else { Ok(bytes(uri)) };
        gltf::load("s.glb", &builder.glb(), &mut fetch).map(|_| ()).unwrap_err().to_string()
    };
    let good = || json!({ "lights": [{ "uri": "wedge.ies" }] });
    for (extension, node, expected) in [
        (good(), json!({ "light": 1 }), "nodes[1].extensions.EXT_lights_ies.light = 1"),
        (good(), json!({ "light": 0, "multiplier": -1.0 }), "nodes[1].extensions.EXT_lights_ies.multiplier = -1"),
        (good(), json!({ "light": 0, "color": [0.0, 2.0, 0.0] }), "nodes[1].extensions.EXT_lights_ies.color[1] = 2"),
        (json!({ "lights": [{}] }), json!({ "light": 0 }), "extensions.EXT_lights_ies.lights[0]"),
        (
            json!({ "lights": [{ "bufferView": 9 }] }),
            json!({ "light": 0 }),
            "extensions.EXT_lights_ies.lights[0].bufferView",
        ),
        (json!({ "lights": [{ "uri": "../wedge.ies" }] }), json!({ "light": 0 }), "`..` is refused"),
        (json!({ "lights": [{ "uri": "bad.ies" }] }), json!({ "light": 0 }), "bad.ies: TILT (line 1)"),
    ] {
        let message = refusal(extension, node);
        assert!(message.contains(expected), "{expected}: {message}");
    }
}

#[test]
fn sources_by_formula_give_their_closed_forms() {
    let at = |kind: &str| {
        scene(&format!(
            "[[source]]\nposition = [0.0, 2.0, 0.0]\ndirection = [0.0, -2.0, 0.0]\nintensity = 500.0\n{kind}\n"
        ))
    };
    let power = at("kind = \"cos_power\"\nexponent = 3.0");
    assert_near(power.sources.flux(), 2.0 * PI * 500.0 / 4.0, 1e-12);
    assert_near(lux(&power, [0.0; 3], UP), 500.0 / 4.0, 1e-12);
    // 60 degrees off: I0/8, at 4 m, and half for the surface.
    assert_near(lux(&power, [2.0 * 3f64.sqrt(), 0.0, 0.0], UP), 500.0 / 8.0 / 16.0 / 2.0, 1e-12);
    assert_eq!(lux(&power, [0.0, 4.0, 0.0], [0.0, -1.0, 0.0]), 0.0);
    let spot = at("kind = \"spot\"\ninner_degrees = 30.0\nouter_degrees = 60.0");
    assert_near(lux(&spot, [1.0, 0.0, 0.0], UP), 500.0 / 5.0 * 2.0 / 5f64.sqrt(), 1e-12);
    assert_eq!(lux(&spot, [4.0, 0.0, 0.0], UP), 0.0);
    // Half way between the cones in the cosine a quarter is left.
    let cosine = 0.5 * (0.5 + 0.75f64.sqrt());
    let away = 2.0 * (1.0 / (cosine * cosine) - 1.0).sqrt();
    assert_near(lux(&spot, [away, 0.0, 0.0], UP), 0.25 * 500.0 * cosine * cosine * cosine / 4.0, 1e-9);
}

#[test]
fn lights_out_of_range_are_refused_by_field() {
    let source = "[[source]]\nposition = [0.0, 2.0, 0.0]\nintensity = 5.0\n";
    for (job, expected) in [
        (
            format!("{source}kind = \"spot\"\ndirection = [0, 1, 0]\ninner_degrees = 30.0\nouter_degrees = 30.0\n"),
            "source[0].inner_degrees = 30",
        ),
        (
            format!("{source}kind = \"spot\"\ndirection = [0, 1, 0]\ninner_degrees = 30.0\nouter_degrees = 91.0\n"),
            "source[0].outer_degrees = 91",
        ),
        (format!("{source}kind = \"cos_power\"\ndirection = [0, 1, 0]\nexponent = -1.0\n"), "source[0].exponent = -1"),
        (format!("{source}kind = \"cos_power\"\ndirection = [0, 0, 0]\nexponent = 1.0\n"), "source[0].direction"),
        (luminaire("full.ies", ""), "luminaire[0].position = (missing): a position, a node or a mesh"),
        (luminaire("full.ies", "node = \"lamp\""), "luminaire[0].node = lamp: a node only with a scene"),
        (luminaire("full.ies", "position = [0, 0, 0]\nmultiplier = 0.0"), "luminaire[0].multiplier = 0"),
        (luminaire("full.ies", "position = [0, 0, 0]\ndimming = 1.5"), "luminaire[0].dimming = 1.5"),
        (luminaire("full.ies", "position = [0, 0, 0]\nflux = -1.0"), "luminaire[0].flux = -1"),
        (luminaire("full.ies", "position = [0, 0, 0]\nlumens = 1.0"), "lumens"),
        (luminaire("none.ies", "position = [0, 0, 0]"), "luminaire[0].file = none.ies"),
    ] {
        let error = planned(&job, &[]).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(expected), "{expected}: {error}");
    }
}

/// Where the luminaire in the closed box hangs \[m\].
pub const IN_BOX: [f64; 3] = [1.2, 1.1, 1.7];

/// A closed box around a luminaire, and the luminaire.
pub fn boxed(web: &Photometry, extent: &str, reflectance: f64, job: &str) -> Experiment {
    boxed_with(Model::default(), web, &format!("extent = \"{extent}\""), reflectance, job)
}

/// The same with what is in `model`, of which `shines` says what of it does.
pub fn boxed_with(mut model: Model, web: &Photometry, shines: &str, reflectance: f64, job: &str) -> Experiment {
    let walls = box_walls(DVec3::new(3.0, 2.0, 4.0));
    walls.iter().for_each(|&[origin, u, v]| add_quad(&mut model, origin, u, v, lambert(reflectance, 0.0)));
    let place = format!("position = {IN_BOX:?}\naim = [0.3, -1.0, 0.2]\nc0 = [1.0, 0.0, 0.5]\n");
    let entry = format!("[[luminaire]]\nfile = \"x\"\n{shines}\n{place}");
    let job_file = format!("scene = \"in memory\"\n{entry}{SOMEWHERE}");
    let parsed = lampyris::job::Job::parse(&job_file, "in memory").unwrap();
    model.hang(("in memory", "luminaire[0]"), &parsed.luminaires[0], web).unwrap();
    Experiment::new(job, model).unwrap()
}

#[test]
fn the_lux_on_the_walls_of_a_closed_box_sum_up_to_the_flux() {
    const CELLS: u32 = 200;
    for file in ["full.ies", "half_90_270.ies", "type_b.ies", "symmetry_3.ldt"] {
        let experiment = boxed(&photometry(file), "point", 0.0, SOMEWHERE);
        let size = DVec3::new(3.0, 2.0, 4.0);
        let mut sum = 0.0;
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for side in [0.0, 1.0] {
                let mut normal = [0.0; 3];
                normal[axis] = 1.0 - 2.0 * side;
                for k in 0..CELLS * CELLS {
                    let mut position = [0.0; 3];
                    position[axis] = side * size[axis];
                    position[u] = (f64::from(k % CELLS) + 0.5) / f64::from(CELLS) * size[u];
                    position[v] = (f64::from(k / CELLS) + 0.5) / f64::from(CELLS) * size[v];
                    sum += lux(&experiment.scene, position, normal) * size[u] * size[v] / f64::from(CELLS * CELLS);
                }
            }
        }
        // The midpoint rule over cells of 1 to 2 cm.
        assert_near(sum, experiment.scene.sources.flux(), 2e-4);
    }
}

/// Local against reverse estimation of the light that `of` builds, of which each is given its run: the one draws directions
/// from the source, the other, by `paths` in a batch, asks it for intensities.
pub fn compare_both_ends(what: &str, paths: u32, of: impl Fn(&str) -> Experiment) {
    let run = |estimator: &str, histories: u32| {
        let sampling = format!("[run]\nhistories_per_batch = {histories}\nbatches = 32\nseed = 5\n");
        let meters = point("floor", [0.6, 0.02, 3.0], UP)
            + &point("wall", [2.98, 1.0, 1.0], [-1.0, 0.0, 0.0])
            + &point("up", [1.2, 1.0, 0.4], [0.0, -1.0, 0.0]);
        of(&format!("{sampling}[transport]\nestimator = \"{estimator}\"\n{meters}")).values()
    };
    for (a, b) in run("local", 512).iter().zip(&run("reverse", paths)) {
        let error = (a.standard_error * a.standard_error + b.standard_error * b.standard_error).sqrt();
        // Some thirty comparisons in all at a family-wise 1e-6: 5.5 sigma of a normal, more of Student's t with some 60 degrees.
        assert!((a.mean - b.mean).abs() < 6.5 * error, "{what}: {} against {}, error {error}", a.mean, b.mean);
        assert!(error < 0.02 * b.mean, "{what}: {error} of {}", b.mean);
    }
}

#[test]
fn reflected_light_is_the_same_from_both_ends() {
    for file in ["full.ies", "half_90_270.ies", "type_b.ies"] {
        compare_both_ends(file, 1024, |job| boxed(&photometry(file), "point", 0.6, job));
    }
    let model = || closed_box(DVec3::new(3.0, 2.0, 4.0), &lambert(0.6, 0.0));
    let aimed = "direction = [0.3, -1.0, 0.2]";
    let shining = "reflectance = 0.5\nflux = 100.0";
    for (paths, kind) in [
        (1024, format!("kind = \"cos_power\"\nexponent = 4.0\n{aimed}\nintensity = 100.0")),
        (1024, format!("kind = \"spot\"\ninner_degrees = 20.0\nouter_degrees = 50.0\n{aimed}\nintensity = 100.0")),
        (
            8192,
            format!("kind = \"rectangle\"\nalong = [1, 0, 0]\nsize = [0.8, 0.6]\ntwo_sided = true\n{aimed}\n{shining}"),
        ),
        (8192, format!("kind = \"disc\"\nradius = 0.4\n{aimed}\n{shining}")),
        (8192, format!("kind = \"sphere\"\nradius = 0.3\n{shining}")),
    ] {
        let source = format!("[[source]]\nposition = [1.2, 1.1, 1.7]\n{kind}\n");
        compare_both_ends(&kind, paths, |job| Experiment::new(&format!("{job}{source}"), model()).unwrap());
    }
}

fn lampyris(at: &TempDir, args: &[&str]) -> std::process::Output {
    Command::new(env!("CARGO_BIN_EXE_lampyris")).args(args).current_dir(at.path()).output().unwrap()
}

#[test]
fn a_planned_folder_holds_its_luminaires_and_workers_change_no_bits() {
    let run = "[run]\nhistories_per_batch = 64\nbatches = 16\nbatches_per_shard = 4\n[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 1, 0]\nreflectance = 0.5\n[[point]]\nname = \"above\"\nposition = [0.0, 3.0, 0.0]\nnormal = [0.0, -1.0, 0.0]\n";
    let job = format!(
        "{run}{}{}{}",
        luminaire("full.ies", "position = [0.0, 2.0, 0.0]"),
        luminaire("full.ies", "position = [1.0, 2.0, 0.0]\ndimming = 0.5"),
        luminaire("opening_sphere.ies", "position = [-1.0, 2.0, 0.0]\nextent = \"opening\"")
    );
    let digest = |workers: &str, changed: bool| {
        let at = place(&job, &[]);
        if changed {
            let text = String::from_utf8(bytes("full.ies")).unwrap().replacen("320 324.619", "320 324.62", 1);
            fs::write(at.path().join("full.ies"), text).unwrap();
        }
        assert!(lampyris(&at, &["plan", "job.toml", "-o", "out"]).status.success());
        let planned = fs::read_to_string(at.path().join("out/plan.toml")).unwrap();
        assert_eq!(planned.matches("name = \"full.ies\"").count(), 1, "one file, one input:\n{planned}");
        let out = lampyris(&at, &["run", "-q", "job.toml", "-o", "out", "-w", workers]);
        assert!(out.status.success(), "{out:?}");
        let summary: Value = serde_json::from_slice(&fs::read(at.path().join("out/summary.json")).unwrap()).unwrap();
        (summary["plan_digest"].clone(), summary["results_digest"].clone())
    };
    let (one, two, other) = (digest("1", false), digest("2", false), digest("2", true));
    assert_eq!(one, two);
    assert!(one.0 != other.0 && one.1 != other.1);
    let at = place(&job, &[]);
    assert!(lampyris(&at, &["plan", "job.toml", "-o", "out"]).status.success());
    for name in ["full.ies", "job.toml"] {
        fs::remove_file(at.path().join(name)).unwrap();
    }
    let out = lampyris(&at, &["work", "out", "--shard", "0"]);
    assert!(out.status.success(), "{out:?}");
}

#[test]
fn the_command_says_what_a_file_holds_and_draws_it() {
    let at = place("# half_90_270.ies wrong_ratio.ldt latin_1.ies", &[("bad.ies", b"TILT=NONE\n1 2".to_vec())]);
    let out = lampyris(&at, &["luminaire", "half_90_270.ies"]);
    let text = String::from_utf8(out.stdout).unwrap();
    for line in [
        "IES LM-63-1995, type C",
        "mirrored at C90-C270",
        "7, 90 .. 270 degrees",
        "2513.27 lm, 64.91 %",
        "20 W, 125.7 lm/W",
        "curves in half_90_270.ies.png",
    ] {
        assert!(text.contains(line), "{line}:\n{text}");
    }
    let picture = fs::read(at.path().join("half_90_270.ies.png")).unwrap();
    let reader = png::Decoder::new(std::io::Cursor::new(picture)).read_info().unwrap();
    assert_eq!((reader.info().width, reader.info().height), (680, 760));
    let odd = String::from_utf8(lampyris(&at, &["luminaire", "wrong_ratio.ldt", "-o", "x.png"]).stdout).unwrap();
    assert!(
        odd.contains("warning") && odd.contains("the file states 8000.0 lm") && at.path().join("x.png").exists(),
        "{odd}"
    );
    for (args, expected) in [
        (&["bad.ies"][..], "bad.ies: candela multiplier (line 2)"),
        (&["none.ies"], "an IES or EULUMDAT file"),
        (&["latin_1.ies", "-o", "latin_1.ies"], "--output = latin_1.ies: a file name that ends in .png"),
        (&["latin_1.ies", "-o", "no/x.png"], "--output = no/x.png: a file in a folder that is there"),
        (&["latin_1.ies", "-o", ".."], "--output = ..: a file name"),
    ] {
        let out = lampyris(&at, &[&["luminaire"], args].concat());
        let error = String::from_utf8(out.stderr).unwrap();
        assert!(out.status.code() == Some(2) && error.contains(expected), "{error}");
    }
    assert_eq!(fs::read(at.path().join("latin_1.ies")).unwrap(), bytes("latin_1.ies"), "the input is kept");
}
