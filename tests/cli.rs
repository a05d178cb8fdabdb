//! The command line on wrong usage and bad input: exit codes and messages, run as a real process.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

/// A small job that needs no scene file.
const JOB: &str = r#"
[run]
histories_per_batch = 1
batches = 4
batches_per_shard = 2
sampling = "random"
[[camera]]
name = "view"
eye = [0.0, 1.0, 3.0]
target = [0.0, 1.0, 0.0]
vertical_fov_degrees = 40.0
width = 4
height = 3
[[grid]]
name = "floor"
origin = [0.0, 0.0, 0.0]
u = [1.0, 0.0, 0.0]
v = [0.0, 0.0, -1.0]
normal = [0.0, 1.0, 0.0]
columns = 2
rows = 2
[[point]]
name = "desk"
position = [0.0, 0.8, 0.0]
normal = [0.0, 1.0, 0.0]
[[gonio]]
name = "eye"
position = [0.0, 0.8, 0.0]
width = 4
height = 2
[[plane]]
point = [0.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
reflectance = 0.5
[[sphere]]
center = [0.0, 5.0, 0.0]
radius = 1.0
facing = "outward"
reflectance = 0.5
[[source]]
kind = "omni"
position = [0.0, 2.0, 0.0]
intensity = 100.0
"#;

fn lampyris(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lampyris"));
    command.current_dir(folder).args(args).env_remove("SLURM_ARRAY_TASK_ID").env_remove("LAMPYRIS_FAULT");
    command.output().unwrap()
}

/// Runs and expects exit code `code`; returns what was said on standard error, or else on standard output.
fn expect(folder: &Path, code: i32, args: &[&str]) -> String {
    let output = lampyris(folder, args);
    let said = String::from_utf8(output.stderr).unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(code), "{args:?}: {said}{text}");
    assert!(!said.contains("panicked"), "{args:?}: {said}");
    if said.is_empty() { text } else { said }
}

fn folder_with(job: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("job.toml"), job).unwrap();
    folder
}

/// A planned folder `out` beside the job.
fn planned() -> TempDir {
    let folder = folder_with(JOB);
    expect(folder.path(), 0, &["plan", "job.toml", "-o", "out"]);
    folder
}

#[test]
fn bad_values_in_a_job_are_named_with_field_value_and_range() {
    // (what stands in the job, what somebody typed instead, fragment of the message)
    let cases = [
        ("batches = 4", "batches = 0", "run.batches = 0: 1 .. 4294967296"),
        ("batches = 4", "batches = -4", "run.batches (line 4) = -4: a whole number, 0 or more"),
        ("batches = 4", "batches = \"many\"", "run.batches (line 4) = \"many\": a whole number, 0 or more"),
        ("sampling = \"random\"", "", "run.batches = 4: at least 16; any number with sampling = \"random\""),
        ("sampling = \"random\"", "sampling = \"sobol\"", "run.sampling (line 6) = \"sobol\": one of random, rqmc"),
        (
            "sampling = \"random\"",
            "sampling = \"rqmc\"\n[transport]\nestimator = \"reverse\"",
            "run.sampling = rqmc: \"random\" with estimator = \"reverse\", whose paths are independent",
        ),
        (
            "histories_per_batch = 1\nbatches = 4",
            "histories_per_batch = 1\nthinning = 0\nbatches = 4",
            "run.thinning = 0: 1 .. 1048576: histories_per_batch x thinning is at most 1048576",
        ),
        (
            "histories_per_batch = 1\nbatches = 4",
            "histories_per_batch = 1024\nthinning = 1025\nbatches = 4",
            "run.thinning = 1025: 1 .. 1024",
        ),
        (
            "histories_per_batch = 1\nbatches = 4\nbatches_per_shard = 2\nsampling = \"random\"",
            "histories_per_batch = 4\nthinning = 3\nbatches = 16",
            "run.thinning = 3: a power of two: 2 or 4; any number with sampling = \"random\"",
        ),
        (
            "histories_per_batch = 1\nbatches = 4\nbatches_per_shard = 2\nsampling = \"random\"",
            "histories_per_batch = 2000\nbatches = 16",
            "run.histories_per_batch = 2000: a power of two: 1024 or 2048; any number with sampling = \"random\"",
        ),
        (
            "histories_per_batch = 1\nbatches = 4\nbatches_per_shard = 2\nsampling = \"random\"",
            "histories_per_batch = 1048575\nbatches = 16",
            "a power of two: 524288 or 1048576;",
        ),
        ("[run]", "[run]\nseed = -1", "run.seed (line 3) = -1: a whole number"),
        ("[run]", "[run]\nhistories = 3", "run.histories (line 3) = 3: a key that is known here: histories_per_batch,"),
        ("[run]", "[run]\nconfidence = 1.0", "run.confidence = 1: between 0 and 1, exclusive"),
        ("[run]", "[run]\nconfidence = nan", "run.confidence = NaN: between 0 and 1, exclusive"),
        ("[run]", "[run]\ncheckpoint_seconds = 0", "run.checkpoint_seconds = 0: 0.1 .. 86400"),
        ("[run]", "[run]\nchannels = \"spectral\"", "run.channels (line 3) = \"spectral\": one of rgb, luminance"),
        ("[run]", "[transport]\nroulette_below = 2\n[run]", "transport.roulette_below = 2: above 0 and at most 1"),
        (
            "[run]",
            "[transport]\nroulette_below = \"no\"\n[run]",
            "transport.roulette_below (line 3) = \"no\": a number above 0, at most 1, or \"analog\"",
        ),
        ("[run]", "[run", "job.toml: (syntax) (line 2) = [run:"),
        ("batches_per_shard = 2", "batches_per_shard = 0", "run.batches_per_shard = 0: 1 .. 1048576"),
        ("width = 4\nheight = 3", "width = 0\nheight = 3", "camera[0].width = 0: 1 .. 65536"),
        ("width = 4\nheight = 3", "width = 60000\nheight = 60000", "camera[0].width x height = 3600000000: at most"),
        ("height = 3", "height = 3\npixel_samples = 3", "camera[0].pixel_samples = 3: 1, 4, 9 or 16"),
        ("vertical_fov_degrees = 40.0", "vertical_fov_degrees = 180", "camera[0].vertical_fov_degrees = 180: between"),
        ("vertical_fov_degrees = 40.0", "", "camera[0] = (incomplete): either node, or all of eye, target"),
        ("target = [0.0, 1.0, 0.0]", "target = [0.0, 1.0, 3.0]", "at least 1e-6 m from the eye"),
        (
            "vertical_fov_degrees = 40.0",
            "vertical_fov_degrees = 40\nup = [0, 0, 1]",
            "camera[0].up = [0.0, 0.0, 1.0]: not",
        ),
        (
            "eye = [0.0, 1.0, 3.0]",
            "node = \"camera\"\neye = [0.0, 1.0, 3.0]",
            "camera[0].node = camera: a node, or eye",
        ),
        ("name = \"floor\"", "name = \"view\"", "grid[0].name = view: a name used only once: camera[0] has it"),
        ("name = \"floor\"", "name = \"../floor\"", "grid[0].name = ../floor: 1 .. 64 letters, digits"),
        ("name = \"floor\"", "name = \"summary\"", "name = summary: any name but points, regions, summary and flux"),
        ("name = \"floor\"", "name = \"Points\"", "name = Points: any name but points, regions, summary and flux"),
        ("normal = [0.0, 1.0, 0.0]\ncolumns", "normal = [0, 0, 0]\ncolumns", "grid[0].normal = [0.0, 0.0, 0.0]: three"),
        ("columns = 2", "columns = 70000", "grid[0].columns = 70000: 1 .. 65536"),
        ("columns = 2\nrows = 2", "columns = 16000\nrows = 16000", "grid[0].keep_batches = true (\"floor\", with the"),
        ("position = [0.0, 0.8, 0.0]\nwidth", "position = [0, inf, 0]\nwidth", "gonio[0].position = [0.0, inf, 0.0]"),
        ("name = \"eye\"", "name = \"eye\"\nsurface = true", "gonio[0].normal = (missing): needed with surface = true"),
        (
            "name = \"eye\"",
            "name = \"eye\"\nnormal = [0, 1, 0]",
            "gonio[0].normal = [0.0, 1.0, 0.0]: only with surface",
        ),
        ("reflectance = 0.5\n[[sphere]]", "reflectance = 1.5\n[[sphere]]", "plane[0].reflectance = 1.5: 0 .. 1"),
        ("radius = 1.0", "radius = 0.0", "sphere[0].radius = 0: above 0, at most 1e6"),
        ("facing = \"outward\"", "facing = \"up\"", "sphere[0].facing (line 38) = \"up\": one of inward, outward"),
        ("kind = \"omni\"", "kind = \"laser\"", "source[0].kind (line 41) = \"laser\": one of disc, sphere, omni, s"),
        ("[run]", "[stop]\nrelative_half_width = 0\nmax_batches = 4\n[run]", "stop.relative_half_width = 0: between"),
        ("[run]", "[stop]\nrelative_half_width = nan\nmax_batches = 4\n[run]", "stop.relative_half_width = NaN: betw"),
        (
            "[run]",
            "[stop]\nrelative_half_width = 0.1\n[run]",
            "stop.max_batches (line 2) = (missing): a value: this key has no default",
        ),
        (
            "[run]",
            "[stop]\nrelative_half_width = 0.1\nmax_batches = 4\n[run]",
            "stop.max_batches = 4: 16 .. 4294967296",
        ),
        (
            "[run]",
            "[stop]\nrelative_half_width = 0.1\nmax_batches = 20\n[run]",
            "run.batches = 4: absent with [stop], whose max_batches = 20 is the limit",
        ),
        (
            "[run]\nhistories_per_batch = 1\nbatches = 4\nbatches_per_shard = 2",
            "[stop]\nrelative_half_width = 0.1\nmax_batches = 20\n[run]\nbatches_per_shard = 32",
            "stop.max_batches = 20: at least 32, the first look: whole shards of run.batches_per_shard",
        ),
        (
            "[run]",
            "[stop]\nrelative_half_width = 0.1\nmax_batches = 4\nshare = 0\n[run]",
            "stop.share = 0: above 0 and",
        ),
        ("[run]", "[stop]\nrelative_half_width = 0.1\nmax_batches = 4\nshare = 1.1\n[run]", "stop.share = 1.1: above"),
        (
            "batches = 4\nbatches_per_shard = 2\nsampling = \"random\"",
            "batches_per_shard = 2\n[stop]\nrelative_half_width = 0.1\nmax_batches = 99\nreceivers = [\"dask\"]",
            "stop.receivers[0] = dask: one of desk, eye, view, floor",
        ),
        ("= 100.0", "= \"bright\"", "source[0].intensity (line 43) = \"bright\": a number"),
        ("= 100.0", "= 1e300", "source[0].intensity = 1e300: above 0, at most 1e12 cd"),
        ("= 100.0", "= [1, 2]", "source[0].intensity (line 43) = [1, 2]: a number"),
        (
            "intensity = 100.0",
            "intensiti = 1",
            "source[0].intensiti (line 43) = 1: a key that is known here: intensity,",
        ),
        ("intensity = 100.0", "", "source[0].intensity (line 40) = (missing): a value: this key has no default"),
        (
            "kind = \"omni\"",
            "",
            "source[0].kind (line 40) = (missing): one of disc, omni, spot, sphere, cos_power, rect",
        ),
        ("kind = \"omni\"", "kind = 3", "source[0].kind (line 41) = 3: text in quotation marks"),
        (
            "position = [0.0, 2.0, 0.0]",
            "position = [0, 2]",
            "source[0].position (line 42) = [0, 2]: 3 numbers in brackets",
        ),
        ("[[source]]", "[source]", "source (line 40) = [source]: a list of tables: [[...]], in double brackets"),
        ("[run]", "[[run]]", "run (line 2) = [[run]]: one table: [...], in single brackets"),
        ("[run]", "[run]\nscene = \"x.glb\"", "run.scene (line 3) = \"x.glb\": above the first [table]"),
        ("[run]", "[sky]\nmodel = 5\nzenith_luminance = 1\n[run]", "job.toml: plane = infinite: no [[plane]] together"),
        ("[run]", "scene = \"gone.glb\"\n[run]", "scene = gone.glb: a .glb or .gltf file, relative to the job file"),
    ];
    for (from, to, fragment) in cases {
        assert!(JOB.contains(from), "{from}");
        let folder = folder_with(&JOB.replacen(from, to, 1));
        let said = expect(folder.path(), 2, &["plan", "job.toml", "-o", "out"]);
        assert!(said.contains(fragment) && said.contains("job.toml"), "{to}\n  expected {fragment}\n  said {said}");
        assert!(!folder.path().join("out").exists(), "{to}: a folder was made for a job that is wrong");
    }
}

#[test]
fn jobs_without_receivers_light_or_text_are_refused() {
    let without = |start: &str, end: &str| {
        let (head, tail) = JOB.split_once(start).unwrap();
        let end = if end.is_empty() { tail.len() } else { tail.find(end).unwrap() };
        format!("{head}{}", &tail[end..])
    };
    let dark = folder_with(&without("[[source]]", ""));
    assert!(expect(dark.path(), 2, &["run", "job.toml"]).contains("scene = (missing): a scene file, or at least one"));
    let blind = folder_with(&without("[[camera]]", "[[plane]]"));
    assert!(expect(blind.path(), 2, &["run", "job.toml"]).contains("receivers = 0: at least one [[camera]]"));
    fs::write(blind.path().join("job.toml"), [0xff, 0xfe, 0x00]).unwrap();
    assert!(expect(blind.path(), 2, &["run", "job.toml"]).contains("(encoding) = not UTF-8"));
    assert!(expect(blind.path(), 2, &["run", "none.toml"]).contains("JOB = none.toml: a job file (No such file"));
    assert!(expect(blind.path(), 2, &["run", "."]).contains("JOB = .: a job file"));
}

#[test]
fn wrong_usage_is_exit_code_2() {
    let folder = folder_with(JOB);
    let cases: [(&[&str], &str); 8] = [
        (&[], "Usage"),
        (&["render", "job.toml"], "unrecognized subcommand 'render'"),
        (&["run"], "<JOB>"),
        (&["run", "job.toml", "-w", "0"], "allowed: 1 .. 1024"),
        (&["run", "job.toml", "--seed", "3"], "unexpected argument '--seed'"),
        (&["work", "out"], "--shard <K>"),
        (&["work", "out", "--shard", "-1"], "unexpected argument '-1'"),
        (&["merge"], "<DIR>"),
    ];
    for (args, fragment) in cases {
        let said = expect(folder.path(), 2, args);
        assert!(said.contains(fragment), "{args:?}: {said}");
    }
}

#[test]
fn every_help_has_an_example() {
    let folder = folder_with(JOB);
    for command in ["run", "plan", "work", "status", "merge", "submit", "fit"] {
        let text = expect(folder.path(), 0, &[command, "--help"]);
        assert!(text.contains("Example") && text.contains(&format!("lampyris {command}")), "{text}");
    }
    assert!(expect(folder.path(), 0, &["--help"]).contains("75"));
}

#[test]
fn folders_without_a_plan_or_with_another_are_refused() {
    let folder = planned();
    let at = folder.path();
    for args in [&["work", "none", "--shard", "0"][..], &["status", "none"], &["merge", "none"]] {
        assert!(expect(at, 2, args).contains("none: plan.toml = (missing): a folder made by `lampyris plan`"));
    }
    assert!(expect(at, 2, &["merge", "out"]).contains("out: refused: holds no checkpoint yet: nothing to merge"));
    assert!(expect(at, 2, &["work", "out", "--shard", "2"]).contains("--shard = 2: 0 .. 1"));
    fs::write(at.join("other.toml"), JOB.replace("width = 4\nheight = 3", "width = 5\nheight = 3")).unwrap();
    let said = expect(at, 2, &["run", "other.toml", "-o", "out"]);
    assert!(said.contains("the job is no longer the one planned here"), "{said}");
    assert!(said.contains("camera[0].width: 4 in the plan, 5 now"), "{said}");
    fs::write(at.join("fewer.toml"), JOB.replace("batches = 4", "batches = 3")).unwrap();
    let said = expect(at, 2, &["plan", "fewer.toml", "-o", "out"]);
    assert!(said.contains("run.batches: 4 in the plan, 3 now (more batches extend"), "{said}");
    let said = expect(at, 0, &["plan", "job.toml", "-o", "out"]);
    assert!(said.contains("# 2 shards in out"), "{said}");
}

#[test]
fn an_edited_or_damaged_plan_is_refused() {
    let edits = [
        ("seed = 1", "seed = 2", "edited or damaged: its digest is not that of its content"),
        ("numerics = 6", "numerics = 9", "NUMERICS 9 of program"),
        ("batches = 4", "batches = 0", "run.batches = 0: 1 .."),
        ("seed = 1", "seed = ", "not a plan"),
        ("seed = 1", "seed = 1\nspeed = 1", "not a plan: unknown field `speed`"),
        ("digest = \"", "digest = \"../", "damaged: an input has no digest of 64 hexadecimal digits"),
    ];
    for (from, to, fragment) in edits {
        let folder = planned();
        let path = folder.path().join("out/plan.toml");
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{from}");
        fs::write(&path, text.replace(from, to)).unwrap();
        let said = expect(folder.path(), 2, &["status", "out"]);
        assert!(said.contains(fragment) && said.contains("plan.toml"), "{to}: {said}");
    }
}

#[test]
fn a_checkpoint_that_is_none_stops_everything_and_stays() {
    let folder = planned();
    let at = folder.path();
    let path = at.join("out/shards/shard-000001.ckpt");
    fs::write(&path, "precious, and none of ours").unwrap();
    let fragment = "shard-000001.ckpt: refused: not a checkpoint of lampyris";
    for args in [
        &["work", "out", "--shard", "1"][..],
        &["run", "job.toml", "-o", "out", "-q"],
        &["status", "out"],
        &["merge", "out"],
    ] {
        let said = expect(at, 2, args);
        assert!(said.contains(fragment), "{args:?}: {said}");
    }
    assert_eq!(fs::read(&path).unwrap(), b"precious, and none of ours");
}

#[test]
fn a_goal_fills_in_the_number_of_batches_of_the_plan() {
    let goal = |batches: &str| {
        let stop = format!(
            "{batches}batches_per_shard = 2\nsampling = \"random\"\n[stop]\nrelative_half_width = 0.1\nmax_batches = 99\n"
        );
        folder_with(&JOB.replacen("batches = 4\nbatches_per_shard = 2\nsampling = \"random\"\n", &stop, 1))
    };
    for typed in ["", "batches = 99\n"] {
        let folder = goal(typed);
        let said = expect(folder.path(), 0, &["plan", "job.toml", "-o", "out"]);
        assert!(said.contains("\nbatches = 99\n") && said.contains("\nmax_batches = 99\n"), "{said}");
        let said = expect(folder.path(), 0, &["status", "out"]);
        assert!(said.contains("0 of 99 batches") && said.contains("\nnext look at 16 batches\n"), "{said}");
        // The limit may be raised, not lowered.
        for (limit, code, fragment) in
            [("120", 0, "batches = 120"), ("50", 2, "stop.max_batches: 120 in the plan, 50 now")]
        {
            let text = fs::read_to_string(folder.path().join("job.toml")).unwrap();
            fs::write(folder.path().join("other.toml"), text.replace("= 99", &format!("= {limit}"))).unwrap();
            let said = expect(folder.path(), code, &["plan", "other.toml", "-o", "out"]);
            assert!(said.contains(fragment), "{said}");
        }
    }
    let folder = goal("");
    expect(folder.path(), 0, &["plan", "job.toml", "-o", "out"]);
    let path = folder.path().join("out/plan.toml");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace("\nbatches = 99\n", "\nbatches = 98\n")).unwrap();
    let said = expect(folder.path(), 2, &["status", "out"]);
    assert!(said.contains("run.batches = 98: absent with [stop]"), "{said}");
}

#[test]
fn a_scene_that_cannot_be_read_beside_its_job_is_named() {
    let folder = folder_with(&format!("scene = \"../gone/room.glb\"\n{JOB}"));
    let said = expect(folder.path(), 2, &["run", "job.toml", "-q"]);
    assert!(said.contains("job.toml: scene = ../gone/room.glb: a .glb or .gltf file"), "{said}");
}

#[test]
fn a_fault_that_names_no_step_is_refused() {
    let folder = planned();
    let mut command = Command::new(env!("CARGO_BIN_EXE_lampyris"));
    command.current_dir(folder.path()).args(["work", "out", "--shard", "0"]).env("LAMPYRIS_FAULT", "sometime:1");
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("LAMPYRIS_FAULT = sometime:1: <step>:<count> with a step among after-create"), "{said}");
}

#[test]
fn instructions_that_are_not_there_are_refused() {
    let folder = folder_with(JOB);
    for (name, code) in [("avx1024", 2), ("", 2), ("scalar", 0)] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_lampyris"));
        command.current_dir(folder.path()).args(["plan", "job.toml"]).env("LAMPYRIS_SIMD", name);
        let output = command.output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{name}: {said}");
        let wrong =
            format!("LAMPYRIS_SIMD = {}: what this processor has: ", if name.is_empty() { "(empty)" } else { name });
        assert!(code == 0 || said.contains(&wrong) && said.contains("scalar"), "{said}");
    }
}

#[test]
fn regions_and_ratios_are_checked_as_all_else() {
    let good = "[[region]]\nname = \"wall\"\ncamera = \"view\"\nrectangle = [1, 1, 2, 2]\n\
                [[ratio]]\nname = \"part\"\nnumerator = \"wall\"\ndenominator = \"floor\"\n\
                [[ratio]]\nname = \"whole\"\nnumerator = \"desk\"\ndenominator = \"floor\"\n";
    let rectangle = "region[0].rectangle = ";
    let cases = [
        ("camera = \"view\"", "camera = \"eye\"", "region[0].camera = eye: the name of a [[camera]]: view"),
        ("[1, 1, 2, 2]", "[1, 1, 4, 2]", "[1, 1, 4, 2]: column, row, columns, rows of at least one pixel inside 4 x 3"),
        ("[1, 1, 2, 2]", "[1, 1, 0, 2]", rectangle),
        ("[1, 1, 2, 2]", "[4294967295, 1, 4294967295, 2]", rectangle),
        ("[1, 1, 2, 2]", "[1, 1, 2]", "region[0].rectangle (line 47) = [1, 1, 2]: 4 numbers in brackets"),
        ("rectangle = [1, 1, 2, 2]", "", "region[0] = (both or neither): either rectangle or node"),
        ("[1, 1, 2, 2]", "[1, 1, 2, 2]\nnode = \"Table\"", "region[0] = (both or neither): either rectangle or node"),
        ("rectangle = [1, 1, 2, 2]", "node = \"Table\"", "region[0].node = Table: a node only with a scene"),
        ("name = \"wall\"", "name = \"regions\"", "name = regions: any name but points, regions, summary and flux"),
        ("name = \"wall\"", "name = \"desk\"", "region[0].name = desk: a name used only once: point[0] has it"),
        ("name = \"part\"", "name = \"a/b\"", "ratio[0].name = a/b: 1 .. 64 letters, digits, '_' or '-'"),
        ("name = \"whole\"", "name = \"Part\"", "ratio[1].name = Part: a name used for only one ratio"),
        (
            "numerator = \"wall\"",
            "numerator = \"view\"",
            "ratio[0].numerator = view: a grid with keep_batches, a point",
        ),
        ("denominator = \"floor\"", "denominator = \"no\"", "a point or a region: desk, floor, wall"),
        ("denominator = \"floor\"", "", "ratio[0].denominator (line 48) = (missing): a value"),
    ];
    let folder = folder_with(&format!("{JOB}{good}"));
    expect(folder.path(), 0, &["plan", "job.toml", "-o", "out"]);
    for (from, to, fragment) in cases {
        assert!(good.contains(from), "{from}");
        let folder = folder_with(&format!("{JOB}{}", good.replacen(from, to, 1)));
        let said = expect(folder.path(), 2, &["plan", "job.toml", "-o", "out"]);
        assert!(said.contains(fragment) && said.contains("job.toml"), "{to}\n  expected {fragment}\n  said {said}");
    }
}

#[test]
fn ratios_may_change_after_the_fact_and_regions_may_not() {
    let region = "[[region]]\nname = \"wall\"\ncamera = \"view\"\nrectangle = [1, 1, 2, 2]\n";
    let ratio = "[[ratio]]\nname = \"r\"\nnumerator = \"wall\"\ndenominator = \"floor\"\n";
    let folder = folder_with(&format!("{JOB}{region}"));
    let at = folder.path();
    expect(at, 0, &["run", "job.toml", "-o", "out", "-q"]);
    fs::write(at.join("more.toml"), format!("{JOB}{region}{ratio}")).unwrap();
    let said = expect(at, 0, &["run", "more.toml", "-o", "out", "-q"]);
    assert!(said.contains("all 4 batches were done before") && said.contains("r: wall / floor = "), "{said}");
    assert!(said.contains("    wall: mean ") && at.join("out/regions.csv").exists(), "{said}");
    fs::write(at.join("other.toml"), format!("{JOB}{}", region.replace("[1, 1, 2, 2]", "[0, 1, 2, 2]"))).unwrap();
    let said = expect(at, 2, &["run", "other.toml", "-o", "out", "-q"]);
    assert!(said.contains("region[0].rectangle: [1,1,2,2] in the plan, [0,1,2,2] now"), "{said}");
}
