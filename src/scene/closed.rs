//! Bodies of glass must be closed: light that is inside must find its way out through a surface that knows it.
//!
//! A mesh is closed where each of its edges is run through as often one way as the other; its fronts are outside where the volume
//! that it bounds is above zero. Corners count as the same where the rays see them at the same place.

use super::{Delta, Reflectance, Surface};
use crate::error::{Error, Result};
use crate::math::{DVec3, Vec3};
use std::cmp::Ordering;

/// An edge of a triangle, its lesser end first, and whether it is run through that way: 1, or -1.
type Edge = ([f32; 3], [f32; 3], i32);

/// Refuses glass on `surfaces` whose triangles, with these `corners`, leave a hole or have their fronts inside. The error tells places
/// as they are without `offset`.
///
/// # Errors
/// [`Error::Input`] naming the material, and an open edge.
pub(super) fn refuse_open_glass(
    surfaces: &[Surface],
    surface_of: &[u32],
    corners: &[[Vec3; 3]],
    offset: DVec3,
) -> Result<()> {
    let is_glass = |s: &Surface| matches!(s.reflectance, Reflectance::Delta(Delta::Glass(_)));
    let mut names: Vec<&str> = surfaces.iter().filter(|s| is_glass(s)).map(|s| &s.name[..]).collect();
    names.sort_unstable();
    names.dedup();
    for name in names {
        // One material may be several surfaces, by what else a mesh has.
        let is_its = |surface: &u32| is_glass(&surfaces[*surface as usize]) && surfaces[*surface as usize].name == name;
        let faces: Vec<[Vec3; 3]> =
            surface_of.iter().zip(corners).filter(|(surface, _)| is_its(surface)).map(|(_, face)| *face).collect();
        let refused = |value: String, allowed: &str| {
            Err(Error::input("scene", format!("material {name}, a body of glass"), value, allowed))
        };
        if let Some(ends) = open_edge(&faces) {
            let [a, b] = ends.map(|end| (Vec3::from_array(end).as_dvec3() - offset).to_array().map(|x| x as f32));
            let allowed = "a closed mesh, whose triangles share each edge; or [[material]] with kind = \"pane\"";
            return refused(format!("open from {a:?} to {b:?}"), allowed);
        }
        if !faces.is_empty() && volume(&faces) <= 0.0 {
            return refused("inside out".to_owned(), "a closed mesh with its fronts outside");
        }
    }
    Ok(())
}

/// The ends of an edge that is not run through as often one way as the other.
fn open_edge(faces: &[[Vec3; 3]]) -> Option<[[f32; 3]; 2]> {
    let mut edges: Vec<Edge> = faces.iter().flat_map(|[a, b, c]| [edge(*a, *b), edge(*b, *c), edge(*c, *a)]).collect();
    let order = |a: &Edge, b: &Edge| compare(&a.0, &b.0).then(compare(&a.1, &b.1));
    edges.sort_unstable_by(order);
    let mut same = edges.chunk_by(|a, b| order(a, b) == Ordering::Equal);
    same.find(|same| same[0].0 != same[0].1 && same.iter().map(|e| e.2).sum::<i32>() != 0).map(|e| [e[0].0, e[0].1])
}

fn edge(from: Vec3, to: Vec3) -> Edge {
    let (from, to) = (from.to_array(), to.to_array());
    if compare(&from, &to) == Ordering::Less { (from, to, 1) } else { (to, from, -1) }
}

/// By coordinates; both zeros are one.
fn compare(a: &[f32; 3], b: &[f32; 3]) -> Ordering {
    a.partial_cmp(b).expect("coordinates are finite")
}

/// Volume inside `faces`, closed, that is on their backs, less what is on their fronts, times 6 \[m3\].
fn volume(faces: &[[Vec3; 3]]) -> f64 {
    let origin = faces[0][0].as_dvec3();
    let of_face = |face: &[Vec3; 3]| {
        let [a, b, c] = face.map(|corner| corner.as_dvec3() - origin);
        a.dot(b.cross(c))
    };
    faces.iter().map(of_face).sum()
}
