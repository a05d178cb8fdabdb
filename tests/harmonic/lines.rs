//! Lines of all kinds against an object, and whether their first hits are those of the oracle.

use super::oracle;
use lampyris::geometry::harmonic::Star;
use lampyris::math::DVec3;
use lampyris::random::{Generator, sphere};

/// Origin and direction of a line: from outside, from inside, from just above and below the surface, or grazing a point of it.
pub fn draw(star: &Star, rng: &mut Generator) -> (DVec3, DVec3) {
    let (low, high) = star.radii();
    let target = sphere(rng.uniform2()) * high * rng.uniform();
    let n0 = sphere(rng.uniform2());
    let (normal, _) = star.normal_and_area(n0);
    let surface = star.series().value(n0) * n0;
    let from = match (5.0 * rng.uniform()) as u32 {
        0 => sphere(rng.uniform2()) * high * (1.0 + 3.0 * rng.uniform()),
        1 => sphere(rng.uniform2()) * low * rng.uniform(),
        2 => surface + 1e-6 * normal,
        3 => surface - 1e-6 * normal,
        _ => {
            // Past the surface at most 1e-3 above or below it, down to 1e-9.
            let side = if rng.uniform() < 0.5 { -1.0 } else { 1.0 };
            let lift = side * lampyris::math::pow(10.0, -3.0 - 6.0 * rng.uniform());
            let along = normal.cross(sphere(rng.uniform2())).normalize();
            return (surface + lift * normal - 3.0 * high * along, along);
        }
    };
    (from, (target - from).normalize())
}

/// What becomes of a line.
pub enum Verdict {
    /// As the oracle says; `leaves` where it started inside and never met the surface.
    Agrees { leaves: bool },
    /// Otherwise, but an extremum lies so near zero that nobody can tell.
    Grazes,
    /// What is wrong.
    Wrong(String),
}

/// The first hit of a line against the oracle.
pub fn judge(star: &Star, o: DVec3, d: DVec3) -> Verdict {
    let all = oracle::crossings(star.series(), o, d);
    let first = star.first_crossing(o, d, f64::INFINITY);
    let agrees = match (&first, all.distances.first()) {
        (None, None) => true,
        (Some(c), Some(&expected)) => {
            let at = o + c.distance * d;
            // Both are as good as their values over the cosine, at a tangency as good as the root of that, and the oracle no better
            // than it can be.
            let within = 1e-11 / d.dot(c.normal).abs().max(1e-6) + all.resolution(at.length());
            (c.position - at).length() < within
                && (c.normal - star.normal_and_area(at.normalize()).0).length() < 100.0 * within
                && (c.distance - expected).abs() < within
        }
        _ => false,
    };
    match (agrees, all.grazes) {
        (true, _) => Verdict::Agrees { leaves: first.is_none() && star.contains(o) },
        (false, true) => Verdict::Grazes,
        (false, false) => Verdict::Wrong(format!("{first:?} {:?}", all.distances)),
    }
}
