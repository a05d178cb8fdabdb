//! Directions towards a ball, uniform in projected solid angle: what an unobstructed ball gives a matt receiver then has no variance.
//!
//! Directions are points of the unit disc in the plane of the receiver, on which equal areas are equal shares of illuminance (Nusselt). A cap of
//! the half angle s around a direction at the angle t from the normal covers
//!
//! ```text
//! the ellipse about (cos s sin t, 0) with the half axes a = sin s |cos t| and b = sin s     where all of it is above the horizon
//! between that ellipse and the unit circle, which touch at y_t                              where it is partly below
//! ```
//!
//! In the second case a point is drawn by its y, from the area up to there, and then by its x (after Urena and Gamito 2018).

use crate::math::{DVec2, DVec3, asin, frame};
use crate::random::disc;

/// Least area: less is rounding \[1\].
const LEAST: f64 = 1e-12;
/// Steps of Newton's method in a bracket, which halves at least.
const STEPS: u32 = 64;
/// Share of the area to which y is found.
const PRECISION: f64 = 1e-14;

/// The part above the horizon of the directions in which a ball is seen.
#[derive(Clone, Copy, Debug)]
pub struct ProjectedCap {
    /// Axes of the disc, the first towards the ball, and the normal.
    axes: [DVec3; 3],
    /// Middle of the ellipse, and its half axes.
    center: f64,
    a: f64,
    b: f64,
    /// y_t, and on which side of the ellipse the part above lies: 1 behind its near side, -1 behind its far one. `None`: all is above.
    across: Option<(f64, f64)>,
    /// Projected solid angle \[sr\].
    pub area: f64,
}

impl ProjectedCap {
    /// The ball with its middle at `way` from the receiver with `normal`, and with this radius; `None` where nothing of it is above the
    /// horizon, or the receiver lies within.
    pub fn new(way: DVec3, radius: f64, normal: DVec3) -> Option<ProjectedCap> {
        let sin2 = radius * radius / way.length_squared();
        if sin2.is_nan() || sin2 >= 1.0 {
            return None;
        }
        let (sin, cos) = (sin2.sqrt(), (1.0 - sin2).sqrt());
        let towards = way.normalize();
        let cosine = towards.dot(normal);
        let flat = towards - cosine * normal;
        let x = flat.try_normalize().unwrap_or_else(|| frame(normal).0);
        let sine = flat.length();
        let mut cap = ProjectedCap {
            axes: [x, normal.cross(x), normal],
            center: cos * sine,
            a: sin * cosine.abs(),
            b: sin,
            across: None,
            area: std::f64::consts::PI * sin2 * cosine,
        };
        if cosine < sin {
            let touch = cos / sine;
            let y = (1.0 - touch * touch).max(0.0).sqrt().min(sin);
            cap.across = Some((y, cosine.signum()));
            cap.area = 2.0 * cap.up_to(cap.highest());
        }
        (cosine > -sin && cap.area > LEAST).then_some(cap)
    }

    /// Greatest y of the part above.
    fn highest(&self) -> f64 {
        match self.across {
            Some((touch, side)) if side < 0.0 => touch,
            _ => self.b,
        }
    }

    /// Its area between 0 and `y`, where it is partly below.
    fn up_to(&self, y: f64) -> f64 {
        let (touch, side) = self.across.unwrap_or_default();
        let within = y.min(touch);
        let ellipse = |y: f64| self.a * self.b * under_circle(y / self.b);
        let beside = under_circle(within) - self.center * within + side * ellipse(within);
        beside + 2.0 * (ellipse(y) - ellipse(within))
    }

    /// The x between which it lies at `y`.
    fn ends(&self, y: f64) -> (f64, f64) {
        let (touch, side) = self.across.unwrap_or_default();
        let half = self.a * (1.0 - (y / self.b) * (y / self.b)).max(0.0).sqrt();
        let far = if y < touch { (1.0 - y * y).sqrt() } else { self.center + half };
        (self.center - side * half, far)
    }

    /// The y up to which its area is `share` of half of the whole.
    fn height(&self, share: f64) -> f64 {
        let target = share * 0.5 * self.area;
        let (mut low, mut high) = (0.0, self.highest());
        let mut y = share * high;
        for _ in 0..STEPS {
            let off = self.up_to(y) - target;
            if off.abs() <= PRECISION * self.area {
                break;
            }
            if off > 0.0 {
                high = y
            } else {
                low = y
            }
            let (near, far) = self.ends(y);
            let next = y - off / (far - near);
            y = if next > low && next < high { next } else { 0.5 * (low + high) };
        }
        y
    }

    /// The direction that `u` draws, a unit vector.
    pub fn direction(&self, u: DVec2) -> DVec3 {
        let point = match self.across {
            None => DVec2::new(self.center, 0.0) + DVec2::new(self.a, self.b) * disc(u),
            Some(_) => {
                let y = self.height((2.0 * u.y - 1.0).abs());
                let (near, far) = self.ends(y);
                DVec2::new(near + u.x * (far - near), if u.y < 0.5 { -y } else { y })
            }
        };
        let [x, y, normal] = self.axes;
        (point.x * x + point.y * y + (1.0 - point.length_squared()).max(0.0).sqrt() * normal).normalize()
    }
}

/// int sqrt(1 - t^2) dt from 0 to t.
fn under_circle(t: f64) -> f64 {
    let t = t.min(1.0);
    0.5 * (t * (1.0 - t * t).max(0.0).sqrt() + asin(t))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{PI, sin_cos};
    use crate::random::{Domain, Stream, around_z, evenly};

    /// Projected solid angle by a lattice over the cap.
    fn by_lattice(angle: f64, sine: f64) -> f64 {
        let (sin, cos) = sin_cos(angle);
        let axis = DVec3::new(sin, 0.0, cos);
        let height = 1.0 - (1.0 - sine * sine).sqrt();
        let n = 2_000_000;
        let cosine = |k| {
            let u = evenly(DVec2::splat(0.5), k);
            crate::math::to_world(axis, around_z(1.0 - height * u.x, u.y)).z.max(0.0)
        };
        2.0 * PI * height * (0..n).map(cosine).sum::<f64>() / n as f64
    }

    #[test]
    fn areas_are_those_of_a_lattice_and_directions_fill_them_evenly() {
        let mut rng = Stream::new(3, Domain::Pilot, "cap").generator(0);
        for (degrees, sine) in
            [(0.0, 0.3), (50.0, 0.3), (80.0, 0.3), (95.0, 0.3), (60.0, 0.9), (130.0, 0.9), (90.0, 0.5)]
        {
            let angle = degrees * PI / 180.0;
            let (sin, cos) = sin_cos(angle);
            let towards = DVec3::new(sin, 0.0, cos);
            let cap = ProjectedCap::new(2.0 * towards, 2.0 * sine, DVec3::Z).unwrap();
            let expected = by_lattice(angle, sine);
            assert!((cap.area - expected).abs() < 2e-4 * expected, "{degrees}, {sine}: {} not {expected}", cap.area);
            // Uniform on the disc: means of x, and of y where it is not symmetric, against the lattice are those of a uniform density.
            let (n, mut inside, mut mean) = (20_000, 0, DVec2::ZERO);
            for _ in 0..n {
                let v = cap.direction(rng.uniform2());
                assert!(v.z >= 0.0 && (v.length() - 1.0).abs() < 1e-12);
                inside += u32::from(v.dot(towards) > (1.0 - sine * sine).sqrt() - 1e-9);
                mean += DVec2::new(v.x, v.y) / f64::from(n);
            }
            assert_eq!(inside, n, "{degrees}, {sine}");
            assert!(mean.y.abs() < 5.0 * cap.b / f64::from(n).sqrt(), "{degrees}, {sine}: {mean}");
        }
    }

    #[test]
    fn points_of_a_cap_across_the_horizon_are_uniform() {
        // Kolmogorov's distance of y, and of x within its ends, from uniform shares of area.
        let mut rng = Stream::new(4, Domain::Pilot, "cap").generator(0);
        for degrees in [70.0, 110.0] {
            let (sin, cos) = sin_cos(degrees * PI / 180.0);
            let cap = ProjectedCap::new(DVec3::new(sin, 0.0, cos), 0.6, DVec3::Z).unwrap();
            let n = 4000;
            let mut shares: Vec<f64> = (0..n)
                .map(|_| {
                    let y = cap.direction(rng.uniform2()).y;
                    0.5 + y.signum() * cap.up_to(y.abs()) / cap.area
                })
                .collect();
            shares.sort_by(f64::total_cmp);
            let far =
                shares.iter().enumerate().map(|(i, s)| (s - (i as f64 + 0.5) / n as f64).abs()).fold(0.0, f64::max);
            // 1.95/sqrt(n): exceeded once in a thousand times, and the seed is fixed.
            assert!(far < 1.95 / (n as f64).sqrt(), "{degrees}: {far}");
        }
    }

    #[test]
    fn below_the_horizon_and_inside_there_is_none() {
        assert!(ProjectedCap::new(DVec3::new(0.1, 0.0, -1.0), 0.5, DVec3::Z).is_none());
        assert!(ProjectedCap::new(DVec3::new(0.1, 0.0, 1.0), 1.5, DVec3::Z).is_none());
        assert!(ProjectedCap::new(DVec3::ZERO, 1.0, DVec3::Z).is_none());
    }
}
