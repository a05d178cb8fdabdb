//! Scenes of the tests, built in memory.

use lampyris::math::DVec3;
use lampyris::photometry::Colour;
use lampyris::scene::{Model, Reflectance, Surface};

/// A one-sided Lambert surface.
pub fn lambert(reflectance: f64, emission: f64) -> Surface {
    Surface {
        name: "wall".into(),
        reflectance: Reflectance::Lambert(Colour::grey(reflectance)),
        double_sided: false,
        emission: Colour::grey(emission),
    }
}

/// Adds a parallelogram with corner `origin`; its front is the side of u x v.
pub fn add_quad(model: &mut Model, origin: DVec3, u: DVec3, v: DVec3, surface: Surface) {
    let first = model.positions.len() as u32;
    model.positions.extend([origin, origin + u, origin + u + v, origin + v]);
    model.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    let number = model.surfaces.len() as u32;
    model.surface_of.extend([number, number]);
    model.surfaces.push(surface);
}

/// A closed box from the origin to `size` whose insides are the fronts, every wall like `surface`.
pub fn closed_box(size: DVec3, surface: &Surface) -> Model {
    let (x, y, z) = (DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z);
    let mut model = Model::default();
    let walls = [(DVec3::ZERO, y, z), (x, z, y), (DVec3::ZERO, z, x), (y, x, z), (DVec3::ZERO, x, y), (z, y, x)];
    for (origin, u, v) in walls {
        add_quad(&mut model, origin, u, v, surface.clone());
    }
    model
}

/// The two planes of Sobolev's problem with their omni of 1 cd; receivers are appended by the caller.
pub fn sobolev(run: &str, h1: f64, rho1: f64, rho2: f64) -> String {
    format!(
        "{run}\n[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 1, 0]\nreflectance = {rho1}\n\
         [[plane]]\npoint = [0, 1, 0]\nnormal = [0, -1, 0]\nreflectance = {rho2}\n\
         [[source]]\nkind = \"omni\"\nposition = [0, {h1}, 0]\nintensity = 1\n"
    )
}

/// A lux-meter as TOML.
pub fn point(name: &str, p: [f64; 3], n: [f64; 3]) -> String {
    format!("[[point]]\nname = \"{name}\"\nposition = {p:?}\nnormal = {n:?}\n")
}

/// A camera of one pixel, so narrow that it sees a point, as TOML.
pub fn spot_camera(name: &str, eye: [f64; 3], target: [f64; 3], up: [f64; 3]) -> String {
    format!(
        "[[camera]]\nname = \"{name}\"\neye = {eye:?}\ntarget = {target:?}\nup = {up:?}\n\
         vertical_fov_degrees = 0.01\nwidth = 1\nheight = 1\npixel_samples = 1\n"
    )
}
