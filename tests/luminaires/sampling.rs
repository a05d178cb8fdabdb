//! Directions drawn from a web: their density is the intensity over the flux.

use crate::{naive, photometry};
use lampyris::math::{DVec2, PI, cos, sin};
use lampyris::random::{Domain, Stream};
use lampyris::scene::photometric_web::Web;

/// Cells in each of the two angles.
const CELLS: usize = 12;

/// Flux of each cell over that of the web, by the midpoint rule.
fn shares(web: &Web) -> Vec<f64> {
    const FINE: usize = 60;
    let cell = |t: usize, p: usize| {
        let mut sum = 0.0;
        for i in 0..FINE {
            let angle = PI * (t as f64 + (i as f64 + 0.5) / FINE as f64) / CELLS as f64;
            for k in 0..FINE {
                let azimuth = 2.0 * PI * (p as f64 + (k as f64 + 0.5) / FINE as f64) / CELLS as f64;
                sum += web.intensity(angle, azimuth) * sin(angle);
            }
        }
        sum * (PI / (CELLS * FINE) as f64) * (2.0 * PI / (CELLS * FINE) as f64) / web.flux()
    };
    (0..CELLS * CELLS).map(|k| cell(k / CELLS, k % CELLS)).collect()
}

fn cell_of((t, p): (f64, f64)) -> usize {
    let t = ((t / PI * CELLS as f64) as usize).min(CELLS - 1);
    let p = ((p.rem_euclid(2.0 * PI) / (2.0 * PI) * CELLS as f64) as usize).min(CELLS - 1);
    t * CELLS + p
}

#[test]
fn drawn_directions_have_the_density_of_the_web() {
    const DRAWS: usize = 1 << 18;
    for name in [
        "omni_1000lm.ies",
        "full.ies",
        "half_90_270.ies",
        "uneven.ies",
        "wedge.ies",
        "type_b.ies",
        "type_a.ies",
        "upward.ies",
    ] {
        let web = photometry(name).web;
        let mut rng = Stream::new(11, Domain::Trajectory, name).generator(0);
        let mut counts = vec![0usize; CELLS * CELLS];
        for _ in 0..DRAWS {
            let (t, p) = web.sample(rng.uniform2());
            assert!(web.intensity(t, p) > 0.0, "{name}: a direction without light was drawn, {t} {p}");
            counts[cell_of((t, p))] += 1;
        }
        let (mut chi_square, mut freedom) = (0.0, -1.0);
        for (&count, share) in counts.iter().zip(shares(&web)) {
            let expected = share * DRAWS as f64;
            if expected > 20.0 {
                chi_square += (count as f64 - expected) * (count as f64 - expected) / expected;
                freedom += 1.0;
            } else {
                assert!(
                    count as f64 <= expected + 8.0 * expected.sqrt() + 8.0,
                    "{name}: {count} where {expected} are due"
                );
            }
        }
        // Six sigma of a chi-square of some dozens of degrees, near enough a normal.
        let bound = freedom + 6.0 * (2.0f64 * freedom).sqrt() + 18.0;
        assert!(chi_square < bound, "{name}: chi-square {chi_square} over {freedom}");
    }
}

#[test]
fn the_inversion_is_exact() {
    // The flux below the angle drawn for u is u of all; and a finer grid of u gives what a closed form gives.
    for name in ["full.ies", "uneven.ies", "type_a.ies", "wedge.ies"] {
        let web = photometry(name).web;
        for k in 0..1000 {
            let u = (f64::from(k) + 0.5) / 1000.0;
            let (t, _) = web.sample(DVec2::new(u, 0.5));
            let below = web.flux_within(t) / web.flux();
            assert!((below - u).abs() < 1e-12, "{name}: {below} of the flux below the angle for {u}");
        }
    }
    let omni = photometry("omni_1000lm.ies").web;
    for (x, y) in [(0.25, 0.1), (0.5, 0.75), (0.9, 0.999)] {
        let (t, p) = omni.sample(DVec2::new(x, y));
        assert!((cos(t) - (1.0 - 2.0 * x)).abs() < 1e-12 && (p - 2.0 * PI * y).abs() < 1e-12, "{t} {p}");
    }
}

#[test]
fn the_largest_intensity_is_where_the_second_reading_has_it() {
    let file = photometry("wedge.ies");
    let (t, p) = file.web.brightest();
    assert!((t - PI / 4.0).abs() < 1e-12 && (p - PI / 2.0).abs() < 1e-12);
    assert_eq!(naive::read("wedge.ies").intensity(90.0, 45.0), file.web.peak());
}
