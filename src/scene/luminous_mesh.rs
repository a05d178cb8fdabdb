//! A mesh of the scene as the luminous surface of a luminaire.
//!
//! L(w) = I(w) / A(w) asks for the area that a direction shows. It is the sum over the faces that look there where none of them hides
//! another, so the mesh must be convex and closed, or flat; others are refused. What is built of it is a [`Panel`](super::Panel).

use super::Model;
use crate::error::{Error, Result};
use crate::math::DVec3;

/// No more faces than this: each is asked for its part of A(w).
const MOST: usize = 4096;
/// What corners may lie off a plane, as a share of the size of the mesh: room for coordinates in f32.
const OFF: f64 = 1e-4;

/// A triangle \[m\].
type Triangle = [DVec3; 3];

/// A mesh that may shine.
#[derive(Debug)]
pub(super) struct LuminousMesh {
    /// Its faces, counter-clockwise from outside.
    pub(super) faces: Vec<Triangle>,
    /// Whether it lies in a plane, and so shines on both sides.
    pub(super) flat: bool,
    /// The middle of its corners \[m\].
    pub(super) middle: DVec3,
}

impl Model {
    /// Takes the triangles at the node called `name`, or below it, out of the scene. `job` is the name of the job file, `at` the entry
    /// that asks for it.
    ///
    /// # Errors
    /// [`Error::Input`] where there is not one such node, or no luminous mesh hangs there.
    pub(super) fn take_mesh(&mut self, (job, at): (&str, &str), name: &str) -> Result<LuminousMesh> {
        let bad = |allowed: String| Error::input(job, format!("{at}.mesh"), name, allowed);
        let place = self.nodes.only_with_surface(name).map_err(bad)?;
        let below = self.nodes.at_or_below(place);
        let is_its = |t: usize| self.nodes.of_triangle.get(t).is_some_and(|&of| below[of as usize]);
        let its: Vec<usize> = (0..self.triangles.len()).filter(|&t| is_its(t)).collect();
        let faces = its.iter().map(|&t| self.triangles[t].map(|corner| self.positions[corner as usize])).collect();
        let mesh = LuminousMesh::new(faces).map_err(bad)?;
        if its.iter().any(|&t| !self.surfaces[self.surface_of[t] as usize].emission.is_black()) {
            self.warn(format!("luminaire {name}: what its material emits is replaced by the photometric file"));
        }
        self.remove_triangles(&its);
        Ok(mesh)
    }

    /// Removes the triangles with these numbers.
    fn remove_triangles(&mut self, numbers: &[usize]) {
        let mut kept = vec![true; self.triangles.len()];
        numbers.iter().for_each(|&t| kept[t] = false);
        // The faces of luminaires, last of the triangles, have no node.
        let keep = |list: &mut Vec<u32>| {
            let mut flags = kept.iter();
            list.retain(|_| *flags.next().expect("no more entries than triangles"));
        };
        keep(&mut self.nodes.of_triangle);
        keep(&mut self.surface_of);
        let mut flags = kept.iter();
        self.triangles.retain(|_| *flags.next().expect("a flag for each"));
        self.textures.charts.retain(&kept);
        self.drop_unused_vertices();
    }
}

impl LuminousMesh {
    /// That of `faces`; what is wanted where it cannot shine.
    fn new(faces: Vec<Triangle>) -> std::result::Result<Self, String> {
        let mut faces: Vec<Triangle> = faces.into_iter().filter(|face| area_vector(face).length() > 0.0).collect();
        if faces.is_empty() || faces.len() > MOST {
            return Err(format!("a node with a mesh of 1 .. {MOST} triangles, not of {}", faces.len()));
        }
        let corners: Vec<DVec3> = faces.iter().flatten().copied().collect();
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let off = OFF * corners.iter().map(|corner| corner.distance(middle)).fold(0.0, f64::max);
        let largest =
            faces.iter().map(area_vector).fold(DVec3::ZERO, |a, b| if b.length() > a.length() { b } else { a });
        let normal = largest.normalize();
        if corners.iter().all(|&corner| (corner - middle).dot(normal).abs() <= off) {
            let one_way = faces.iter().all(|face| area_vector(face).dot(normal) > 0.0);
            let flat = one_way.then_some(LuminousMesh { faces, flat: true, middle });
            return flat.ok_or_else(|| "a flat mesh whose faces all look the same way".to_owned());
        }
        // Inside out it shines the same.
        if faces.iter().map(|face| area_vector(face).dot(face[0] - middle)).sum::<f64>() < 0.0 {
            faces.iter_mut().for_each(|face| face.swap(1, 2));
        }
        let behind = |face: &Triangle| {
            let normal = area_vector(face).normalize();
            corners.iter().all(|&corner| (corner - face[0]).dot(normal) <= off)
        };
        let open = faces.iter().map(area_vector).sum::<DVec3>().length();
        let all: f64 = faces.iter().map(|face| area_vector(face).length()).sum();
        if !faces.iter().all(behind) || open > OFF * all {
            return Err("a mesh that is convex and closed, or flat: only there no face hides another".to_owned());
        }
        Ok(LuminousMesh { faces, flat: false, middle })
    }
}

/// Twice the area of a triangle along its normal \[m2\].
fn area_vector([a, b, c]: &Triangle) -> DVec3 {
    (b - a).cross(c - a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn textures_stay_on_the_triangles_that_are_left() {
        let triangles = vec![[0, 1, 2], [1, 2, 3], [2, 3, 4]];
        let mut model = Model { positions: vec![DVec3::ZERO; 5], triangles, ..Model::default() };
        (model.surface_of, model.nodes.of_triangle) = (vec![7, 8, 9], vec![0, 1, 2]);
        let corner = [0.5, 0.25];
        model.textures.charts.push(2, [&corner; 3]);
        model.remove_triangles(&[0]);
        assert_eq!((&model.surface_of[..], &model.nodes.of_triangle[..]), (&[8, 9][..], &[1, 2][..]));
        assert_eq!([0, 1, 2].map(|t| model.textures.charts.has(t)), [false, true, false]);
    }
}
