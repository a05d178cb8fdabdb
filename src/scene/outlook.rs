//! What sources look like from a receiver, or from several together: the bound by which many sources are told apart.
//!
//! ```text
//! B = I(t) cos / d^2,    d^2 = g^2 + r^2/3
//! ```
//!
//! g is the distance from the receivers to the middle of the box around the sources, r half its diagonal: d^2 is the mean square distance of
//! the points of the box. The least angle t between the axis of the sources and a way from one of them to a receiver, and the greatest cosine at
//! a receiver, are bounded in two ways, of which the better counts: by the cone that both fill as seen from each other,
//! and by the greatest height of a point of the one box over the plane of a point of the other, over the least distance between the boxes.

use super::beam::Beam;
use crate::math::DVec3;

/// Least distance for which bounds are told apart, in radii of the box around several receivers: nearer sources are taken for certain anyway.
const NEAREST: f64 = 0.05;

/// Receivers as the sources see them.
pub struct Outlook {
    low: DVec3,
    high: DVec3,
    center: DVec3,
    /// Half the diagonal of the box around them \[m\].
    radius: f64,
    normal: DVec3,
    /// Cosine of the largest angle between `normal` and one of their normals.
    spread: f64,
}

impl Outlook {
    /// That of one receiver.
    pub fn of_point(position: DVec3, normal: DVec3) -> Outlook {
        Outlook { low: position, high: position, center: position, radius: 0.0, normal, spread: 1.0 }
    }

    /// That of receivers with these positions and normals.
    pub fn of(receivers: impl Iterator<Item = (DVec3, DVec3)> + Clone) -> Outlook {
        let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = receivers.clone().fold(empty, |(low, high), (p, _)| (low.min(p), high.max(p)));
        let normal = receivers.clone().map(|(_, n)| n).sum::<DVec3>().try_normalize().unwrap_or(DVec3::Y);
        let spread = receivers.map(|(_, n)| n.dot(normal)).fold(1.0, f64::min);
        Outlook { low, high, center: 0.5 * (low + high), radius: 0.5 * low.distance(high), normal, spread }
    }

    /// About the greatest illuminance that the sources of `beam` give here \[lx\]; zero only where nothing of their light can arrive.
    pub fn bound(&self, beam: &Beam) -> f64 {
        let (center, radius) = (0.5 * (beam.low + beam.high), 0.5 * beam.low.distance(beam.high));
        let to_middle = (self.low - center).max(center - self.high).max(DVec3::ZERO).length_squared();
        let softened = radius * radius / 3.0 + NEAREST * NEAREST * self.radius * self.radius;
        let d2 = to_middle + softened + f64::MIN_POSITIVE.sqrt();
        let pair = Pair {
            way: self.center - center,
            reach: self.radius + radius,
            half: 0.5 * (beam.high - beam.low + self.high - self.low),
            gap: (self.low - beam.high).max(beam.low - self.high).max(DVec3::ZERO).length(),
        };
        let there = pair.greatest_cosine(beam.axis);
        let here = nearer(pair.greatest_cosine(-self.normal), self.spread);
        beam.envelope(there) * here.max(0.0) / d2
    }
}

/// A box of sources and one of receivers.
struct Pair {
    /// From the middle of the one to that of the other \[m\].
    way: DVec3,
    /// Sum of half their diagonals \[m\].
    reach: f64,
    /// Sum of half their edges \[m\].
    half: DVec3,
    /// Least distance between them \[m\].
    gap: f64,
}

impl Pair {
    /// Bound of the cosine between the unit vector `axis` and a way from the one to the other.
    fn greatest_cosine(&self, axis: DVec3) -> f64 {
        let distance = self.way.length();
        let along = axis.dot(self.way);
        let height = along + axis.abs().dot(self.half);
        let by_height = if height > 0.0 { height / self.gap.max(height) } else { height / (distance + self.reach) };
        if self.reach >= distance {
            return by_height;
        }
        // Both fill the cone with this sine around the way from middle to middle.
        let sine = self.reach / distance;
        by_height.min(nearer(along / distance, (1.0 - sine * sine).sqrt()))
    }
}

/// Cosine of the angle with `cosine` made smaller by the one with the cosine `by`.
fn nearer(cosine: f64, by: f64) -> f64 {
    if cosine >= by {
        return 1.0;
    }
    let sines = (1.0 - cosine * cosine).max(0.0) * (1.0 - by * by).max(0.0);
    cosine * by + sines.sqrt()
}
