//! Crossings of a line by the exact polynomial: the last resort for lines that graze a surface.
//!
//! The line passes the centre at the distance p. At the angle a from the nearest point, in the direction u, the direction
//! is n(a) = cos a u + sin a d and |x| = p/cos a, so that
//!
//! ```text
//! F cos a = p - r(n(a)) cos a = sum over j = 0 .. N + 1 of c_j cos ja + s_j sin ja
//! ```
//!
//! is a trigonometric polynomial, known from 2N + 4 of its values. Its second derivative is at most M = sum j^2 |(c_j, s_j)|.
//! So in an interval of half width h around a place with the value v and the slope v' it has no root where |v| > |v'| h + M h^2/2, and one at most
//! where |v'| > M h; intervals of which neither is known are halved, the nearer half first.

use super::Series;
use crate::math::{DVec3, PI, atan2, sin_cos, tan};

/// Half width of an interval below which a root in it is one that the line only touches.
const NARROWEST: f64 = 1e-11;
/// What the sums round, in units of the sum of the sizes of their terms.
const ROUNDING: f64 = 1e-13;
/// Halvings that leave nothing of an interval.
const HALVINGS: u32 = 60;

/// F cos a along a line, times the side on which it begins.
pub(super) struct Wave {
    terms: Vec<[f64; 2]>,
    second: f64,
    nil: f64,
    /// Distance of the line from the centre, and where on it that is.
    foot: f64,
    nearest: f64,
}

impl Wave {
    /// Of the line from `o` along the unit vector `d`, which does not meet the centre, for the surface of `series`; `side` is 1 outside and
    /// -1 inside.
    pub(super) fn new(series: &Series, o: DVec3, d: DVec3, side: f64) -> Wave {
        let nearest = -o.dot(d);
        let across = o + nearest * d;
        let foot = across.length();
        let u = across / foot;
        let count = 2 * series.degree() + 4;
        let circle: Vec<(f64, f64)> = (0..count).map(|i| sin_cos(2.0 * PI * i as f64 / count as f64)).collect();
        let value = |&(s, c): &(f64, f64)| side * (foot - series.value(c * u + s * d) * c);
        let values: Vec<f64> = circle.iter().map(value).collect();
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
        let size = |[c, s]: &[f64; 2]| (c * c + s * s).sqrt();
        let second = terms.iter().enumerate().map(|(j, term)| (j * j) as f64 * size(term)).sum();
        let nil = ROUNDING * terms.iter().map(size).sum::<f64>();
        Wave { terms, second, nil, foot, nearest }
    }

    /// How far along the line it first changes sides between the distances `from`, where it is on its side or leaves the surface, and `to`.
    pub(super) fn first(&self, from: f64, to: f64) -> Option<f64> {
        let angle = |at: f64| atan2(at - self.nearest, self.foot);
        self.within(angle(from), angle(to)).map(|a| self.nearest + self.foot * tan(a))
    }

    fn within(&self, from: f64, to: f64) -> Option<f64> {
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        let [value, slope] = self.at(middle);
        let most = slope.abs() * half + 0.5 * self.second * half * half;
        if value.abs() > most || most < self.nil || half < NARROWEST {
            return (value < -self.nil).then_some(from);
        }
        if slope.abs() <= self.second * half {
            return self.within(from, middle).or_else(|| self.within(middle, to));
        }
        if self.at(from)[0] < -self.nil {
            return Some(from);
        }
        (slope < 0.0 && self.at(to)[0] < 0.0).then(|| self.root(from, to))
    }

    /// The one root between `from`, above it, and `to`, below.
    fn root(&self, mut from: f64, mut to: f64) -> f64 {
        for _ in 0..HALVINGS {
            let middle = 0.5 * (from + to);
            *(if self.at(middle)[0] < 0.0 { &mut to } else { &mut from }) = middle;
        }
        0.5 * (from + to)
    }

    /// Value and slope at the angle `a`.
    fn at(&self, a: f64) -> [f64; 2] {
        let (s, c) = sin_cos(a);
        let (mut sine, mut cosine) = (0.0, 1.0);
        let [mut value, mut slope] = [0.0; 2];
        for (j, term) in self.terms.iter().enumerate() {
            value += term[0] * cosine + term[1] * sine;
            slope += j as f64 * (term[1] * cosine - term[0] * sine);
            (sine, cosine) = (sine * c + cosine * s, cosine * c - sine * s);
        }
        [value, slope]
    }
}
