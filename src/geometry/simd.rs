//! Vectors of 8 and 16 numbers on whatever instructions the processor has.
//!
//! A [`Kernel`] is written once, over an [`Isa`], and compiled for each: AVX-512, AVX2 with FMA, and plain Rust, which
//! any x86-64 processor runs and which is the twin that tests the others. [`Path::run`] picks the best one, or the one
//! that the environment variable `LAMPYRIS_SIMD` names. Every function between [`Kernel::run`] and an instruction must
//! be `#[inline(always)]`: what is not compiled with the caller's instructions is ten times slower.
//!
//! All vectors give the same lanes for every operation but [`Vector::mul_add`], which is fused where the processor can.
//! So it may only decide what needs no last bit: a conservative test, never a number of a result.

#![allow(unsafe_code, reason = "instructions that the compiler cannot know the processor to have; see `Path::run`")]

use crate::error::{Error, Result};
use std::arch::x86_64::*;
use std::sync::OnceLock;

/// The environment variable that names a [`Path`].
pub const VARIABLE: &str = "LAMPYRIS_SIMD";

/// Instructions that kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Path {
    /// 16 lanes in a register.
    Avx512,
    /// 8 lanes in a register.
    Avx2,
    /// What every x86-64 processor has.
    Scalar,
}

impl Path {
    /// All paths, the fastest first.
    pub const ALL: [Path; 3] = [Path::Avx512, Path::Avx2, Path::Scalar];

    /// Its name in the environment and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Path::Avx512 => "avx512",
            Path::Avx2 => "avx2",
            Path::Scalar => "scalar",
        }
    }

    /// True when this processor has the instructions.
    #[inline]
    pub fn is_available(self) -> bool {
        // The standard library keeps what it detected, but asks for each of ten instructions.
        static AVAILABLE: OnceLock<[bool; 3]> = OnceLock::new();
        AVAILABLE.get_or_init(|| Path::ALL.map(Path::detect))[self as usize]
    }

    fn detect(self) -> bool {
        match self {
            Path::Avx512 => {
                Path::Avx2.detect()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512vl")
            }
            Path::Avx2 => {
                is_x86_feature_detected!("avx2")
                    && is_x86_feature_detected!("fma")
                    && is_x86_feature_detected!("bmi1")
                    && is_x86_feature_detected!("bmi2")
                    && is_x86_feature_detected!("lzcnt")
                    && is_x86_feature_detected!("popcnt")
            }
            Path::Scalar => true,
        }
    }

    /// The path of this process: the one that [`VARIABLE`] names, else the fastest available.
    ///
    /// # Errors
    /// [`Error::Input`] for a name that is none, or of instructions that the processor has not.
    pub fn chosen() -> Result<Path> {
        static CHOSEN: OnceLock<std::result::Result<Path, String>> = OnceLock::new();
        let chosen = CHOSEN.get_or_init(|| match std::env::var_os(VARIABLE) {
            None => Ok(Path::ALL.into_iter().find(|p| p.is_available()).unwrap_or(Path::Scalar)),
            Some(name) => {
                let named = Path::ALL.into_iter().find(|p| name == p.name() && p.is_available());
                named.ok_or_else(|| name.to_string_lossy().into_owned())
            }
        });
        chosen.clone().map_err(|name| {
            let available = Path::ALL.into_iter().filter(|p| p.is_available()).map(Path::name);
            let allowed = format!("what this processor has: {}", available.collect::<Vec<_>>().join(", "));
            Error::input("environment", VARIABLE, name, allowed)
        })
    }

    /// The path for kernels without vectors of sixteen, which gain nothing from AVX-512.
    pub fn for_eights(self) -> Path {
        if self == Path::Avx512 { Path::Avx2 } else { self }
    }

    /// Runs `kernel` compiled for these instructions.
    ///
    /// # Panics
    /// Where the processor has not the instructions.
    #[inline]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            // SAFETY: the assertions say that the processor has the instructions; asking again costs a load.
            Path::Avx512 => {
                assert!(self.is_available(), "no AVX-512 here");
                unsafe { run_avx512(kernel) }
            }
            Path::Avx2 => {
                assert!(self.is_available(), "no AVX2 here");
                unsafe { run_avx2(kernel) }
            }
            Path::Scalar => run_scalar(kernel),
        }
    }
}

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Avx512>()
}

#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Avx2>()
}

/// Asks for the memory of `what`, which is wanted soon.
#[inline(always)]
pub(super) fn prefetch<T>(what: &T) {
    for line in (0..size_of::<T>()).step_by(64) {
        // SAFETY: nothing is read, and every processor of this kind has the instruction.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(what).cast::<i8>().add(line)) }
    }
}

/// Not inlined, as the others cannot be: what calls a kernel stays small.
#[inline(never)]
fn run_scalar<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Scalar>()
}

/// A computation that is compiled for every [`Isa`].
pub trait Kernel {
    /// What it gives.
    type Output;
    /// The computation; `#[inline(always)]` in every implementation.
    fn run<I: Isa>(self) -> Self::Output;
}

/// A set of instructions, by its vectors.
pub trait Isa: Copy {
    /// Eight numbers.
    type Eight: Vector<Array = [f32; 8]>;
    /// Sixteen numbers.
    type Sixteen: Vector<Array = [f32; 16]>;
}

/// Lanes of f32. Only a [`Kernel`] makes them, so the processor has their instructions.
pub trait Vector: Copy {
    /// The lanes in memory.
    type Array;
    /// The same number in every lane.
    fn splat(x: f32) -> Self;
    /// From memory.
    fn load(from: &Self::Array) -> Self;
    /// To memory.
    fn store(self, to: &mut Self::Array);
    /// self + other.
    fn add(self, other: Self) -> Self;
    /// self - other.
    fn sub(self, other: Self) -> Self;
    /// self x other.
    fn mul(self, other: Self) -> Self;
    /// self / other.
    fn div(self, other: Self) -> Self;
    /// The lesser; `other` where one is NaN.
    fn min(self, other: Self) -> Self;
    /// The greater; `other` where one is NaN.
    fn max(self, other: Self) -> Self;
    /// self x factor + term, rounded once or twice.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// self x factor - term, rounded once or twice.
    fn mul_sub(self, factor: Self, term: Self) -> Self;
    /// Magnitudes.
    fn abs(self) -> Self;
    /// Negated where the sign bit of `sign` is set.
    fn flip(self, sign: Self) -> Self;
    /// Bit i: lane i is less than that of `other`; NaN is not.
    fn less(self, other: Self) -> u32;
    /// The lanes whose bits are set in `mask`, 0 elsewhere.
    fn select(self, mask: u32) -> Self;
}

/// AVX-512 for 16 lanes, AVX2 for 8.
#[derive(Clone, Copy)]
pub struct Avx512;
/// AVX2 with FMA.
#[derive(Clone, Copy)]
pub struct Avx2;
/// Plain Rust.
#[derive(Clone, Copy)]
pub struct Scalar;

impl Isa for Avx512 {
    type Eight = Ymm;
    type Sixteen = Zmm;
}

impl Isa for Avx2 {
    type Eight = Ymm;
    type Sixteen = Pair;
}

impl Isa for Scalar {
    type Eight = Plain<8>;
    type Sixteen = Plain<16>;
}

/// Eight lanes of AVX2.
#[derive(Clone, Copy)]
pub struct Ymm(__m256);

// SAFETY, here and below: a vector exists inside a kernel alone, where the processor has its instructions; loads and stores
// are those of whole arrays.
impl Vector for Ymm {
    type Array = [f32; 8];

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Ymm(unsafe { _mm256_set1_ps(x) })
    }

    #[inline(always)]
    fn load(from: &[f32; 8]) -> Self {
        Ymm(unsafe { _mm256_loadu_ps(from.as_ptr()) })
    }

    #[inline(always)]
    fn store(self, to: &mut [f32; 8]) {
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), self.0) }
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Ymm(unsafe { _mm256_add_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Ymm(unsafe { _mm256_sub_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Ymm(unsafe { _mm256_mul_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Ymm(unsafe { _mm256_div_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Ymm(unsafe { _mm256_min_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Ymm(unsafe { _mm256_max_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        Ymm(unsafe { _mm256_fmadd_ps(self.0, factor.0, term.0) })
    }

    #[inline(always)]
    fn mul_sub(self, factor: Self, term: Self) -> Self {
        Ymm(unsafe { _mm256_fmsub_ps(self.0, factor.0, term.0) })
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Ymm(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
    }

    #[inline(always)]
    fn flip(self, sign: Self) -> Self {
        Ymm(unsafe { _mm256_xor_ps(self.0, _mm256_and_ps(_mm256_set1_ps(-0.0), sign.0)) })
    }

    #[inline(always)]
    fn less(self, other: Self) -> u32 {
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0)) as u32 }
    }

    #[inline(always)]
    fn select(self, mask: u32) -> Self {
        unsafe {
            let bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let set = _mm256_and_si256(_mm256_set1_epi32(mask as i32), bits);
            Ymm(_mm256_and_ps(self.0, _mm256_castsi256_ps(_mm256_cmpeq_epi32(set, bits))))
        }
    }
}

/// Sixteen lanes of AVX-512.
#[derive(Clone, Copy)]
pub struct Zmm(__m512);

impl Vector for Zmm {
    type Array = [f32; 16];

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Zmm(unsafe { _mm512_set1_ps(x) })
    }

    #[inline(always)]
    fn load(from: &[f32; 16]) -> Self {
        Zmm(unsafe { _mm512_loadu_ps(from.as_ptr()) })
    }

    #[inline(always)]
    fn store(self, to: &mut [f32; 16]) {
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), self.0) }
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Zmm(unsafe { _mm512_add_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Zmm(unsafe { _mm512_sub_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Zmm(unsafe { _mm512_mul_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Zmm(unsafe { _mm512_div_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Zmm(unsafe { _mm512_min_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Zmm(unsafe { _mm512_max_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        Zmm(unsafe { _mm512_fmadd_ps(self.0, factor.0, term.0) })
    }

    #[inline(always)]
    fn mul_sub(self, factor: Self, term: Self) -> Self {
        Zmm(unsafe { _mm512_fmsub_ps(self.0, factor.0, term.0) })
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Zmm(unsafe { _mm512_abs_ps(self.0) })
    }

    #[inline(always)]
    fn flip(self, sign: Self) -> Self {
        Zmm(unsafe { _mm512_xor_ps(self.0, _mm512_and_ps(_mm512_set1_ps(-0.0), sign.0)) })
    }

    #[inline(always)]
    fn less(self, other: Self) -> u32 {
        unsafe { u32::from(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0)) }
    }

    #[inline(always)]
    fn select(self, mask: u32) -> Self {
        Zmm(unsafe { _mm512_maskz_mov_ps(mask as u16, self.0) })
    }
}

/// Sixteen lanes in two registers of AVX2.
#[derive(Clone, Copy)]
pub struct Pair(Ymm, Ymm);

impl Pair {
    #[inline(always)]
    fn halves(array: &[f32; 16]) -> (&[f32; 8], &[f32; 8]) {
        let (low, high) = array.split_first_chunk().expect("8 of 16");
        (low, high.first_chunk().expect("8 more"))
    }
}

impl Vector for Pair {
    type Array = [f32; 16];

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Pair(Ymm::splat(x), Ymm::splat(x))
    }

    #[inline(always)]
    fn load(from: &[f32; 16]) -> Self {
        let (low, high) = Pair::halves(from);
        Pair(Ymm::load(low), Ymm::load(high))
    }

    #[inline(always)]
    fn store(self, to: &mut [f32; 16]) {
        let (low, high) = to.split_first_chunk_mut().expect("8 of 16");
        self.0.store(low);
        self.1.store(high.first_chunk_mut().expect("8 more"));
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Pair(self.0.add(other.0), self.1.add(other.1))
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Pair(self.0.sub(other.0), self.1.sub(other.1))
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Pair(self.0.mul(other.0), self.1.mul(other.1))
    }

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Pair(self.0.div(other.0), self.1.div(other.1))
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Pair(self.0.min(other.0), self.1.min(other.1))
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Pair(self.0.max(other.0), self.1.max(other.1))
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        Pair(self.0.mul_add(factor.0, term.0), self.1.mul_add(factor.1, term.1))
    }

    #[inline(always)]
    fn mul_sub(self, factor: Self, term: Self) -> Self {
        Pair(self.0.mul_sub(factor.0, term.0), self.1.mul_sub(factor.1, term.1))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Pair(self.0.abs(), self.1.abs())
    }

    #[inline(always)]
    fn flip(self, sign: Self) -> Self {
        Pair(self.0.flip(sign.0), self.1.flip(sign.1))
    }

    #[inline(always)]
    fn less(self, other: Self) -> u32 {
        self.0.less(other.0) | self.1.less(other.1) << 8
    }

    #[inline(always)]
    fn select(self, mask: u32) -> Self {
        Pair(self.0.select(mask & 0xff), self.1.select(mask >> 8))
    }
}

/// Lanes of plain Rust.
#[derive(Clone, Copy)]
pub struct Plain<const N: usize>([f32; N]);

impl<const N: usize> Plain<N> {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let mut lanes = [0.0; N];
        for (i, lane) in lanes.iter_mut().enumerate() {
            *lane = f(self.0[i], other.0[i]);
        }
        Plain(lanes)
    }
}

impl<const N: usize> Vector for Plain<N> {
    type Array = [f32; N];

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Plain([x; N])
    }

    #[inline(always)]
    fn load(from: &[f32; N]) -> Self {
        Plain(*from)
    }

    #[inline(always)]
    fn store(self, to: &mut [f32; N]) {
        *to = self.0;
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self.mul(factor).add(term)
    }

    #[inline(always)]
    fn mul_sub(self, factor: Self, term: Self) -> Self {
        self.mul(factor).sub(term)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.zip(self, |a, _| a.abs())
    }

    #[inline(always)]
    fn flip(self, sign: Self) -> Self {
        self.zip(sign, |a, s| f32::from_bits(a.to_bits() ^ (s.to_bits() & (-0f32).to_bits())))
    }

    #[inline(always)]
    fn less(self, other: Self) -> u32 {
        (0..N).map(|i| u32::from(self.0[i] < other.0[i]) << i).sum()
    }

    #[inline(always)]
    fn select(self, mask: u32) -> Self {
        let mut lanes = self.0;
        for (i, lane) in lanes.iter_mut().enumerate() {
            *lane = f32::from_bits(lane.to_bits() & 0u32.wrapping_sub(mask >> i & 1));
        }
        Plain(lanes)
    }
}
