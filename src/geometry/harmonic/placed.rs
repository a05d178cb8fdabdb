//! Star-shaped objects where they stand in the world, and the meshes that decide for most rays and segments.

use super::shells::Shells;
use super::{Star, normal_and_area};
use crate::error::{Error, Result};
use crate::geometry::bvh::Build;
use crate::geometry::mesh::{Mesh, bits};
use crate::geometry::simd::Path;
use crate::geometry::visibility::{BUNDLES, Lanes, Points, Scratch};
use crate::geometry::{Hit, Ray, hit};
use crate::math::{DMat3, DVec3, Vec3};
use std::sync::Arc;

/// How far beyond a triangle the next is looked for, as a share of the segment.
const NEXT: f64 = 1e-9;

/// A star-shaped object in the world.
#[derive(Clone)]
pub struct Harmonic {
    star: Star,
    /// Where its centre stands \[m\].
    center: DVec3,
    /// From its coordinates to those of the world, about the centre.
    to_world: DMat3,
    to_own: DMat3,
    shells: Option<Arc<Shelled>>,
}

/// Meshes that decide for most rays and segments between points outside: what crosses the inner one crosses the surface; what does
/// not cross the outer one does not, where one end is outside of that too.
struct Shelled {
    inner: Mesh,
    outer: Mesh,
    /// Points at least so many times as far from the centre as the surface in their direction are outside of both.
    reach: f64,
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
        Ok(Harmonic { star, center, to_world, to_own, shells: None })
    }

    /// The object in its own coordinates.
    pub fn star(&self) -> &Star {
        &self.star
    }

    /// Corners of a box around it \[m\].
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let rows = self.to_world.transpose();
        let half = self.star.radii.1 * DVec3::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length());
        (self.center - half, self.center + half)
    }

    /// Its centre, the radius of a ball about that around it \[m\], and how much longer it is here than in its own coordinates, at most.
    pub fn around(&self) -> (DVec3, f64, f64) {
        // No direction is stretched by more than the root of the sum of squares of a matrix.
        let columns = [self.to_world.x_axis, self.to_world.y_axis, self.to_world.z_axis];
        let whole = columns.iter().map(|c| c.length_squared()).sum::<f64>().sqrt();
        // A turned and evenly scaled object, as most are, is stretched by the length of any column.
        let even = columns.iter().map(|c| c.length()).fold(0.0, f64::max);
        let product = self.to_world.transpose() * self.to_world;
        let off = product - DMat3::from_diagonal(DVec3::splat(even * even));
        let is_even = off.to_cols_array().iter().all(|x| x.abs() <= 1e-12 * even * even);
        let stretch = if is_even { even } else { whole };
        (self.center, stretch * self.star.radii.1, stretch)
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

    /// True for points that may lie inside the outer mesh \[m\].
    pub(in crate::geometry) fn is_near(&self, p: DVec3) -> bool {
        let own = self.to_own * (p - self.center);
        let reach = self.shells.as_ref().map_or(f64::INFINITY, |shells| shells.reach);
        let length = own.length();
        length < self.star.radii.0
            || (length < self.star.radii.1 * reach && length < self.star.series.value(own / length) * reach)
    }

    /// The same object with meshes inside and outside of it, for rays that come from anywhere in the box `around` \[m\].
    pub(in crate::geometry) fn shelled(mut self, around: (DVec3, DVec3)) -> Self {
        // Rounding to f32 moves a corner by half a unit of the largest coordinate; where a triangle is steep, that counts several times.
        let coordinate = around.0.abs().max(around.1.abs()).max_element();
        let columns = [self.to_own.x_axis, self.to_own.y_axis, self.to_own.z_axis];
        let shrunk = columns.iter().map(|c| c.length_squared()).sum::<f64>().sqrt();
        let margin = 64.0 / f64::from(1 << 24) * coordinate * shrunk / self.star.radii.0;
        let shells = Shells::new(&self.star, margin);
        let mesh = |triangles: &[[DVec3; 3]]| {
            let place = |p: DVec3| (self.center + self.to_world * p).as_vec3();
            let mirrored = self.to_world.determinant() < 0.0;
            let turned = |[a, b, c]: [DVec3; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
            let triangles: Vec<_> = triangles.iter().map(|&t| turned(t).map(place)).collect();
            Mesh::within(&triangles, Build::Thorough, around)
        };
        self.shells =
            Some(Arc::new(Shelled { inner: mesh(&shells.inner), outer: mesh(&shells.outer), reach: shells.reach }));
        self
    }

    /// Asks its meshes on `path`, where nobody else has them: for tests.
    pub(in crate::geometry) fn set_path(&mut self, path: Path) {
        if let Some(shells) = self.shells.as_mut().and_then(Arc::get_mut) {
            (shells.inner.path, shells.outer.path) = (path, path);
        }
    }

    /// Clears the bits of the points in `seen` that `apex` does not see for this object, of which the points `inside` it, and those
    /// near it, are known.
    pub(in crate::geometry) fn hide(
        &self,
        apex: Vec3,
        points: &Points,
        [inside, near]: [&Lanes; 2],
        seen: &mut Lanes,
        scratch: &mut Scratch,
    ) {
        let mut undecided = *seen;
        let at = apex.as_dvec3();
        if let Some(shells) = self.shells.as_ref().filter(|_| !self.contains(at)) {
            let is_near = self.is_near(at);
            let (mut open, mut clear) = (*seen, *seen);
            shells.inner.hide(apex, points, &mut open, scratch);
            shells.outer.hide(apex, points, &mut clear, scratch);
            for bundle in 0..BUNDLES {
                // Inside the outer mesh both ends may see each other through the surface without crossing it.
                let within = if is_near { near[bundle] } else { 0 };
                let (asked, inside) = (seen[bundle], inside[bundle]);
                seen[bundle] &= open[bundle] | inside;
                undecided[bundle] = asked & (inside | open[bundle] & (!clear[bundle] | within));
            }
        }
        for (bundle, seen) in seen.iter_mut().enumerate() {
            for lane in bits(u32::from(undecided[bundle])) {
                let blocked = self.crosses(apex.as_dvec3(), points.point(bundle, lane).as_dvec3());
                *seen &= !(u16::from(blocked) << lane);
            }
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

    /// The first point of the surface along `ray`, at most `limit` away \[m\].
    pub(in crate::geometry) fn hit(&self, ray: &Ray, limit: f64) -> Option<Hit> {
        let skipped = self.way_to(ray)?;
        let direction = self.to_own * ray.direction;
        let scale = direction.length();
        let origin = self.to_own * (ray.origin + skipped * ray.direction - self.center);
        let crossing = self.star.first_crossing(origin, direction / scale, (limit - skipped) * scale)?;
        let normal = (self.to_own.transpose() * crossing.normal).normalize();
        let position = self.center + self.to_world * crossing.position;
        Some(hit(ray, skipped + crossing.distance / scale, position, normal))
    }

    /// How far along `ray` its surface is first met, by the series alone \[m\]: the twin that tests the meshes.
    pub fn first_crossing(&self, ray: &Ray) -> Option<f64> {
        let own = self.to_own * ray.direction;
        let scale = own.length();
        let origin = self.to_own * (ray.origin - self.center);
        self.star.first_crossing(origin, own / scale, f64::INFINITY).map(|crossing| crossing.distance / scale)
    }

    /// How far along `ray` there is certainly nothing; `None` where it misses the object \[m\].
    fn way_to(&self, ray: &Ray) -> Option<f64> {
        let Some(shells) = &self.shells else { return Some(0.0) };
        let outer = shells.outer.closest_hit(ray, f64::INFINITY)?;
        // From behind it starts between the shells, or inside.
        Some(if outer.front { (outer.distance * (1.0 - 1e-9)).max(0.0) } else { 0.0 })
    }

    /// True when the segment between `a` and `b` crosses the surface \[m\].
    pub(in crate::geometry) fn blocks(&self, a: Vec3, b: Vec3) -> bool {
        let (from, to) = (a.as_dvec3(), b.as_dvec3());
        if let Some(shells) = self.shells.as_ref().filter(|_| !self.contains(from) && !self.contains(to)) {
            let within = self.is_near(from) && self.is_near(to);
            if !within && !shells.outer.blocks(a, b) {
                return false;
            }
            if shells.inner.blocks(a, b) {
                return true;
            }
        }
        self.crosses(from, to)
    }

    /// The same by the series, wherever the segment is inside the outer mesh.
    fn crosses(&self, a: DVec3, b: DVec3) -> bool {
        let whole = (b - a).length();
        if whole == 0.0 {
            return false;
        }
        let direction = (b - a) / whole;
        let Some(shells) = &self.shells else { return self.crosses_between(a, direction, whole) };
        let mut at = 0.0;
        while at < whole {
            let origin = a + at * direction;
            let outer = shells.outer.closest_hit(&Ray { origin, direction }, whole - at);
            let (enters, distance) = outer.map_or((false, whole - at), |hit| (hit.front, hit.distance));
            // What is before an entrance is outside; what is before an exit, or the end, may not be.
            if !enters && self.crosses_between(origin, direction, distance) {
                return true;
            }
            // A little too far, so as to find no triangle twice: there is room between the mesh and the surface.
            at += distance + NEXT * whole;
        }
        false
    }

    /// True when there is a point of the surface at most `end` from `from` along the unit vector `direction` \[m\].
    fn crosses_between(&self, from: DVec3, direction: DVec3, end: f64) -> bool {
        let own = self.to_own * direction;
        let scale = own.length();
        let origin = self.to_own * (from - self.center);
        self.star.first_crossing(origin, own / scale, end * scale).is_some()
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
