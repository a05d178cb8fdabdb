//! What is certain without the series is what the series says: samples and their errors, bounds, cones.

use super::beside::Beside;
use super::{Harmonic, Series, Star};
use crate::geometry::{Geometry, Mesh, Ray};
use crate::math::{DMat3, DVec3};
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
            let (guess, errors) = star.samples.height(x, d);
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
fn nothing_of_the_object_stands_in_the_cone_of_a_point() {
    let mut rng = generator("cones");
    for degree in [0, 8, 24] {
        let star = Star::new(rough(degree, &mut rng)).unwrap();
        let turned = DMat3::from_cols(DVec3::new(0.6, 0.8, 0.0), DVec3::new(0.8, -0.6, 0.0), DVec3::Z) * 0.3;
        let object = Harmonic::new(star, DVec3::new(0.2, 0.1, -0.4), turned).unwrap();
        let geometry = Geometry::new(Mesh::new(&[]), Vec::new(), Vec::new()).with_harmonics(vec![object.clone()]);
        let (mut widest, mut in_cones) = (1.0f64, 0);
        for _ in 0..400 {
            let (at, normal, _) = object.point(sphere(rng.uniform2()));
            let origin = geometry.lift(at, normal);
            let Beside { free, inside, .. } = geometry.harmonics()[0].beside(origin);
            let cone = free.expect("a point just outside of an object that keeps its shape");
            assert!(!inside && cone.axis.dot(normal) > 0.999);
            widest = widest.min(cone.cosine);
            for _ in 0..40 {
                let direction = sphere(rng.uniform2());
                if cone.holds(direction) {
                    in_cones += 1;
                    assert_eq!(
                        object.first_crossing(&Ray { origin, direction }),
                        None,
                        "{origin} {direction} {cone:?}"
                    );
                }
            }
        }
        assert!(widest < 0.6 && in_cones > 1000, "degree {degree}: cosine {widest}, {in_cones} directions");
    }
}
