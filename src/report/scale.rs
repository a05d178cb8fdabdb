//! From a number to a colour: linear or logarithmic, between round ends, stated in words.
//!
//! Values that span less than a factor of 40 get a linear scale, others a logarithmic one of at most five decades.
//! A few bins far above the rest (a lamp in the picture) do not stretch the scale: they get its last colour, and
//! the words say how many they are.

use super::canvas::Rgb;
use super::number::label;
use crate::math::{ceil, floor, log};
use colorous::Gradient;

/// Where no number is: a grey that no gradient of ours contains.
pub(super) const NOTHING: Rgb = [160, 160, 160];

/// Largest over small values from which a scale is logarithmic.
const LOGARITHMIC_FROM: f64 = 40.0;
/// A linear scale has at most about this many steps.
const STEPS: f64 = 8.0;
/// A logarithmic scale shows at most this ratio.
const LARGEST_RATIO: f64 = 1e5;

/// A colour scale fitted to some numbers.
pub(super) struct Scale {
    low: f64,
    high: f64,
    /// Between two labels of a linear scale; a logarithmic one has none.
    step: Option<f64>,
    gradient: Gradient,
    below: usize,
    above: usize,
}

impl Scale {
    /// A scale for the finite ones of `values`; what no label could show (beyond 1e300) is left out. With
    /// `from_zero` a linear scale begins at 0 even where all values lie close together.
    pub fn fit(values: impl Iterator<Item = f64>, gradient: Gradient, from_zero: bool) -> Self {
        let mut sorted: Vec<f64> = values.filter(|x| x.abs() <= 1e300).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let (low, high, step) = limits(&sorted, from_zero);
        let below = sorted.partition_point(|&x| x < low);
        let above = sorted.len() - sorted.partition_point(|&x| x <= high);
        Scale { low, high, step, gradient, below, above }
    }

    /// A linear scale from 0 to a round number that is not below `most`.
    pub fn up_to(most: f64, gradient: Gradient) -> Self {
        let (low, high, step) = linear_limits(0.0, most);
        Scale { low, high, step, gradient, below: 0, above: 0 }
    }

    /// Place of `value` on the scale, 0 at its low and 1 at its high end, cut off there.
    pub fn position(&self, value: f64) -> f64 {
        let place = if self.step.is_none() {
            // Zero has no logarithm; it lies below any scale.
            log(value.max(self.low) / self.low) / log(self.high / self.low)
        } else {
            (value - self.low) / (self.high - self.low)
        };
        place.clamp(0.0, 1.0)
    }

    /// The colour of `value`.
    pub fn colour(&self, value: f64) -> Rgb {
        if value.is_nan() { NOTHING } else { self.colour_at(self.position(value)) }
    }

    /// The colour at a place of the scale.
    pub fn colour_at(&self, position: f64) -> Rgb {
        self.gradient.eval_continuous(position).as_array()
    }

    /// Round numbers to label, both ends among them.
    pub fn ticks(&self) -> Vec<f64> {
        if let Some(step) = self.step {
            let count = ((self.high - self.low) / step).round() as u32;
            return (0..=count).map(|i| self.low + f64::from(i) * step).collect();
        }
        let mut ticks = vec![self.low];
        while let Some(&last) = ticks.last().filter(|&&t| t < self.high) {
            ticks.push(next_round(last * 1.5));
        }
        // Over many decades the powers of ten and the ends are enough, where their labels do not touch.
        if ticks.len() > 10 {
            let apart = |t: f64| (0.07..=0.93).contains(&self.position(t));
            let power = |t: f64| t == round_number(1, exponent_below(t));
            ticks.retain(|&t| t == self.low || t == self.high || (power(t) && apart(t)));
        }
        ticks
    }

    /// The scale in words.
    pub fn words(&self, unit: &str) -> String {
        let kind = if self.step.is_none() { "logarithmic" } else { "linear" };
        let mut words = format!("{kind} scale {} .. {} {unit}", label(self.low), label(self.high));
        for (count, side) in [(self.below, "below"), (self.above, "above")] {
            match count {
                0 => {}
                1 => words += &format!(", 1 bin {side}"),
                _ => words += &format!(", {count} bins {side}"),
            }
        }
        words
    }
}

/// Round ends for the ascending numbers `sorted`, and the step between labels if the scale is linear.
fn limits(sorted: &[f64], from_zero: bool) -> (f64, f64, Option<f64>) {
    let (Some(&least), Some(&most)) = (sorted.first(), sorted.last()) else { return (0.0, 1.0, Some(0.2)) };
    let top = quantile(sorted, 0.995);
    let high = if most <= 2.0 * top || top <= 0.0 { most } else { top };
    let positive = &sorted[sorted.partition_point(|&x| x <= 0.0)..];
    if least >= 0.0 && !positive.is_empty() && high > LOGARITHMIC_FROM * quantile(positive, 0.02) {
        let high = next_round(high);
        let low = previous_round(quantile(positive, 0.005)).max(previous_round(high / LARGEST_RATIO));
        return (low, high, None);
    }
    // Numbers close together show nothing on a scale from zero.
    let apart = from_zero || least <= 0.5 * high || least >= high;
    linear_limits(if apart { least.min(0.0) } else { least }, high.max(0.0))
}

/// Round ends of a linear scale that contains `least` and `most`.
fn linear_limits(least: f64, most: f64) -> (f64, f64, Option<f64>) {
    if least >= most {
        return (least, least + 1.0, Some(0.2));
    }
    let step = next_round((most - least) / STEPS);
    let low = floor(least / step) * step;
    // A little less than a whole step is rounding, not a value beyond the last label.
    let steps = ceil((most - low) / step - 1e-9).max(1.0);
    (low, low + steps * step, Some(step))
}

/// The number below which the share `q` of the ascending numbers `sorted` lies.
fn quantile(sorted: &[f64], q: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * q).round() as usize]
}

/// The exponent of the largest power of ten not above `x`.
fn exponent_below(x: f64) -> i32 {
    let text = format!("{x:e}");
    let exponent = text.split_once('e').expect("scientific notation has an exponent").1;
    exponent.parse().expect("a printed number reads back")
}

/// `digit` times ten to the power `exponent`: the very number that its label reads back to, which a product is not.
fn round_number(digit: u32, exponent: i32) -> f64 {
    format!("{digit}e{exponent}").parse().expect("a printed number reads back")
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `x`.
fn next_round(x: f64) -> f64 {
    let exponent = exponent_below(x);
    let candidates = [1, 2, 5].map(|digit| round_number(digit, exponent));
    candidates.into_iter().find(|&c| c >= x).unwrap_or_else(|| round_number(1, exponent + 1))
}

/// The largest of 1, 2, 5 times a power of ten that is not above `x`.
fn previous_round(x: f64) -> f64 {
    let exponent = exponent_below(x);
    let candidates = [5, 2].map(|digit| round_number(digit, exponent));
    candidates.into_iter().find(|&c| c <= x).unwrap_or_else(|| round_number(1, exponent))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scale(values: &[f64]) -> Scale {
        Scale::fit(values.iter().copied(), colorous::VIRIDIS, false)
    }

    #[test]
    fn round_numbers_are_those_of_a_ruler() {
        assert_eq!([next_round(0.3), next_round(0.2), next_round(7.0), next_round(1001.0)], [0.5, 0.2, 10.0, 2000.0]);
        assert_eq!([previous_round(0.3), previous_round(0.2), previous_round(999.0)], [0.2, 0.2, 500.0]);
        for k in -30..30 {
            let x: f64 = round_number(1, k);
            assert_eq!((round_number(1, exponent_below(x)), next_round(x), previous_round(x)), (x, x, x));
        }
    }

    #[test]
    fn close_values_get_a_linear_scale_that_contains_them() {
        let s = scale(&[410.0, 425.0, 498.0]);
        assert!(s.step.is_some());
        assert_eq!((s.low, s.high), (400.0, 500.0));
        assert_eq!(s.ticks(), [400.0, 420.0, 440.0, 460.0, 480.0, 500.0]);
        assert_eq!(s.words("lx"), "linear scale 400 .. 500 lx");
        let zero = Scale::fit([410.0, 498.0].into_iter(), colorous::VIRIDIS, true);
        assert_eq!((zero.low, zero.high), (0.0, 500.0));
        let narrow = scale(&[0.6489, 0.7863]).ticks();
        assert!((narrow[0] - 0.64).abs() < 1e-12 && (narrow[narrow.len() - 1] - 0.8).abs() < 1e-12, "{narrow:?}");
        assert_eq!((s.position(400.0), s.position(450.0), s.position(600.0)), (0.0, 0.5, 1.0));
    }

    #[test]
    fn wide_values_get_a_logarithmic_scale_with_zero_at_its_low_end() {
        let s = scale(&[0.0, 1.0, 3.0, 10.0, 900.0, 1000.0]);
        assert!(s.step.is_none());
        assert_eq!((s.low, s.high), (1.0, 1000.0));
        assert_eq!(s.ticks(), [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0]);
        assert_eq!(s.words("cd/m2"), "logarithmic scale 1 .. 1000 cd/m2, 1 bin below");
        assert!((s.position(10.0) - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(s.colour(0.0), s.colour_at(0.0));
        let wide = scale(&[1.0, 10.0, 1e5]).ticks();
        assert_eq!(wide, [1.0, 10.0, 100.0, 1e3, 1e4, 1e5]);
    }

    #[test]
    fn a_lamp_does_not_stretch_the_scale() {
        let mut values = vec![1e6];
        values.extend((0..999).map(|i| 50.0 + f64::from(i) * 0.05));
        let s = scale(&values);
        assert!(s.high <= 100.0 && s.above == 1, "{}", s.words("lx"));
    }

    #[test]
    fn nothing_equal_and_missing_values_do_not_break_a_scale() {
        for values in
            [&[][..], &[0.0, 0.0], &[7.0, 7.0], &[f64::NAN], &[-3.0, -3.0], &[f64::INFINITY], &[1e-300, 1e300]]
        {
            let s = scale(values);
            assert!(s.low < s.high, "{values:?}");
            assert!(s.ticks().len() >= 2 && s.ticks().len() < 14, "{values:?}: {:?}", s.ticks());
        }
        assert_eq!(scale(&[1.0]).colour(f64::NAN), NOTHING);
    }
}
