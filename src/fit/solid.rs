//! A closed surface of triangles: equal vertices joined, every edge between exactly two faces, the front outside.

use super::input::Soup;
use crate::error::{Error, Result};
use crate::math::{DVec3, PI, atan2};
use std::collections::BTreeMap;

/// Diagonals of the box around a mesh that can be computed with \[m\].
const SIZES: (f64, f64) = (1e-6, 1e9);

/// A face as rays and planes see it.
#[derive(Clone, Copy, Debug)]
pub struct Face {
    /// Corners \[m\].
    pub corners: [DVec3; 3],
    /// Outward unit normal.
    pub normal: DVec3,
}

impl Face {
    /// Its middle \[m\].
    pub fn middle(&self) -> DVec3 {
        (self.corners[0] + self.corners[1] + self.corners[2]) / 3.0
    }

    /// Height of the plane of the face over `point`, positive where `point` lies behind it \[m\].
    pub fn margin(&self, point: DVec3) -> f64 {
        self.normal.dot(self.corners[0] - point)
    }

    /// Solid angle seen from `point`, positive from behind \[sr\] (van Oosterom and Strackee 1983).
    pub fn solid_angle(&self, point: DVec3) -> f64 {
        let [a, b, c] = self.corners.map(|corner| (corner - point).normalize());
        2.0 * atan2(a.dot(b.cross(c)), 1.0 + a.dot(b) + b.dot(c) + c.dot(a))
    }
}

/// A closed mesh.
#[derive(Debug)]
pub struct Solid {
    /// Vertices, each of them once \[m\].
    pub positions: Vec<DVec3>,
    /// Faces with area.
    pub faces: Vec<Face>,
    /// Number of triangles, those without area too.
    pub triangles: usize,
    /// True when the file had the inside in front.
    pub turned: bool,
    /// Volume \[m3\].
    pub volume: f64,
    /// Middle of the volume \[m\].
    pub centroid: DVec3,
    /// Diagonal of the box around it \[m\].
    pub diagonal: f64,
}

impl Solid {
    /// The solid whose surface is `soup`, from the file `name`.
    ///
    /// # Errors
    /// [`Error::Input`] for a mesh that is open, not consistently oriented, empty, or of a size beyond all measure.
    pub fn new(name: &str, soup: Soup) -> Result<Solid> {
        let (positions, mut triangles) = weld(soup);
        refuse_gaps(name, &positions, &triangles)?;
        let (low, high) =
            positions.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |b, &p| (b.0.min(p), b.1.max(p)));
        let diagonal = (high - low).length();
        if !(SIZES.0..=SIZES.1).contains(&diagonal) {
            let allowed = format!("{:e} .. {:e} m; none without triangles", SIZES.0, SIZES.1);
            return Err(Error::input(name, "diagonal of the mesh", diagonal, allowed));
        }
        let (mut volume, centroid) = moments(&positions, &triangles, 0.5 * (low + high));
        let turned = volume < 0.0;
        if turned {
            volume = -volume;
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        let faces = triangles.iter().filter_map(|t| face(t.map(|v| positions[v as usize]))).collect();
        Ok(Solid { positions, faces, triangles: triangles.len(), turned, volume, centroid, diagonal })
    }
}

/// The face with these corners; `None` where they enclose no area.
fn face(corners: [DVec3; 3]) -> Option<Face> {
    let [a, b, c] = corners;
    (b - a).cross(c - a).try_normalize().map(|normal| Face { corners, normal })
}

/// Joins vertices at equal positions, and drops triangles of which that leaves an edge, and vertices of no triangle.
fn weld(soup: Soup) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut first_of = BTreeMap::new();
    let mut positions = Vec::new();
    let mut joined = |corner: u32| {
        // Adding zero makes -0 the same as 0.
        let position = soup.positions[corner as usize] + DVec3::ZERO;
        *first_of.entry(position.to_array().map(f64::to_bits)).or_insert_with(|| {
            positions.push(position);
            positions.len() as u32 - 1
        })
    };
    let all = soup.triangles.iter().map(|t| t.map(&mut joined));
    let triangles = all.filter(|[a, b, c]| a != b && b != c && c != a).collect();
    (positions, triangles)
}

/// Refuses a mesh in which not every edge lies between exactly two triangles that run along it in opposite directions.
fn refuse_gaps(name: &str, positions: &[DVec3], triangles: &[[u32; 3]]) -> Result<()> {
    let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let mut sides: Vec<(u32, u32, bool)> = sides.map(|[a, b]| (a.min(b), a.max(b), a < b)).collect();
    sides.sort_unstable();
    for edge in sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let [from, to] = [edge[0].0, edge[0].1].map(|v| place(positions[v as usize]));
        let problem = match edge {
            [a, b] if a.2 != b.2 => continue,
            [_, _] => "between 2 triangles, one of them turned inside out".to_owned(),
            _ => format!("of {} triangle{}", edge.len(), if edge.len() == 1 { "" } else { "s" }),
        };
        let allowed = "a closed mesh: each edge between exactly 2 triangles that have their fronts on the same side";
        return Err(Error::input(name, format!("edge from {from} to {to}"), problem, allowed));
    }
    Ok(())
}

/// A position for a message \[m\].
pub fn place(p: DVec3) -> String {
    let [x, y, z] = p.to_array().map(|x| crate::report::short(x, 6));
    format!("({x}, {y}, {z})")
}

/// Volume, negative where the inside is in front, and its middle; `around` keeps rounding small.
fn moments(positions: &[DVec3], triangles: &[[u32; 3]], around: DVec3) -> (f64, DVec3) {
    let (mut volume, mut moment) = (0.0, DVec3::ZERO);
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| positions[v as usize] - around);
        let part = a.dot(b.cross(c)) / 6.0;
        volume += part;
        moment += part * 0.25 * (a + b + c);
    }
    (volume, around + moment / volume)
}

/// Solid angle of the whole sphere \[sr\].
pub const WHOLE: f64 = 4.0 * PI;
