//! The paper's point about normals: the luminance of a glossy body by its series and by a mesh of it, against the exact surface.

use super::generator;
use lampyris::geometry::harmonic::{Series, Star, projection};
use lampyris::geometry::{Geometry, Harmonic, Mesh, Ray};
use lampyris::math::{DMat3, DVec3, PI, sin_cos};
use lampyris::photometry::Colour;
use lampyris::random::sphere;
use lampyris::scene::Reflectance;

const AXES: DVec3 = DVec3::new(1.0, 0.8, 1.25);
const LAMP: DVec3 = DVec3::new(3.0, 2.0, 4.0);

/// Where the ray meets the ellipsoid, and the normal there.
fn exact(ray: &Ray) -> Option<(DVec3, DVec3)> {
    let (o, d) = (ray.origin / AXES, ray.direction / AXES);
    let (a, b, c) = (d.length_squared(), o.dot(d), o.length_squared() - 1.0);
    let under = b * b - a * c;
    let at = ray.origin + (-b - under.sqrt()) / a * ray.direction;
    (under > 0.0).then(|| (at, (at / (AXES * AXES)).normalize()))
}

/// A mesh of the ellipsoid by meridians and parallels, its corners on the surface: 3 x 2 x 146 x 73 / 2 edges, about 32,000.
fn mesh() -> Mesh {
    let (around, down) = (146, 73);
    let corner = |i: usize, j: usize| {
        let ((s, c), (sin, cos)) =
            (sin_cos(PI * j as f64 / down as f64), sin_cos(2.0 * PI * (i % around) as f64 / around as f64));
        (DVec3::new(s * cos, s * sin, c) * AXES).as_vec3()
    };
    let cell = |(i, j): (usize, usize)| {
        let [a, b, c, d] = [corner(i, j), corner(i, j + 1), corner(i + 1, j + 1), corner(i + 1, j)];
        [[a, b, c], [a, c, d]]
    };
    let cells = (0..around).flat_map(|i| (0..down).map(move |j| (i, j)));
    Mesh::new(&cells.flat_map(cell).collect::<Vec<_>>())
}

/// Luminance of the lamp's light at a point towards the start of `ray`, lamp of 1 cd \[cd/m2\].
fn luminance(law: &Reflectance, ray: &Ray, (at, normal): (DVec3, DVec3)) -> f64 {
    let way = at - LAMP;
    let w_in = way.normalize();
    let cosine = -normal.dot(w_in);
    if cosine <= 0.0 || ray.direction.dot(normal) >= 0.0 {
        return 0.0;
    }
    law.evaluate(normal, w_in, -ray.direction).luminance() * cosine / way.length_squared()
}

#[test]
fn luminance_by_the_series_is_far_nearer_to_the_exact_surface_than_by_a_mesh_of_32000_edges() {
    let radius = |n: &DVec3| 1.0 / (*n / AXES).length();
    let fitted = |degree: usize| -> Series {
        projection(degree, 2 * degree + 2, |all| Ok(all.iter().map(radius).collect())).unwrap()
    };
    let object = |degree| {
        let object = Harmonic::new(Star::new(fitted(degree)).unwrap(), DVec3::ZERO, DMat3::IDENTITY).unwrap();
        Geometry::new(Mesh::new(&[]), Vec::new(), Vec::new()).with_harmonics(vec![object])
    };
    let surfaces = [
        ("series of degree 8", object(8)),
        ("series of degree 16", object(16)),
        ("series of degree 32", object(32)),
        ("mesh", Geometry::new(mesh(), Vec::new(), Vec::new())),
    ];
    let law = Reflectance::metallic_roughness(Colour([0.8; 3]), 1.0, 0.3);
    let mut rng = generator("normals");
    let mut sums = [[0.0; 2]; 4];
    let mut whole = 0.0;
    // Views from all around: directions in which each point is seen, and luminance in each.
    for _ in 0..20_000 {
        let eye = 6.0 * sphere(rng.uniform2());
        let target = 0.9 * sphere(rng.uniform2()) * AXES;
        let ray = Ray { origin: eye, direction: (target - eye).normalize() };
        let Some(truth) = exact(&ray).map(|at| luminance(&law, &ray, at)) else { continue };
        whole += truth * truth;
        for ((_, geometry), sums) in surfaces.iter().zip(&mut sums) {
            let hit = geometry.closest_hit(&ray).map_or(0.0, |hit| luminance(&law, &ray, (hit.position, hit.normal)));
            *sums = [sums[0] + (hit - truth) * (hit - truth), sums[1].max((hit - truth).abs())];
        }
    }
    let errors = sums.map(|[squares, _]| (squares / whole).sqrt());
    for ((name, _), (error, [_, most])) in surfaces.iter().zip(errors.iter().zip(sums)) {
        println!("{name}: luminance off by {:.4} % (rms), {most:.2e} cd/m2 at most", 100.0 * error);
    }
    assert!(errors[1] < 0.01 && errors[2] < 1e-4 && errors[3] > 0.02, "{errors:?}");
}
