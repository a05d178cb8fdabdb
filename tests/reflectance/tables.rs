//! Tabulated laws whose cells are small or large: their albedos are exact, and no narrow spike is overlooked.

use crate::generator;
use crate::quadrature::Incidence;
use lampyris::math::{DVec3, PI, cos, sin};
use lampyris::scene::{Reflectance, Tabulated};
use std::fmt::Write;

/// The text of a table of one channel.
fn text(theta: &[f64], phi: &[f64], f: impl Fn(usize, usize, usize) -> f64) -> String {
    let words = |numbers: &[f64]| numbers.iter().map(|x| format!(" {x}")).collect::<String>();
    let mut text = format!("lampyris-brdf 1\nchannels 1\ntheta{}\nphi{}\n", words(theta), words(phi));
    for i in 0..theta.len() {
        for j in 0..theta.len() {
            (0..phi.len()).for_each(|k| write!(text, "{} ", f(i, j, k)).unwrap());
            text.push('\n');
        }
    }
    text
}

fn law(text: &str) -> Reflectance {
    Reflectance::tabulated(Tabulated::parse("table", text.as_bytes()).unwrap())
}

/// The reflectance of `law` at the cosine `mu` by the midpoint rule in sin^2 and azimuth.
fn by_points(law: &Reflectance, mu: f64) -> f64 {
    const SIDE: u32 = 1000;
    let w_in = DVec3::new((1.0 - mu * mu).sqrt(), 0.0, -mu);
    let value = |(i, j): (u32, u32)| {
        let (square, turn) = ((f64::from(i) + 0.5) / f64::from(SIDE), PI * (f64::from(j) + 0.5) / f64::from(SIDE));
        let across = square.sqrt();
        let w_out = DVec3::new(across * cos(turn), across * sin(turn), (1.0 - square).sqrt());
        law.evaluate(DVec3::Z, w_in, w_out).0[0]
    };
    let all: f64 = (0..SIDE).flat_map(|i| (0..SIDE).map(move |j| (i, j))).map(value).sum();
    PI * all / f64::from(SIDE * SIDE)
}

#[test]
fn albedos_are_the_integrals_of_what_stands_between_the_nodes() {
    // Uneven angles that end before 90 and 180 degrees, and values without any pattern but reciprocity.
    let (theta, phi) = ([0.0, 11.0, 40.0, 47.0, 75.0], [0.0, 20.0, 95.0, 160.0]);
    let rough = law(&text(&theta, &phi, |i, j, k| 0.05 * ((3 * (i + j) + i * j + 2 * k) % 7) as f64));
    for degrees in [0.0, 5.0, 11.0, 33.0, 47.0, 74.0, 80.0, 89.9] {
        let mu = cos(degrees * PI / 180.0);
        let (exact, found) = (rough.albedo(mu).0[0], by_points(&rough, mu));
        assert!((exact / found - 1.0).abs() < 1e-5, "{degrees}: {exact} by cells, {found} by points");
    }
}

/// Black but for a spike of `height` a hundredth of a degree wide, and one in azimuth: 1.517e-6 of it is the reflectance there.
fn spike(height: f64) -> String {
    let (theta, phi) = ([0.0, 42.49, 42.5, 42.51, 90.0], [0.0, 89.5, 90.0, 90.5, 180.0]);
    text(&theta, &phi, |i, j, k| if (i, j, k) == (2, 2, 2) { height } else { 0.0 })
}

#[test]
fn a_spike_between_the_points_of_any_grid_is_counted_whole() {
    let fits = law(&spike(6e5));
    let mu = cos(42.5 * PI / 180.0);
    let found = fits.albedo(mu).0[0];
    let width = 0.01 * PI / 180.0 * sin(85.0 * PI / 180.0);
    assert!((found / (6e5 * width * 0.5 * PI / 180.0) - 1.0).abs() < 1e-6, "{found}");
    let error = Tabulated::parse("spike.brdf", spike(7e5).as_bytes()).unwrap_err().to_string();
    assert!(error.contains("spike.brdf: reflectance at theta 42.5 = 1.06") && error.contains("at most 1"), "{error}");
}

#[test]
fn no_weight_grows_beyond_a_few_times_the_albedo() {
    // Where f falls linearly from a corner of a cell to zero it is there four times its mean, a little more along s.
    let most = 6.5;
    let mut rng = generator(800);
    let coarse = text(&[0.0, 90.0], &[0.0, 180.0], |i, j, k| if (i, j, k) == (1, 1, 0) { 0.6 } else { 0.0 });
    for (name, text) in [("spike", spike(6e5)), ("coarse", coarse)] {
        let law = law(&text);
        for degrees in [10.0, 42.495, 42.5, 60.0, 89.0] {
            let mu = cos(degrees * PI / 180.0);
            let w_in = Incidence::new(DVec3::Z, mu, 1.0).w_in;
            let albedo = law.albedo(mu).0[0];
            let (mut sum, mut count) = (0.0, 0.0);
            for _ in 0..20_000 {
                let factor = law.sample(DVec3::Z, w_in, &mut rng).map_or(0.0, |drawn| drawn.factor.0[0]);
                assert!(factor <= most, "{name} at {degrees}: {factor}");
                (sum, count) = (sum + factor, count + 1.0);
            }
            assert!((sum / count - albedo).abs() <= 0.05 * albedo, "{name} at {degrees}: {} for {albedo}", sum / count);
        }
    }
}
