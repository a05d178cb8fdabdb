//! Rays and segments in the world against a star-shaped object: meshes first, the series for what is left.
//!
//! Between two points outside: what a plane stands before is free (`hull`); what passes beside the outline from a point is free too, what
//! passes through it beyond the object is blocked (`outline`). Of what is left, that which crosses the inner mesh is blocked; that which does
//! not cross the outer one, where an end is certainly outside of that too, is free. A point just outside of the surface stands within the
//! outer mesh, and nearly every segment from there would cross it. So its end is moved along the segment first, as far as that is certainly
//! clear (`rise`). A way that is moved off by rounding stays within the room that the meshes leave.

use super::Crossing;
use super::beside::{Beside, TileBeside, shares};
use super::outline::{Outline, Prospect, Sort};
use super::placed::{Harmonic, Pair, Shelled};
use super::rise::Shares;
use crate::geometry::mesh::bits;
use crate::geometry::points::Ends;
use crate::geometry::visibility::{BUNDLES, Lanes, Points, Scratch, Starts};
use crate::geometry::{Hit, Ray, hit};
use crate::math::{DVec3, Vec3};
use std::ops::Range;

/// What an end that is moved may be off, in units of its largest coordinate.
const ROUNDING: f64 = 1e-6;

/// A segment between two points outside of an object, and the part of it that is left where it is clear from its ends on.
#[derive(Clone, Copy)]
struct Segment {
    whole: [Vec3; 2],
    part: [Vec3; 2],
    /// Whether the ends may be within the outer mesh.
    near: [bool; 2],
}

/// The segments from an apex to the points of a tile.
struct Tile<'a> {
    apex: Vec3,
    points: &'a Points,
    /// The points, each moved along its segment as far as that is certainly clear.
    ends: &'a Ends,
    /// The points that may be within the outer mesh.
    near: &'a Lanes,
}

/// A crossing in the coordinates of an object, looked for from `before` on \[m\], with lengths `scale` times those of the world.
struct Line {
    crossing: Crossing,
    before: f64,
    scale: f64,
}

impl Harmonic {
    /// Clears the bits of the points in `seen` that `apex` does not see for this object, `beside` which they are.
    pub(in crate::geometry) fn hide(
        &self,
        (apex, prospect): (Vec3, &Prospect),
        points: &Points,
        beside: &TileBeside,
        seen: &mut Lanes,
        scratch: &mut Scratch,
    ) {
        if *seen == [0; BUNDLES] || self.is_apart(apex, points, beside) {
            return;
        }
        let here = self.beside(apex.as_dvec3());
        for (seen, inside) in seen.iter_mut().zip(&beside.inside) {
            *seen &= if here.inside { *inside } else { !inside };
        }
        if *seen == [0; BUNDLES] {
            return;
        }
        let Some(shells) = self.shells.as_ref().filter(|_| !here.inside) else {
            let whole = |bundle, lane| [apex, points.point(bundle, lane)];
            return clear_bits(seen, *seen, |bundle, lane| self.crosses(&Segment::inside(whole(bundle, lane))));
        };
        let mut moved = None;
        let mut free = beside.towards(shells.fine.outer.path, apex, &points.ends, seen, &mut moved);
        let ends = moved.as_ref().unwrap_or(&points.ends);
        *seen = joined(seen, &free, |seen, free| seen & !free);
        let tile = Tile { apex, points, ends, near: &beside.near };
        if here.near {
            self.hide_beside(&here, &tile, shells, seen, scratch);
            *seen = joined(seen, &free, |seen, free| seen | free);
            return;
        }
        // What points on the surface are seen past is the surface around them.
        let others = joined(seen, &beside.near, |seen, near| seen & !near);
        let mut open = *seen;
        if others != [0; BUNDLES]
            && let Some(outline) = prospect.get_or_init(|| self.outline(apex))
        {
            let sort = Sort { outline, apex, ends: &points.ends, asked: &others };
            let (certain, blocked) = shells.fine.outer.path.run(sort);
            free = joined(&free, &certain, |free, certain| free | certain);
            let known = joined(&certain, &blocked, |certain, blocked| certain | blocked);
            open = joined(&open, &known, |open, known| open & !known);
        }
        if open != [0; BUNDLES] {
            let (certain, left) = shells.fine.decide((apex, None), ends, &open, scratch);
            free = joined(&free, &certain, |free, certain| free | certain);
            open = left;
        }
        *seen = joined(&free, &open, |free, open| free | open);
        clear_bits(seen, open, |bundle, lane| self.crosses(&tile.segment(bundle, lane, 0.0, false)));
    }

    /// True where a plane certainly stands between the object and all segments from `apex` to the points of a tile.
    fn is_apart(&self, apex: Vec3, points: &Points, beside: &TileBeside) -> bool {
        let none = [0; BUNDLES];
        let Some(hull) = self.star.hull.as_ref().filter(|_| beside.near == none && beside.inside == none) else {
            return false;
        };
        let (low, high) = points.ends.tile;
        let (low, high) = (DVec3::from(low.map(f64::from)), DVec3::from(high.map(f64::from)));
        let (middle, half) = (0.5 * (low + high) - self.center, 0.5 * (high - low));
        let placed = (&self.to_world, self.world_radii());
        // Points far from all have no part in the box.
        points.ends.far == none && hull.is_apart(placed, apex.as_dvec3() - self.center, (middle, half))
    }

    /// How the object is seen from `apex` \[m\].
    pub(super) fn outline(&self, apex: Vec3) -> Option<Box<Outline>> {
        let Shelled { cage, fine } = self.shells.as_deref()?;
        Outline::new(cage, self.world_radii(), apex.as_dvec3() - self.center, fine.outer.path).map(Box::new)
    }

    /// The same for an `apex` that may be within the outer mesh, where it is `here`.
    fn hide_beside(&self, here: &Beside, tile: &Tile, shells: &Shelled, seen: &mut Lanes, scratch: &mut Scratch) {
        let (fine, apex) = (&shells.fine, tile.apex);
        let (shares, above) = shares(fine.outer.path, here, apex, tile.ends, seen);
        let segment = |bundle: usize, lane: usize| tile.segment(bundle, lane, shares[bundle][lane], true);
        let asked = joined(seen, &above, |seen, above| seen & !above);
        let slow = below_half(&shares, &asked);
        let fast = joined(&asked, &slow, |asked, slow| asked & !slow);
        let (mut free, open) = fine.decide((apex, Some(&Starts::new(shares, &fast))), tile.ends, &fast, scratch);
        let within = joined(&free, tile.near, |free, near| free & near);
        clear_bits(&mut free, within, |bundle, lane| {
            let segment = segment(bundle, lane);
            self.is_within(&segment) && self.crosses(&segment)
        });
        *seen = joined(&free, &above, |free, above| free | above);
        *seen = joined(seen, &slow, |seen, slow| seen | slow);
        clear_bits(seen, slow, |bundle, lane| self.is_crossed(fine, &segment(bundle, lane)));
        *seen = joined(seen, &open, |seen, open| seen | open);
        clear_bits(seen, open, |bundle, lane| self.crosses(&segment(bundle, lane)));
    }

    /// True when the segment between `a` and `b` crosses the surface \[m\].
    pub(in crate::geometry) fn blocks(&self, a: Vec3, b: Vec3) -> bool {
        let sides = [self.beside(a.as_dvec3()), self.beside(b.as_dvec3())];
        if sides[0].inside != sides[1].inside {
            return true;
        }
        match &self.shells {
            Some(shells) if !sides[0].inside => {
                let Some(share) = sides[1].clear(a - b) else { return false };
                let to = b + share * (a - b);
                let Some(share) = sides[0].clear(to - a) else { return false };
                let from = a + share * (to - a);
                let segment = Segment { whole: [a, b], part: [from, to], near: sides.map(|side| side.near) };
                self.is_crossed(&shells.fine, &segment)
            }
            _ => self.crosses(&Segment::inside([a, b])),
        }
    }

    /// True when a segment crosses the surface.
    fn is_crossed(&self, shells: &Pair, segment: &Segment) -> bool {
        let Segment { part: [from, to], near, .. } = *segment;
        if !(shells.outer.blocks(from, to) || near == [true; 2] && self.is_within(segment)) {
            return false;
        }
        shells.inner.blocks(from, to) || self.crosses(segment)
    }

    /// True where both ends of what is left of a segment may be within the outer mesh: without crossing that they may see each other through the
    /// surface.
    fn is_within(&self, segment: &Segment) -> bool {
        segment.part.iter().all(|p| self.beside(p.as_dvec3()).near)
    }

    /// The same by the series, wherever the segment is inside the outer mesh.
    fn crosses(&self, segment: &Segment) -> bool {
        let [a, b] = segment.whole.map(|p| p.as_dvec3());
        let whole = (b - a).length();
        if whole == 0.0 {
            return false;
        }
        let ray = Ray { origin: a, direction: (b - a) / whole };
        let [from, to] = segment.part.map(|p| (p.as_dvec3() - a).dot(ray.direction));
        let off = ROUNDING * a.abs().max(b.abs()).max_element();
        let part = self.part_within(&ray, (from - off).max(0.0)..(to + off).min(whole), segment.near);
        part.is_some_and(|part| {
            let (origin, way, scale) = self.own(&ray, part.start);
            self.star.is_crossed(origin, way, (part.end - part.start) * scale)
        })
    }

    /// The first point of the surface along `ray`, at most `limit` away \[m\].
    pub(in crate::geometry) fn hit(&self, ray: &Ray, limit: f64) -> Option<Hit> {
        if !self.passes(ray, limit) {
            return None;
        }
        let here = self.beside(ray.origin);
        let around = limit.min(2.0 * self.around().1);
        let clear = f64::from(here.clear((around * ray.direction).as_vec3())?) * around;
        let line = self.first_within(ray, clear..limit, [here.near, limit < f64::INFINITY])?;
        Some(self.met(ray, &line))
    }

    /// The same of many rays, each up to its entry of `hits`, which it replaces as the surface `primitive`: rays from one point ask the outer mesh
    /// together.
    pub(in crate::geometry) fn hits(&self, rays: &[Ray], hits: &mut [Option<Hit>], primitive: u32) {
        let mut entries = vec![None; rays.len()];
        if let Some(shells) = &self.shells {
            shells.fine.outer.closest_hits(rays, &mut entries);
        }
        let mut start: Option<(DVec3, bool)> = None;
        for ((ray, hit), entry) in rays.iter().zip(hits).zip(entries) {
            let limit = hit.map_or(f64::INFINITY, |hit: Hit| hit.distance);
            let is_near = match start.filter(|(origin, _)| *origin == ray.origin) {
                Some((_, is_near)) => is_near,
                None => self.shells.is_none() || self.beside(ray.origin).near,
            };
            start = Some((ray.origin, is_near));
            let found = if is_near {
                self.hit(ray, limit)
            } else {
                let line = entry.and_then(|entry: Hit| self.look(ray, entry.distance..limit));
                line.map(|line| self.met(ray, &line))
            };
            if let Some(found) = found.filter(|found| found.distance < limit) {
                *hit = Some(Hit { primitive, ..found });
            }
        }
    }

    /// False where `ray` certainly misses the ball around the meshes before `limit`.
    fn passes(&self, ray: &Ray, limit: f64) -> bool {
        let from = ray.origin - self.center;
        let along = -from.dot(ray.direction);
        let under = self.reach2 - (from + along * ray.direction).length_squared();
        let half = under.max(0.0).sqrt();
        under >= 0.0 && along + half >= 0.0 && along - half <= limit
    }

    /// What `ray` meets at `line`.
    fn met(&self, ray: &Ray, line: &Line) -> Hit {
        let Line { crossing, before, scale } = line;
        let normal = (self.to_own.transpose() * crossing.normal).normalize();
        let position = self.center + self.to_world * crossing.position;
        hit(ray, before + crossing.distance / scale, position, normal)
    }

    /// How far along `ray` its surface is first met, by the series alone \[m\]: the twin that tests the meshes.
    pub fn first_crossing(&self, ray: &Ray) -> Option<f64> {
        let (origin, way, scale) = self.own(ray, 0.0);
        self.star.first_crossing(origin, way, f64::INFINITY).map(|crossing| crossing.distance / scale)
    }

    /// The first crossing of a part of `ray`, whose ends may be within the outer mesh or are certainly not.
    fn first_within(&self, ray: &Ray, part: Range<f64>, near: [bool; 2]) -> Option<Line> {
        self.look(ray, self.part_within(ray, part, near)?)
    }

    /// What the series must be asked of a part of `ray`: from where it enters the outer mesh on.
    fn part_within(&self, ray: &Ray, part: Range<f64>, [starts_near, ends_near]: [bool; 2]) -> Option<Range<f64>> {
        let Some(shells) = &self.shells else { return Some(part) };
        let Range { start, end } = part;
        let here = Ray { origin: ray.origin + start * ray.direction, direction: ray.direction };
        match shells.fine.outer.closest_hit(&here, end - start) {
            Some(outer) if outer.front => Some(start + outer.distance..end),
            Some(_) => Some(start..end),
            // No way in from outside, and none out to an end that is there.
            None => (starts_near && ends_near).then_some(start..end),
        }
    }

    /// The first crossing by the series alone.
    fn look(&self, ray: &Ray, part: Range<f64>) -> Option<Line> {
        let (origin, way, scale) = self.own(ray, part.start);
        let crossing = self.star.first_crossing(origin, way, (part.end - part.start) * scale)?;
        Some(Line { crossing, before: part.start, scale })
    }

    /// The point `from` along `ray` and the direction of that, in coordinates of the object, where lengths are so many times those of the world.
    fn own(&self, ray: &Ray, from: f64) -> (DVec3, DVec3, f64) {
        let way = self.to_own * ray.direction;
        let scale = way.length();
        (self.to_own * (ray.origin + from * ray.direction - self.center), way / scale, scale)
    }
}

impl Pair {
    /// Of the segments from an apex, each from its start on, to the points `asked`: those that do not cross the outer mesh, and those that cross it
    /// and not the inner one.
    fn decide(
        &self,
        (apex, starts): (Vec3, Option<&Starts>),
        ends: &Ends,
        asked: &Lanes,
        scratch: &mut Scratch,
    ) -> (Lanes, Lanes) {
        let mut free = *asked;
        self.outer.hide_after(apex, starts, ends, &mut free, scratch);
        let mut open = joined(asked, &free, |asked, free| asked & !free);
        if open != [0; BUNDLES] {
            self.inner.hide(apex, ends, &mut open, scratch);
        }
        (free, open)
    }
}

impl Tile<'_> {
    /// That to one point, clear from the apex on for this `share` of the way to where the point was moved; `near` tells of the apex.
    fn segment(&self, bundle: usize, lane: usize, share: f32, near: bool) -> Segment {
        let (apex, to) = (self.apex, self.ends.point(bundle, lane));
        let whole = [apex, self.points.point(bundle, lane)];
        let part = [apex + share * (to - apex), to];
        Segment { whole, part, near: [near, self.near[bundle] >> lane & 1 == 1] }
    }
}

impl Segment {
    /// Between two points on the same side, for an object without meshes or from within.
    fn inside(whole: [Vec3; 2]) -> Segment {
        Segment { whole, part: whole, near: [true; 2] }
    }
}

/// The points in `seen` whose shares are below half of the greatest: what is asked of all of a tile would begin too early for the others.
fn below_half(shares: &Shares, seen: &Lanes) -> Lanes {
    let (mut most, mut below) = (0f32, [0; BUNDLES]);
    for bundle in 0..BUNDLES {
        for lane in bits(u32::from(seen[bundle])) {
            most = most.max(shares[bundle][lane]);
        }
    }
    for bundle in 0..BUNDLES {
        for lane in bits(u32::from(seen[bundle])) {
            below[bundle] |= u16::from(shares[bundle][lane] < 0.5 * most) << lane;
        }
    }
    below
}

/// `of` the lanes of both, bundle by bundle.
fn joined(a: &Lanes, b: &Lanes, of: impl Fn(u16, u16) -> u16) -> Lanes {
    let mut lanes = *a;
    lanes.iter_mut().zip(b).for_each(|(a, b)| *a = of(*a, *b));
    lanes
}

/// Clears the bits of `seen` that are set in `asked` where `is_hidden`.
fn clear_bits(seen: &mut Lanes, asked: Lanes, is_hidden: impl Fn(usize, usize) -> bool) {
    for bundle in 0..BUNDLES {
        for lane in bits(u32::from(asked[bundle])) {
            seen[bundle] &= !(u16::from(is_hidden(bundle, lane)) << lane);
        }
    }
}
