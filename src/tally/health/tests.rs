//! The checks on samples of known distributions.

use super::checks::*;
use super::tail::{STEEPEST, tail_slope};
use super::*;
use crate::job::Sampling;
use crate::math::{log, pow};
use crate::random::{Domain, Generator, Stream};
use crate::tally::statistics::Estimate;
use crate::tally::{HistoryMoments, Monitor, Watched};

/// The monitor of `batches` batches of 64 independent histories each.
fn monitor(run: u64, batches: u64, draw: fn(&mut Generator) -> f64) -> Monitor {
    let mut g = Stream::new(29, Domain::Receiver, "health").generator(run);
    let mut monitor = Monitor::new(0);
    for _ in 0..batches {
        let totals: Vec<f64> = (0..64).map(|_| draw(&mut g)).collect();
        let score = totals.iter().sum::<f64>() / 64.0;
        monitor.accumulate(score, &Watched { totals });
    }
    monitor
}

/// A total with every moment.
fn exponential(g: &mut Generator) -> f64 {
    -log(1.0 - g.uniform())
}

/// A total whose survival falls as t^(-3/2): a pixel on an edge in the plain estimate. Its variance is infinite.
fn plain_edge(g: &mut Generator) -> f64 {
    pow(1.0 - g.uniform(), -2.0 / 3.0)
}

/// The same pixel with the kernel bounded: what the bound cuts off comes back as a continuation, which is short-tailed.
fn bounded_edge(g: &mut Generator) -> f64 {
    plain_edge(g).min(4.0) + exponential(g)
}

/// The outcomes of the ten checks for 50 runs.
fn outcomes(batches: u64, draw: fn(&mut Generator) -> f64, sampling: Sampling) -> Vec<[Outcome; 10]> {
    let of = |run| {
        let m = monitor(run, batches, draw);
        checks(&snapshots(&m, 0.0), tail_slope(&m.largest), sampling)
    };
    (0..50).map(of).collect()
}

/// In how many of `outcomes` each check failed.
fn failures(outcomes: &[[Outcome; 10]]) -> [usize; 10] {
    std::array::from_fn(|i| outcomes.iter().filter(|o| o[i] == Outcome::Failed).count())
}

/// In how many of `outcomes` the first nine checks set a mark.
fn marked(outcomes: &[[Outcome; 10]]) -> usize {
    let failed = |o: &&[Outcome; 10]| o[..9].iter().filter(|&&o| o == Outcome::Failed).count() >= FAILED_CHECKS;
    outcomes.iter().filter(failed).count()
}

#[test]
fn an_edge_pixel_of_the_plain_estimate_fails_the_tail_and_the_bounded_one_passes() {
    let plain = failures(&outcomes(64, plain_edge, Sampling::Rqmc));
    let bounded = failures(&outcomes(64, bounded_edge, Sampling::Rqmc));
    println!("plain {plain:?}, bounded {bounded:?}");
    assert!(plain[9] >= 43, "{plain:?}");
    assert_eq!(bounded[9], 0, "{bounded:?}");
}

#[test]
fn a_healthy_run_passes_and_one_of_infinite_variance_does_not() {
    for (batches, draw, few) in [(64, exponential as fn(&mut Generator) -> f64, 3), (256, bounded_edge, 1)] {
        let healthy = outcomes(batches, draw, Sampling::Random);
        println!("healthy, {batches} batches: {:?}, {} marked", failures(&healthy), marked(&healthy));
        assert!(failures(&healthy).iter().all(|&n| n <= 5), "{:?}", failures(&healthy));
        assert!(marked(&healthy) <= few);
    }
    let sick = outcomes(256, plain_edge, Sampling::Random);
    println!("sick, 256 batches: {:?}, {} marked", failures(&sick), marked(&sick));
    assert!(marked(&sick) >= 35);
}

#[test]
fn a_drift_of_the_mean_and_a_rate_that_is_not_a_square_root_are_seen() {
    let rising = Monitor {
        bin: 0,
        scores: (0..100).map(|b| 1.0 + 0.01 * f64::from(b)).collect(),
        histories: vec![HistoryMoments::of(&[0.0, 1.0, 2.0]); 100],
        largest: Vec::new(),
    };
    let judged = checks(&snapshots(&rising, 0.0), None, Sampling::Random);
    assert_eq!(judged[0], Outcome::Failed);
    // The error of a mean that drifts does not fall: R sqrt(n) grows.
    assert_eq!((judged[3], judged[9]), (Outcome::Failed, Outcome::NotApplicable));
    // Scores of a run of which the second half scatters ten times as much.
    let widening = Monitor {
        scores: (0..100).map(|b| 5.0 + if b % 2 == 0 { 1.0 } else { -1.0 } * if b < 50 { 0.1 } else { 1.0 }).collect(),
        ..rising
    };
    let judged = checks(&snapshots(&widening, 0.0), None, Sampling::Random);
    assert_eq!([judged[2], judged[3], judged[7]], [Outcome::Failed; 3]);
}

#[test]
fn quasi_random_batches_have_three_checks() {
    let judged = outcomes(32, bounded_edge, Sampling::Rqmc)[0];
    let applicable: Vec<&str> = (0..10).filter(|&i| judged[i] != Outcome::NotApplicable).map(|i| CHECKS[i]).collect();
    assert_eq!(applicable, ["error_small", "error_rate", "tail_steep"]);
}

#[test]
fn few_batches_and_missing_histories_are_no_verdict() {
    let short = monitor(1, 15, exponential);
    let judged = checks(&snapshots(&short, 0.0), tail_slope(&short.largest), Sampling::Random);
    assert_eq!(judged[..9], [Outcome::NotApplicable; 9]);
    assert_eq!(judged[9], Outcome::Passed);
    let mut unwatched = Monitor::new(0);
    (0..32).for_each(|b| unwatched.accumulate(1.0 + f64::from(b % 3), &Watched::default()));
    let judged = checks(&snapshots(&unwatched, 0.0), tail_slope(&unwatched.largest), Sampling::Random);
    for check in [4, 5, 6, 7, 8, 9] {
        assert_eq!(judged[check], Outcome::NotApplicable, "{}", CHECKS[check]);
    }
    assert_eq!(judged[3], Outcome::Passed);
    assert_eq!(checks(&snapshots(&Monitor::new(0), 0.0), None, Sampling::Random), [Outcome::NotApplicable; 10]);
}

#[test]
fn snapshots_are_the_second_half_in_ten_steps() {
    assert_eq!(snapshot_counts(256), [128, 141, 154, 167, 180, 192, 205, 218, 231, 244, 256]);
    assert_eq!(snapshot_counts(16), [8, 9, 10, 11, 12, 13, 14, 15, 16]);
    assert_eq!(snapshot_counts(3), [2, 3]);
    assert!(snapshot_counts(1).is_empty() && snapshot_counts(0).is_empty());
    let largest = u64::MAX - 7;
    assert_eq!(snapshot_counts(largest).last(), Some(&largest));
}

#[test]
fn a_snapshot_is_what_the_first_batches_say() {
    let m = monitor(5, 40, exponential);
    let at_20 = snapshots(&m, 3.0)[0];
    assert_eq!((at_20.batches, at_20.histories), (20, 20 * 64));
    let mean = m.scores[..20].iter().sum::<f64>() / 20.0;
    let variance = m.scores[..20].iter().map(|s| (s - mean) * (s - mean)).sum::<f64>() / 19.0;
    assert!((at_20.mean - mean - 3.0).abs() < 1e-14);
    let relative = (variance / 20.0).sqrt() / (mean + 3.0);
    assert!((at_20.relative_error / relative - 1.0).abs() < 1e-12);
    assert!((at_20.figure_of_merit_per_history * relative * relative * 1280.0 - 1.0).abs() < 1e-12);
    // VOV of an exponential density: (9 - 1)/n.
    assert!((at_20.vov * 1280.0 / 8.0 - 1.0).abs() < 0.5, "{}", at_20.vov);
}

const HEALTHY: Signs = Signs {
    batches: 64,
    informed: true,
    relative_error: 0.02,
    peak: 0.01,
    vov: 0.03,
    history_vov: 0.03,
    slope: Some(STEEPEST),
    failed_checks: 1,
    caustic: 0.1,
    histories_in_lobe: 20.0,
};

#[test]
fn each_sign_sets_its_own_mark() {
    assert!(health(&HEALTHY).is_healthy());
    let code = |signs: Signs| health(&signs).code();
    assert_eq!(code(Signs { informed: false, ..HEALTHY }), 1);
    assert_eq!(code(Signs { batches: 15, ..HEALTHY }), 2);
    assert_eq!(code(Signs { relative_error: 0.11, ..HEALTHY }), 4);
    assert_eq!(code(Signs { peak: 0.06, ..HEALTHY }), 8);
    assert_eq!(code(Signs { vov: 0.11, ..HEALTHY }), 16);
    assert_eq!(code(Signs { history_vov: 0.11, batches: 16, ..HEALTHY }), 16);
    assert_eq!(code(Signs { slope: Some(2.5), ..HEALTHY }), 32);
    assert_eq!(code(Signs { slope: Some(2.5), history_vov: 0.01, ..HEALTHY }), 0, "a tail that does not matter");
    assert_eq!(code(Signs { failed_checks: FAILED_CHECKS, ..HEALTHY }), 64);
    assert_eq!(code(Signs { caustic: 0.3, ..HEALTHY }), 128);
    assert_eq!(code(Signs { caustic: 0.3, histories_in_lobe: 40.0, ..HEALTHY }), 0, "a lobe that many histories met");
    let worst = health(&Signs { batches: 4, relative_error: 0.5, peak: 0.5, slope: Some(2.0), ..HEALTHY });
    let words: Vec<&str> = worst.marks().map(Mark::word).collect();
    assert_eq!((worst.code(), words), (2 + 4 + 8 + 32, vec!["few batches", "relative error", "peak", "tail"]));
}

#[test]
fn what_is_not_known_sets_no_mark() {
    let nan = f64::NAN;
    let unknown =
        Signs { relative_error: nan, peak: nan, vov: nan, history_vov: nan, slope: None, caustic: nan, ..HEALTHY };
    assert!(health(&unknown).is_healthy());
    assert!(health(&Signs { vov: 0.5, batches: 49, ..HEALTHY }).is_healthy(), "VOV of few batches");
    assert!(health(&Signs { relative_error: 0.0, batches: 1, vov: nan, ..HEALTHY }).is_healthy(), "known exactly");
}

#[test]
fn signs_are_shares_of_the_whole_value() {
    let estimate = Estimate { n: 32, mean: 2.0, standard_error: 0.5 };
    let counted = Counted { estimate, direct: 1.0, peak: 3.0, vov: 0.2, caustic: 1.0 };
    let common = Common { histories: 300.0, narrowest_lobe: 0.5 };
    let of = |counted: Counted| Signs::of(&common, &counted, 3.0, None);
    let signs = of(counted);
    // Fixed light is part of the value, and no light at the receiver is part of what histories brought.
    assert_eq!((signs.relative_error, signs.peak, signs.caustic), (0.1, 0.01, 2.0));
    assert_eq!((signs.batches, signs.informed, signs.histories_in_lobe), (32, true, 75.0));
    let with = |n, mean, standard_error| of(Counted { estimate: Estimate { n, mean, standard_error }, ..counted });
    assert_eq!(with(32, -3.0, 0.0).relative_error, 0.0, "an exact zero");
    assert!(with(32, 1.0, 0.1).peak.is_nan(), "nothing but direct light");
    assert!(with(1, 2.0, f64::NAN).informed && !with(32, 2.0, f64::NAN).informed);
    assert!(!with(0, f64::NAN, f64::NAN).informed);
}
