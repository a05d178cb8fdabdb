//! Where points are beside a star-shaped object: one by one, and in tiles.

use super::horizon::Cone;
use super::{Bend, Harmonic};
use crate::geometry::visibility::{BUNDLE, BUNDLES, Lanes, Points};
use crate::math::Vec3;

/// Where a point is.
#[derive(Clone, Copy, Debug)]
pub(in crate::geometry) struct Beside {
    /// Inside the object.
    pub(in crate::geometry) inside: bool,
    /// Maybe inside the outer mesh.
    pub(in crate::geometry) near: bool,
    /// Directions in which there is certainly nothing of the object, where they are known.
    pub(in crate::geometry) free: Option<Cone>,
    /// The series there, of points near but not inside.
    pub(in crate::geometry) bend: Option<Bend>,
}

/// The same of an end of a segment, as far as the series needs it.
#[derive(Clone, Copy)]
pub(in crate::geometry) struct End<'a> {
    /// Maybe inside the outer mesh.
    pub(in crate::geometry) near: bool,
    /// The series there, of points near but not inside.
    pub(in crate::geometry) bend: Option<&'a Bend>,
}

impl Beside {
    pub(in crate::geometry) fn end(&self) -> End<'_> {
        End { near: self.near, bend: self.bend.as_ref() }
    }
}

/// Where the points of a tile are beside a star-shaped object.
#[derive(Debug)]
pub(in crate::geometry) struct TileBeside {
    /// Inside.
    pub(in crate::geometry) inside: Lanes,
    /// Inside or just outside.
    pub(in crate::geometry) near: Lanes,
    /// Of those just outside, the directions in which there is certainly nothing of the object.
    cones: Option<Box<Cones>>,
    /// Of those just outside, the series; in the order of the points.
    bends: Vec<(u16, Bend)>,
}

/// A cone for each point of a tile: axes, and cosines, which are 2 where there is none.
#[derive(Debug)]
struct Cones {
    axes: [[[f32; BUNDLE]; BUNDLES]; 3],
    cosines: [[f32; BUNDLE]; BUNDLES],
}

/// No direction is in a cone with this cosine.
const NONE: f32 = 2.0;
/// What the products of f32 in the test of a cone may round, in units of 1.
const ROUNDING: f64 = 1e-5;

impl TileBeside {
    pub(in crate::geometry) fn new(object: &Harmonic, points: &[Vec3]) -> Self {
        let mut tile = TileBeside { inside: [0; BUNDLES], near: [0; BUNDLES], cones: None, bends: Vec::new() };
        for (i, &point) in points.iter().enumerate() {
            let (bundle, lane) = (i / BUNDLE, i % BUNDLE);
            let Beside { inside, near, free, bend } = object.beside(point.as_dvec3());
            tile.inside[bundle] |= u16::from(inside) << lane;
            tile.near[bundle] |= u16::from(near) << lane;
            tile.bends.extend(bend.map(|bend| (i as u16, bend)));
            if let Some(Cone { axis, cosine }) = free {
                let none =
                    || Box::new(Cones { axes: [[[0.0; BUNDLE]; BUNDLES]; 3], cosines: [[NONE; BUNDLE]; BUNDLES] });
                let cones = tile.cones.get_or_insert_with(none);
                (0..3).for_each(|k| cones.axes[k][bundle][lane] = axis[k] as f32);
                cones.cosines[bundle][lane] = (cosine + ROUNDING) as f32;
            }
        }
        tile
    }

    /// What the series needs to know of a point.
    pub(in crate::geometry) fn end(&self, bundle: usize, lane: usize) -> End<'_> {
        let number = (bundle * BUNDLE + lane) as u16;
        let bend = self.bends.binary_search_by_key(&number, |(i, _)| *i).ok().map(|i| &self.bends[i].1);
        End { near: self.near[bundle] >> lane & 1 == 1, bend }
    }

    /// The points of a bundle, of those `asked`, whose segments to `apex`, which is `here`, certainly meet nothing of the object.
    pub(in crate::geometry) fn free(
        &self,
        bundle: usize,
        points: &Points,
        apex: Vec3,
        here: &Beside,
        asked: u16,
    ) -> u16 {
        if asked == 0 {
            return 0;
        }
        let mut free = 0;
        if let Some(Cone { axis, cosine }) = here.free {
            let (axis, cosine) = ((-axis).as_vec3().to_array(), [(cosine + ROUNDING) as f32; BUNDLE]);
            free |= in_cones(points, bundle, apex, axis.map(|k| [k; BUNDLE]), &cosine);
        }
        if let Some(cones) = self.cones.as_ref().filter(|_| self.near[bundle] & asked != 0) {
            let axes = [cones.axes[0][bundle], cones.axes[1][bundle], cones.axes[2][bundle]];
            free |= in_cones(points, bundle, apex, axes, &cones.cosines[bundle]);
        }
        free
    }
}

/// The points of a bundle from which `apex` lies in their cones with these axes and cosines.
fn in_cones(points: &Points, bundle: usize, apex: Vec3, axes: [[f32; BUNDLE]; 3], cosines: &[f32; BUNDLE]) -> u16 {
    let mut within = 0;
    for lane in 0..BUNDLE {
        let d = apex - points.point(bundle, lane);
        let along = d.x * axes[0][lane] + d.y * axes[1][lane] + d.z * axes[2][lane];
        let whole = d.x * d.x + d.y * d.y + d.z * d.z;
        let is_in = along > 0.0 && along * along > cosines[lane] * cosines[lane] * whole;
        within |= u16::from(is_in) << lane;
    }
    within
}
