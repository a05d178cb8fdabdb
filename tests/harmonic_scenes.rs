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
    let node = model.nodes.list.len();
    let name = Some("star".to_owned());
    model.nodes.list.push(Node { index: node, name, parent: None, world: DMat4::IDENTITY });
    model.nodes.of_triangle.resize(model.triangles.len(), 0);
    let harmonic = Harmonic::new(Star::new(series).unwrap(), center, to_world).unwrap();
    model.replacements.push(Replaced { harmonic, surface: model.surfaces.len() as u32, node: Some(node as u32) });
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

#[test]
fn a_luminous_sphere_gives_what_its_size_says_down_to_contact() {
    let (radius, luminance) = (0.4, 100.0);
    let mut job = run(16384, 32);
    let places = [(1.001, 1.0), (1.2, 1.0), (3.0, 1.0), (3.0, 0.6)];
    for (i, (distance, cosine)) in places.into_iter().enumerate() {
        let across = f64::sqrt(1.0 - cosine * cosine);
        job += &point(&format!("p{i}"), [distance * radius, 0.0, 0.0], [-cosine, 0.0, across]);
    }
    let scaled = DMat3::from_diagonal(DVec3::new(0.5, 0.5, -0.5));
    let model = with_star(Model::default(), Series::constant(0.8), DVec3::ZERO, scaled, lambert(0.0, luminance));
    let case = Case::new(&job, model);
    let flux = case.scene.sources.flux();
    assert!((flux / (4.0 * PI * PI * radius * radius * luminance) - 1.0).abs() < 1e-12, "{flux}");
    let estimates = case.estimates();
    let all: Vec<_> = (estimates.iter().flatten().zip(places))
        .map(|(estimate, (distance, cosine))| {
            let expected = PI * luminance * cosine / (distance * distance);
            // Without noise; its points lie some micrometres above it.
            compare(format!("E at {distance} radii"), *estimate, expected).within(2e-5)
        })
        .collect();
    assert_all(&all);
}

/// A lumpy body that shines in a room beside a lamp: shared between both estimators, which know nothing of each other's direct light.
#[test]
fn light_of_an_emissive_series_is_that_of_rays_that_find_it() {
    let mut pairs = vec![[0.25, 0.0], [0.03, 0.0], [-0.02, 0.04]];
    pairs.extend([[0.04, 0.0], [0.02, -0.03], [0.01, 0.03], [-0.03, 0.0], [0.02, 0.0], [0.0, 0.02], [0.01, 0.01]]);
    let turned = DMat3::from_cols(DVec3::new(0.6, 0.8, 0.0), DVec3::new(-0.8, 0.6, 0.0), DVec3::new(0.1, 0.0, 0.7));
    let room = || {
        let (room, series) = (closed_box(DVec3::ONE, &lambert(0.5, 0.0)), Series::new(&pairs).unwrap());
        with_star(room, series, DVec3::new(0.5, 0.5, 0.4), turned, lambert(0.3, 50.0))
    };
    let mut places = omni([0.2, 0.8, 0.9], 1.0);
    let points = [[0.5, 0.5, 0.001], [0.95, 0.5, 0.4], [0.5, 0.62, 0.9]];
    let normals = [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]];
    for (i, (p, n)) in points.into_iter().zip(normals).enumerate() {
        places += &point(&format!("p{i}"), p, n);
    }
    places += &spot_camera("wall", [0.1, 0.1, 0.9], [1.0, 0.6, 0.35], [0.0, 1.0, 0.0]);
    places += &spot_camera("body", [0.1, 0.1, 0.9], [0.5, 0.5, 0.4], [0.0, 1.0, 0.0]);
    let local = Case::new(&(run(16384, 48) + &places), room()).estimates();
    let reversed = run(8192, 24) + "[transport]\nestimator = \"reverse\"\n" + &places;
    let reverse = Case::new(&reversed, room()).estimates();
    let pairs = local.iter().flatten().zip(reverse.iter().flatten());
    let all: Vec<_> = pairs.enumerate().map(|(i, (l, r))| difference(format!("bin {i}"), *l, *r)).collect();
    assert_eq!(all.len(), 5);
    assert_all(&all);
}
