//! The random numbers: first outputs pinned by constants, and independence of histories a fixed lag apart, by a test
//! that rejects the seedings one must not use.

use lampyris::random::{Domain, Stream};
use rand_core::Rng;
use rand_pcg::Pcg64;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Cells along one side of the square of pairs.
const CELLS: usize = 16;
/// Pairs of one test: 1024 expected in each cell.
const PAIRS: u64 = 1 << 18;
/// Lags between two histories: neighbours, and powers of two, at which counters correlate.
const LAGS: [u64; 6] = [1, 2, 1 << 10, 1 << 12, 1 << 16, 1 << 32];
/// Of each history this many first draws are tested, each against the same draw of the other history.
const DRAWS: usize = 2;
/// Probability that a good generator fails in one lag and draw.
const LEVEL: f64 = 1e-6;

#[test]
fn first_draws_are_the_stored_ones() {
    // A change here changes every number of every job: raise NUMERICS with it.
    let draws = |seed, domain, set, index| {
        let mut g = Stream::new(seed, domain, set).generator(index);
        [g.uniform(), g.uniform(), g.uniform()].map(f64::to_bits)
    };
    let now = [
        draws(1, Domain::Trajectory, "", 0),
        draws(1, Domain::Trajectory, "", 1),
        draws(1, Domain::Trajectory, "", u64::MAX),
        draws((1 << 63) - 1, Domain::Trajectory, "", 0),
        draws(1, Domain::Receiver, "", 0),
        draws(1, Domain::Receiver, "view", 0),
    ];
    const STORED: [[u64; 3]; 6] = [
        [0x3fe6_6900_adbd_c995, 0x3fe9_1ab5_1fee_0f99, 0x3fe0_0ccc_8eb8_49c5],
        [0x3fca_3dfd_5625_8970, 0x3fec_391c_96d8_71c6, 0x3fcf_80c3_beca_dc30],
        [0x3fd7_c022_4e74_ded0, 0x3fe0_3042_b558_fd61, 0x3fcd_7501_e9c1_f8d4],
        [0x3fea_a822_32ae_14de, 0x3fdc_44c8_668b_2096, 0x3fee_fef4_d900_b373],
        [0x3fde_c49e_4a29_3292, 0x3feb_5293_c141_ee6e, 0x3fdc_5d11_b587_b100],
        [0x3fb2_a5f4_07a7_1538, 0x3fd5_d5e5_abe4_3fbc, 0x3fce_1d91_5b3b_e62c],
    ];
    assert!(now == STORED, "{now:#x?}");
}

/// Chi-square of pairs (draw number `k` of history i, the same of history i + lag) in cells of equal probability.
fn chi_square(draw: impl Fn(u64, usize) -> f64, k: usize, lag: u64) -> f64 {
    let cell = |i| (draw(i, k) * CELLS as f64) as usize;
    let mut counts = [0u64; CELLS * CELLS];
    (0..PAIRS).for_each(|i| counts[CELLS * cell(i) + cell(i + lag)] += 1);
    let expected = PAIRS as f64 / counts.len() as f64;
    counts.iter().map(|&n| (n as f64 - expected) * (n as f64 - expected) / expected).sum()
}

/// The largest statistic over all lags and draws.
fn worst(draw: impl Fn(u64, usize) -> f64) -> f64 {
    let of_lag = |&lag: &u64| (0..DRAWS).map(|k| chi_square(&draw, k, lag)).fold(0.0, f64::max);
    LAGS.iter().map(of_lag).fold(0.0, f64::max)
}

/// What one statistic of a good generator exceeds with probability [`LEVEL`].
fn bound() -> f64 {
    ChiSquared::new((CELLS * CELLS - 1) as f64).unwrap().inverse_cdf(1.0 - LEVEL)
}

#[test]
fn histories_a_lag_apart_are_independent() {
    let streams = [
        Stream::new(1, Domain::Trajectory, ""),
        Stream::new(2, Domain::Trajectory, ""),
        Stream::new((1 << 63) - 1, Domain::Trajectory, ""),
        Stream::new(1, Domain::Receiver, "view"),
    ];
    for (s, stream) in streams.iter().enumerate() {
        let draw = |i, k| {
            let mut g = stream.generator(i);
            for _ in 0..k {
                g.uniform();
            }
            g.uniform()
        };
        let worst = worst(draw);
        println!("stream {s}: {worst} of {}", bound());
        assert!(worst <= bound(), "stream {s}: {worst} > {}", bound());
    }
}

fn uniform(mut pcg: Pcg64, k: usize) -> f64 {
    for _ in 0..k {
        pcg.next_u64();
    }
    (pcg.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}

#[test]
fn seedings_that_count_are_rejected() {
    const STATE: u128 = 0xcafe_f00d_d15e_a5e5;
    let jump = |i: u64| {
        let mut pcg = Pcg64::new(STATE, 0x0a02_bdbf_7bb3_c0a7);
        pcg.advance(u128::from(i) << 64);
        pcg
    };
    let bad: [(&str, &dyn Fn(u64) -> Pcg64); 4] = [
        ("index as stream number", &|i| Pcg64::new(STATE, u128::from(i))),
        ("index << 64 as stream number", &|i| Pcg64::new(STATE, u128::from(i) << 64)),
        ("index as state", &|i| Pcg64::new(u128::from(i), STATE)),
        ("jumps of 2^64", &jump),
    ];
    for (name, generator) in bad {
        let worst = worst(|i, k| uniform(generator(i), k));
        println!("{name}: {worst} of {}", bound());
        assert!(worst > bound(), "{name}: accepted, {worst} <= {}", bound());
    }
}
