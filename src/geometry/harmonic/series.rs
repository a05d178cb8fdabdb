//! Series of real spherical harmonics on the unit sphere.
//!
//! Schmidt semi-normalised functions with sqrt(2) for m > 0 and without the Condon-Shortley sign:
//!
//! ```text
//! S_k^m(theta) = sqrt(2 - delta_m0) sqrt((k-m)!/(k+m)!) sin^m d^m P_k/dz^m,   z = cos theta
//! r(n)         = sum over k = 0..N, m = 0..k of (c_km cos m phi + s_km sin m phi) S_k^m
//! norm^2       = 4 pi/(2k+1) of every function;   the sum over m of their squares is 1 at every point
//! ```
//!
//! With H_k^m(z) = S_k^m/sin^m, which obeys a recurrence over k without factorials, and (x + i y)^m = C_m + i D_m nothing
//! is singular at the poles, and no trigonometric function is needed:
//!
//! ```text
//! r = sum_m (A_m C_m + B_m D_m),   A_m = sum_k c_km H_k^m(z),   B_m = sum_k s_km H_k^m(z)
//! g = (sum m (A_m C_(m-1) + B_m D_(m-1)),  sum m (B_m C_(m-1) - A_m D_(m-1)),  sum (A'_m C_m + B'_m D_m))
//! ```
//!
//! In the recurrence stands z^2 + (x^2 + y^2) where it could be 1: what rounding leaves of a unit vector would count k^2 times
//! near the poles else, and k times so.
//! The gradient on the sphere is g - (g,n) n. The functions are those of the paper's (18) times sqrt(2) (-1)^m, m > 0.

#![allow(clippy::needless_range_loop, reason = "several arrays go by one lane")]

use crate::error::{Error, Result};
use crate::geometry::simd::{Isa, Kernel, Path};
use crate::math::{DMat3, DVec3};
use std::ops::RangeInclusive;

/// The largest degree N.
pub const MAX_DEGREE: usize = 128;

/// A real function on the unit sphere as a sum of spherical harmonics up to a degree.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    degree: usize,
    /// Orders one after the other, degrees k = m ..= N in each.
    pub(super) terms: Vec<Term>,
    /// The same, [`LANES`] orders side by side.
    groups: Vec<Vec<Row>>,
    path: Path,
}

/// Orders that are summed side by side: two registers of AVX2, so that one waits less for the other, and sums stay in registers.
const LANES: usize = 8;

/// Directions that share what does not depend on x and y: as many as mirrors in x, y and x = y make of one.
pub(super) const ROUND: usize = 8;

/// Terms with the same k - m of neighbouring orders m; 0 beyond the degree of the series.
#[derive(Clone, Debug, PartialEq)]
struct Row {
    cosine: [f64; LANES],
    sine: [f64; LANES],
    ahead: [f64; LANES],
    behind: [f64; LANES],
}

/// A pair of coefficients and the recurrence that leads to its function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Term {
    cosine: f64,
    sine: f64,
    /// H_k = `ahead` z H_(k-1) - `behind` H_(k-2); `ahead` of k = m is H_m^m itself.
    pub(super) ahead: f64,
    pub(super) behind: f64,
}

/// Value and gradient in a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slope {
    /// r(n).
    pub value: f64,
    /// The gradient of r on the sphere, orthogonal to n \[unit of r per rad\].
    pub gradient: DVec3,
}

/// Value and derivatives in a direction, of the function of x, y and z that is r on the sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bend {
    /// r(n).
    pub value: f64,
    /// g; the part across n is the gradient on the sphere \[unit of r per rad\].
    pub g: DVec3,
    /// Second derivatives.
    pub hessian: DMat3,
}

impl Bend {
    /// The gradient of r on the sphere, in the direction `n` that this belongs to.
    pub fn slope(&self, n: DVec3) -> Slope {
        Slope { value: self.value, gradient: self.g - self.g.dot(n) * n }
    }
}

/// Coefficients of degree k and order m stand at `index(k, m)`: degree after degree, orders in each.
pub(super) fn index(k: usize, m: usize) -> usize {
    k * (k + 1) / 2 + m
}

impl Series {
    /// The series with the pairs c_km, s_km, degree after degree, orders m = 0 ..= k in each.
    ///
    /// # Errors
    /// [`Error::Input`] for a number of pairs that no degree up to [`MAX_DEGREE`] has, an s_k0 that is not 0, or a number
    /// that is not finite.
    pub fn new(pairs: &[[f64; 2]]) -> Result<Series> {
        let degree = (0..=MAX_DEGREE).find(|&n| index(n + 1, 0) == pairs.len()).ok_or_else(|| {
            let allowed = format!("(N + 1)(N + 2)/2 of them, N from 0 to {MAX_DEGREE}");
            Error::input("series", "pairs of coefficients", pairs.len(), allowed)
        })?;
        if let Some(wrong) = pairs.iter().flatten().find(|c| !c.is_finite()) {
            return Err(Error::input("series", "coefficient", wrong, "finite numbers"));
        }
        if let Some(k) = (0..=degree).find(|&k| pairs[index(k, 0)][1] != 0.0) {
            return Err(Error::input("series", format!("s of degree {k}, order 0"), pairs[index(k, 0)][1], "0"));
        }
        let mut terms = Vec::with_capacity(pairs.len());
        let mut first = 1.0;
        for m in 0..=degree {
            // sqrt(2) of m > 0 comes in at m = 1, where sqrt((2m - 1)/(2m)) is sqrt(1/2).
            first *= if m >= 2 { ((2 * m - 1) as f64 / (2 * m) as f64).sqrt() } else { 1.0 };
            for k in m..=degree {
                let [cosine, sine] = pairs[index(k, m)];
                let below = ((k * k - m * m) as f64).sqrt();
                let (ahead, behind) = match k - m {
                    0 => (first, 0.0),
                    1 => ((2 * k - 1) as f64 / below, 0.0),
                    _ => ((2 * k - 1) as f64 / below, (((k - 1) * (k - 1) - m * m) as f64).sqrt() / below),
                };
                terms.push(Term { cosine, sine, ahead, behind });
            }
        }
        let groups = groups(degree, &terms);
        Ok(Series { degree, terms, groups, path: Path::chosen().unwrap_or(Path::Scalar) })
    }

    /// The constant function.
    pub fn constant(value: f64) -> Series {
        Series::new(&[[value, 0.0]]).expect("one finite coefficient")
    }

    /// N.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// The pairs c_km, s_km, degree after degree, orders m = 0 ..= k in each.
    pub fn pairs(&self) -> Vec<[f64; 2]> {
        let mut pairs = vec![[0.0; 2]; self.terms.len()];
        self.for_each(|k, m, term| pairs[index(k, m)] = [term.cosine, term.sine]);
        pairs
    }

    /// The same series up to `degree`, if it goes farther.
    pub fn truncated(&self, degree: usize) -> Series {
        let degree = degree.min(self.degree);
        Series::new(&self.pairs()[..index(degree + 1, 0)]).expect("coefficients of a series")
    }

    pub(super) fn for_each(&self, mut f: impl FnMut(usize, usize, &Term)) {
        let mut terms = self.terms.iter();
        for m in 0..=self.degree {
            for (k, term) in (m..=self.degree).zip(terms.by_ref()) {
                f(k, m, term);
            }
        }
    }

    /// r in the direction of the unit vector `n`.
    pub fn value(&self, n: DVec3) -> f64 {
        self.path.run(At::<0, LANES> { series: self, n }).value
    }

    /// r and its gradient in the direction of the unit vector `n`.
    pub fn slope(&self, n: DVec3) -> Slope {
        let bend = self.path.run(At::<1, LANES> { series: self, n });
        Slope { value: bend.value, gradient: bend.g - bend.g.dot(n) * n }
    }

    /// r, g and the second derivatives in the direction of the unit vector `n`.
    pub fn bend(&self, n: DVec3) -> Bend {
        self.path.run(At::<2, { LANES / 2 }> { series: self, n })
    }

    /// The same in each of some directions with the same z, and the same x^2 + y^2 to the last bit.
    pub(super) fn round(&self, directions: &[DVec3; ROUND]) -> [Bend; ROUND] {
        self.path.run(Round { series: self, directions })
    }

    /// The norm |c_k| of the coefficients of each degree: sqrt(sum over m of c^2 + s^2), which bounds that part of r everywhere.
    pub fn norms(&self) -> Vec<f64> {
        let mut squares = vec![0.0; self.degree + 1];
        self.for_each(|k, _, term| squares[k] += term.cosine * term.cosine + term.sine * term.sine);
        squares.into_iter().map(f64::sqrt).collect()
    }

    /// The mean of r.
    pub fn mean(&self) -> f64 {
        self.terms[0].cosine * self.terms[0].ahead
    }
}

/// The terms, orders side by side.
fn groups(degree: usize, terms: &[Term]) -> Vec<Vec<Row>> {
    let zero = Row { cosine: [0.0; LANES], sine: [0.0; LANES], ahead: [0.0; LANES], behind: [0.0; LANES] };
    let mut groups: Vec<Vec<Row>> = (0..=degree).step_by(LANES).map(|m| vec![zero.clone(); degree + 1 - m]).collect();
    let mut terms = terms.iter();
    for m in 0..=degree {
        for (row, term) in groups[m / LANES].iter_mut().zip(terms.by_ref().take(degree + 1 - m)) {
            let lane = m % LANES;
            (row.cosine[lane], row.sine[lane]) = (term.cosine, term.sine);
            (row.ahead[lane], row.behind[lane]) = (term.ahead, term.behind);
        }
    }
    groups
}

/// A series in a direction, with as many derivatives as `DERIVATIVES`, the others 0, so many lanes at once. Lanes are summed by plain operations
/// and joined order by order, so the bits are those of a loop over single terms, on any processor.
struct At<'a, const DERIVATIVES: u32, const WIDE: usize> {
    series: &'a Series,
    n: DVec3,
}

impl<const DERIVATIVES: u32, const WIDE: usize> Kernel for At<'_, DERIVATIVES, WIDE> {
    type Output = Bend;

    #[inline(always)]
    fn run<I: Isa>(self) -> Bend {
        let mut sum = Sum::new(&[self.n]);
        for (group, first) in self.series.groups.iter().zip((0..).step_by(LANES)) {
            let of = sums::<DERIVATIVES, WIDE>(group, self.n);
            sum.add::<DERIVATIVES>(&of, first..=self.series.degree);
        }
        sum.bend(0)
    }
}

/// A series in directions with the same z, and the same x^2 + y^2 to the last bit, which share what does not depend on x and y, and
/// are summed side by side.
struct Round<'a> {
    series: &'a Series,
    directions: &'a [DVec3; ROUND],
}

impl Kernel for Round<'_> {
    type Output = [Bend; ROUND];

    #[inline(always)]
    fn run<I: Isa>(self) -> [Bend; ROUND] {
        let mut sum = Sum::new(self.directions);
        for (group, first) in self.series.groups.iter().zip((0..).step_by(LANES)) {
            let of = sums::<2, { LANES / 2 }>(group, self.directions[0]);
            sum.add::<2>(&of, first..=self.series.degree);
        }
        let mut bends = [sum.bend(0); ROUND];
        for i in 1..ROUND {
            bends[i] = sum.bend(i);
        }
        bends
    }
}

/// The sums of orders in so many directions.
struct Sum<const MANY: usize> {
    x: [f64; MANY],
    y: [f64; MANY],
    value: [f64; MANY],
    g: [[f64; MANY]; 3],
    /// xx, xy, xz, yz, zz.
    second: [[f64; MANY]; 5],
    /// (x + i y)^m, and the same with m - 1 and m - 2.
    powers: [[[f64; MANY]; 2]; 3],
}

impl<const MANY: usize> Sum<MANY> {
    #[inline(always)]
    fn new(directions: &[DVec3; MANY]) -> Self {
        let zero = [0.0; MANY];
        let (mut x, mut y) = (zero, zero);
        for i in 0..MANY {
            (x[i], y[i]) = (directions[i].x, directions[i].y);
        }
        let powers = [[[1.0; MANY], zero], [zero; 2], [zero; 2]];
        Sum { x, y, value: zero, g: [zero; 3], second: [zero; 5], powers }
    }

    /// Adds the orders of a group, as far as there are any.
    #[inline(always)]
    fn add<const DERIVATIVES: u32>(&mut self, of: &[[f64; LANES]; 6], orders: RangeInclusive<usize>) {
        let Sum { x, y, value, g: [gx, gy, gz], second: [xx, xy, xz, yz, zz], powers } = self;
        for (lane, m) in (0..LANES).zip(orders) {
            let [a, b, da, db, dda, ddb] =
                [of[0][lane], of[1][lane], of[2][lane], of[3][lane], of[4][lane], of[5][lane]];
            let order = m as f64;
            let [[c, d], [c1, d1], [c2, d2]] = *powers;
            for i in 0..MANY {
                value[i] += a * c[i] + b * d[i];
            }
            if DERIVATIVES >= 1 {
                for i in 0..MANY {
                    gx[i] += order * (a * c1[i] + b * d1[i]);
                    gy[i] += order * (b * c1[i] - a * d1[i]);
                    gz[i] += da * c[i] + db * d[i];
                }
            }
            if DERIVATIVES >= 2 {
                let pairs = order * (order - 1.0);
                for i in 0..MANY {
                    xx[i] += pairs * (a * c2[i] + b * d2[i]);
                    xy[i] += pairs * (b * c2[i] - a * d2[i]);
                    xz[i] += order * (da * c1[i] + db * d1[i]);
                    yz[i] += order * (db * c1[i] - da * d1[i]);
                    zz[i] += dda * c[i] + ddb * d[i];
                }
            }
            (powers[2], powers[1]) = ([c1, d1], [c, d]);
            for i in 0..MANY {
                (powers[0][0][i], powers[0][1][i]) = (c[i] * x[i] - d[i] * y[i], c[i] * y[i] + d[i] * x[i]);
            }
        }
    }

    /// What they come to in direction `i`.
    #[inline(always)]
    fn bend(&self, i: usize) -> Bend {
        let [xx, xy, xz, yz, zz] =
            [self.second[0][i], self.second[1][i], self.second[2][i], self.second[3][i], self.second[4][i]];
        // The powers are harmonic in x and y.
        let hessian = DMat3::from_cols_array(&[xx, xy, xz, xy, -xx, yz, xz, yz, zz]);
        Bend { value: self.value[i], g: DVec3::new(self.g[0][i], self.g[1][i], self.g[2][i]), hessian }
    }
}

/// A_m, B_m and their first and second derivatives by z of the orders of a group, so many at once: what is more than registers hold costs several
/// times as much.
#[inline(always)]
fn sums<const DERIVATIVES: u32, const WIDE: usize>(group: &[Row], n: DVec3) -> [[f64; LANES]; 6] {
    let across2 = n.x * n.x + n.y * n.y;
    let mut all = [[0.0; LANES]; 6];
    for first in (0..LANES).step_by(WIDE) {
        let zero = [0.0; WIDE];
        let [mut a, mut b, mut da, mut db, mut dda, mut ddb] = [zero; 6];
        // H and its derivatives of the last step, and of the one before.
        let [mut h, mut h0, mut dh, mut dh0, mut ddh, mut ddh0] = [zero; 6];
        for i in 0..WIDE {
            let row = &group[0];
            h[i] = row.ahead[first + i];
            (a[i], b[i]) = (row.cosine[first + i] * h[i], row.sine[first + i] * h[i]);
        }
        // The first of these orders has fewer terms than that of the group.
        let terms = group.len().saturating_sub(first).max(1);
        for row in &group[1..terms] {
            for i in 0..WIDE {
                let (ahead, behind) = (row.ahead[first + i], row.behind[first + i]);
                let (cosine, sine) = (row.cosine[first + i], row.sine[first + i]);
                if DERIVATIVES >= 2 {
                    let next = ahead * (2.0 * dh[i] + n.z * ddh[i]) - behind * ddh0[i];
                    (ddh0[i], ddh[i]) = (ddh[i], next);
                    dda[i] += cosine * next;
                    ddb[i] += sine * next;
                }
                if DERIVATIVES >= 1 {
                    let next = ahead * (h[i] + n.z * dh[i]) - behind * dh0[i];
                    (dh0[i], dh[i]) = (dh[i], next);
                    da[i] += cosine * next;
                    db[i] += sine * next;
                }
                let next = n.z * (ahead * h[i] - behind * (n.z * h0[i])) - behind * (across2 * h0[i]);
                (h0[i], h[i]) = (h[i], next);
                a[i] += cosine * next;
                b[i] += sine * next;
            }
        }
        let of = [a, b, da, db, dda, ddb];
        for k in 0..6 {
            all[k][first..first + WIDE].copy_from_slice(&of[k]);
        }
    }
    all
}
