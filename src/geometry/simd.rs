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

pub mod exact;
mod plain;
mod wide;

use crate::error::{Error, Result};
use plain::Plain;
use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
use std::sync::OnceLock;
use wide::{Pair, Ymm, Zmm};

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

/// Asks for all of `what` before it is needed.
#[inline(always)]
pub(super) fn prefetch<T>(what: &T) {
    for line in 0..size_of::<T>().div_ceil(64) {
        // SAFETY: a prefetch reads nothing; SSE is part of every x86-64 processor.
        unsafe { _mm_prefetch::<_MM_HINT_T0>((what as *const T).cast::<i8>().wrapping_add(64 * line)) }
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
    /// Square roots, correctly rounded; NaN of negative numbers.
    fn sqrt(self) -> Self;
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

#[cfg(test)]
mod tests;
