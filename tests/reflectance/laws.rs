//! The laws that a job may ask for: reciprocity, energy, sampling against density and evaluation, and what is refused.

use crate::quadrature::Incidence;
use crate::sampling::fit;
use crate::{generator, integrated_albedo, largest_difference};
use lampyris::math::{DVec3, PI};
use lampyris::photometry::Colour;
use lampyris::random::sphere;
use lampyris::scene::{Delta, Glass, Pane, Reflectance, Tabulated, law_of_road};
use std::fmt::Write;

const NORMAL: DVec3 = DVec3::new(0.36, 0.48, -0.8);
const COSINES: [f64; 5] = [0.05, 0.3, 0.6, 0.9, 1.0];

/// A table of f = a + b c c' (1 - cos(phi)), c and c' the cosines, every 5 and 10 degrees.
fn table(a: f64, b: f64) -> String {
    let mut text = "lampyris-brdf 1 # a test\nchannels 1\ntheta".to_owned();
    let angles: Vec<u32> = (0..=18).map(|i| 5 * i).collect();
    angles.iter().for_each(|x| write!(text, " {x}").unwrap());
    text.push_str("\nphi 0 10 20 30 40 50 60 70 80 90 100 110 120 130 140 150 160 170 180\n\n");
    let sine = |degrees: u32| lampyris::math::sin(f64::from(degrees) * PI / 180.0);
    for one in &angles {
        for other in &angles {
            for k in 0..19 {
                let phi = lampyris::math::cos(f64::from(10 * k) * PI / 180.0);
                write!(text, "{} ", a + b * sine(*one) * sine(*other) * (1.0 - phi)).unwrap();
            }
            text.push('\n');
        }
    }
    text
}

fn tabulated() -> Reflectance {
    Reflectance::tabulated(Tabulated::parse("table", table(0.1, 0.15).as_bytes()).unwrap())
}

/// Finite laws with names.
fn laws() -> Vec<(&'static str, Reflectance)> {
    let (some, more) = (Colour([0.1, 0.3, 0.5]), Colour([0.6, 0.4, 0.5]));
    vec![
        ("phong 1", Reflectance::phong(some, more, 1.0)),
        ("phong 20", Reflectance::phong(some, more, 20.0)),
        ("phong 300", Reflectance::phong(Colour::BLACK, Colour::WHITE, 300.0)),
        ("opal", Reflectance::opal(some, more * 0.9)),
        ("lambert", Reflectance::Lambert(more)),
        ("tabulated", tabulated()),
    ]
}

#[test]
fn reciprocal_bit_for_bit() {
    let mut rng = generator(11);
    for (name, law) in laws() {
        for _ in 0..2000 {
            let (n, a, b) = (sphere(rng.uniform2()), sphere(rng.uniform2()), sphere(rng.uniform2()));
            // From the side on which light arrives, on both ways.
            let arrival = |w: DVec3| if w.dot(n) < 0.0 { n } else { -n };
            assert_eq!(law.evaluate(arrival(a), a, b), law.evaluate(arrival(-b), -b, -a), "{name}");
        }
    }
}

#[test]
fn albedos_are_those_of_the_law_and_never_above_one() {
    for (name, law) in laws() {
        // A narrow lobe is integrated over half vectors, which the horizon must not cut.
        let narrow = name == "phong 300";
        for mu in COSINES.into_iter().filter(|mu| !narrow || *mu >= 0.3) {
            let integral = integrated_albedo(&law, &Incidence::new(NORMAL, mu, if narrow { 0.04 } else { 1.0 }));
            let (reflected, transmitted) = law.shares(mu);
            let error = largest_difference(integral, reflected);
            assert!(error < 2e-3, "{name}, mu {mu}: {error}, {integral:?} for {reflected:?}");
            assert!((reflected + transmitted).max() <= 1.0 + 1e-9, "{name}, mu {mu}");
            assert!(largest_difference(reflected + transmitted, law.albedo(mu)) < 1e-12, "{name}, mu {mu}");
        }
    }
    // At normal incidence nothing of a narrow lobe is cut off.
    let narrow = Reflectance::phong(Colour::BLACK, Colour::WHITE, 1e5).albedo(1.0).0[0];
    assert!((narrow - 1.0).abs() < 2e-3, "{narrow}");
}

#[test]
fn directions_follow_their_density_and_factors_their_law() {
    for (i, (name, law)) in laws().into_iter().enumerate() {
        for mu in [0.1, 0.5, 1.0] {
            let at = Incidence::new(NORMAL, mu, 1.0);
            let mut rng = generator(500 + i as u64);
            // What is transmitted is looked at in the mirror of the surface.
            for side in [1.0, -1.0] {
                let turned = |w: DVec3| if side > 0.0 { w } else { w.reflect(NORMAL) };
                let above = |w: &DVec3| w.dot(NORMAL) > 0.0;
                let pdf = |w: DVec3| if above(&w) { law.pdf(NORMAL, at.w_in, turned(w)) } else { 0.0 };
                let mut draw = || law.sample(NORMAL, at.w_in, &mut rng).map(|s| turned(s.direction)).filter(above);
                if side < 0.0 && name != "opal" {
                    assert!((0..1000).all(|_| draw().is_none()), "{name} transmits nothing");
                    continue;
                }
                let fit = fit(&at, pdf, draw);
                assert!(fit.holds(), "{name}, mu {mu}: {} > {}", fit.statistic, fit.critical);
            }
            for _ in 0..2000 {
                let Some(drawn) = law.sample(NORMAL, at.w_in, &mut rng) else { continue };
                let (w, side) = (drawn.direction, drawn.direction.dot(NORMAL));
                assert_eq!(drawn.transmitted, side < 0.0, "{name}");
                let wanted = law.evaluate(NORMAL, at.w_in, w) * (side.abs() / law.pdf(NORMAL, at.w_in, w));
                let scale = 1e-12 + 1e-9 * wanted.max();
                assert!(largest_difference(wanted, drawn.factor) < scale, "{name}, mu {mu}: {drawn:?} for {wanted:?}");
            }
        }
    }
}

#[test]
fn opal_sends_to_each_side_what_it_says() {
    let law = Reflectance::opal(Colour::grey(0.3), Colour::grey(0.5));
    let mut rng = generator(600);
    let (mut through, mut all) = (0.0, 0.0);
    for _ in 0..100_000 {
        let drawn = law.sample(NORMAL, -NORMAL, &mut rng).unwrap();
        let part = drawn.factor.0[1] * if drawn.transmitted { 1.0 } else { 0.0 };
        (through, all) = (through + part, all + drawn.factor.0[1]);
    }
    assert!((through / 1e5 - 0.5).abs() < 0.006 && (all / 1e5 - 0.8).abs() < 1e-9, "{through} {all}");
}

#[test]
fn deltas_keep_the_flux() {
    let glass = Delta::Glass(Glass::new(1.5, Colour::BLACK));
    let pane = Delta::Pane(Pane::new(1.5, Colour([1.0, 0.9, 0.5])));
    let mirror = Delta::Mirror(Colour::grey(0.7));
    for mu in COSINES {
        for (law, most) in [(&glass, 1.0), (&pane, 1.0), (&mirror, 0.7)] {
            let (reflected, transmitted) = Reflectance::Delta(law.clone()).shares(mu);
            assert!((reflected + transmitted).max() <= most + 1e-12);
        }
        assert_eq!(Reflectance::Delta(mirror.clone()).shares(mu), (Colour::grey(0.7), Colour::BLACK));
        let clear = Reflectance::Delta(glass.clone()).shares(mu);
        assert!(largest_difference(clear.0 + clear.1, Colour::WHITE) < 1e-15);
    }
}

#[test]
fn tables_that_cannot_be_are_refused() {
    let good = table(0.1, 0.15);
    let refused = |text: &str, word: &str| {
        let error = Tabulated::parse("bad.brdf", text.as_bytes()).unwrap_err().to_string();
        assert!(error.contains("bad.brdf") && error.contains(word), "{error}");
    };
    refused("", "lampyris-brdf 1");
    refused(&good.replace("lampyris-brdf 1", "lampyris-brdf 2"), "lampyris-brdf 1");
    refused(&good.replace("channels 1", "channels 2"), "channels 3");
    refused(&good.replace("theta 0 5", "theta 5 5"), "ascending");
    refused(&good.replace("180\n", "190\n"), "at most 180");
    refused(&good.replace("\n\n0.1 ", "\n\n-0.1 "), "line 6");
    refused(&good.replace("\n\n0.1 ", "\n\nNaN "), "NaN");
    refused(&good.replace("\n\n0.1 ", "\n\n"), "18 numbers");
    refused(&(good.clone() + "1 2\n"), "last value");
    refused(good.trim_end().rsplit_once('\n').unwrap().0, "end of the file");
    refused(&table(0.3, 0.9), "no law reflects more");
    let mut bent: Vec<String> = good.lines().map(str::to_owned).collect();
    bent[6] = "0.2 ".repeat(19);
    refused(&bent.join("\n"), "f for theta 0 and 5, phi 0 (line 7) = 0.2: within a tenth of 0.1");
    refused(&bent.join("\n"), ", for theta 5 and 0 (line 25): a law is reciprocal");
    assert!(Tabulated::parse("good", good.as_bytes()).is_ok());
}

#[test]
fn a_table_of_one_value_is_lambert() {
    let text = format!("lampyris-brdf 1\nchannels 3\ntheta 0\nphi 0\n{} {} {}\n", 0.1 / PI, 0.2 / PI, 0.9 / PI);
    let law = Reflectance::tabulated(Tabulated::parse("flat", text.as_bytes()).unwrap());
    let mut rng = generator(700);
    for mu in COSINES {
        assert!(largest_difference(law.albedo(mu), Colour([0.1, 0.2, 0.9])) < 1e-12);
        let w_in = Incidence::new(NORMAL, mu, 1.0).w_in;
        let drawn = law.sample(NORMAL, w_in, &mut rng).unwrap();
        assert!(largest_difference(drawn.factor, Colour([0.1, 0.2, 0.9])) < 1e-9, "{drawn:?}");
    }
}

#[test]
fn a_road_table_is_kept_where_the_observer_looks() {
    let table = "# 10^4 r\nbeta 0 10 90 180\n0 700 700 700 700\n1 300 200 150 100\n4 90 9 - 3\n";
    let text = law_of_road("road", table).unwrap();
    let law = Reflectance::tabulated(Tabulated::parse("road", text.as_bytes()).unwrap());
    let observer = DVec3::new(lampyris::math::sin(89.0 * PI / 180.0), 0.0, lampyris::math::cos(89.0 * PI / 180.0));
    // Light goes forward, beta = 0, where it comes from opposite to the observer.
    for (tan, beta, r) in [(1.0, 0.0, 300.0), (1.0, 10.0, 200.0), (4.0, 180.0, 3.0), (4.0, 90.0, 9.0)] {
        let (sin, cos) = lampyris::math::sin_cos(beta * PI / 180.0);
        let w_in = DVec3::new(cos * tan, sin * tan, -1.0).normalize();
        let q = law.evaluate(DVec3::Z, w_in, observer).0[0];
        let wanted: f64 = 1e-4 * r / (-w_in.z * w_in.z * w_in.z);
        assert!((q / wanted - 1.0).abs() < 1e-6, "tan {tan}, beta {beta}: {q} for {wanted}");
    }
    for (bad, word) in [
        ("", "line of beta"),
        ("beta 0 90\n0 1 1\n", "0 to 180"),
        ("beta 0 180\n0 1\n", "2 values"),
        ("beta 0 180\n1 1 1\n", "ascending from 0"),
        ("beta 0 180\n0 1 x\n", "line 2"),
        ("beta 0 180\n0 - -\n", "at least one"),
        ("beta 0 180\n", "at least one row"),
    ] {
        let error = law_of_road("road", bad).unwrap_err().to_string();
        assert!(error.contains("road") && error.contains(word), "{error}");
    }
}
