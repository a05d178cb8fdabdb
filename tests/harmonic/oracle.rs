//! All crossings of a line with a star-shaped surface, with certainty: the oracle of first hits.
//!
//! Along the line the direction is cos a u + sin a d, the distance from the centre p/cos a, and t(a) = r(a) cos a - p, positive inside, is a
//! trigonometric polynomial of degree N + 1. Its coefficients come from 2N + 4 values; intervals are halved until its second
//! derivative, bounded by the coefficients, leaves no root or exactly one.

use lampyris::geometry::harmonic::Series;
use lampyris::math::{DVec3, PI, atan2, sin_cos, tan};

/// Crossings in ascending order of distance, each a sign change.
pub struct Crossings {
    pub distances: Vec<f64>,
    /// True where an extremum lies so near zero that nobody can tell.
    pub grazes: bool,
    /// How far the line passes the centre.
    pub foot: f64,
}

impl Crossings {
    /// How well a crossing so far from the centre is known: p/cos a of an angle that is off by a few roundings.
    pub fn resolution(&self, from_center: f64) -> f64 {
        1e-15 * from_center * from_center / self.foot
    }
}

/// Half widths below which an interval is given up.
const NARROWEST: f64 = 1e-11;
/// What counts as zero at an extremum.
const NIL: f64 = 1e-10;

/// Where the line from `o` along the unit vector `d` crosses the surface, ahead of `o`.
pub fn crossings(series: &Series, o: DVec3, d: DVec3) -> Crossings {
    let along = -o.dot(d);
    let foot = o + along * d;
    let p = foot.length();
    assert!(p > 1e-9, "a line through the centre");
    let wave = Wave::new(series, foot / p, d, p);
    let mut found = Crossings { distances: Vec::new(), grazes: false, foot: p };
    let start = atan2(-along, p);
    wave.roots(start, 0.5 * PI, &mut found);
    found.distances.iter_mut().for_each(|a| *a = along + p * tan(*a));
    found
}

/// A trigonometric polynomial: the sum of c_j cos j a + s_j sin j a.
struct Wave {
    terms: Vec<[f64; 2]>,
    second: f64,
}

impl Wave {
    fn new(series: &Series, u: DVec3, d: DVec3, p: f64) -> Wave {
        let count = 2 * series.degree() + 4;
        let step = 2.0 * PI / count as f64;
        let circle: Vec<(f64, f64)> = (0..count).map(|i| sin_cos(step * i as f64)).collect();
        let values: Vec<f64> = circle.iter().map(|&(s, c)| series.value(c * u + s * d) * c - p).collect();
        let term = |j: usize| {
            let mut term = [0.0; 2];
            for (i, value) in values.iter().enumerate() {
                let (s, c) = circle[i * j % count];
                term[0] += value * c;
                term[1] += value * s;
            }
            term.map(|t| t * if j == 0 { 1.0 } else { 2.0 } / count as f64)
        };
        let terms: Vec<[f64; 2]> = (0..=series.degree() + 1).map(term).collect();
        let second = terms.iter().enumerate().map(|(j, [c, s])| (j * j) as f64 * (c * c + s * s).sqrt()).sum();
        Wave { terms, second }
    }

    fn at(&self, a: f64) -> (f64, f64) {
        let (s, c) = sin_cos(a);
        let (mut sin, mut cos) = (0.0, 1.0);
        let (mut value, mut slope) = (0.0, 0.0);
        for (j, term) in self.terms.iter().enumerate() {
            value += term[0] * cos + term[1] * sin;
            slope += j as f64 * (term[1] * cos - term[0] * sin);
            (sin, cos) = (sin * c + cos * s, cos * c - sin * s);
        }
        (value, slope)
    }

    fn roots(&self, from: f64, to: f64, found: &mut Crossings) {
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        let (value, slope) = self.at(middle);
        if value.abs() > slope.abs() * half + 0.5 * self.second * half * half {
            return;
        }
        if slope.abs() > self.second * half {
            let (before, after) = (self.at(from).0, self.at(to).0);
            if (before < 0.0) != (after < 0.0) {
                found.distances.push(self.bisected(from, to, before < 0.0));
            }
            return;
        }
        if half < NARROWEST {
            found.grazes |= value.abs() < NIL;
            return;
        }
        self.roots(from, middle, found);
        self.roots(middle, to, found);
    }

    fn bisected(&self, mut from: f64, mut to: f64, below: bool) -> f64 {
        for _ in 0..60 {
            let middle = 0.5 * (from + to);
            if (self.at(middle).0 < 0.0) == below {
                from = middle;
            } else {
                to = middle;
            }
        }
        0.5 * (from + to)
    }
}
