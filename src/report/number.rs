//! Numbers for human eyes. Files for machines print every digit instead.

/// `x` with `digits` significant digits: plain between 1e-4 and 1e6, with a power of ten elsewhere.
pub fn short(x: f64, digits: usize) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x:?}").trim_end_matches(".0").to_owned();
    }
    let scientific = format!("{x:.*e}", digits.max(1) - 1);
    // The exponent after rounding: 9.996 at three digits is 1.00e1.
    let exponent: i32 = scientific.split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0);
    if !(-4..6).contains(&exponent) {
        return scientific;
    }
    let decimals = (digits as i32 - 1 - exponent).max(0);
    format!("{x:.*}", decimals as usize)
}

/// `x` with at most six significant digits and no trailing zeros: labels of a scale.
pub(super) fn label(x: f64) -> String {
    let text = short(x, 6);
    let (mantissa, exponent) = text.split_once('e').map_or((text.as_str(), None), |(m, e)| (m, Some(e)));
    let mantissa = if mantissa.contains('.') { mantissa.trim_end_matches('0').trim_end_matches('.') } else { mantissa };
    exponent.map_or(mantissa.to_owned(), |e| format!("{mantissa}e{e}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_keeps_significant_digits() {
        let cases = [
            (0.0, "0"),
            (12.3456, "12.35"),
            (9.9996, "10.00"),
            (0.000123456, "0.0001235"),
            (1234567.0, "1.235e6"),
            (123456.0, "123456"),
            (-2.5, "-2.500"),
            (1e-9, "1.000e-9"),
            (f64::NAN, "NaN"),
        ];
        for (x, text) in cases {
            assert_eq!(short(x, 4), text);
        }
    }

    #[test]
    fn label_has_no_trailing_zeros() {
        for (x, text) in [(0.0, "0"), (0.5, "0.5"), (200.0, "200"), (2e7, "2e7"), (1e-6, "1e-6"), (0.25, "0.25")] {
            assert_eq!(label(x), text);
        }
    }
}
