//! The metallic-roughness law for many pairs of directions at once, in lanes of f32.
//!
//! The equations are those of `glossy`, `microfacet` and `albedo`, whose f64 is the twin that tests these. Plain
//! operations alone, so the bits do not depend on the width of the vectors; no gathered loads, which are slower here than
//! sixteen single ones.

#![allow(clippy::needless_range_loop, reason = "several arrays go by one channel or lane")]

use super::PEAK;
use super::albedo::{Coefficients, INTERVALS};
use super::directional::{Directional, one_by_one};
use crate::geometry::simd::Vector;
use crate::geometry::simd::exact::{Triple, add, cross, dot};
use crate::math::PI;
use crate::photometry::{Colour, REC709};

/// What a divisor that may vanish with its dividend is kept above: nothing that counts comes near it.
const TINY: f32 = 1e-30;

/// A law of reflection with its parameters in f32.
#[derive(Clone, Debug)]
pub struct LawInLanes {
    f0: [f32; 3],
    diffuse: [f32; 3],
    has_diffuse: bool,
    specular: Specular,
    /// A law of another kind, evaluated lane by lane.
    other: Option<Box<Directional>>,
}

#[derive(Clone, Debug)]
enum Specular {
    Mirror,
    Rough { alpha2: f32, intervals: Box<[Interval; INTERVALS]> },
}

/// A and B where an interval of the table begins, and how much they rise in it.
type Interval = [f32; 4];

impl LawInLanes {
    /// The law over a mirror.
    pub(super) fn mirror(f0: Colour, diffuse: Colour) -> Self {
        Self::new(f0, diffuse, Specular::Mirror)
    }

    /// The law of roughness `alpha2`, the square of alpha, with A and B of its specular albedo.
    pub(super) fn rough(f0: Colour, diffuse: Colour, alpha2: f64, nodes: &[Coefficients]) -> Self {
        let mut intervals = Box::new([[0.0; 4]; INTERVALS]);
        for (interval, ends) in intervals.iter_mut().zip(nodes.windows(2)) {
            let (rise_a, rise_b) = (ends[1].a - ends[0].a, ends[1].b - ends[0].b);
            *interval = [ends[0].a, ends[0].b, rise_a, rise_b].map(|x| x as f32);
        }
        Self::new(f0, diffuse, Specular::Rough { alpha2: alpha2 as f32, intervals })
    }

    /// The law of another kind.
    pub(super) fn one_by_one(law: Directional) -> Self {
        LawInLanes { other: Some(Box::new(law)), ..Self::mirror(Colour::BLACK, Colour::BLACK) }
    }

    fn new(f0: Colour, diffuse: Colour, specular: Specular) -> Self {
        let narrow = |c: Colour| c.0.map(|c| c as f32);
        LawInLanes { f0: narrow(f0), diffuse: narrow(diffuse), has_diffuse: !diffuse.is_black(), specular, other: None }
    }

    /// f in `C` channels without the delta component \[1/sr\]; 0 where a direction lies below the surface. Both directions are
    /// unit vectors away from the surface with the unit `normal`, that to where light comes from and that to where it goes, in
    /// any order; `through` is [`super::Reflectance::through`] of the first.
    #[inline(always)]
    pub fn evaluate<V: Vector<Array = [f32; 16]>, const C: usize>(
        &self,
        normal: &Triple<V>,
        (one, through): (&Triple<V>, &[V; C]),
        other: &Triple<V>,
    ) -> [V; C] {
        if let Some(law) = &self.other {
            return lane_by_lane(law, normal, one, other);
        }
        let zero = V::splat(0.0);
        let cosines = [dot(normal, one), dot(normal, other)];
        let above = zero.less(cosines[0]) & zero.less(cosines[1]);
        let mut f = [zero; C];
        if let Specular::Rough { alpha2, .. } = self.specular {
            self.add_specular(&mut f, alpha2, normal, &add(one, other), cosines);
        }
        if self.has_diffuse {
            self.add_diffuse(&mut f, through, cosines[1]);
        }
        for c in 0..C {
            f[c] = f[c].select(above);
        }
        f
    }

    /// F D V, of the sum of the two directions.
    #[inline(always)]
    fn add_specular<V: Vector, const C: usize>(
        &self,
        f: &mut [V; C],
        alpha2: f32,
        normal: &Triple<V>,
        sum: &Triple<V>,
        [mu, nu]: [V; 2],
    ) {
        let (alpha2, rest) = (V::splat(alpha2), V::splat(1.0 - alpha2));
        let stretched = |mu: V| alpha2.add(rest.mul(mu.mul(mu))).sqrt();
        let across = cross(normal, sum);
        let (length2, along) = (dot(sum, sum), mu.add(nu));
        let spread = alpha2.mul(along.mul(along)).add(dot(&across, &across));
        let ratio = length2.div(spread.max(V::splat(TINY)));
        let reach = nu.mul(stretched(mu)).add(mu.mul(stretched(nu))).max(V::splat(TINY));
        let law = alpha2.mul(V::splat((0.5 / PI) as f32)).mul(ratio.mul(ratio)).div(reach);
        let rise = fresnel_rise(V::splat(0.5).mul(length2.sqrt()));
        for c in 0..C {
            let f0 = V::splat(self.f0[c]);
            f[c] = f[c].add(f0.add(V::splat(1.0).sub(f0).mul(rise)).mul(law));
        }
    }

    /// What is under the specular part, of light that gets `through` it on one side and leaves or comes at the cosine `mu`.
    #[inline(always)]
    fn add_diffuse<V: Vector<Array = [f32; 16]>, const C: usize>(&self, f: &mut [V; C], through: &[V; C], mu: V) {
        let one = V::splat(1.0);
        let [a, b] = self.albedo(mu);
        for c in 0..C {
            let other = one.sub(V::splat(self.f0[c]).mul(a).add(b));
            f[c] = f[c].add(V::splat(self.diffuse[c]).mul(through[c].mul(other)));
        }
    }

    /// A and B at the cosine `mu`.
    #[inline(always)]
    fn albedo<V: Vector<Array = [f32; 16]>>(&self, mu: V) -> [V; 2] {
        let Specular::Rough { intervals, .. } = &self.specular else {
            let rise = fresnel_rise(mu);
            return [V::splat(1.0).sub(rise), rise];
        };
        let (zero, one, count) = (V::splat(0.0), V::splat(1.0), V::splat(INTERVALS as f32));
        let at = mu.max(zero).min(one).sqrt().sqrt().mul(count);
        // In a number of this size the last bits count units: the number of the interval, no conversion needed.
        let units = V::splat((1u32 << 23) as f32);
        let numbered = at.sub(V::splat(0.5)).max(zero).min(count.sub(one)).add(units);
        let rest = at.sub(numbered.sub(units));
        let mut numbers = [0.0; 16];
        numbered.store(&mut numbers);
        let mut columns = [[0.0; 16]; 4];
        for lane in 0..16 {
            let interval = &intervals[numbers[lane].to_bits() as usize % INTERVALS];
            for k in 0..4 {
                columns[k][lane] = interval[k];
            }
        }
        let value = |k: usize| V::load(&columns[k]).add(V::load(&columns[k + 2]).mul(rest));
        [value(0), value(1)]
    }
}

/// f by plain code.
#[inline(always)]
fn lane_by_lane<V: Vector<Array = [f32; 16]>, const C: usize>(
    law: &Directional,
    normal: &Triple<V>,
    one: &Triple<V>,
    other: &Triple<V>,
) -> [V; C] {
    let mut stored = [[[0.0; 16]; 3]; 3];
    for axis in 0..3 {
        normal[axis].store(&mut stored[0][axis]);
        one[axis].store(&mut stored[1][axis]);
        other[axis].store(&mut stored[2][axis]);
    }
    let values = one_by_one::<C>(law, &stored[0], &stored[1], &stored[2]);
    let mut f = [V::splat(0.0); C];
    for c in 0..C {
        f[c] = V::load(&values[c]);
    }
    f
}

/// How many times the tolerated weight connections with these values of `f` have, at least 1.
#[inline(always)]
pub fn weights_over_tolerated<V: Vector, const C: usize>(f: &[V; C]) -> V {
    let mut luminance = f[0];
    if C > 1 {
        luminance = f[0].mul(V::splat(REC709[0] as f32));
        for c in 1..C {
            luminance = luminance.add(f[c].mul(V::splat(REC709[c] as f32)));
        }
    }
    luminance.mul(V::splat((PI / PEAK) as f32)).max(V::splat(1.0))
}

/// (1 - c)^5, as its twin of f64.
#[inline(always)]
fn fresnel_rise<V: Vector>(c: V) -> V {
    let x = V::splat(1.0).sub(c).max(V::splat(0.0));
    let x2 = x.mul(x);
    x2.mul(x2).mul(x)
}
