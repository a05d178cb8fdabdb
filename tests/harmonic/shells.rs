//! What the meshes inside and outside of an object decide is what the series says, one segment at a time and in tiles, on
//! every path; rays that use them meet the same points.

use super::{generator, objects};
use lampyris::geometry::harmonic::{Series, Star};
use lampyris::geometry::simd::Path;
use lampyris::geometry::visibility::{BUNDLE, BUNDLES, Lanes, Points, Scratch, TILE};
use lampyris::geometry::{Geometry, Harmonic, Mesh, Ray};
use lampyris::math::{DMat3, DVec3, Vec3};
use lampyris::random::{Generator, sphere};

/// A room around the object, which stands turned, stretched unevenly and mirrored.
fn room(series: Series) -> (Geometry, Harmonic) {
    let corner = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let floor = [
        [corner(-4.0, -4.0, -3.0), corner(4.0, -4.0, -3.0), corner(4.0, 4.0, -3.0)],
        [corner(-4.0, -4.0, 3.0), corner(4.0, 4.0, 3.0), corner(-4.0, 4.0, 3.0)],
    ];
    let turned = DMat3::from_cols(DVec3::new(0.6, 0.8, 0.0), DVec3::new(0.96, -0.72, 0.0), DVec3::new(0.0, 0.0, 0.7));
    let object = Harmonic::new(Star::new(series).unwrap(), DVec3::new(0.3, -0.2, 0.4), turned).unwrap();
    (Geometry::new(Mesh::new(&floor), Vec::new(), Vec::new()).with_harmonics(vec![object.clone()]), object)
}

/// Whether the segment crosses the surface, by the series alone.
fn crosses(object: &Harmonic, a: Vec3, b: Vec3) -> bool {
    let (a, b) = (a.as_dvec3(), b.as_dvec3());
    let length = (b - a).length();
    object.first_crossing(&Ray { origin: a, direction: (b - a) / length }).is_some_and(|at| at < length)
}

/// A point in the room, a lifted point of the object, or one inside it.
fn place(geometry: &Geometry, object: &Harmonic, rng: &mut Generator) -> Vec3 {
    let (at, normal, _) = object.point(sphere(rng.uniform2()));
    match (4.0 * rng.uniform()) as u32 {
        0 => (0.3 * at + 0.7 * DVec3::new(0.3, -0.2, 0.4)).as_vec3(),
        1 | 2 => geometry.lift(at, normal).as_vec3(),
        _ => (2.5 * sphere(rng.uniform2())).as_vec3(),
    }
}

/// How many of the points of a tile `apex` does not see: as by the series alone, one by one and in the tile, on every path.
fn hidden(name: &str, geometry: &mut Geometry, object: &Harmonic, apex: Vec3, points: &[Vec3]) -> usize {
    let expected: Vec<bool> = points.iter().map(|&p| !crosses(object, apex, p)).collect();
    for path in Path::ALL.into_iter().filter(|p| p.is_available()) {
        *geometry = std::mem::take(geometry).with_path(path);
        let mut seen: Lanes = [u16::MAX; BUNDLES];
        let tile = Points::new(geometry, points);
        geometry.hide(&geometry.apex(apex), &tile, &mut seen, &mut Scratch::default());
        for (i, (&p, &expected)) in points.iter().zip(&expected).enumerate() {
            assert_eq!(geometry.visible(apex, p), expected, "{name}: {apex} {p}");
            let in_tile = seen[i / BUNDLE] >> (i % BUNDLE) & 1 == 1;
            assert_eq!(in_tile, expected, "{name}, {path:?}, in a tile: {apex} {p}");
        }
    }
    expected.iter().filter(|seen| !**seen).count()
}

#[test]
fn segments_are_blocked_as_by_the_series_alone() {
    for (name, series) in [("reference", objects::reference()), ("rough", objects::rough(16, &mut generator("rough")))]
    {
        let (mut geometry, object) = room(series);
        let mut rng = generator(name);
        let (mut blocked, mut count) = (0, 0);
        for _ in 0..24 {
            let apex = place(&geometry, &object, &mut rng);
            let points: Vec<Vec3> = (0..TILE).map(|_| place(&geometry, &object, &mut rng)).collect();
            blocked += hidden(name, &mut geometry, &object, apex, &points);
            count += TILE;
        }
        assert!(blocked > count / 5 && blocked < count * 4 / 5, "{name}: {blocked} of {count}");
    }
}

#[test]
fn tiles_beyond_beside_and_before_an_object_are_seen_as_by_the_series_alone() {
    let (mut geometry, object) = room(objects::rough(16, &mut generator("rough")));
    let mut rng = generator("tiles");
    let mut hidden_of = [0; 3];
    for tile in 0..60 {
        // Tiles in a plane far and near, of which some lie in the shadow and some along its edge.
        let center = DVec3::new(0.3, -0.2, 0.4);
        let mut outside = || sphere(rng.uniform2()) * (1.7 + 1.5 * rng.uniform());
        let (apex, elsewhere) = (outside(), outside());
        let middle = center + if tile % 2 == 0 { elsewhere } else { 0.6 * elsewhere - apex };
        let apex = (center + apex).as_vec3();
        let (e, f) = lampyris::math::frame(sphere(rng.uniform2()));
        let size = 0.1 + 3.0 * rng.uniform();
        let mut point = || middle + size * ((rng.uniform() - 0.5) * e + (rng.uniform() - 0.5) * f);
        // Between floor and ceiling.
        let points: Vec<Vec3> =
            (0..TILE).map(|_| point().clamp(DVec3::splat(-2.9), DVec3::splat(2.9)).as_vec3()).collect();
        match hidden("tiles", &mut geometry, &object, apex, &points) {
            0 => hidden_of[0] += 1,
            TILE => hidden_of[2] += 1,
            _ => hidden_of[1] += 1,
        }
    }
    assert!(hidden_of.iter().all(|&count| count >= 5), "{hidden_of:?} seen, in part and hidden");
}

#[test]
fn rays_meet_what_the_series_alone_meets() {
    let (geometry, object) = room(objects::rough(16, &mut generator("rough")));
    let mut rng = generator("rays");
    let mut met = 0;
    for _ in 0..4000 {
        let origin = place(&geometry, &object, &mut rng).as_dvec3();
        let ray = Ray { origin, direction: sphere(rng.uniform2()) };
        let exact = object.first_crossing(&ray);
        match geometry.closest_hit(&ray).filter(|hit| hit.primitive == 2) {
            Some(hit) => {
                met += 1;
                let cosine = hit.normal.dot(ray.direction).abs().max(1e-5);
                assert!((hit.distance - exact.expect("it was met")).abs() < 1e-10 / cosine, "{hit:?} {exact:?}");
                assert!((hit.position - (origin + hit.distance * ray.direction)).length() < 1e-9 / cosine);
            }
            None => assert!(exact.is_none(), "{exact:?} from {origin} along {}", ray.direction),
        }
    }
    assert!(met > 1500, "{met}");
}
