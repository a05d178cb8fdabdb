//! Every operation gives the same lanes on every path, but for the one rounding that a fused one saves.

use super::*;

/// What is awkward for comparisons, signs and roundings.
const AWKWARD: [f32; 14] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
    f32::MIN_POSITIVE,
    -1e-40,
    f32::MAX,
    f32::MIN,
    0.1,
    16_777_217.0,
    -3.5e-20,
];

/// Every operation on one pair of vectors, lanes as bits; NaN has many, all of them alike here.
struct All {
    a: [f32; 16],
    b: [f32; 16],
    mask: u32,
}

impl All {
    fn of<V: Vector>(&self, load: impl Fn(&[f32; 16]) -> V, store: impl Fn(V) -> Vec<f32>) -> Vec<u32> {
        let (a, b) = (load(&self.a), load(&self.b));
        let made = [
            V::splat(self.a[0]),
            a.add(b),
            a.sub(b),
            a.mul(b),
            a.div(b),
            a.min(b),
            a.max(b),
            a.sqrt(),
            a.abs(),
            a.flip(b),
            a.select(self.mask),
        ];
        let bits = |x: f32| if x.is_nan() { u32::MAX } else { x.to_bits() };
        let mut all: Vec<u32> = made.into_iter().flat_map(&store).map(bits).collect();
        all.extend([a.less(b), b.less(a), a.less(a)]);
        all
    }
}

impl Kernel for &All {
    type Output = Vec<u32>;

    #[inline(always)]
    fn run<I: Isa>(self) -> Vec<u32> {
        let half = |all: &[f32; 16]| *all.first_chunk::<8>().expect("8 of 16");
        let eight = |v: I::Eight| {
            let mut lanes = [0.0; 8];
            v.store(&mut lanes);
            lanes.to_vec()
        };
        let sixteen = |v: I::Sixteen| {
            let mut lanes = [0.0; 16];
            v.store(&mut lanes);
            lanes.to_vec()
        };
        let mut all = self.of(|from| I::Eight::load(&half(from)), eight);
        all.extend(self.of(I::Sixteen::load, sixteen));
        all
    }
}

/// The two products with a sum, of eight and of sixteen lanes.
struct Fused([[f32; 16]; 3]);

impl Kernel for &Fused {
    type Output = [[f32; 16]; 3];

    #[inline(always)]
    fn run<I: Isa>(self) -> [[f32; 16]; 3] {
        let [a, b, c] = [0, 1, 2].map(|i| I::Sixteen::load(&self.0[i]));
        let (mut out, mut low) = ([[0.0; 16]; 3], [0.0; 8]);
        a.mul_add(b, c).store(&mut out[0]);
        a.mul_sub(b, c).store(&mut out[1]);
        let [a, b, c] = [0, 1, 2].map(|i| I::Eight::load(self.0[i].first_chunk().expect("8 of 16")));
        a.mul_add(b, c).store(&mut low);
        out[2][..8].copy_from_slice(&low);
        a.mul_sub(b, c).store(&mut low);
        out[2][8..].copy_from_slice(&low);
        out
    }
}

fn available() -> impl Iterator<Item = Path> {
    Path::ALL.into_iter().filter(|p| p.is_available())
}

/// Numbers of all exponents from a small generator; sometimes an awkward one.
fn numbers(state: &mut u64) -> [f32; 16] {
    [0; 16].map(|_| {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let bits = (*state >> 32) as u32;
        if bits.is_multiple_of(3) { AWKWARD[(*state >> 20) as usize % AWKWARD.len()] } else { f32::from_bits(bits) }
    })
}

#[test]
fn all_operations_give_the_same_lanes_on_all_paths() {
    let mut state = 1;
    for _ in 0..20_000 {
        let all = All { a: numbers(&mut state), b: numbers(&mut state), mask: (state >> 40) as u32 & 0xffff };
        let plain = Path::Scalar.run(&all);
        for path in available() {
            assert_eq!(path.run(&all), plain, "{path:?}: {:?} and {:?}", all.a, all.b);
        }
    }
}

#[test]
fn fused_operations_differ_by_one_rounding_at_most() {
    let mut state = 2;
    let mut next = || numbers(&mut state).map(|x| (x.to_bits() >> 9) as f32 / (1 << 23) as f32 - 0.4);
    for _ in 0..20_000 {
        let fused = Fused([next(), next(), next()]);
        let [a, b, c] = &fused.0;
        for path in available() {
            let out = path.run(&fused);
            for i in 0..16 {
                let product = f64::from(a[i]) * f64::from(b[i]);
                let (sum, difference) = (product + f64::from(c[i]), product - f64::from(c[i]));
                // Each of the product and the result is rounded by less than half a unit of its last place.
                let bound = f64::from(f32::EPSILON) * (product.abs() + sum.abs().max(difference.abs()));
                let eight = if i < 8 { (product, 1.0) } else { (f64::from(a[i - 8]) * f64::from(b[i - 8]), -1.0) };
                let of_eight = eight.0 + eight.1 * f64::from(c[i % 8]);
                assert!((f64::from(out[0][i]) - sum).abs() <= bound, "{path:?}: {a:?} {b:?} {c:?}");
                assert!((f64::from(out[1][i]) - difference).abs() <= bound, "{path:?}: {a:?} {b:?} {c:?}");
                let bound = f64::from(f32::EPSILON) * (eight.0.abs() + of_eight.abs());
                assert!((f64::from(out[2][i]) - of_eight).abs() <= bound, "{path:?}: {a:?} {b:?} {c:?}");
            }
        }
    }
}
