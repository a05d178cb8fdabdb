//! Luminance, integrals and directions of skies, by themselves.

use crate::common::{Case, assert_all, compare};
use crate::{sky, turn};
use lampyris::job::Job;
use lampyris::math::{DVec3, PI, acos, cos, exp};
use lampyris::random::{Domain, Stream};
use lampyris::scene::{Model, Sky};
use lampyris::validate::scenes::{add_quad, lambert, point, run};

const SUN: &str = "[sky.sun]\nazimuth_degrees = 135\nelevation_degrees = 35\n";

fn of(text: &str) -> Sky {
    let job =
        Job::parse(&format!("scene = \"x\"\n{text}{}", point("p", [0.0; 3], [0.0, 1.0, 0.0])), "sky.toml").unwrap();
    Sky::of_job(&job.sky.unwrap())
}

/// The standard's own table: a, b, c, d, e of types 1 to 15.
const TABLE: [[f64; 5]; 15] = [
    [4.0, -0.7, 0.0, -1.0, 0.0],
    [4.0, -0.7, 2.0, -1.5, 0.15],
    [1.1, -0.8, 0.0, -1.0, 0.0],
    [1.1, -0.8, 2.0, -1.5, 0.15],
    [0.0, -1.0, 0.0, -1.0, 0.0],
    [0.0, -1.0, 2.0, -1.5, 0.15],
    [0.0, -1.0, 5.0, -2.5, 0.3],
    [0.0, -1.0, 10.0, -3.0, 0.45],
    [-1.0, -0.55, 2.0, -1.5, 0.15],
    [-1.0, -0.55, 5.0, -2.5, 0.3],
    [-1.0, -0.55, 10.0, -3.0, 0.45],
    [-1.0, -0.32, 10.0, -3.0, 0.45],
    [-1.0, -0.32, 16.0, -3.0, 0.3],
    [-1.0, -0.15, 16.0, -3.0, 0.3],
    [-1.0, -0.15, 24.0, -2.8, 0.15],
];

/// Towards the sun of [`SUN`] with north along -Z: by hand.
fn sun() -> DVec3 {
    let (s, c) = turn(35.0 / 360.0);
    DVec3::new(c * 0.5f64.sqrt(), s, c * 0.5f64.sqrt())
}

/// L/Lz of type `number`, written once more.
fn relative(number: usize, v: DVec3) -> f64 {
    let [a, b, c, d, e] = TABLE[number - 1];
    let phi = |z: f64| 1.0 + a * exp(b / z);
    let f = |chi: f64| 1.0 + c * (exp(d * chi) - exp(d * PI / 2.0)) + e * cos(chi) * cos(chi);
    phi(v.y) * f(acos(v.dot(sun()))) / (phi(1.0) * f(acos(sun().y)))
}

/// int L cos dw over the upper hemisphere by rings around the sun: where the standard has its only edge.
fn horizontal(luminance: impl Fn(DVec3) -> f64) -> f64 {
    let (rings, places) = (1500, 720);
    let (t, b) = lampyris::math::frame(sun());
    let mut sum = 0.0;
    for i in 0..rings {
        let chi = (f64::from(i) + 0.5) / f64::from(rings) * PI;
        let (sin, cos) = lampyris::math::sin_cos(chi);
        for j in 0..places {
            let (s, c) = turn((f64::from(j) + 0.5) / f64::from(places));
            let v = cos * sun() + sin * (c * t + s * b);
            if v.y > 0.0 {
                sum += luminance(v) * v.y * sin;
            }
        }
    }
    sum * PI / f64::from(rings) * 2.0 * PI / f64::from(places)
}

#[test]
fn all_types_have_the_luminance_and_the_integral_of_the_standard() {
    for number in 1..=15 {
        let sky = of(&sky(&number.to_string(), 1000.0, SUN));
        for v in [DVec3::Y, DVec3::new(0.3, 0.2, -0.7), DVec3::new(-0.5, 0.01, 0.2), sun()] {
            let (found, expected) =
                (sky.luminance(v.normalize()).luminance(), 1000.0 * relative(number, v.normalize()));
            // The arc cosine has half the digits at the sun itself.
            assert!((found / expected - 1.0).abs() < 1e-7, "type {number} {v}: {found} {expected}");
        }
        let expected = 1000.0 * horizontal(|v| relative(number, v));
        let found = sky.horizontal_illuminance();
        assert!((found / expected - 1.0).abs() < 2e-5, "type {number}: {found} {expected}");
    }
    let by_illuminance =
        of("[sky]\nmodel = 12\nhorizontal_illuminance = 15000\nup = [0, 0, 2]\nnorth = [0, 1, 0.5]\n[sky.sun]\n\
                             azimuth_degrees = 90\nelevation_degrees = 30\nilluminance = 1\n");
    assert!((by_illuminance.horizontal_illuminance() - 15000.0).abs() < 1e-9);
    let (low, high) = (DVec3::new(-0.9, 0.0, 0.45).normalize(), DVec3::new(0.9, 0.0, 0.45).normalize());
    let [low, high] = [low, high].map(|v| by_illuminance.luminance(v).luminance());
    assert!(high > 5.0 * low, "the sun stands in the east, +X: {high} {low}");
}

#[test]
fn overcast_and_uniform_have_their_closed_forms_and_the_ground_reflects_them() {
    let uniform = of(&sky("\"uniform\"", 1000.0, "ground_reflectance = 0.2\n"));
    assert!((uniform.horizontal_illuminance() / (1000.0 * PI) - 1.0).abs() < 1e-12);
    let ground = uniform.luminance(DVec3::new(0.6, -0.8, 0.0)).luminance();
    assert!((ground / 200.0 - 1.0).abs() < 1e-12, "{ground}");
    let overcast = of(&sky("\"overcast\"", 1000.0, ""));
    assert!((overcast.horizontal_illuminance() / (7000.0 * PI / 9.0) - 1.0).abs() < 1e-12);
    assert_eq!(overcast.luminance(DVec3::NEG_Y).luminance(), 0.0);
    let sunny = of(&sky("5", 1000.0, &("ground_reflectance = 0.5\n".to_owned() + SUN + "illuminance = 2000\n")));
    let ground = sunny.luminance(DVec3::NEG_Y).luminance();
    let expected = 0.5 * (1000.0 * PI + 2000.0 * sun().y) / PI;
    assert!((ground / expected - 1.0).abs() < 1e-12, "{ground} {expected}");
}

/// Draws 2^18 directions and counts them in boxes of height and azimuth; the density summed over each box says how many.
#[test]
fn directions_are_drawn_with_the_density_that_is_evaluated_and_nearly_as_the_luminance() {
    let skies = [sky("13", 1000.0, SUN), sky("\"overcast\"", 1.0, "ground_reflectance = 0.3\n"), sky("6", 5.0, SUN)];
    let (heights, turns, draws) = (20usize, 24usize, 1 << 18);
    for (text, above) in skies.iter().flat_map(|text| [(text, None), (text, Some(DVec3::new(0.6, 0.0, -0.8)))]) {
        let sky = of(text);
        let mut counts = vec![0.0; heights * turns];
        let mut rng = Stream::new(5, Domain::Receiver, "skies").generator(0);
        let mut integral = 0.0;
        let density = |v| above.map_or_else(|| sky.density(v), |n| sky.density_above(n, v));
        for _ in 0..draws {
            let u = rng.uniform2();
            let v = above.map_or_else(|| sky.sample(u), |n| sky.sample_above(n, u));
            let (row, turn) = (0.5 * (1.0 - v.y), lampyris::math::atan2(v.z, v.x) / (2.0 * PI));
            let column = ((turn - turn.floor()) * turns as f64) as usize % turns;
            counts[(row * heights as f64) as usize * turns + column] += 1.0;
            if above.is_none() {
                let ratio = sky.luminance(v).luminance() / density(v);
                integral += ratio / f64::from(draws);
                let mean = sky.luminance(DVec3::Y).luminance() / sky.density(DVec3::Y);
                assert!(ratio < 1.5 * mean && ratio > mean / 2.0, "{text}: {ratio} {mean}");
            }
        }
        let (mut chi, mut boxes, mut all) = (0.0, 0.0, 0.0);
        let fine = 48;
        for (i, count) in counts.iter().enumerate() {
            let mut expected = 0.0;
            for k in 0..fine * fine {
                let place = |at: usize, of: usize, k: usize| (at as f64 + (k as f64 + 0.5) / fine as f64) / of as f64;
                let y = 1.0 - 2.0 * place(i / turns, heights, k / fine);
                let (s, c) = turn(place(i % turns, turns, k % fine));
                let across = (1.0 - y * y).sqrt();
                expected +=
                    density(DVec3::new(across * c, y, across * s)) * 4.0 * PI / (heights * turns * fine * fine) as f64;
            }
            all += expected;
            let expected = expected * f64::from(draws);
            if expected > 20.0 {
                chi += (count - expected) * (count - expected) / expected;
                boxes += 1.0;
            }
        }
        let z = (chi - boxes) / (2.0 * boxes).sqrt();
        assert!((all - 1.0).abs() < 2e-3, "{text}: the density integrates to {all}");
        assert!(z.abs() < 5.0, "{text}: chi-square {chi} in {boxes} boxes");
        if above.is_none() {
            let ground = sky.luminance(DVec3::NEG_Y).luminance() * 2.0 * PI;
            assert!(integral > ground, "{integral}");
        }
    }
}

fn far_below() -> Model {
    let mut model = Model::default();
    add_quad(&mut model, DVec3::new(-0.1, -9.0, -0.1), DVec3::Z * 0.2, DVec3::X * 0.2, lambert(0.0, 0.0));
    model
}

#[test]
fn unobstructed_meters_read_the_integrals() {
    let up = [0.0, 1.0, 0.0];
    let meters = point("up", [0.0; 3], up) + &point("side", [0.0; 3], [1.0, 0.0, 0.0]);
    let both = |text: String| Case::new(&(run(1024, 32) + &text + &meters), far_below()).values();
    let mut all = Vec::new();
    let mut add = |name: &str, text: String, expected: [f64; 2]| {
        for (found, (what, expected)) in both(text).into_iter().zip([("up", expected[0]), ("side", expected[1])]) {
            all.push(compare(format!("{name} {what}"), found, expected));
        }
    };
    add("uniform", sky("\"uniform\"", 1000.0, ""), [1000.0 * PI, 500.0 * PI]);
    add("uniform over ground", sky("\"uniform\"", 1000.0, "ground_reflectance = 0.5\n"), [1000.0 * PI, 750.0 * PI]);
    add("overcast", sky("\"overcast\"", 1000.0, ""), [7000.0 * PI / 9.0, 968.043220043]);
    // By quadrature; the vertical plane by turning the sum's weight.
    for number in [1, 8, 13, 15] {
        let side = |v: DVec3| 1000.0 * relative(number, v) * v.x.max(0.0) / v.y;
        let expected = [1000.0 * horizontal(|v| relative(number, v)), horizontal(side)];
        add(&format!("type {number}"), sky(&number.to_string(), 1000.0, SUN), expected);
    }
    let sunny =
        sky("\"uniform\"", 1.0, "[sky.sun]\nazimuth_degrees = 90\nelevation_degrees = 30\nilluminance = 1000\n");
    add("sun in the east, +X", sunny, [PI + 500.0, 0.5 * PI + 1000.0 * 0.75f64.sqrt()]);
    assert_all(&all);
}
