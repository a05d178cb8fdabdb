//! Objects whose hits are looked for.

use lampyris::geometry::harmonic::{Series, projection};
use lampyris::math::DVec3;
use lampyris::random::Generator;

/// The object of the reference table: N = 6.
pub fn reference() -> Series {
    let mut pairs = vec![[0.0; 2]; 28];
    let at = |k: usize, m: usize| k * (k + 1) / 2 + m;
    pairs[at(0, 0)] = [1.0, 0.0];
    pairs[at(2, 0)] = [0.2, 0.0];
    pairs[at(3, 1)] = [0.1, -0.05];
    pairs[at(4, 3)] = [0.0, 0.08];
    pairs[at(6, 6)] = [0.03, 0.0];
    Series::new(&pairs).unwrap()
}

/// An ellipsoid with half axes 1, 0.8, 1.25 to degree 16.
pub fn ellipsoid() -> Series {
    let radius = |n: &DVec3| 1.0 / (*n / DVec3::new(1.0, 0.8, 1.25)).length();
    projection(16, 34, |all| Ok(all.iter().map(radius).collect())).unwrap()
}

/// A rough object of degree `degree`: coefficients that fall as k^-2, radii from about half to one and a half.
pub fn rough(degree: usize, rng: &mut Generator) -> Series {
    let mut pairs = Vec::new();
    for k in 0..=degree {
        for m in 0..=k {
            let size = if k == 0 { 0.0 } else { 0.5 / (k * k) as f64 };
            let mut coefficient = || size * (2.0 * rng.uniform() - 1.0);
            pairs.push([coefficient(), if m == 0 { 0.0 } else { coefficient() }]);
        }
    }
    pairs[0][0] = 1.0;
    Series::new(&pairs).unwrap()
}
