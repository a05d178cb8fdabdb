//! Segments of a tile without what is at their start, for an apex that stands within a mesh.

use super::super::mesh::bits;
use super::{BUNDLE, BUNDLES, GROUP, Lanes};

/// The shares of the segments to the points of a tile that are left out at their start: triangles that are crossed there alone may be found
/// or not.
pub(in crate::geometry) struct Starts {
    pub(in crate::geometry) each: [[f32; BUNDLE]; BUNDLES],
    pub(super) tile: f32,
    pub(super) groups: [f32; BUNDLES / GROUP],
    pub(super) bundles: [f32; BUNDLES],
}

impl Starts {
    /// The shares `each` of the points in `seen`.
    pub(in crate::geometry) fn new(each: [[f32; BUNDLE]; BUNDLES], seen: &Lanes) -> Self {
        let mut starts = Starts {
            each,
            tile: f32::INFINITY,
            groups: [f32::INFINITY; BUNDLES / GROUP],
            bundles: [f32::INFINITY; BUNDLES],
        };
        for bundle in 0..BUNDLES {
            for lane in bits(u32::from(seen[bundle])) {
                starts.bundles[bundle] = starts.bundles[bundle].min(each[bundle][lane]);
            }
            let group = &mut starts.groups[bundle / GROUP];
            *group = group.min(starts.bundles[bundle]);
            starts.tile = starts.tile.min(*group);
        }
        starts
    }
}
