//! Where points are beside a star-shaped object: one by one, and in tiles.

use super::Harmonic;
use super::rise::{Depart, Leave, Rise, Rises};
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
    /// Certainly outside of the coarser outer mesh too.
    pub(super) far: bool,
    /// How the distance to the surface grows there, of points near but not inside.
    pub(super) rise: Option<Rise>,
}

impl Beside {
    /// The share of the way `d` from there that is certainly clear.
    pub(super) fn clear(&self, d: Vec3) -> f32 {
        self.rise.map_or(0.0, |rise| rise.clear(d))
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
            let (bundle, lane) = (i / BUNDLE, i % BUNDLE);
            let Beside { inside, near, rise, .. } = object.beside(point.as_dvec3());
            tile.inside[bundle] |= u16::from(inside) << lane;
            tile.near[bundle] |= u16::from(near) << lane;
            if let Some(rise) = rise {
                tile.rises.get_or_insert_default().set(i, &rise);
            }
        }
        tile
    }

    /// The points `asked`, each as far towards `apex` as its way there is certainly clear; `None` where none of them moves.
    pub(super) fn towards(&self, path: Path, apex: Vec3, points: &Ends, asked: &Lanes) -> Option<Ends> {
        let rises = self.rises.as_ref()?;
        if asked.iter().zip(&self.near).all(|(asked, near)| asked & near == 0) {
            return None;
        }
        let mut ends = points.clone();
        path.run(Leave { rises, apex, asked, ends: &mut ends });
        Some(ends)
    }
}

/// The shares of the ways from `from`, which is `here`, to the points `asked` that are certainly clear.
pub(super) fn shares(
    path: Path,
    here: &Beside,
    from: Vec3,
    points: &Ends,
    asked: &Lanes,
) -> Option<[[f32; BUNDLE]; BUNDLES]> {
    here.rise.as_ref().map(|rise| path.run(Depart { rise, from, asked, ends: points }))
}
