//! How far a mesh and the series fitted to it are apart.
//!
//! Directions n of a Fibonacci spiral, none of which the fit has used, stand for the sphere, each for the same solid angle:
//!
//! | error | of a direction | weight |
//! |---|---|---|
//! | radial | r(n) of the series less r(n) of the mesh, also at its vertices for the largest | solid angle |
//! | surface, mesh to series | from the point of the mesh to the series surface, also from its vertices for the largest | area of the mesh |
//! | surface, series to mesh | from the point of the series to the nearest triangle, exact | area of the series |
//! | angle | between the normals of both | area of the mesh |
//!
//! The way from a point to the series surface begins along the radius and is shortened by projections on tangent planes
//! until they gain nothing: it ends where the surface is nearest among its neighbours, and is never too short.

use super::radial::Radial;
use super::solid::Solid;
use super::star_shape::Centre;
use crate::geometry::harmonic::Star;
use crate::math::{DVec3, PI, atan2, sin_cos};

/// Fewest and most directions; eight for each coefficient between.
const DIRECTIONS: (usize, usize) = (40_000, 60_000);
/// Most vertices from which distances are taken; of more, every second, third, ... one.
const VERTICES: usize = 20_000;
/// Projections on tangent planes, at most.
const PROJECTIONS: usize = 20;
/// Share of its length that a way has to lose for another projection.
const GAIN: f64 = 1e-5;
/// Part of a turn by which directions of the spiral follow each other: the golden section.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Root of the mean square and the largest magnitude of an error.
#[derive(Clone, Copy, Debug, Default)]
pub struct Deviation {
    /// Root of the weighted mean square.
    pub rms: f64,
    /// Largest magnitude.
    pub max: f64,
    squares: f64,
    weights: f64,
}

impl Deviation {
    fn add(&mut self, error: f64, weight: f64) {
        self.squares += weight * error * error;
        self.weights += weight;
        self.rms = (self.squares / self.weights).sqrt();
        self.max = self.max.max(error.abs());
    }
}

/// What is measured.
#[derive(Clone, Debug, Default)]
pub struct Errors {
    /// Number of directions.
    pub directions: usize,
    /// Number of vertices of the mesh that were looked at.
    pub vertices: usize,
    /// Mean of r over all directions \[m\].
    pub mean_radius: f64,
    /// Of the radius \[m\].
    pub radial: Deviation,
    /// From the mesh to the series \[m\].
    pub from_mesh: Deviation,
    /// From the series to the mesh \[m\].
    pub from_series: Deviation,
    /// Between the normals \[deg\].
    pub angle: Deviation,
    /// Volume of the mesh and of the series \[m3\].
    pub volumes: [f64; 2],
}

impl Errors {
    /// Compares `star` with the mesh `solid`, which is `radial` around `centre`.
    pub fn measure(solid: &Solid, centre: &Centre, radial: &Radial, star: &Star) -> Errors {
        let coefficients = (star.series().degree() + 1) * (star.series().degree() + 1);
        let directions = (8 * coefficients).clamp(DIRECTIONS.0, DIRECTIONS.1);
        let mut errors = Errors { directions, volumes: [solid.volume, star.volume()], ..Errors::default() };
        for i in 0..directions {
            errors.look(spiral(i, directions), radial, star);
        }
        let step = solid.positions.len().div_ceil(VERTICES);
        for &vertex in solid.positions.iter().step_by(step) {
            let p = vertex - centre.position;
            let radial = star.series().value(p.normalize()) - p.length();
            errors.radial.max = errors.radial.max.max(radial.abs());
            errors.from_mesh.max = errors.from_mesh.max.max(distance(star, p));
            errors.vertices += 1;
        }
        errors
    }

    /// Takes one direction in.
    fn look(&mut self, n0: DVec3, radial: &Radial, star: &Star) {
        let Some(mesh) = radial.along(n0) else { return };
        let radius = star.series().value(n0);
        let (normal, area) = star.normal_and_area(n0);
        let error = radius - mesh.radius;
        self.mean_radius += mesh.radius / self.directions as f64;
        self.radial.add(error, 1.0);
        let area_of_mesh = mesh.radius * mesh.radius / mesh.normal.dot(n0);
        self.from_mesh.add(distance(star, mesh.radius * n0), area_of_mesh);
        self.from_series.add(radial.geometry.distance(radius * n0, error.abs()), area);
        let angle = atan2(normal.cross(mesh.normal).length(), normal.dot(mesh.normal));
        self.angle.add(angle * 180.0 / PI, area_of_mesh);
    }
}

/// Direction `i` of `count` on a spiral from pole to pole.
fn spiral(i: usize, count: usize) -> DVec3 {
    let z = 1.0 - (2 * i + 1) as f64 / count as f64;
    let turns = GOLDEN * i as f64;
    let (sin, cos) = sin_cos(2.0 * PI * (turns - turns.floor()));
    let across = (1.0 - z * z).sqrt();
    DVec3::new(across * cos, across * sin, z)
}

/// Length of a shortest way from `p` to the surface \[m\].
fn distance(star: &Star, p: DVec3) -> f64 {
    let foot = |direction: DVec3| {
        let slope = star.series().slope(direction);
        let away = p - slope.value * direction;
        let normal = (slope.value * direction - slope.gradient).normalize();
        (away.length(), (p - away.dot(normal) * normal).normalize_or(direction))
    };
    let mut direction = p.normalize_or(DVec3::Z);
    let (mut least, mut next) = foot(direction);
    let mut step = 1.0;
    for _ in 0..PROJECTIONS {
        let tried = direction.lerp(next, step).normalize_or(direction);
        let (length, after) = foot(tried);
        if length < least * (1.0 - GAIN) {
            (direction, least, next) = (tried, length, after);
        } else if step > 0.25 {
            // Over a strongly curved surface the foot on the tangent plane lies too far.
            step *= 0.5;
        } else {
            return least.min(length);
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::harmonic::Series;

    #[test]
    fn the_way_to_a_surface_is_found_from_the_side() {
        // A sphere of radius 1 about (0, 0, 0.3), to the accuracy of a series of degree 24.
        let radius = |n: &DVec3| 0.3 * n.z + (1.0 - 0.09 * (1.0 - n.z * n.z)).sqrt();
        let of = |n: &[DVec3]| Ok(n.iter().map(radius).collect());
        let series: Series = crate::geometry::harmonic::projection(24, 50, of).unwrap();
        let star = Star::new(series).unwrap();
        for p in [DVec3::new(1.2, 0.0, 0.1), DVec3::new(0.3, -0.4, 0.9), DVec3::new(-0.1, 1.5, -1.0)] {
            let expected = ((p - 0.3 * DVec3::Z).length() - 1.0).abs();
            let found = distance(&star, p);
            assert!(found > expected - 1e-9 && found < expected * 1.001 + 1e-9, "{p}: {found} {expected}");
        }
    }
}
