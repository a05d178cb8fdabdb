//! The visibility kernel on every path against brute force in f64: the same masks bit for bit, whatever the geometry, the
//! tile and the apex; and closed surfaces through which nothing passes.

mod common;

use common::scenes::bumpy_sphere;
use lampyris::geometry::simd::Path;
use lampyris::geometry::visibility::{BUNDLE, BUNDLES, Lanes, Points, Scratch, TILE};
use lampyris::geometry::{Geometry, Mesh, Plane, Sphere, kd_order};
use lampyris::math::{DMat3, DVec3, Vec3, cbrt, pow};
use lampyris::random::{Domain, Generator, Stream, sphere};

type Triangle = [Vec3; 3];

fn generator(name: &str) -> Generator {
    Stream::new(67, Domain::Receiver, name).generator(0)
}

/// Uniform in the cube of half side `half`.
fn in_cube(rng: &mut Generator, half: f64) -> DVec3 {
    let mut coordinate = || half * (2.0 * rng.uniform() - 1.0);
    DVec3::new(coordinate(), coordinate(), coordinate())
}

/// A number whose magnitude is any between the two, logarithmically uniform.
fn magnitude(rng: &mut Generator, least: f64, most: f64) -> f64 {
    least * pow(most / least, rng.uniform())
}

fn choose<'a, T>(rng: &mut Generator, from: &'a [T]) -> &'a T {
    &from[rng.below(from.len() as u32) as usize]
}

// ---------------------------------------------------------------------------------------------- brute force

/// All surfaces, asked one after the other in f64.
struct Brute {
    triangles: Vec<Triangle>,
    /// Point and unit normal.
    planes: Vec<(DVec3, DVec3)>,
    spheres: Vec<Sphere>,
    /// Where segments are asked whole: what lies outside is cut off and rounded to f32 again.
    near: (DVec3, DVec3),
}

impl Brute {
    fn new(triangles: &[Triangle], planes: &[(DVec3, DVec3)], spheres: &[Sphere]) -> Brute {
        let corners = || triangles.iter().flatten().map(|p| p.as_dvec3());
        let low = corners().fold(DVec3::INFINITY, DVec3::min);
        let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        let around = 0.01 * (high - low).max_element();
        let planes = planes.iter().map(|&(point, normal)| (point, normal.normalize())).collect();
        Brute { triangles: triangles.to_vec(), planes, spheres: spheres.to_vec(), near: (low - around, high + around) }
    }

    fn is_near(&self, p: Vec3) -> bool {
        let p = p.as_dvec3();
        p.cmpge(self.near.0).all() && p.cmple(self.near.1).all()
    }

    /// The part of the segment near the triangles.
    fn clip(&self, a: Vec3, b: Vec3) -> Option<(Vec3, Vec3)> {
        if self.is_near(a) && self.is_near(b) {
            return Some((a, b));
        }
        let (o, d) = (a.as_dvec3(), b.as_dvec3() - a.as_dvec3());
        let (mut enter, mut leave) = (0.0f64, 1.0f64);
        for axis in 0..3 {
            let (low, high) = ((self.near.0[axis] - o[axis]) / d[axis], (self.near.1[axis] - o[axis]) / d[axis]);
            enter = enter.max(low.min(high));
            leave = leave.min(low.max(high));
        }
        (enter <= leave).then_some(((o + enter * d).as_vec3(), (o + leave * d).as_vec3()))
    }

    fn sees(&self, a: Vec3, b: Vec3) -> bool {
        let through_triangles = !self.triangles.is_empty()
            && self.clip(a, b).is_some_and(|(a, b)| {
                let d = (b - a).as_dvec3();
                self.triangles.iter().any(|t| crosses(t, a.as_dvec3(), d))
            });
        let (a, b) = (a.as_dvec3(), b.as_dvec3());
        let through_planes = self.planes.iter().any(|&(p, n)| {
            let (a, b) = (n.dot(a - p), n.dot(b - p));
            (a < 0.0 && b > 0.0) || (a > 0.0 && b < 0.0)
        });
        !through_triangles && !through_planes && !self.spheres.iter().any(|s| crosses_sphere(s, a, b))
    }
}

/// True when the segment from `o` along `d` crosses the triangle, edges included and ends excluded; where only roundings say
/// so, the crossing must lie in the triangle's box.
fn crosses(triangle: &Triangle, o: DVec3, d: DVec3) -> bool {
    let [a, b, c] = triangle.map(|p| p.as_dvec3());
    let normal = (b - a).cross(c - a);
    let t = (normal.dot(a) - normal.dot(o)) / normal.dot(d);
    if !(t > 0.0 && t < 1.0) {
        return false;
    }
    let (a, b, c) = (a - o, b - o, c - o);
    let edges = [d.dot(c.cross(b)), d.dot(a.cross(c)), d.dot(b.cross(a))];
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    let around = low.abs().max(high.abs()).max_element() * 4.0 / f64::from(1 << 24);
    let within = (t * d).cmpge(low - around).all() && (t * d).cmple(high + around).all();
    within && (edges.iter().all(|&e| e >= 0.0) || edges.iter().all(|&e| e <= 0.0))
}

fn crosses_sphere(s: &Sphere, a: DVec3, b: DVec3) -> bool {
    let (a, b) = (a - s.center, b - s.center);
    let inside = |p: DVec3| p.length_squared() < s.radius * s.radius;
    if inside(a) || inside(b) {
        return inside(a) != inside(b);
    }
    let d = b - a;
    inside(a + (-a.dot(d) / d.length_squared()).clamp(0.0, 1.0) * d)
}

// ------------------------------------------------------------------------------------------------ the kernel

fn available() -> impl Iterator<Item = Path> {
    Path::ALL.into_iter().filter(|p| p.is_available())
}

/// The bits of the points for which `is` holds.
fn lanes(points: &[Vec3], mut is: impl FnMut(Vec3) -> bool) -> Lanes {
    let mut lanes = [0; BUNDLES];
    for (i, &point) in points.iter().enumerate() {
        lanes[i / BUNDLE] |= u16::from(is(point)) << (i % BUNDLE);
    }
    lanes
}

/// Asks every path about the points of one tile, of which `asked` are wanted.
#[track_caller]
fn compare(name: &str, geometry: Geometry, brute: &Brute, apex: Vec3, points: &[Vec3], asked: Lanes) -> Geometry {
    let mut expected = lanes(points, |p| brute.sees(apex, p));
    expected.iter_mut().zip(asked).for_each(|(e, a)| *e &= a);
    let mut geometry = geometry;
    for path in available() {
        geometry = geometry.with_path(path);
        let tile = Points::new(&geometry, points);
        let mut seen = asked;
        geometry.hide(&geometry.apex(apex), &tile, &mut seen, &mut Scratch::default());
        for (i, &point) in points.iter().enumerate() {
            let bit = |lanes: &Lanes| lanes[i / BUNDLE] >> (i % BUNDLE) & 1;
            let which = format!("{name}, {path:?}: point {i} of {}: {apex:?} to {point:?}", points.len());
            assert_eq!(bit(&seen), bit(&expected), "{which}");
        }
        assert_eq!(seen, expected, "{name}, {path:?}: lanes without points");
    }
    geometry
}

// ---------------------------------------------------------------------------------------------- the geometry

/// Triangles of all sizes in the cube of half side 2.
fn soup(name: &str, count: usize) -> Vec<Triangle> {
    let mut rng = generator(name);
    let triangle = |i: usize| {
        let corner = in_cube(&mut rng, 2.0);
        let size = [1.0, 0.1, 0.01][i % 3];
        let (u, v) = (in_cube(&mut rng, size), in_cube(&mut rng, size));
        [corner, corner + u, corner + v].map(|p| p.as_vec3())
    };
    (0..count).map(triangle).collect()
}

/// Long triangles, down to no width at all.
fn slivers() -> Vec<Triangle> {
    let mut rng = generator("slivers");
    let triangle = |_| {
        let corner = in_cube(&mut rng, 2.0);
        let along = in_cube(&mut rng, 2.0);
        let width = magnitude(&mut rng, 1e-9, 1e-2);
        let third = corner + along * (1.4 * rng.uniform() - 0.2) + in_cube(&mut rng, width);
        [corner, corner + along, third].map(|p| p.as_vec3())
    };
    (0..300).map(triangle).collect()
}

/// Triangles on a coarse lattice, parallel to a pair of axes, many of them in one plane or on top of each other.
fn axis_aligned() -> Vec<Triangle> {
    let mut rng = generator("axis-aligned");
    let triangle = |i: usize| {
        let mut corner = || DVec3::from_array([0; 3].map(|_| f64::from(rng.below(17)) / 4.0 - 2.0));
        let [a, mut b, mut c] = [corner(), corner(), corner()];
        (b[i % 3], c[i % 3]) = (a[i % 3], a[i % 3]);
        [a, b, c].map(|p| p.as_vec3())
    };
    (0..300).map(triangle).collect()
}

/// Lattices in three inclined planes: neighbours share corners, but planes agree to rounding only.
fn coplanar() -> Vec<Triangle> {
    let mut rng = generator("coplanar");
    let mut all = Vec::new();
    for _ in 0..3 {
        let (corner, u, v) = (in_cube(&mut rng, 1.0), in_cube(&mut rng, 0.3), in_cube(&mut rng, 0.3));
        let at = |i: i32, j: i32| (corner + f64::from(i) * u + f64::from(j) * v).as_vec3();
        for (i, j) in (-3..3).flat_map(|i| (-3..3).map(move |j| (i, j))) {
            all.extend([[at(i, j), at(i + 1, j), at(i, j + 1)], [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]]);
        }
    }
    all
}

/// The same with steps of few bits: the corners of a plane lie in it exactly.
fn exactly_coplanar() -> Vec<Triangle> {
    let mut rng = generator("exactly coplanar");
    let mut all = Vec::new();
    for _ in 0..3 {
        let mut step = |half| (in_cube(&mut rng, half) * 1048576.0).round() / 1048576.0;
        let (corner, u, v) = (step(1.0), step(0.3), step(0.3));
        let at = |i: i32, j: i32| (corner + f64::from(i) * u + f64::from(j) * v).as_vec3();
        for (i, j) in (-3..3).flat_map(|i| (-3..3).map(move |j| (i, j))) {
            all.extend([[at(i, j), at(i + 1, j), at(i, j + 1)], [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]]);
        }
    }
    all
}

/// Triangles that are lines and points.
fn degenerate() -> Vec<Triangle> {
    let mut all = soup("degenerate", 90);
    for (i, t) in all.iter_mut().enumerate() {
        match i % 3 {
            0 => t[1] = t[0],
            1 => t[2] = t[0] + 2.0 * (t[1] - t[0]),
            _ => *t = [t[0]; 3],
        }
    }
    all
}

/// The closed box of half sides `half`.
fn room(half: DVec3) -> Vec<Triangle> {
    let corner = |i: usize| {
        let side = |axis: usize| if i >> axis & 1 == 1 { half[axis] } else { -half[axis] };
        DVec3::new(side(0), side(1), side(2)).as_vec3()
    };
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let halves = |[a, b, c, d]: [usize; 4]| [[a, b, c], [a, c, d]].map(|t| t.map(corner));
    faces.into_iter().flat_map(halves).collect()
}

fn moved(triangles: Vec<Triangle>, scale: f64, shift: DVec3) -> Vec<Triangle> {
    let place = |p: Vec3| (p.as_dvec3() * scale + shift).as_vec3();
    triangles.into_iter().map(|t| t.map(place)).collect()
}

fn rotated(triangles: Vec<Triangle>) -> Vec<Triangle> {
    let rotation = DMat3::from_axis_angle(DVec3::new(2.0, -3.0, 6.0) / 7.0, 0.7);
    triangles.into_iter().map(|t| t.map(|p| (rotation * p.as_dvec3()).as_vec3())).collect()
}

// -------------------------------------------------------------------------------------------------- the points

/// Where to take an apex and points from.
struct Places<'a> {
    triangles: &'a [Triangle],
    middle: DVec3,
    /// Half the side of a cube around everything \[m\].
    half: f64,
}

impl Places<'_> {
    fn new(triangles: &[Triangle]) -> Places<'_> {
        let corners = || triangles.iter().flatten().map(|p| p.as_dvec3());
        let low = corners().fold(DVec3::INFINITY, DVec3::min);
        let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        Places { triangles, middle: 0.5 * (low + high), half: 0.5 * (high - low).max_element() }
    }

    /// Some place that is hard for one of the triangles.
    fn any(&self, rng: &mut Generator) -> Vec3 {
        let [a, b, c] = choose(rng, self.triangles).map(|p| p.as_dvec3());
        let (u, v) = (2.0 * rng.uniform() - 0.5, 2.0 * rng.uniform() - 0.5);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let place = match rng.below(10) {
            0..3 => self.middle + in_cube(rng, 0.99 * self.half),
            // Beyond what is near.
            3 => self.middle + in_cube(rng, 3.0 * self.half),
            4 => a,
            5 => a + (b - a) * u,
            // In the plane of the triangle, and a little above.
            6 => a + u * (b - a) + v * (c - a),
            7 => a + 2.0 * (b - a) + 3.0 * (c - a),
            _ => {
                let height = self.half * magnitude(rng, 1e-9, 1e-2) * [1.0, -1.0][rng.below(2) as usize];
                a + u * (b - a) + v * (c - a) + height * normal
            }
        };
        place.as_vec3()
    }

    /// A point that `apex` sees exactly on, or across, an edge or a corner.
    fn behind(&self, rng: &mut Generator, apex: Vec3) -> Vec3 {
        let [a, b, _] = choose(rng, self.triangles).map(|p| p.as_dvec3());
        let on = [a, a + (b - a) * rng.uniform(), 0.5 * (a + b)][rng.below(3) as usize].as_vec3();
        let times = [1.0, 2.0, 1.5, 1.0 + magnitude(rng, 1e-7, 1.0) as f32][rng.below(4) as usize];
        apex + (on - apex) * times
    }

    /// Points of a tile: some number, close together or not, in an order that makes tight bundles or not.
    fn tile(&self, rng: &mut Generator, apex: Vec3) -> Vec<Vec3> {
        let count = [1, 2, 15, 16, 17, 64, 100, 255, TILE][rng.below(9) as usize];
        let spread = self.half * magnitude(rng, 1e-7, 1.0);
        let middle = self.any(rng);
        let kind = rng.below(4);
        let point = |rng: &mut Generator| match kind {
            0 => self.any(rng),
            1 => self.behind(rng, apex),
            2 if rng.below(4) == 0 => self.behind(rng, apex),
            _ => (middle.as_dvec3() + in_cube(rng, spread)).as_vec3(),
        };
        let points: Vec<Vec3> = (0..count).map(|_| point(rng)).collect();
        if rng.below(2) == 0 {
            return points;
        }
        let places: Vec<DVec3> = points.iter().map(|p| p.as_dvec3()).collect();
        kd_order(&places).into_iter().map(|i| points[i as usize]).collect()
    }
}

#[track_caller]
fn check(name: &str, triangles: Vec<Triangle>, tiles: usize) {
    let mut rng = generator(name);
    let brute = Brute::new(&triangles, &[], &[]);
    let mut geometry = Geometry::new(Mesh::new(&triangles), Vec::new(), Vec::new());
    let places = Places::new(&triangles);
    for _ in 0..tiles {
        let apex = places.any(&mut rng);
        let points = places.tile(&mut rng, apex);
        let some = rng.below(3) == 0;
        let asked = lanes(&points, |_| !some || rng.below(2) == 0);
        geometry = compare(name, geometry, &brute, apex, &points, asked);
    }
}

#[test]
fn masks_are_those_of_brute_force_on_random_geometry() {
    check("soup", soup("soup", 400), 400);
    for count in [1, 2, 7, 8, 9, 65] {
        check("few", soup("few", count), 200);
    }
    check("slivers", slivers(), 500);
    check("degenerate", degenerate(), 200);
}

#[test]
fn masks_are_those_of_brute_force_on_planes_in_common() {
    check("axis-aligned", axis_aligned(), 500);
    check("rotated", rotated(axis_aligned()), 500);
    check("coplanar", coplanar(), 500);
    check("exactly coplanar", exactly_coplanar(), 4000);
}

#[test]
fn masks_are_those_of_brute_force_on_touching_triangles() {
    check("bumpy", bumpy_sphere(3), 300);
    check("room", room(DVec3::new(3.0, 1.5, 2.0)), 500);
    check("rotated room", rotated(room(DVec3::new(3.0, 1.5, 2.0))), 500);
    let nested: Vec<_> = (1..20).flat_map(|i| room(DVec3::splat(f64::from(i) * 0.1))).collect();
    check("nested rooms", nested, 300);
}

#[test]
fn masks_are_those_of_brute_force_far_out_and_at_large_and_small_scale() {
    let far = DVec3::new(1000.0, 1000.0, -1000.0);
    for (name, triangles) in [("soup", soup("soup", 200)), ("slivers", slivers()), ("bumpy", bumpy_sphere(2))] {
        check(&format!("{name} far out"), moved(triangles.clone(), 1.0, far), 200);
        check(&format!("{name} of kilometres"), moved(triangles.clone(), 1000.0, DVec3::ZERO), 200);
        check(&format!("{name} of micrometres"), moved(triangles, 1e-6, DVec3::ZERO), 200);
    }
}

#[test]
fn planes_and_spheres_take_part() {
    let mut rng = generator("planes and spheres");
    let triangles = soup("planes and spheres", 50);
    let all = [
        (triangles, vec![(DVec3::new(0.0, 0.3, 0.0), DVec3::Y)], vec![]),
        (vec![], vec![(in_cube(&mut rng, 1.0), in_cube(&mut rng, 1.0)), (DVec3::ZERO, DVec3::Z)], vec![]),
        (soup("more", 50), vec![], vec![DVec3::ZERO, DVec3::new(1.0, 0.5, -1.0)]),
        (soup("most", 30), vec![(in_cube(&mut rng, 1.0), in_cube(&mut rng, 1.0))], vec![in_cube(&mut rng, 1.0)]),
        (vec![], vec![], vec![DVec3::ZERO]),
    ];
    for (i, (triangles, planes, centers)) in all.into_iter().enumerate() {
        let ball = |center: &DVec3| Sphere { center: *center, radius: 0.7, inward: i == 4 };
        let spheres: Vec<Sphere> = centers.iter().map(ball).collect();
        let brute = Brute::new(&triangles, &planes, &spheres);
        let made = planes.iter().map(|&(p, n)| Plane::new(p, n)).collect();
        let mut geometry = Geometry::new(Mesh::new(&triangles), spheres, made);
        for _ in 0..200 {
            let apex = in_cube(&mut rng, 2.5).as_vec3();
            let (middle, spread) = (in_cube(&mut rng, 2.0), magnitude(&mut rng, 1e-3, 3.0));
            let count = rng.below(TILE as u32) as usize + 1;
            let mut points: Vec<Vec3> = (0..count).map(|_| (middle + in_cube(&mut rng, spread)).as_vec3()).collect();
            // Exactly on surfaces.
            points[0] = planes.first().map_or(points[0], |p| p.0.as_vec3());
            points[count / 2] = centers.first().map_or(points[count / 2], |c| (*c + 0.7 * DVec3::X).as_vec3());
            let asked = lanes(&points, |_| true);
            geometry = compare(&format!("planes and spheres {i}"), geometry, &brute, apex, &points, asked);
        }
    }
}

// ------------------------------------------------------------------------------------------------------ leaks

/// A closed surface around the origin that lies between two radii: what it encloses and what it keeps out.
struct Closed {
    name: &'static str,
    triangles: Vec<Triangle>,
    /// Points nearer to the origin are inside \[m\].
    inside: f64,
    /// Points farther away are outside \[m\].
    outside: f64,
}

/// Every segment from inside to outside is blocked, tile after tile, those through edges and corners among them.
fn keeps_in(closed: &Closed, tiles: usize) {
    let Closed { name, triangles, inside, outside } = closed;
    // Specks far away, so that points outside are near the mesh and asked by the kernel, not one by one.
    let speck = |at: DVec3| [at, at + 1e-5 * DVec3::X, at + 1e-5 * DVec3::Y].map(|p| p.as_vec3());
    let around = 3.0 * outside * DVec3::new(1.0, 0.99, 0.98);
    let all: Vec<Triangle> = triangles.iter().copied().chain([speck(around), speck(-around)]).collect();
    let mut geometry = Geometry::new(Mesh::new(&all), Vec::new(), Vec::new());
    let mut rng = generator(name);
    for i in 0..tiles {
        let apex = (inside * cbrt(rng.uniform()) * sphere(rng.uniform2())).as_vec3();
        let one = *choose(&mut rng, triangles);
        let point = |rng: &mut Generator| {
            let [a, b, c] = if i % 2 == 0 { one } else { *choose(rng, triangles) }.map(|p| p.as_dvec3());
            let (u, v) = (rng.uniform(), rng.uniform());
            let target = [a, a + (b - a) * u, 0.5 * (a + b), a + (b - a) * (0.5 * u) + (c - a) * (0.5 * v)];
            let away = choose(rng, &target).as_vec3() - apex;
            apex + away * ((outside * (1.001 + rng.uniform()) + inside) as f32 / away.length())
        };
        let points: Vec<Vec3> = (0..TILE).map(|_| point(&mut rng)).collect();
        assert!(points.iter().all(|p| p.as_dvec3().length() > *outside));
        for path in available() {
            geometry = geometry.with_path(path);
            let tile = Points::new(&geometry, &points);
            let mut seen: Lanes = [u16::MAX; BUNDLES];
            geometry.hide(&geometry.apex(apex), &tile, &mut seen, &mut Scratch::default());
            assert_eq!(seen, [0; BUNDLES], "{name}, {path:?}: tile {i} leaks from {apex}");
        }
    }
}

#[test]
fn closed_surfaces_leak_nothing() {
    let half = DVec3::new(3.0, 1.5, 2.0);
    let closed = [
        Closed { name: "room", triangles: room(half), inside: 1.5, outside: half.length() },
        Closed { name: "rotated room", triangles: rotated(room(half)), inside: 1.5, outside: half.length() },
        Closed { name: "bumpy", triangles: bumpy_sphere(5), inside: 0.7, outside: 1.3 },
        Closed { name: "cube", triangles: room(DVec3::splat(0.1)), inside: 0.1, outside: 0.18 },
    ];
    for closed in &closed {
        keeps_in(closed, 1000);
    }
}
