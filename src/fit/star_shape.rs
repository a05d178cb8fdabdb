//! The centre of a star-shaped object: a point behind the planes of all faces.
//!
//! ```text
//! maximise t:  (n_f, c) + t <= (n_f, p_f) for every face f            four unknowns, one condition a face
//! ```
//!
//! t > 0 exactly where every face is seen from within from some c; the largest t stands farthest from not being so. The
//! dual simplex method solves it: four planes hold the optimum of themselves, the plane that this violates most comes in,
//! the one whose multiplier falls to zero first goes out. It begins with four planes far around the mesh. The objective
//! leans by [`LEAN`], so that no multiplier is zero for long and no set of planes comes back.
//!
//! Many points may have the largest t (those in the middle of a rod), and its ends are as good as its middle then. So
//! the centre moves from the optimum towards the middle of the volume as far as [`KEPT`] of t allows.

use super::solid::{Face, Solid, WHOLE, place};
use crate::error::{Error, Result};
use crate::math::{DMat4, DVec3, DVec4, PI, acos};
use crate::report::short;

/// Share of the largest margin that the centre keeps on its way to the middle of the volume.
const KEPT: f64 = 0.9;
/// Pull of the objective in space: far below what changes a margin, far above rounding.
const LEAN: DVec3 = DVec3::new(1.3e-8, -0.7e-8, 1.9e-8);
/// Largest coordinate of the four planes of the beginning, in diagonals of the mesh.
const FAR: f64 = 4.0;
/// Violations that are rounding, in diagonals.
const TOLERANCE: f64 = 1e-12;
/// Least margin, in diagonals: rays see corners in f32.
const LEAST: f64 = 1e-6;
/// Exchanges of planes, at most; a few tens are usual.
const MOST_EXCHANGES: usize = 2000;

/// Where the directions of a series begin.
#[derive(Clone, Copy, Debug)]
pub struct Centre {
    /// The point \[m\].
    pub position: DVec3,
    /// Distance of the nearest plane of a face from it \[m\].
    pub margin: f64,
    /// The largest distance that any point has \[m\].
    pub best: f64,
}

/// The condition (normal, c) + t <= offset.
#[derive(Clone, Copy)]
struct Plane {
    normal: DVec3,
    offset: f64,
}

/// A centre for `solid`, from the file `name`.
///
/// # Errors
/// [`Error::Input`] with the worst face, for a mesh that has none, or that winds more than once around it.
pub fn centre(name: &str, solid: &Solid) -> Result<Centre> {
    let (position, best) = optimum(solid);
    if best < LEAST * solid.diagonal {
        return Err(refusal(name, solid, position));
    }
    let position = towards_the_middle(solid, position, KEPT * best);
    // What rounding leaves of zero would only be digits in the file.
    let nil = TOLERANCE * solid.diagonal;
    let position = DVec3::select(position.abs().cmplt(DVec3::splat(nil)), DVec3::ZERO, position);
    let solid_angle: f64 = solid.faces.iter().map(|face| face.solid_angle(position)).sum();
    if (solid_angle / WHOLE - 1.0).abs() > 1e-6 {
        let allowed = "one layer around the centre: each ray from it meets the mesh once";
        return Err(Error::input(name, "layers of the mesh", short(solid_angle / WHOLE, 4), allowed));
    }
    Ok(Centre { position, margin: margin(&solid.faces, position), best })
}

/// Distance of the nearest plane of a face from `point`, negative where that is in front of one \[m\].
fn margin(faces: &[Face], point: DVec3) -> f64 {
    faces.iter().map(|face| face.margin(point)).fold(f64::INFINITY, f64::min)
}

/// The point with the largest margin, and that margin \[m\].
fn optimum(solid: &Solid) -> (DVec3, f64) {
    // Around the middle and in units of the diagonal, rounding is the same for all meshes.
    let scale = 1.0 / solid.diagonal;
    let middle = solid.positions.iter().sum::<DVec3>() / solid.positions.len() as f64;
    let plane = |f: &Face| Plane { normal: f.normal, offset: scale * f.margin(middle) };
    let planes: Vec<Plane> = solid.faces.iter().map(plane).collect();
    let (center, _) = solve(&planes);
    let position = middle + center * solid.diagonal;
    (position, margin(&solid.faces, position))
}

/// c and t of the linear programme; should exchanges not end, the best of all that were met.
fn solve(planes: &[Plane]) -> (DVec3, f64) {
    let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let mut basis = corners.map(|n| Plane { normal: DVec3::from_array(n).normalize(), offset: FAR });
    let mut best = (DVec3::ZERO, f64::NEG_INFINITY);
    for _ in 0..MOST_EXCHANGES {
        let columns = basis.map(|p| p.normal.extend(1.0));
        let inverse = DMat4::from_cols(columns[0], columns[1], columns[2], columns[3]).inverse();
        if !inverse.is_finite() {
            break;
        }
        let at = inverse.transpose() * DVec4::from_array(basis.map(|p| p.offset));
        let center = at.truncate();
        let Some((entering, margin)) = most_violated(planes, center) else { break };
        if margin > best.1 {
            best = (center, margin);
        }
        if margin >= at.w - TOLERANCE {
            break;
        }
        let Some(leaving) = first_to_vanish(inverse * LEAN.extend(1.0), inverse * entering.normal.extend(1.0)) else {
            break;
        };
        basis[leaving] = entering;
    }
    best
}

/// The plane over which `center` has least height, and that height.
fn most_violated(planes: &[Plane], center: DVec3) -> Option<(Plane, f64)> {
    let heights = planes.iter().map(|p| (*p, p.offset - p.normal.dot(center)));
    heights.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Which of the four `multipliers` reaches zero first when they change along -`change`.
fn first_to_vanish(multipliers: DVec4, change: DVec4) -> Option<usize> {
    let ratio = |i: usize| multipliers[i].max(0.0) / change[i];
    (0..4).filter(|&i| change[i] > TOLERANCE).min_by(|&i, &j| ratio(i).total_cmp(&ratio(j)))
}

/// From `from` as far towards the middle of the volume as no margin falls below `least`: margins are linear on the way.
fn towards_the_middle(solid: &Solid, from: DVec3, least: f64) -> DVec3 {
    let step = solid.centroid - from;
    let allowed = solid.faces.iter().map(|face| {
        let fall = face.normal.dot(step);
        if fall > 0.0 { (face.margin(from) - least) / fall } else { 1.0 }
    });
    from + step * allowed.fold(1.0, f64::min).max(0.0)
}

/// Says which face is seen from the front most, from where that is least so for the worst of all.
fn refusal(name: &str, solid: &Solid, center: DVec3) -> Error {
    let lean = |face: &Face| (face.middle() - center).normalize_or_zero().dot(face.normal);
    let wrong = solid.faces.iter().filter(|face| face.margin(center) < LEAST * solid.diagonal);
    let Some(worst) = wrong.clone().min_by(|a, b| lean(a).total_cmp(&lean(b))) else {
        return Error::input(name, "faces", solid.faces.len(), "faces with area");
    };
    let degrees = acos(lean(worst).clamp(-1.0, 1.0)) * 180.0 / PI;
    let value = format!(
        "{} of {} faces turn away from even the best centre {}; the worst, around {}: that lies {} m in front of its plane, \
         {} deg between its normal and the direction to it",
        wrong.count(),
        solid.faces.len(),
        place(center),
        place(worst.middle()),
        short(-worst.margin(center), 4),
        short(degrees, 4),
    );
    let least = short(LEAST * solid.diagonal, 2);
    let allowed = format!(
        "a star-shaped mesh: a point at least {least} m behind the planes of all faces, so less than 90 deg; split it"
    );
    Error::input(name, "star shape", value, allowed)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The planes of a box between -`half` and `half`.
    fn walls(half: DVec3) -> Vec<Plane> {
        let axes = [(DVec3::X, half.x), (DVec3::Y, half.y), (DVec3::Z, half.z)];
        let pair = |(n, h)| [Plane { normal: n, offset: h }, Plane { normal: -n, offset: h }];
        axes.into_iter().flat_map(pair).collect()
    }

    #[test]
    fn the_largest_margin_of_a_box_is_half_its_least_side() {
        let (center, t) = solve(&walls(DVec3::new(0.1, 0.2, 0.3)));
        assert!((t - 0.1).abs() < 1e-12 && center.x.abs() < 1e-12, "{center} {t}");
        let (center, t) = solve(&walls(DVec3::splat(0.25)));
        assert!((t - 0.25).abs() < 1e-12 && center.length() < 1e-11, "{center} {t}");
    }

    #[test]
    fn a_corner_cut_off_by_a_plane_gives_the_insphere() {
        // x, y, z >= 0 and x + y + z <= 1: the inscribed sphere of radius 1/(3 + sqrt 3).
        let mut planes: Vec<Plane> = [DVec3::X, DVec3::Y, DVec3::Z].map(|n| Plane { normal: -n, offset: 0.0 }).into();
        planes.push(Plane { normal: DVec3::ONE.normalize(), offset: 1.0 / 3f64.sqrt() });
        let radius = 1.0 / (3.0 + 3f64.sqrt());
        let (center, t) = solve(&planes);
        assert!((t - radius).abs() < 1e-13 && (center - radius).length() < 1e-12, "{center} {t}");
    }

    #[test]
    fn two_walls_back_to_back_have_a_negative_margin() {
        let mut planes = walls(DVec3::splat(0.5));
        planes.push(Plane { normal: DVec3::X, offset: -0.1 });
        planes.push(Plane { normal: -DVec3::X, offset: -0.1 });
        let (_, t) = solve(&planes);
        assert!((t + 0.1).abs() < 1e-12, "{t}");
    }
}
