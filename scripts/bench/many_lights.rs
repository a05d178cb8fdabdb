//! Many luminaires of the same flux together in a hall with columns, one thread:
//! `cargo bench --bench many_lights -- [point|opening|emissive|bulb|outside ...] [grid|picture] [N ...]`. Prints markdown tables.
//! A bulb is a ball of 128 emissive triangles.
//!
//! For a grid and a picture: time before the first batch, time of a history and bin, relative error, and figure of merit as in
//! `merit`, also against that of the first number of lights. Medians of three seeds. `outside` is `point` with seven times the
//! flux besides above the roof, which nothing passes, and eight times the histories: as many start in the hall.

mod common;

use common::{Reached, reach, thread_time};
use lampyris::farm::pilot::bounds;
use lampyris::farm::realization::Realization;
use lampyris::job::Job;
use lampyris::math::{DVec3, PI};
use lampyris::scene::photometric_web::Photometry;
use lampyris::scene::{Model, Scene};
use lampyris::tally::statistics::{figure_of_merit, median};
use lampyris::validate::scenes::{add_quad, box_walls, closed_box, lambert};

const SEEDS: u64 = 3;
/// Flux in the hall \[lm\].
const FLUX: f64 = 1e6;
/// The hall \[m\].
const HALL: DVec3 = DVec3::new(60.0, 6.0, 40.0);
/// Where luminaires hang \[m\].
const HEIGHT: f64 = 5.5;
/// A wide downlight with a rectangular opening.
const WEB: &str = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 7 3 1 2 0.3 0.6 0\n1 1 20\n0 15 30 45 60 75 90\n0 45 90\n\
                   300 310 330 300 200 80 0\n300 305 310 270 160 50 0\n300 300 290 230 120 30 0\n";
const GRID: &str = "[run]\nhistories_per_batch = 256\nbatches = 16\n[[grid]]\nname = \"floor\"\norigin = [0.0, 0.8, 40.0]\nu = [60.0, 0.0, 0.0]\nv = [0.0, 0.0, -40.0]\n\
                    normal = [0, 1, 0]\ncolumns = 48\nrows = 32\n";
const CAMERA: &str = "[run]\nhistories_per_batch = 256\nbatches = 16\n[[camera]]\nname = \"view\"\neye = [1.0, 2.0, 1.0]\ntarget = [30.0, 2.0, 22.0]\nup = [0, 1, 0]\n\
                      vertical_fov_degrees = 60\nwidth = 96\nheight = 64\n";

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let numbers: Vec<u32> = arguments.iter().filter_map(|a| a.parse().ok()).collect();
    let named = |names: &[&'static str]| -> Vec<&'static str> {
        names.iter().copied().filter(|name| arguments.iter().any(|a| a == name)).collect()
    };
    let (kinds, receivers) = (named(&["point", "opening", "emissive", "bulb", "outside"]), named(&["grid", "picture"]));
    let numbers = if numbers.is_empty() { vec![10, 100, 1000] } else { numbers };
    let kinds = if kinds.is_empty() { vec!["point", "opening", "emissive"] } else { kinds };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    println!(
        "| lights | receivers | before [s] | us a history and bin | error | worst bin | FOM [1/s] | against the first |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for kind in kinds {
        for (what, job) in [("grid", GRID), ("picture", CAMERA)] {
            if !receivers.is_empty() && !receivers.contains(&what) {
                continue;
            }
            let mut first = None;
            for &number in &numbers {
                let runs: Vec<[f64; 5]> =
                    (1..=SEEDS).map(|seed| pool.install(|| run(kind, number, job, seed))).collect();
                let of = |k: usize| median(runs.iter().map(|r| r[k]));
                let merit = of(4);
                println!(
                    "| {number} {kind} | {what} | {:.2} | {:.4} | {:.3} % | {:.2} % | {merit:.0} | {:.2} |",
                    of(0),
                    1e6 * of(1),
                    100.0 * of(2),
                    100.0 * of(3),
                    merit / *first.get_or_insert(merit),
                );
            }
        }
    }
}

/// The hall with its columns and `number` lights of a kind.
fn hall(kind: &str, number: u32) -> Model {
    let mut model = closed_box(HALL, &lambert(0.5, 0.0));
    model.surfaces[2] = lambert(0.2, 0.0);
    for i in 0..9 {
        for j in 0..5 {
            let corner = DVec3::new(6.0 * f64::from(i + 1) - 0.3, 0.0, 6.5 * f64::from(j + 1) - 0.3);
            // The walls of a box, seen from outside.
            for [origin, u, v] in box_walls(DVec3::new(0.6, HALL.y, 0.6)) {
                add_quad(&mut model, corner + origin, v, u, lambert(0.5, 0.0));
            }
        }
    }
    let outside = if kind == "outside" { 7 * number } else { 0 };
    let columns = (f64::from(number) * HALL.x / HALL.z).sqrt().ceil() as u32;
    let rows = number.div_ceil(columns);
    let share = FLUX / f64::from(number);
    for i in 0..number + outside {
        let (column, row) = (f64::from(i % number % columns), f64::from(i % number / columns));
        let height = if i < number { HEIGHT } else { HALL.y + 4.0 };
        let place =
            DVec3::new(HALL.x * (column + 0.47) / f64::from(columns), height, HALL.z * (row + 0.47) / f64::from(rows));
        let place = beside_columns(place);
        match kind {
            "emissive" => emissive(&mut model, place, share),
            "bulb" => bulb(&mut model, place, share),
            "opening" => hang(&mut model, place, share, "opening"),
            _ => hang(&mut model, place, share, "point"),
        }
    }
    model
}

/// The place, or one 0.7 m beside the middle of a column into which a luminaire there would stick, to light the bins within.
fn beside_columns(place: DVec3) -> DVec3 {
    let off = |x: f64, step: f64| x - (x / step).round() * step;
    let (x, z) = (off(place.x, 6.0), off(place.z, 6.5));
    if x.abs() < 0.62 && z.abs() < 0.47 { place + (0.7_f64.copysign(x) - x) * DVec3::X } else { place }
}

/// A rectangle of 0.6 x 0.3 m that looks down.
fn emissive(model: &mut Model, place: DVec3, flux: f64) {
    let luminance = flux / (PI * 0.18);
    add_quad(model, place - DVec3::new(0.3, 0.0, 0.15), DVec3::X * 0.6, DVec3::Z * 0.3, lambert(0.0, luminance));
}

/// An octahedron of 0.1 m, each face divided in 16, rounded.
fn bulb(model: &mut Model, place: DVec3, flux: f64) {
    let radius = 0.1;
    let luminance = flux / (PI * 4.0 * PI * radius * radius);
    let number = model.surfaces.len() as u32;
    model.surfaces.push(lambert(0.0, luminance));
    let n = 4;
    for corner in 0..8 {
        let sign = |bit: u32| if corner >> bit & 1 == 1 { -1.0 } else { 1.0 };
        let axes = [DVec3::X * sign(0), DVec3::Y * sign(1), DVec3::Z * sign(2)];
        let even = (corner as u32).count_ones().is_multiple_of(2);
        let at = |i: u32, j: u32| {
            let share = |k: u32| f64::from(k) / f64::from(n);
            place + radius * (share(i) * axes[0] + share(j) * axes[1] + share(n - i - j) * axes[2]).normalize()
        };
        let mut add = |a: DVec3, b: DVec3, c: DVec3| {
            let first = model.positions.len() as u32;
            model.positions.extend(if even { [a, b, c] } else { [a, c, b] });
            model.triangles.push([first, first + 1, first + 2]);
            model.surface_of.push(number);
        };
        for i in 0..n {
            for j in 0..n - i {
                add(at(i, j), at(i + 1, j), at(i, j + 1));
                if i + j + 1 < n {
                    add(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                }
            }
        }
    }
}

fn hang(model: &mut Model, place: DVec3, flux: f64, extent: &str) {
    let web = Photometry::parse("web", WEB.as_bytes()).expect("the file is right");
    let job = format!(
        "scene = \"hall\"\n{GRID}[[luminaire]]\nfile = \"web\"\nposition = {:?}\nflux = {flux}\nextent = \"{extent}\"\n",
        place.to_array()
    );
    let job = Job::parse(&job, "bench").expect("the job is right");
    model.hang(("bench", "luminaire"), &job.luminaires[0], &web).expect("a luminaire with an opening");
}

/// Seconds before the first batch, seconds of a history and bin, relative error, the worst of a bin, figure of merit.
fn run(kind: &str, number: u32, job: &str, seed: u64) -> [f64; 5] {
    let mut job = Job::parse(&format!("scene = \"hall\"\n{job}"), "bench").expect("the job is right");
    job.run.seed = seed;
    job.run.histories_per_batch *= if kind == "outside" { 8 } else { 1 };
    let scene = Scene::new(hall(kind, number), &job).expect("the scene is right");
    let start = thread_time();
    let realization = Realization::new(&job, &scene, &bounds(&job, &scene));
    let before = (thread_time() - start).as_secs_f64();
    let Reached { seconds, of_a_bin, relative_error, worst } = reach(&realization, &job);
    [before, of_a_bin, relative_error, worst, figure_of_merit(relative_error, seconds)]
}
