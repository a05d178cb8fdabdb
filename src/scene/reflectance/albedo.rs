//! Directional albedo of the specular part, tabulated over the cosine of incidence.
//!
//! Schlick's factor is linear in F0 and F90, so two functions of the cosine serve all colours:
//!
//! ```text
//! a(mu) = F0 A(mu) + F90 B(mu),   A = E[g (1 - s)],  B = E[g s],  s = (1 - (v,h))^5
//! g     = law |cos| / density = mu' (k mu + t(mu)) / (mu' t(mu) + mu t(mu'))
//! ```
//!
//! with the mean over the uniform points of the cap of `microfacet`. The nodes are mu = t^4, t uniform: closer where
//! grazing light meets the roughness, down to cosines below the least alpha. Between nodes A and B are linear in t,
//! and the mean `<a>` = 2 int a mu dmu is that of the interpolated functions, so that the diffuse part made from them
//! conserves energy exactly.

use super::fresnel_rise;
use super::microfacet::Microfacets;
use crate::math::{DVec3, PI, acos, cos, gauss_legendre, sin_cos};

/// Intervals of the table.
pub(super) const INTERVALS: usize = 128;
/// Points of the Gauss-Legendre rule over the polar angle of the cap.
const POLAR: usize = 32;
/// Points of the midpoint rule over half the azimuth (the integrand is even and periodic).
const AZIMUTHS: usize = 32;

/// A and B, or their means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Coefficients {
    /// Factor of F0.
    pub a: f64,
    /// Factor of F90, the grazing rise of Schlick's factor.
    pub b: f64,
}

impl Coefficients {
    /// Those of a mirror: Schlick's factor itself.
    pub fn mirror(mu: f64) -> Self {
        let s = fresnel_rise(mu);
        Coefficients { a: 1.0 - s, b: s }
    }

    /// Means for a mirror: 2 int (1 - mu)^5 mu dmu = 1/21.
    pub const MIRROR_MEAN: Coefficients = Coefficients { a: 20.0 / 21.0, b: 1.0 / 21.0 };

    /// F0 A + F90 B.
    pub fn albedo(self, f0: f64, f90: f64) -> f64 {
        f0 * self.a + f90 * self.b
    }
}

/// A and B of one roughness.
#[derive(Clone, Debug)]
pub(super) struct AlbedoTable {
    nodes: Vec<Coefficients>,
}

impl AlbedoTable {
    /// Integrates the specular part of `facets` at every node.
    pub fn new(facets: &Microfacets) -> Self {
        // On [0, 1].
        let rule: Vec<_> = gauss_legendre(POLAR).into_iter().map(|(x, w)| (0.5 * (1.0 + x), 0.5 * w)).collect();
        let azimuths: Vec<f64> = (0..AZIMUTHS).map(|j| cos(PI * (j as f64 + 0.5) / AZIMUTHS as f64)).collect();
        let node = |i: usize| {
            let t = i as f64 / INTERVALS as f64;
            integrate(facets, t * t * t * t, &rule, &azimuths)
        };
        AlbedoTable { nodes: (0..=INTERVALS).map(node).collect() }
    }

    /// A and B at the cosine `mu`.
    pub fn at(&self, mu: f64) -> Coefficients {
        let t = mu.clamp(0.0, 1.0).sqrt().sqrt() * INTERVALS as f64;
        let i = (t as usize).min(INTERVALS - 1);
        let (p, q, x) = (self.nodes[i], self.nodes[i + 1], t - i as f64);
        Coefficients { a: p.a + (q.a - p.a) * x, b: p.b + (q.b - p.b) * x }
    }

    /// A and B at all nodes.
    pub fn nodes(&self) -> &[Coefficients] {
        &self.nodes
    }

    /// 2 int mu dmu of `at`, exactly: 8 int t^7 dt of functions linear in t over each interval.
    pub fn mean(&self) -> Coefficients {
        let mut mean = Coefficients { a: 0.0, b: 0.0 };
        for (i, ends) in self.nodes.windows(2).enumerate() {
            let (low, high) = hat_moments(i as f64, INTERVALS as f64);
            mean.a += low * ends[0].a + high * ends[1].a;
            mean.b += low * ends[0].b + high * ends[1].b;
        }
        mean
    }
}

/// 8 int t^7 dt over [i/n, (i+1)/n] of the two functions linear there that are 1 at one end and 0 at the other.
fn hat_moments(i: f64, n: f64) -> (f64, f64) {
    let eighth = |x: f64| {
        let x4 = x * x * x * x;
        x4 * x4
    };
    let j = i + 1.0;
    let whole = eighth(j) - eighth(i);
    let high = (eighth(j) * j - eighth(i) * i) * (8.0 / 9.0) - i * whole;
    ((whole - high) / eighth(n), high / eighth(n))
}

/// A and B at `mu` by the product rule over the cap.
fn integrate(facets: &Microfacets, mu: f64, rule: &[(f64, f64)], azimuths: &[f64]) -> Coefficients {
    let arrival = DVec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
    let cap = facets.cap(arrival);
    let (reach, stretched, end) = (facets.reach(mu), facets.stretched(mu), acos(-cap.depth));
    let mut sum = Coefficients { a: 0.0, b: 0.0 };
    for &(x, weight) in rule {
        let (sin, z) = sin_cos(end * x);
        for &azimuth in azimuths {
            let c = DVec3::new(sin * azimuth, sin * (1.0 - azimuth * azimuth).sqrt(), z);
            let Some(h) = cap.half_vector(c) else { continue };
            let leaving = cap.reflect(h).z;
            if leaving > 0.0 {
                let g = reach * leaving / (leaving * stretched + mu * facets.stretched(leaving));
                let s = fresnel_rise(arrival.dot(h));
                sum.a += weight * sin * g * (1.0 - s);
                sum.b += weight * sin * g * s;
            }
        }
    }
    let scale = end / ((1.0 + cap.depth) * azimuths.len() as f64);
    Coefficients { a: sum.a * scale, b: sum.b * scale }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_is_that_of_the_interpolated_functions() {
        let table = AlbedoTable::new(&Microfacets::new(0.09));
        let (n, mut sum) = (200_000, 0.0);
        for i in 0..n {
            let mu = (i as f64 + 0.5) / n as f64;
            sum += 2.0 * mu * table.at(mu).albedo(0.3, 1.0) / n as f64;
        }
        assert!((sum - table.mean().albedo(0.3, 1.0)).abs() < 1e-8);
    }
}
