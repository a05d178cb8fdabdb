//! The bounds of the roundings against an adversary: a search that climbs towards the largest error, and towards decisions that
//! f64 contradicts.

use super::super::mesh::Triangle;
use super::*;
use crate::geometry::simd::{Kernel, Path};
use crate::math::DVec3;

/// Random bits of its own: geometry knows nothing of the generators above it.
struct Numbers(u64);

impl Numbers {
    fn bits(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 32) as u32
    }

    fn below(&mut self, n: u32) -> usize {
        (self.bits() % n) as usize
    }

    /// In [-1, 1).
    fn signed(&mut self) -> f32 {
        (self.bits() >> 8) as f32 / (1 << 23) as f32 - 1.0
    }
}

/// An apex, a triangle and a direction.
#[derive(Clone, Copy, Debug)]
struct Case {
    apex: Vec3,
    corners: [Vec3; 3],
    d: Vec3,
}

impl Case {
    fn random(n: &mut Numbers) -> Case {
        let size = [1.0, 0.1, 1e-3][n.below(3)];
        let mut vector = |size: f32| size * Vec3::new(n.signed(), n.signed(), n.signed());
        let (apex, a) = (vector(1.0), vector(1.0));
        let corners = [a, a + vector(size), a + vector(size)];
        Case { apex, corners, d: (a - apex) * 1.5 + vector(1.5 * size) }
    }

    /// One coordinate changed: by a few last bits, or by much.
    fn changed(mut self, n: &mut Numbers) -> Case {
        let vector = match n.below(5) {
            0 => &mut self.apex,
            1 => &mut self.d,
            i => &mut self.corners[i - 2],
        };
        let axis = n.below(3);
        let step = n.below(24);
        vector[axis] = match n.below(3) {
            0 => f32::from_bits(vector[axis].to_bits() ^ (n.bits() & ((1 << step) - 1))),
            1 => vector[axis] * (1.0 + 0.1 * n.signed()),
            _ => vector[axis] + n.signed() * f32::from_bits((127 - step as u32) << 23),
        };
        self
    }

    fn extent(&self) -> Extent {
        let [a, b, c] = self.corners.map(|p| p - self.apex);
        let size = a.abs().max(b.abs()).max(c.abs()).max_element();
        let edge = (b - a).abs().max((c - b).abs()).max((a - c).abs()).max_element();
        Extent { far: a.length().max(b.length()).max(c.length()), size, edge }
    }
}

/// How far off f32 is, in units of the tolerances: of the edges in u M L S, of the face in u (|a| + |d|).
#[derive(Clone, Copy, Debug, Default)]
struct Errors {
    edge: f64,
    face: f64,
}

/// A case in f32: its errors, and whether a decision contradicts f64.
struct Judge(Case);

impl Kernel for Judge {
    type Output = (Errors, bool);

    #[inline(always)]
    fn run<I: Isa>(self) -> (Errors, bool) {
        let Case { apex, corners, d } = self.0;
        let directions = Directions::new(d.to_array(), d.to_array());
        let extent = self.0.extent();
        let block = Block::new(&[corners]);
        let planes = Planes::<I>::new(&block, apex.to_array(), extent, &directions, 0.0);
        let mut rows = Rows::default();
        planes.store(&mut rows);
        let ray = [I::Sixteen::splat(d.x), I::Sixteen::splat(d.y), I::Sixteen::splat(d.z)];
        let single = rows.test::<I>(0, &ray);
        let (against, alone) = (planes.against(&directions), planes.test(d.to_array()));
        let hit = single.hit | alone.hit | against.cover;
        let miss = single.miss | alone.miss | !against.may | !planes.toward(&directions);
        let crosses = Triangle::new(corners).crosses(apex.as_dvec3(), d.as_dvec3());
        let contradicted = if crosses { miss & 1 == 1 } else { hit & 1 == 1 };
        (errors::<I>(&self.0, &rows, &ray), contradicted)
    }
}

#[inline(always)]
fn errors<I: Isa>(case: &Case, rows: &Rows, ray: &[I::Sixteen; 3]) -> Errors {
    let value = |normals: &[[f32; WIDTH]; 3]| {
        let mut lanes = [0.0; 16];
        along::<I>(normals, 0, ray).store(&mut lanes);
        f64::from(lanes[0])
    };
    let (o, d) = (case.apex.as_dvec3(), case.d.as_dvec3());
    let [a, b, c] = case.corners.map(|p| p.as_dvec3() - o);
    let normal = (b - a).cross(c - a).normalize();
    let exact_volume = normal.dot(a);
    let sign = if exact_volume < 0.0 { -1.0 } else { 1.0 };
    let Extent { far, size, edge } = case.extent();
    let unit = f64::from(U) * f64::from(size) * f64::from(edge) * d.abs().element_sum();
    let exact = [b.cross(c), c.cross(a), a.cross(b)].map(|n| 2.0 * sign * d.dot(n));
    let edges = (0..3).map(|k| (value(&rows.edges[k]) - exact[k]).abs() / unit);
    let face =
        (value(&rows.face) - sign * normal.dot(d)).abs() + (f64::from(rows.volume[0]) - exact_volume.abs()).abs();
    let face = face / (f64::from(U) * (f64::from(far) + d.length()));
    // Where the sign of V is in doubt, or the triangle has no area, nothing is decided.
    if rows.doubtful & 1 == 1 || !normal.is_finite() {
        return Errors::default();
    }
    Errors { edge: edges.fold(0.0, f64::max), face }
}

/// Climbs from many random cases towards larger values of `aim`; the largest errors met.
fn search(path: Path, climbs: u64, aim: impl Fn(Errors) -> f64) -> Errors {
    let mut most = Errors::default();
    for climb in 0..climbs {
        let n = &mut Numbers(climb);
        let mut case = Case::random(n);
        let mut best = 0.0;
        for _ in 0..2000 {
            let next = case.changed(n);
            let (errors, contradicted) = path.run(Judge(next));
            assert!(!contradicted, "{path:?} contradicts f64: {next:?}");
            if aim(errors) >= best {
                (case, best) = (next, aim(errors));
            }
            most = Errors { edge: most.edge.max(errors.edge), face: most.face.max(errors.face) };
        }
    }
    most
}

#[test]
fn an_adversary_finds_no_error_beyond_the_bounds() {
    for path in Path::ALL.into_iter().filter(|p| p.is_available()) {
        let edge = search(path, 40, |e| e.edge).edge;
        let face = search(path, 40, |e| e.face).face;
        assert!(edge > 6.0 && edge <= 32.0, "{path:?}: {edge}");
        assert!(face > 1.0 && face <= 5.0, "{path:?}: {face}");
    }
}

/// Decisions near their thresholds: the direction is steered to where the ray grazes an edge or ends at the face.
#[test]
fn no_decision_contradicts_f64() {
    let n = &mut Numbers(7);
    for i in 0..300_000u32 {
        let mut case = Case::random(n);
        let [a, b, c] = case.corners;
        let u = 0.5 + 0.5 * n.signed();
        let on = [a, a + u * (b - a), c + u * (b - c), a + 0.5 * u * (b - a) + 0.3 * (c - a)][n.below(4)];
        let past = [0.0, 1e-7, -1e-7, 1e-5, 0.5][n.below(5)];
        case.d = (on - case.apex) * (1.0 + past);
        for _ in 0..n.below(4) {
            case = case.changed(n);
        }
        for path in Path::ALL.into_iter().filter(|p| p.is_available()) {
            let (_, contradicted) = path.run(Judge(case));
            assert!(!contradicted, "{i}, {path:?} contradicts f64: {case:?}");
        }
    }
}

/// A box of directions is decided as all of its directions are.
#[test]
fn boxes_of_directions_are_decided_as_their_corners() {
    struct Boxes(Case, Vec3);
    impl Kernel for Boxes {
        type Output = Against;

        #[inline(always)]
        fn run<I: Isa>(self) -> Against {
            let Boxes(case, half) = self;
            let directions = Directions::new((case.d - half).to_array(), (case.d + half).to_array());
            Planes::<I>::new(&Block::new(&[case.corners]), case.apex.to_array(), case.extent(), &directions, 0.0)
                .against(&directions)
        }
    }
    let n = &mut Numbers(11);
    let (mut covered, mut missed) = (0, 0);
    for _ in 0..100_000 {
        let case = Case::random(n);
        let size = [1e-7, 1e-4, 1e-2][n.below(3)];
        let half = size * Vec3::new(n.signed(), n.signed(), n.signed()).abs();
        let triangle = Triangle::new(case.corners);
        let corner = |i: u32| {
            let side = |axis: usize| if i >> axis & 1 == 1 { half[axis] } else { -half[axis] };
            triangle.crosses(case.apex.as_dvec3(), (case.d + Vec3::new(side(0), side(1), side(2))).as_dvec3())
        };
        let crossing = (0..8).filter(|&i| corner(i)).count();
        for path in Path::ALL.into_iter().filter(|p| p.is_available()) {
            let against = path.run(Boxes(case, half));
            assert!(against.cover & 1 == 0 || crossing == 8, "{path:?}: {case:?} {half}");
            assert!(against.may & 1 == 1 || crossing == 0, "{path:?}: {case:?} {half}");
            covered += against.cover & 1;
            missed += !against.may & 1;
        }
    }
    assert!(covered > 1000 && missed > 1000, "{covered} covered, {missed} missed");
}

#[test]
fn triangles_without_area_are_left_to_f64() {
    let case = Case { apex: Vec3::ZERO, corners: [Vec3::ONE, 2.0 * Vec3::ONE, 3.0 * Vec3::ONE], d: Vec3::ONE };
    let (errors, contradicted) = Path::Scalar.run(Judge(case));
    assert!(errors.edge == 0.0 && !contradicted && !Triangle::new(case.corners).crosses(DVec3::ZERO, DVec3::ONE));
}
