//! Where points are beside a star-shaped object: one by one, and in tiles.

use super::Harmonic;
use super::rise::{Depart, Leave, Rise, Rises, Shares};
use crate::geometry::points::Ends;
use crate::geometry::simd::Path;
use crate::geometry::visibility::{BUNDLE, BUNDLES, Lanes};
use crate::math::Vec3;

/// Where a point is.
#[derive(Clone, Copy, Debug)]
pub(in crate::geometry) struct Beside {
    /// Inside the object.
    pub(in crate::geometry) inside: bool,
    /// Maybe inside the outer mesh.
    pub(in crate::geometry) near: bool,
    /// How the distance to the surface grows there, of points near but not inside.
    pub(super) rise: Option<Rise>,
}

impl Beside {
    /// Certainly outside of all meshes.
    pub(super) const FAR: Beside = Beside { inside: false, near: false, rise: None };

    /// The share of the way `d` from there that is certainly clear; `None` where all of it is, and all beyond.
    pub(super) fn clear(&self, d: Vec3) -> Option<f32> {
        self.rise.map_or(Some(0.0), |rise| rise.clear(d))
    }
}

/// Where the points of a tile are beside a star-shaped object.
#[derive(Debug)]
pub(in crate::geometry) struct TileBeside {
    /// Inside.
    pub(super) inside: Lanes,
    /// Maybe inside the outer mesh.
    pub(super) near: Lanes,
    /// Of those near but not inside, how the distance to the surface grows.
    rises: Option<Box<Rises>>,
}

impl TileBeside {
    pub(in crate::geometry) fn new(object: &Harmonic, points: &[Vec3]) -> Self {
        let mut tile = TileBeside { inside: [0; BUNDLES], near: [0; BUNDLES], rises: None };
        for (i, &point) in points.iter().enumerate() {
            let Beside { inside, near, rise } = object.beside(point.as_dvec3());
            if !(inside || near) {
                continue;
            }
            let (bundle, lane) = (i / BUNDLE, i % BUNDLE);
            tile.inside[bundle] |= u16::from(inside) << lane;
            tile.near[bundle] |= u16::from(near) << lane;
            if let Some(rise) = rise {
                tile.rises.get_or_insert_default().set(i, &rise);
            }
        }
        tile
    }

    /// Puts into `moved` the points `asked`, each as far towards `apex` as its way there is certainly clear, where any of them moves; gives those where all
    /// of it is.
    pub(super) fn towards(
        &self,
        path: Path,
        apex: Vec3,
        ends: &Ends,
        asked: &Lanes,
        moved: &mut Option<Ends>,
    ) -> Lanes {
        self.rises.as_ref().map_or([0; BUNDLES], |rises| path.run(Leave { rises, apex, asked, ends, moved }))
    }
}

/// The shares of the ways from `from`, which is `here`, to the points `asked` that are certainly clear, and the points where all of it is.
pub(super) fn shares(path: Path, here: &Beside, from: Vec3, ends: &Ends, asked: &Lanes) -> (Shares, Lanes) {
    let none = ([[0.0; BUNDLE]; BUNDLES], [0; BUNDLES]);
    here.rise.as_ref().map_or(none, |rise| path.run(Depart { rise, from, asked, ends }))
}
