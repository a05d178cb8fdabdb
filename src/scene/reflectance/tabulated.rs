//! A law measured pair by pair: an isotropic table of f over two polar angles and the azimuth between them.
//!
//! Between nodes f is linear in each of the three angles, beyond the last polar angle constant. The table is the same when the two
//! directions are exchanged, so the law is reciprocal. Directions are drawn from the cells of the table in proportion to what they
//! reflect, of the node below or above the angle of arrival by its distance, and in a cell uniformly in sin^2(theta) and azimuth.
//! Where f is linear it is at most a few times its mean, so no weight grows without bound. What is evaluated is the density with
//! which that is done.
//! `docs/brdf-format.md`: the text, read by `text`.

mod cells;
mod text;

use super::{Scattered, above};
use crate::math::{DVec2, DVec3, PI, acos, frame};
use crate::photometry::Colour;
use crate::random::{Generator, around_z};
use cells::{Axis, cell, inside};
use std::sync::Arc;

/// A tabulated law.
#[derive(Clone)]
pub struct Tabulated(Arc<Table>);

impl std::fmt::Debug for Tabulated {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "Tabulated({} polar angles, {} azimuths)", self.0.polar.len(), self.0.azimuths.len())
    }
}

struct Table {
    /// Polar angles of both directions \[rad\], ascending from 0.
    polar: Vec<f64>,
    /// Azimuths between the directions \[rad\], ascending from 0 (back to where light came from) to pi.
    azimuths: Vec<f64>,
    /// f by polar angle, polar angle and azimuth \[1/sr\].
    values: Vec<Colour>,
    /// The cells of directions of departure: sin^2 of the polar angle, and azimuth.
    axes: [Axis; 2],
    /// Of each polar angle of arrival the directional albedo.
    albedos: Vec<Colour>,
    /// Of each polar angle of arrival the running sum of the probabilities of the cells.
    sums: Vec<Vec<f64>>,
}

/// A place between two nodes: the lower one, and how far beyond it.
type Place = (usize, f64);

fn place(nodes: &[f64], x: f64) -> Place {
    let last = nodes.len() - 1;
    let i = nodes.partition_point(|&node| node <= x).saturating_sub(1);
    if i >= last { (last, 0.0) } else { (i, (x - nodes[i]) / (nodes[i + 1] - nodes[i])) }
}

impl Tabulated {
    /// The law of `values` \[1/sr\] by polar angle, polar angle and azimuth, the same both ways.
    fn new(polar: Vec<f64>, azimuths: Vec<f64>, values: Vec<Colour>) -> Self {
        let axes = [Axis::polar(&polar), Axis::azimuths(&azimuths)];
        let mut table = Table { polar, azimuths, values, axes, albedos: Vec::new(), sums: Vec::new() };
        for i in 0..table.polar.len() {
            let (albedo, sums) = table.cells(i);
            table.albedos.push(albedo);
            table.sums.push(sums);
        }
        Tabulated(Arc::new(table))
    }

    pub(super) fn evaluate(&self, normal: DVec3, w_in: DVec3, w_out: DVec3) -> Colour {
        if !above(normal, w_in, w_out) {
            return Colour::BLACK;
        }
        let (from, to) = ((-w_in).dot(normal), w_out.dot(normal));
        self.0.at(acos(from.min(1.0)), acos(to.min(1.0)), azimuth(normal, -w_in, w_out))
    }

    pub(super) fn pdf(&self, normal: DVec3, w_in: DVec3, w_out: DVec3) -> f64 {
        if !above(normal, w_in, w_out) {
            return 0.0;
        }
        let (theta, cosine) = (acos((-w_in.dot(normal)).min(1.0)), w_out.dot(normal));
        let (number, area) = cell(&self.0.axes, DVec2::new(1.0 - cosine * cosine, azimuth(normal, -w_in, w_out)));
        let (i, t) = place(&self.0.polar, theta);
        let of_node = |i: usize| {
            let sums = &self.0.sums[i];
            sums[number] - number.checked_sub(1).map_or(0.0, |before| sums[before])
        };
        let probability = of_node(i) * (1.0 - t) + if t > 0.0 { of_node(i + 1) * t } else { 0.0 };
        // Uniform in sin^2 and azimuth over the hemisphere, an area of pi, is the cosine's density.
        if area > 0.0 { probability / area * cosine } else { 0.0 }
    }

    /// One uniform for the cell, two for the place in it.
    pub(super) fn sample(&self, normal: DVec3, w_in: DVec3, rng: &mut Generator) -> Option<Scattered> {
        let (i, t) = place(&self.0.polar, acos((-w_in.dot(normal)).clamp(0.0, 1.0)));
        let sums = &self.0.sums[if t > 0.0 && rng.chance(t) { i + 1 } else { i }];
        let (choice, u) = (rng.uniform(), rng.uniform2());
        let number = sums.partition_point(|&sum| sum <= choice).min(sums.len() - 1);
        let side = 2.0 * u.y - 1.0;
        let at = inside(&self.0.axes, number, DVec2::new(u.x, side.abs()));
        let local = around_z((1.0 - at.x).max(0.0).sqrt(), at.y.copysign(side) / (2.0 * PI));
        // The azimuth counts from where the light came from.
        let back = -w_in - normal * (-w_in).dot(normal);
        let x = if back.length_squared() > 1e-24 { back.normalize() } else { frame(normal).0 };
        let direction = (x * local.x + normal.cross(x) * local.y + normal * local.z).normalize();
        let density = self.pdf(normal, w_in, direction);
        let factor = self.evaluate(normal, w_in, direction) * (direction.dot(normal) / density);
        (density > 0.0).then_some(Scattered { direction, factor, delta: false, transmitted: false })
    }

    /// Directional albedo.
    pub(super) fn albedo(&self, cosine: f64) -> Colour {
        let (i, t) = place(&self.0.polar, acos(cosine.clamp(0.0, 1.0)));
        let upper = self.0.albedos[(i + 1).min(self.0.albedos.len() - 1)];
        self.0.albedos[i] * (1.0 - t) + upper * t
    }

    /// The greatest pi f.
    pub(super) fn summit(&self) -> f64 {
        self.0.values.iter().map(|f| PI * f.luminance()).fold(0.0, f64::max)
    }

    pub(super) fn is_black(&self) -> bool {
        self.0.values.iter().all(|f| f.is_black())
    }

    pub(super) fn grey(self) -> Self {
        let values = self.0.values.iter().map(|f| Colour::grey(f.luminance())).collect();
        Tabulated::new(self.0.polar.clone(), self.0.azimuths.clone(), values)
    }
}

impl Table {
    /// f at the nodes \[1/sr\].
    fn value(&self, i: usize, j: usize, k: usize) -> Colour {
        self.values[(i * self.polar.len() + j) * self.azimuths.len() + k]
    }

    /// f at two polar angles and an azimuth: the smaller angle first, so that exchanging them changes no bit.
    fn at(&self, one: f64, other: f64, azimuth: f64) -> Colour {
        let (i, s) = place(&self.polar, one.min(other));
        let (j, t) = place(&self.polar, one.max(other));
        let (k, u) = place(&self.azimuths, azimuth);
        let mut sum = Colour::BLACK;
        for (i, s) in [(i, 1.0 - s), (i + 1, s)] {
            for (j, t) in [(j, 1.0 - t), (j + 1, t)] {
                for (k, u) in [(k, 1.0 - u), (k + 1, u)] {
                    if s * t * u > 0.0 {
                        sum += self.value(i, j, k) * (s * t * u);
                    }
                }
            }
        }
        sum
    }

    /// Directional albedo at node `i` of arrival, and the running sum of the shares of it that the cells reflect.
    fn cells(&self, i: usize) -> (Colour, Vec<f64>) {
        let [polar, azimuths] = &self.axes;
        let (mut albedo, mut sums) = (Colour::BLACK, Vec::with_capacity(polar.parts() * azimuths.parts()));
        for row in 0..polar.parts() {
            for column in 0..azimuths.parts() {
                for (j, u) in polar.corners(row) {
                    for (k, v) in azimuths.corners(column) {
                        albedo += self.value(i, j, k) * (u * v);
                    }
                }
                sums.push(albedo.luminance());
            }
        }
        let all = albedo.luminance();
        // Of a black angle all cells are alike.
        let count = sums.len() as f64;
        let share = |(number, part): (usize, f64)| if all > 0.0 { part / all } else { (number + 1) as f64 / count };
        (albedo, sums.into_iter().enumerate().map(share).collect())
    }
}

/// Angle between the projections of two unit vectors onto the surface; a half turn where one of them has none.
fn azimuth(normal: DVec3, one: DVec3, other: DVec3) -> f64 {
    let flat = |w: DVec3| w - normal * w.dot(normal);
    let (a, b) = (flat(one), flat(other));
    let size = (a.length_squared() * b.length_squared()).sqrt();
    if size > 1e-24 { acos((a.dot(b) / size).clamp(-1.0, 1.0)) } else { PI }
}
