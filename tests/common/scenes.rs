//! Scenes of the tests: those of the battery, and a cube with a glossy floor or with mirrors.
#![allow(dead_code, unused_imports, reason = "each test binary uses its own part")]

use lampyris::math::{DVec3, Vec3};
use lampyris::photometry::Colour;
use lampyris::scene::{Model, Reflectance, Surface};
pub use lampyris::validate::scenes::{
    PLAIN, add_quad, box_walls, closed_box, integrating_sphere, lambert, omni, point, sobolev, spot_camera,
};

/// A surface that emits nothing, as glTF has it.
fn metallic_roughness(base: f64, metallic: f64, roughness: f64) -> Surface {
    let reflectance = Reflectance::metallic_roughness(Colour::grey(base), metallic, roughness);
    Surface { reflectance, ..lambert(0.0, 0.0) }
}

/// A metallic mirror.
pub fn mirror(base: f64) -> Surface {
    metallic_roughness(base, 1.0, 0.0)
}

/// A closed unit cube of Lambert walls with a GGX floor, whose ceiling emits `luminance` \[cd/m2\].
pub fn cube_with_floor(roughness: f64, metallic: f64, luminance: f64) -> Model {
    let mut model = closed_box(DVec3::ONE, &lambert(0.6, 0.0));
    // closed_box adds floor and ceiling as its third and fourth quads.
    model.surfaces[2] = metallic_roughness(0.6, metallic, roughness);
    model.surfaces[3] = lambert(0.6, luminance);
    model
}

/// A closed unit cube with a mirror wall at x = 0 and a polished, half mirroring floor, whose ceiling emits `luminance`
/// \[cd/m2\].
pub fn cube_with_mirrors(luminance: f64) -> Model {
    let mut model = closed_box(DVec3::ONE, &lambert(0.5, 0.0));
    model.surfaces[0] = mirror(0.9);
    model.surfaces[2] = metallic_roughness(0.6, 0.0, 0.0);
    model.surfaces[3] = lambert(0.5, luminance);
    model
}

/// A closed surface of many triangles: an octahedron's faces divided `depth` times, pushed out to a bumpy sphere.
pub fn bumpy_sphere(depth: u32) -> Vec<[Vec3; 3]> {
    let axes = [DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y];
    let mut faces: Vec<[DVec3; 3]> = Vec::new();
    for i in 0..4 {
        let (a, b) = (axes[i], axes[(i + 1) % 4]);
        faces.extend([[a, b, DVec3::Z], [b, a, DVec3::NEG_Z]]);
    }
    for _ in 0..depth {
        let split = |[a, b, c]: [DVec3; 3]| {
            let (x, y, z) = ((a + b).normalize(), (b + c).normalize(), (c + a).normalize());
            [[a, x, z], [x, b, y], [z, y, c], [x, y, z]]
        };
        faces = faces.into_iter().flat_map(split).collect();
    }
    let push = |p: DVec3| (p * (1.0 + 0.2 * p.x * p.y + 0.1 * p.z * p.z)).as_vec3();
    faces.into_iter().map(|f| f.map(push)).collect()
}
