//! Derived quantities: what the jackknife, family-wise intervals and the least of several promise, checked on scores
//! whose truth is known.

use lampyris::math::{PI, cos, log};
use lampyris::random::{Domain, Generator, Stream};
use lampyris::tally::derived::{Family, Series, family_quantile, jackknife, least, ratio};
use lampyris::tally::statistics::{Estimate, student_quantile};
use lampyris::tally::{Replicates, Scores};

const REPLICATES: u64 = 2000;
const BATCHES: usize = 32;

/// A standard normal number.
fn normal(rng: &mut Generator) -> f64 {
    let u = rng.uniform2();
    (-2.0 * log(1.0 - u.x)).sqrt() * cos(2.0 * PI * u.y)
}

fn generator(test: &str, replicate: u64) -> Generator {
    Stream::new(20_261, Domain::Receiver, test).generator(replicate)
}

/// Standard errors by which `covered` of `total` intervals lie above (positive) or below the share `nominal`.
fn sigmas(covered: u64, total: u64, nominal: f64) -> f64 {
    let n = total as f64;
    (covered as f64 - n * nominal) / (n * nominal * (1.0 - nominal)).sqrt()
}

fn series(scores: &[f64], fixed: f64) -> Series {
    let informed = scores.iter().any(|&x| x != 0.0);
    Series { scores: scores.to_vec(), fixed, informed }
}

#[test]
fn factors_are_those_of_the_printed_table() {
    // Two-sided family-wise 95 % factors, docs/method.md, section 11.
    let members = [1, 10, 100, 1000, 10_000, 1_000_000];
    let table = [
        (8, [2.36, 4.03, 6.08, 8.78, 12.4, 24.4]),
        (16, [2.13, 3.29, 4.42, 5.61, 6.91, 10.0]),
        (32, [2.04, 3.02, 3.89, 4.70, 5.51, 7.14]),
        (64, [2.00, 2.91, 3.67, 4.35, 4.99, 6.19]),
        (1 << 32, [1.96, 2.81, 3.48, 4.06, 4.56, 5.45]),
    ];
    for (batches, factors) in table {
        for (m, printed) in members.into_iter().zip(factors) {
            // Three digits are printed.
            let last = if printed < 10.0 { 0.00501 } else { 0.0501 };
            let factor = family_quantile(0.95, m, batches);
            assert!((factor - printed).abs() <= last, "{batches} batches, {m} members: {factor}, not {printed}");
        }
    }
    assert_eq!(family_quantile(0.95, 1, 32).to_bits(), student_quantile(0.95, 32).to_bits());
    assert!(family_quantile(0.95, 10, 1).is_nan());
}

#[test]
fn the_jackknife_of_a_mean_is_its_usual_standard_error() {
    let mut rng = generator("linear", 0);
    for n in [2, 3, 16, 500] {
        let scores: Vec<f64> = (0..n).map(|_| 1000.0 + normal(&mut rng)).collect();
        let sum: f64 = scores.iter().sum();
        let mean = |left_out: Option<usize>| match left_out {
            None => sum / n as f64,
            Some(batch) => (sum - scores[batch]) / (n as f64 - 1.0),
        };
        let usual = Estimate::from_scores(scores.iter().copied());
        let jackknifed = jackknife(n, mean);
        assert!((jackknifed.standard_error / usual.standard_error - 1.0).abs() < 1e-9, "{n}: {jackknifed:?} {usual:?}");
        assert!((jackknifed.mean - usual.mean).abs() < 1e-12 * usual.mean);
    }
    assert!(jackknife(1, |_| 1.0).standard_error.is_nan());
}

#[test]
fn a_set_over_itself_is_one_without_error() {
    let mut rng = generator("itself", 0);
    let scores: Vec<f64> = (0..BATCHES).map(|_| 3.0 + normal(&mut rng)).collect();
    let a = series(&scores, 0.7);
    let one = ratio(&a, &a, 0.95);
    assert_eq!((one.mean, one.standard_error), (1.0, 0.0));
    // Twice the light at twice the price: the errors cancel but for rounding.
    let twice = series(&scores.iter().map(|x| 2.0 * x).collect::<Vec<_>>(), 1.4);
    let two = ratio(&twice, &a, 0.95);
    assert!((two.mean - 2.0).abs() < 1e-14 && two.standard_error < 1e-14, "{two:?}");
}

#[test]
fn the_ratio_of_correlated_means_covers_where_quadrature_is_far_too_wide() {
    // x = 2 + c + d/10, y = 1 + c/2 + e/10 and a fixed part of 1 on each: true ratio 3/2, correlation 0.97.
    let quantile = student_quantile(0.95, BATCHES as u64);
    let (mut covered, mut by_quadrature, mut narrower) = (0, 0, 0.0);
    for replicate in 0..REPLICATES {
        let mut rng = generator("ratio", replicate);
        let draw = |_| {
            let common = 0.5 * normal(&mut rng);
            [2.0 + common + 0.05 * normal(&mut rng), 1.0 + 0.5 * common + 0.05 * normal(&mut rng)]
        };
        let pairs: Vec<[f64; 2]> = (0..BATCHES).map(draw).collect();
        let [x, y] = [0, 1].map(|i| series(&pairs.iter().map(|p| p[i]).collect::<Vec<_>>(), 1.0));
        let estimate = ratio(&x, &y, 0.95);
        let [r, s] = [&x, &y].map(|series| series.estimate().relative_error());
        let naive = Estimate { standard_error: estimate.mean * (r * r + s * s).sqrt(), ..estimate };
        let holds = |e: Estimate| u64::from(e.interval(quantile).0 <= 1.5 && 1.5 <= e.interval(quantile).1);
        covered += holds(estimate);
        by_quadrature += holds(naive);
        narrower += estimate.standard_error / naive.standard_error / REPLICATES as f64;
    }
    println!("jackknife {covered}, quadrature {by_quadrature} of {REPLICATES}, widths {narrower:.3} to 1");
    assert!(sigmas(covered, REPLICATES, 0.95).abs() < 4.0, "{covered} of {REPLICATES} intervals cover");
    assert_eq!(by_quadrature, REPLICATES, "quadrature ignores that the errors cancel");
    assert!(narrower < 0.5, "{narrower}");
}

/// Batch scores of a grid: point i has the mean `means[i]`, and an error of which `common` is shared by all points.
fn grid(means: &[f64], common: f64, own: f64, rng: &mut Generator) -> Replicates {
    let mut scores = Replicates::new(means.len());
    for _ in 0..BATCHES {
        let shared = common * normal(rng);
        let row: Vec<f64> = means.iter().map(|m| m * (1.0 + shared + own * normal(rng))).collect();
        scores.accumulate(&row, &vec![0.0; means.len()]);
    }
    scores
}

/// How often the intervals of the minimum, of the uniformity and of every point at once hold, and their mean widths
/// relative to the truth.
fn coverage(test: &str, means: &[f64], common: f64, own: f64) -> [(u64, f64); 3] {
    let mean = means.iter().sum::<f64>() / means.len() as f64;
    let lowest = means.iter().copied().fold(f64::INFINITY, f64::min);
    let mut found = [(0, 0.0); 3];
    for replicate in 0..REPLICATES {
        let scores = grid(means, common, own, &mut generator(test, replicate));
        let family = Family::new(&scores, &[]);
        let (minimum, uniformity) = (family.minimum(0.95).unwrap(), family.uniformity(0.95).unwrap());
        let quantile = family_quantile(0.95, means.len(), BATCHES as u64);
        let intervals: Vec<(f64, f64)> = (0..means.len()).map(|i| scores.estimate(i).interval(quantile)).collect();
        let all = intervals.iter().zip(means).all(|((low, high), m)| low <= m && m <= high);
        let width = intervals.iter().zip(means).map(|((low, high), m)| (high - low) / m).sum::<f64>();
        let inside = |low: f64, high: f64, truth: f64| (low <= truth && truth <= high, (high - low) / truth);
        let results = [
            inside(minimum.low, minimum.high, lowest),
            inside(uniformity.low, uniformity.high, lowest / mean),
            (all, width / means.len() as f64),
        ];
        for (sum, (holds, width)) in found.iter_mut().zip(results) {
            *sum = (sum.0 + u64::from(holds), sum.1 + width / REPLICATES as f64);
        }
    }
    let [a, b, c] = found;
    println!(
        "{test}: minimum {} (width {:.4}), Uo {} (width {:.4}), every point {} (width {:.4}) of {REPLICATES}",
        a.0, a.1, b.0, b.1, c.0, c.1
    );
    found
}

#[test]
fn minimum_uniformity_and_every_point_cover_at_least_as_promised() {
    // One point clearly lowest; a tie of all; a slope. The errors mostly shared, or all their own.
    let slope: Vec<f64> = (0..40).map(|i| 1.0 + 0.02 * f64::from(i)).collect();
    let alone: Vec<f64> = (0..40).map(|i| if i == 7 { 0.5 } else { 1.0 }).collect();
    let cases = [("tie", vec![1.0; 40], 0.1, 0.1), ("alone", alone, 0.3, 0.05), ("slope", slope, 0.0, 0.2)];
    for (name, means, common, own) in cases {
        for (covered, _) in coverage(name, &means, common, own) {
            assert!(sigmas(covered, REPLICATES, 0.95) > -4.0, "{name}: {covered} of {REPLICATES}");
        }
    }
}

#[test]
fn shared_errors_cancel_in_the_uniformity_and_not_in_the_minimum() {
    let [minimum, uniformity, _] = coverage("shared", &[1.0, 2.0, 3.0], 0.3, 0.01);
    assert!(uniformity.1 < 0.1 * minimum.1, "{uniformity:?} {minimum:?}");
}

#[test]
fn the_least_observed_mean_lies_low_and_its_jackknife_does_not_cover() {
    // Why equation (11.6): 40 equal points, each with its own error.
    let (mut bias, mut covered) = (0.0, 0);
    for replicate in 0..REPLICATES {
        let scores = grid(&[1.0; 40], 0.0, 0.2, &mut generator("naive", replicate));
        let sums: Vec<f64> = (0..40).map(|i| scores.scores(i).sum()).collect();
        let lowest = |left_out: Option<usize>| {
            let mean = |(i, sum): (usize, &f64)| match left_out {
                None => sum / BATCHES as f64,
                Some(batch) => (sum - scores.value[40 * batch + i]) / (BATCHES as f64 - 1.0),
            };
            sums.iter().enumerate().map(mean).fold(f64::INFINITY, f64::min)
        };
        let naive = jackknife(BATCHES, lowest);
        bias += (naive.mean - 1.0) / REPLICATES as f64;
        let (low, high) = naive.interval(student_quantile(0.95, BATCHES as u64));
        covered += u64::from(low <= 1.0 && 1.0 <= high);
    }
    println!("least of 40 equal points: bias {bias:.4}, a plain jackknife covers {covered} of {REPLICATES}");
    assert!(bias < -0.05 && sigmas(covered, REPLICATES, 0.95) < -20.0, "{bias} {covered}");
}

#[test]
fn points_without_receiver_do_not_count_and_fixed_light_does() {
    let mut scores = Replicates::new(3);
    [[1.0, 50.0, 4.0], [3.0, 50.0, 6.0], [2.0, 50.0, 5.0]].iter().for_each(|row| scores.accumulate(row, &[0.0; 3]));
    let family = Family::new(&scores, &[10.0, f64::NAN, 0.0]);
    assert_eq!(family.len(), 2);
    let mean = family.mean().unwrap();
    assert_eq!((mean.scores.as_slice(), mean.fixed), ([2.5, 4.5, 3.5].as_slice(), 5.0));
    assert_eq!(mean.estimate().mean, 8.5);
    let (minimum, uniformity) = (family.minimum(0.95).unwrap(), family.uniformity(0.95).unwrap());
    assert_eq!((minimum.value, uniformity.value), (5.0, 5.0 / 8.5));
    let half = family_quantile(0.95, 2, 3) / 3f64.sqrt();
    assert!((minimum.low - (5.0 - half)).abs() < 1e-12 && (minimum.high - (5.0 + half)).abs() < 1e-12, "{minimum:?}");
}

/// A family of two bins over 20 batches, scored by the pair (value and direct part, peak, existed).
fn batches(score: impl Fn(u64) -> (f64, f64, bool)) -> Replicates {
    let mut scores = Replicates::new(2);
    for batch in 0..20 {
        let (direct, peak, existed) = score(batch);
        let (value, caustic) = (vec![direct; 2], vec![0.0; 2]);
        let (direct, peak, existed) = (value.clone(), vec![peak; 2], vec![existed; 2]);
        scores.accumulate_scores(&Scores { value, direct, peak, caustic, existed, ..Scores::default() });
    }
    scores
}

#[test]
fn bins_and_what_is_derived_from_them_know_equally_much() {
    // An area lamp lights both, a little differently in each batch; reflected light could come, and no history brought any.
    let unknown = batches(|batch| (10.0 + (batch % 2) as f64, 0.0, true));
    let family = Family::new(&unknown, &[]);
    assert!(unknown.estimate(0).standard_error.is_nan() && family.mean().unwrap().estimate().standard_error.is_nan());
    assert!(family.minimum(0.95).unwrap().low.is_nan() && family.uniformity(0.95).unwrap().low.is_nan());
    assert!(ratio(&family.mean().unwrap(), &family.mean().unwrap(), 0.95).standard_error.is_nan());
    // Nothing reflects: fixed direct light is all there is, and is exact.
    let exact = batches(|_| (0.0, 0.0, false));
    let family = Family::new(&exact, &[3.0, 5.0]);
    let (minimum, uniformity) = (family.minimum(0.95).unwrap(), family.uniformity(0.95).unwrap());
    assert_eq!((family.mean().unwrap().estimate().mean, family.mean().unwrap().estimate().standard_error), (4.0, 0.0));
    assert_eq!([minimum.value, minimum.low, minimum.high], [3.0; 3]);
    assert_eq!([uniformity.value, uniformity.low, uniformity.high], [0.75; 3]);
    assert_eq!(ratio(&family.mean().unwrap(), &family.mean().unwrap(), 0.95).standard_error, 0.0);
}

#[test]
fn what_is_not_known_has_no_interval() {
    let scored = series(&[1.0, 1.2, 0.8, 1.1], 0.0);
    let noise = series(&[1.0, -1.2, 0.8, -0.7], 0.0);
    let silent = series(&[0.0; 4], 5.0);
    for (numerator, denominator) in [(&scored, &noise), (&silent, &scored), (&scored, &silent)] {
        let estimate = ratio(numerator, denominator, 0.95);
        assert!(estimate.standard_error.is_nan() && estimate.mean.is_finite(), "{estimate:?}");
    }
    assert!(noise.estimate().standard_error > 0.0 && !noise.is_clear_of_zero(0.95) && scored.is_clear_of_zero(0.95));
    // A mean about zero: no uniformity, but a minimum.
    let mut scores = Replicates::new(2);
    [[1.0, -1.0], [-1.2, 1.0], [0.4, 0.3]].iter().for_each(|row| scores.accumulate(row, &[0.0; 2]));
    let family = Family::new(&scores, &[]);
    let uniformity = family.uniformity(0.95).unwrap();
    assert!(uniformity.low.is_nan() && uniformity.high.is_nan() && family.minimum(0.95).unwrap().low.is_finite());
    // One bin without information: the least may lie anywhere below what the others say.
    let mut scores = Replicates::new(2);
    [[1.0, 0.0], [1.2, 0.0], [0.8, 0.0]].iter().for_each(|row| scores.accumulate(row, &[0.0; 2]));
    let minimum = Family::new(&scores, &[0.0, 3.0]).minimum(0.95).unwrap();
    assert!(minimum.low.is_nan() && minimum.high > 1.0 && minimum.high < 2.5 && minimum.value == 1.0, "{minimum:?}");
    let (low, high) = least([].into_iter());
    assert!(low.is_nan() && high.is_nan());
    let none = Family::new(&scores, &[f64::NAN; 2]);
    assert!(
        none.is_empty()
            && none.mean().unwrap().estimate().mean.is_nan()
            && none.uniformity(0.95).unwrap().value.is_nan()
    );
}
