//! From the planes that a file holds to a web over all directions measured: what symmetry leaves out is filled in.
//!
//! A file gives planes, and in each plane the same angles. What the two mean depends on the type of goniometer:
//!
//! | type | planes | angles in a plane | pole | azimuth 0 |
//! |---|---|---|---|---|
//! | C | C, around the aim | from the aim | the aim | the C0 direction |
//! | A, B | horizontal, around the C0 direction | vertical: 90 is the C0 direction | the C0 direction | the aim |
//!
//! The aim is the direction of the two angles 0. Types A and B differ in nothing but what of the lamp is called aim.

use super::Grid;
use crate::math::PI;

/// How far two angles may differ that should be equal \[degrees\].
const SAME: f64 = 1e-6;

/// The type of goniometer, by its letter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Planes share the vertical axis of the lamp; automotive lamps.
    A,
    /// Planes share a horizontal axis; floodlights.
    B,
    /// C-planes share the vertical axis through the aim; nearly all luminaires.
    C,
}

/// What a file leaves out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Symmetry {
    /// Nothing.
    None,
    /// The same in all planes.
    Axial,
    /// Mirrored at the plane of this angle and the one opposite \[degrees\].
    Plane(f64),
    /// Mirrored at the planes C0-C180 and C90-C270.
    Quadrants,
    /// Of types A and B: mirrored at horizontal 0, at vertical 0, or at both.
    Mirrored {
        /// At horizontal 0.
        horizontal: bool,
        /// At vertical 0.
        vertical: bool,
    },
}

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Type of goniometer.
    pub kind: Kind,
    /// Angles of the planes, growing \[degrees\].
    pub planes: Vec<f64>,
    /// Angles in each plane, growing, two or more \[degrees\].
    pub angles: Vec<f64>,
    /// Plane by plane the intensities \[cd\].
    pub candela: Vec<f64>,
}

/// Angles with the number of the plane, or of the angle in it, whose intensities they have.
type Nodes = Vec<(f64, usize)>;

impl Measured {
    /// The intensities over all directions measured, and what was filled in; or what is wrong with the planes.
    pub(super) fn grid(&self) -> Result<(Grid, Symmetry), String> {
        let (azimuth, polar, symmetry) = match self.kind {
            Kind::C => {
                let (planes, symmetry) = around(&self.planes)?;
                (planes, numbered(&self.angles), symmetry)
            }
            Kind::A | Kind::B => {
                if self.planes.len() < 2 {
                    return Err("two planes or more in types A and B".to_owned());
                }
                let (planes, horizontal) = from_zero(&self.planes);
                let (angles, vertical) = from_zero(&self.angles);
                // From the pole, which is vertical 90.
                let polar = angles.into_iter().rev().map(|(v, k)| (90.0 - v, k)).collect();
                (planes, polar, Symmetry::Mirrored { horizontal, vertical })
            }
        };
        let symmetry = match symmetry {
            Symmetry::Mirrored { horizontal: false, vertical: false } => Symmetry::None,
            other => other,
        };
        let value = |&(_, angle): &(f64, usize)| {
            let of_plane = move |&(_, plane): &(f64, usize)| self.candela[plane * self.angles.len() + angle];
            azimuth.iter().map(of_plane)
        };
        let intensity = polar.iter().flat_map(value).collect();
        let mut azimuth: Vec<f64> = azimuth.iter().map(|&(degrees, _)| radians(degrees)).collect();
        let (first, last) = (azimuth[0], azimuth.len() - 1);
        if (azimuth[last] - first - 2.0 * PI).abs() < radians(SAME) {
            azimuth[last] = first + 2.0 * PI;
        }
        let polar = polar.iter().map(|&(degrees, _)| radians(degrees)).collect();
        Ok((Grid { polar, azimuth, intensity }, symmetry))
    }
}

/// The C-planes of a full turn.
fn around(planes: &[f64]) -> Result<(Nodes, Symmetry), String> {
    let nodes = numbered(planes);
    let [first, .., last] = planes else { return Ok((vec![(0.0, 0), (360.0, 0)], Symmetry::Axial)) };
    let span = last - first;
    let is = |angle: f64| (span - angle).abs() < SAME;
    let at_quarter = (first / 90.0 - (first / 90.0).round()).abs() < SAME;
    if is(360.0) {
        Ok((nodes, Symmetry::None))
    } else if at_quarter && is(180.0) {
        Ok((mirrored(nodes), Symmetry::Plane(first.rem_euclid(180.0))))
    } else if at_quarter && is(90.0) {
        Ok((mirrored(mirrored(nodes)), Symmetry::Quadrants))
    } else if first.abs() < SAME && span > 180.0 && span < 360.0 {
        Ok((nodes.into_iter().chain([(360.0, 0)]).collect(), Symmetry::None))
    } else {
        Err("one plane, or planes from 0 to 90, 0 to 180, 90 to 270, -90 to 90 or 0 to 360 degrees".to_owned())
    }
}

/// Angles that begin at 0 mirrored there, others as they are; and whether they were.
fn from_zero(angles: &[f64]) -> (Nodes, bool) {
    let nodes = numbered(angles);
    if angles[0].abs() < SAME { (mirrored(nodes), true) } else { (nodes, false) }
}

fn numbered(angles: &[f64]) -> Nodes {
    angles.iter().copied().zip(0..).collect()
}

/// The nodes with their mirror images at the first in front.
fn mirrored(nodes: Nodes) -> Nodes {
    let first = nodes[0].0;
    nodes[1..].iter().rev().map(|&(angle, k)| (2.0 * first - angle, k)).chain(nodes.iter().copied()).collect()
}

/// `degrees` in radians, exact at whole quarters of a turn.
pub fn radians(degrees: f64) -> f64 {
    degrees / 180.0 * PI
}
