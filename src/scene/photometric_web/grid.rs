//! The web itself: luminous intensity between the measured directions, its flux in closed form, and its exact inversion.
//!
//! Directions are an angle t from a pole and an azimuth p around it. Between four neighbouring directions the intensity is
//! bilinear in the two angles \[cd\]; a direction outside the angles measured is dark. Then with h the step of a strip of
//! t and A, B the integrals of the intensity over the azimuth at its ends
//!
//! ```text
//! flux of the strip up to t = A (cos t0 - cos t) + (B - A)/h (sin t - sin t0 - (t - t0) cos t)                   [lm]
//! ```
//!
//! and the flux of the web is the sum over the strips: no quadrature. A direction is drawn with density I/flux by inverting
//! first this function of t, then at that t the integral over the azimuth, which is quadratic between two planes.

use super::Grid;
use crate::math::{DVec2, PI, cos, sin};

/// Halvings and Newton steps until the interval of an angle is as narrow as an f64: 60 halvings would do.
const STEPS: usize = 64;

/// Luminous intensity over the sphere.
#[derive(Clone, Debug, PartialEq)]
pub struct Web {
    /// Angles from the pole, growing \[rad\].
    polar: Vec<f64>,
    /// Azimuths, growing over at most a full turn \[rad\].
    azimuth: Vec<f64>,
    /// Of each polar angle the intensities at all azimuths \[cd\].
    intensity: Vec<f64>,
    /// Of each polar angle the integrals of the intensity from the first azimuth to each \[cd rad\].
    running: Vec<f64>,
    /// Flux from the first polar angle to each \[lm\].
    strips: Vec<f64>,
}

/// Two neighbours in a list and how far between them something is, 0 ..= 1.
#[derive(Clone, Copy)]
struct Between {
    low: usize,
    share: f64,
}

impl Web {
    /// The web of `grid`, whose angles grow and are two or more in each of the two.
    pub(super) fn new(grid: Grid) -> Web {
        let Grid { polar, azimuth, intensity } = grid;
        let columns = azimuth.len();
        let mut running = Vec::with_capacity(intensity.len());
        for row in intensity.chunks_exact(columns) {
            let mut sum = 0.0;
            running.push(sum);
            for k in 1..columns {
                sum += 0.5 * (row[k - 1] + row[k]) * (azimuth[k] - azimuth[k - 1]);
                running.push(sum);
            }
        }
        let mut web = Web { polar, azimuth, intensity, running, strips: vec![0.0] };
        for i in 0..web.polar.len() - 1 {
            let flux = web.strips[i] + web.strip_flux(i, web.polar[i + 1]);
            web.strips.push(flux);
        }
        web
    }

    /// Memory \[bytes\].
    pub fn bytes(&self) -> u64 {
        (8 * (self.intensity.len() + self.running.len())) as u64
    }

    /// Luminous flux \[lm\].
    pub fn flux(&self) -> f64 {
        self.strips[self.strips.len() - 1]
    }

    /// Largest intensity \[cd\].
    pub fn peak(&self) -> f64 {
        self.intensity.iter().copied().fold(0.0, f64::max)
    }

    /// The direction of the largest intensity, the first of several: angle from the pole and azimuth \[rad\].
    pub fn brightest(&self) -> (f64, f64) {
        let peak = self.peak();
        let at = self.intensity.iter().position(|&i| i == peak).unwrap_or(0);
        (self.polar[at / self.azimuth.len()], self.azimuth[at % self.azimuth.len()])
    }

    /// Flux at angles from the pole up to `t` \[lm\].
    pub fn flux_within(&self, t: f64) -> f64 {
        match self.polar.partition_point(|&edge| edge <= t) {
            0 => 0.0,
            n if n == self.polar.len() => self.flux(),
            n => self.strips[n - 1] + self.strip_flux(n - 1, t),
        }
    }

    /// Luminous intensity at the angle `t` from the pole and the azimuth `p` \[cd\].
    pub fn intensity(&self, t: f64, p: f64) -> f64 {
        let first = self.azimuth[0];
        let turned = first + (p - first).rem_euclid(2.0 * PI);
        // A hair below the first azimuth is not a full turn above it.
        let turned = if turned - first >= 2.0 * PI { first } else { turned };
        let (Some(row), Some(column)) = (between(&self.polar, t), between(&self.azimuth, turned)) else { return 0.0 };
        let at = |i: usize| {
            let k = i * self.azimuth.len() + column.low;
            mix(self.intensity[k], self.intensity[k + 1], column.share)
        };
        mix(at(row.low), at(row.low + 1), row.share)
    }

    /// The direction to which `u`, uniform in the unit square, is mapped with density I/flux: angle from the pole and
    /// azimuth \[rad\]. A web without flux has none.
    pub fn sample(&self, u: DVec2) -> (f64, f64) {
        let target = u.x * self.flux();
        let strip = self.strips.partition_point(|&flux| flux <= target).clamp(1, self.strips.len() - 1) - 1;
        let t = self.polar_at(strip, target - self.strips[strip]);
        let share = (t - self.polar[strip]) / (self.polar[strip + 1] - self.polar[strip]);
        (t, self.azimuth_at(Between { low: strip, share }, u.y))
    }

    /// Flux of strip `i` from its lower edge to `t` \[lm\].
    fn strip_flux(&self, i: usize, t: f64) -> f64 {
        let (from, to) = (self.polar[i], self.polar[i + 1]);
        let (low, high) = (self.ring(i), self.ring(i + 1));
        let step = t - from;
        // cos t0 - cos t without cancellation.
        let caps = 2.0 * sin(0.5 * (t + from)) * sin(0.5 * step);
        low * caps + (high - low) / (to - from) * (sin(t) - sin(from) - step * cos(t))
    }

    /// Integral of the intensity over the azimuth at polar angle number `i` \[cd rad\].
    fn ring(&self, i: usize) -> f64 {
        self.running[(i + 1) * self.azimuth.len() - 1]
    }

    /// The polar angle up to which strip `i` has the flux `target`: Newton's method, kept inside by halving.
    fn polar_at(&self, i: usize, target: f64) -> f64 {
        let (mut low, mut high) = (self.polar[i], self.polar[i + 1]);
        let (from, slope) = (low, (self.ring(i + 1) - self.ring(i)) / (high - low));
        let mut t = 0.5 * (low + high);
        for _ in 0..STEPS {
            let excess = self.strip_flux(i, t) - target;
            if excess > 0.0 {
                high = t;
            } else {
                low = t;
            }
            let density = (self.ring(i) + slope * (t - from)) * sin(t);
            let newton = t - excess / density;
            // Written so that NaN, from a density of zero, is halved.
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            if next == t {
                break;
            }
            t = next;
        }
        t
    }

    /// The azimuth up to which the share `u` of the intensity at one polar angle lies.
    fn azimuth_at(&self, row: Between, u: f64) -> f64 {
        let columns = self.azimuth.len();
        let (a, b) = (row.low * columns, (row.low + 1) * columns);
        let sum = |k: usize| mix(self.running[a + k], self.running[b + k], row.share);
        let value = |k: usize| mix(self.intensity[a + k], self.intensity[b + k], row.share);
        let target = u * sum(columns - 1);
        let mut last = 0;
        let mut beyond = columns - 1;
        while beyond - last > 1 {
            let middle = (last + beyond) / 2;
            if sum(middle) <= target {
                last = middle;
            } else {
                beyond = middle;
            }
        }
        let width = self.azimuth[last + 1] - self.azimuth[last];
        let (low, high) = (value(last), value(last + 1));
        let rest = (target - sum(last)) / width;
        // Root of low s + (high - low) s^2/2 = rest in the form that never subtracts near equals.
        let root = (low * low + 2.0 * (high - low) * rest).max(0.0).sqrt();
        let share = if low + root > 0.0 { (2.0 * rest / (low + root)).clamp(0.0, 1.0) } else { 0.0 };
        self.azimuth[last] + share * width
    }
}

/// Where `x` lies in the growing `list`; `None` outside of it.
fn between(list: &[f64], x: f64) -> Option<Between> {
    let above = list.partition_point(|&edge| edge <= x);
    if above == 0 || (above == list.len() && x > list[above - 1]) {
        return None;
    }
    let low = (above - 1).min(list.len() - 2);
    Some(Between { low, share: (x - list[low]) / (list[low + 1] - list[low]) })
}

fn mix(a: f64, b: f64, share: f64) -> f64 {
    a + (b - a) * share
}
