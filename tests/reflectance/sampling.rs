//! What `sample` draws, against `pdf` and `evaluate`: fixed seeds, bounds from the number of comparisons.
//!
//! Each of the [`COMPARISONS`] statistical statements fails by chance with probability 1e-6 / COMPARISONS.

use crate::quadrature::Incidence;
use crate::sheets::SHEETS;
use crate::{BASE, DIELECTRICS, MIRROR, generator, integrated_albedo, largest_difference, law};
use lampyris::math::DVec3;
use lampyris::photometry::Colour;
use lampyris::random::{Generator, around_z};
use lampyris::scene::Reflectance;
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

const DRAWS: u64 = 100_000;
const SECTORS: usize = 10;
/// Per case one chi-square, three means and one frequency.
const COMPARISONS: f64 = 5.0 * CASES.len() as f64;
const NORMAL: DVec3 = DVec3::new(0.36, 0.48, -0.8);

/// alpha, metallic, cosine of incidence.
const CASES: [(f64, f64, f64); 10] = [
    (0.0011, 1.0, 0.6),
    (0.0025, 0.0, 0.3),
    (0.01, 0.3, 0.9),
    (0.01, 1.0, 0.02),
    (0.1, 0.0, 0.1),
    (0.25, 1.0, 0.05),
    (0.5, 0.3, 0.5),
    (1.0, 1.0, 0.2),
    (0.1, 0.3, 1.0),
    (MIRROR, 0.0, 0.1),
];

/// Chi-square of one set of draws over the cells of half vectors, with its critical value.
pub struct Fit {
    pub statistic: f64,
    pub critical: f64,
}

impl Fit {
    pub fn holds(&self) -> bool {
        self.statistic <= self.critical
    }
}

/// Compares `draw` (None: not a finite continuation) with the density `pdf`; the missing mass is a cell of its own.
pub fn fit(at: &Incidence, pdf: impl Fn(DVec3) -> f64, mut draw: impl FnMut() -> Option<DVec3>) -> Fit {
    let panels = at.polar.len() - 1;
    // The horizon cuts the wide panels of a rough surface, where the density jumps to zero.
    let parts = if panels < 10 { (40, 40) } else { (12, 12) };
    let mut expected = vec![0.0; panels * SECTORS + 1];
    for (cell, mass) in expected.iter_mut().take(panels * SECTORS).enumerate() {
        let (panel, sector) = (cell / SECTORS, (cell % SECTORS) as f64);
        let turn = (sector / SECTORS as f64, (sector + 1.0) / SECTORS as f64);
        let polar = (at.polar[panel], at.polar[panel + 1]);
        at.nodes(polar, turn, parts, &mut |w, weight| *mass += pdf(w) * weight * DRAWS as f64);
    }
    expected[panels * SECTORS] = (DRAWS as f64 - expected.iter().sum::<f64>()).max(0.0);
    let mut counts = vec![0u64; expected.len()];
    for _ in 0..DRAWS {
        let cell = draw().map_or(panels * SECTORS, |w| {
            let (panel, turn) = at.locate(w);
            panel * SECTORS + (turn * SECTORS as f64) as usize
        });
        counts[cell] += 1;
    }
    chi_square(&expected, &counts)
}

/// Pearson's statistic; cells of fewer than 20 expected draws are joined.
fn chi_square(expected: &[f64], counts: &[u64]) -> Fit {
    let term = |e: f64, n: f64| (n - e) * (n - e) / e;
    let (mut statistic, mut cells, mut rest) = (0.0, 0.0, (0.0, 0.0));
    for (&e, &n) in expected.iter().zip(counts) {
        if e < 20.0 {
            rest = (rest.0 + e, rest.1 + n as f64);
        } else {
            statistic += term(e, n as f64);
            cells += 1.0;
        }
    }
    // What is too rare for its own cell is at least one draw wide, so that rounding of the integrals is harmless.
    statistic += term(rest.0 + 1.0, rest.1.max(rest.0 + 1.0));
    let law = ChiSquared::new(cells).expect("positive degrees of freedom");
    Fit { statistic, critical: law.inverse_cdf(1.0 - 1e-6 / COMPARISONS) }
}

/// Bound on |z|, two-sided.
fn quantile() -> f64 {
    Normal::new(0.0, 1.0).expect("a valid law").inverse_cdf(1.0 - 0.5e-6 / COMPARISONS)
}

fn finite_direction(law: &Reflectance, at: &Incidence, rng: &mut Generator) -> Option<DVec3> {
    law.sample(at.normal, at.w_in, rng).filter(|drawn| !drawn.delta).map(|drawn| drawn.direction)
}

#[test]
fn directions_follow_their_density() {
    for (i, (alpha, metallic, mu)) in CASES.into_iter().enumerate() {
        let (law, at) = (law(BASE, metallic, alpha), Incidence::new(NORMAL, mu, alpha));
        let mut rng = generator(100 + i as u64);
        let fit = fit(&at, |w| law.pdf(NORMAL, at.w_in, w), || finite_direction(&law, &at, &mut rng));
        println!("alpha {alpha}, metallic {metallic}, mu {mu}: {:.1} of {:.1}", fit.statistic, fit.critical);
        assert!(fit.holds(), "alpha {alpha}, metallic {metallic}, mu {mu}: {} > {}", fit.statistic, fit.critical);
    }
}

#[test]
fn directions_follow_their_density_under_other_outer_surfaces() {
    for (i, dielectric) in DIELECTRICS[..3].iter().chain(&SHEETS).enumerate() {
        for (metallic, alpha, mu) in [(0.0, 0.1, 0.3), (0.4, 0.25, 0.7)] {
            let law = Reflectance::layered(BASE, metallic, f64::sqrt(alpha), *dielectric);
            let at = Incidence::new(NORMAL, mu, alpha);
            let mut rng = generator(150 + i as u64);
            let fit = fit(&at, |w| law.pdf(NORMAL, at.w_in, w), || finite_direction(&law, &at, &mut rng));
            assert!(fit.holds(), "{dielectric:?}, {metallic}, {alpha}, {mu}: {} > {}", fit.statistic, fit.critical);
            let mut mean = Colour::BLACK;
            for _ in 0..DRAWS {
                mean += law.sample(NORMAL, at.w_in, &mut rng).map_or(Colour::BLACK, |d| d.factor / DRAWS as f64);
            }
            assert!(largest_difference(mean, law.albedo(mu)) < 0.005, "{dielectric:?}: {mean:?} {:?}", law.albedo(mu));
        }
    }
}

#[test]
fn a_density_without_the_jacobian_is_rejected() {
    let (law, at) = (law(BASE, 1.0, 0.25), Incidence::new(NORMAL, 0.5, 0.25));
    // The density of half vectors claimed for directions, scaled to the same total.
    let claimed = |w: DVec3| law.pdf(NORMAL, at.w_in, w) * 4.0 * (w - at.w_in).normalize().dot(w);
    let (mut right, mut wrong) = (0.0, 0.0);
    at.hemisphere(|w, weight| {
        if w.dot(NORMAL) > 0.0 {
            right += law.pdf(NORMAL, at.w_in, w) * weight;
            wrong += claimed(w) * weight;
        }
    });
    let mut rng = generator(200);
    let fit = fit(&at, |w| claimed(w) * right / wrong, || finite_direction(&law, &at, &mut rng));
    assert!(!fit.holds(), "{} <= {}", fit.statistic, fit.critical);
}

#[test]
fn normals_drawn_without_their_visibility_are_rejected() {
    let (alpha, w_in) = (0.25, DVec3::new(-0.8, 0.0, -0.6));
    let (law, at) = (law(BASE, 1.0, alpha), Incidence::new(DVec3::Z, 0.6, alpha));
    let mut rng = generator(201);
    // Half vectors with density D cos, the classic sampling, against the density of visible ones.
    let draw = || {
        let u = rng.uniform2();
        let tangent2 = alpha * alpha * u.x / (1.0 - u.x);
        let h = around_z(1.0 / (1.0 + tangent2).sqrt(), u.y);
        let w = w_in - 2.0 * w_in.dot(h) * h;
        (w.z > 0.0).then_some(w)
    };
    assert!((at.w_in - w_in).length() < 1e-12, "the frame of Z has X first");
    let fit = fit(&at, |w| law.pdf(DVec3::Z, at.w_in, w), draw);
    assert!(!fit.holds(), "{} <= {}", fit.statistic, fit.critical);
}

#[test]
fn factors_average_to_the_albedo() {
    let z = quantile();
    for (i, (alpha, metallic, mu)) in CASES.into_iter().enumerate() {
        let (law, at) = (law(BASE, metallic, alpha), Incidence::new(NORMAL, mu, alpha));
        let delta = law.delta_reflectance(mu).unwrap_or(Colour::BLACK);
        let reference = integrated_albedo(&law, &at) + delta;
        let mut rng = generator(300 + i as u64);
        let (mut sum, mut squares) = ([0.0; 3], [0.0; 3]);
        for _ in 0..DRAWS {
            let Some(drawn) = law.sample(NORMAL, at.w_in, &mut rng) else { continue };
            for c in 0..3 {
                sum[c] += drawn.factor.0[c];
                squares[c] += drawn.factor.0[c] * drawn.factor.0[c];
            }
        }
        for c in 0..3 {
            let (n, expected) = (DRAWS as f64, reference.0[c]);
            let mean = sum[c] / n;
            let error = ((squares[c] / n - mean * mean).max(0.0) / n).sqrt();
            let case = format!("alpha {alpha}, metallic {metallic}, mu {mu}, channel {c}: {mean} for {expected}");
            assert!((mean - expected).abs() <= z * error + 1e-4 * expected + 1e-12, "{case}, error {error}");
            // The black metal reflects by its grazing rise alone, which no choice by luminance favours.
            assert!(c == 0 || error <= 0.005 * expected, "{case}, error {error}");
        }
    }
}

#[test]
fn the_delta_component_is_drawn_as_often_as_its_factor_says() {
    let (law, mu) = (law(BASE, 0.0, MIRROR), 0.25);
    let at = Incidence::new(NORMAL, mu, 1.0);
    let mirrored = at.w_in + 2.0 * mu * NORMAL;
    let reflectance = law.delta_reflectance(mu).expect("a mirror has a delta component");
    let mut rng = generator(400);
    let (mut count, mut probability) = (0.0, 0.0);
    for _ in 0..DRAWS {
        let drawn = law.sample(NORMAL, at.w_in, &mut rng).expect("a smooth dielectric always continues");
        if drawn.delta {
            assert!((drawn.direction - mirrored).length() < 1e-14);
            probability = reflectance.0[1] / drawn.factor.0[1];
            count += 1.0;
        }
    }
    let n = DRAWS as f64;
    let bound = quantile() * (n * probability * (1.0 - probability)).sqrt();
    assert!((count - n * probability).abs() <= bound, "{count} of {n} for {probability}");
    let mut finite = 0.0;
    at.hemisphere(|w, weight| finite += law.pdf(NORMAL, at.w_in, w) * weight);
    assert!((finite + probability - 1.0).abs() < 1e-6, "{finite} + {probability}");
}
