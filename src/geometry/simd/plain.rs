//! Vectors of plain Rust: what every processor runs, and the twin of the others.
//!
//! The operations are calls: unrolled into the kernels they took two fifths of the time in which the library compiles, and only old
//! processors and tests take this path.

use super::Vector;

/// Lanes of plain Rust.
#[derive(Clone, Copy)]
pub struct Plain<const N: usize>([f32; N]);

impl<const N: usize> Plain<N> {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let mut lanes = [0.0; N];
        for (i, lane) in lanes.iter_mut().enumerate() {
            *lane = f(self.0[i], other.0[i]);
        }
        Plain(lanes)
    }
}

impl<const N: usize> Vector for Plain<N> {
    type Array = [f32; N];

    #[inline(never)]
    fn splat(x: f32) -> Self {
        Plain([x; N])
    }

    #[inline(never)]
    fn load(from: &[f32; N]) -> Self {
        Plain(*from)
    }

    #[inline(never)]
    fn store(self, to: &mut [f32; N]) {
        *to = self.0;
    }

    #[inline(never)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }

    #[inline(never)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }

    #[inline(never)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }

    #[inline(never)]
    fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }

    #[inline(never)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }

    #[inline(never)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    #[inline(never)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self.mul(factor).add(term)
    }

    #[inline(never)]
    fn mul_sub(self, factor: Self, term: Self) -> Self {
        self.mul(factor).sub(term)
    }

    #[inline(never)]
    fn sqrt(self) -> Self {
        self.zip(self, |a, _| a.sqrt())
    }

    #[inline(never)]
    fn abs(self) -> Self {
        self.zip(self, |a, _| a.abs())
    }

    #[inline(never)]
    fn flip(self, sign: Self) -> Self {
        self.zip(sign, |a, s| f32::from_bits(a.to_bits() ^ (s.to_bits() & (-0f32).to_bits())))
    }

    #[inline(never)]
    fn less(self, other: Self) -> u32 {
        (0..N).map(|i| u32::from(self.0[i] < other.0[i]) << i).sum()
    }

    #[inline(never)]
    fn select(self, mask: u32) -> Self {
        let mut lanes = self.0;
        for (i, lane) in lanes.iter_mut().enumerate() {
            *lane = f32::from_bits(lane.to_bits() & 0u32.wrapping_sub(mask >> i & 1));
        }
        Plain(lanes)
    }
}
