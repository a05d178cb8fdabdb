//! (seed, domain, receiver set, index) -> [`Generator`]: every draw is a function of these four.
//!
//! A [`Stream`] is the 256-bit key of one domain of one job, hashed by BLAKE3. A generator of the stream is a
//! `Pcg64` whose state and increment are four different bijections of the index under that key, so that no two
//! indices share a state and no counter ever becomes a PCG stream number (physics: docs/method.md, "Random
//! numbers"). Nothing about a generator is ever stored: a history is replayed from its index.

use crate::math::{DVec2, DVec3, PI, sin_cos};
use rand_core::Rng;
use rand_pcg::Pcg64;

/// What a stream of random numbers is for; switching one use on never shifts another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Domain {
    /// Light trajectories; the index is the global index of the history.
    Trajectory,
    /// Sub-pixel positions, mirror choices and area-light samples of one receiver set; the index is
    /// `batch * bins + bin`.
    Receiver,
    /// Trajectories that fix the bound of the kernel before the run; the index is that of the trajectory.
    Pilot,
    /// Receiver-side continuations of one receiver set; the index is `batch * bins + bin`.
    Continuation,
    /// Scrambling of the quasi-random set of a batch; the index is the batch.
    Scrambling,
    /// Paths from the receivers of one receiver set; the index is `batch * bins + bin`.
    Reverse,
}

impl Domain {
    fn tag(self) -> &'static str {
        match self {
            Domain::Trajectory => "lampyris 1 trajectory",
            Domain::Receiver => "lampyris 1 receiver",
            Domain::Pilot => "lampyris 1 pilot",
            Domain::Continuation => "lampyris 1 continuation",
            Domain::Scrambling => "lampyris 1 scrambling",
            Domain::Reverse => "lampyris 1 reverse",
        }
    }
}

/// All generators of one domain of one job (and of one receiver set where the domain has sets).
#[derive(Clone, Debug)]
pub struct Stream {
    key: [u64; 4],
}

impl Stream {
    /// The stream of `domain` for the job's `seed`; `set` names the receiver set, or is empty.
    pub fn new(seed: u64, domain: Domain, set: &str) -> Self {
        let mut hasher = blake3::Hasher::new_derive_key(domain.tag());
        hasher.update(&seed.to_le_bytes()).update(set.as_bytes());
        let hash = hasher.finalize();
        let word = |i: usize| {
            let bytes = hash.as_bytes()[8 * i..8 * i + 8].try_into();
            u64::from_le_bytes(bytes.expect("a slice of eight bytes"))
        };
        Stream { key: [word(0), word(1), word(2), word(3)] }
    }

    /// The generator number `index` of this stream.
    pub fn generator(&self, index: u64) -> Generator {
        let word = |i: usize| u128::from(mix(mix(index ^ self.key[i]).wrapping_add(self.key[(i + 1) % 4])));
        Generator { pcg: Pcg64::new(word(0) | word(1) << 64, word(2) | word(3) << 64) }
    }
}

/// Stafford's "Mix13" finaliser, the output function of SplitMix64: a bijection of 64-bit words.
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// Numbered draws of one history or one bin of one batch.
#[derive(Clone, Debug)]
pub struct Generator {
    pcg: Pcg64,
}

impl Generator {
    /// Uniform in [0, 1), a multiple of 2^-53.
    pub fn uniform(&mut self) -> f64 {
        (self.pcg.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Uniform in the unit square.
    pub fn uniform2(&mut self) -> DVec2 {
        let x = self.uniform();
        DVec2::new(x, self.uniform())
    }

    /// Uniform integer in `0..n`.
    pub fn below(&mut self, n: u32) -> u32 {
        // The product is below n: uniform() is at most 1 - 2^-53 and n is exact in f64.
        (self.uniform() * f64::from(n)) as u32
    }
}

/// Direction uniform over the sphere, from a point of the unit square.
pub fn sphere(u: DVec2) -> DVec3 {
    let z = 1.0 - 2.0 * u.x;
    around_z(z, u.y)
}

/// Direction of the hemisphere around +Z with density cosine/pi, from a point of the unit square.
pub fn cosine_hemisphere(u: DVec2) -> DVec3 {
    around_z((1.0 - u.x).sqrt(), u.y)
}

/// Point of the unit disc, uniform in area, from a point of the unit square.
pub fn disc(u: DVec2) -> DVec2 {
    let (sin, cos) = sin_cos(2.0 * PI * u.y);
    u.x.sqrt() * DVec2::new(cos, sin)
}

/// The unit vector with third coordinate `z` at the azimuth 2 pi `turn`.
pub fn around_z(z: f64, turn: f64) -> DVec3 {
    let s = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = sin_cos(2.0 * PI * turn);
    DVec3::new(s * cos, s * sin, z)
}
