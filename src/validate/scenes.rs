//! Scenes built in memory: surfaces and boxes as a [`Model`], receivers, sources and runs as the TOML of a job.

use crate::math::DVec3;
use crate::photometry::Colour;
use crate::scene::{Light, Model, Reflectance, Surface};

/// The direction upwards.
pub const UP: [f64; 3] = [0.0, 1.0, 0.0];

/// A one-sided Lambert surface of `reflectance` \[1\] and emitted luminance `emission` \[cd/m2\].
pub fn lambert(reflectance: f64, emission: f64) -> Surface {
    Surface {
        name: "wall".into(),
        reflectance: Reflectance::Lambert(Colour::grey(reflectance)),
        double_sided: false,
        emission: Colour::grey(emission),
    }
}

/// Adds a parallelogram with corner `origin` \[m\]; its front is the side of u x v.
pub fn add_quad(model: &mut Model, origin: DVec3, u: DVec3, v: DVec3, surface: Surface) {
    add_polygon(model, &rectangle(origin, u, v), surface);
}

/// The corners of a parallelogram, counter-clockwise seen from the side of u x v \[m\].
pub fn rectangle(origin: DVec3, u: DVec3, v: DVec3) -> [DVec3; 4] {
    [origin, origin + u, origin + u + v, origin + v]
}

/// Adds a convex polygon with `corners` \[m\], counter-clockwise seen from its front.
pub fn add_polygon(model: &mut Model, corners: &[DVec3], surface: Surface) {
    let first = model.positions.len() as u32;
    let number = model.surfaces.len() as u32;
    model.positions.extend(corners);
    for i in 2..corners.len() as u32 {
        model.triangles.push([first, first + i - 1, first + i]);
        model.surface_of.push(number);
    }
    model.surfaces.push(surface);
}

/// A closed box from the origin to `size` \[m\] whose insides are the fronts, every wall like `surface`.
pub fn closed_box(size: DVec3, surface: &Surface) -> Model {
    enclosure(&box_walls(size), surface)
}

/// The `walls`, each an origin, u and v \[m\], all like `surface`.
pub fn enclosure(walls: &[[DVec3; 3]], surface: &Surface) -> Model {
    let mut model = Model::default();
    walls.iter().for_each(|&[origin, u, v]| add_quad(&mut model, origin, u, v, surface.clone()));
    model
}

/// The walls of a box from the origin to `size` as origin, u and v, u x v inwards \[m\]: those at x = 0 and at its other
/// end, floor, ceiling, those at z = 0 and at its other end.
pub fn box_walls(size: DVec3) -> [[DVec3; 3]; 6] {
    let (o, x, y, z) = (DVec3::ZERO, DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z);
    [[o, y, z], [x, z, y], [o, z, x], [y, x, z], [o, x, y], [z, y, x]]
}

/// Adds the parallelogram with a hole between the shares `across` of u and `along` of v, in eight quads.
pub fn add_quad_with_hole(
    model: &mut Model,
    [origin, u, v]: [DVec3; 3],
    across: [f64; 2],
    along: [f64; 2],
    surface: &Surface,
) {
    let ends = |[low, high]: [f64; 2]| [(0.0, low), (low, high - low), (high, 1.0 - high)];
    for (i, (x, width)) in ends(across).into_iter().enumerate() {
        for (j, (y, height)) in ends(along).into_iter().enumerate().filter(|(j, _)| (i, *j) != (1, 1)) {
            assert!(width > 0.0 && height > 0.0, "a hole inside, {i} {j}");
            add_quad(model, origin + x * u + y * v, width * u, height * v, surface.clone());
        }
    }
}

/// `model` in parallel light along `direction` of `illuminance` across it \[lx\].
pub fn in_parallel_light(mut model: Model, direction: DVec3, illuminance: f64) -> Model {
    model.lights.push(Light::Directional { direction, illuminance: Colour::grey(illuminance) });
    model
}

/// The two planes of Sobolev's problem with their omni of 1 cd, after the tables of `run`; the caller adds receivers.
pub fn sobolev(run: &str, h1: f64, rho1: f64, rho2: f64) -> String {
    let source = omni([0.0, h1, 0.0], 1.0);
    let (lower, upper) = (plane([0.0; 3], UP, rho1), plane([0.0, 1.0, 0.0], [0.0, -1.0, 0.0], rho2));
    format!("{run}\n{lower}{upper}{source}")
}

/// `[run]` of `batches` times `histories`: powers of two, and 16 batches or more, so that every way of sampling fits.
pub fn run(histories: u32, batches: u32) -> String {
    format!("[run]\nhistories_per_batch = {histories}\nbatches = {batches}\nseed = 21\n")
}

/// The plain local estimate: what single orders of reflection are a matter of.
pub const PLAIN: &str = "[transport]\nbounded = false\n";

/// An infinite plane.
pub fn plane(point: [f64; 3], normal: [f64; 3], reflectance: f64) -> String {
    format!("[[plane]]\npoint = {point:?}\nnormal = {normal:?}\nreflectance = {reflectance}\n")
}

/// An integrating sphere of radius 1 m about the origin.
pub fn integrating_sphere(reflectance: f64) -> String {
    format!("[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nfacing = \"inward\"\nreflectance = {reflectance}\n")
}

/// A point source of `intensity` \[cd\].
pub fn omni(position: [f64; 3], intensity: f64) -> String {
    format!("[[source]]\nkind = \"omni\"\nposition = {position:?}\nintensity = {intensity}\n")
}

/// A lux-meter.
pub fn point(name: &str, p: [f64; 3], n: [f64; 3]) -> String {
    format!("[[point]]\nname = \"{name}\"\nposition = {p:?}\nnormal = {n:?}\n")
}

/// Lux-meters at places and with normals, named by `prefix` and their numbers.
pub fn points(prefix: &str, places: impl IntoIterator<Item = ([f64; 3], [f64; 3])>) -> String {
    places.into_iter().enumerate().map(|(i, (p, n))| point(&format!("{prefix}{i}"), p, n)).collect()
}

/// A camera of one pixel, so narrow that it sees a point.
pub fn spot_camera(name: &str, eye: [f64; 3], target: [f64; 3], up: [f64; 3]) -> String {
    format!(
        "[[camera]]\nname = \"{name}\"\neye = {eye:?}\ntarget = {target:?}\nup = {up:?}\n\
         vertical_fov_degrees = 0.01\nwidth = 1\nheight = 1\npixel_samples = 1\n"
    )
}
