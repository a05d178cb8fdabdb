//! Integrals over directions of departure, by Gauss panels that shrink with the lobe.
//!
//! In half-vector coordinates dw_out = 4 (v,h) dw_h, so int g dw_out = int g 4 (v,h) sin(theta) dtheta dphi over the polar angles of h. Shares
//! nothing with the sampling or the tables under test.

use lampyris::math::{DVec3, PI, atan2, frame, sin_cos};

/// A surface, the light that arrives there, and the polar grid of half vectors.
pub struct Incidence {
    pub normal: DVec3,
    pub w_in: DVec3,
    axes: (DVec3, DVec3),
    alpha: f64,
    /// Edges of the polar panels, from 0 to pi/2.
    pub polar: Vec<f64>,
}

/// Abscissae and weights of the three-point Gauss-Legendre rule on [0, 1].
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_31, 5.0 / 18.0), (0.5, 4.0 / 9.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

impl Incidence {
    /// Light arriving on `normal` at the cosine `mu`, for a lobe of width about `alpha`.
    pub fn new(normal: DVec3, mu: f64, alpha: f64) -> Self {
        let (t, b) = frame(normal);
        let mut polar = vec![0.0];
        let mut edge = 0.25 * alpha;
        while edge < 1.2 {
            polar.push(edge);
            edge *= 1.6;
        }
        polar.push(0.5 * PI);
        let w_in = -(normal * mu + t * (1.0 - mu * mu).max(0.0).sqrt());
        Incidence { normal, w_in, axes: (t, b), alpha, polar }
    }

    /// Calls `visit(w_out, weight)` at the nodes of `parts` Gauss panels in polar angle and azimuth.
    pub fn nodes(
        &self,
        polar: (f64, f64),
        turn: (f64, f64),
        parts: (usize, usize),
        visit: &mut impl FnMut(DVec3, f64),
    ) {
        for (theta, theta_weight) in gauss(polar, parts.0) {
            let (sin, cos) = sin_cos(theta);
            for (turn, turn_weight) in gauss(turn, parts.1) {
                let (s, c) = sin_cos(2.0 * PI * turn);
                let h = self.normal * cos + (self.axes.0 * c + self.axes.1 * s) * sin;
                let vh = -self.w_in.dot(h);
                if vh > 0.0 {
                    visit(self.w_in + 2.0 * vh * h, 8.0 * PI * vh * sin * theta_weight * turn_weight);
                }
            }
        }
    }

    /// Calls `visit(w_out, weight)` over all directions; the integrand is even in azimuth.
    ///
    /// A narrow lobe is integrated over half vectors, a wide one over the directions themselves, where the horizon
    /// is an edge of the grid.
    pub fn hemisphere(&self, mut visit: impl FnMut(DVec3, f64)) {
        if self.alpha < 0.05 {
            for edge in self.polar.windows(2) {
                self.nodes((edge[0], edge[1]), (0.0, 0.5), (5, 40), &mut |w, weight| visit(w, 2.0 * weight));
            }
            return;
        }
        for elevation in octaves(0.5 * PI) {
            for turn in octaves(0.5) {
                self.patch(elevation, turn, &mut visit);
            }
        }
    }

    /// The directions within bounds of elevation above the surface \[rad\] and of turn from the plane of incidence.
    fn patch(&self, elevation: (f64, f64), turn: (f64, f64), visit: &mut impl FnMut(DVec3, f64)) {
        for (angle, angle_weight) in gauss(elevation, 5) {
            let (mu, across) = sin_cos(angle);
            for (turn, turn_weight) in gauss(turn, 4) {
                // Half a turn lies opposite to the arrival: forward scattering, where grazing lobes are narrow.
                let (s, c) = sin_cos(2.0 * PI * (0.5 - turn));
                let w = self.normal * mu + (self.axes.0 * c + self.axes.1 * s) * across;
                visit(w, 4.0 * PI * across * angle_weight * turn_weight);
            }
        }
    }

    /// The polar panel and the turn in [0, 1) of the half vector that leads to `w_out`.
    pub fn locate(&self, w_out: DVec3) -> (usize, f64) {
        let h = w_out - self.w_in;
        let theta = atan2(self.normal.cross(h).length(), self.normal.dot(h));
        let turn = atan2(h.dot(self.axes.1), h.dot(self.axes.0)) / (2.0 * PI);
        let panel = self.polar.partition_point(|&edge| edge <= theta);
        (panel.clamp(1, self.polar.len() - 1) - 1, (turn + 1.0) % 1.0)
    }
}

/// Nodes and weights of `parts` equal Gauss panels over an interval.
fn gauss((start, end): (f64, f64), parts: usize) -> impl Iterator<Item = (f64, f64)> {
    let width = (end - start) / parts as f64;
    (0..parts).flat_map(move |i| GAUSS.map(|(x, w)| (start + (i as f64 + x) * width, w * width)))
}

/// Intervals that together are [0, `end`], each half as long as the one above it.
fn octaves(end: f64) -> impl Iterator<Item = (f64, f64)> {
    const COUNT: i32 = 9;
    let edge = move |i: i32| if i == COUNT { 0.0 } else { end / f64::from(1u32 << i) };
    (0..COUNT).map(move |i| (edge(i + 1), edge(i)))
}
