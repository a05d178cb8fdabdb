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
use std::sync::Arc;

/// What a divisor that may vanish with its dividend is kept above: nothing that counts comes near it.
const TINY: f32 = 1e-30;

/// A law of reflection with its parameters in f32.
#[derive(Clone, Debug)]
pub struct LawInLanes {
    tint: Tint,
    specular: Arc<SpecularInLanes>,
    /// A law of another kind, evaluated lane by lane.
    other: Option<Arc<Directional>>,
}

/// What of a law depends on the colours of the material.
#[derive(Clone, Copy, Debug)]
pub struct Tint {
    /// Specular reflectance at normal incidence.
    pub f0: [f32; 3],
    /// The same at grazing incidence.
    pub f90: f32,
    /// What f has under the specular part, over what gets through it twice \[1/sr\].
    pub diffuse: [f32; 3],
}

/// The tints of the laws in the lanes.
pub struct Tints<V, const C: usize> {
    /// Of each channel the specular reflectance at normal incidence.
    pub f0: [V; C],
    /// The same at grazing incidence.
    pub f90: V,
    /// Of each channel what is under it; `None` where there is nothing in any lane.
    pub diffuse: Option<[V; C]>,
}

/// The outer surface of a law, whatever its colours.
#[derive(Clone, Debug)]
pub(super) enum SpecularInLanes {
    Mirror,
    Rough { alpha2: f32, intervals: Box<[Interval; INTERVALS]> },
}

/// A and B where an interval of the table begins, and how much they rise in it.
type Interval = [f32; 4];

impl SpecularInLanes {
    /// That of roughness `alpha2`, the square of alpha, with A and B of its specular albedo.
    pub(super) fn rough(alpha2: f64, nodes: &[Coefficients]) -> Self {
        let mut intervals = Box::new([[0.0; 4]; INTERVALS]);
        for (interval, ends) in intervals.iter_mut().zip(nodes.windows(2)) {
            let (rise_a, rise_b) = (ends[1].a - ends[0].a, ends[1].b - ends[0].b);
            *interval = [ends[0].a, ends[0].b, rise_a, rise_b].map(|x| x as f32);
        }
        SpecularInLanes::Rough { alpha2: alpha2 as f32, intervals }
    }
}

impl LawInLanes {
    pub(super) fn new((f0, f90): (Colour, f64), diffuse: Colour, specular: Arc<SpecularInLanes>) -> Self {
        let narrow = |c: Colour| c.0.map(|c| c as f32);
        LawInLanes { tint: Tint { f0: narrow(f0), f90: f90 as f32, diffuse: narrow(diffuse) }, specular, other: None }
    }

    /// The law of another kind.
    pub(super) fn one_by_one(law: Directional) -> Self {
        let none = Self::new((Colour::BLACK, 0.0), Colour::BLACK, Arc::new(SpecularInLanes::Mirror));
        LawInLanes { other: Some(Arc::new(law)), ..none }
    }

    /// What depends on the colours of the material.
    pub fn tint(&self) -> &Tint {
        &self.tint
    }

    /// True where `other` differs in nothing but its tint, and may stand for this one in [`LawInLanes::evaluate_tinted`].
    pub fn is_like(&self, other: &LawInLanes) -> bool {
        Arc::ptr_eq(&self.specular, &other.specular)
    }

    /// f in `C` channels without the delta component \[1/sr\]; 0 where a direction lies below the surface. Both directions are
    /// unit vectors away from the surface with the unit `normal`, that to where light comes from and that to where it goes, in
    /// any order; `through` is [`super::Reflectance::through`] of the first.
    #[inline(always)]
    pub fn evaluate<V: Vector<Array = [f32; 16]>, const C: usize>(
        &self,
        normal: &Triple<V>,
        from: (&Triple<V>, &[V; C]),
        other: &Triple<V>,
    ) -> [V; C] {
        let (mut f0, mut diffuse) = ([V::splat(0.0); C], [V::splat(0.0); C]);
        for c in 0..C {
            f0[c] = V::splat(self.tint.f0[c]);
            diffuse[c] = V::splat(self.tint.diffuse[c]);
        }
        let diffuse = if self.tint.diffuse == [0.0; 3] { None } else { Some(diffuse) };
        self.evaluate_tinted(normal, from, other, &Tints { f0, f90: V::splat(self.tint.f90), diffuse })
    }

    /// The same with `tints`, those of the laws like this one that belong to the lanes.
    #[inline(always)]
    pub fn evaluate_tinted<V: Vector<Array = [f32; 16]>, const C: usize>(
        &self,
        normal: &Triple<V>,
        (one, through): (&Triple<V>, &[V; C]),
        other: &Triple<V>,
        tints: &Tints<V, C>,
    ) -> [V; C] {
        if let Some(law) = &self.other {
            return lane_by_lane(law, normal, one, other);
        }
        let zero = V::splat(0.0);
        let cosines = [dot(normal, one), dot(normal, other)];
        let above = zero.less(cosines[0]) & zero.less(cosines[1]);
        let mut f = [zero; C];
        if let SpecularInLanes::Rough { alpha2, .. } = *self.specular {
            add_specular(&mut f, tints, alpha2, normal, &add(one, other), cosines);
        }
        if let Some(diffuse) = &tints.diffuse {
            let [a, b] = self.specular.albedo(cosines[1]);
            for c in 0..C {
                let through_other = V::splat(1.0).sub(tints.f0[c].mul(a).add(tints.f90.mul(b)));
                f[c] = f[c].add(diffuse[c].mul(through[c].mul(through_other)));
            }
        }
        for c in 0..C {
            f[c] = f[c].select(above);
        }
        f
    }
}

/// F D V, of the sum of the two directions.
#[inline(always)]
fn add_specular<V: Vector, const C: usize>(
    f: &mut [V; C],
    tints: &Tints<V, C>,
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
        let f0 = tints.f0[c];
        f[c] = f[c].add(f0.add(tints.f90.sub(f0).mul(rise)).mul(law));
    }
}

impl SpecularInLanes {
    /// A and B at the cosine `mu`.
    #[inline(always)]
    fn albedo<V: Vector<Array = [f32; 16]>>(&self, mu: V) -> [V; 2] {
        let SpecularInLanes::Rough { intervals, .. } = self else {
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
