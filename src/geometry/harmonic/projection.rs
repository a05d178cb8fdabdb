//! Functions on the sphere as series: all functions of a direction, and the coefficients of a function by quadrature.

use super::series::{Series, index};
use crate::error::Result;
use crate::math::{DVec3, PI, gauss_legendre, sin_cos};

/// All functions up to `degree` in the direction of the unit vector `n`: the pairs S_k^m cos m phi, S_k^m sin m phi, degree
/// after degree, orders m = 0 ..= k in each.
pub fn basis(degree: usize, n: DVec3) -> Vec<[f64; 2]> {
    let unit = Series::new(&vec![[0.0; 2]; index(degree + 1, 0)]).expect("zeros up to a degree");
    let mut functions = vec![[0.0; 2]; unit.terms.len()];
    let (mut re, mut im) = (1.0, 0.0);
    let (mut h, mut previous) = (0.0, 0.0);
    let across2 = n.x * n.x + n.y * n.y;
    unit.for_each(|k, m, term| {
        if k == m {
            if m > 0 {
                (re, im) = (re * n.x - im * n.y, re * n.y + im * n.x);
            }
            (h, previous) = (term.ahead, 0.0);
        } else {
            let next = n.z * (term.ahead * h - term.behind * (n.z * previous)) - term.behind * (across2 * previous);
            (h, previous) = (next, h);
        }
        functions[index(k, m)] = [h * re, h * im];
    });
    functions
}

/// The coefficients of a function of direction: c_km = (2k+1)/(4 pi) int r S_k^m cos m phi dw, s_km with sin.
///
/// Gauss-Legendre in z with `nodes` nodes and twice as many equal steps of the azimuth; `of` is given all directions at once.
/// Exact for series up to degree `nodes` - 1 - `degree`/2; 2(N + 1) nodes remove aliasing.
///
/// # Errors
/// Those of `of`, and of [`Series::new`] for values that are not finite.
pub fn projection(degree: usize, nodes: usize, of: impl FnOnce(&[DVec3]) -> Result<Vec<f64>>) -> Result<Series> {
    let rule = gauss_legendre(nodes);
    let steps = 2 * nodes;
    let mut directions = Vec::with_capacity(nodes * steps);
    for &(z, _) in &rule {
        let across = (1.0 - z * z).max(0.0).sqrt();
        directions.extend((0..steps).map(|j| {
            let (sin, cos) = sin_cos(2.0 * PI * (j as f64 + 0.5) / steps as f64);
            DVec3::new(across * cos, across * sin, z)
        }));
    }
    let values = of(&directions)?;
    let mut pairs = vec![[0.0; 2]; index(degree + 1, 0)];
    for (i, (&n, value)) in directions.iter().zip(values).enumerate() {
        // 4 pi is the sum of the weights: 2 of the rule, 2 pi of the azimuth.
        let weight = value * rule[i / steps].1 * 0.5 / steps as f64;
        for (pair, function) in pairs.iter_mut().zip(basis(degree, n)) {
            pair[0] += weight * function[0];
            pair[1] += weight * function[1];
        }
    }
    for k in 0..=degree {
        for m in 0..=k {
            pairs[index(k, m)] = pairs[index(k, m)].map(|c| c * (2 * k + 1) as f64);
        }
        pairs[index(k, 0)][1] = 0.0;
    }
    Series::new(&pairs)
}
