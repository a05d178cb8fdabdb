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
use crate::scene::{LawInLanes, Scene, weights_over_tolerated};

/// The receivers of a tile whose response depends on the direction of arrival.
#[derive(Debug)]
pub(super) struct Varying {
    /// A primitive with each law, and the receivers on surfaces of that law.
    laws: Vec<(u32, Lanes)>,
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
            to_eye: [zero; 3],
            through: [zero; 3],
            attenuation: [zero; 3],
            carried: zero,
            peaked: [0; BUNDLES],
        };
        for (i, link) in links.iter().enumerate() {
            if let Response::Reflectance { primitive, to_eye, attenuation, carried, peaked } = link.receiver.response
                && scene.surface(primitive).reflectance.lanes().is_some()
            {
                let (bundle, lane) = (i / BUNDLE, i % BUNDLE);
                all.of_law(scene, primitive)[bundle] |= 1 << lane;
                all.peaked[bundle] |= u16::from(peaked) << lane;
                all.carried[bundle][lane] = carried as f32;
                let through = scene.surface(primitive).reflectance.through(to_eye.dot(link.receiver.normal));
                for k in 0..3 {
                    all.through[k][bundle][lane] = through.0[k] as f32;
                    all.to_eye[k][bundle][lane] = to_eye[k] as f32;
                    all.attenuation[k][bundle][lane] = attenuation.0[k] as f32;
                }
            }
        }
        (!all.laws.is_empty()).then(|| Box::new(all))
    }

    /// The receivers on surfaces like that of `primitive`.
    fn of_law(&mut self, scene: &Scene, primitive: u32) -> &mut Lanes {
        let surface = scene.surface(primitive);
        let known = self.laws.iter().position(|(other, _)| std::ptr::eq(scene.surface(*other), surface));
        let at = known.unwrap_or(self.laws.len());
        if known.is_none() {
            self.laws.push((primitive, [0; BUNDLES]));
        }
        &mut self.laws[at].1
    }

    /// Response to light that arrives from the unit vectors `from`, and the peak by which the share is lessened, for the lanes
    /// `wanted` of a bundle; 1 and 1 where the response does not depend on direction.
    #[inline(always)]
    pub(super) fn respond<I: Isa, const C: usize>(
        &self,
        scene: &Scene,
        bundle: usize,
        wanted: u32,
        normal: &Triple<I::Sixteen>,
        from: &Triple<I::Sixteen>,
    ) -> ([I::Sixteen; C], I::Sixteen) {
        let one = I::Sixteen::splat(1.0);
        let (mut response, mut peak) = ([one; C], one);
        for (primitive, lanes) in &self.laws {
            let here = u32::from(lanes[bundle]) & wanted;
            let reflectance = &scene.surface(*primitive).reflectance;
            if let (Some(law), true) = (reflectance.lanes(), here != 0) {
                let (f, weight) = self.of_one::<I, C>(law, reflectance.is_peaked(), bundle, normal, from);
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
        law: &LawInLanes,
        is_peaked: bool,
        bundle: usize,
        normal: &Triple<I::Sixteen>,
        from: &Triple<I::Sixteen>,
    ) -> ([I::Sixteen; C], I::Sixteen) {
        let one = I::Sixteen::splat(1.0);
        let [x, y, z] = &self.to_eye;
        let to_eye = [I::Sixteen::load(&x[bundle]), I::Sixteen::load(&y[bundle]), I::Sixteen::load(&z[bundle])];
        let mut through = [one; C];
        for c in 0..C {
            through[c] = I::Sixteen::load(&self.through[c][bundle]);
        }
        let mut f = law.evaluate::<I::Sixteen, C>(normal, (&to_eye, &through), from);
        let weight = weights_over_tolerated(&f);
        let carried = I::Sixteen::load(&self.carried[bundle]);
        let carried = if is_peaked { carried.div(weight) } else { carried };
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
