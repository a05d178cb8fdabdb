//! Directions drawn nearly in proportion to a luminance: cells of equal solid angle, each with its mean luminance.
//!
//! Whatever the cells say, an estimate that divides by the density is unbiased: what is evaluated is what is drawn from.

use crate::math::{DVec2, DVec3, PI, atan2, floor, sin_cos};

/// Places in a cell, along each of its edges, at which its luminance is averaged.
const PLACES: usize = 3;

/// Cells of the sphere, z up: one below the horizon, `rows` x `columns` above it, rows of equal steps of z.
#[derive(Clone, Debug)]
pub(super) struct Cells {
    /// Running sum over the lower hemisphere and the rows \[cd/m2 sr\].
    rows: Vec<f64>,
    /// Of each row the running sum over its columns.
    columns: Vec<Vec<f64>>,
}

impl Cells {
    /// Cells for a luminance above the horizon, and that `below` it.
    pub fn new((rows, columns): (usize, usize), below: f64, luminance: impl Fn(DVec3) -> f64) -> Cells {
        let solid_angle = 2.0 * PI / (rows * columns) as f64;
        let step = 1.0 / PLACES as f64;
        let places = || (0..PLACES * PLACES).map(|k| ((k / PLACES) as f64, (k % PLACES) as f64));
        let mean = |row: usize, column: usize| {
            let at = |(i, j): (f64, f64)| {
                let z = (row as f64 + (i + 0.5) * step) / rows as f64;
                luminance(direction(z, (column as f64 + (j + 0.5) * step) / columns as f64))
            };
            places().map(at).sum::<f64>() * step * step * solid_angle
        };
        let of_row = |row| running((0..columns).map(|column| mean(row, column)));
        let columns: Vec<Vec<f64>> = (0..rows).map(of_row).collect();
        let rows = running(std::iter::once(2.0 * PI * below).chain(columns.iter().map(|row| total(row))));
        Cells { rows, columns }
    }

    /// The luminance summed over all directions \[cd/m2 sr\].
    pub fn integral(&self) -> f64 {
        total(&self.rows)
    }

    /// The direction that `u` draws.
    pub fn sample(&self, u: DVec2) -> DVec3 {
        let (row, within) = choose(&self.rows, u.x);
        let Some(row) = row.checked_sub(1) else { return direction(-within, u.y) };
        let columns = &self.columns[row];
        let (column, turn) = choose(columns, u.y);
        direction((row as f64 + within) / self.columns.len() as f64, (column as f64 + turn) / columns.len() as f64)
    }

    /// Density with which the unit vector `v` is drawn \[1/sr\].
    pub fn density(&self, v: DVec3) -> f64 {
        if v.z < 0.0 {
            return self.rows[0] / (2.0 * PI * self.integral());
        }
        let rows = self.columns.len();
        let row = &self.columns[((v.z * rows as f64) as usize).min(rows - 1)];
        let turn = if row.len() == 1 { 0.0 } else { atan2(v.y, v.x) / (2.0 * PI) };
        let column = ((turn - floor(turn)) * row.len() as f64) as usize;
        let own = part(row, column.min(row.len() - 1));
        own * (rows * row.len()) as f64 / (2.0 * PI * self.integral())
    }
}

fn direction(z: f64, turn: f64) -> DVec3 {
    let across = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = sin_cos(2.0 * PI * turn);
    DVec3::new(across * cos, across * sin, z)
}

fn running(parts: impl Iterator<Item = f64>) -> Vec<f64> {
    let add = |sum: &mut f64, part: f64| {
        *sum += part;
        Some(*sum)
    };
    parts.scan(0.0, add).collect()
}

fn total(sums: &[f64]) -> f64 {
    sums[sums.len() - 1]
}

fn part(sums: &[f64], number: usize) -> f64 {
    sums[number] - number.checked_sub(1).map_or(0.0, |before| sums[before])
}

/// The part in which the share `u` of the total lies, and how far within it, both ends of [0, 1] included.
fn choose(sums: &[f64], u: f64) -> (usize, f64) {
    let target = u * total(sums);
    let number = sums.partition_point(|&sum| sum <= target).min(sums.len() - 1);
    let own = part(sums, number);
    (number, ((target - (sums[number] - own)) / own).clamp(0.0, 1.0))
}
