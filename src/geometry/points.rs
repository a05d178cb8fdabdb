//! Points that the visibility kernel takes together: a tile, its groups and bundles with the boxes around them.

use super::Geometry;
use super::harmonic::beside::TileBeside;
use super::mesh::bits;
use super::packet::range;
use super::simd::{Isa, Vector};
use super::visibility::{BUNDLE, BUNDLES, GROUP, Lanes};
use crate::math::{DVec3, Vec3};

/// A box between two corners \[m\].
pub(super) type Corners = ([f32; 3], [f32; 3]);

/// Up to [`TILE`](super::visibility::TILE) points, and the boxes around them.
#[derive(Clone, Debug)]
pub(super) struct Ends {
    x: [[f32; BUNDLE]; BUNDLES],
    y: [[f32; BUNDLE]; BUNDLES],
    z: [[f32; BUNDLE]; BUNDLES],
    pub(super) tile: Corners,
    pub(super) groups: [Corners; BUNDLES / GROUP],
    pub(super) bundles: [Corners; BUNDLES],
    /// Points so far from the mesh that they go through it alone.
    pub(super) far: Lanes,
}

/// No box.
const EMPTY: Corners = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);

impl Ends {
    fn new(geometry: &Geometry, points: &[Vec3]) -> Self {
        let none = [[0.0; BUNDLE]; BUNDLES];
        let bundles = [EMPTY; BUNDLES];
        let mut ends = Ends { x: none, y: none, z: none, tile: EMPTY, groups: [EMPTY; 4], bundles, far: [0; BUNDLES] };
        for (i, &point) in points.iter().enumerate() {
            let (bundle, lane) = (i / BUNDLE, i % BUNDLE);
            (ends.x[bundle][lane], ends.y[bundle][lane], ends.z[bundle][lane]) = point.into();
            if geometry.mesh.is_near(point.as_dvec3()) {
                include(&mut ends.bundles[bundle], point);
            } else {
                ends.far[bundle] |= 1 << lane;
            }
        }
        ends.join();
        ends
    }

    /// Makes the boxes of groups and tile anew from those of bundles.
    #[inline(always)]
    pub(super) fn join(&mut self) {
        self.tile = EMPTY;
        for group in 0..BUNDLES / GROUP {
            self.groups[group] = EMPTY;
            for bundle in GROUP * group..GROUP * (group + 1) {
                unite(&mut self.groups[group], &self.bundles[bundle]);
            }
            unite(&mut self.tile, &self.groups[group]);
        }
    }

    /// A point \[m\].
    #[inline(always)]
    pub(super) fn point(&self, bundle: usize, lane: usize) -> Vec3 {
        Vec3::new(self.x[bundle][lane], self.y[bundle][lane], self.z[bundle][lane])
    }

    /// The points of a bundle.
    #[inline(always)]
    pub(super) fn bundle<I: Isa>(&self, bundle: usize) -> [I::Sixteen; 3] {
        [I::Sixteen::load(&self.x[bundle]), I::Sixteen::load(&self.y[bundle]), I::Sixteen::load(&self.z[bundle])]
    }

    /// Other points in the place of those of a bundle, of which only `asked` count, at least one.
    #[inline(always)]
    pub(super) fn set_bundle<I: Isa>(&mut self, bundle: usize, points: &[I::Sixteen; 3], asked: u16) {
        let first = asked.trailing_zeros() as usize;
        let (asked, far) = (u32::from(asked), self.far[bundle]);
        let mut corners = EMPTY;
        for axis in 0..3 {
            let column = match axis {
                0 => &mut self.x[bundle],
                1 => &mut self.y[bundle],
                _ => &mut self.z[bundle],
            };
            points[axis].store(column);
            // The first in the place of those that do not count: the box is as small as can be.
            let first = I::Sixteen::splat(column[first]).select(!asked);
            points[axis].select(asked).add(first).store(column);
            (corners.0[axis], corners.1[axis]) = range::<I>(column);
        }
        if far != 0 {
            corners = EMPTY;
            for lane in bits(asked & !u32::from(far)) {
                include(&mut corners, self.point(bundle, lane));
            }
        }
        self.bundles[bundle] = corners;
    }

    /// The segments from `apex` to the points of a bundle.
    #[inline(always)]
    pub(super) fn segments<I: Isa>(&self, bundle: usize, apex: [f32; 3]) -> [I::Sixteen; 3] {
        let [x, y, z] = self.bundle::<I>(bundle);
        [x.sub(I::Sixteen::splat(apex[0])), y.sub(I::Sixteen::splat(apex[1])), z.sub(I::Sixteen::splat(apex[2]))]
    }
}

/// Up to [`TILE`](super::visibility::TILE) lifted points, as the kernel wants them.
#[derive(Debug)]
pub struct Points {
    pub(super) ends: Ends,
    /// Of each plane, the points in front of it and those behind it.
    pub(super) sides: Vec<[Lanes; 2]>,
    /// Of each sphere, the points inside.
    pub(super) inside: Vec<Lanes>,
    /// Of each star-shaped object, where they are.
    pub(super) beside: Vec<TileBeside>,
}

impl Points {
    /// The tile of `points`, at most [`TILE`](super::visibility::TILE) \[m\].
    pub fn new(geometry: &Geometry, points: &[Vec3]) -> Self {
        let where_true = |is: &dyn Fn(DVec3) -> bool| {
            let mut lanes = [0; BUNDLES];
            for (i, point) in points.iter().enumerate() {
                lanes[i / BUNDLE] |= u16::from(is(point.as_dvec3())) << (i % BUNDLE);
            }
            lanes
        };
        let sides = |p: &super::Plane| [where_true(&|q| p.height(q) > 0.0), where_true(&|q| p.height(q) < 0.0)];
        Points {
            ends: Ends::new(geometry, points),
            sides: geometry.planes.iter().map(sides).collect(),
            inside: geometry.spheres.iter().map(|s| where_true(&|q| s.contains(q))).collect(),
            beside: geometry.harmonics.iter().map(|h| TileBeside::new(h, points)).collect(),
        }
    }

    /// A point of the tile \[m\].
    #[inline(always)]
    pub(super) fn point(&self, bundle: usize, lane: usize) -> Vec3 {
        self.ends.point(bundle, lane)
    }
}

#[inline(always)]
fn unite(corners: &mut Corners, other: &Corners) {
    for axis in 0..3 {
        corners.0[axis] = corners.0[axis].min(other.0[axis]);
        corners.1[axis] = corners.1[axis].max(other.1[axis]);
    }
}

#[inline(always)]
fn include(corners: &mut Corners, point: Vec3) {
    for axis in 0..3 {
        corners.0[axis] = corners.0[axis].min(point[axis]);
        corners.1[axis] = corners.1[axis].max(point[axis]);
    }
}
