//! A luminaire with its luminous opening: a surface whose luminance follows from the intensities of its web.
//!
//! ```text
//! L(w) = I(w) / A(w),    A(w) = sum over the faces of area x (normal, w)_+          [cd/m2]
//! ```
//!
//! The same in all points that a direction shows, so that from afar the intensity is that of the file. A history leaves in a direction
//! drawn from the web, from a point uniform over what that direction shows of the opening.

use super::luminous_mesh::LuminousMesh;
use super::photometric_web::{Luminaire, Opening, Placement, Shape};
use super::source::Emitter;
use crate::geometry::Geometry;
use crate::math::{DVec3, PI, sin, sin_cos};
use crate::photometry::Colour;
use crate::random::Generator;

/// Corners of what stands for a circle, of the same area.
pub(super) const CORNERS: u32 = 64;
/// Times that the faces of an octahedron are divided in four to stand for a sphere, of the same surface.
const DIVISIONS: u32 = 3;
/// Share of its area below which a flat opening is seen edge-on, and dark.
const EDGE_ON: f64 = 1e-9;
/// The least share of its area that a face counts in the choice of one, where it is not dark: another part of it may be seen less aslant.
const LEAST_SHOWN: f64 = 0.1;

/// A triangle, counter-clockwise seen from outside \[m\].
pub(super) type Triangle = [DVec3; 3];

/// A luminaire with extent, as a job asks for it.
#[derive(Clone, Debug)]
pub struct Extended {
    /// Its light.
    pub luminaire: Luminaire,
    /// Its faces in the coordinates of the file \[m\].
    pub faces: Vec<Triangle>,
    /// Whether the faces shine on both sides: a flat opening does.
    pub flat: bool,
}

/// The same in a scene.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Its light.
    pub luminaire: Luminaire,
    /// Its faces; their luminance is not used.
    pub faces: Vec<Emitter>,
    /// Area of the faces \[m2\].
    pub area: f64,
    flat: bool,
}

impl Extended {
    /// The `opening` of a luminaire with this `placement`; `None` where it has no area.
    pub fn new(luminaire: Luminaire, opening: &Opening, placement: &Placement) -> Option<Extended> {
        if !opening.has_area() {
            return None;
        }
        let [along, across, up] = placement.edges(opening, luminaire.kind());
        let flat = matches!(opening.shape, Shape::Rectangle | Shape::Disc | Shape::UprightDisc);
        let faces = match opening.shape {
            Shape::Point | Shape::Unknown => return None,
            Shape::Rectangle => fan(&around(along, across, 4)),
            Shape::Disc => fan(&around(along, across, CORNERS)),
            Shape::UprightDisc => fan(&around(across, up, CORNERS)),
            Shape::Box => prism(&around(along, across, 4), up),
            Shape::UprightCylinder => prism(&around(along, across, CORNERS), up),
            Shape::CylinderAlongLength => prism(&around(across, up, CORNERS), along),
            Shape::CylinderAlongWidth => prism(&around(up, along, CORNERS), across),
            Shape::Sphere => ball([along, across, up]),
        };
        let center = luminaire.position;
        let faces: Vec<Triangle> = faces.into_iter().map(|face| outwards(face, flat).map(|p| center + p)).collect();
        Some(Extended { luminaire, faces, flat })
    }

    /// A luminaire whose light leaves `mesh`.
    pub(super) fn of_mesh(luminaire: Luminaire, mesh: LuminousMesh) -> Extended {
        Extended { luminaire, faces: mesh.faces, flat: mesh.flat }
    }
}

impl Panel {
    /// The panel of `extended` whose faces are the triangles from number `first` on.
    pub(super) fn new(extended: Extended, geometry: &Geometry, first: u32) -> Panel {
        let Extended { luminaire, faces, flat } = extended;
        let face = |k: u32| Emitter::of_triangle(geometry, first + k, Colour::BLACK, flat);
        let faces: Vec<Emitter> = (0..faces.len() as u32).map(face).collect();
        let area = faces.iter().map(|face| face.area).sum();
        Panel { luminaire, faces, area, flat }
    }

    /// Whether it is flat, and shines on both sides.
    pub fn is_flat(&self) -> bool {
        self.flat
    }

    /// Luminance towards the unit vector `w` \[cd/m2\].
    pub fn luminance(&self, w: DVec3) -> Colour {
        let shown = self.shown(w);
        if shown > EDGE_ON * self.area { self.luminaire.intensity(w) / shown } else { Colour::BLACK }
    }

    /// Area of the opening as seen against the unit vector `w` \[m2\].
    fn shown(&self, w: DVec3) -> f64 {
        self.faces.iter().map(|face| self.shown_of(face, w)).sum()
    }

    fn shown_of(&self, face: &Emitter, w: DVec3) -> f64 {
        let cosine = face.normal.dot(w);
        face.area * if self.flat { cosine.abs() } else { cosine.max(0.0) }
    }

    /// The face that `u` in [0, 1] chooses for a point at `from`, and the probability of that; `None` where all are dark there.
    pub fn choose_face(&self, from: DVec3, u: f64) -> Option<(&Emitter, f64)> {
        let all: f64 = self.weights(from).sum();
        let mut left = u * all;
        let reached = |(_, weight): &(&Emitter, f64)| {
            left -= weight;
            *weight > 0.0 && left < 0.0
        };
        let chosen = self.faces.iter().zip(self.weights(from)).find(reached);
        // Rounding may leave a rest behind the last face.
        let last = || self.faces.iter().zip(self.weights(from)).rfind(|(_, weight)| *weight > 0.0);
        chosen.or_else(last).map(|(face, weight)| (face, weight / all))
    }

    /// The probability with which `face` is chosen for a point at `from`.
    pub fn probability(&self, face: &Emitter, from: DVec3) -> f64 {
        self.weight(face, from) / self.weights(from).sum::<f64>()
    }

    fn weights(&self, from: DVec3) -> impl DoubleEndedIterator<Item = f64> + ExactSizeIterator {
        self.faces.iter().map(move |face| self.weight(face, from))
    }

    /// What a face counts for a point at `from`: about the area that it shows, and some of it wherever it shines there.
    fn weight(&self, face: &Emitter, from: DVec3) -> f64 {
        let way = from - face.corners[0];
        let height = face.normal.dot(way);
        match self.flat {
            // All of its faces show the same share.
            true => face.area,
            false if height > 0.0 => face.area * (height / way.length()).max(LEAST_SHOWN),
            false => 0.0,
        }
    }

    /// Where a history starts, and its direction.
    pub(super) fn emit(&self, geometry: &Geometry, rng: &mut Generator) -> (DVec3, DVec3) {
        let w = self.luminaire.sample(rng.uniform2());
        let mut left = rng.uniform() * self.shown(w);
        let reached = |face: &&Emitter| {
            left -= self.shown_of(face, w);
            left < 0.0
        };
        // Rounding may leave a rest behind the last face.
        let face = self.faces.iter().find(reached).unwrap_or(&self.faces[self.faces.len() - 1]);
        let normal = face.normal * if face.normal.dot(w) < 0.0 { -1.0 } else { 1.0 };
        (geometry.lift(face.point(rng.uniform2()), normal), w)
    }
}

/// The corners of a polygon about the origin in the plane of `u` and `v`, half of its edges: four for the rectangle, more for an
/// ellipse of the same area.
pub(super) fn around(u: DVec3, v: DVec3, corners: u32) -> Vec<DVec3> {
    if corners == 4 {
        return vec![u + v, v - u, -u - v, u - v];
    }
    let step = 2.0 * PI / f64::from(corners);
    let out = (step / sin(step)).sqrt();
    let corner = |k: u32| {
        let (sin, cos) = sin_cos(step * f64::from(k));
        out * (cos * u + sin * v)
    };
    (0..corners).map(corner).collect()
}

/// The triangles of a convex polygon.
pub(super) fn fan(corners: &[DVec3]) -> Vec<Triangle> {
    (2..corners.len()).map(|i| [corners[0], corners[i - 1], corners[i]]).collect()
}

/// A prism over `base`, by half its height to both sides.
fn prism(base: &[DVec3], half: DVec3) -> Vec<Triangle> {
    let (top, bottom): (Vec<DVec3>, Vec<DVec3>) = base.iter().map(|&p| (p + half, p - half)).unzip();
    let side = |i: usize| {
        let j = (i + 1) % base.len();
        fan(&[bottom[i], bottom[j], top[j], top[i]])
    };
    fan(&top).into_iter().chain(fan(&bottom)).chain((0..base.len()).flat_map(side)).collect()
}

/// An ellipsoid with these half axes, in flat faces with the mean width of round ones.
fn ball([a, b, c]: [DVec3; 3]) -> Vec<Triangle> {
    let axes = [DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y];
    let top = (0..4).flat_map(|i| [[axes[i], axes[(i + 1) % 4], DVec3::Z], [axes[(i + 1) % 4], axes[i], DVec3::NEG_Z]]);
    let mut faces: Vec<Triangle> = top.collect();
    for _ in 0..DIVISIONS {
        let split = |[a, b, c]: Triangle| {
            let (x, y, z) = ((a + b).normalize(), (b + c).normalize(), (c + a).normalize());
            [[a, x, z], [x, b, y], [z, y, c], [x, y, z]]
        };
        faces = faces.into_iter().flat_map(split).collect();
    }
    let surface: f64 = faces.iter().map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum();
    let out = (4.0 * PI / surface).sqrt();
    faces.into_iter().map(|face| face.map(|p| out * (p.x * a + p.y * b + p.z * c))).collect()
}

/// A face of a convex shape about the origin, its corners counter-clockwise from outside; a flat one as it is.
fn outwards([a, b, c]: Triangle, flat: bool) -> Triangle {
    let inwards = (b - a).cross(c - a).dot(a) < 0.0;
    if !flat && inwards { [a, c, b] } else { [a, b, c] }
}
