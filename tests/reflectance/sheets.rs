//! Thin sheets: dielectrics of which a share lets light straight through.

use crate::quadrature::Incidence;
use crate::{ALPHAS, BASE, METALLIC, MIRROR, TABLE_ERROR, generator, integrated_albedo, largest_difference, law};
use lampyris::math::DVec3;
use lampyris::photometry::Colour;
use lampyris::random::sphere;
use lampyris::scene::{Dielectric, Reflectance};

/// One that is half matt under a coloured outer surface, and one that is clear all through.
pub const SHEETS: [Dielectric; 2] = [
    Dielectric { f0: Colour([0.3, 0.05, 0.0]), f90: 1.0, transmission: 0.5 },
    Dielectric { transmission: 1.0, ..Dielectric::PLAIN },
];

const SHARES: [f64; 4] = [0.0, 0.3, 0.8, 1.0];
const COSINES: [f64; 8] = [0.002, 0.02, 0.055, 0.1, 0.3, 0.6, 0.83, 1.0];

/// The sheet of which the share `t` transmits, of roughness sqrt(alpha).
fn sheet(base: Colour, metallic: f64, alpha: f64, t: f64) -> Reflectance {
    let dielectric = Dielectric { transmission: t, ..Dielectric::PLAIN };
    Reflectance::layered(base, metallic, alpha.sqrt(), dielectric)
}

#[test]
fn what_is_reflected_and_what_goes_straight_on_are_what_the_opaque_law_reflects() {
    for alpha in ALPHAS.into_iter().chain([MIRROR]).filter(|alpha| *alpha < 1.0) {
        for metallic in METALLIC {
            let opaque = law(BASE, metallic, alpha);
            for t in SHARES {
                let sheet = sheet(BASE, metallic, alpha, t);
                for mu in COSINES {
                    let (reflected, straight) = sheet.shares(mu);
                    let case = format!("alpha {alpha}, metallic {metallic}, t {t}, mu {mu}");
                    assert_eq!((reflected, straight), (sheet.albedo(mu), sheet.straight(mu)), "{case}");
                    assert!((reflected + straight).max() <= 1.0 + 1e-12, "{case}");
                    assert!(largest_difference(reflected + straight, opaque.albedo(mu)) < 1e-12, "{case}");
                    // What gets through the outer surface is parted by t.
                    let parted = (opaque.albedo(mu) + sheet.with_transmission(1.0).albedo(mu) * -1.0) * t;
                    assert!(largest_difference(straight, parted) < 1e-12, "{case}: {straight:?} for {parted:?}");
                }
                assert_eq!(sheet.is_veil(), t > 0.0 && metallic < 1.0);
            }
        }
    }
}

#[test]
fn the_law_is_what_the_albedo_says() {
    for (alpha, metallic, t) in
        [(0.01, 0.3, 0.5), (0.1, 0.0, 1.0), (0.5, 0.3, 0.8), (1.0, 0.0, 0.5), (MIRROR, 0.0, 0.4)]
    {
        let sheet = sheet(BASE, metallic, alpha, t);
        for mu in COSINES {
            let delta = sheet.delta_reflectance(mu).unwrap_or(Colour::BLACK);
            let integral = integrated_albedo(&sheet, &Incidence::new(DVec3::Z, mu, alpha)) + delta;
            let error = largest_difference(integral, sheet.albedo(mu));
            assert!(error <= TABLE_ERROR, "{error}: alpha {alpha}, metallic {metallic}, t {t}, mu {mu}");
        }
    }
}

#[test]
fn a_polished_sheet_lets_through_what_schlick_leaves() {
    let (metallic, t) = (0.25, 0.6);
    let sheet = sheet(BASE, metallic, MIRROR, t);
    for mu in COSINES {
        let rise = (1.0 - mu) * (1.0 - mu) * (1.0 - mu) * (1.0 - mu) * (1.0 - mu);
        let wanted = BASE.map(|rho| {
            let f0 = 0.04 * (1.0 - metallic) + rho * metallic;
            (1.0 - metallic) * t * rho * (1.0 - f0 - (1.0 - f0) * rise)
        });
        assert!(largest_difference(sheet.straight(mu), wanted) < 1e-14, "{mu}");
    }
}

#[test]
fn reciprocal_bit_for_bit() {
    let mut rng = generator(21);
    for (alpha, t) in [(MIRROR, 0.5), (0.0025, 0.3), (0.1, 1.0), (1.0, 0.5)] {
        let sheet = sheet(Colour([0.2, 0.5, 0.9]), 0.3, alpha, t);
        for _ in 0..2000 {
            let (n, a, b) = (sphere(rng.uniform2()), sphere(rng.uniform2()), sphere(rng.uniform2()));
            assert_eq!(sheet.evaluate(n, a, b), sheet.evaluate(n, -b, -a));
        }
    }
}

#[test]
fn without_transmission_a_law_has_the_bits_of_the_opaque_one() {
    let mut rng = generator(22);
    for (metallic, alpha) in [(0.0, 0.1), (0.3, 0.01), (1.0, 0.5), (0.2, MIRROR)] {
        let opaque = law(BASE, metallic, alpha);
        let none = sheet(BASE, metallic, alpha, 0.7).with_transmission(0.0);
        assert!(!none.is_veil() && none.straight(0.5).is_black() && none.peak(BASE) == opaque.peak(BASE));
        for _ in 0..500 {
            let (n, a, b) = (sphere(rng.uniform2()), sphere(rng.uniform2()), sphere(rng.uniform2()));
            assert_eq!(none.evaluate(n, a, b), opaque.evaluate(n, a, b));
            assert_eq!(none.pdf(n, a, b), opaque.pdf(n, a, b));
        }
        for mu in COSINES {
            assert_eq!((none.albedo(mu), none.through(mu)), (opaque.albedo(mu), opaque.through(mu)));
        }
    }
}

#[test]
fn special_cases_are_what_they_claim() {
    // Rough, and no metal: matt where it is opaque; a sheet has its outer surface.
    assert!(sheet(BASE, 0.0, 1.0, 0.0).lambert().is_some());
    assert!(sheet(BASE, 0.0, 1.0, 0.1).lambert().is_none() && sheet(BASE, 0.0, 1.0, 0.1).is_veil());
    // Metal, and black, transmit nothing.
    assert!(!sheet(BASE, 1.0, 0.1, 1.0).is_veil() && !sheet(Colour::BLACK, 0.0, 0.1, 1.0).is_veil());
    // Nothing can stand where nothing reflects but a mirror, or nothing at all.
    assert!(sheet(BASE, 0.0, MIRROR, 1.0).is_black() && !sheet(BASE, 0.0, 0.1, 1.0).is_black());
    let nothing = Dielectric { f0: Colour::BLACK, f90: 0.0, transmission: 1.0 };
    let air = Reflectance::layered(Colour::WHITE, 0.0, 0.5, nothing);
    assert!(air.is_black() && air.straight(0.1) == Colour::WHITE && air.albedo(0.1).is_black());
    // Tint by the base colour, and grey of it.
    let tinted = sheet(Colour([0.9, 0.5, 0.1]), 0.0, 0.1, 0.5);
    let grey = tinted.clone().grey().straight(0.7).0[0];
    assert!((grey - tinted.straight(0.7).luminance()).abs() < 1e-12, "{grey}");
    let white = tinted.with_base(Colour::WHITE).straight(0.7).0[0];
    assert!((tinted.straight(0.7).0[1] - 0.5 * white).abs() < 1e-12);
}
