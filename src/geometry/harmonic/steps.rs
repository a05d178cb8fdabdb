//! How far a function of one variable certainly has no zero, by its derivatives in one place and their bounds elsewhere.

/// Halvings between the zero of the parabola, or what is enough, in search of that of the cubic.
const HALVINGS: u32 = 4;

/// A function and its derivatives in one place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Taylor {
    pub(super) value: f64,
    pub(super) first: f64,
    pub(super) second: f64,
}

impl Taylor {
    /// The same of the function times `k`.
    pub(super) fn times(self, k: f64) -> Taylor {
        Taylor { value: k * self.value, first: k * self.first, second: k * self.second }
    }

    /// The same less what it may be too great by.
    pub(super) fn less(self, errors: Taylor) -> Taylor {
        Taylor {
            value: self.value - errors.value,
            first: self.first - errors.first,
            second: self.second - errors.second,
        }
    }

    /// The zero of value + first s + second s^2/2 that the tangent of a falling function leads to, ahead or behind; where there is none, twice as far
    /// as that of the tangent.
    pub(super) fn root(&self) -> f64 {
        let turns = self.first * self.first - 2.0 * self.second * self.value;
        2.0 * self.value / (turns.max(0.0).sqrt() - self.first)
    }

    /// value + first s + second s^2/2 - third s^3/6: the least that the function can be at s.
    fn least(&self, s: f64, third: f64) -> f64 {
        self.value + s * (self.first + s * (0.5 * self.second - s * third / 6.0))
    }

    /// True where `least` is not negative from 0 to `s`. Its second derivative falls, so it has one minimum between at most, where it falls
    /// first and then bends up.
    fn is_clear(&self, s: f64, third: f64) -> bool {
        if self.least(s, third) < 0.0 {
            return false;
        }
        let turns = self.second * self.second + 2.0 * third * self.first;
        if self.first >= 0.0 || self.second <= 0.0 || turns < 0.0 {
            return true;
        }
        // The smaller root of the derivative, without cancellation.
        let lowest = -2.0 * self.first / (self.second + turns.sqrt());
        lowest >= s || self.least(lowest, third) >= 0.0
    }
}

/// A step within which a function has no zero that starts as `at`, whose value is not negative, and whose second and third derivatives
/// stay within the bounds given: `enough` where it is clear that far; else to the zero of the parabola, or near that of the cubic where it
/// reaches farther.
pub(super) fn safe_step(at: &Taylor, [second, third]: [f64; 2], enough: f64) -> f64 {
    let value = at.value.max(0.0);
    if at.is_clear(enough, third) {
        return enough;
    }
    let root = (at.first * at.first + 2.0 * second * value).sqrt();
    let parabola = if at.first > 0.0 { (at.first + root) / second } else { 2.0 * value / (root - at.first) };
    if parabola >= enough {
        return enough;
    }
    let (mut clear, mut blocked) = (parabola, enough);
    for _ in 0..HALVINGS {
        let middle = if blocked > 4.0 * clear { (clear * blocked).sqrt() } else { 0.5 * (clear + blocked) };
        *(if at.is_clear(middle, third) { &mut clear } else { &mut blocked }) = middle;
    }
    clear
}
