//! Quasi-random points: the first eight dimensions of Sobol's sequence, scrambled anew for every batch.
//!
//! ```text
//! x_i      = xor of v_k over the ones k of the Gray code of i                          v_k: directions of Joe and Kuo
//! y's bit j = x's bit j  xor  a fair coin of (batch, dimension, j, the j higher bits of x)          Owen's scrambling
//! ```
//!
//! The 2^m points of a [`PointSet`] are a net: every interval [k 2^-m, (k+1) 2^-m) holds one point in each dimension,
//! and what Sobol's points have of this in several dimensions the scrambled ones keep. One point alone is uniform over the
//! cube, so a mean over the set is unbiased; different batches are independent, so a batch is one realization. Inside
//! a set points depend on each other: no error bar comes from there.
//!
//! The coins of six levels are the 63 nodes of a binary tree: one hashed word holds them. Below the last level on
//! which points of the set still differ each point has a path of its own, where coins are hashed bits as they come.
//!
//! S. Joe and F. Y. Kuo, "Constructing Sobol sequences with better two-dimensional projections", SIAM J. Sci. Comput.
//! 30 (2008); A. B. Owen, "Randomly permuted (t,m,s)-nets and (t,s)-sequences" (1995). Knows no histories.

use super::{Stream, UNIT, mix};

/// Coordinates of a point.
pub const DIMENSIONS: usize = 8;
/// Binary digits of a coordinate before scrambling: a set has at most 2^32 points.
const DIGITS: u32 = 32;
/// Levels of the tree of coins that one hashed word serves.
const LEVELS: u32 = 6;

/// Of each dimension but the first the degree and the inner coefficients of its primitive polynomial and the odd
/// numbers m_k of its first directions v_k = m_k 2^-k (file new-joe-kuo-6.21201).
const JOE_KUO: [(usize, u32, [u32; 5]); DIMENSIONS - 1] = [
    (1, 0, [1, 0, 0, 0, 0]),
    (2, 1, [1, 3, 0, 0, 0]),
    (3, 1, [1, 3, 1, 0, 0]),
    (3, 2, [1, 1, 1, 0, 0]),
    (4, 1, [1, 1, 3, 3, 0]),
    (4, 4, [1, 3, 5, 13, 0]),
    (5, 2, [1, 1, 5, 5, 17]),
];

/// v_k of all dimensions, the binary point before the highest bit.
const DIRECTIONS: [[u32; DIMENSIONS]; DIGITS as usize] = directions();

const fn directions() -> [[u32; DIMENSIONS]; DIGITS as usize] {
    let mut v = [[0; DIMENSIONS]; DIGITS as usize];
    let mut k = 0;
    while k < DIGITS as usize {
        v[k][0] = 1 << (DIGITS as usize - 1 - k);
        let mut d = 1;
        while d < DIMENSIONS {
            v[k][d] = direction(&v, k, d);
            d += 1;
        }
        k += 1;
    }
    v
}

/// v_k of dimension `d` from those before it.
const fn direction(v: &[[u32; DIMENSIONS]; DIGITS as usize], k: usize, d: usize) -> u32 {
    let (degree, coefficients, first) = JOE_KUO[d - 1];
    if k < degree {
        return first[k] << (DIGITS as usize - 1 - k);
    }
    let mut sum = v[k - degree][d] ^ (v[k - degree][d] >> degree);
    let mut back = 1;
    while back < degree {
        if (coefficients >> (degree - 1 - back)) & 1 == 1 {
            sum ^= v[k - back][d];
        }
        back += 1;
    }
    sum
}

/// Point number `i` of Sobol's sequence in the order of the Gray code, unscrambled, in units of 2^-32.
pub fn sobol(i: u32) -> [u32; DIMENSIONS] {
    let mut ones = i ^ (i >> 1);
    let mut x = [0; DIMENSIONS];
    while ones != 0 {
        let v = &DIRECTIONS[ones.trailing_zeros() as usize];
        x.iter_mut().zip(v).for_each(|(x, v)| *x ^= v);
        ones &= ones - 1;
    }
    x
}

/// One independently scrambled set of 2^m points.
#[derive(Clone, Debug)]
pub struct PointSet {
    /// Two words for each dimension.
    keys: [[u64; 2]; DIMENSIONS],
    /// Words of coins on the way from the root to where no two points of the set share a path.
    words: u32,
}

impl PointSet {
    /// The set of `batch`, of 2^`m` points, `m` at most 32. `scrambling` is the stream of `Domain::Scrambling`.
    pub fn new(scrambling: &Stream, batch: u64, m: u32) -> Self {
        assert!(m <= DIGITS, "a set of 2^{m} points");
        let mut generator = scrambling.generator(batch);
        let keys = std::array::from_fn(|_| [generator.word(), generator.word()]);
        PointSet { keys, words: m.div_ceil(LEVELS) }
    }

    /// Point number `i` of the set: eight multiples of 2^-53 in [0, 1).
    pub fn point(&self, i: u32) -> [f64; DIMENSIONS] {
        self.start(i)
    }

    /// The first coordinates of point number `i`.
    pub fn start<const N: usize>(&self, i: u32) -> [f64; N] {
        let x = sobol(i);
        std::array::from_fn(|d| self.scrambled(x[d], self.keys[d]) as f64 * UNIT)
    }

    /// The 53 digits of a scrambled coordinate.
    fn scrambled(&self, x: u32, key: [u64; 2]) -> u64 {
        let mut digits = u64::from(x) << (64 - DIGITS);
        // The way so far after a leading one: no two nodes of the tree have the same.
        let mut way = 1;
        let mut y = 0;
        for _ in 0..self.words {
            let next = digits >> (64 - LEVELS);
            y = (y << LEVELS) | (next ^ coins(hashed(way, key), next));
            way = (way << LEVELS) | next;
            digits <<= LEVELS;
        }
        let below = 53 - self.words * LEVELS;
        (y << below) | (hashed(way, key) >> (64 - below))
    }
}

/// The coins on the way `digits` through the tree of six levels whose node n is bit n of `tree`; the root is node 1.
fn coins(tree: u64, digits: u64) -> u64 {
    let coin = |level: u32| (tree >> ((1 << level) | (digits >> (LEVELS - level)))) & 1;
    (0..LEVELS).fold(0, |coins, level| (coins << 1) | coin(level))
}

/// A word of fair bits for `way` under `key`.
fn hashed(way: u64, [a, b]: [u64; 2]) -> u64 {
    mix(mix(way ^ a).wrapping_add(b))
}
