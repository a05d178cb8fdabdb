//! The quasi-random sets: Sobol's points against another implementation, what scrambling must keep and what it must
//! make random, which draw takes which coordinate, and that no error bar comes from inside a set.

mod common;

use common::scenes::{add_quad, lambert, point, sobolev};
use common::{Case, Estimate, number, table};
use lampyris::math::{DVec3, PI};
use lampyris::random::sobol::{DIMENSIONS, PointSet, sobol as plain};
use lampyris::random::{Domain, Generator, Stream};
use lampyris::scene::Model;
use lampyris::tally::statistics::student_quantile;
use lampyris::transport::trajectory::{Vertex, trace};
use statrs::distribution::{Binomial, ChiSquared, ContinuousCDF, DiscreteCDF};

/// Probability that a right program fails one comparison.
const LEVEL: f64 = 1e-6;

const TWO_32: f64 = (1u64 << 32) as f64;

fn square(x: f64) -> f64 {
    x * x
}

fn scrambling(seed: u64) -> Stream {
    Stream::new(seed, Domain::Scrambling, "")
}

/// Points of set number `batch`, 2^m of them.
fn scrambled(seed: u64, batch: u64, m: u32) -> Vec<[f64; DIMENSIONS]> {
    let set = PointSet::new(&scrambling(seed), batch, m);
    (0..1 << m).map(|i| set.point(i)).collect()
}

#[test]
fn unscrambled_points_are_those_of_scipy() {
    // scipy 1.17.1: qmc.Sobol(8, scramble=False, bits=32).random(1024), times 1024.
    const SCIPY: [(u32, [u32; DIMENSIONS]); 7] = [
        (0, [0, 0, 0, 0, 0, 0, 0, 0]),
        (1, [512, 512, 512, 512, 512, 512, 512, 512]),
        (2, [768, 256, 256, 256, 768, 768, 256, 768]),
        (3, [256, 768, 768, 768, 256, 256, 768, 256]),
        (7, [128, 640, 384, 128, 128, 384, 640, 640]),
        (100, [424, 264, 792, 744, 904, 760, 24, 488]),
        (1023, [1, 771, 627, 149, 191, 449, 143, 633]),
    ];
    for (i, expected) in SCIPY {
        assert_eq!(plain(i), expected.map(|x| x << 22), "point {i}");
    }
    // And one that needs the later of the 32 directions: the columns of its matrix `_sv` by the Gray code.
    const LATE: [u32; DIMENSIONS] =
        [0x2414_0001, 0xafc3_ffff, 0x6c0c_5555, 0x56d9_0093, 0xd379_db9d, 0xcfaf_bbbb, 0x6084_4477, 0x1a67_9641];
    assert_eq!(plain(u32::MAX - 12344), LATE);
}

#[test]
fn first_scrambled_points_are_the_stored_ones() {
    // A change here changes every number of every job: raise NUMERICS with it.
    let bits = |seed, batch, m, i| PointSet::new(&scrambling(seed), batch, m).point(i).map(f64::to_bits);
    let now = [bits(1, 0, 11, 0), bits(1, 0, 11, 1), bits(1, 7, 11, 1), bits(2, 0, 20, 1_000_000)];
    const STORED: [[u64; DIMENSIONS]; 4] = [
        [
            0x3fcc_6087_de1d_d598,
            0x3fe9_ff62_09ea_286c,
            0x3fe0_7bf8_6374_9b09,
            0x3fe2_3c49_e48b_c288,
            0x3fd5_dc88_6180_f21c,
            0x3fd3_4fe2_c464_3140,
            0x3fe3_084b_fc45_5409,
            0x3fea_8b88_1a6f_c43b,
        ],
        [
            0x3fec_4ff1_fa0d_45fb,
            0x3fcf_aa8a_8e24_1674,
            0x3fd7_852b_ae3e_d998,
            0x3faf_afab_b37d_dcf0,
            0x3fee_5ba7_ec58_b3d5,
            0x3fea_be38_2832_333d,
            0x3fc1_3418_a51f_5e60,
            0x3fc9_093d_4b89_0ae8,
        ],
        [
            0x3f8b_904d_2bd4_5200,
            0x3fe6_18dd_bb19_a51a,
            0x3feb_b113_7e6c_ff95,
            0x3fd3_d4ab_3a47_b450,
            0x3fe5_4d39_5893_3e31,
            0x3fe8_cc77_1065_860b,
            0x3fde_049d_102d_77e6,
            0x3fea_b64c_38e8_b4bc,
        ],
        [
            0x3fda_326a_81fb_3626,
            0x3fd7_87fa_9245_30f2,
            0x3fc6_6e5b_d6ae_6870,
            0x3fdc_4d69_d96f_d2bc,
            0x3fe9_6e0a_06a4_53f3,
            0x3fe1_9743_e05e_7599,
            0x3fd5_bb00_2719_8da0,
            0x3fd2_ed3b_9754_acde,
        ],
    ];
    assert!(now == STORED, "{now:#x?}");
}

/// True when every box of 2^-a x 2^-b holds the same number of the points.
fn balanced(points: &[[f64; 2]], a: u32, b: u32) -> bool {
    let mut counts = vec![0usize; 1 << (a + b)];
    for [x, y] in points {
        let (column, row) = ((x * f64::from(1 << a)) as usize, (y * f64::from(1 << b)) as usize);
        counts[column << b | row] += 1;
    }
    counts.iter().all(|&n| n == points.len() >> (a + b))
}

#[test]
fn every_projection_of_a_set_is_the_net_that_sobol_made() {
    // m = 6 fills one word of coins, 7 and 10 begin and leave another.
    for (m, batch) in [(0, 0), (1, 0), (6, 1), (7, 2), (10, 3), (13, 4)] {
        let points = scrambled(5, batch, m);
        for d in 0..DIMENSIONS {
            let projected: Vec<[f64; 2]> = points.iter().map(|p| [p[d], 0.0]).collect();
            assert!(balanced(&projected, m, 0), "2^{m} points, dimension {d}");
        }
    }
    let m = 10;
    let points = scrambled(5, 3, m);
    let (mut kept, mut best) = (0, 0);
    for (c, d) in (0..DIMENSIONS).flat_map(|c| (0..c).map(move |d| (c, d))) {
        let of_sobol: Vec<_> = (0..1 << m).map(|i| [plain(i)[c], plain(i)[d]].map(|x| f64::from(x) / TWO_32)).collect();
        let of_set: Vec<_> = points.iter().map(|p| [p[c], p[d]]).collect();
        for (a, b) in (1..m).flat_map(|a| (1..=m - a).map(move |b| (a, b))) {
            let balance = balanced(&of_sobol, a, b);
            assert_eq!(balanced(&of_set, a, b), balance, "dimensions {c} and {d}, boxes of 2^-{a} x 2^-{b}");
            kept += usize::from(balance);
            best += usize::from(balance && a + b == m);
        }
    }
    // Most boxes are balanced, down to those of one point, or the comparison would say little.
    assert!(kept > 28 * 35 && best > 28, "{kept} {best}");
}

/// Chi-square of pairs in [0,1)^2 over `cells` x `cells` boxes, as the probability of a larger one.
fn p_value(pairs: &[[f64; 2]], cells: usize) -> f64 {
    let mut counts = vec![0u32; cells * cells];
    let cell = |x: f64| (x * cells as f64) as usize;
    pairs.iter().for_each(|[x, y]| counts[cells * cell(*x) + cell(*y)] += 1);
    let expected = pairs.len() as f64 / counts.len() as f64;
    let chi: f64 = counts.iter().map(|&n| square(f64::from(n) - expected) / expected).sum();
    1.0 - ChiSquared::new((counts.len() - 1) as f64).unwrap().cdf(chi)
}

/// Over many batches the pairs that `of` makes of their sets, in 16 x 16 boxes.
fn over_batches(m: u32, of: impl Fn(&PointSet) -> [f64; 2]) -> f64 {
    let stream = scrambling(9);
    let pairs: Vec<_> = (0..1 << 16).map(|batch| of(&PointSet::new(&stream, batch, m))).collect();
    p_value(&pairs, 16)
}

/// `x` without its first `digits` binary digits.
fn below(x: f64, digits: u32) -> f64 {
    (x * (1u64 << digits) as f64).fract()
}

#[test]
fn one_point_is_uniform_and_its_coordinates_are_independent() {
    for i in [0, 1, 1500] {
        for (c, d) in [(0, 1), (0, 7), (3, 4), (6, 7)] {
            // Coarse and fine digits: around the ends of words of coins, and below the last level.
            for digits in [0, 5, 11, 24] {
                let p = over_batches(11, |set| [below(set.point(i)[c], digits), below(set.point(i)[d], digits)]);
                assert!(p > LEVEL, "point {i}, dimensions {c} and {d} below digit {digits}: p = {p:e}");
            }
        }
    }
}

#[test]
fn digits_after_the_first_that_differs_are_independent() {
    // Points 1 and 2 lie in one half and different quarters of dimension 0, and share all zeros below: a shift of
    // digits leaves them in the same place of their quarters, Owen's scrambling makes these places independent.
    assert_eq!([plain(1)[0], plain(2)[0]], [0x8000_0000, 0xc000_0000]);
    let places = |set: &PointSet| [set.point(1)[0], set.point(2)[0]];
    let stream = scrambling(9);
    for batch in 0..1000 {
        let [x, y] = places(&PointSet::new(&stream, batch, 11));
        assert!((x < 0.5) == (y < 0.5) && ((2.0 * x).fract() < 0.5) != ((2.0 * y).fract() < 0.5), "{x} {y}");
    }
    let p = over_batches(11, |set| places(set).map(|x| below(x, 2)));
    assert!(p > LEVEL, "p = {p:e}");
    let shift = Stream::new(9, Domain::Receiver, "shift");
    let shifted: Vec<_> = (0..1 << 16)
        .map(|batch| {
            let mask = (shift.generator(batch).uniform() * TWO_32) as u32;
            [1, 2].map(|i| below(f64::from(plain(i)[0] ^ mask) / TWO_32, 2))
        })
        .collect();
    assert!(p_value(&shifted, 16) < LEVEL, "a digital shift is accepted");
}

#[test]
fn batches_and_seeds_are_independent() {
    let (one, other) = (scrambling(9), scrambling(10));
    let point = |stream: &Stream, batch: u64| PointSet::new(stream, batch, 11).point(3)[2];
    for lag in [1, 2, 1 << 12, 1 << 32] {
        let pairs: Vec<_> = (0..1 << 16).map(|b| [point(&one, b), point(&one, b + lag)]).collect();
        let p = p_value(&pairs, 16);
        assert!(p > LEVEL, "batches {lag} apart: p = {p:e}");
    }
    let pairs: Vec<_> = (0..1 << 16).map(|b| [point(&one, b), point(&other, b)]).collect();
    assert!(p_value(&pairs, 16) > LEVEL, "two seeds");
}

#[test]
fn means_over_sets_are_unbiased_and_better_than_random() {
    // A smooth function of all eight coordinates with mean one; one history varies by (1 + 1/12)^8 - 1.
    let f = |p: &[f64; DIMENSIONS]| p.iter().map(|x| x + 0.5).product::<f64>();
    let m = 8;
    let mean = |batch| scrambled(3, batch, m).iter().map(f).sum::<f64>() / f64::from(1 << m);
    let estimate = Estimate::from_scores((0..4096).map(mean));
    let z = (estimate.mean - 1.0) / estimate.standard_error;
    assert!(z.abs() < 5.0, "{estimate:?}: z = {z}");
    let random = (square(square(square(13.0 / 12.0))) - 1.0) / f64::from(1 << m);
    let gain = random / (square(estimate.standard_error) * estimate.n as f64);
    assert!(gain > 20.0, "variance smaller by {gain} only");
}

fn generator() -> Generator {
    Stream::new(1, Domain::Trajectory, "").generator(5)
}

/// A point whose coordinates tell their places.
const NUMBERED: [f64; DIMENSIONS] = [0.05, 0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75];

#[test]
fn coordinates_come_first_then_the_numbers_of_the_generator_from_the_first_on() {
    let (mut with, mut without) = (generator().after(NUMBERED), generator());
    assert_eq!([(); DIMENSIONS].map(|()| with.uniform()), NUMBERED);
    (0..100).for_each(|_| assert_eq!(with.uniform(), without.uniform()));
    // The last coordinate and a number make a pair; roulette takes numbers only.
    let (mut with, mut without) = (generator().after(NUMBERED), generator());
    assert_eq!([(); DIMENSIONS - 1].map(|()| with.uniform()), NUMBERED[..DIMENSIONS - 1]);
    assert_eq!(with.chance(0.5), without.chance(0.5));
    let pair = with.uniform2();
    assert_eq!([pair.x, pair.y], [NUMBERED[7], without.uniform()]);
    let hits = (0..10_000).filter(|_| with.chance(0.3)).count();
    assert!((2770..3230).contains(&hits), "{hits} of 10000 with a chance of 0.3");
}

/// Coordinates that the emission of a history takes in the scene of `job` over `model`.
fn emission_takes(job: &str, model: Model) -> usize {
    let case = Case::new(&(job.to_owned() + &point("p", [0.0; 3], [0.0, 1.0, 0.0])), model);
    let mut rng = generator().after(NUMBERED);
    case.scene.sources.emit(&case.scene.geometry, &mut rng);
    let next = rng.uniform();
    NUMBERED.iter().position(|&x| x == next).unwrap()
}

#[test]
fn emission_takes_the_coordinates_that_the_docs_say() {
    let omni = "[[source]]\nkind = \"omni\"\nposition = [0, 1, 0]\nintensity = 1\n";
    let panel = |double_sided| {
        let mut model = Model::default();
        let mut surface = lambert(0.0, 1.0);
        surface.double_sided = double_sided;
        add_quad(&mut model, DVec3::ZERO, DVec3::X, DVec3::Z, surface);
        model
    };
    assert_eq!(emission_takes(omni, Model::default()), 2);
    assert_eq!(emission_takes(&(omni.to_owned() + omni), Model::default()), 3);
    // Two triangles are two sources: one coordinate for the choice.
    assert_eq!(emission_takes("", panel(false)), 1 + 2 + 2);
    assert_eq!(emission_takes("", panel(true)), 1 + 2 + 1 + 2);
}

/// Light of one history at r = 1 m on plane 1 in Sobolev's case A by plain local estimation \[lx\].
fn local_estimate(vertices: &[Vertex]) -> f64 {
    let upper = vertices.iter().filter(|v| v.normal.y < 0.0);
    upper.map(|v| v.weight.luminance() * 0.5 / PI / square(v.position.distance_squared(DVec3::X))).sum()
}

/// Totals of the histories of each set of 2^m in case A, and the exact mean.
fn totals_of_sets(sets: u64, m: u32) -> (Vec<Vec<f64>>, f64) {
    let job = sobolev("", 0.5, 0.5, 0.5) + &point("unused", [0.0; 3], [0.0, 1.0, 0.0]);
    let case = Case::new(&job, Model::default());
    let trajectories = Stream::new(17, Domain::Trajectory, "");
    let of_set = |batch: u64| -> Vec<f64> {
        let history = |(i, point)| {
            let mut rng = trajectories.generator((batch << m) + i).after(point);
            let mut vertices = Vec::new();
            trace(&case.scene, &case.job.transport, &mut rng, &mut vertices);
            local_estimate(&vertices)
        };
        (0..).zip(scrambled(17, batch, m)).map(history).collect()
    };
    let rows = table("sobolev_tables.csv");
    let row = rows.iter().find(|r| r["case"] == "A" && number(r, "r") == 1.0).unwrap();
    ((0..sets).map(of_set).collect(), number(row, "E1") - number(row, "E1_direct"))
}

/// True when the 95 % interval of `estimate` contains `truth`.
fn covers(estimate: Estimate, truth: f64) -> bool {
    let (low, high) = estimate.interval(student_quantile(0.95, estimate.n));
    (low..=high).contains(&truth)
}

#[test]
fn error_bars_from_histories_inside_a_set_are_rejected() {
    const BATCHES: usize = 16;
    const EXPERIMENTS: usize = 1000;
    let (sets, truth) = totals_of_sets((BATCHES * EXPERIMENTS) as u64, 6);
    let inside: Vec<Estimate> = sets.iter().map(|set| Estimate::from_scores(set.iter().copied())).collect();
    let mean = Estimate::from_scores(inside.iter().map(|e| e.mean));
    assert!(((mean.mean - truth) / mean.standard_error).abs() < 5.0, "{mean:?} against {truth}");
    // What a set really varies by, and what its histories, taken for independent, say.
    let real = square(mean.standard_error) * mean.n as f64;
    let said = Estimate::from_scores(inside.iter().map(|e| square(e.standard_error))).mean;
    // From 16 batches, as the program does it.
    let batches: Vec<Estimate> =
        inside.chunks(BATCHES).map(|few| Estimate::from_scores(few.iter().map(|e| e.mean))).collect();
    let right = Estimate::from_scores(batches.iter().map(|e| square(e.standard_error) * BATCHES as f64));
    let (covered_inside, covered) = (count(&inside, |e| covers(*e, truth)), count(&batches, |e| covers(*e, truth)));
    println!("inside: variance {:.2} times the real one, {covered_inside} of {} cover", said / real, inside.len());
    println!("batches: variance {:.3} times the real one, {covered} of {EXPERIMENTS} cover", right.mean / real);
    assert!(said / real > 4.0, "{}", said / real);
    assert!(!plausible(covered_inside, inside.len()), "{covered_inside}");
    assert!((right.mean / real - 1.0).abs() < 5.0 * right.relative_error(), "{right:?} against {real}");
    assert!(plausible(covered, EXPERIMENTS), "{covered}");
}

fn count<T>(all: &[T], holds: impl Fn(&T) -> bool) -> usize {
    all.iter().filter(|x| holds(x)).count()
}

/// True when `covered` of `n` intervals are what a coverage of 95 % can give, both sides together at [`LEVEL`].
fn plausible(covered: usize, n: usize) -> bool {
    let binomial = Binomial::new(0.95, n as u64).unwrap();
    let low = binomial.cdf(covered as u64);
    let high = 1.0 - covered.checked_sub(1).map_or(0.0, |k| binomial.cdf(k as u64));
    low.min(high) > LEVEL / 2.0
}

#[test]
fn batches_of_quasi_random_histories_are_the_sets_in_order() {
    // The program's batch is the mean over the set of its number, and random sampling is another thing.
    let (m, batch) = (5, 3);
    let run = |sampling| format!("[run]\nseed = 17\nhistories_per_batch = {}\nsampling = \"{sampling}\"", 1 << m);
    let score = |sampling| {
        let toml = sobolev(&run(sampling), 0.5, 0.5, 0.5) + "[transport]\nbounded = false\n";
        let case = Case::new(&(toml + &point("r1", [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])), Model::default());
        case.batches(0..u32::MAX).1[batch].sets[0].value[0]
    };
    let expected = totals_of_sets(batch as u64 + 1, m).0[batch].iter().sum::<f64>() / f64::from(1 << m);
    assert!((score("rqmc") / expected - 1.0).abs() < 1e-5, "{} against {expected}", score("rqmc"));
    assert!((score("random") / expected - 1.0).abs() > 1e-3);
}
