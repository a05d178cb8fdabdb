//! The outline of a star-shaped object seen from a point outside.
//!
//! Rays from the apex a in half a plane that ends at the line from a through the centre cross the object up to some angle with that line, none
//! beyond: a crossing at y means that all of the way from the centre to y is inside. So with z the coordinate of D = p - a towards the centre, x and y
//! those across, and w = z/(|x| + |y|), for each wedge around the line
//!
//! ```text
//! w < w_o  or  z <= z_n:  the segment from a to p is free,      w_o: the least w of the outer net of the cage in the wedge
//! w > w_i and z > z_f:    it is blocked,                        w_i: the greatest w of edges of the inner net, around all of the line
//! ```
//!
//! z_n is that of the nearest point of the object, z_f the farthest of the centre and these edges: a ray below an edge crosses the way
//! from the centre there. The edges are those of the rim. Whatever goes around the line in the inner net would do, between the triangles where
//! the line enters it and leaves.
//!
//! The share q = |y|/(|x| + |y|) tells the direction within a quadrant, and along a straight edge w is linear in q: both are quotients of
//! linear functions with the same denominator.

use super::cage::{Cage, EDGES, Found};
use crate::geometry::points::Ends;
use crate::geometry::simd::{Isa, Kernel, Path, Vector};
use crate::geometry::visibility::{BUNDLE, BUNDLES, Lanes};
use crate::math::{DVec3, Vec3, frame};
use std::sync::{Arc, OnceLock};

/// Wedges around the line.
const WEDGES: usize = 64;
/// Those of a quadrant.
const QUADRANT: f32 = (WEDGES / 4) as f32;
/// What is taken off w for rounding: of itself, and of that in units of its least.
const ROUNDING: [f64; 2] = [1e-5, 1e-6];
/// What is added to wedges for rounding, in units of them.
const ASIDE: f32 = 0.02;
/// The least distance from the centre to the surface, seen from the apex, that f32 leaves alone.
const LEAST: f64 = 1e-3;

/// Nearer than so many times the greatest distance of a corner from the centre no outline is made.
const BEYOND: f64 = 1.01;
/// Outlines of an object at one time, at most.
const MOST: usize = 1 << 14;
/// Memory of all of them, where so many are wanted \[bytes\].
pub(super) const MOST_BYTES: u64 = (MOST * size_of::<Outline>()) as u64;

/// The outline from an apex, from when it is first asked for.
pub(in crate::geometry) type Prospect = OnceLock<Option<Box<Outline>>>;

/// The outline.
#[derive(Clone, Debug)]
pub(in crate::geometry) struct Outline {
    /// Unit vectors across the line, and along it towards the centre.
    axes: [Vec3; 3],
    /// w_o and w_i of each wedge.
    bounds: [[f32; 2]; WEDGES],
    /// z_n and z_f \[m\].
    near: f32,
    far: f32,
    /// Held for as long as it is there.
    _counted: Arc<()>,
}

/// w_o and w_i of a wedge of which nothing is known.
const UNKNOWN: [f32; 2] = [f32::NEG_INFINITY, f32::INFINITY];

/// What an outline is made of: w_o and w_i so far of the lines that cross the beginning of each wedge, and of the ends of lines within it.
struct Draft {
    axes: [Vec3; 3],
    distance: f32,
    far: f32,
    borders: [[f32; 2]; WEDGES],
    ends: [[f32; 2]; WEDGES],
}

/// Coordinates across the line, and along it in the outer net and in the inner one.
type Place = [f32; 4];

/// Which way a place lies from the line, in wedges, and w in both nets; in the inner one 0 where that does not count.
#[derive(Clone, Copy)]
struct Bearing {
    turn: f32,
    w: [f32; 2],
}

impl Outline {
    /// That of a surface in the `cage`, between the distances `low` and `high` from its centre, from the point `apex`, seen from there \[m\]; `None` from
    /// within the cage or near it, from too far for f32, and where there are very many.
    pub(super) fn new(cage: &Cage, (low, high): (f64, f64), apex: DVec3, path: Path) -> Option<Outline> {
        let distance = apex.length();
        // From within the net no rim would go around the axis. Written so, no number that is none passes.
        let is_outside = distance > BEYOND * cage.reach.max(high) && low >= LEAST * distance;
        if !is_outside || Arc::strong_count(&cage.outlines) > MOST {
            return None;
        }
        let towards = -apex / distance;
        let (e, f) = frame(towards);
        let axes = [e, f, towards].map(|v| v.as_vec3());
        let draft = path.run(Sketch { cage, apex: apex.as_vec3(), axes, distance: distance as f32 });
        let off = (ROUNDING[0] + ROUNDING[1] * distance / low) as f32;
        let near = ((distance - high) * (1.0 - ROUNDING[0])) as f32;
        let counted = Arc::clone(&cage.outlines);
        Some(Outline { axes, bounds: draft.bounds(off), near, far: draft.far * (1.0 + off), _counted: counted })
    }
}

/// The rim of a cage, from an apex that it is at this `distance` from.
struct Sketch<'a> {
    cage: &'a Cage,
    apex: Vec3,
    axes: [Vec3; 3],
    distance: f32,
}

impl Kernel for Sketch<'_> {
    type Output = Draft;

    #[inline(always)]
    fn run<I: Isa>(self) -> Draft {
        let Sketch { cage, apex, axes, distance } = self;
        let none = [[f32::INFINITY, 0.0]; WEDGES];
        let mut draft = Draft { axes, distance, far: distance, borders: none, ends: none };
        let mut found = [Found::default(); EDGES];
        let count = cage.rim(apex, &mut found);
        let mut far = I::Sixteen::splat(distance);
        for edges in found[..count].chunks(BUNDLE) {
            far = far.max(draft.include::<I>(cage, edges));
        }
        let mut lanes = [0.0; BUNDLE];
        far.store(&mut lanes);
        for lane in lanes {
            draft.far = if lane > draft.far { lane } else { draft.far };
        }
        draft
    }
}

impl Draft {
    /// Takes in up to sixteen edges of the outer net, and of those that are part of the rim the edges of the inner one; gives how far these lie.
    #[inline(always)]
    fn include<I: Isa>(&mut self, cage: &Cage, edges: &[Found]) -> I::Sixteen {
        // What is left of sixteen repeats the first.
        let mut corners = [[[0.0; BUNDLE]; 4]; 2];
        let mut rim = 0;
        for lane in 0..BUNDLE {
            let edge = &edges[if lane < edges.len() { lane } else { 0 }];
            let ends = cage.ends(edge);
            rim |= u32::from(edge.is_rim) << lane;
            for end in 0..2 {
                corners[end][0][lane] = ends[end].outer.x;
                corners[end][1][lane] = ends[end].outer.y;
                corners[end][2][lane] = ends[end].outer.z;
                corners[end][3][lane] = ends[end].ratio;
            }
        }
        let distance = I::Sixteen::splat(self.distance);
        let mut far = distance;
        let mut places = [[distance; 4]; 2];
        let mut bearings = [[distance; 3]; 2];
        for end in 0..2 {
            let columns = &corners[end];
            let corner = [I::Sixteen::load(&columns[0]), I::Sixteen::load(&columns[1]), I::Sixteen::load(&columns[2])];
            let ratio = I::Sixteen::load(&columns[3]);
            let (x, y) = (along::<I>(&corner, self.axes[0]), along::<I>(&corner, self.axes[1]));
            let z = along::<I>(&corner, self.axes[2]);
            // The inner corner is in the same direction from the centre, nearer to it: these are that many times its coordinates.
            let inner = z.add(distance.mul(ratio)).select(rim);
            far = far.max(z.div(ratio).add(distance).select(rim));
            places[end] = [x, y, z.add(distance), inner];
            bearings[end] = bearing::<I>(&places[end]);
        }
        let ([a, b], [from, to]) = (&bearings, &places);
        let zero = I::Sixteen::splat(0.0);
        let across = (from[0].less(zero) ^ to[0].less(zero)) | (from[1].less(zero) ^ to[1].less(zero));
        let inverse = I::Sixteen::splat(1.0).div(b[0].sub(a[0]));
        let mut slopes = [[0.0; BUNDLE]; 2];
        b[1].sub(a[1]).mul(inverse).store(&mut slopes[0]);
        b[2].sub(a[2]).mul(inverse).store(&mut slopes[1]);
        let mut ways = [[[0.0; BUNDLE]; 3]; 2];
        for end in 0..2 {
            for k in 0..3 {
                bearings[end][k].store(&mut ways[end][k]);
            }
            // The places are asked for by few: `corners` has been read.
            for k in 0..4 {
                places[end][k].store(&mut corners[end][k]);
            }
        }
        for lane in 0..edges.len() {
            let a = Bearing { turn: ways[0][0][lane], w: [ways[0][1][lane], ways[0][2][lane]] };
            let b = Bearing { turn: ways[1][0][lane], w: [ways[1][1][lane], ways[1][2][lane]] };
            self.end(a);
            self.end(b);
            if across >> lane & 1 == 0 {
                let (low, high) = if a.turn <= b.turn { (a, b) } else { (b, a) };
                self.spread(low, high.turn, [slopes[0][lane], slopes[1][lane]]);
            } else {
                self.spread_across(&corners, lane, [a, b]);
            }
        }
        far
    }

    /// Takes in what lies between the ends of an edge that leaves a quadrant, in a lane of its `places`.
    #[inline(never)]
    fn spread_across(&mut self, places: &[[[f32; BUNDLE]; 4]; 2], lane: usize, [mut from, to]: [Bearing; 2]) {
        let [a, b] = places.each_ref().map(|columns| columns.map(|column| column[lane]));
        let crossing = |k: usize| if (a[k] < 0.0) != (b[k] < 0.0) { a[k] / (a[k] - b[k]) } else { 2.0 };
        let shares = [crossing(0), crossing(1)];
        let order = if shares[0] <= shares[1] { [0, 1] } else { [1, 0] };
        for k in order.into_iter().filter(|&k| shares[k] <= 1.0) {
            let axis = on_axis(a, b, k, shares[k]);
            self.spread_between(from, axis);
            self.end(axis);
            from = axis;
        }
        self.spread_between(from, to);
    }

    /// Takes in what lies between two places in a quadrant.
    fn spread_between(&mut self, a: Bearing, b: Bearing) {
        let (mut low, mut high) = if a.turn <= b.turn { (a, b) } else { (b, a) };
        if high.turn - low.turn > 1.5 * QUADRANT {
            // The beginning of a turn is the end of one.
            (low, high) = (high, Bearing { turn: low.turn + WEDGES as f32, w: low.w });
        }
        let inverse = 1.0 / (high.turn - low.turn);
        self.spread(low, high.turn, [0, 1].map(|k| (high.w[k] - low.w[k]) * inverse));
    }

    /// Takes in the end of a line, in both wedges where it is at the border of two.
    #[inline(always)]
    fn end(&mut self, at: Bearing) {
        // A turn more: what is positive is rounded down by a mere conversion.
        let turn = at.turn + WEDGES as f32;
        let (first, last) = ((turn - ASIDE) as usize % WEDGES, (turn + ASIDE) as usize % WEDGES);
        widen(&mut self.ends[first], at.w);
        if last != first {
            widen(&mut self.ends[last], at.w);
        }
    }

    /// Takes in what lies between `low` and a place in the same quadrant that is `high` of a turn, where wedges begin; w grows by `slopes` for each wedge.
    #[inline(always)]
    fn spread(&mut self, low: Bearing, high: f32, slopes: [f32; 2]) {
        let (first, last) = (low.turn as usize + 1, high as usize);
        for k in first..=last {
            let way = k as f32 - low.turn;
            // As far beyond it as points may be put into the wrong wedge.
            for way in [(way - ASIDE).max(0.0), (way + ASIDE).min(high - low.turn)] {
                let w = [low.w[0] + slopes[0] * way, low.w[1] + slopes[1] * way];
                widen(&mut self.borders[k % WEDGES], w);
            }
        }
    }

    /// w_o and w_i of all wedges, widened by the share `off`.
    fn bounds(&self, off: f32) -> [[f32; 2]; WEDGES] {
        let mut bounds = self.ends;
        for (k, bounds) in bounds.iter_mut().enumerate() {
            widen(bounds, self.borders[k]);
            widen(bounds, self.borders[(k + 1) % WEDGES]);
            // Where nothing goes around, nothing is known.
            let is_known = bounds[0] < f32::INFINITY && bounds[1] > 0.0;
            *bounds = if is_known { [bounds[0] * (1.0 - off), bounds[1] * (1.0 + off)] } else { UNKNOWN };
        }
        bounds
    }
}

/// Takes w in an outer and an inner line into the least of the first and the greatest of the second.
#[inline(always)]
fn widen(bounds: &mut [f32; 2], [outer, inner]: [f32; 2]) {
    bounds[0] = if outer < bounds[0] { outer } else { bounds[0] };
    bounds[1] = if inner > bounds[1] { inner } else { bounds[1] };
}

/// Where the line from `a` to `b` crosses that with x = 0, or y = 0 where `k` is 1, which it does after this `share` of it.
fn on_axis(a: Place, b: Place, k: usize, share: f32) -> Bearing {
    let mut at = [0.0; 4];
    for i in 0..4 {
        at[i] = a[i] + share * (b[i] - a[i]);
    }
    let other = at[1 - k];
    let turn = if k == 0 {
        if other < 0.0 { 3.0 } else { 1.0 }
    } else if other < 0.0 {
        2.0
    } else {
        0.0
    };
    let inverse = 1.0 / other.abs().max(f32::MIN_POSITIVE);
    Bearing { turn: turn * QUADRANT, w: [at[2] * inverse, at[3] * inverse] }
}

/// Which way places lie from the line, and w in both nets.
#[inline(always)]
fn bearing<I: Isa>(place: &[I::Sixteen; 4]) -> [I::Sixteen; 3] {
    let [x, y, outer, inner] = *place;
    let across = x.abs().add(y.abs()).max(I::Sixteen::splat(f32::MIN_POSITIVE));
    let inverse = I::Sixteen::splat(1.0).div(across);
    [turn::<I>(x, y, y.abs().mul(inverse)), outer.mul(inverse), inner.mul(inverse)]
}

/// Which way places lie from the line, whose y is this `share` of |x| + |y|.
#[inline(always)]
fn turn<I: Isa>(x: I::Sixteen, y: I::Sixteen, share: I::Sixteen) -> I::Sixteen {
    // share, 2 - share, 2 + share and 4 - share quadrants, each in its own.
    let zero = I::Sixteen::splat(0.0);
    let (left, low) = (x.less(zero), y.less(zero));
    let back = I::Sixteen::splat(QUADRANT).mul(share);
    let mirrored = I::Sixteen::splat(-1.0).mul(back);
    let whole = I::Sixteen::splat(2.0 * QUADRANT);
    let start = whole.select(left).add(whole.add(whole).select(low & !left));
    let turned = (left ^ low) & 0xFFFF;
    start.add(back.select(!turned)).add(mirrored.select(turned))
}

/// The points `asked` whose segments from `apex` are certainly free, and those whose are certainly blocked.
pub(super) struct Sort<'a> {
    pub(super) outline: &'a Outline,
    pub(super) apex: Vec3,
    pub(super) ends: &'a Ends,
    pub(super) asked: &'a Lanes,
}

impl Kernel for Sort<'_> {
    type Output = (Lanes, Lanes);

    #[inline(always)]
    fn run<I: Isa>(self) -> (Lanes, Lanes) {
        let Sort { outline, apex, ends, asked } = self;
        let (mut free, mut blocked) = ([0; BUNDLES], [0; BUNDLES]);
        let [e, f, towards] = outline.axes;
        let (near, far) = (I::Sixteen::splat(outline.near), I::Sixteen::splat(outline.far));
        let mut wedges = [0.0; BUNDLE];
        let mut bounds = [[0.0; BUNDLE]; 2];
        for bundle in 0..BUNDLES {
            if asked[bundle] == 0 {
                continue;
            }
            let d = ends.segments::<I>(bundle, apex.to_array());
            let (x, y, z) = (along::<I>(&d, e), along::<I>(&d, f), along::<I>(&d, towards));
            let (width, height) = (x.abs(), y.abs());
            let across = width.add(height);
            let share = height.div(across.max(I::Sixteen::splat(f32::MIN_POSITIVE)));
            turn::<I>(x, y, share).store(&mut wedges);
            for lane in 0..BUNDLE {
                let [outer, inner] = outline.bounds[wedges[lane] as usize % WEDGES];
                (bounds[0][lane], bounds[1][lane]) = (outer, inner);
            }
            let outside = z.less(I::Sixteen::load(&bounds[0]).mul(across));
            let inside = I::Sixteen::load(&bounds[1]).mul(across).less(z);
            free[bundle] = asked[bundle] & (outside | z.less(near)) as u16;
            blocked[bundle] = asked[bundle] & !free[bundle] & (inside & far.less(z)) as u16;
        }
        (free, blocked)
    }
}

#[inline(always)]
fn along<I: Isa>(d: &[I::Sixteen; 3], axis: Vec3) -> I::Sixteen {
    let [x, y, z] = [d[0], d[1], d[2]];
    x.mul(I::Sixteen::splat(axis.x)).add(y.mul(I::Sixteen::splat(axis.y))).add(z.mul(I::Sixteen::splat(axis.z)))
}
