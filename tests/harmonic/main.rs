//! Spherical harmonics and the surfaces made of them: numbers of the reference table, identities, the paper's own
//! formulas, and first hits against an oracle that finds all roots.

mod lines;
mod normals;
mod objects;
mod oracle;
mod paper;
mod shells;

use lampyris::geometry::harmonic::{Bounds, Series, Star, basis, projection};
use lampyris::math::{DVec3, PI, sin_cos};
use lampyris::random::{Domain, Generator, Stream, sphere};
use lines::Verdict;
use std::collections::BTreeMap;

/// The reference table: kind, parameters, quantity, value.
fn rows(kind: &str) -> impl Iterator<Item = (&'static str, &'static str, &'static str)> {
    let all = include_str!("sh_reference.csv").lines().skip(1).map(|line| {
        let mut fields = line.splitn(4, ',');
        let mut next = || fields.next().expect("four fields");
        (next(), (next(), next(), next()))
    });
    all.filter_map(move |(of, rest)| (of == kind).then_some(rest))
}

/// `name=value` pairs between semicolons.
fn parameters(text: &str) -> BTreeMap<&str, &str> {
    text.split(';').map(|pair| pair.split_once('=').expect("name=value")).collect()
}

fn direction(theta: f64, phi: f64) -> DVec3 {
    let ((s, c), (sin, cos)) = (sin_cos(theta), sin_cos(phi));
    DVec3::new(s * cos, s * sin, c)
}

fn generator(name: &str) -> Generator {
    Stream::new(11, Domain::Trajectory, name).generator(0)
}

/// dr/dtheta and dr/dphi / sin theta: components of the gradient along e_theta and e_phi, at the poles too.
fn polar(gradient: DVec3, theta: f64, phi: f64) -> (f64, f64) {
    let ((s, c), (sin, cos)) = (sin_cos(theta), sin_cos(phi));
    (gradient.dot(DVec3::new(c * cos, c * sin, -s)), gradient.dot(DVec3::new(-sin, cos, 0.0)))
}

#[test]
fn functions_are_those_of_the_reference() {
    let mut compared = 0;
    for (at, quantity, value) in rows("basis") {
        let at = parameters(at);
        let (theta, k, m): (f64, usize, usize) =
            (at["theta"].parse().unwrap(), at["k"].parse().unwrap(), at["m"].parse().unwrap());
        let mut pairs = vec![[0.0; 2]; (k + 1) * (k + 2) / 2];
        pairs[k * (k + 1) / 2 + m] = [1.0, 0.0];
        let series = Series::new(&pairs).unwrap();
        let expected: f64 = value.parse().unwrap();
        // With cos m phi at phi = 0 the value is S, and its derivative by theta that of S. With m phi = pi/2 the derivative by phi is -m S.
        let is = match quantity {
            "S" => basis(k, direction(theta, 0.0))[k * (k + 1) / 2 + m][0],
            "dS_dtheta" => polar(series.slope(direction(theta, 0.0)).gradient, theta, 0.0).0,
            "m_S_over_sin" if m == 0 => 0.0,
            "m_S_over_sin" => {
                let phi = 0.5 * PI / m as f64;
                -polar(series.slope(direction(theta, phi)).gradient, theta, phi).1
            }
            other => panic!("{other}"),
        };
        assert!((is - expected).abs() <= 1e-12 * expected.abs().max(1.0), "{at:?} {quantity}: {is} {expected}");
        compared += 1;
    }
    assert_eq!(compared, 120);
}

#[test]
fn the_object_of_the_reference_has_its_normals_crossings_volume_and_area() {
    let star = Star::new(objects::reference()).unwrap();
    for (at, quantity, value) in rows("object") {
        let Ok(expected) = value.parse::<f64>() else { continue };
        let at = parameters(at);
        let close =
            |is: f64, within: f64| assert!((is - expected).abs() < within, "{at:?} {quantity}: {is} {expected}");
        match quantity {
            "volume" => close(star.volume(), 1e-11),
            "area" => close(star.area(), 1e-9),
            _ => {
                let (theta, phi) = (at["theta"].parse().unwrap(), at["phi"].parse().unwrap());
                let slope = star.series().slope(direction(theta, phi));
                let (by_theta, by_phi) = polar(slope.gradient, theta, phi);
                let normal = star.normal_and_area(direction(theta, phi)).0;
                let is = match quantity {
                    "r" => slope.value,
                    "dr_dtheta" => by_theta,
                    "dr_dphi_over_sin" => by_phi,
                    "normal_x" => normal.x,
                    "normal_y" => normal.y,
                    "normal_z" => normal.z,
                    other => panic!("{other}"),
                };
                // The table gives theta of the south pole with 12 digits.
                close(is, 2e-11);
            }
        }
    }
    let vector = |text: &str| {
        let mut numbers = text.trim_matches(['(', ')']).split(' ').map(|n| n.parse::<f64>().unwrap());
        DVec3::new(numbers.next().unwrap(), numbers.next().unwrap(), numbers.next().unwrap())
    };
    for (at, quantity, value) in rows("ray") {
        let at = parameters(at);
        let (o, d) = (vector(at["o"]), vector(at["d"]));
        let all = oracle::crossings(star.series(), o, d);
        let expected: f64 = value.parse().unwrap();
        let first = star.first_crossing(o, d, f64::INFINITY).map(|c| c.distance);
        match quantity {
            "count" => assert_eq!((all.distances.len() as f64, first.is_some()), (expected, expected > 0.0), "{at:?}"),
            "xi_0" => {
                assert!((all.distances[0] - expected).abs() < 1e-11, "{at:?}: {:?}", all.distances);
                assert!((first.unwrap() - expected).abs() < 1e-11, "{at:?}: {first:?}");
            }
            _ => assert!((all.distances[1] - expected).abs() < 1e-11, "{at:?}: {:?}", all.distances),
        }
    }
}

#[test]
fn squares_of_each_degree_sum_to_one_to_degree_128() {
    let mut rng = generator("addition");
    let special = [DVec3::Z, -DVec3::Z, DVec3::X, direction(1e-9, 1.0), direction(PI - 1e-3, -2.0)];
    let mut worst = 0f64;
    for n in special.into_iter().chain((0..2000).map(|_| sphere(rng.uniform2()))) {
        let functions = basis(128, n.normalize());
        for k in 0..=128 {
            let of_degree = &functions[k * (k + 1) / 2..(k + 1) * (k + 2) / 2];
            let sum: f64 = of_degree.iter().flatten().map(|f| f * f).sum();
            if (sum - 1.0).abs() > worst {
                println!("{n} {k} {}", sum - 1.0);
            }
            worst = worst.max((sum - 1.0).abs());
        }
    }
    assert!(worst < 1e-13, "{worst:e}");
    // A recurrence of 128 steps rounds most beside the poles.
    for n in [direction(1e-4, 0.3), direction(PI - 1e-5, -2.0), direction(1e-6, 2.0)] {
        let functions = basis(128, n);
        let sum: f64 = functions[128 * 129 / 2..].iter().flatten().map(|f| f * f).sum();
        assert!((sum - 1.0).abs() < 2e-13, "{sum}");
    }
}

#[test]
fn gradients_are_finite_differences_of_values_at_the_poles_too() {
    let series = objects::rough(32, &mut generator("rough"));
    let mut rng = generator("gradients");
    let poles = [DVec3::Z, -DVec3::Z];
    for i in 0..300 {
        let n = poles.get(i).copied().unwrap_or_else(|| sphere(rng.uniform2()));
        let slope = series.slope(n);
        assert!((slope.value - series.value(n)).abs() < 1e-14 && slope.gradient.dot(n).abs() < 1e-12);
        let tangent = n.cross(sphere(rng.uniform2())).normalize();
        let at = |angle: f64| {
            let (s, c) = sin_cos(angle);
            series.value(c * n + s * tangent)
        };
        // Fourth order: its error is below h^4 M5/30 with h = 1e-3.
        let h = 1e-3;
        let difference = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
        assert!((difference - slope.gradient.dot(tangent)).abs() < 3e-7, "{difference} at {n}");
    }
}

#[test]
fn nothing_exceeds_the_bounds_of_the_coefficients() {
    let series = objects::rough(24, &mut generator("bounds"));
    let (bounds, radii) = (Bounds::of_coefficients(&series), Star::new(series.clone()).unwrap().radii());
    assert!(radii.0 > bounds.low && radii.1 < bounds.high, "{radii:?} {bounds:?}");
    let mut rng = generator("bounds of");
    let (mut least, mut most) = (f64::INFINITY, 0f64);
    for _ in 0..20_000 {
        let slope = series.slope(sphere(rng.uniform2()));
        (least, most) = (least.min(slope.value), most.max(slope.value));
        assert!(slope.gradient.length() < bounds.first);
    }
    // The shells are tight, and never passed.
    assert!(radii.0 <= least && least < radii.0 + 0.03, "{radii:?} {least}");
    assert!(radii.1 >= most && most > radii.1 - 0.03, "{radii:?} {most}");
}

#[test]
fn a_projection_gives_back_its_series() {
    let series = objects::rough(20, &mut generator("projected"));
    let again = projection(20, 42, |all| Ok(all.iter().map(|&n| series.value(n)).collect())).unwrap();
    for (a, b) in series.pairs().into_iter().flatten().zip(again.pairs().into_iter().flatten()) {
        assert!((a - b).abs() < 1e-14, "{a} {b}");
    }
}

/// First hits of `count` lines against the oracle: no wrong one, no missed one but where nobody can tell. How many grazed.
fn compare(name: &str, star: &Star, count: usize) -> usize {
    let mut rng = generator(name);
    let graze = |_| {
        let (o, d) = lines::draw(star, &mut rng);
        match lines::judge(star, o, d) {
            Verdict::Agrees { leaves } => {
                assert!(!leaves, "{name}: nothing in the way from {o} along {d}");
                false
            }
            Verdict::Grazes => true,
            Verdict::Wrong(why) => panic!("{name}: {why} from {o} along {d}"),
        }
    };
    (0..count).map(graze).filter(|&grazes| grazes).count()
}

#[test]
fn first_hits_are_those_of_the_oracle() {
    let rough = objects::rough(32, &mut generator("rough"));
    let objects = [
        ("sphere", Series::constant(0.7)),
        ("reference", objects::reference()),
        ("ellipsoid", objects::ellipsoid()),
        ("rough", rough),
    ];
    for (name, series) in objects {
        let grazing = compare(name, &Star::new(series).unwrap(), 3000);
        assert!(grazing <= 2, "{name}: {grazing} of 3000 lines graze");
    }
}

#[test]
fn what_is_no_surface_is_refused() {
    assert!(Series::new(&[[1.0, 0.0], [0.0, 0.0]]).is_err(), "two pairs");
    assert!(Series::new(&[[1.0, 0.5]]).is_err(), "s of order 0");
    assert!(Series::new(&[[f64::NAN, 0.0]]).is_err());
    assert!(Star::new(Series::constant(-1.0)).is_err());
    let thin = Series::new(&[[1.0, 0.0], [1.5, 0.0], [0.0, 0.0]]).unwrap();
    assert!(Star::new(thin).unwrap_err().to_string().contains("least radius"));
}
