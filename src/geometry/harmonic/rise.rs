//! How far from a point just outside of a surface a segment is certainly clear, and whether it is from there on.
//!
//! ```text
//! F(p + s D) >= s h(s),   h(s) = (g,D) + s D'QD/2 - s^2 M |D|^3/6        0 <= s, F(p) >= 0, |s D| <= reach
//! ```
//!
//! with g and Q the first and second derivatives of F in space at p and M a bound of the third along lines around. h is concave, so up to its
//! root there is no surface. With D the whole way to another point, s is the share of it that is clear. Where s (g,D) exceeds the height of the
//! plane across g that the whole surface lies under (`hull`) above p, what follows is above that plane too, and so clear however far it goes. Numbers
//! are f32 and in the world; their roundings are in what is taken off the slope and the bend.

use super::hull::Hull;
use super::samples::Look;
use crate::geometry::points::Ends;
use crate::geometry::simd::{Isa, Kernel, Vector};
use crate::geometry::visibility::{BUNDLE, BUNDLES, Lanes};
use crate::math::{DMat3, DVec3, Vec3};

/// Numbers of a rise.
const NUMBERS: usize = 14;
/// What f32 rounds of a sum of products, in units of the largest.
const ROUNDING: f64 = 2e-6;
/// What is left off a share for the rounding of its own.
const MARGIN: f32 = 1.0 - 1e-5;

/// Shares of the ways to the points of a tile.
pub(super) type Shares = [[f32; BUNDLE]; BUNDLES];

/// The derivatives of F at a point, where the distance to the surface is not negative.
#[derive(Clone, Copy, Debug)]
pub(in crate::geometry) struct Rise {
    /// g, what it is wrong by, Q (xx, yy, zz, yz, xz, xy), what it is wrong by, M/6, reach \[m\], and (g,x) of the plane above all
    /// less that of p.
    numbers: [f32; NUMBERS],
}

impl Rise {
    /// At `p` in the coordinates of a surface, which looks as `look` says in the direction of `p`, as far as an angle with this `sine`, and stays
    /// within the `hull`; `to_own` leads there from the world, and makes nothing longer than by the factor `stretch`, `to_world` leads back.
    pub(super) fn new(
        p: DVec3,
        look: &Look,
        (sine, hull): (f64, &Hull),
        (to_own, to_world): (&DMat3, &DMat3),
        stretch: f64,
    ) -> Rise {
        let length = p.length();
        let n = p / length;
        let outer = |a: DVec3, b: DVec3| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
        let slope = n - look.gradient / length;
        let turned = look.hessian - outer(n, look.gradient) - outer(look.gradient, n);
        let bend = (DMat3::IDENTITY - outer(n, n) - turned * (1.0 / length)) * (1.0 / length);
        let [_, third] = look.around.of_lines((1.0 - sine) * length, 1.0);
        let (slope, bend) = (to_own.transpose() * slope, to_own.transpose() * bend * *to_own);
        let rows = bend.to_cols_array_2d();
        let greatest = bend.to_cols_array().iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let wrong = look.errors.first / length * stretch + ROUNDING * slope.length();
        let bent_wrong = look.errors.second / (length * length) * stretch * stretch + ROUNDING * greatest;
        let single = |x: f64| x as f32;
        let [gx, gy, gz] = slope.to_array().map(single);
        let [xx, yy, zz] = [rows[0][0], rows[1][1], rows[2][2]].map(single);
        let [yz, xz, xy] = [rows[1][2], rows[0][2], rows[0][1]].map(single);
        let [wrong, bent_wrong, third] = [wrong, bent_wrong, third / 6.0 * stretch * stretch * stretch].map(single);
        let reach = single(sine * length / stretch);
        // Of g as it was rounded.
        let across = to_world.transpose() * DVec3::new(gx.into(), gy.into(), gz.into());
        let above = hull.support(across) - across.dot(p);
        let above = single(above.max(0.0) + ROUNDING * (above.abs() + across.length() * length));
        Rise { numbers: [gx, gy, gz, wrong, xx, yy, zz, yz, xz, xy, bent_wrong, third, reach, above] }
    }

    /// The share of the way `d` \[m\] that is clear; `None` where all of it is, and all beyond.
    pub(super) fn clear(&self, d: Vec3) -> Option<f32> {
        let [gx, gy, gz, wrong, xx, yy, zz, yz, xz, xy, bent_wrong, third, reach, above] = self.numbers;
        let slope = gx * d.x + gy * d.y + gz * d.z - wrong * (d.x.abs() + d.y.abs() + d.z.abs());
        if slope <= 0.0 {
            return Some(0.0);
        }
        let length2 = d.x * d.x + d.y * d.y + d.z * d.z;
        let sides = yz * d.y * d.z + xz * d.x * d.z + xy * d.x * d.y;
        let bend = sides + 0.5 * (xx * d.x * d.x + yy * d.y * d.y + zz * d.z * d.z - bent_wrong * length2);
        let length = length2.sqrt();
        let third = third * length2 * length;
        let size = bend.abs() + (bend * bend + 4.0 * third * slope).sqrt();
        let share = if bend < 0.0 { 2.0 * slope / size } else { 0.5 * size / third };
        let share = share.min(reach / length).min(1.0) * MARGIN;
        if share * slope > above { None } else { Some(share) }
    }
}

/// The rises of the points of a tile, all 0 where there is none, and where there are.
#[derive(Debug)]
pub(super) struct Rises([[[f32; BUNDLE]; BUNDLES]; NUMBERS], Lanes);

impl Default for Rises {
    fn default() -> Self {
        Rises([[[0.0; BUNDLE]; BUNDLES]; NUMBERS], [0; BUNDLES])
    }
}

impl Rises {
    pub(super) fn set(&mut self, point: usize, rise: &Rise) {
        for (column, number) in self.0.iter_mut().zip(rise.numbers) {
            column[point / BUNDLE][point % BUNDLE] = number;
        }
        self.1[point / BUNDLE] |= 1 << (point % BUNDLE);
    }
}

/// Puts the points `asked` of a tile as far towards `apex` as their ways there are clear, but leaves those where all of it is: those it gives.
pub(super) struct Leave<'a> {
    pub(super) rises: &'a Rises,
    pub(super) apex: Vec3,
    pub(super) asked: &'a Lanes,
    pub(super) ends: &'a Ends,
    /// Where they come to; large, so not handed from call to call.
    pub(super) moved: &'a mut Option<Ends>,
}

impl Kernel for Leave<'_> {
    type Output = Lanes;

    #[inline(always)]
    fn run<I: Isa>(self) -> Lanes {
        let (moved, mut free) = (self.moved, [0; BUNDLES]);
        let apex = splat::<I>(self.apex);
        for bundle in 0..BUNDLES {
            if self.asked[bundle] == 0 {
                continue;
            }
            let at = self.ends.bundle::<I>(bundle);
            let d = [apex[0].sub(at[0]), apex[1].sub(at[1]), apex[2].sub(at[2])];
            let mut numbers = [I::Sixteen::splat(0.0); NUMBERS];
            for k in 0..NUMBERS {
                numbers[k] = I::Sixteen::load(&self.rises.0[k][bundle]);
            }
            let (share, clear) = share::<I>(&numbers, &d);
            free[bundle] = self.asked[bundle] & clear as u16;
            let left = self.asked[bundle] & !free[bundle];
            if left & self.rises.1[bundle] != 0 {
                let to = [d[0].mul(share).add(at[0]), d[1].mul(share).add(at[1]), d[2].mul(share).add(at[2])];
                if moved.is_none() {
                    *moved = Some(self.ends.clone());
                }
                if let Some(ends) = moved {
                    ends.set_bundle::<I>(bundle, &to, left);
                }
            }
        }
        if let Some(ends) = moved {
            ends.join();
        }
        free
    }
}

/// The shares of the ways from one point to those `asked` of a tile that are clear, and where all of it is.
pub(super) struct Depart<'a> {
    pub(super) rise: &'a Rise,
    pub(super) from: Vec3,
    pub(super) asked: &'a Lanes,
    pub(super) ends: &'a Ends,
}

impl Kernel for Depart<'_> {
    type Output = (Shares, Lanes);

    #[inline(always)]
    fn run<I: Isa>(self) -> (Shares, Lanes) {
        let (mut shares, mut free) = ([[0.0; BUNDLE]; BUNDLES], [0; BUNDLES]);
        let from = splat::<I>(self.from);
        let mut numbers = [I::Sixteen::splat(0.0); NUMBERS];
        for k in 0..NUMBERS {
            numbers[k] = I::Sixteen::splat(self.rise.numbers[k]);
        }
        for bundle in 0..BUNDLES {
            if self.asked[bundle] != 0 {
                let at = self.ends.bundle::<I>(bundle);
                let d = [at[0].sub(from[0]), at[1].sub(from[1]), at[2].sub(from[2])];
                let (share, clear) = share::<I>(&numbers, &d);
                share.store(&mut shares[bundle]);
                free[bundle] = self.asked[bundle] & clear as u16;
            }
        }
        (shares, free)
    }
}

#[inline(always)]
fn splat<I: Isa>(p: Vec3) -> [I::Sixteen; 3] {
    [I::Sixteen::splat(p.x), I::Sixteen::splat(p.y), I::Sixteen::splat(p.z)]
}

/// What [`Rise::clear`] gives, for sixteen ways; no fused operation, so that all paths give the same.
#[inline(always)]
fn share<I: Isa>(numbers: &[I::Sixteen; NUMBERS], d: &[I::Sixteen; 3]) -> (I::Sixteen, u32) {
    let [gx, gy, gz, wrong, xx, yy, zz, yz, xz, xy, bent_wrong, third, reach, above] = *numbers;
    let [x, y, z] = *d;
    let (zero, one, half) = (I::Sixteen::splat(0.0), I::Sixteen::splat(1.0), I::Sixteen::splat(0.5));
    let extent = x.abs().add(y.abs()).add(z.abs());
    let slope = gx.mul(x).add(gy.mul(y)).add(gz.mul(z)).sub(wrong.mul(extent));
    let (x2, y2, z2) = (x.mul(x), y.mul(y), z.mul(z));
    let length2 = x2.add(y2).add(z2);
    let sides = yz.mul(y).mul(z).add(xz.mul(x).mul(z)).add(xy.mul(x).mul(y));
    let bend = xx.mul(x2).add(yy.mul(y2)).add(zz.mul(z2)).sub(bent_wrong.mul(length2)).mul(half).add(sides);
    let length = length2.sqrt();
    let third = third.mul(length2).mul(length);
    let four = I::Sixteen::splat(4.0);
    let size = bend.abs().add(bend.mul(bend).add(four.mul(third).mul(slope)).sqrt());
    let falls = bend.less(zero);
    let share = slope.add(slope).div(size).select(falls).add(half.mul(size).div(third).select(!falls));
    // Of a way without length neither is a number, and the other counts.
    let share = reach.div(length).min(share.min(one));
    let share = share.mul(I::Sixteen::splat(MARGIN)).select(zero.less(slope));
    (share, above.less(share.mul(slope)))
}
