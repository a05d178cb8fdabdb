//! Star-shaped objects that emit: Lambert area lights, sampled by their area element.
//!
//! ```text
//! Phi = pi L A,    A = int a(n0) dw,    a = r |r n0 - grad r| in its own coordinates
//! ```
//!
//! Histories leave from points uniform in area: n0 uniform on the sphere, kept with probability a(n0)/max a. A receiver draws half of its
//! samples by n0 uniform, with the weight 4 pi a(n0), and half by a direction to the ball around the object, or any direction
//! from within that: the balance of both is bounded at contact.

use super::Surface;
use crate::geometry::{Geometry, Harmonic};
use crate::math::{DVec2, DVec3, PI, to_world};
use crate::photometry::Colour;
use crate::random::{Generator, around_z, cosine_hemisphere, sphere};

/// Tries after which a point is kept whatever its share, in units of their mean number: one in e^32 comes so far.
const TRIES: f64 = 32.0;

/// An emissive star-shaped object.
#[derive(Clone, Debug)]
pub struct Body {
    /// Its number among all surfaces.
    pub primitive: u32,
    /// Its number among the star-shaped objects.
    object: usize,
    /// Area \[m2\].
    area: f64,
    /// No point has more area for each unit of solid angle \[m2/sr\].
    most: f64,
    /// Emitted luminance \[cd/m2\].
    pub luminance: Colour,
    /// True when the inside emits as well.
    double_sided: bool,
    /// True of a ball.
    round: bool,
}

/// A point of a body.
#[derive(Clone, Copy, Debug)]
pub struct BodyPoint {
    /// Where \[m\].
    pub position: DVec3,
    /// Outward unit normal.
    pub normal: DVec3,
    /// The area that a uniform n0 stands for there \[m2\].
    pub area: f64,
}

impl Body {
    /// The object number `object` of `geometry`, which is the surface `primitive` of the kind `surface`.
    pub(super) fn new(geometry: &Geometry, object: usize, primitive: u32, surface: &Surface) -> Body {
        let harmonic = &geometry.harmonics()[object];
        let Surface { emission, double_sided, .. } = *surface;
        let most = harmonic.greatest_area_element();
        Body {
            primitive,
            object,
            area: harmonic.area(),
            most,
            luminance: emission,
            double_sided,
            round: harmonic.is_round(),
        }
    }

    fn sides(&self) -> f64 {
        if self.double_sided { 2.0 } else { 1.0 }
    }

    /// Luminous flux \[lm\].
    pub fn flux(&self) -> Colour {
        self.luminance * (PI * self.area * self.sides())
    }

    fn harmonic<'a>(&self, geometry: &'a Geometry) -> &'a Harmonic {
        &geometry.harmonics()[self.object]
    }

    /// The point of the direction that `u` draws.
    pub fn point(&self, geometry: &Geometry, u: DVec2) -> BodyPoint {
        let (position, normal, area) = self.harmonic(geometry).point(sphere(u));
        BodyPoint { position, normal, area: 4.0 * PI * area }
    }

    /// Its point at `position` \[m\].
    pub fn point_at(&self, geometry: &Geometry, position: DVec3) -> BodyPoint {
        let harmonic = self.harmonic(geometry);
        let (_, normal, area) = harmonic.point(harmonic.direction_of(position));
        BodyPoint { position, normal, area: 4.0 * PI * area }
    }

    /// The unit normal on the side of `point` from which it is lit, if it is.
    pub fn lit_side(&self, point: &BodyPoint, from: DVec3) -> Option<DVec3> {
        let height = point.normal.dot(from - point.position);
        (height > 0.0 || (height < 0.0 && self.double_sided)).then(|| point.normal * height.signum())
    }

    /// True of a ball: it is seen in all directions of its cone.
    pub fn is_round(&self) -> bool {
        self.round
    }

    /// Centre and radius of a ball around it \[m\].
    pub fn ball(&self, geometry: &Geometry) -> (DVec3, f64) {
        let (center, radius, _) = self.harmonic(geometry).around();
        (center, radius)
    }

    /// The directions from `from` in which it may be seen: the axis of a cone, and one less the cosine of its half angle.
    pub fn seen_from(&self, geometry: &Geometry, from: DVec3) -> (DVec3, f64) {
        let (center, radius) = self.ball(geometry);
        let way = center - from;
        // The square of the sine.
        let share = radius * radius / way.length_squared();
        let height = if share < 1.0 { share / (1.0 + (1.0 - share).sqrt()) } else { 2.0 };
        (way.normalize_or(DVec3::Z), height)
    }

    /// Where a history starts, and its direction.
    pub(super) fn emit(&self, geometry: &Geometry, rng: &mut Generator) -> (DVec3, DVec3) {
        let mut point = self.point(geometry, rng.uniform2());
        let most = 4.0 * PI * self.most;
        for _ in 0..(TRIES * most / self.area).ceil() as u64 {
            if rng.uniform() * most < point.area {
                break;
            }
            point = self.point(geometry, rng.uniform2());
        }
        let back = self.double_sided && rng.uniform() < 0.5;
        let normal = if back { -point.normal } else { point.normal };
        let direction = to_world(normal, cosine_hemisphere(rng.uniform2()));
        (geometry.lift(point.position, normal), direction)
    }
}

/// A direction uniform in the cone around `axis`, `height` one less the cosine of its half angle.
pub fn in_cone(axis: DVec3, height: f64, u: DVec2) -> DVec3 {
    to_world(axis, around_z(1.0 - u.x * height, u.y))
}
