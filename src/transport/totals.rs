//! What histories give the links of a tile: in f32 over the vertices of one history, in f64 over histories.

#![allow(clippy::needless_range_loop, reason = "several arrays go by one axis, lane or channel")]

use super::connection::{Connected, TILE, Tile};
use crate::geometry::visibility::{BUNDLE, BUNDLES};
use crate::photometry::Colour;

/// f32 lanes of a tile.
pub(super) type Column = [[f32; BUNDLE]; BUNDLES];

/// What one history gives the links of a tile, constant responses left out.
pub(super) struct Sums<const C: usize> {
    pub(super) light: [Column; C],
    /// The part of `light` by vertices that a delta scatterer lit straight.
    pub(super) mirrored: [Column; C],
    pub(super) has_mirrored: bool,
    /// Of one vertex at a time, what veils let through.
    pub(super) through: [Column; C],
}

impl<const C: usize> Sums<C> {
    pub(super) fn new() -> Self {
        let zero = [[[0.0; BUNDLE]; BUNDLES]; C];
        Sums { light: zero, mirrored: zero, has_mirrored: false, through: zero }
    }

    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.light = [[[0.0; BUNDLE]; BUNDLES]; C];
        if std::mem::take(&mut self.has_mirrored) {
            self.mirrored = [[[0.0; BUNDLE]; BUNDLES]; C];
        }
    }
}

/// What all histories so far give the links of a tile, lane by lane.
pub(super) struct Totals<const C: usize> {
    constant: [[f64; TILE]; C],
    start: [[f64; TILE]; C],
    sum: [[f64; TILE]; C],
    /// Of the history at hand, the luminous total.
    total: [f64; TILE],
    peak: [f64; TILE],
    mirrored: [f64; TILE],
    watched: Vec<(usize, Vec<f64>)>,
}

impl<const C: usize> Totals<C> {
    pub(super) fn new(tile: &Tile) -> Self {
        let column = |of: &dyn Fn(usize) -> Colour| {
            let mut columns = [[0.0; TILE]; C];
            for i in 0..tile.links.len() {
                columns.iter_mut().zip(of(i).0).for_each(|(column, value)| column[i] = value);
            }
            columns
        };
        let watched = tile.links.iter().enumerate().filter(|(_, l)| l.watched);
        Totals {
            constant: column(&|i| tile.constant[i].unwrap_or(Colour::WHITE)),
            start: column(&|i| tile.links[i].start),
            sum: [[0.0; TILE]; C],
            total: [0.0; TILE],
            peak: [0.0; TILE],
            mirrored: [0.0; TILE],
            watched: watched.map(|(i, _)| (i, Vec::new())).collect(),
        }
    }

    /// Takes in what one history gave.
    #[inline(always)]
    pub(super) fn add(&mut self, sums: &Sums<C>, tile: &Tile) {
        let lanes = tile.bundles() * BUNDLE;
        let lanes = lanes.min(TILE);
        for i in 0..lanes {
            let mut total = [0.0; C];
            for c in 0..C {
                total[c] = self.start[c][i] + f64::from(sums.light[c].as_flattened()[i]) * self.constant[c][i];
                self.sum[c][i] += total[c];
            }
            self.total[i] = luminance(total);
            self.peak[i] = if self.total[i] > self.peak[i] { self.total[i] } else { self.peak[i] };
        }
        for (i, totals) in &mut self.watched {
            totals.push(self.total[*i]);
        }
        if sums.has_mirrored {
            for i in 0..lanes {
                let part = |c: usize| f64::from(sums.mirrored[c].as_flattened()[i]) * self.constant[c][i];
                self.mirrored[i] += luminance(std::array::from_fn::<f64, C, _>(part));
            }
        }
    }

    /// Link by link.
    pub(super) fn connected(mut self, tile: &Tile) -> Vec<Connected> {
        let mut watched = std::mem::take(&mut self.watched).into_iter().peekable();
        let of_link = |i: usize| Connected {
            sum: colour(std::array::from_fn::<f64, C, _>(|c| self.sum[c][i])),
            peak: self.peak[i],
            mirrored: self.mirrored[i],
            totals: watched.next_if(|(at, _)| *at == i).map(|(_, totals)| totals),
        };
        (0..tile.links.len()).map(of_link).collect()
    }
}

/// The colour of one channel, or of three.
#[inline(always)]
fn colour<const C: usize>(channels: [f64; C]) -> Colour {
    Colour(std::array::from_fn(|c| channels[c.min(C - 1)]))
}

/// The luminance of one channel, or of three.
#[inline(always)]
fn luminance<const C: usize>(channels: [f64; C]) -> f64 {
    if C == 1 { channels[0] } else { colour(channels).luminance() }
}
