//! Every check on what a user typed: each refusal names the field, the value and what is allowed.

use super::{
    Camera, Degree, DegreeWord, Estimator, Gonio, Grid, Job, Kept, Ratio, ReceiverKind, Region, Replacement, Roulette,
    Sampling, Stop, lights, material, sky,
};
use crate::error::{Error, Result, listed};
use std::collections::{HashMap, HashSet};
use std::fmt::Debug;

/// Largest picture: 2^28 pixels.
const MAX_BINS: u64 = 1 << 28;
/// Most trajectories of a batch.
const MAX_TRAJECTORIES: u64 = 1 << 20;
/// Largest coordinate \[m\]: beyond it positions in f32 say little.
const MAX_METRES: f64 = 1e6;
/// Fewest batches of quasi-random sets: only batches tell the error, and fewer tell it badly.
const MIN_RQMC_BATCHES: u64 = 16;
/// Largest degree of a series, as of its files.
const MAX_DEGREE: u64 = 128;
/// Most bins of one set that are watched history by history.
const MAX_MONITORED: usize = 1024;

/// Refuses `job` where a value lies outside its range.
pub(super) fn check(job: &Job, file: &str) -> Result<()> {
    let c = Checker { file };
    check_run(&c, job)?;
    check_sampling(&c, job)?;
    check_names(&c, job)?;
    for (i, camera) in job.cameras.iter().enumerate() {
        check_camera(&c, &format!("camera[{i}]"), camera, job.scene.is_some())?;
    }
    for (i, grid) in job.grids.iter().enumerate() {
        check_grid(&c, &format!("grid[{i}]"), grid)?;
    }
    for (i, point) in job.points.iter().enumerate() {
        c.position(&format!("point[{i}].position"), point.position)?;
        c.direction(&format!("point[{i}].normal"), point.normal)?;
    }
    for (i, gonio) in job.gonios.iter().enumerate() {
        check_gonio(&c, &format!("gonio[{i}]"), gonio)?;
    }
    for (i, region) in job.regions.iter().enumerate() {
        check_region(&c, &format!("region[{i}]"), region, job)?;
    }
    check_ratios(&c, job)?;
    if let Some(stop) = &job.stop {
        check_stop(&c, stop, job)?;
    }
    check_estimator(&c, job)?;
    check_surfaces(&c, job)?;
    material::check(&c, job)?;
    lights::check(&c, job)?;
    sky::check(&c, job)
}

/// Counting on surface elements needs elements: only the cells of a grid are any.
fn check_estimator(c: &Checker, job: &Job) -> Result<()> {
    if job.transport.estimator != Estimator::DirectSimulation {
        return Ok(());
    }
    let others = job.sets().into_iter().find(|s| s.kind != ReceiverKind::Grid);
    let allowed = "local or reverse: direct_simulation counts on the cells of grids, and knows no other receivers";
    let name = others.as_ref().map_or("", |s| s.name.as_str());
    c.that("transport.estimator", format!("direct_simulation (with \"{name}\")"), others.is_none(), allowed)?;
    for (i, grid) in job.grids.iter().enumerate() {
        check_cells(c, &format!("grid[{i}].normal"), grid)?;
    }
    Ok(())
}

/// What crosses a cell is the illuminance of its own plane, whichever way a lux-meter there would face.
fn check_cells(c: &Checker, field: &str, grid: &Grid) -> Result<()> {
    let across = cross(grid.u, grid.v);
    let size = length(across);
    let off = length(cross(across, grid.normal)) / (size * length(grid.normal));
    let allowed = "with direct_simulation a normal across u and v, and u and v that span cells";
    c.that(field, Shown(grid.normal), size > 1e-12 * length(grid.u) * length(grid.v) && off <= 1e-6, allowed)
}

/// With a goal the number of batches is its limit. A plan, in which the limit has been filled in, is read again.
pub(super) fn check_typed_batches(typed: Option<u64>, stop: &Stop, file: &str) -> Result<()> {
    match typed {
        Some(batches) if batches != stop.max_batches => {
            let allowed = format!("absent with [stop], whose max_batches = {} is the limit", stop.max_batches);
            Err(Error::input(file, "run.batches", batches, allowed))
        }
        _ => Ok(()),
    }
}

fn check_stop(c: &Checker, stop: &Stop, job: &Job) -> Result<()> {
    let (half, share) = (stop.relative_half_width, stop.share);
    c.that("stop.relative_half_width", half, half > 0.0 && half < 1.0, "between 0 and 1, exclusive")?;
    c.that("stop.share", share, share > 0.0 && share <= 1.0, "above 0 and at most 1")?;
    c.range("stop.max_batches", stop.max_batches, 16, 1 << 32)?;
    let sets = job.sets();
    let names: Vec<&str> = sets.iter().map(|s| s.name.as_str()).collect();
    for (i, name) in stop.receivers.iter().enumerate() {
        let allowed = format!("one of {}", listed(name, names.iter().copied()));
        c.that(&format!("stop.receivers[{i}]"), name, names.contains(&name.as_str()), &allowed)?;
    }
    Ok(())
}

fn check_region(c: &Checker, at: &str, region: &Region, job: &Job) -> Result<()> {
    let Some(camera) = job.cameras.iter().find(|k| k.name == region.camera) else {
        let cameras = job.cameras.iter().map(|c| c.name.as_str());
        let allowed = format!("the name of a [[camera]]: {}", listed(&region.camera, cameras));
        return Err(Error::input(c.file, format!("{at}.camera"), &region.camera, allowed));
    };
    match (region.rectangle, &region.node) {
        (Some([column, row, columns, rows]), None) => {
            let end = |start: u32, length: u32| u64::from(start) + u64::from(length);
            let inside = end(column, columns) <= camera.width.into() && end(row, rows) <= camera.height.into();
            let allowed =
                format!("column, row, columns, rows of at least one pixel inside {} x {}", camera.width, camera.height);
            let shown = Shown([column, row, columns, rows]);
            c.that(&format!("{at}.rectangle"), shown, inside && columns > 0 && rows > 0, &allowed)
        }
        (None, Some(node)) => c.that(&format!("{at}.node"), node, job.scene.is_some(), "a node only with a scene"),
        _ => Err(Error::input(c.file, at, "(both or neither)", "either rectangle or node")),
    }
}

fn check_ratios(c: &Checker, job: &Job) -> Result<()> {
    let mut seen = HashSet::new();
    for (i, ratio) in job.ratios.iter().enumerate() {
        let (at, name) = (format!("ratio[{i}]"), ratio.name.as_str());
        c.name(&format!("{at}.name"), name)?;
        let new = seen.insert(name.to_ascii_lowercase());
        c.that(&format!("{at}.name"), name, new, "a name used for only one ratio")?;
        check_ratio(c, &at, ratio, job)?;
    }
    Ok(())
}

fn check_ratio(c: &Checker, at: &str, ratio: &Ratio, job: &Job) -> Result<()> {
    let kept: Vec<String> = job.sets().into_iter().filter(|s| s.kept == Kept::EveryBatch).map(|s| s.name).collect();
    [("numerator", &ratio.numerator), ("denominator", &ratio.denominator)].into_iter().try_for_each(|(field, name)| {
        let names = listed(name, kept.iter().map(String::as_str));
        let allowed = format!("a grid with keep_batches, a point or a region: {names}");
        c.that(&format!("{at}.{field}"), name, kept.contains(name), &allowed)
    })
}

fn check_monitor(c: &Checker, at: &str, monitor: &[[u32; 2]], width: u32, height: u32) -> Result<()> {
    c.that(&format!("{at}.monitor"), monitor.len(), monitor.len() <= MAX_MONITORED, "at most 1024 bins")?;
    for (i, &[column, row]) in monitor.iter().enumerate() {
        let allowed = format!("[column, row] inside {width} x {height}");
        c.that(&format!("{at}.monitor[{i}]"), Shown([column, row]), column < width && row < height, &allowed)?;
    }
    Ok(())
}

fn check_run(c: &Checker, job: &Job) -> Result<()> {
    let run = &job.run;
    c.that("run.seed", run.seed, run.seed < 1 << 63, "0 .. 9223372036854775807")?;
    c.range("run.histories_per_batch", run.histories_per_batch, 1, MAX_TRAJECTORIES)?;
    let local = job.transport.estimator == Estimator::Local;
    let allowed = "1 with estimators other than \"local\", which connect nothing";
    c.that("run.thinning", run.thinning, local || run.thinning == 1, allowed)?;
    let most = MAX_TRAJECTORIES / run.histories_per_batch;
    let allowed = format!("1 .. {most}: histories_per_batch x thinning is at most {MAX_TRAJECTORIES}");
    c.that("run.thinning", run.thinning, (1..=most).contains(&run.thinning), &allowed)?;
    c.range("run.batches", run.batches, 1, 1 << 32)?;
    c.range("run.batches_per_shard", run.batches_per_shard, 1, 1 << 20)?;
    c.that(
        "run.confidence",
        run.confidence,
        run.confidence > 0.0 && run.confidence < 1.0,
        "between 0 and 1, exclusive",
    )?;
    let seconds = run.checkpoint_seconds;
    c.that("run.checkpoint_seconds", seconds, (0.1..=86400.0).contains(&seconds), "0.1 .. 86400")?;
    if let Roulette::Below(below) = job.transport.roulette_below {
        let allowed = "above 0 and at most 1, or \"analog\"";
        c.that("transport.roulette_below", below, below > 0.0 && below <= 1.0, allowed)?;
    }
    Ok(())
}

/// A scrambled set has 2^m points; with `[stop]` the number of batches is not `run.batches`, and has its own limits.
fn check_sampling(c: &Checker, job: &Job) -> Result<()> {
    let run = &job.run;
    if run.sampling == Sampling::Random {
        return Ok(());
    }
    let reverse = job.transport.estimator == Estimator::Reverse;
    let allowed = "\"random\" with estimator = \"reverse\", whose paths are independent";
    c.that("run.sampling", "rqmc", !reverse, allowed)?;
    for (field, n) in [("run.histories_per_batch", run.histories_per_batch), ("run.thinning", run.thinning)] {
        let (below, above) = (1u64 << n.ilog2(), n.next_power_of_two());
        let allowed = format!("a power of two: {below} or {above}; any number with sampling = \"random\"");
        c.that(field, n, n.is_power_of_two(), &allowed)?;
    }
    let enough = job.stop.is_some() || run.batches >= MIN_RQMC_BATCHES;
    let allowed = format!("at least {MIN_RQMC_BATCHES}; any number with sampling = \"random\"");
    c.that("run.batches", run.batches, enough, &allowed)
}

fn check_names(c: &Checker, job: &Job) -> Result<()> {
    let mut seen: HashMap<String, String> = HashMap::new();
    let sets = job.sets();
    c.that("receivers", sets.len(), !sets.is_empty(), "at least one [[camera]], [[grid]], [[point]] or [[gonio]]")?;
    for (i, set) in sets.iter().enumerate() {
        // Sets of a kind stand together.
        let index = i - sets.partition_point(|other| (other.kind as u8) < set.kind as u8);
        let (entry, name) = (format!("{}[{index}]", set.kind.table()), set.name.as_str());
        let field = format!("{entry}.name");
        c.name(&field, name)?;
        // Results are files named after their sets; `points.csv`, `regions.csv` and `summary.json` are already taken.
        // Capitals do not distinguish files everywhere.
        let plain = name.to_ascii_lowercase();
        let free = !["points", "regions", "summary", "flux"].contains(&plain.as_str());
        c.that(&field, name, free, "any name but points, regions, summary and flux")?;
        if let Some(other) = seen.insert(plain, entry) {
            c.that(&field, name, false, &format!("a name used only once: {other} has it"))?;
        }
    }
    Ok(())
}

fn check_camera(c: &Checker, at: &str, camera: &Camera, has_scene: bool) -> Result<()> {
    check_size(c, at, [("width", camera.width), ("height", camera.height)], camera.pixel_samples)?;
    check_monitor(c, at, &camera.monitor, camera.width, camera.height)?;
    let typed = camera.eye.is_some() || camera.target.is_some() || camera.vertical_fov_degrees.is_some();
    if let Some(node) = &camera.node {
        let allowed = "a node, or eye, target and vertical_fov_degrees, not both";
        c.that(&format!("{at}.node"), node, !typed && camera.up.is_none(), allowed)?;
        return c.that(&format!("{at}.node"), node, has_scene, "a node only with a scene");
    }
    let Some(view) = camera.view() else {
        let allowed = "either node, or all of eye, target and vertical_fov_degrees";
        return Err(Error::input(c.file, at, "(incomplete)", allowed));
    };
    c.position(&format!("{at}.eye"), view.eye)?;
    c.position(&format!("{at}.target"), view.target)?;
    c.direction(&format!("{at}.up"), view.up)?;
    let forward: [f64; 3] = std::array::from_fn(|i| view.target[i] - view.eye[i]);
    c.that(&format!("{at}.target"), Shown(view.target), length(forward) >= 1e-6, "at least 1e-6 m from the eye")?;
    let across = cross(forward, view.up);
    let scale = length(forward) * length(view.up);
    c.that(&format!("{at}.up"), Shown(view.up), length(across) > 1e-6 * scale, "not parallel to the line of sight")?;
    let fov = view.vertical_fov_degrees;
    c.that(&format!("{at}.vertical_fov_degrees"), fov, fov > 0.0 && fov < 180.0, "between 0 and 180, exclusive")
}

fn check_gonio(c: &Checker, at: &str, gonio: &Gonio) -> Result<()> {
    check_size(c, at, [("width", gonio.width), ("height", gonio.height)], gonio.pixel_samples)?;
    check_monitor(c, at, &gonio.monitor, gonio.width, gonio.height)?;
    c.position(&format!("{at}.position"), gonio.position)?;
    match (gonio.surface, gonio.normal) {
        (true, Some(normal)) => c.direction(&format!("{at}.normal"), normal),
        (true, None) => Err(Error::input(c.file, format!("{at}.normal"), "(missing)", "needed with surface = true")),
        (false, Some(n)) => Err(Error::input(c.file, format!("{at}.normal"), Shown(n), "only with surface = true")),
        (false, None) => Ok(()),
    }
}

fn check_grid(c: &Checker, at: &str, grid: &Grid) -> Result<()> {
    check_size(c, at, [("columns", grid.columns), ("rows", grid.rows)], 1)?;
    check_monitor(c, at, &grid.monitor, grid.columns, grid.rows)?;
    c.position(&format!("{at}.origin"), grid.origin)?;
    c.position(&format!("{at}.u"), grid.u)?;
    c.position(&format!("{at}.v"), grid.v)?;
    c.direction(&format!("{at}.normal"), grid.normal)
}

fn check_size(c: &Checker, at: &str, size: [(&str, u32); 2], samples: u32) -> Result<()> {
    for (name, n) in size {
        c.range(&format!("{at}.{name}"), u64::from(n), 1, 65536)?;
    }
    let bins = u64::from(size[0].1) * u64::from(size[1].1);
    c.that(&format!("{at}.{} x {}", size[0].0, size[1].0), bins, bins <= MAX_BINS, "at most 268435456 in all")?;
    c.that(&format!("{at}.pixel_samples"), samples, [1, 4, 9, 16].contains(&samples), "1, 4, 9 or 16")
}

fn check_surfaces(c: &Checker, job: &Job) -> Result<()> {
    for (i, plane) in job.planes.iter().enumerate() {
        c.position(&format!("plane[{i}].point"), plane.point)?;
        c.direction(&format!("plane[{i}].normal"), plane.normal)?;
        c.share(&format!("plane[{i}].reflectance"), plane.reflectance)?;
    }
    for (i, sphere) in job.spheres.iter().enumerate() {
        c.position(&format!("sphere[{i}].center"), sphere.center)?;
        c.share(&format!("sphere[{i}].reflectance"), sphere.reflectance)?;
        let radius = sphere.radius;
        c.that(&format!("sphere[{i}].radius"), radius, radius > 0.0 && radius <= MAX_METRES, "above 0, at most 1e6")?;
    }
    for (i, replacement) in job.replacements.iter().enumerate() {
        check_replacement(c, &format!("replace[{i}]"), replacement, job)?;
    }
    Ok(())
}

fn check_replacement(c: &Checker, at: &str, replacement: &Replacement, job: &Job) -> Result<()> {
    c.that(&format!("{at}.node"), &replacement.node, job.scene.is_some(), "a node only with a scene")?;
    let twice = job.replacements.iter().filter(|other| other.node == replacement.node).count() > 1;
    c.that(&format!("{at}.node"), &replacement.node, !twice, "each node once")?;
    if let Some(Degree::Number(degree)) = replacement.degree {
        c.range(&format!("{at}.degree"), degree.into(), 0, MAX_DEGREE)?;
    }
    let auto = matches!(replacement.degree, Some(Degree::Word(DegreeWord::Auto)));
    let error = replacement.error_pixels;
    let fits = error.is_none_or(|e| auto && e > 0.0 && e <= 100.0);
    let shown = error.unwrap_or_default();
    c.that(&format!("{at}.error_pixels"), shown, fits, "above 0, at most 100, and only with degree = \"auto\"")?;
    c.that(&format!("{at}.degree"), "auto", !auto || !job.cameras.is_empty(), "a number where there is no [[camera]]")
}

/// Refuses what does not hold, by field, value and what is allowed.
pub(super) struct Checker<'a> {
    file: &'a str,
}

impl Checker<'_> {
    pub(super) fn that(&self, field: &str, value: impl ToString, holds: bool, allowed: &str) -> Result<()> {
        if holds { Ok(()) } else { Err(Error::input(self.file, field, value, allowed)) }
    }

    fn name(&self, field: &str, name: &str) -> Result<()> {
        let plain = |b: u8| b.is_ascii_alphanumeric() || b == b'_' || b == b'-';
        let fits = (1..=64).contains(&name.len()) && name.bytes().all(plain);
        self.that(field, name, fits, "1 .. 64 letters, digits, '_' or '-'")
    }

    fn range(&self, field: &str, value: u64, low: u64, high: u64) -> Result<()> {
        self.that(field, value, (low..=high).contains(&value), &format!("{low} .. {high}"))
    }

    pub(super) fn share(&self, field: &str, value: f64) -> Result<()> {
        self.that(field, value, (0.0..=1.0).contains(&value), "0 .. 1")
    }

    pub(super) fn position(&self, field: &str, p: [f64; 3]) -> Result<()> {
        let fits = p.iter().all(|x| x.abs() <= MAX_METRES);
        self.that(field, Shown(p), fits, "three finite numbers of at most 1e6 m")
    }

    pub(super) fn direction(&self, field: &str, n: [f64; 3]) -> Result<()> {
        let fits = n.iter().all(|x| x.abs() <= MAX_METRES) && length(n) >= 1e-9;
        self.that(field, Shown(n), fits, "three finite numbers, not all zero")
    }
}

/// Shows a vector as it is typed.
struct Shown<T>(T);

impl<T: Debug> std::fmt::Display for Shown<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{:?}", self.0)
    }
}

/// True for directions that are not parallel.
pub(super) fn are_apart(a: [f64; 3], b: [f64; 3]) -> bool {
    length(cross(a, b)) > 1e-6 * length(a) * length(b)
}

pub(super) fn length(v: [f64; 3]) -> f64 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
