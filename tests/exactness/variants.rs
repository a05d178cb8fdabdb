//! Every option of a job is as exact as the defaults: estimators, ways of sampling, bounds of a closed and of an open
//! scene, surfaces of every kind, channels. One small job, changed line by line; the parts of it are run with other instructions.

use crate::bits::{read_map, summary};
use crate::faults::die_at;
use crate::place::{Place, plan_in};
use crate::process::{expect, lampyris, run_quietly, work};
use lampyris::farm::durable::Step;
use lampyris::geometry::simd;
use lampyris::scene::textures::Coverage;
use lampyris::scene::{Light, gltf};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

const JOB: &str = include_str!("variants.toml");
const SHARDS: u64 = 4;

/// An infinite plane below the room: it has nothing to do with the light in it, but makes the scene an open one.
const OPEN: &str = "[[plane]]\npoint = [0.0, -3.0, 0.0]\nnormal = [0.0, 1.0, 0.0]\nreflectance = 0.3\n[[camera]]\n";
/// Laws that the room has not: matt and glossy ones, a mirror of steel and a picture with a texture are there already.
const OF_SURFACES: (&str, &str) = (
    "[[camera]]\n",
    "[[material]]\nname = \"floorboards\"\nkind = \"tabulated\"\nfile = \"floor.brdf\"\n\
     [[material]]\nname = \"accent wall\"\nkind = \"phong\"\ndiffuse = [0.3, 0.2, 0.1]\nspecular = 0.4\nexponent = 20\n\
     [[material]]\nname = \"lampshade\"\nkind = \"opal\"\nreflectance = 0.4\ntransmittance = [0.5, 0.4, 0.3]\n\
     [[material]]\nname = \"brushed steel\"\nkind = \"mirror\"\nreflectance = 0.8\n\
     [[material]]\nname = \"paper green\"\nkind = \"pane\"\n\
     [[material]]\nname = \"apple\"\nkind = \"glass\"\ntransmittance_per_metre = 0.1\n[[camera]]\n",
);
const FLOOR: &str = "lampyris-brdf 1\nchannels 1\ntheta 0 80\nphi 0 180\n0.1 0.1\n0.1 0.1\n0.1 0.1\n0.1 0.4\n";
/// Every kind of light, and of most kinds so many that they are chosen: parallel light and a sky, an opening to aim at, more than 16 lights
/// without extent, photometric webs of the job and of the scene among them, more than 64 emissive triangles, spheres, a luminaire of every
/// shape, and a mesh that shines.
fn of_lights() -> String {
    let omni = |i: u32| {
        let x = 0.4 + 0.25 * f64::from(i);
        format!("[[source]]\nkind = \"omni\"\nposition = [{x}, 2.2, -0.4]\nintensity = {}\n", 1 + i % 3)
    };
    let luminaire = |(i, file): (usize, &&str)| {
        let (x, z) = (0.7 + 0.5 * i as f64, -3.2);
        format!(
            "[[luminaire]]\nfile = \"{file}\"\nposition = [{x}, 2.0, {z}]\nextent = \"opening\"\nmultiplier = 0.1\n"
        )
    };
    let omnis: String = (0..14).map(omni).collect();
    let luminaires: String = OPENINGS.iter().enumerate().map(luminaire).collect();
    LIGHTS.to_owned() + &omnis + &luminaires
}

/// Files of luminaires of tests/luminaires.
const OPENINGS: [&str; 8] = [
    "opening_rectangle.ies",
    "opening_disc.ies",
    "opening_box.ies",
    "opening_cylinder_upright.ies",
    "opening_cylinder_along_c0.ies",
    "opening_cylinder_across_c0.ies",
    "opening_sphere.ies",
    "opening_disc_upright.ies",
];
/// The file of EXT_lights_ies.
const OF_SCENE: &str = "wedge.ies";
const LIGHTS: &str = "\
[sky]
model = 12
horizontal_illuminance = 10000
ground_reflectance = 0.2
[sky.sun]
azimuth_degrees = 20
elevation_degrees = 40
illuminance = 30000
[[opening]]
corners = [[1, 1, -4], [3, 1, -4], [3, 2, -4]]
[[source]]
kind = \"sphere\"
position = [1, 2, -1]
radius = 0.1
flux = 100
[[source]]
kind = \"sphere\"
position = [4, 2, -1]
radius = 0.05
flux = 50
[[source]]
kind = \"disc\"
position = [2, 2, -1]
direction = [0, -1, 0]
radius = 0.1
luminance = 1000
[[source]]
kind = \"rectangle\"
position = [3, 2, -1]
direction = [0, -1, 0.5]
along = [1, 0, 0]
size = [0.4, 0.2]
flux = 100
two_sided = true
[[source]]
kind = \"spot\"
position = [3, 2.2, -2]
direction = [0, -1, 0]
intensity = 100
inner_degrees = 10
outer_degrees = 20
[[source]]
kind = \"cos_power\"
position = [2, 2.2, -2]
direction = [0, -1, 0.2]
intensity = 100
exponent = 4
[[luminaire]]
file = \"opening_box.ies\"
mesh = \"book\"
[[luminaire]]
file = \"opening_rectangle.ies\"
position = [3.5, 2, -0.8]
aim = [0.2, -1, 0.1]
extent = \"point\"
";
/// The one sky that the variant of all lights has not.
const OF_SKY: (&str, &str) = ("[[camera]]\n", "[sky]\nmodel = \"uniform\"\nzenith_luminance = 1000\n[[camera]]\n");
const RANDOM: (&str, &str) = ("seed = 23", "seed = 23\nsampling = \"random\"");
const RGB: (&str, &str) = ("seed = 23", "seed = 23\nchannels = \"rgb\"");
const OF_OPEN: (&str, &str) = ("[[camera]]\n", OPEN);
const PLAIN: (&str, &str) = ("bounded = true", "bounded = false");
const REVERSE: (&str, &str) = ("bounded = true", "estimator = \"reverse\"");

/// Without any peak: then a flag says which receivers are continued.
const DULL: (&str, &str) = ("room.glb", "dull.glb");

/// Name and changes.
type Variant = (&'static str, &'static [(&'static str, &'static str)]);

const VARIANTS: [Variant; 7] = [
    ("closed", &[]),
    ("random-rgb", &[RANDOM, RGB]),
    ("open", &[OF_OPEN, DULL]),
    ("open-random-rgb", &[OF_OPEN, RANDOM, RGB]),
    ("plain-sky", &[PLAIN, OF_SKY]),
    ("reverse-rgb", &[REVERSE, RGB]),
    ("surfaces", &[("room.glb", "peaked.glb"), OF_SURFACES, RGB]),
];

/// A place with the scenes of all variants.
fn place() -> Place {
    let place = Place::new();
    let webs = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/luminaires");
    for file in OPENINGS.into_iter().chain([OF_SCENE]) {
        fs::copy(webs.join(file), place.path(file)).unwrap();
    }
    let scene = fs::read(place.path("room.glb")).unwrap();
    fs::write(place.path("floor.brdf"), FLOOR).unwrap();
    fs::write(place.path("dull.glb"), polished(scene.clone(), b'9')).unwrap();
    fs::write(place.path("peaked.glb"), edited(&polished(scene.clone(), b'1'), veiled)).unwrap();
    fs::write(place.path("lit.glb"), edited(&scene, lit)).unwrap();
    place
}

/// The same scene with its JSON changed.
fn edited(glb: &[u8], change: impl FnOnce(&mut Value)) -> Vec<u8> {
    let length = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize;
    let (json, others) = glb[20..].split_at(length(12));
    let mut json: Value = serde_json::from_slice(json).unwrap();
    change(&mut json);
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let lengths = [20 + text.len() + others.len(), text.len()].map(|n| (n as u32).to_le_bytes());
    [&glb[..8], &lengths[0], &lengths[1], b"JSON", &text, others].concat()
}

/// The one of `list` called `name`.
fn called<'a>(list: &'a mut Value, name: &str) -> &'a mut Value {
    list.as_array_mut().unwrap().iter_mut().find(|entry| entry["name"] == name).unwrap()
}

/// Half of what meets the rug, which has a texture, goes through.
fn veiled(json: &mut Value) {
    let rug = called(&mut json["materials"], "rug");
    rug["alphaMode"] = "BLEND".into();
    rug["pbrMetallicRoughness"]["baseColorFactor"] = json!([1.0, 1.0, 1.0, 0.5]);
}

/// A web of EXT_lights_ies beside the spot of the shelf.
fn lit(json: &mut Value) {
    json["extensionsUsed"].as_array_mut().unwrap().push("EXT_lights_ies".into());
    json["extensions"]["EXT_lights_ies"] = json!({ "lights": [{ "uri": OF_SCENE }] });
    called(&mut json["nodes"], "shelf spot")["extensions"]["EXT_lights_ies"] = json!({ "light": 0, "multiplier": 2.0 });
}

/// The same scene with another roughness, 0.`digit`, of all materials that are not matt.
fn polished(mut scene: Vec<u8>, digit: u8) -> Vec<u8> {
    let key = b"\"roughnessFactor\":0.";
    let places = scene.windows(key.len()).enumerate().filter(|(_, w)| w == key).map(|(i, _)| i + key.len());
    let places: Vec<usize> = places.collect();
    assert!(!places.is_empty());
    for at in places {
        let digits = scene[at..].iter().take_while(|b| b.is_ascii_digit()).count();
        scene[at..at + digits].fill(b'0');
        scene[at] = digit;
    }
    scene
}

fn job_of(place: &Place, name: &str, changes: &[(&str, &str)]) -> PathBuf {
    let change = |text: String, (from, to): &(&str, &str)| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    };
    let path = place.path(&format!("{name}.toml"));
    fs::write(&path, changes.iter().fold(JOB.to_owned(), change)).unwrap();
    path
}

/// All decoded results of a folder: digest of the summary, samples of the maps, text of the tables.
#[derive(Debug, PartialEq)]
struct Results {
    digest: String,
    maps: BTreeMap<String, Vec<u32>>,
    tables: BTreeMap<String, String>,
}

fn results(dir: &Path) -> Results {
    let names = fs::read_dir(dir).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
    let (mut maps, mut tables) = (BTreeMap::new(), BTreeMap::new());
    for name in names {
        match name.rsplit_once('.') {
            Some((map, "exr")) => maps.extend(read_map(dir, map)),
            Some((table, "csv")) => drop(tables.insert(table.to_owned(), fs::read_to_string(dir.join(&name)).unwrap())),
            _ => {}
        }
    }
    assert!(!tables.is_empty());
    Results { digest: summary(dir)["results_digest"].as_str().unwrap().to_owned(), maps, tables }
}

fn run(job: &Path, dir: &Path, workers: usize) -> Results {
    expect(0, &mut run_quietly(job, dir, workers));
    results(dir)
}

/// One worker; three workers with plain instructions; workers killed around the first checkpoint of every shard and resumed by two
/// threads, with each kind of instructions in turn, in another order; a run extended from 16 batches, which end inside a shard; two folders merged: the same results.
fn assert_exact(name: &str, changes: &[(&str, &str)]) {
    let place = place();
    let job = job_of(&place, name, changes);
    let straight = run(&job, &place.path("straight"), 1);
    let three = place.path("three");
    expect(0, run_quietly(&job, &three, 3).env(simd::VARIABLE, simd::Path::Scalar.name()));
    assert_eq!(straight, results(&three), "{name}: workers");
    let mut paths = simd::Path::ALL.into_iter().filter(|path| path.is_available()).cycle();
    let dir = place.plan(&job, "killed");
    for shard in (0..SHARDS).rev() {
        // One shard goes on from its first checkpoint, the next one has lost it.
        die_at(&dir, shard, if shard % 2 == 0 { Step::AfterRename } else { Step::BeforeRename });
        let path = paths.next().expect("plain instructions are always there");
        let mut work = lampyris(&["work", "--threads", "2", "--shard", &shard.to_string()]);
        expect(0, work.env(simd::VARIABLE, path.name()).arg(&dir));
    }
    expect(0, lampyris(&["merge"]).arg(&dir));
    assert_eq!(straight, results(&dir), "{name}: kills and threads");
    let dir = place.path("extended");
    run(&job_of(&place, name, &[changes, &[("batches = 18", "batches = 16")]].concat()), &dir, 2);
    let job = job_of(&place, name, changes);
    assert_eq!(straight, run(&job, &dir, 2), "{name}: extension");
    let [a, b] = ["a", "b"].map(|part| place.plan(&job, part));
    for (dir, shards) in [(&a, [3, 0]), (&b, [1, 2])] {
        shards.into_iter().for_each(|shard| drop(expect(0, &mut work(dir, shard))));
    }
    for (i, folders) in [[&a, &b], [&b, &a]].into_iter().enumerate() {
        let out = place.path(&format!("merged-{i}"));
        expect(0, lampyris(&["merge"]).args(folders).arg("-o").arg(&out));
        assert_eq!(straight, results(&out), "{name}: merged");
    }
}

#[test]
fn every_variant_is_exact() {
    for (name, changes) in VARIANTS {
        assert_exact(name, changes);
    }
}

#[test]
fn every_kind_of_light_is_exact_with_all_instructions() {
    let lights = of_lights() + "[[camera]]\n";
    let changes = [("[[camera]]\n", lights.as_str()), ("room.glb", "lit.glb")];
    assert_exact("lights", &changes);
    let place = place();
    let job = job_of(&place, "lights", &changes);
    let on_path = |path: &simd::Path| {
        let dir = place.path(path.name());
        expect(0, run_quietly(&job, &dir, 2).env(simd::VARIABLE, path.name()));
        results(&dir)
    };
    let all: Vec<Results> = simd::Path::ALL.iter().filter(|path| path.is_available()).map(on_path).collect();
    assert!(all.iter().all(|results| *results == all[0]));
}

#[test]
fn direct_simulation_is_exact() {
    let grid = JOB.find("[[grid]]").unwrap()..JOB.find("[[point]]").unwrap();
    let receivers = &JOB[JOB.find("[[camera]]").unwrap()..];
    let counted = ("bounded = true", "estimator = \"direct_simulation\"");
    assert_exact("direct-simulation", &[(receivers, &JOB[grid]), counted]);
}

#[test]
fn variants_are_what_they_are_called() {
    let place = place();
    let bounds = |(name, changes): &Variant| plan_in(&place.plan(&job_of(&place, name, changes), name)).bounds;
    let [closed, _, open, _, plain, reverse, ..] = VARIANTS.each_ref().map(bounds);
    assert!(closed.len() == 5 && closed.iter().all(|b| *b == closed[0]), "{closed:?}");
    // Each set has a bound of its own; the region, the last of them, is made of pixels.
    assert!(open.len() == 5 && open[..4].iter().all(|b| b.is_finite()) && open[0] != open[2], "{open:?}");
    assert!(plain.is_empty() && reverse.is_empty());
    let model = |scene: &str| {
        let bytes = fs::read(place.path(scene)).unwrap();
        gltf::load(scene, &bytes, &mut |beside| Ok(fs::read(place.path(beside)).unwrap())).unwrap()
    };
    let peaked = |scene: &str| model(scene).surfaces.iter().filter(|s| s.reflectance.is_peaked()).count();
    // Steel and glazed clay of the room are peaked; floor, oak, lacquer and apple become so.
    assert_eq!(["dull.glb", "room.glb", "peaked.glb"].map(peaked), [0, 2, 6]);
    let [veiled, lit] = ["peaked.glb", "lit.glb"].map(model);
    assert!(veiled.textures.of_surface.iter().flatten().any(|t| t.coverage == Coverage::Blend));
    assert!(lit.lights.iter().any(|light| matches!(light, Light::Luminaire(_))));
}

#[test]
fn a_plan_made_again_has_the_same_bounds_for_any_number_of_threads() {
    let place = place();
    let job = job_of(&place, "open", &[OF_OPEN]);
    let text = |threads: &str| {
        let dir = place.path(threads);
        let mut plan = lampyris(&["plan"]);
        expect(0, plan.env("RAYON_NUM_THREADS", threads).arg(&job).arg("-o").arg(&dir));
        fs::read_to_string(dir.join("plan.toml")).unwrap()
    };
    let one = text("1");
    assert!(one.contains("\nbounds = [0."), "{one}");
    assert_eq!(one, text("2"));
}

#[test]
fn edited_bounds_are_refused() {
    let place = place();
    let dir = place.plan(&job_of(&place, "closed", &[]), "dir");
    let path = dir.join("plan.toml");
    let text = fs::read_to_string(&path).unwrap();
    let start = text.find("bounds = [").unwrap();
    let line = &text[start..start + text[start..].find('\n').unwrap()];
    let first = &line["bounds = [".len()..line.find(',').unwrap()];
    let of = |b: &str| line.replacen(first, b, 1);
    for edited in ["bounds = []".to_owned(), of("1.0"), of("nan"), of("0.0"), of("-0.1"), of("inf")] {
        fs::write(&path, text.replace(line, &edited)).unwrap();
        for command in [&mut work(&dir, 0), lampyris(&["merge"]).arg(&dir), lampyris(&["status"]).arg(&dir)] {
            let said = expect(2, command);
            assert!(said.contains("plan.toml: refused: edited or damaged"), "{edited}: {said}");
        }
    }
}

/// Sets that are added before, between and behind those of the job.
const MORE: &str = r#"[[camera]]
name = "close"
node = "camera_detail"
width = 6
height = 4
[[grid]]
name = "shelf"
origin = [1.0, 1.0, -1.0]
u = [1.0, 0.0, 0.0]
v = [0.0, 1.0, 0.0]
normal = [0.0, 0.0, 1.0]
columns = 3
rows = 2
[[region]]
name = "corner"
camera = "close"
rectangle = [0, 0, 2, 2]
"#;

#[test]
fn other_receivers_change_neither_a_bound_nor_a_number() {
    for (name, changes) in [VARIANTS[0], VARIANTS[2], VARIANTS[3]] {
        let place = place();
        let (alone, with) = (place.path("alone"), place.path("with"));
        let before = run(&job_of(&place, name, changes), &alone, 1);
        let more = format!("{MORE}[[camera]]\nname = \"view\"");
        let after =
            run(&job_of(&place, name, &[changes, &[("[[camera]]\nname = \"view\"", &more)]].concat()), &with, 1);
        for (map, samples) in &before.maps {
            assert!(*samples == after.maps[map], "{name}: {map}");
        }
        for table in ["floor", "points"] {
            assert_eq!(before.tables[table], after.tables[table], "{name}");
        }
        let regions = &before.tables["regions"];
        assert!(regions.lines().all(|line| after.tables["regions"].lines().any(|l| l == line)), "{name}: {regions}");
        // By name, for they have other numbers now.
        let bounds = |dir: &Path| -> BTreeMap<String, u64> {
            let plan = plan_in(dir);
            plan.sets().into_iter().map(|s| s.name).zip(plan.bounds.iter().map(|b| b.to_bits())).collect()
        };
        let (before, after) = (bounds(&alone), bounds(&with));
        assert!(before.len() == 5 && after.len() == 8, "{before:?} {after:?}");
        assert!(before.iter().all(|(set, b)| *b == after[set]), "{name}: {before:?} {after:?}");
    }
}
