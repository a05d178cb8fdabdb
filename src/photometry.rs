//! Photometric quantities in three channels or one. What a number means stands in its name, its unit in its doc.
//!
//! A [`Colour`] is a triple of linear Rec.709 values of one quantity; in a job with `channels = "luminance"`
//! the three are equal and only the first is carried through the hot loop.

use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign};

/// Luminance of the linear Rec.709 primaries (sum 1).
pub const REC709: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// Linear Rec.709 triple of a photometric quantity or of a reflectance, weighted so that
/// 0.2126 R + 0.7152 G + 0.0722 B is the photometric value itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Colour(pub [f64; 3]);

impl Colour {
    /// No light.
    pub const BLACK: Colour = Colour([0.0; 3]);
    /// One of every channel.
    pub const WHITE: Colour = Colour([1.0; 3]);

    /// The same value in every channel.
    pub const fn grey(value: f64) -> Self {
        Colour([value; 3])
    }

    /// The photometric value: lm, lx, cd or cd/m2 of a coloured quantity, luminous reflectance of a coloured one.
    pub fn luminance(self) -> f64 {
        let [r, g, b] = self.0;
        // Grey stays exact: the weights add to one only within rounding.
        if r == g && g == b { r } else { REC709[0] * r + REC709[1] * g + REC709[2] * b }
    }

    /// Largest channel.
    pub fn max(self) -> f64 {
        self.0[0].max(self.0[1]).max(self.0[2])
    }

    /// Each channel through `f`.
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Colour(self.0.map(f))
    }

    /// True where every channel is zero.
    pub fn is_black(self) -> bool {
        self.0 == [0.0; 3]
    }
}

impl Add for Colour {
    type Output = Colour;
    fn add(self, o: Colour) -> Colour {
        Colour([self.0[0] + o.0[0], self.0[1] + o.0[1], self.0[2] + o.0[2]])
    }
}

impl AddAssign for Colour {
    fn add_assign(&mut self, o: Colour) {
        *self = *self + o;
    }
}

impl Mul for Colour {
    type Output = Colour;
    fn mul(self, o: Colour) -> Colour {
        Colour([self.0[0] * o.0[0], self.0[1] * o.0[1], self.0[2] * o.0[2]])
    }
}

impl Mul<f64> for Colour {
    type Output = Colour;
    fn mul(self, k: f64) -> Colour {
        self.map(|c| c * k)
    }
}

impl MulAssign<f64> for Colour {
    fn mul_assign(&mut self, k: f64) {
        *self = *self * k;
    }
}

impl Div<f64> for Colour {
    type Output = Colour;
    fn div(self, k: f64) -> Colour {
        self.map(|c| c / k)
    }
}

impl Sum for Colour {
    fn sum<I: Iterator<Item = Colour>>(colours: I) -> Colour {
        colours.fold(Colour::BLACK, |a, b| a + b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn luminance_of_grey_is_exact_and_of_primaries_rec709() {
        assert_eq!(Colour::grey(0.1).luminance(), 0.1);
        assert_eq!(Colour([0.0, 1.0, 0.0]).luminance(), 0.7152);
    }
}
