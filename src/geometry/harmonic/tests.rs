//! What is certain without the series is what the series says: samples and their errors, bounds, what is clear.

use super::lattice::Lattice;
use super::outline::Sort;
use super::roots::Wave;
use super::samples::Guess;
use super::{Harmonic, Series, Star};
use crate::geometry::simd::Path;
use crate::geometry::visibility::{BUNDLE, BUNDLES, Points, TILE};
use crate::geometry::{Geometry, Mesh, Ray};
use crate::math::{DMat3, DVec3, sin_cos};
use crate::random::{Domain, Generator, Stream, sphere};

fn generator(name: &str) -> Generator {
    Stream::new(5, Domain::Trajectory, name).generator(0)
}

/// A series of `degree` around 1 whose coefficients fall with the degree.
fn rough(degree: usize, rng: &mut Generator) -> Series {
    let mut pairs = vec![[1.0, 0.0]];
    for k in 1..=degree {
        for m in 0..=k {
            let size = 0.25 / ((1 + k) * (1 + k)) as f64;
            let mut draw = || size * (2.0 * rng.uniform() - 1.0);
            pairs.push([draw(), if m == 0 { 0.0 } else { draw() }]);
        }
    }
    Series::new(&pairs).unwrap()
}

#[test]
fn samples_are_no_farther_from_the_series_than_they_say() {
    let mut rng = generator("samples");
    for degree in [0, 3, 12, 40] {
        let star = Star::new(rough(degree, &mut rng)).unwrap();
        let mut nearest = 0f64;
        for _ in 0..4000 {
            let (n, d) = (sphere(rng.uniform2()), sphere(rng.uniform2()));
            let x = n * star.bounds.high * (0.8 + 0.4 * rng.uniform());
            let Guess { along: guess, errors, .. } = star.samples.height(x, d);
            let truth = star.height(x, d).along;
            for (guess, error, truth) in [
                (guess.value, errors.value, truth.value),
                (guess.first, errors.first, truth.first),
                (guess.second, errors.second, truth.second),
            ] {
                assert!((guess - truth).abs() <= error, "{guess} +- {error} {truth}, degree {degree}");
            }
            let (value, error) = star.samples.value(n);
            assert!((value - star.series.value(n)).abs() <= error);
            nearest = nearest.max((guess.value - truth.value).abs() / errors.value);
        }
        // The error is no idle number: where there is something to interpolate some samples come near it.
        assert!(degree < 12 || nearest > 0.05, "{nearest}, degree {degree}");
    }
}

#[test]
fn no_derivative_along_a_great_circle_exceeds_its_bound() {
    let mut rng = generator("bounds");
    let star = Star::new(rough(32, &mut rng)).unwrap();
    let bounds = star.bounds;
    let mut most = [0f64; 2];
    for _ in 0..20_000 {
        let n = sphere(rng.uniform2());
        let bend = star.series.bend(n);
        let (high, low) = super::bends(&bend, n);
        most = [most[0].max(bend.slope(n).gradient.length()), most[1].max(high.max(-low))];
        assert!(bounds.low <= bend.value && bend.value <= bounds.high);
    }
    for (most, bound) in most.into_iter().zip([bounds.first, bounds.second]) {
        assert!(most <= bound && bound < 1.25 * most, "{most} {bound}");
    }
}

#[test]
fn directions_that_share_what_depends_on_z_have_the_bits_of_each_alone() {
    let mut rng = generator("round");
    for degree in [0, 3, 21] {
        let series = rough(degree, &mut rng);
        let n = sphere(rng.uniform2());
        let quarter = |n: DVec3| [n, -n, DVec3::new(-n.x, n.y, n.z), DVec3::new(n.x, -n.y, n.z)].map(|m| m.with_z(n.z));
        let round: [DVec3; 8] = [quarter(n), quarter(DVec3::new(n.y, n.x, n.z))].concat().try_into().unwrap();
        let bends = series.round(&round);
        assert!(bends.iter().zip(round).all(|(bend, n)| *bend == series.bend(n)), "degree {degree}");
    }
}

#[test]
fn rounds_are_all_points_of_a_lattice() {
    for cells in [1, 2, 5, 8] {
        let lattice = Lattice::new(cells);
        let mut all: Vec<[usize; 3]> = lattice.rounds().flat_map(|one| lattice.round(one)).collect();
        all.sort_unstable();
        all.dedup();
        assert!(all.iter().copied().eq(lattice.points()), "{cells}");
        let faces: Vec<[usize; 3]> = all.iter().flat_map(|&point| lattice.faces(point)).collect();
        assert!(faces.len() == lattice.number([6, 0, 0]), "{cells}");
        for one in lattice.rounds() {
            let like = |n: DVec3| (n.z, n.x * n.x + n.y * n.y);
            assert!(lattice.round(one).iter().all(|&p| like(lattice.direction(p)) == like(lattice.direction(one))));
            assert!(lattice.faces(one).all(|face| lattice.on_face(face) == one));
        }
    }
}

#[test]
fn third_derivatives_around_a_place_are_no_greater_than_they_say() {
    let mut rng = generator("regions");
    let star = Star::new(rough(24, &mut rng)).unwrap();
    let (mut tightest, mut loosest) = (0f64, f64::INFINITY);
    for _ in 0..4000 {
        let (n, way) = (sphere(rng.uniform2()), sphere(rng.uniform2()));
        let around = *star.samples.look(n).around;
        // Anywhere as far as it holds, by differences of second derivatives along a great circle.
        let tangent = n.cross(way).normalize();
        let angle = 0.99 * star.samples.reach() * rng.uniform();
        let at = |angle: f64| {
            let (s, c) = sin_cos(angle);
            let (there, along) = (c * n + s * tangent, c * tangent - s * n);
            let bend = star.series.bend(there);
            along.dot(bend.hessian * along) - bend.g.dot(there)
        };
        let third = (at(angle + 1e-4) - at(angle - 1e-4)) / 2e-4;
        assert!(third.abs() <= around.third && at(angle).abs() <= around.second, "{third} {around:?}");
        tightest = tightest.max(third.abs() / around.third);
        loosest = loosest.min(around.third / star.bounds.third);
    }
    // Near the bound somewhere, and far below the one that holds everywhere somewhere.
    assert!(tightest > 0.3 && loosest < 0.7, "{tightest} {loosest}");
}

#[test]
fn the_share_of_a_way_that_is_called_clear_meets_nothing() {
    let mut rng = generator("rises");
    for degree in [0, 8, 24] {
        let star = Star::new(rough(degree, &mut rng)).unwrap();
        // Turned and stretched unevenly.
        let turned = DMat3::from_cols(DVec3::new(0.6, 0.8, 0.0), DVec3::new(0.8, -0.6, 0.0), DVec3::Z * 1.3) * 0.3;
        let object = Harmonic::new(star, DVec3::new(0.2, 0.1, -0.4), turned).unwrap();
        let geometry = Geometry::new(Mesh::new(&[]), Vec::new(), Vec::new()).with_harmonics(vec![object.clone()]);
        let (mut whole, mut rising, mut endless) = (0.0, 0, 0);
        for _ in 0..400 {
            let (at, normal, _) = object.point(sphere(rng.uniform2()));
            let origin = geometry.lift(at, normal);
            let beside = geometry.harmonics()[0].beside(origin);
            assert!(beside.near && !beside.inside);
            for _ in 0..20 {
                let direction = sphere(rng.uniform2());
                let met = object.first_crossing(&Ray { origin, direction });
                let clear = beside.clear(direction.as_vec3()).map(f64::from);
                endless += usize::from(clear.is_none());
                assert!(clear.is_some() || met.is_none(), "{origin} {direction}: above all, and {met:?}");
                let clear = clear.unwrap_or(1.0);
                assert!(met.is_none_or(|met| met >= clear), "{origin} {direction}: {clear} {met:?}");
                if direction.dot(normal) > 0.1 {
                    (whole, rising) = (whole + clear, rising + 1);
                }
            }
        }
        assert!(whole > 0.01 * f64::from(rising), "degree {degree}: {whole} of {rising}");
        // Half of all directions rise; a ball is below all of its tangent planes.
        assert!(endless > if degree == 0 { 3000 } else { 20 }, "degree {degree}: {endless} of 8000");
    }
}

#[test]
fn exact_roots_are_where_steps_lead() {
    let mut rng = generator("roots");
    let star = Star::new(rough(24, &mut rng)).unwrap();
    let (mut met, mut missed) = (0, 0);
    for i in 0..20_000 {
        // Half of them graze: beside a tangent by up to a thousandth of the radius.
        let (n0, d) = (sphere(rng.uniform2()), sphere(rng.uniform2()));
        let (normal, _) = star.normal_and_area(n0);
        let d = if i % 2 == 0 { d } else { d.reject_from(normal).normalize() };
        let beside = n0 * star.series.value(n0) + normal * 1e-3 * (2.0 * rng.uniform() - 1.0);
        let o = beside - 3.0 * d;
        let wave = Wave::new(&star.series, o, d, 1.0);
        match (wave.first(0.0, 6.0), star.first_crossing(o, d, 6.0)) {
            (Some(at), Some(crossing)) => {
                // A crossing is known as well as F is, over its slope.
                let slope = star.height(o + at * d, d).along.first.abs();
                assert!((at - crossing.distance).abs() * slope < 1e-12, "{at} {}", crossing.distance);
                let on = 1e-11 + 1e-12 / slope;
                assert!(
                    star.is_crossed(o, d, crossing.distance + on) && !star.is_crossed(o, d, crossing.distance - on)
                );
                met += 1;
            }
            (None, None) => {
                assert!(!star.is_crossed(o, d, 6.0));
                missed += 1;
            }
            (root, crossing) => panic!("{root:?} by roots, {crossing:?} by steps"),
        }
    }
    assert!(met > 5000 && missed > 2000, "{met} met, {missed} missed");
}

#[test]
fn exact_roots_from_within_lead_out() {
    let mut rng = generator("within");
    let star = Star::new(rough(16, &mut rng)).unwrap();
    for _ in 0..5000 {
        let (n, d) = (sphere(rng.uniform2()), sphere(rng.uniform2()));
        let o = n * star.series.value(n) * (0.1 + 0.89 * rng.uniform());
        let crossing = star.first_crossing(o, d, 6.0).unwrap();
        let root = Wave::new(&star.series, o, d, -1.0).first(0.0, 6.0).unwrap();
        assert!((root - crossing.distance).abs() < 1e-9, "{root} {}", crossing.distance);
    }
}

#[test]
fn an_outline_tells_of_nearly_all_points_and_never_wrongly() {
    let mut rng = generator("outlines");
    for (degree, uneven) in [(0, 1.0), (4, 1.0), (8, 1.0), (24, 1.0), (8, 1.3), (24, 1.3)] {
        let star = Star::new(rough(degree, &mut rng)).unwrap();
        let turned = DMat3::from_cols(DVec3::new(0.6, 0.8, 0.0), DVec3::new(0.8, -0.6, 0.0), DVec3::Z * uneven) * 0.3;
        let object = Harmonic::new(star, DVec3::new(0.2, 0.1, -0.4), turned).unwrap();
        let corners = DVec3::splat(30.0);
        let object = object.shelled((-corners, corners));
        let (center, radius, _) = object.around();
        let (mut known, mut missed, mut met, mut all, mut near) = (0, 0, 0, 0, 0);
        for i in 0..90 {
            // From just outside to fifty radii away, and so near that the nets may be around; points on a disc beyond the object, and anywhere around.
            let is_far = i % 3 > 0;
            let share = rng.uniform() * rng.uniform() * rng.uniform();
            let distance = if is_far { 1.011 + 50.0 * share } else { 1.0001 + 0.1 * share };
            let apex = center + sphere(rng.uniform2()) * radius * distance;
            let point = |k: usize, rng: &mut Generator| match k % 2 {
                0 => 2.0 * center - apex + 4.0 * radius * sphere(rng.uniform2()),
                _ => center + 3.0 * radius * rng.uniform() * sphere(rng.uniform2()),
            };
            let apex = apex.as_vec3();
            let points: Vec<_> = (0..TILE).map(|k| point(k, &mut rng).as_vec3()).collect();
            let Some(outline) = object.outline(apex) else {
                near += usize::from(is_far);
                continue;
            };
            let tile = Points::new(&Geometry::default(), &points);
            let sort = || Sort { outline: &outline, apex, ends: &tile.ends, asked: &[u16::MAX; BUNDLES] };
            let sorted = Path::Scalar.run(sort());
            for path in Path::ALL.into_iter().filter(|path| path.is_available()) {
                assert_eq!(path.run(sort()), sorted, "{path:?}");
            }
            for (k, p) in points.iter().enumerate().filter(|(_, p)| !object.contains(p.as_dvec3())) {
                let way = (p - apex).as_dvec3();
                let ray = Ray { origin: apex.as_dvec3(), direction: way.normalize() };
                let is_met = object.first_crossing(&ray).is_some_and(|at| at < way.length());
                let [free, blocked] = [&sorted.0, &sorted.1].map(|lanes| lanes[k / BUNDLE] >> (k % BUNDLE) & 1 == 1);
                assert!(if is_met { !free } else { !blocked }, "{apex} {p}: {free} {blocked} {is_met}");
                (all, known) = (all + 1, known + usize::from(free || blocked));
                (missed, met) = (missed + usize::from(free), met + usize::from(blocked));
            }
        }
        assert!(near < 15, "degree {degree}: {near} of 60 too near");
        assert!(
            10 * known > 8 * all && 20 * missed > all && 20 * met > all,
            "degree {degree}: {missed} {met} of {all}"
        );
    }
}
