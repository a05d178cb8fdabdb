//! How far a function of one variable certainly has no zero, by its derivatives in one place and their bounds elsewhere.

/// Times by which the cubic may outreach the parabola.
const REACH: f64 = 1024.0;
/// Halvings of the step, of a factor [`REACH`] in all, in search of the zero of the cubic.
const HALVINGS: u32 = 12;

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
/// stay within the bounds given: to the zero of the parabola, or near that of the cubic where it reaches farther.
pub(super) fn safe_step(at: &Taylor, [second, third]: [f64; 2]) -> f64 {
    let value = at.value.max(0.0);
    let root = (at.first * at.first + 2.0 * second * value).sqrt();
    let parabola = if at.first > 0.0 { (at.first + root) / second } else { 2.0 * value / (root - at.first) };
    if at.is_clear(REACH * parabola, third) {
        return REACH * parabola;
    }
    let (mut clear, mut blocked) = (1.0, REACH);
    for _ in 0..HALVINGS {
        let middle = if blocked > 4.0 * clear { (clear * blocked).sqrt() } else { 0.5 * (clear + blocked) };
        *(if at.is_clear(middle * parabola, third) { &mut clear } else { &mut blocked }) = middle;
    }
    clear * parabola
}
