//! Veils: triangles that do not block, but that somebody wants to know of when a segment crosses them.
//!
//! They lie in a hierarchy of their own beside the mesh that blocks. What a veil does to light is not for geometry to know: it
//! tells which veils a segment crosses, where and at which cosine. The order in which it tells them is that of the
//! hierarchy, whatever else was asked at once; so a product over them has the same bits for one segment and for a tile.
//!
//! A segment through an edge that two triangles share crosses exactly one of them (a pane is two triangles, and must not count
//! twice along its diagonal): where the triple product that tells the side of an edge is 0 the order of the corners in
//! space decides, which is opposite for the two neighbours. That is what the signs would be if the
//! segment were moved a little, the same way everywhere.

use super::mesh::{Mesh, Triangle, bits};
use super::points::Points;
use super::shaft::Shaft;
use super::simd::Scalar;
use super::visibility::Lanes;
use super::{Build, Geometry};
use crate::math::{DVec3, Vec3};

/// How far from the box around a triangle f64 may see a crossing, as in `mesh`.
const AROUND: f64 = 4.0 / (1u64 << 24) as f64;

/// Where a segment crosses a veil.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// The veil.
    pub primitive: u32,
    /// The place \[m\].
    pub position: DVec3,
    /// Cosine between segment and normal, above 0.
    pub cosine: f64,
}

impl Geometry {
    /// The geometry of `triangles` of which some are veils, in the order of their numbers; spheres and planes are added by the caller.
    pub fn veiled(triangles: &[[Vec3; 3]], is_veil: &[bool], build: Build) -> Geometry {
        let bounds = Mesh::bounds_of(triangles);
        let part = |wanted: bool| {
            let numbers: Vec<u32> = (0..).zip(is_veil).filter(|(_, veil)| **veil == wanted).map(|(i, _)| i).collect();
            let own: Vec<[Vec3; 3]> = numbers.iter().map(|&i| triangles[i as usize]).collect();
            Mesh::within(&own, build, bounds).numbered(&numbers)
        };
        let veils = is_veil.contains(&true).then(|| part(true));
        let mesh = if veils.is_some() { part(false) } else { Mesh::built(triangles, build) };
        Geometry { mesh, veils, ..Geometry::default() }.measured()
    }

    /// True where there are veils.
    pub fn has_veils(&self) -> bool {
        self.veils.is_some()
    }

    /// Calls `visit` for each veil that crosses the segment between two lifted points.
    pub fn veils_between(&self, a: Vec3, b: Vec3, mut visit: impl FnMut(Crossing)) {
        let Some(veils) = &self.veils else { return };
        let Some(shaft) = veils.shaft(a, b) else { return };
        veils.blocks_met(&shaft, |triangle| {
            if let Some(crossing) = Sheet::new(triangle, a.as_dvec3()).crossed((b - a).as_dvec3()) {
                visit(crossing);
            }
        });
    }

    /// Calls `visit` for each veil that crosses a segment from `apex` to one of the `points` that are `seen`, with the bundle and
    /// the lane of the point.
    pub fn veils_before(
        &self,
        apex: Vec3,
        points: &Points,
        seen: &Lanes,
        mut visit: impl FnMut(usize, usize, Crossing),
    ) {
        let Some(veils) = &self.veils else { return };
        let near = veils.is_near(apex.as_dvec3());
        if near
            && !veils.are_met(&Shaft::new(apex.to_array(), points.ends.tile.0, points.ends.tile.1))
            && points.ends.far == [0; 16]
        {
            return;
        }
        for (bundle, &seen) in seen.iter().enumerate().filter(|(_, seen)| **seen != 0) {
            let alone = if near { seen & points.ends.far[bundle] } else { seen };
            for lane in bits(u32::from(alone)) {
                self.veils_between(apex, points.point(bundle, lane), |crossing| visit(bundle, lane, crossing));
            }
            let together = seen & !alone;
            if together == 0 {
                continue;
            }
            let (low, high) = points.ends.bundles[bundle];
            veils.blocks_met(&Shaft::new(apex.to_array(), low, high), |triangle| {
                let sheet = Sheet::new(triangle, apex.as_dvec3());
                for lane in bits(u32::from(together)) {
                    if let Some(crossing) = sheet.crossed((points.point(bundle, lane) - apex).as_dvec3()) {
                        visit(bundle, lane, crossing);
                    }
                }
            });
        }
    }
}

impl Mesh {
    /// The shaft of one segment, inside the mesh; `None` where it misses that.
    fn shaft(&self, a: Vec3, b: Vec3) -> Option<Shaft> {
        let (o, end) = (a.as_dvec3(), b.as_dvec3());
        if self.is_near(o) && self.is_near(end) {
            return Some(Shaft::new(a.to_array(), b.to_array(), b.to_array()));
        }
        let (enter, leave) = self.clip(o, end - o, 1.0)?;
        let [a, b] = [enter, leave].map(|t| (o + t * (end - o)).as_vec3().to_array());
        Some(Shaft::new(a, b, b))
    }

    /// True unless the segments of `shaft` meet no box of the root.
    fn are_met(&self, shaft: &Shaft) -> bool {
        self.bvh.nodes.first().is_some_and(|root| shaft.meets::<Scalar>(root) != 0)
    }

    /// Calls `visit` for the triangles of all blocks that segments of `shaft` may meet.
    fn blocks_met(&self, shaft: &Shaft, mut visit: impl FnMut(&Triangle)) {
        let mut open: Vec<u32> = if self.is_empty() { Vec::new() } else { vec![0] };
        while let Some(number) = open.pop() {
            let node = &self.bvh.nodes[number as usize];
            let met = shaft.meets::<Scalar>(node);
            for slot in bits(met & node.blocks) {
                self.triangles[self.bvh.block(node.child[slot])].iter().for_each(&mut visit);
            }
            open.extend(bits(met & !node.blocks).map(|slot| node.child[slot]));
        }
    }
}

/// A veil seen from one point: what all segments from there share.
struct Sheet {
    primitive: u32,
    from: DVec3,
    /// N, of the length of twice the area, and N . (corner - from).
    normal: DVec3,
    numerator: f64,
    /// Normals of the planes through the point and each edge, and the sign that 0 counts as.
    edges: [(DVec3, f64); 3],
    /// The box around it, seen from the point, and a little more.
    low: DVec3,
    high: DVec3,
}

impl Sheet {
    fn new(triangle: &Triangle, from: DVec3) -> Self {
        let corners = triangle.corners;
        let [a, b, c] = corners.map(|p| p.as_dvec3() - from);
        let normal = (b - a).cross(c - a);
        let edge = |p: DVec3, q: DVec3, i: usize, j: usize| {
            let first = corners[i].to_array() < corners[j].to_array();
            (p.cross(q), if first { 1.0 } else { -1.0 })
        };
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let around = AROUND * low.abs().max(high.abs()).max_element();
        Sheet {
            primitive: triangle.primitive,
            from,
            normal,
            numerator: normal.dot(a),
            edges: [edge(c, b, 2, 1), edge(a, c, 0, 2), edge(b, a, 1, 0)],
            low: low - around,
            high: high + around,
        }
    }

    /// Where the segment along `d` crosses it, ends excluded.
    fn crossed(&self, d: DVec3) -> Option<Crossing> {
        let slope = self.normal.dot(d);
        let t = self.numerator / slope;
        // Edge-on the quotient is infinite or undefined: a veil seen edge-on is not there.
        if !(t > 0.0 && t < 1.0) {
            return None;
        }
        let side = |(across, tie): (DVec3, f64)| match d.dot(across) {
            0.0 => tie > 0.0,
            e => e > 0.0,
        };
        let sides = self.edges.map(side);
        let at = t * d;
        let inside = sides[0] == sides[1] && sides[1] == sides[2];
        let crossed = inside && at.cmpge(self.low).all() && at.cmple(self.high).all();
        let cosine = slope.abs() / (self.normal.length() * d.length());
        crossed.then(|| Crossing { primitive: self.primitive, position: self.from + at, cosine: cosine.min(1.0) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::visibility::{BUNDLE, TILE};
    use crate::random::{Domain, Generator, Stream};

    /// A square of `n` x `n` cells of two triangles each at height `y`.
    fn sheet(n: u32, y: f32) -> Vec<[Vec3; 3]> {
        let at = |i: u32, j: u32| Vec3::new(i as f32 / n as f32 - 0.5, y, j as f32 / n as f32 - 0.5);
        let cells = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
        let halves = |(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            [[a, b, c], [a, c, d]]
        };
        cells.flat_map(halves).collect()
    }

    fn crossings(geometry: &Geometry, a: Vec3, b: Vec3) -> Vec<Crossing> {
        let mut found = Vec::new();
        geometry.veils_between(a, b, |crossing| found.push(crossing));
        found
    }

    fn point(rng: &mut Generator) -> Vec3 {
        Vec3::from_array(std::array::from_fn(|_| 1.2 * rng.uniform() as f32 - 0.6))
    }

    #[test]
    fn a_pane_is_crossed_once_along_edges_and_through_corners() {
        let triangles = sheet(4, 0.0);
        let geometry = Geometry::veiled(&triangles, &vec![true; triangles.len()], Build::Quick);
        // Straight down, and aslant, through every eighth of a cell: edges, diagonals and corners among them.
        for (i, j) in (1..32).flat_map(|i| (1..32).map(move |j| (i, j))) {
            let at = Vec3::new(i as f32 / 32.0 - 0.5, 0.0, j as f32 / 32.0 - 0.5);
            for off in [Vec3::Y, Vec3::new(0.5, 0.25, 0.0), Vec3::new(-0.25, 0.5, 0.125)] {
                let found = crossings(&geometry, at + off, at - off);
                assert_eq!(found.len(), 1, "{at} {off}: {found:?}");
                assert!((found[0].position - at.as_dvec3()).length() < 1e-6, "{at} {off}: {found:?}");
                let cosine = f64::from(off.y / off.length());
                assert!((found[0].cosine - cosine).abs() < 1e-6, "{at} {off}: {found:?}");
            }
        }
        // Beside it, and short of it.
        assert!(crossings(&geometry, Vec3::new(0.6, 1.0, 0.0), Vec3::new(0.6, -1.0, 0.0)).is_empty());
        assert!(crossings(&geometry, Vec3::new(0.1, 1.0, 0.0), Vec3::new(0.1, 0.5, 0.0)).is_empty());
    }

    #[test]
    fn a_tile_is_told_what_its_segments_are_told_in_the_same_order() {
        let mut rng = Stream::new(3, Domain::Receiver, "veils").generator(0);
        let mut triangles: Vec<[Vec3; 3]> = (0..7).flat_map(|k| sheet(3, 0.1 * k as f32 - 0.35)).collect();
        triangles.extend((0..40).map(|_| [point(&mut rng), point(&mut rng), point(&mut rng)]));
        let veils: Vec<bool> = (0..triangles.len()).map(|i| i % 7 != 0).collect();
        let geometry = Geometry::veiled(&triangles, &veils, Build::Thorough);
        let mut told = 0;
        for far in [1.0, 1.0, 1.0, 30.0] {
            let points: Vec<Vec3> = (0..TILE).map(|i| point(&mut rng) * if i % 3 == 0 { far } else { 0.3 }).collect();
            let tile = Points::new(&geometry, &points);
            for apex in [point(&mut rng), point(&mut rng) * far, point(&mut rng) * 0.1] {
                let mut of_tile = vec![Vec::new(); TILE];
                let seen = [0xffff; 16];
                geometry.veils_before(apex, &tile, &seen, |bundle, lane, c| of_tile[bundle * BUNDLE + lane].push(c));
                for (&point, of_tile) in points.iter().zip(of_tile) {
                    let alone = crossings(&geometry, apex, point);
                    told += alone.len();
                    assert!(alone.iter().all(|c| veils[c.primitive as usize]));
                    assert_eq!(alone, of_tile, "{apex} {point}");
                }
            }
        }
        assert!(told > 3000, "{told}");
    }

    #[test]
    fn rays_meet_veils_and_segments_are_not_blocked_by_them() {
        let triangles: Vec<[Vec3; 3]> = [sheet(1, 0.0), sheet(1, 1.0), sheet(1, -1.0)].concat();
        let veils = [true, true, false, false, true, true];
        let geometry = Geometry::veiled(&triangles, &veils, Build::Quick);
        // In micrometres: a ray from beyond the mesh rounds once more.
        let hit = |y: f64, up: f64| {
            let ray = super::super::Ray { origin: DVec3::new(0.1, y, 0.2), direction: DVec3::Y * up };
            geometry.closest_hit(&ray).map(|hit| (hit.primitive / 2, (1e6 * hit.distance + 0.5) as u32))
        };
        assert_eq!(hit(0.5, -1.0), Some((0, 500_000)));
        assert_eq!(hit(0.5, 1.0), Some((1, 500_000)));
        assert_eq!(hit(-0.5, -1.0), Some((2, 500_000)));
        assert_eq!(hit(2.0, -1.0), Some((1, 1_000_000)));
        assert_eq!(hit(-2.0, -1.0), None);
        let at = |y: f32| Vec3::new(0.1, y, 0.2);
        assert!(geometry.visible(at(-2.0), at(0.9)) && !geometry.visible(at(0.5), at(1.5)));
        assert_eq!(geometry.triangles(), 6);
        for primitive in 0..6 {
            let corners = triangles[primitive as usize].map(|c| c.as_dvec3());
            assert_eq!(geometry.triangle(primitive), corners);
        }
    }
}
