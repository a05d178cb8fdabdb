//! The paper's own formulas (22), (23), (26) - (28), (30) - (33), with its functions Q_k^m, which carry the Condon-Shortley
//! sign and no sqrt(2): the same object, the same gradient up to the factor r sin theta, the same points of rays.

use super::{direction, generator, objects, polar};
use lampyris::geometry::harmonic::{Star, basis};
use lampyris::math::{DVec3, PI, acos, atan2, sin_cos};
use lampyris::random::sphere;

/// Q_k^m = (-1)^m S_k^m / sqrt(2 - delta_m0); 0 for m > k; for m = -1 by its symmetry, -Q_k^1.
fn q(functions: &[[f64; 2]], k: usize, m: i64) -> f64 {
    if m < 0 {
        return -q(functions, k, -m);
    }
    let m = m as usize;
    if m > k {
        return 0.0;
    }
    let s = functions[k * (k + 1) / 2 + m][0];
    if m == 0 { s } else { s * if m % 2 == 1 { -1.0 } else { 1.0 } / 2f64.sqrt() }
}

/// r, dr/dtheta and dr/dphi by (22), (23), (26) and (27).
fn by_the_paper(pairs: &[[f64; 2]], theta: f64, phi: f64) -> (f64, f64, f64) {
    let degree = (0..).find(|n| (n + 1) * (n + 2) / 2 == pairs.len()).unwrap();
    let functions = basis(degree + 1, direction(theta, 0.0));
    let sin = sin_cos(theta).0;
    let (mut r, mut by_theta, mut by_phi) = (0.0, 0.0, 0.0);
    for k in 0..=degree {
        for m in 0..=k {
            // c Q cos m phi + s Q sin m phi with the paper's Q: its coefficients are ours times sqrt(2) (-1)^m.
            let [c, s] = pairs[k * (k + 1) / 2 + m]
                .map(|x| if m == 0 { x } else { x * 2f64.sqrt() * if m % 2 == 1 { -1.0 } else { 1.0 } });
            let (sin_m, cos_m) = sin_cos(m as f64 * phi);
            let (kf, mf) = (k as f64, m as f64);
            let value = q(&functions, k, m as i64);
            // (26): 2 dQ/dtheta = sqrt((k-m)(k+m+1)) Q_k^(m+1) - sqrt((k+m)(k-m+1)) Q_k^(m-1).
            let up = ((kf - mf) * (kf + mf + 1.0)).sqrt() * q(&functions, k, m as i64 + 1);
            let down = ((kf + mf) * (kf - mf + 1.0)).sqrt() * q(&functions, k, m as i64 - 1);
            // (27): 2 m Q/sin = -(sqrt((k+m)(k+m-1)) Q_(k-1)^(m-1) + sqrt((k-m)(k-m-1)) Q_(k-1)^(m+1)).
            let over_sin = if m == 0 {
                0.0
            } else {
                -0.5 * (((kf + mf) * (kf + mf - 1.0)).sqrt() * q(&functions, k - 1, m as i64 - 1)
                    + ((kf - mf) * (kf - mf - 1.0)).max(0.0).sqrt() * q(&functions, k - 1, m as i64 + 1))
            };
            r += value * (c * cos_m + s * sin_m);
            by_theta += 0.5 * (up - down) * (c * cos_m + s * sin_m);
            by_phi += over_sin * sin * (s * cos_m - c * sin_m);
        }
    }
    (r, by_theta, by_phi)
}

#[test]
fn the_papers_functions_derivatives_and_normal_are_ours() {
    let series = objects::rough(12, &mut generator("paper"));
    let (star, pairs) = (Star::new(series.clone()).unwrap(), series.pairs());
    let mut rng = generator("angles");
    for _ in 0..200 {
        let (theta, phi) = (0.02 + (PI - 0.04) * rng.uniform(), 2.0 * PI * rng.uniform());
        let (r, by_theta, by_phi) = by_the_paper(&pairs, theta, phi);
        let slope = series.slope(direction(theta, phi));
        let (sin, cos) = sin_cos(theta);
        let (our_theta, our_phi) = polar(slope.gradient, theta, phi);
        assert!((r - slope.value).abs() < 1e-12);
        assert!((by_theta - our_theta).abs() < 1e-11, "{by_theta} {our_theta}");
        assert!((by_phi - our_phi * sin).abs() < 1e-11, "{by_phi} {}", our_phi * sin);
        // (28): r sin theta times the gradient of r - |x|, which points inward and vanishes at the poles.
        let (sin_phi, cos_phi) = sin_cos(phi);
        let by_28 = DVec3::new(
            by_theta * sin * cos * cos_phi - by_phi * sin_phi - r * sin * sin * cos_phi,
            by_theta * sin * cos * sin_phi + by_phi * cos_phi - r * sin * sin * sin_phi,
            -by_theta * sin * sin - r * sin * cos,
        );
        let (normal, _) = star.normal_and_area(direction(theta, phi));
        assert!((by_28.normalize() + normal).length() < 1e-11, "{by_28} {normal}");
    }
}

#[test]
fn the_papers_angles_along_a_ray_lead_to_the_same_crossing() {
    let star = Star::new(objects::reference()).unwrap();
    let pairs = star.series().pairs();
    let mut rng = generator("rays of the paper");
    let mut met = 0;
    for _ in 0..300 {
        let o = 2.5 * sphere(rng.uniform2());
        let d = (1.2 * rng.uniform() * sphere(rng.uniform2()) - o).normalize();
        let Some(crossing) = star.first_crossing(o, d, f64::INFINITY) else { continue };
        met += 1;
        // (30) - (33): theta and phi of o + xi d, and |x| = r(theta, phi) there.
        let x = o + crossing.distance * d;
        let (theta, phi) = (acos(x.z / x.length()), atan2(x.y, x.x));
        let (r, ..) = by_the_paper(&pairs, theta, phi);
        assert!((r - x.length()).abs() < 1e-11, "{r} {}", x.length());
    }
    assert!(met > 100, "{met}");
}
