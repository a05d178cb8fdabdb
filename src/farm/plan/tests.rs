use super::*;
use crate::farm::testing::{JOB, plan, plan_of};

fn changed(from: &str, to: &str) -> Plan {
    assert!(JOB.contains(from), "{from}");
    plan_of(&JOB.replace(from, to)).unwrap()
}

#[test]
fn shards_are_fixed_ranges_whatever_the_total() {
    let ranges: Vec<_> = plan().shards().collect();
    assert_eq!(ranges, [0..4, 4..8, 8..10]);
    let longer: Vec<_> = changed("batches = 10", "batches = 17").shards().collect();
    assert_eq!(longer, [0..4, 4..8, 8..12, 12..16, 16..17]);
    assert_eq!(plan().shard(3), 10..10);
    assert_eq!(plan().shard(u64::MAX), 10..10);
}

#[test]
fn batches_confidence_and_intervals_are_outside_the_digest() {
    for (from, to) in [
        ("batches = 10", "batches = 12"),
        ("seed = 7", "seed = 7\nconfidence = 0.5"),
        ("seed = 7", "seed = 7\ncheckpoint_seconds = 1"),
    ] {
        let other = changed(from, to);
        assert_eq!(other.digest, plan().digest, "{to}");
        assert!(other.differences(&plan()).is_empty() && other.obstacles(&plan()).is_empty());
    }
}

#[test]
fn everything_else_is_inside_and_named() {
    let cases = [
        ("seed = 7", "seed = 8", "run.seed: 7 in the plan, 8 now"),
        ("channels = \"rgb\"", "", "run.channels: \"rgb\" in the plan, \"luminance\" now"),
        ("batches_per_shard = 4", "batches_per_shard = 5", "run.batches_per_shard: 4"),
        ("seed = 7", "seed = 7\nhistories_per_batch = 1", "run.histories_per_batch: 64 in the plan, 1 now"),
        ("[[camera]]", "[transport]\nroulette_below = \"analog\"\n[[camera]]", "transport.roulette_below: 0.05"),
        ("width = 5", "width = 6", "camera[0].width: 5 in the plan, 6 now"),
        ("width = 5", "width = 5\nup = [1, 0, 0]", "camera[0].up: (none) in the plan, [1.0,0.0,0.0] now"),
        ("rows = 64\nkeep_batches = false", "rows = 64", "grid[0].keep_batches: false in the plan, true now"),
        ("0.8, 0.0]\nnormal", "0.9, 0.0]\nnormal", "point[0].position: [0.0,0.8,0.0] in the plan, [0.0,0.9,0.0] now"),
        ("intensity = 100.0", "intensity = 1", "source[0].intensity: 100.0 in the plan, 1.0 now"),
        (
            "[[source]]",
            "[[sphere]]\ncenter=[0,0,0]\nradius=1\nreflectance=0.5\n[[source]]",
            "sphere[0]: (none) in the plan",
        ),
        ("[[point]]", "[[point]]\nname='p'\nposition=[0,0,0]\nnormal=[0,1,0]\n[[point]]", "point[1]: (none)"),
    ];
    for (from, to, expected) in cases {
        let other = changed(from, to);
        assert_ne!(other.digest, plan().digest, "{to}");
        let differences = other.differences(&plan());
        assert!(differences.iter().any(|d| d.starts_with(expected)), "{expected}: {differences:?}");
    }
}

#[test]
fn inputs_count_by_content_and_are_named() {
    let with = |files: &[(&str, &str)]| {
        let inputs = files.iter().map(|(name, content)| Input::of(name, content.as_bytes())).collect();
        let base = plan();
        Plan::new("test", base.job, base.job_file, inputs, base.scene).unwrap().bounded(base.bounds)
    };
    let old = with(&[("room.gltf", "a"), ("room.bin", "b")]);
    assert_eq!(old.digest, with(&[("moved.gltf", "a"), ("room.bin", "b")]).digest);
    let edited = with(&[("room.gltf", "a"), ("room.bin", "c")]);
    assert_eq!(edited.differences(&old), ["input \"room.bin\": its content has changed"]);
    let fewer = with(&[("room.gltf", "a")]);
    assert_eq!(fewer.differences(&old), ["input 1: \"room.bin\" in the plan, (none) now"]);
}

#[test]
fn more_batches_extend_and_fewer_are_refused() {
    let more = changed("batches = 10", "batches = 12");
    assert!(more.obstacles(&plan()).is_empty());
    let obstacles = plan().obstacles(&more);
    assert_eq!(obstacles.len(), 1);
    assert!(obstacles[0].starts_with("run.batches: 12 in the plan, 10 now"), "{obstacles:?}");
}

#[test]
fn cameras_with_and_without_optional_fields_have_different_bytes() {
    // A node called like the bytes of the other fields must not hash like them.
    let camera = |node: Option<&str>, up: Vector| Camera {
        name: "a".to_owned(),
        node: node.map(str::to_owned),
        eye: None,
        target: None,
        up,
        vertical_fov_degrees: None,
        width: 1,
        height: 1,
        pixel_samples: 1,
        monitor: Vec::new(),
    };
    let bytes = |c: &Camera| postcard::to_stdvec(&camera_content(c)).unwrap();
    let zeros = "\0".repeat(24);
    assert_ne!(bytes(&camera(Some(&zeros), None)), bytes(&camera(None, Some([0.0; 3]))));
}

#[test]
fn kept_scores_and_shards_beyond_the_limits_are_refused() {
    let refused = |text: String| plan_of(&text).unwrap_err().to_string();
    let grid = refused(JOB.replace("columns = 2\nrows = 2", "columns = 5000\nrows = 5000"));
    assert!(grid.contains("grid[1].keep_batches = true (\"desk\", with the others 3.7 GiB of batch scores)"), "{grid}");
    assert!(grid.contains("at most 2.0 GiB of kept batch scores; set keep_batches = false"), "{grid}");
    let shards = refused(JOB.replace("batches = 10", "batches = 1000000"));
    assert!(shards.contains("run.batches_per_shard = 4 (250000 shards): large enough"), "{shards}");
    let no_grid = JOB.replace("rows = 2\n", "rows = 2\nkeep_batches = false\n");
    let batches = refused(
        no_grid.replace("batches = 10\nbatches_per_shard = 4", "batches = 4000000000\nbatches_per_shard = 1000000"),
    );
    assert!(batches.contains("run.batches = 4000000000"), "{batches}");
}

#[test]
fn sizes_cover_what_a_checkpoint_takes() {
    let sizes = plan().sizes();
    assert!(sizes.worker > sizes.checkpoint && sizes.checkpoints == 3 * sizes.checkpoint);
    // Batch scores of four grid points, a lux-meter and the flux; the lux-meter is monitored.
    assert_eq!(sizes.kept, 10 * (4 + 1 + 5) * 16 + 10 * 48 + 200 * 8);
    let watched =
        plan_of(&JOB.replace("columns = 65\n", "columns = 65\nmonitor = [[1, 2], [3, 4]]\n")).unwrap().sizes();
    assert_eq!(watched.kept - sizes.kept, 2 * (10 * 48 + 200 * 8));
    assert_eq!(watched.checkpoint - sizes.checkpoint, 2 * (4 * 48 + 200 * 8));
    assert_eq!(human(5 << 20), "5.0 MiB");
    assert_eq!(human(1000), "1000 B");
}

#[test]
fn the_digest_of_a_known_job_stays() {
    // It changes with NUMERICS, or when the form of a job changes; old folders are then refused, so be sure.
    assert_eq!(NUMERICS, 6);
    assert_eq!(&plan().digest[..16], "ef8c8777b5c66f73");
}

#[test]
fn what_of_a_luminaire_shines_is_in_the_plan_and_in_the_digest() {
    let of = |extent: &str| {
        plan_of(&format!("{JOB}[[luminaire]]\nfile = \"lamp.ies\"\nposition = [0, 2, 0]\n{extent}")).unwrap()
    };
    let [left_out, file, point, opening] =
        ["", "extent = \"file\"", "extent = \"point\"", "extent = \"opening\""].map(of);
    assert_eq!((&left_out.digest, &left_out.job), (&file.digest, &file.job));
    assert!(toml::to_string(&left_out).unwrap().contains("extent = \"file\""));
    // A folder planned when a point was the default holds "point", and is not taken for one of the same job now.
    assert_eq!(left_out.differences(&point), ["luminaire[0].extent: \"point\" in the plan, \"file\" now"]);
    assert!(point.digest != opening.digest && opening.digest != file.digest);
}

#[test]
fn every_table_of_a_job_is_inside_the_digest() {
    const MORE: &str = r#"
[[gonio]]
name = "eye"
position = [0.0, 1.0, 0.0]
width = 4
height = 2
[[region]]
name = "part"
camera = "view"
rectangle = [0, 0, 2, 2]
[[plane]]
point = [0.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
reflectance = 0.5
[[sphere]]
center = [0.0, 5.0, 0.0]
radius = 1.0
reflectance = 0.5
[[replace]]
node = "head"
harmonic = "head.harmonic"
[[material]]
name = "wall"
kind = "lambert"
reflectance = 0.5
[[luminaire]]
file = "lamp.ies"
position = [0.0, 2.0, 0.0]
[sky]
model = 5
zenith_luminance = 1.0
[[opening]]
corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
[stop]
relative_half_width = 0.1
max_batches = 99
[[ratio]]
name = "ratio"
numerator = "meter"
denominator = "desk"
"#;
    let text = JOB.replacen("batches = 10\n", "", 1);
    let whole = plan_of(&format!("scene = \"room.glb\"\n{text}{MORE}")).unwrap();
    let table = toml::Table::try_from(&whole.job).unwrap();
    assert_eq!(table.len(), 18, "a key that this test does not know: {table}");
    let without = |keys: &[&str]| {
        let mut rest = table.clone();
        keys.iter().for_each(|key| drop(rest.remove(*key)));
        let mut job: Job = rest.try_into().unwrap();
        // What is left out is filled in with what stood there.
        job.run = whole.job.run.clone();
        Plan { job, ..whole.clone() }.content_digest()
    };
    let outside = ["scene", "stop", "ratio"];
    assert_eq!(without(&outside), whole.content_digest());
    for key in
        table.keys().filter(|key| !outside.contains(&key.as_str()) && !["run", "transport"].contains(&key.as_str()))
    {
        assert_ne!(without(&[key]), whole.content_digest(), "{key}");
    }
}
