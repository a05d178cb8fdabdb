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

/// The share `x`, which somebody typed, per cent: every digit of it, and none that the product with 100 would add.
pub(super) fn percent(x: f64) -> String {
    let scientific = format!("{x:e}");
    let (digits, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let hundredfold: f64 = format!("{digits}e{}", exponent + 2).parse().unwrap_or(f64::NAN);
    let shortest = format!("{hundredfold:?}");
    format!("{} %", shortest.trim_end_matches(".0"))
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
    fn percent_is_what_was_typed() {
        let cases = [
            (0.95, "95 %"),
            (0.07, "7 %"),
            (1.0, "100 %"),
            (0.9999999, "99.99999 %"),
            (0.9999999999999999, "99.99999999999999 %"),
            (0.0123456789, "1.23456789 %"),
            (1e-9, "1e-7 %"),
        ];
        for (x, text) in cases {
            assert_eq!(percent(x), text);
        }
    }

    #[test]
    fn label_has_no_trailing_zeros() {
        for (x, text) in [(0.0, "0"), (0.5, "0.5"), (200.0, "200"), (2e7, "2e7"), (1e-6, "1e-6"), (0.25, "0.25")] {
            assert_eq!(label(x), text);
        }
    }
}
