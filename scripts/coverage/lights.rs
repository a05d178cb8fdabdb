//! Light that is sampled because there is much of it, or because it has an extent: many lights, many luminous areas, luminaires with the
//! opening of their file or a mesh, spheres, a sky behind a window.

use super::cases::{camera, measured, tables};
use super::count::{Counted, count};
use super::replicate::Kind;
use lampyris::error::Result;
use lampyris::job::Job;
use lampyris::math::{DMat4, DVec3};
use lampyris::scene::photometric_web::Photometry;
use lampyris::scene::{Model, Node};
use lampyris::validate::experiment::Experiment;
use lampyris::validate::scenes::{
    UP, add_quad, add_quad_with_hole, box_walls, closed_box, enclosure, lambert, omni, point,
};

/// Size of the hall \[m\].
const HALL: DVec3 = DVec3::new(12.0, 3.0, 8.0);
/// A downlight with a rectangular opening of 0.6 x 0.3 m.
const WEB: &str = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 7 1 1 2 0.3 0.6 0\n1 1 20\n0 15 30 45 60 75 90\n0\n\
                   300 310 330 300 200 80 0\n";

/// What is counted, of so many replicates.
type Case = fn(u64) -> Result<Vec<Counted>>;
/// The cases and what they are called.
pub const CASES: [(&str, Case); 7] = [
    ("points", many_points),
    ("areas", many_areas),
    ("opening", opening),
    ("openings", many_openings),
    ("mesh", mesh),
    ("spheres", spheres),
    ("window", window),
];

/// All cases, or the one called `only`, printed as they come.
pub fn run(only: Option<&str>, replicates: u64, mut done: impl FnMut(&[Counted])) -> Result<Vec<Counted>> {
    let mut all = Vec::new();
    for (_, case) in CASES.into_iter().filter(|(name, _)| only.is_none_or(|only| only == *name)) {
        let counted = case(replicates)?;
        done(&counted);
        all.extend(counted);
    }
    Ok(all)
}

/// A pixel of floor and wall together, a lux-meter at an edge and one in the middle, over `model` with the sources of `more`.
fn hall(name: &str, model: Model, more: &str, n: u64) -> Result<Vec<Counted>> {
    let job = tables("rqmc", 32, 32)
        + &camera("view", [1.0, 1.5, 1.0], [8.0, 0.0, 6.0], 20.0, [1, 1])
        + &point("near", [5.0, 0.0, 0.05], UP)
        + &point("middle", [5.0, 0.0, 4.0], UP)
        + more;
    let experiment = Experiment::new(&job, model)?;
    let wanted = [
        ("pixel of the floor", Kind::Total(0, 0)),
        ("E 5 cm from a wall", Kind::Total(1, 0)),
        ("E in the middle", Kind::Total(2, 0)),
        ("ratio of the two", Kind::Ratio(1, 2)),
    ];
    let quantities = measured(&experiment, &wanted);
    Ok(count(name, &experiment, quantities, n))
}

/// Places below the ceiling, in columns and rows.
fn places(columns: u32, rows: u32) -> impl Iterator<Item = DVec3> {
    let share = |i: u32, count: u32| (f64::from(i) + 0.4) / f64::from(count);
    let place = move |i: u32| DVec3::new(HALL.x * share(i % columns, columns), 2.8, HALL.z * share(i / columns, rows));
    (0..columns * rows).map(place)
}

fn many_points(n: u64) -> Result<Vec<Counted>> {
    let sources: String = places(12, 8).map(|place| omni(place.to_array(), 10.0)).collect();
    hall("96 omnis in a hall, rqmc, 32 x 32", closed_box(HALL, &lambert(0.5, 0.0)), &sources, n)
}

fn many_areas(n: u64) -> Result<Vec<Counted>> {
    let mut model = closed_box(HALL, &lambert(0.5, 0.0));
    places(12, 8).for_each(|place| add_quad(&mut model, place, DVec3::X * 0.3, DVec3::Z * 0.3, lambert(0.0, 100.0)));
    hall("96 luminous squares in a hall, rqmc, 32 x 32", model, "", n)
}

fn opening(n: u64) -> Result<Vec<Counted>> {
    hall("two luminaires with openings in a hall, rqmc, 32 x 32", with_openings(places(2, 1))?, "", n)
}

fn many_openings(n: u64) -> Result<Vec<Counted>> {
    hall("60 luminaires with openings in a hall, rqmc, 32 x 32", with_openings(places(10, 6))?, "", n)
}

fn mesh(n: u64) -> Result<Vec<Counted>> {
    hall("two luminaires with luminous meshes in a hall, rqmc, 32 x 32", with_meshes(places(2, 1))?, "", n)
}

/// Balls below the ceiling, which hide one another, and one that stands on the floor between the wall and the meter beside it.
fn spheres(n: u64) -> Result<Vec<Counted>> {
    let sphere = |[x, y, z]: [f64; 3]| {
        format!(
            "[[source]]\nkind = \"sphere\"\nposition = [{x}, {y}, {z}]\nradius = 0.15\nflux = 500\nreflectance = 0.5\n"
        )
    };
    let hanging: String = places(4, 2).map(|place| sphere((place - 0.2 * DVec3::Y).to_array())).collect();
    let sources = hanging + &sphere([5.2, 0.15, 0.2]);
    hall("nine luminous spheres in a hall, rqmc, 32 x 32", closed_box(HALL, &lambert(0.5, 0.0)), &sources, n)
}

/// A clear sky with its sun through a hole of 4 x 1.5 m in the wall x = 12 m, with the opening to aim at.
fn window(n: u64) -> Result<Vec<Counted>> {
    let surface = lambert(0.5, 0.0);
    let mut walls = box_walls(HALL).to_vec();
    let facade = walls.remove(1);
    let mut model = enclosure(&walls, &surface);
    add_quad_with_hole(&mut model, facade, [0.25, 0.75], [1.0 / 3.0, 2.5 / 3.0], &surface);
    let sky = "[sky]\nmodel = 12\nhorizontal_illuminance = 10000\nground_reflectance = 0.2\n\
               [sky.sun]\nazimuth_degrees = 80\nelevation_degrees = 30\nilluminance = 20000\n\
               [[opening]]\ncorners = [[12, 1, 2], [12, 1, 6], [12, 2.5, 6], [12, 2.5, 2]]\n";
    hall("sky and sun through a window, rqmc, 32 x 32", model, sky, n)
}

/// The hall with a luminaire at each of `places`.
fn with_openings(places: impl Iterator<Item = DVec3>) -> Result<Model> {
    let entries = places.map(|place| format!("position = {:?}\nextent = \"opening\"", place.to_array()));
    hung(closed_box(HALL, &lambert(0.5, 0.0)), entries)
}

/// The same with a box of the scene, larger than the opening of the file, in the place of each.
fn with_meshes(places: impl Iterator<Item = DVec3>) -> Result<Model> {
    let mut model = closed_box(HALL, &lambert(0.5, 0.0));
    let (size, mut names) = (DVec3::new(1.2, 0.15, 0.3), Vec::new());
    let mut add_node = |model: &mut Model, name: &str| {
        let world = DMat4::IDENTITY;
        let index = model.nodes.list.len();
        model.nodes.list.push(Node { index, name: Some(name.to_owned()), parent: None, world });
        model.nodes.of_triangle.resize(model.triangles.len(), index as u32);
        names.push(name.to_owned());
    };
    add_node(&mut model, "walls");
    for (i, place) in places.enumerate() {
        for [origin, u, v] in box_walls(size) {
            add_quad(&mut model, place - 0.5 * size + origin, u, v, lambert(0.0, 0.0));
        }
        add_node(&mut model, &format!("lamp {i}"));
    }
    hung(model, names[1..].iter().map(|name| format!("mesh = \"{name}\"")))
}

/// `model` with a luminaire for each of `entries`.
fn hung(mut model: Model, entries: impl Iterator<Item = String>) -> Result<Model> {
    let web = Photometry::parse("web", WEB.as_bytes())?;
    for entry in entries {
        let receiver = point("p", [1.0; 3], UP);
        let job = format!("scene = \"hall\"\n[[luminaire]]\nfile = \"web\"\n{entry}\n{receiver}");
        let job = Job::parse(&job, "hall")?;
        model.hang(("hall", "luminaire[0]"), &job.luminaires[0], &web)?;
    }
    Ok(model)
}
