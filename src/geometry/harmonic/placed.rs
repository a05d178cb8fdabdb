//! Star-shaped objects where they stand in the world, and the meshes that decide for most rays and segments.

use super::beside::{Beside, End, TileBeside};
use super::horizon::{Cone, Horizon};
use super::shells::Shells;
use super::{Bend, Crossing, Star, normal_and_area};
use crate::error::{Error, Result};
use crate::geometry::bvh::Build;
use crate::geometry::mesh::{Mesh, bits};
use crate::geometry::simd::Path;
use crate::geometry::visibility::{BUNDLES, Lanes, Points, Scratch};
use crate::geometry::{Hit, Ray, hit};
use crate::math::{DMat3, DVec3, Vec3};
use std::ops::Range;
use std::sync::Arc;

/// How far beyond a triangle the next is looked for, as a share of the way there and the size of the object.
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
    /// Where the object keeps its shape in the world.
    horizon: Option<Horizon>,
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

    /// Memory of its samples, meshes and horizon \[bytes\]; what the series takes is in proportion to its file.
    pub(in crate::geometry) fn bytes(&self) -> u64 {
        let of = |shells: &Arc<Shelled>| {
            shells.inner.bytes() + shells.outer.bytes() + shells.horizon.as_ref().map_or(0, Horizon::bytes)
        };
        self.star.samples.bytes() + self.shells.as_ref().map_or(0, of)
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
        // No direction is stretched by more than the root of the sum of squares of a matrix.
        let columns = [self.to_world.x_axis, self.to_world.y_axis, self.to_world.z_axis];
        let whole = columns.iter().map(|c| c.length_squared()).sum::<f64>().sqrt();
        let stretch = self.even().unwrap_or(whole);
        (self.center, stretch * self.star.bounds.high, stretch)
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

    /// True for points, in its own coordinates, that may be inside the outer mesh.
    fn is_near(&self, own: DVec3) -> bool {
        let length = own.length();
        let (low, high) = self.star.radii();
        let reach = self.shells.as_ref().map_or(f64::INFINITY, |shells| shells.reach);
        if length < low || length >= high * reach {
            return length < low;
        }
        let (value, error) = self.star.samples.value(own / length);
        length <= (value + error) * reach
    }

    /// Where `p` is \[m\], with its cone where that is asked for.
    pub(in crate::geometry) fn beside(&self, p: DVec3, with_cone: bool) -> Beside {
        let own = self.to_own * (p - self.center);
        let (length, near) = (own.length(), self.is_near(own));
        if !near || length < self.star.bounds.low {
            return Beside { inside: near, near, free: None, bend: None };
        }
        let reach = self.shells.as_ref().map_or(f64::INFINITY, |shells| shells.reach);
        let n = own / length;
        let bend = self.star.series.bend(n);
        let (inside, near) = (length < bend.value, length < bend.value * reach);
        let horizon = self.shells.as_ref().and_then(|shells| shells.horizon.as_ref());
        let is_beside = near && !inside;
        let free = horizon.filter(|_| is_beside && with_cone).map(|horizon| {
            let cone = horizon.cone(&self.star, own, &bend);
            Cone { axis: (self.to_world * cone.axis).normalize(), ..cone }
        });
        Beside { inside, near, free, bend: is_beside.then_some(bend) }
    }

    /// The same object with meshes inside and outside of it, for rays that come from anywhere in the box `around` \[m\].
    pub(in crate::geometry) fn shelled(mut self, around: (DVec3, DVec3)) -> Self {
        // Rounding to f32 moves a corner by half a unit of the largest coordinate; where a triangle is steep, that counts several times.
        let coordinate = around.0.abs().max(around.1.abs()).max_element();
        let columns = [self.to_own.x_axis, self.to_own.y_axis, self.to_own.z_axis];
        let shrunk = columns.iter().map(|c| c.length_squared()).sum::<f64>().sqrt();
        let margin = 64.0 / f64::from(1 << 24) * coordinate * shrunk / self.star.bounds.low;
        let shells = Shells::new(&self.star, margin);
        let mesh = |triangles: &[[DVec3; 3]]| {
            let place = |p: DVec3| (self.center + self.to_world * p).as_vec3();
            let mirrored = self.to_world.determinant() < 0.0;
            let turned = |[a, b, c]: [DVec3; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
            let triangles: Vec<_> = triangles.iter().map(|&t| turned(t).map(place)).collect();
            Mesh::within(&triangles, Build::Thorough, around)
        };
        let horizon = self.even().map(|_| Horizon::new(&self.star));
        let (inner, outer) = (mesh(&shells.inner), mesh(&shells.outer));
        self.shells = Some(Arc::new(Shelled { inner, outer, reach: shells.reach, horizon }));
        self
    }

    /// Asks its meshes on `path`, where nobody else has them: for tests.
    pub(in crate::geometry) fn set_path(&mut self, path: Path) {
        if let Some(shells) = self.shells.as_mut().and_then(Arc::get_mut) {
            (shells.inner.path, shells.outer.path) = (path, path);
        }
    }

    /// Clears the bits of the points in `seen` that `apex` does not see for this object, `beside` which they are.
    pub(in crate::geometry) fn hide(
        &self,
        apex: Vec3,
        points: &Points,
        beside: &TileBeside,
        seen: &mut Lanes,
        scratch: &mut Scratch,
    ) {
        let here = self.beside(apex.as_dvec3(), true);
        let mut undecided = *seen;
        for bundle in 0..BUNDLES {
            let (inside, free) = (beside.inside[bundle], beside.free(bundle, points, apex, &here, undecided[bundle]));
            seen[bundle] &= if here.inside { inside } else { !inside };
            undecided[bundle] = seen[bundle] & !free;
        }
        if undecided == [0; BUNDLES] {
            return;
        }
        if let Some(shells) = self.shells.as_ref().filter(|_| !here.inside) {
            let mut clear = undecided;
            shells.outer.hide(apex, points, &mut clear, scratch);
            for bundle in 0..BUNDLES {
                // Inside the outer mesh both ends may see each other through the surface without crossing it.
                let within = if here.near { beside.near[bundle] } else { 0 };
                undecided[bundle] &= !clear[bundle] | within;
            }
            if undecided == [0; BUNDLES] {
                return;
            }
            let mut open = undecided;
            shells.inner.hide(apex, points, &mut open, scratch);
            for bundle in 0..BUNDLES {
                seen[bundle] &= !undecided[bundle] | open[bundle];
                undecided[bundle] &= open[bundle];
            }
        }
        for (bundle, seen) in seen.iter_mut().enumerate() {
            for lane in bits(u32::from(undecided[bundle])) {
                let (a, b) = (apex.as_dvec3(), points.point(bundle, lane).as_dvec3());
                let blocked = self.crosses([a, b], [here.end(), beside.end(bundle, lane)]);
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

    /// The direction, in its own coordinates, of `position` \[m\].
    pub fn direction_of(&self, position: DVec3) -> DVec3 {
        (self.to_own * (position - self.center)).normalize()
    }

    /// No point has more area for each unit of solid angle of its own coordinates \[m2/sr\].
    pub fn greatest_area_element(&self) -> f64 {
        let (high, steep) = (self.star.bounds.high, self.star.bounds.first);
        // A turned normal is stretched by no more than the root of the sum of squares of its matrix.
        let columns = [self.to_own.x_axis, self.to_own.y_axis, self.to_own.z_axis];
        let stretch = columns.iter().map(|c| c.length_squared()).sum::<f64>().sqrt();
        let stretch = self.even().map_or(stretch, |even| 1.0 / even);
        high * (high * high + steep * steep).sqrt() * self.to_world.determinant().abs() * stretch
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
        let near = self.is_near(self.to_own * (ray.origin - self.center));
        let Line { crossing, before, scale } = self.first_within(ray, 0.0..limit, near, limit < f64::INFINITY)?;
        let normal = (self.to_own.transpose() * crossing.normal).normalize();
        let position = self.center + self.to_world * crossing.position;
        Some(hit(ray, before + crossing.distance / scale, position, normal))
    }

    /// How far along `ray` its surface is first met, by the series alone \[m\]: the twin that tests the meshes.
    pub fn first_crossing(&self, ray: &Ray) -> Option<f64> {
        let own = self.to_own * ray.direction;
        let scale = own.length();
        let origin = self.to_own * (ray.origin - self.center);
        self.star.first_crossing(origin, own / scale, f64::INFINITY).map(|crossing| crossing.distance / scale)
    }

    /// True when the segment between `a` and `b` crosses the surface \[m\].
    pub(in crate::geometry) fn blocks(&self, a: Vec3, b: Vec3) -> bool {
        let (from, to) = (a.as_dvec3(), b.as_dvec3());
        let sides = [self.beside(from, false), self.beside(to, false)];
        if sides[0].inside != sides[1].inside {
            return true;
        }
        if let Some(shells) = self.shells.as_ref().filter(|_| !sides[0].inside) {
            let both_near = sides[0].near && sides[1].near;
            if !both_near && !shells.outer.blocks(a, b) {
                return false;
            }
            if shells.inner.blocks(a, b) {
                return true;
            }
        }
        self.crosses([from, to], sides.each_ref().map(Beside::end))
    }

    /// The same of two points on one side, by the series, wherever the segment is inside the outer mesh. Where the derivatives at an end
    /// are known, they say how far from there it is clear.
    fn crosses(&self, [a, b]: [DVec3; 2], ends: [End; 2]) -> bool {
        let whole = (b - a).length();
        if whole == 0.0 {
            return false;
        }
        let direction = (b - a) / whole;
        let own = self.to_own * direction;
        let scale = own.length();
        let clear = |at: DVec3, way: DVec3, bend: Option<&Bend>| {
            let far =
                |bend| self.star.clear(self.to_own * (at - self.center), way / scale, whole * scale, bend) / scale;
            bend.map_or(0.0, far)
        };
        let between = clear(a, own, ends[0].bend)..whole - clear(b, -own, ends[1].bend);
        self.first_within(&Ray { origin: a, direction }, between, ends[0].near, ends[1].near).is_some()
    }

    /// The first crossing of a part of `ray`, by the series wherever that is inside the outer mesh. Its ends may be in there or are certainly
    /// not.
    fn first_within(&self, ray: &Ray, part: Range<f64>, starts_near: bool, ends_near: bool) -> Option<Line> {
        let own = self.to_own * ray.direction;
        let scale = own.length();
        let look = |from: f64, way: f64| {
            let origin = self.to_own * (ray.origin + from * ray.direction - self.center);
            let crossing = self.star.first_crossing(origin, own / scale, way * scale)?;
            Some(Line { crossing, before: from, scale })
        };
        let Range { start: mut at, end } = part;
        let Some(shells) = &self.shells else { return look(at, end - at) };
        let mut outside = !starts_near;
        while at < end {
            let here = Ray { origin: ray.origin + at * ray.direction, direction: ray.direction };
            let Some(outer) = shells.outer.closest_hit(&here, end - at) else {
                // No way in from outside, and none out to an end that is there.
                return if outside || !ends_near { None } else { look(at, end - at) };
            };
            // What is before an entrance is outside.
            let found = if outer.front { None } else { look(at, outer.distance) };
            if found.is_some() {
                return found;
            }
            outside = !outer.front;
            // A little too far, so as to find no triangle twice: there is room between the mesh and the surface.
            at += outer.distance + NEXT * (at + outer.distance + self.star.bounds.high / scale);
        }
        None
    }
}

/// A crossing in its own coordinates, looked for from `before` on \[m\], with lengths `scale` times those of the world.
struct Line {
    crossing: Crossing,
    before: f64,
    scale: f64,
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
