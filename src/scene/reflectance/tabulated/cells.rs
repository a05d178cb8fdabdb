//! The cells of a table: integrals of the law over them, and the choice of one.
//!
//! Between nodes f is linear in each angle of departure, so that its integral over a cell is a sum over the four corners. With
//! s = sin^2(theta), over half the azimuth
//!
//! ```text
//! a = int f ds dphi = sum over cells sum over corners u_j v_k f_jk,     u_j = int h_j ds,   v_k = int h_k dphi
//! ```
//!
//! h being the functions that are 1 at one node and fall linearly to 0 at the next. Nothing is sampled: however narrow a spike of
//! the table is, it counts whole.

use crate::math::{DVec2, PI, gauss_legendre, sin};

/// Points of the rule over a polar interval: linear times sin(2 theta) over 90 degrees to 1e-14.
const POINTS: usize = 8;

/// An axis of the table, in parts between its nodes, the last of which goes to the end of the axis.
pub(super) struct Axis {
    /// Ends of the parts, ascending, in s or phi.
    edges: Vec<f64>,
    /// What the nodes below and above each part count in an integral over it.
    shares: Vec<[f64; 2]>,
    /// Number of the last node.
    last: usize,
}

impl Axis {
    /// Of polar angles `nodes` \[rad\], measured by s.
    pub(super) fn polar(nodes: &[f64]) -> Self {
        let rule = gauss_legendre(POINTS);
        let shares = |from: f64, to: f64| {
            let mut shares = [0.0; 2];
            for &(x, weight) in &rule {
                let t = 0.5 * (1.0 + x);
                let measure = 0.5 * weight * (to - from) * sin(2.0 * (from + t * (to - from)));
                shares[0] += measure * (1.0 - t);
                shares[1] += measure * t;
            }
            shares
        };
        let squared_sine = |theta: f64| sin(theta) * sin(theta);
        Axis::new(nodes, 0.5 * PI, squared_sine, shares)
    }

    /// Of azimuths `nodes` \[rad\].
    pub(super) fn azimuths(nodes: &[f64]) -> Self {
        Axis::new(nodes, PI, |phi| phi, |from, to| [0.5 * (to - from); 2])
    }

    fn new(nodes: &[f64], end: f64, measure: impl Fn(f64) -> f64, shares: impl Fn(f64, f64) -> [f64; 2]) -> Self {
        let mut ends = nodes.to_vec();
        // Beyond the last node f stays what it is there.
        if ends.last().is_some_and(|&last| last < end) {
            ends.push(end);
        }
        Axis {
            last: nodes.len() - 1,
            shares: ends.windows(2).map(|w| shares(w[0], w[1])).collect(),
            edges: ends.into_iter().map(measure).collect(),
        }
    }

    /// Number of parts.
    pub(super) fn parts(&self) -> usize {
        self.shares.len()
    }

    /// The nodes below and above `part`, with what they count in an integral over it.
    pub(super) fn corners(&self, part: usize) -> [(usize, f64); 2] {
        let [below, above] = self.shares[part];
        [(part, below), ((part + 1).min(self.last), above)]
    }

    /// The part in which `x` lies.
    fn part(&self, x: f64) -> usize {
        self.edges[1..self.parts()].partition_point(|&edge| edge <= x)
    }

    fn width(&self, part: usize) -> f64 {
        self.edges[part + 1] - self.edges[part]
    }
}

/// The cell that holds s = `place.x` and phi = `place.y`, and its area.
pub(super) fn cell([polar, azimuths]: &[Axis; 2], place: DVec2) -> (usize, f64) {
    let (row, column) = (polar.part(place.x), azimuths.part(place.y));
    (row * azimuths.parts() + column, polar.width(row) * azimuths.width(column))
}

/// The place with the shares `u` of the cell `number` along both axes: s and phi.
pub(super) fn inside([polar, azimuths]: &[Axis; 2], number: usize, u: DVec2) -> DVec2 {
    let (row, column) = (number / azimuths.parts(), number % azimuths.parts());
    let between = |axis: &Axis, part: usize, u: f64| axis.edges[part] + u * axis.width(part);
    DVec2::new(between(polar, row, u.x), between(azimuths, column, u.y))
}
