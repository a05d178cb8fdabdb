//! Points that the visibility kernel takes together: a tile, its groups and bundles with the boxes around them.

use super::Geometry;
use super::harmonic::beside::TileBeside;
use super::simd::{Isa, Vector};
use super::visibility::{BUNDLE, BUNDLES, GROUP, Lanes};
use crate::math::{DVec3, Vec3};

/// A box between two corners \[m\].
pub(super) type Corners = ([f32; 3], [f32; 3]);

/// Up to [`TILE`](super::visibility::TILE) lifted points, as the kernel wants them.
#[derive(Debug)]
pub struct Points {
    pub(super) x: [[f32; BUNDLE]; BUNDLES],
    pub(super) y: [[f32; BUNDLE]; BUNDLES],
    pub(super) z: [[f32; BUNDLE]; BUNDLES],
    pub(super) tile: Corners,
    pub(super) groups: [Corners; BUNDLES / GROUP],
    pub(super) bundles: [Corners; BUNDLES],
    /// Points so far from the mesh that they go through it alone.
    pub(super) far: Lanes,
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
        let empty = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        let mut tile = Points {
            x: [[0.0; BUNDLE]; BUNDLES],
            y: [[0.0; BUNDLE]; BUNDLES],
            z: [[0.0; BUNDLE]; BUNDLES],
            tile: empty,
            groups: [empty; BUNDLES / GROUP],
            bundles: [empty; BUNDLES],
            far: [0; BUNDLES],
            sides: Vec::new(),
            inside: Vec::new(),
            beside: Vec::new(),
        };
        for (i, &point) in points.iter().enumerate() {
            let (bundle, lane) = (i / BUNDLE, i % BUNDLE);
            (tile.x[bundle][lane], tile.y[bundle][lane], tile.z[bundle][lane]) = point.into();
            if geometry.mesh.is_near(point.as_dvec3()) {
                for corners in [&mut tile.tile, &mut tile.groups[bundle / GROUP], &mut tile.bundles[bundle]] {
                    include(corners, point);
                }
            } else {
                tile.far[bundle] |= 1 << lane;
            }
        }
        let where_true = |is: &dyn Fn(DVec3) -> bool| {
            let mut lanes = [0; BUNDLES];
            for (i, point) in points.iter().enumerate() {
                lanes[i / BUNDLE] |= u16::from(is(point.as_dvec3())) << (i % BUNDLE);
            }
            lanes
        };
        let sides = |p: &super::Plane| [where_true(&|q| p.height(q) > 0.0), where_true(&|q| p.height(q) < 0.0)];
        tile.sides = geometry.planes.iter().map(sides).collect();
        tile.inside = geometry.spheres.iter().map(|s| where_true(&|q| s.contains(q))).collect();
        tile.beside = geometry.harmonics.iter().map(|h| TileBeside::new(h, points)).collect();
        tile
    }

    /// A point of the tile \[m\].
    #[inline(always)]
    pub(super) fn point(&self, bundle: usize, lane: usize) -> Vec3 {
        Vec3::new(self.x[bundle][lane], self.y[bundle][lane], self.z[bundle][lane])
    }

    /// The segments from `apex` to the points of a bundle.
    #[inline(always)]
    pub(super) fn segments<I: Isa>(&self, bundle: usize, apex: [f32; 3]) -> [I::Sixteen; 3] {
        [
            I::Sixteen::load(&self.x[bundle]).sub(I::Sixteen::splat(apex[0])),
            I::Sixteen::load(&self.y[bundle]).sub(I::Sixteen::splat(apex[1])),
            I::Sixteen::load(&self.z[bundle]).sub(I::Sixteen::splat(apex[2])),
        ]
    }
}

fn include(corners: &mut Corners, point: Vec3) {
    for axis in 0..3 {
        corners.0[axis] = corners.0[axis].min(point[axis]);
        corners.1[axis] = corners.1[axis].max(point[axis]);
    }
}
