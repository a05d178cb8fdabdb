//! Scenes built in memory: surfaces and boxes as a [`Model`], receivers, sources and runs as the TOML of a job.

use crate::math::DVec3;
use crate::photometry::Colour;
use crate::scene::{Model, Reflectance, Surface};

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
    add_polygon(model, &[origin, origin + u, origin + u + v, origin + v], surface);
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
    let (x, y, z) = (DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z);
    let mut model = Model::default();
    let walls = [(DVec3::ZERO, y, z), (x, z, y), (DVec3::ZERO, z, x), (y, x, z), (DVec3::ZERO, x, y), (z, y, x)];
    for (origin, u, v) in walls {
        add_quad(&mut model, origin, u, v, surface.clone());
    }
    model
}

/// The two planes of Sobolev's problem with their omni of 1 cd, after the tables of `run`; the caller adds receivers.
pub fn sobolev(run: &str, h1: f64, rho1: f64, rho2: f64) -> String {
    let source = omni([0.0, h1, 0.0], 1.0);
    let (lower, upper) = (plane([0.0; 3], [0.0, 1.0, 0.0], rho1), plane([0.0, 1.0, 0.0], [0.0, -1.0, 0.0], rho2));
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

/// A camera of one pixel, so narrow that it sees a point.
pub fn spot_camera(name: &str, eye: [f64; 3], target: [f64; 3], up: [f64; 3]) -> String {
    format!(
        "[[camera]]\nname = \"{name}\"\neye = {eye:?}\ntarget = {target:?}\nup = {up:?}\n\
         vertical_fov_degrees = 0.01\nwidth = 1\nheight = 1\npixel_samples = 1\n"
    )
}
