//! Star-shaped objects where they stand in the world, and the meshes that decide for most rays and segments.

use super::beside::Beside;
use super::cage::{self, Cage};
use super::hull::Hull;
use super::outline::MOST_BYTES;
use super::rise::Rise;
use super::shells::Shells;
use super::{Star, normal_and_area};
use crate::error::{Error, Result};
use crate::geometry::bvh::Build;
use crate::geometry::mesh::Mesh;
use crate::geometry::simd::Path;
use crate::math::{DMat3, DVec3};
use std::sync::Arc;

/// A star-shaped object in the world.
#[derive(Clone)]
pub struct Harmonic {
    pub(super) star: Star,
    /// Where its centre stands \[m\].
    pub(super) center: DVec3,
    /// From its coordinates to those of the world, about the centre.
    pub(super) to_world: DMat3,
    pub(super) to_own: DMat3,
    /// No way is longer by more than this factor in its own coordinates.
    pub(super) shrunk: f64,
    /// Nor in the world by more than this.
    stretched: f64,
    /// Squared distance from the centre beyond which points are outside of all meshes \[m2\].
    pub(super) reach2: f64,
    pub(super) shells: Option<Arc<Shelled>>,
}

/// Cells of the meshes along an edge of the cube: what is left between them is soon told by the series, least of all that is blocked.
const INNER: usize = 16;
const OUTER: usize = 32;

/// What a distance from the centre is widened by for its rounding.
const ROUNDING: f64 = 1.0 + 1e-9;

/// What decides for most rays and segments between points outside, without the series.
pub(super) struct Shelled {
    /// The nets whose outline is seen.
    pub(super) cage: Cage,
    pub(super) fine: Pair,
}

/// Two meshes: what crosses the inner one crosses the surface; what does not cross the outer one does not, where one end is outside of that too.
pub(super) struct Pair {
    pub(super) inner: Mesh,
    pub(super) outer: Mesh,
    /// Points at least so many times as far from the centre as the surface in their direction are outside of both.
    pub(super) reach: f64,
}

impl Harmonic {
    /// The object `star` with its centre at `center` \[m\], turned and scaled by `to_world`.
    ///
    /// # Errors
    /// [`Error::Input`] for a transform that flattens it.
    pub fn new(star: Star, center: DVec3, to_world: DMat3) -> Result<Harmonic> {
        let to_own = to_world.inverse();
        if !to_own.is_finite() || to_world.determinant() == 0.0 {
            let allowed = "a transform that flattens nothing";
            return Err(Error::input("harmonic", "transform", format!("{to_world:?}"), allowed));
        }
        // No direction is stretched by more than the root of the sum of squares of a matrix.
        let [shrunk, stretched] = [to_own, to_world].map(|by| {
            let columns = [by.x_axis, by.y_axis, by.z_axis];
            columns.iter().map(|c| c.length_squared()).sum::<f64>().sqrt()
        });
        let mut harmonic =
            Harmonic { star, center, to_world, to_own, shrunk, stretched, reach2: f64::INFINITY, shells: None };
        if let Some(even) = harmonic.even() {
            (harmonic.shrunk, harmonic.stretched) = (1.0 / even, even);
        }
        Ok(harmonic)
    }

    /// Memory of its samples and meshes, and of outlines at most \[bytes\]; what the series takes is in proportion to its file.
    pub(in crate::geometry) fn bytes(&self) -> u64 {
        let of = |pair: &Pair| pair.inner.bytes() + pair.outer.bytes();
        self.star.samples.bytes()
            + self.shells.as_ref().map_or(0, |shells| shells.cage.bytes() + of(&shells.fine) + MOST_BYTES)
            + self.star.hull.as_ref().map_or(0, |hull| hull.bytes())
    }

    /// The object in its own coordinates.
    pub fn star(&self) -> &Star {
        &self.star
    }

    /// Corners of a box around it \[m\].
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let rows = self.to_world.transpose();
        let half = self.star.bounds.high * DVec3::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length());
        (self.center - half, self.center + half)
    }

    /// How much longer it is here than in its own coordinates, where that is the same in all directions.
    fn even(&self) -> Option<f64> {
        let columns = [self.to_world.x_axis, self.to_world.y_axis, self.to_world.z_axis];
        let even = columns.iter().map(|c| c.length()).fold(0.0, f64::max);
        let product = self.to_world.transpose() * self.to_world;
        let off = product - DMat3::from_diagonal(DVec3::splat(even * even));
        off.to_cols_array().iter().all(|x| x.abs() <= 1e-12 * even * even).then_some(even)
    }

    /// True of a ball.
    pub fn is_round(&self) -> bool {
        self.star.bounds.first == 0.0 && self.even().is_some()
    }

    /// Its centre, the radius of a ball about that around it \[m\], and how much longer it is here than in its own coordinates, at most.
    pub fn around(&self) -> (DVec3, f64, f64) {
        (self.center, self.world_radii().1, self.stretched)
    }

    /// No point of the surface is nearer to the centre than the first, none farther than the second \[m\].
    pub(super) fn world_radii(&self) -> (f64, f64) {
        (self.star.bounds.low / self.shrunk, self.stretched * self.star.bounds.high)
    }

    /// The same object elsewhere.
    pub fn moved(mut self, by: DVec3) -> Self {
        self.center += by;
        self
    }

    /// True for points inside \[m\].
    pub fn contains(&self, p: DVec3) -> bool {
        self.star.contains(self.to_own * (p - self.center))
    }

    /// Where `p` is \[m\].
    pub(in crate::geometry) fn beside(&self, p: DVec3) -> Beside {
        // Of most points no more need be known.
        if (p - self.center).length_squared() > self.reach2 {
            return Beside::FAR;
        }
        let own = self.to_own * (p - self.center);
        let length = own.length();
        let (low, high) = self.star.radii();
        let fine = self.shells.as_ref().map_or(f64::INFINITY, |shells| shells.fine.reach);
        if length < low || length >= high * fine {
            return Beside { inside: length < low, near: length < low, rise: None };
        }
        let n = own / length;
        let look = self.star.samples.look(n);
        let error = look.errors.value;
        let near = length <= (look.value + error) * fine;
        let certain = (length - look.value).abs() > error;
        let inside = if certain { length < look.value } else { length < self.star.series.value(n) };
        let frames = (&self.to_own, &self.to_world);
        let rise = |hull: &Arc<Hull>| Rise::new(own, &look, (self.star.samples.reach(), hull), frames, self.shrunk);
        Beside { inside, near, rise: self.star.hull.as_ref().filter(|_| near && !inside).map(rise) }
    }

    /// The same object with meshes inside and outside of it, for rays that come from anywhere in the box `around` \[m\].
    pub(in crate::geometry) fn shelled(mut self, around: (DVec3, DVec3)) -> Self {
        // Rounding to f32 moves a corner, and what a segment starts from, by few units of the largest coordinate; where the surface is
        // steep, that counts several times along the radius.
        let coordinate = around.0.abs().max(around.1.abs()).max_element();
        let (low, steep) = (self.star.bounds.low, self.star.bounds.first);
        let steepness = (1.0 + steep * steep / (low * low)).sqrt();
        let margin = 64.0 / f64::from(1 << 24) * coordinate * self.shrunk / low * steepness;
        let mesh = |triangles: &[[DVec3; 3]]| {
            let place = |p: DVec3| (self.center + self.to_world * p).as_vec3();
            let mirrored = self.to_world.determinant() < 0.0;
            let turned = |[a, b, c]: [DVec3; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
            let triangles: Vec<_> = triangles.iter().map(|&t| turned(t).map(place)).collect();
            Mesh::within(&triangles, Build::Thorough, around)
        };
        let shells = |cells: usize| Shells::new(&self.star, cells, margin);
        let [coarse, inside, outside] = [cage::CELLS, INNER, OUTER].map(shells);
        let cage = Cage::new(&coarse, &self.to_world);
        let (inner, outer) = rayon::join(|| mesh(&inside.inner), || mesh(&outside.outer));
        self.star.hull = Some(Arc::new(Hull::new(&outside.outer)));
        let fine = Pair { inner, outer, reach: outside.reach };
        let reach = self.around().1 * fine.reach * ROUNDING;
        self.reach2 = reach * reach;
        self.shells = Some(Arc::new(Shelled { cage, fine }));
        self
    }

    /// Asks its meshes on `path`, where nobody else has them: for tests.
    pub(in crate::geometry) fn set_path(&mut self, path: Path) {
        if let Some(shells) = self.shells.as_mut().and_then(Arc::get_mut) {
            (shells.fine.inner.path, shells.fine.outer.path) = (path, path);
        }
    }

    /// The point of the surface in the direction `n0` of its own coordinates \[m\], its outward normal, and the area for each unit of solid angle
    /// there \[m2/sr\].
    pub fn point(&self, n0: DVec3) -> (DVec3, DVec3, f64) {
        let slope = self.star.series.slope(n0);
        let (normal, area) = normal_and_area(&slope, n0);
        let turned = self.to_own.transpose() * normal;
        let stretch = turned.length();
        let position = self.center + self.to_world * (slope.value * n0);
        (position, turned / stretch, area * self.to_world.determinant().abs() * stretch)
    }

    /// The direction, in its own coordinates, of `position` \[m\].
    pub fn direction_of(&self, position: DVec3) -> DVec3 {
        (self.to_own * (position - self.center)).normalize()
    }

    /// No point has more area for each unit of solid angle of its own coordinates \[m2/sr\].
    pub fn greatest_area_element(&self) -> f64 {
        let (high, steep) = (self.star.bounds.high, self.star.bounds.first);
        high * (high * high + steep * steep).sqrt() * self.to_world.determinant().abs() * self.shrunk
    }

    /// Area of the surface \[m2\].
    pub fn area(&self) -> f64 {
        self.star.over_the_sphere(|_, n0| self.point(n0).2)
    }

    /// True unless no point of it above the tangent plane of `position` with the unit vector `normal` can have a geometric factor
    /// above `bound` \[1/m2\]: what is too far, or all below, has none.
    pub(in crate::geometry) fn may_exceed(&self, position: DVec3, normal: DVec3, bound: f64) -> bool {
        let (low, high) = self.bounds();
        let nearest = position.clamp(low, high);
        let highest = DVec3::select(normal.cmpgt(DVec3::ZERO), high, low);
        (nearest - position).length_squared() * bound < 1.0 && (highest - position).dot(normal) > 0.0
    }
}

impl std::fmt::Debug for Harmonic {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(
            f,
            "Harmonic {{ degree {}, center {}, to_world {} }}",
            self.star.series.degree(),
            self.center,
            self.to_world
        )
    }
}
