//! Star-shaped objects: |x| = r(x/|x|) around their centre, r a series of spherical harmonics.
//!
//! The surface is exact, and so is its normal n, proportional to r n0 - grad r in the direction n0: nothing is ever made of
//! triangles but what only rules out or in, beforehand, what needs no look at the series.
//!
//! ```text
//! F(t) = |o + t d| - r((o + t d)/|o + t d|):  positive outside, negative inside, 0 on the surface
//! F'   = c - (grad r, d)/|x|,                                  c = (x,d)/|x|
//! F''  = (1 - c^2)/|x| - (w'Hw - 2 c (g,w) - (1 - c^2)(g,n))/|x|^2,  w = d - c n,  n = x/|x|
//! |F''|  <= (M2 + M1)/R^2 + 1/R,                                          where |x| >= R
//! |F'''| <= (M3 + 2.31 M2 + 2 M1)/R^3 + 1.16/R^2
//! ```
//!
//! with M1, M2, M3 the bounds of the derivatives of r along great circles: along a line the angle a has a' = s/|x|,
//! a'' = -2 s c/|x|^2, a''' = -2 (s^3 - 3 s c^2)/|x|^3, s^2 = 1 - c^2, and s^2 c <= 0.385. So where the parabola or the cubic that starts with
//! these derivatives and falls below F by its bound stays positive there is no surface: steps to its zero pass none, and near a
//! crossing they converge on it faster than Newton's. From inside -F is taken.

pub mod file;
mod series;
mod shells;
mod steps;

pub use series::{Bend, Bounds, MAX_DEGREE, Series, Slope, basis, projection};

use super::bvh::Build;
use super::mesh::{Mesh, bits};
use super::simd::Path;
use super::visibility::{BUNDLES, Lanes, Points, Scratch};
use super::{Hit, Ray, hit};
use crate::error::{Error, Result};
use crate::math::{DMat3, DVec3, PI, Vec3};
use shells::{Shells, radii};
use std::sync::Arc;
use steps::{Taylor, safe_step};

/// What the sum of a series and its comparison with |x| round, in units of its largest radius.
const ROUNDING: f64 = 1e-14;
/// Steps after which a line that only grazes the surface counts as meeting it.
const MAX_STEPS: usize = 4096;

/// A series as a surface, in its own coordinates.
#[derive(Clone, Debug)]
pub struct Star {
    series: Series,
    bounds: Bounds,
    /// No radius is less, none more.
    radii: (f64, f64),
}

/// Where a line crosses a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// How far along the line, in units of its direction.
    pub distance: f64,
    /// The point, on the surface.
    pub position: DVec3,
    /// Outward unit normal.
    pub normal: DVec3,
}

/// F and its derivatives along a line, and where.
struct Height {
    along: Taylor,
    slope: Slope,
    direction: DVec3,
}

impl Star {
    /// The surface of `series`.
    ///
    /// # Errors
    /// [`Error::Input`] unless every radius is certainly positive.
    pub fn new(series: Series) -> Result<Star> {
        let bounds = series.bounds();
        let radii = radii(&series, &bounds);
        if radii.0 <= 0.0 {
            let allowed = "a radius above 0 in every direction, by the bounds of its derivatives too";
            return Err(Error::input("series", "least radius", radii.0, allowed));
        }
        Ok(Star { series, bounds, radii })
    }

    /// The series.
    pub fn series(&self) -> &Series {
        &self.series
    }

    /// No radius is less than the first, none more than the second.
    pub fn radii(&self) -> (f64, f64) {
        self.radii
    }

    /// True for points inside.
    pub fn contains(&self, p: DVec3) -> bool {
        let length = p.length();
        length < self.radii.0 || (length < self.radii.1 && length < self.series.value(p / length))
    }

    /// Outward unit normal in the direction of the unit vector `n0`, and the area of the surface for each unit of solid angle there.
    pub fn normal_and_area(&self, n0: DVec3) -> (DVec3, f64) {
        normal_and_area(&self.series.slope(n0), n0)
    }

    /// The first crossing of the line from `o` along the unit vector `d`, at most `end` away.
    pub fn first_crossing(&self, o: DVec3, d: DVec3, end: f64) -> Option<Crossing> {
        let nearest = -o.dot(d);
        let across2 = (o + nearest * d).length_squared();
        let (low, high) = self.radii;
        let reach2 = high * high - across2;
        if reach2 < 0.0 {
            return None;
        }
        let mut at = (nearest - reach2.sqrt()).max(0.0);
        let end = end.min(nearest + reach2.sqrt());
        // The line inside the ball that lies within the surface; empty where it misses that.
        let half_core = (low * low - across2).max(0.0).sqrt();
        let core = nearest - half_core..nearest + half_core;
        let floor = ROUNDING * high;
        let least = low.max(across2.sqrt());
        let bounds = self.derivatives(least);
        // Entering the ball around the surface is being outside; else the first look tells.
        let (mut side, mut height) = (if at > 0.0 { 1.0 } else { 0.0 }, None);
        for _ in 0..MAX_STEPS {
            if at > end {
                return None;
            }
            if side <= 0.0 && at > core.start && at < core.end {
                (side, at) = (-1.0, core.end);
                continue;
            }
            let here = self.height(o + at * d, d);
            if side == 0.0 {
                side = if here.along.value < 0.0 { -1.0 } else { 1.0 };
                if here.along.value.abs() <= floor && here.along.first * side < 0.0 {
                    // Starting on the surface and going through it.
                    side = -side;
                }
            }
            let along = here.along.times(side);
            height = Some((at, here));
            if along.value <= floor && (along.first <= 0.0 || along.value < -floor) {
                break;
            }
            let step = safe_step(&along, bounds);
            // From inside the bound holds outside the core only, beyond which all is known.
            let next = at + step;
            let next = if side < 0.0 && at < core.start { next.min(core.end) } else { next };
            if next <= at {
                break;
            }
            at = next;
        }
        let (at, height) = height.filter(|(at, _)| *at <= end)?;
        let (normal, _) = normal_and_area(&height.slope, height.direction);
        Some(Crossing { distance: at, position: height.slope.value * height.direction, normal })
    }

    /// Bounds of the second and third derivatives of F where |x| is at least `least`.
    fn derivatives(&self, least: f64) -> [f64; 2] {
        let Bounds { first, second, third, .. } = self.bounds;
        let square = least * least;
        let of_second = (second + first) / square + 1.0 / least;
        [of_second, (third + 2.31 * second + 2.0 * first) / (square * least) + 1.16 / square]
    }

    fn height(&self, x: DVec3, d: DVec3) -> Height {
        let length = x.length();
        let direction = x / length;
        let bend = self.series.bend(direction);
        let slope = bend.slope(direction);
        let c = direction.dot(d);
        let w = d - c * direction;
        let across = 1.0 - c * c;
        let turned = w.dot(bend.hessian * w) - 2.0 * c * bend.g.dot(w) - across * bend.g.dot(direction);
        let along = Taylor {
            value: length - slope.value,
            first: c - slope.gradient.dot(d) / length,
            second: (across - turned / length) / length,
        };
        Height { along, slope, direction }
    }

    /// Volume, by a rule that is exact for r^3.
    pub fn volume(&self) -> f64 {
        self.over_the_sphere(|_, n0| {
            let r = self.series.value(n0);
            r * r * r / 3.0
        })
    }

    /// Area of the surface, to the accuracy of a rule for four times the degree.
    pub fn area(&self) -> f64 {
        self.over_the_sphere(|series, n0| normal_and_area(&series.slope(n0), n0).1)
    }

    /// int f dw.
    fn over_the_sphere(&self, f: impl Fn(&Series, DVec3) -> f64) -> f64 {
        let values = |directions: &[DVec3]| Ok(directions.iter().map(|&n0| f(&self.series, n0)).collect::<Vec<f64>>());
        let mean = projection(0, 2 * self.series.degree() + 16, values);
        4.0 * PI * mean.map_or(f64::NAN, |mean| mean.value(DVec3::Z))
    }
}

fn normal_and_area(slope: &Slope, n0: DVec3) -> (DVec3, f64) {
    let across = slope.value * n0 - slope.gradient;
    (across.normalize(), slope.value * across.length())
}

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
    pub(super) fn is_near(&self, p: DVec3) -> bool {
        let own = self.to_own * (p - self.center);
        let reach = self.shells.as_ref().map_or(f64::INFINITY, |shells| shells.reach);
        let length = own.length();
        length < self.star.radii.0
            || (length < self.star.radii.1 * reach && length < self.star.series.value(own / length) * reach)
    }

    /// The same object with meshes inside and outside of it, for rays that come from anywhere in the box `around` \[m\].
    pub(super) fn shelled(mut self, around: (DVec3, DVec3)) -> Self {
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
    pub(super) fn set_path(&mut self, path: Path) {
        if let Some(shells) = self.shells.as_mut().and_then(Arc::get_mut) {
            (shells.inner.path, shells.outer.path) = (path, path);
        }
    }

    /// Clears the bits of the points in `seen` that `apex` does not see for this object, of which the points `inside` it, and those
    /// near it, are known.
    pub(super) fn hide(
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
    pub(super) fn may_exceed(&self, position: DVec3, normal: DVec3, bound: f64) -> bool {
        let (low, high) = self.bounds();
        let nearest = position.clamp(low, high);
        let highest = DVec3::select(normal.cmpgt(DVec3::ZERO), high, low);
        (nearest - position).length_squared() * bound < 1.0 && (highest - position).dot(normal) > 0.0
    }

    /// The first point of the surface along `ray`, at most `limit` away \[m\].
    pub(super) fn hit(&self, ray: &Ray, limit: f64) -> Option<Hit> {
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
    pub(super) fn blocks(&self, a: Vec3, b: Vec3) -> bool {
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
