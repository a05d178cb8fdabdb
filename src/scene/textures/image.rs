//! Images: texels as their file stores them, and the linear values that they stand for.

use crate::math::pow;
use std::sync::{LazyLock, OnceLock};

/// What the numbers of an image are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Coding {
    /// Colours in sRGB, whose linear values count; alpha is linear.
    Srgb,
    /// Data such as roughness: as stored, 0 .. 1.
    Data,
}

/// An image of red, green, blue and alpha, row by row from the top.
#[derive(Debug)]
pub struct Image {
    width: usize,
    height: usize,
    texels: Texels,
    /// In [`CELLS`] x `CELLS` parts of the image, whether a texel is not black: found when first asked for.
    bright: OnceLock<Vec<bool>>,
}

/// Parts of an image along each axis in which light is looked for.
const CELLS: usize = 64;

/// The texels of an image.
#[derive(Debug, PartialEq)]
pub enum Texels {
    /// Of 8 bits a channel.
    Eight(Vec<[u8; 4]>),
    /// Of 16 bits a channel.
    Sixteen(Vec<[u16; 4]>),
}

/// Linear values of 8 bits of sRGB.
static LINEAR_8: LazyLock<Vec<f64>> = LazyLock::new(|| (0..1 << 8).map(|i| linear(f64::from(i) / 255.0)).collect());
/// Linear values of 16 bits of sRGB.
static LINEAR_16: LazyLock<Vec<f64>> = LazyLock::new(|| (0..1 << 16).map(|i| linear(f64::from(i) / 65535.0)).collect());

impl Image {
    /// An image of `width` texels in each row; `None` where the texels do not make whole rows, at least one.
    pub fn new(width: usize, texels: Texels) -> Option<Self> {
        let count = match &texels {
            Texels::Eight(texels) => texels.len(),
            Texels::Sixteen(texels) => texels.len(),
        };
        let height = count.checked_div(width)?;
        (height > 0 && height * width == count).then(|| Image { width, height, texels, bright: OnceLock::new() })
    }

    /// Columns and rows.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// Memory \[bytes\].
    pub fn bytes(&self) -> u64 {
        let size = if matches!(self.texels, Texels::Eight(_)) { 4 } else { 8 };
        (self.width * self.height * size) as u64
    }

    /// Red, green, blue and alpha of the texel in `column` and `row`, 0 .. 1.
    pub fn texel(&self, column: usize, row: usize, coding: Coding) -> [f64; 4] {
        let at = row * self.width + column;
        match (&self.texels, coding) {
            (Texels::Eight(texels), Coding::Srgb) => with_alpha(texels[at].map(usize::from), &LINEAR_8),
            (Texels::Eight(texels), Coding::Data) => texels[at].map(|x| f64::from(x) / 255.0),
            (Texels::Sixteen(texels), Coding::Srgb) => with_alpha(texels[at].map(usize::from), &LINEAR_16),
            (Texels::Sixteen(texels), Coding::Data) => texels[at].map(|x| f64::from(x) / 65535.0),
        }
    }

    /// Mean over all texels. They are counted by value first, so that it does not depend on their order.
    pub fn mean(&self, coding: Coding) -> [f64; 4] {
        let count = (self.width * self.height) as f64;
        let decode = if coding == Coding::Srgb { linear } else { |value| value };
        let of_channel = |channel: usize| {
            let counts = self.counts(channel);
            let full = (counts.len() - 1) as f64;
            let decode = if channel < 3 { decode } else { |value| value };
            let seen = counts.iter().enumerate().filter(|&(_, &count)| count > 0);
            let sum: f64 = seen.map(|(value, &count)| count as f64 * decode(value as f64 / full)).sum();
            (sum / count).min(1.0)
        };
        [0, 1, 2, 3].map(of_channel)
    }

    /// The least and the greatest value of a channel, 0 .. 1, of data.
    pub fn range(&self, channel: usize) -> (f64, f64) {
        let counts = self.counts(channel);
        let full = (counts.len() - 1) as f64;
        let value = |found: Option<usize>| found.unwrap_or(0) as f64 / full;
        (value(counts.iter().position(|&c| c > 0)), value(counts.iter().rposition(|&c| c > 0)))
    }

    /// Whether a texel may be bright between the shares `across` of the width and `down` of the height: false is a proof.
    pub fn has_light(&self, across: [f64; 2], down: [f64; 2]) -> bool {
        let bright = self.bright.get_or_init(|| self.bright_cells());
        let cells = |[low, high]: [f64; 2]| {
            let cell = |share: f64| ((share * CELLS as f64) as usize).min(CELLS - 1);
            cell(low).saturating_sub(1)..(cell(high) + 2).min(CELLS)
        };
        cells(down).any(|row| bright[row * CELLS..][cells(across)].contains(&true))
    }

    fn bright_cells(&self) -> Vec<bool> {
        let mut bright = vec![false; CELLS * CELLS];
        for row in 0..self.height {
            for column in 0..self.width {
                let [r, g, b, _] = self.texel(column, row, Coding::Data);
                // An image of few texels has its texels in some of the cells only.
                let cells =
                    |i: usize, count: usize| i * CELLS / count..=((i + 1) * CELLS).div_ceil(count).min(CELLS) - 1;
                if r + g + b > 0.0 {
                    for y in cells(row, self.height) {
                        bright[y * CELLS..][cells(column, self.width)].fill(true);
                    }
                }
            }
        }
        bright
    }

    /// How often each value occurs in a channel.
    fn counts(&self, channel: usize) -> Vec<u64> {
        match &self.texels {
            Texels::Eight(texels) => counted(1 << 8, texels.iter().map(|t| t[channel].into())),
            Texels::Sixteen(texels) => counted(1 << 16, texels.iter().map(|t| t[channel].into())),
        }
    }
}

fn counted(levels: usize, values: impl Iterator<Item = usize>) -> Vec<u64> {
    let mut counts = vec![0; levels];
    values.for_each(|value| counts[value] += 1);
    counts
}

/// Colour through `table`, and alpha as it is stored.
fn with_alpha([r, g, b, a]: [usize; 4], table: &[f64]) -> [f64; 4] {
    [table[r], table[g], table[b], a as f64 / (table.len() - 1) as f64]
}

/// Linear value of the sRGB value `s` (IEC 61966-2-1).
fn linear(s: f64) -> f64 {
    if s <= 0.04045 { s / 12.92 } else { pow((s + 0.055) / 1.055, 2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_ends_are_exact_and_half_is_0_214() {
        assert_eq!((linear(0.0), linear(1.0)), (0.0, 1.0));
        assert!((linear(0.5) - 0.214_041_140_482).abs() < 1e-12);
    }

    #[test]
    fn rows_are_whole() {
        assert!(Image::new(2, Texels::Eight(vec![[0; 4]; 6])).is_some());
        assert!(Image::new(2, Texels::Eight(vec![[0; 4]; 5])).is_none());
        assert!(Image::new(2, Texels::Sixteen(Vec::new())).is_none());
        assert!(Image::new(0, Texels::Eight(vec![[0; 4]; 6])).is_none());
    }
}
