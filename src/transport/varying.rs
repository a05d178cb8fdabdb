//! Responses of the receivers of a tile that depend on the direction of arrival, in lanes.
//!
//! One law of reflection is evaluated for all lanes of a bundle at once, and kept where it is theirs: neighbours mostly
//! share a surface. [`super::receiver`] has the same of one receiver in f64, and is the twin that tests this.

#![allow(clippy::needless_range_loop, reason = "several arrays go by one axis, lane or channel")]

use super::connection::Link;
use super::receiver::Response;
use super::totals::Column;
use crate::geometry::simd::exact::Triple;
use crate::geometry::simd::{Isa, Vector};
use crate::geometry::visibility::{BUNDLE, BUNDLES, Lanes};
use crate::scene::{LawInLanes, Scene, Tints, weights_over_tolerated};

/// Receivers with laws that differ in their tint alone.
#[derive(Debug)]
struct Group {
    /// One of the laws.
    law: LawInLanes,
    lanes: Lanes,
    /// Those whose law is peaked where a direction 60 degrees from the normal is mirrored.
    lobed: Lanes,
    has_diffuse: bool,
}

/// The receivers of a tile whose response depends on the direction of arrival.
#[derive(Debug)]
pub(super) struct Varying {
    /// Laws that differ in more than their tint.
    laws: Vec<Group>,
    /// Specular reflectance at normal incidence, and at grazing incidence.
    f0: [Column; 3],
    f90: Column,
    /// What is under the specular part.
    diffuse: [Column; 3],
    to_eye: [Column; 3],
    /// What gets through the specular part towards the eye.
    through: [Column; 3],
    attenuation: [Column; 3],
    carried: Column,
    /// Receivers the peaks of which lessen the share of connections.
    peaked: Lanes,
}

impl Varying {
    /// Those of `links`; `None` where there are none.
    pub(super) fn new(scene: &Scene, links: &[Link]) -> Option<Box<Varying>> {
        let zero: Column = [[0.0; BUNDLE]; BUNDLES];
        let mut all = Varying {
            laws: Vec::new(),
            f0: [zero; 3],
            f90: zero,
            diffuse: [zero; 3],
            to_eye: [zero; 3],
            through: [zero; 3],
            attenuation: [zero; 3],
            carried: zero,
            peaked: [0; BUNDLES],
        };
        for (i, link) in links.iter().enumerate() {
            let Response::Reflectance { primitive, position, to_eye, attenuation, carried, peaked } =
                link.receiver.response
            else {
                continue;
            };
            let reflectance = scene.reflectance(primitive, position);
            if let Some(law) = reflectance.lanes() {
                let (bundle, lane) = (i / BUNDLE, i % BUNDLE);
                let group = all.of_law(law);
                group.lanes[bundle] |= 1 << lane;
                group.lobed[bundle] |= u16::from(reflectance.is_peaked()) << lane;
                group.has_diffuse |= law.tint().diffuse != [0.0; 3];
                all.peaked[bundle] |= u16::from(peaked) << lane;
                all.carried[bundle][lane] = carried as f32;
                all.f90[bundle][lane] = law.tint().f90;
                let through = reflectance.through(to_eye.dot(link.receiver.normal));
                for k in 0..3 {
                    all.f0[k][bundle][lane] = law.tint().f0[k];
                    all.diffuse[k][bundle][lane] = law.tint().diffuse[k];
                    all.through[k][bundle][lane] = through.0[k] as f32;
                    all.to_eye[k][bundle][lane] = to_eye[k] as f32;
                    all.attenuation[k][bundle][lane] = attenuation.0[k] as f32;
                }
            }
        }
        (!all.laws.is_empty()).then(|| Box::new(all))
    }

    /// The group of laws like `law`.
    fn of_law(&mut self, law: &LawInLanes) -> &mut Group {
        let known = self.laws.iter().position(|group| group.law.is_like(law));
        let at = known.unwrap_or(self.laws.len());
        if known.is_none() {
            let none = [0; BUNDLES];
            self.laws.push(Group { law: law.clone(), lanes: none, lobed: none, has_diffuse: false });
        }
        &mut self.laws[at]
    }

    /// Response to light that arrives from the unit vectors `from`, and the peak by which the share is lessened, for the lanes
    /// `wanted` of a bundle; 1 and 1 where the response does not depend on direction.
    #[inline(always)]
    pub(super) fn respond<I: Isa, const C: usize>(
        &self,
        bundle: usize,
        wanted: u32,
        normal: &Triple<I::Sixteen>,
        from: &Triple<I::Sixteen>,
    ) -> ([I::Sixteen; C], I::Sixteen) {
        let one = I::Sixteen::splat(1.0);
        let (mut response, mut peak) = ([one; C], one);
        for group in &self.laws {
            let here = u32::from(group.lanes[bundle]) & wanted;
            if here != 0 {
                let (f, weight) = self.of_one::<I, C>(group, bundle, normal, from);
                for c in 0..C {
                    response[c] = blend::<I>(response[c], f[c], here);
                }
                peak = blend::<I>(peak, weight, here & u32::from(self.peaked[bundle]));
            }
        }
        (response, peak)
    }

    /// f times attenuation and what is carried, and the weight of f over the tolerated.
    #[inline(always)]
    fn of_one<I: Isa, const C: usize>(
        &self,
        group: &Group,
        bundle: usize,
        normal: &Triple<I::Sixteen>,
        from: &Triple<I::Sixteen>,
    ) -> ([I::Sixteen; C], I::Sixteen) {
        let one = I::Sixteen::splat(1.0);
        let [x, y, z] = &self.to_eye;
        let to_eye = [I::Sixteen::load(&x[bundle]), I::Sixteen::load(&y[bundle]), I::Sixteen::load(&z[bundle])];
        let (mut through, mut f0, mut diffuse) = ([one; C], [one; C], [one; C]);
        for c in 0..C {
            through[c] = I::Sixteen::load(&self.through[c][bundle]);
            f0[c] = I::Sixteen::load(&self.f0[c][bundle]);
            diffuse[c] = I::Sixteen::load(&self.diffuse[c][bundle]);
        }
        let diffuse = if group.has_diffuse { Some(diffuse) } else { None };
        let tints = Tints { f0, f90: I::Sixteen::load(&self.f90[bundle]), diffuse };
        let mut f = group.law.evaluate_tinted::<I::Sixteen, C>(normal, (&to_eye, &through), from, &tints);
        let weight = weights_over_tolerated(&f);
        let carried = I::Sixteen::load(&self.carried[bundle]);
        let lobed = u32::from(group.lobed[bundle]);
        let carried = if lobed == 0 { carried } else { blend::<I>(carried, carried.div(weight), lobed) };
        let left = one.sub(carried.min(one));
        for c in 0..C {
            f[c] = f[c].mul(I::Sixteen::load(&self.attenuation[c][bundle])).mul(left);
        }
        (f, weight)
    }
}

/// The lanes of `other` whose bits are set in `mask`, and those of `one`.
#[inline(always)]
fn blend<I: Isa>(one: I::Sixteen, other: I::Sixteen, mask: u32) -> I::Sixteen {
    one.select(!mask & 0xffff).add(other.select(mask))
}
