//! (seed, domain, receiver set, index) -> [`Generator`]: every draw is a function of these four, or of a quasi-random
//! point ([`sobol`]) that is a function of seed, batch and place in the batch.
//!
//! A [`Stream`] is the 256-bit key of one domain of one job, hashed by BLAKE3. A generator of the stream is a
//! `Pcg64` whose state and increment are four different bijections of the index under that key, so that no two
//! indices share a state and no counter ever becomes a PCG stream number (physics: docs/method.md, "Random
//! numbers"). Nothing about a generator is ever stored: a history is replayed from its index.

pub mod sobol;
pub mod systematic;

use crate::math::{DVec2, DVec3, PI, sin_cos};
use rand_core::Rng;
use rand_pcg::Pcg64;
use sobol::DIMENSIONS;

/// Unit of the uniform numbers, 2^-53.
const UNIT: f64 = 1.0 / (1u64 << 53) as f64;

/// What a stream of random numbers is for; switching one use on never shifts another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Domain {
    /// Light trajectories; the index is the global index of the trajectory.
    Trajectory,
    /// Sub-pixel positions and which of them carry connections, mirror choices, the choice of lights and area-light samples of one receiver set; the index is
    /// `batch * bins + bin`.
    Receiver,
    /// Trajectories that fix the bound of the kernel before the run; the index is that of the trajectory.
    Pilot,
    /// Receiver-side continuations of one receiver set; the index is `batch * bins + bin`, and 2^60 more for each further receiver of a bin.
    Continuation,
    /// Scrambling of the quasi-random set of a batch; the index is the batch.
    Scrambling,
    /// Which vertices of a batch are connected; the index is the batch.
    Thinning,
    /// Scrambling of the points of emitters that the receivers of one set share; the index is `batch * positions + position`.
    Emitter,
    /// Scrambling of the first directions of receiver-side continuations; the index is theirs.
    Direction,
    /// Which vertices the tiles of one receiver set are connected to; the index is `batch * bins + bin` of the first bin of
    /// those that are scored together.
    Choice,
    /// Paths from the receivers of one receiver set; the index is `batch * bins + bin`.
    Reverse,
    /// Batches that an audit computes again; the index is 0.
    Audit,
}

impl Domain {
    fn tag(self) -> &'static str {
        match self {
            Domain::Trajectory => "lampyris 1 trajectory",
            Domain::Receiver => "lampyris 1 receiver",
            Domain::Pilot => "lampyris 1 pilot",
            Domain::Continuation => "lampyris 1 continuation",
            Domain::Scrambling => "lampyris 1 scrambling",
            Domain::Thinning => "lampyris 1 thinning",
            Domain::Emitter => "lampyris 1 emitter",
            Domain::Direction => "lampyris 1 direction",
            Domain::Choice => "lampyris 1 choice",
            Domain::Reverse => "lampyris 1 reverse",
            Domain::Audit => "lampyris 1 audit",
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
        let pcg = Pcg64::new(word(0) | word(1) << 64, word(2) | word(3) << 64);
        Generator { pcg, point: [0.0; DIMENSIONS], taken: DIMENSIONS }
    }
}

/// Stafford's "Mix13" finaliser, the output function of SplitMix64: a bijection of 64-bit words.
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// Numbered draws of one history or one bin of one batch: first the coordinates of its quasi-random point, if it has
/// one, then the numbers of its Pcg64 from the first on.
///
/// The coordinates of the point of a history go, in this order, to
///
/// ```text
/// choice of the source    1    (none with a single source; every emissive triangle is one)
/// omni, spot, parallel    2    direction, or place in the beam
/// luminaire with extent   2+1+2  direction; face, point of it
/// sky                     2+2  direction; place across it or in an opening
/// emissive triangle       2+2  point, direction; 1 between them for the side, where both sides emit
/// Lambert reflection      2    direction
/// glossy reflection       1+2  part, direction; none for the direction of a mirror
/// ```
///
/// so that they last for emission and three reflections from a single omni, two from an emissive triangle. Where one
/// is left for a pair the pair takes it and a random number. Russian roulette takes none, see [`Generator::chance`]:
/// whether it is played depends on the weight, and would shift all that follow.
#[derive(Clone, Debug)]
pub struct Generator {
    pcg: Pcg64,
    point: [f64; DIMENSIONS],
    /// Coordinates of `point` that have been taken; all of a generator that has no point.
    taken: usize,
}

impl Generator {
    /// The same generator with the coordinates of `point`, at most [`DIMENSIONS`], in front.
    pub fn after<const N: usize>(self, point: [f64; N]) -> Self {
        let mut generator = Generator { taken: DIMENSIONS - N, ..self };
        generator.point[DIMENSIONS - N..].copy_from_slice(&point);
        generator
    }

    /// Uniform in [0, 1), a multiple of 2^-53.
    pub fn uniform(&mut self) -> f64 {
        let Some(&coordinate) = self.point.get(self.taken) else {
            return self.random();
        };
        self.taken += 1;
        coordinate
    }

    /// True with the probability `p`; never takes a coordinate.
    pub fn chance(&mut self, p: f64) -> bool {
        self.random() < p
    }

    /// The next number of the Pcg64, uniform in [0, 1).
    fn random(&mut self) -> f64 {
        (self.word() >> 11) as f64 * UNIT
    }

    /// The next 64 bits of the Pcg64.
    fn word(&mut self) -> u64 {
        self.pcg.next_u64()
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

/// Direction uniform over the sphere, from a point of the unit square. The polar axis is +Y, the vertical of glTF:
/// the first coordinate of a quasi-random point then tells floor from ceiling by itself.
pub fn sphere(u: DVec2) -> DVec3 {
    let d = around_z(1.0 - 2.0 * u.x, u.y);
    DVec3::new(d.y, d.z, d.x)
}

/// Direction of the hemisphere around +Z with density cosine/pi, from a point of the unit square.
pub fn cosine_hemisphere(u: DVec2) -> DVec3 {
    around_z((1.0 - u.x).sqrt(), u.y)
}

/// Point number `k` of a sequence that fills the unit square evenly from the point `start` on: its steps are the inverse powers of
/// the plastic number.
pub fn evenly(start: DVec2, k: u64) -> DVec2 {
    (start + k as f64 * DVec2::new(0.754_877_666_246_692_8, 0.569_840_290_998_053_2)).fract()
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
