//! Rays and segments against brute force in f64, and closed surfaces that nothing leaves.

mod common;

use common::scenes::{add_quad, bumpy_sphere, lambert};
use lampyris::geometry::simd::Path;
use lampyris::geometry::{Geometry, Hit, Mesh, Plane, Ray, Sphere};
use lampyris::math::{DVec3, Vec3};
use lampyris::random::{Domain, Generator, Stream, sphere};
use lampyris::scene::Model;

fn generator(name: &str) -> Generator {
    Stream::new(61, Domain::Receiver, name).generator(0)
}

fn in_box(rng: &mut Generator, half: f64) -> DVec3 {
    let coordinate = |rng: &mut Generator| half * (2.0 * rng.uniform() - 1.0);
    DVec3::new(coordinate(rng), coordinate(rng), coordinate(rng))
}

/// Triangles of all sizes, slivers and axis-aligned ones among them.
fn soup(count: usize) -> Vec<[Vec3; 3]> {
    let mut rng = generator("soup");
    let triangle = |i: usize| {
        let corner = in_box(&mut rng, 2.0);
        let size = [1.0, 0.1, 0.01][i % 3];
        let (mut u, mut v) = (size * in_box(&mut rng, 1.0), size * in_box(&mut rng, 1.0));
        if i.is_multiple_of(5) {
            (u.y, v.y) = (0.0, 0.0);
        }
        if i.is_multiple_of(7) {
            v = u + 1e-4 * v;
        }
        [corner, corner + u, corner + v].map(|p| p.as_vec3())
    };
    (0..count).map(triangle).collect()
}

/// Distance at which a ray meets a triangle, by Moeller and Trumbore in f64, and how near it passes to an edge.
fn brute(triangle: &[Vec3; 3], o: DVec3, d: DVec3) -> Option<(f64, f64)> {
    let [a, b, c] = triangle.map(|p| p.as_dvec3());
    let (u_edge, v_edge) = (b - a, c - a);
    let p = d.cross(v_edge);
    let determinant = u_edge.dot(p);
    let (to, q) = (o - a, (o - a).cross(u_edge));
    let (u, v, t) = (to.dot(p) / determinant, d.dot(q) / determinant, v_edge.dot(q) / determinant);
    let margin = u.min(v).min(1.0 - u - v);
    (margin >= 0.0 && t > 0.0).then_some((t, margin))
}

#[test]
fn closest_hits_are_those_of_brute_force() {
    let triangles = soup(2000);
    let geometry = Geometry::new(Mesh::new(&triangles), Vec::new(), Vec::new());
    let mut rng = generator("rays");
    let mut met = 0;
    for _ in 0..5000 {
        // What the mesh sees is the ray rounded to f32.
        let origin = in_box(&mut rng, 3.0).as_vec3().as_dvec3();
        let direction = sphere(rng.uniform2()).as_vec3().as_dvec3();
        let all = triangles.iter().enumerate().filter_map(|(i, t)| Some((brute(t, origin, direction)?, i)));
        let nearest = all.min_by(|a, b| a.0.0.total_cmp(&b.0.0));
        let hit = geometry.closest_hit(&Ray { origin, direction });
        match (nearest, hit) {
            (None, None) => {}
            (Some(((t, _), i)), Some(hit)) => {
                met += 1;
                assert_eq!(hit.primitive as usize, i);
                // A ray from outside is taken to the mesh before it is rounded to f32.
                assert!((hit.distance - t).abs() < 1e-6 * t.max(1.0), "{hit:?} against {t}");
            }
            // On an edge the two formulas may round differently.
            (Some(((_, margin), _)), None) => assert!(margin < 1e-9, "missed a triangle: {margin}"),
            (None, Some(hit)) => panic!("{hit:?} is not there"),
        }
        let limit = 3.0 * rng.uniform();
        let within = geometry.closest_hit_within(&Ray { origin, direction }, limit);
        assert_eq!(within, hit.filter(|h| h.distance <= limit), "within {limit} m");
    }
    assert!(met > 1000, "only {met} rays met anything");
}

#[test]
fn segments_are_blocked_as_by_brute_force() {
    let triangles = soup(2000);
    let spheres = vec![Sphere { center: DVec3::splat(0.5), radius: 0.4, inward: false }];
    let planes = vec![Plane::new(DVec3::Y * -1.5, DVec3::Y)];
    let geometry = Geometry::new(Mesh::new(&triangles), spheres, planes);
    let mut rng = generator("segments");
    let mut blocked = 0;
    for _ in 0..5000 {
        let (a, b) = (in_box(&mut rng, 2.0).as_vec3(), in_box(&mut rng, 2.0).as_vec3());
        let (o, d) = (a.as_dvec3(), (b - a).as_dvec3());
        let by_triangle = triangles.iter().any(|t| brute(t, o, d).is_some_and(|(t, _)| t < 1.0));
        let by_plane = (a.y + 1.5) * (b.y + 1.5) < 0.0;
        let steps = (0..=2000).map(|i| (o + d * f64::from(i) / 2000.0 - DVec3::splat(0.5)).length() < 0.4);
        let inside: Vec<bool> = steps.collect();
        let by_sphere = inside.iter().any(|&x| x != inside[0]);
        let expected = !(by_triangle || by_plane || by_sphere);
        blocked += u32::from(!expected);
        // A chord shorter than a step of the scan may be missed by it, never the other way round.
        let visible = geometry.visible(a, b);
        assert!(visible == expected || !visible, "{a} {b}: visible, but something is between them");
        assert!(visible == expected || (o - DVec3::splat(0.5)).length() > 0.39, "{a} {b}: blocked by nothing");
    }
    assert!((1000..4900).contains(&blocked), "{blocked} of 5000 blocked");
    for length in [0.0, 1e-30, 1e-12] {
        let a = 0.01 * Vec3::ONE;
        assert!(geometry.visible(a, a + Vec3::X * length), "nothing lies within {length} m of a point in the air");
    }
}

#[test]
fn nothing_leaves_closed_surfaces() {
    let mut room = Model::default();
    let (x, y, z) = (DVec3::X * 6.0, DVec3::Y * 3.0, DVec3::Z * 4.0);
    for (origin, u, v) in
        [(DVec3::ZERO, y, z), (x, z, y), (DVec3::ZERO, z, x), (y, x, z), (DVec3::ZERO, x, y), (z, y, x)]
    {
        add_quad(&mut room, origin, u, v, lambert(0.5, 0.0));
    }
    let corner = |&v: &u32| room.positions[v as usize] - DVec3::new(3.0, 1.5, 2.0);
    let room: Vec<[Vec3; 3]> =
        room.triangles.iter().map(|t| [corner(&t[0]), corner(&t[1]), corner(&t[2])].map(|p| p.as_vec3())).collect();
    for (name, triangles) in [("room", room), ("bumpy", bumpy_sphere(5))] {
        let geometry = Geometry::new(Mesh::new(&triangles), Vec::new(), Vec::new());
        let mut rng = generator(name);
        for i in 0..300_000 {
            let origin = in_box(&mut rng, 0.3);
            // Every other ray aims exactly at an edge or a corner, where neighbours meet.
            let [a, b, c] = triangles[rng.below(triangles.len() as u32) as usize].map(|p| p.as_dvec3());
            let target = match i % 4 {
                0 => a,
                1 => a + (b - a) * rng.uniform(),
                _ => a + ((b - a) + (c - a)) * (0.5 * rng.uniform()),
            };
            let direction = (target - origin).normalize();
            let hit = geometry.closest_hit(&Ray { origin, direction });
            assert!(hit.is_some(), "{name}: ray {i} leaves towards {target}");
            let beyond = (origin + 1.5 * (target - origin)).as_vec3();
            assert!(!geometry.visible(origin.as_vec3(), beyond), "{name}: segment {i} leaves towards {target}");
        }
    }
}

#[test]
fn equal_distances_go_to_the_lower_number() {
    let twice = [[Vec3::ZERO, Vec3::Z, Vec3::X], [Vec3::ZERO, Vec3::Z, Vec3::X]];
    let filler = soup(50).into_iter().map(|t| t.map(|p| p - 100.0 * Vec3::Y));
    let triangles: Vec<_> = filler.chain(twice).collect();
    let geometry = Geometry::new(Mesh::new(&triangles), Vec::new(), Vec::new());
    let ray = Ray { origin: DVec3::new(0.2, 1.0, 0.2), direction: DVec3::NEG_Y };
    let Hit { primitive, front, .. } = geometry.closest_hit(&ray).unwrap();
    assert_eq!((primitive, front), (50, true));
}

/// The hits of `rays` in a packet and one by one, on every path of the processor, which must be the same bits.
fn compare_packets(name: &str, triangles: &[[Vec3; 3]], rays: &[Ray]) -> usize {
    let mut geometry = Geometry::new(
        Mesh::new(triangles),
        vec![Sphere { center: DVec3::new(1.0, 2.0, 0.5), radius: 0.3, inward: false }],
        vec![Plane::new(DVec3::Z * -2.5, DVec3::Z)],
    );
    let mut first: Option<Vec<Option<Hit>>> = None;
    for path in Path::ALL.into_iter().filter(|p| p.is_available()) {
        geometry = geometry.with_path(path);
        let mut packet = vec![None; rays.len()];
        geometry.closest_hits(rays, &mut packet);
        let single: Vec<_> = rays.iter().map(|r| geometry.closest_hit(r)).collect();
        for (i, (packet, single)) in packet.iter().zip(&single).enumerate() {
            assert_eq!(packet, single, "{name}: ray {i} of {} in a packet", path.name());
        }
        assert_eq!(&single, first.get_or_insert(single.clone()), "{name}: {}", path.name());
    }
    first.unwrap_or_default().iter().flatten().count()
}

#[test]
fn packets_meet_what_single_rays_meet() {
    let scenes = [("soup", soup(3000)), ("bumpy", bumpy_sphere(4)), ("grid", grid(12))];
    let mut met = 0;
    for (name, triangles) in scenes {
        let mut rng = generator(name);
        for round in 0..60 {
            // Inside, on a lattice point of the grid, and outside, where rays go one by one.
            let origin = match round % 4 {
                0 | 1 => in_box(&mut rng, 1.5),
                2 => (in_box(&mut rng, 2.0) * 4.0).round() / 4.0,
                _ => in_box(&mut rng, 6.0),
            };
            let spread = [0.01, 0.1, 0.4, 2.0][round % 4];
            let axis = if round % 3 == 0 { DVec3::AXES[round % 9 / 3] } else { sphere(rng.uniform2()) };
            let ray = |i: usize| {
                // Towards corners and along the axes too.
                let corner = triangles[rng.below(triangles.len() as u32) as usize][i % 3].as_dvec3();
                let around = (axis + in_box(&mut rng, spread)).normalize();
                let lifted = if round % 5 == 4 { in_box(&mut rng, 1e-3) } else { DVec3::ZERO };
                let direction = match i % 32 {
                    5 => axis,
                    9 if round % 4 == 3 => (corner - origin).normalize(),
                    _ => around,
                };
                Ray { origin: origin + lifted, direction }
            };
            let rays: Vec<Ray> = (0..100).map(ray).collect();
            met += compare_packets(name, &triangles, &rays);
        }
        met += corners_from_a_point(name, &triangles);
    }
    assert!(met > 5000, "only {met} rays met anything");
}

/// Packets towards corners and edges of single triangles, where the filter is in doubt.
fn corners_from_a_point(name: &str, triangles: &[[Vec3; 3]]) -> usize {
    let mut rng = generator("corners");
    let mut met = 0;
    for _ in 0..100 {
        let origin = (in_box(&mut rng, 1.0)).as_vec3().as_dvec3();
        let [a, b, c] = triangles[rng.below(triangles.len() as u32) as usize].map(|p| p.as_dvec3());
        let ray = |i: u32| {
            let along = f64::from(i % 16) / 15.0;
            let (p, q) = [(a, b), (b, c), (c, a), (a, (a + b + c) / 3.0)][i as usize / 16];
            Ray { origin, direction: (p + (q - p) * along - origin).normalize() }
        };
        let rays: Vec<Ray> = (0..64).map(ray).collect();
        met += compare_packets(name, triangles, &rays);
    }
    met
}

/// Axis-aligned squares of a lattice in [-1, 1]^3, many of them seen edge-on from lattice points.
fn grid(count: usize) -> Vec<[Vec3; 3]> {
    let mut rng = generator("grid");
    let mut all = Vec::new();
    for i in 0..count * count {
        let at = (in_box(&mut rng, 1.0) * 4.0).round() / 4.0;
        let (u, v) = (DVec3::AXES[i % 3] * 0.25, DVec3::AXES[(i + 1) % 3] * 0.25);
        all.extend([[at, at + u, at + v], [at + u, at + u + v, at + v]].map(|t| t.map(|p| p.as_vec3())));
    }
    all
}
