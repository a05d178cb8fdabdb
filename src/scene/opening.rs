//! Flat convex polygons through which daylight enters a scene: they are no surfaces, only places to aim at.

use crate::math::{DVec2, DVec3, PI};

/// A window or skylight.
#[derive(Clone, Debug, PartialEq)]
pub struct Opening {
    /// Corners in its plane, counter-clockwise seen from the side of the normal \[m\].
    corners: Vec<DVec3>,
    /// Unit normal of one of its sides.
    pub normal: DVec3,
    /// Area \[m2\].
    pub area: f64,
    /// Mean of the corners \[m\].
    pub center: DVec3,
    /// Running sum of the areas of the triangles from the first corner \[m2\].
    areas: Vec<f64>,
}

impl Opening {
    /// The polygon with `corners`, which are moved into one plane.
    pub(super) fn new(corners: &[DVec3]) -> Opening {
        let center = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let across = |i: usize| (corners[i - 1] - corners[0]).cross(corners[i] - corners[0]);
        let normal = (2..corners.len()).map(across).sum::<DVec3>().normalize();
        let corners: Vec<DVec3> = corners.iter().map(|&p| p - normal.dot(p - center) * normal).collect();
        let mut areas = Vec::with_capacity(corners.len() - 2);
        let mut area = 0.0;
        for i in 2..corners.len() {
            area += 0.5 * normal.dot((corners[i - 1] - corners[0]).cross(corners[i] - corners[0])).max(0.0);
            areas.push(area);
        }
        Opening { corners, normal, area, center, areas }
    }

    /// The point that `u` draws, uniform in area \[m\].
    pub fn point(&self, u: DVec2) -> DVec3 {
        let target = u.x * self.area;
        let number = self.areas.partition_point(|&area| area <= target).min(self.areas.len() - 1);
        let before = number.checked_sub(1).map_or(0.0, |before| self.areas[before]);
        let within = ((target - before) / (self.areas[number] - before)).clamp(0.0, 1.0).sqrt();
        let [a, b, c] = [self.corners[0], self.corners[number + 1], self.corners[number + 2]];
        a * (1.0 - within) + b * (within * (1.0 - u.y)) + c * (within * u.y)
    }

    /// Where the line from `origin` along the unit vector `direction` passes through, in metres from the origin, before or behind it.
    pub fn crossing(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let distance = self.normal.dot(self.center - origin) / self.normal.dot(direction);
        if !distance.is_finite() {
            return None;
        }
        let p = origin + distance * direction;
        let next = self.corners.iter().cycle().skip(1);
        let inside = |(&a, &b): (&DVec3, &DVec3)| self.normal.dot((b - a).cross(p - a)) >= 0.0;
        self.corners.iter().zip(next).all(inside).then_some(distance)
    }
}

impl Opening {
    /// About the share that it takes of what a small matt surface at `position` with the unit normal `normal` sends out: nothing is
    /// asked for what stands between.
    pub fn share_of(&self, position: DVec3, normal: DVec3) -> f64 {
        let way = self.center - position;
        let d2 = way.length_squared();
        let cosines = way.dot(normal).max(0.0) * way.dot(self.normal).abs() / d2.max(f64::MIN_POSITIVE);
        self.area * cosines / (PI * d2 + self.area)
    }
}

/// Directions from a point to openings, each chosen about in proportion to its solid angle.
#[derive(Debug)]
pub struct Aim<'a> {
    openings: &'a [Opening],
    from: DVec3,
    /// Running sum of their probabilities.
    chosen: Vec<f64>,
}

impl<'a> Aim<'a> {
    /// From the point `from` to `openings`.
    pub fn new(openings: &'a [Opening], from: DVec3) -> Self {
        let size = |opening: &Opening| {
            let way = opening.center - from;
            let d2 = way.length_squared();
            let cosine = opening.normal.dot(way).abs() / d2.sqrt().max(f64::MIN_POSITIVE);
            opening.area * (0.1 + cosine) / (d2 + opening.area)
        };
        let all: f64 = openings.iter().map(size).sum();
        let add = |sum: &mut f64, opening: &Opening| {
            *sum += size(opening) / all;
            Some(*sum)
        };
        Aim { openings, from, chosen: openings.iter().scan(0.0, add).collect() }
    }

    /// The direction that `choice` in [0, 1) and `u` draw, one opening at least; zero from a point of the opening itself.
    pub fn direction(&self, choice: f64, u: DVec2) -> DVec3 {
        let number = self.chosen.partition_point(|&sum| sum <= choice).min(self.openings.len() - 1);
        (self.openings[number].point(u) - self.from).normalize_or_zero()
    }

    /// Density with which [`Aim::direction`] draws the unit vector `v` \[1/sr\]: 0 where no opening lies.
    pub fn density(&self, v: DVec3) -> f64 {
        let (mut density, mut before) = (0.0, 0.0);
        for (opening, &sum) in self.openings.iter().zip(&self.chosen) {
            if let Some(distance) = opening.crossing(self.from, v).filter(|d| *d > 0.0) {
                density += (sum - before) * distance * distance / (opening.area * opening.normal.dot(v).abs());
            }
            before = sum;
        }
        density
    }
}
