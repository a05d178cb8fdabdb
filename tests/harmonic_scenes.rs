//! Light in scenes with star-shaped objects: a series of degree 0 is a sphere, outside and as an enclosure.

mod common;

use common::scenes::{closed_box, lambert, omni, point, spot_camera};
use common::{Case, assert_all, compare, difference};
use lampyris::geometry::Harmonic;
use lampyris::geometry::harmonic::{Series, Star};
use lampyris::math::{DMat3, DMat4, DVec3, PI};
use lampyris::scene::{Model, Node, Replaced, Surface};
use lampyris::validate::scenes::run;

/// `model` with a star-shaped object of `surface` at a node of its own.
fn with_star(mut model: Model, series: Series, center: DVec3, to_world: DMat3, surface: Surface) -> Model {
    let node = model.nodes.list.len() as u32;
    let name = Some("star".to_owned());
    model.nodes.list.push(Node { index: node as usize, name, parent: None, world: DMat4::IDENTITY });
    model.nodes.of_triangle.resize(model.triangles.len(), 0);
    let harmonic = Harmonic::new(Star::new(series).unwrap(), center, to_world).unwrap();
    model.replacements.push(Replaced { harmonic, surface: model.surfaces.len() as u32, node });
    model.surfaces.push(surface);
    model
}

#[test]
fn a_series_of_degree_0_is_a_sphere_to_light() {
    let mut job = run(4096, 32) + &omni([0.2, 0.3, 0.8], 1.0);
    for (i, p) in [[0.5, 0.5, 0.05], [0.9, 0.2, 0.5], [0.5, 0.95, 0.3]].into_iter().enumerate() {
        job += &point(&format!("p{i}"), p, [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]][i]);
    }
    job += &spot_camera("on", [0.1, 0.1, 0.9], [0.5, 0.5, 0.5], [0.0, 1.0, 0.0]);
    job += &spot_camera("beside", [0.1, 0.1, 0.9], [1.0, 0.6, 0.35], [0.0, 1.0, 0.0]);
    let room = || closed_box(DVec3::ONE, &lambert(0.6, 0.0));
    let sphere = "[[sphere]]\ncenter = [0.5, 0.5, 0.5]\nradius = 0.25\nreflectance = 0.7\n";
    let analytic = Case::new(&(job.clone() + sphere), room()).estimates();
    // Scaled by its transform, so that the normal and the distance of hits come through it.
    let scaled = DMat3::from_diagonal(DVec3::splat(0.5));
    let model = with_star(room(), Series::constant(0.5), DVec3::splat(0.5), scaled, lambert(0.7, 0.0));
    let harmonic = Case::new(&job, model).estimates();
    let pairs = analytic.iter().flatten().zip(harmonic.iter().flatten());
    let all: Vec<_> = pairs.enumerate().map(|(i, (a, h))| difference(format!("bin {i}"), *h, *a)).collect();
    assert_eq!(all.len(), 5);
    assert_all(&all);
}

#[test]
fn a_series_encloses_an_integrating_sphere() {
    let (rho, radius) = (0.8, 1.5);
    let walls = Surface { double_sided: true, ..lambert(rho, 0.0) };
    let lamp = DVec3::new(0.3, -0.2, 0.4);
    let mut job = run(2048, 32) + &omni(lamp.to_array(), 1.0);
    let places = [DVec3::X, DVec3::new(-1.0, 2.0, 0.5).normalize(), DVec3::NEG_Z];
    for (i, n) in places.iter().enumerate() {
        job += &point(&format!("p{i}"), (*n * radius).to_array(), (-*n).to_array());
    }
    let model = with_star(Model::default(), Series::constant(radius), DVec3::ZERO, DMat3::IDENTITY, walls);
    let case = Case::new(&job, model);
    let reflected = rho / (1.0 - rho) * 4.0 * PI / (4.0 * PI * radius * radius);
    let all: Vec<_> = (case.estimates().iter().flatten().zip(places))
        .map(|(estimate, n)| {
            let to = n * radius - lamp;
            let direct = to.normalize().dot(n) / to.length_squared();
            compare(format!("E at {n}"), *estimate, direct + reflected)
        })
        .collect();
    assert_all(&all);
}
