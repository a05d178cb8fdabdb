//! Road-surface r-tables of CIE 144 as tabulated laws.
//!
//! r = q cos^3(gamma) is tabled in tan(gamma), gamma the angle of incidence, and in beta, the angle between the planes of incidence and of
//! observation, for an observer who looks down by 1 degree; q = L/E is f. For other directions of observation
//!
//! ```text
//! f(theta, theta', phi) = q(min(theta, theta'), beta),      beta = 180 - phi
//! ```
//!
//! which is what the table says where one of the two directions is that of the observer, and reciprocal.

use crate::error::{Error, Result};
use crate::math::{PI, atan2};
use std::fmt::Write;

/// Polar angle of an observer who looks down by 1 degree.
const OBSERVER: f64 = 89.0;
/// Most rows, and most columns.
const MOST: usize = 200;

/// The text of the tabulated law (docs/brdf-format.md) of the r-table `text`, from the file `name`: a line `beta` with angles in
/// degrees, then rows of tan(gamma) and 10^4 r; a dash stands for what is not given, and takes the q of the nearest angle that is.
///
/// # Errors
/// [`Error::Input`] naming the line, for whatever is not of this form.
pub fn law_of_road(name: &str, text: &str) -> Result<String> {
    let bad = |line: usize, value: &str, allowed: &str| Error::input(name, format!("line {line}"), value, allowed);
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let lines = text.lines().enumerate().map(|(i, line)| (i + 1, line.split('#').next().unwrap_or("").trim()));
    let mut lines = lines.filter(|(_, line)| !line.is_empty());
    let number = |line: usize, word: &str| {
        let parsed = word.parse::<f64>().ok().filter(|x| (0.0..=1e6).contains(x));
        parsed.ok_or_else(|| bad(line, word, "numbers of 0 .. 1e6, with a decimal point, or a dash"))
    };
    let (at, first) = lines.next().ok_or_else(|| bad(1, "(empty)", "a line of beta"))?;
    let words = first.strip_prefix("beta").ok_or_else(|| bad(at, first, "the word beta and angles in degrees"))?;
    let betas: Vec<f64> = words.split_whitespace().map(|w| number(at, w)).collect::<Result<_>>()?;
    let ascend = betas.windows(2).all(|w| w[0] < w[1]) && betas.len() <= MOST;
    if !ascend || betas.first() != Some(&0.0) || betas.last() != Some(&180.0) {
        return Err(bad(at, first, "beta and ascending angles from 0 to 180"));
    }
    let (mut gammas, mut rows) = (Vec::<f64>::new(), Vec::new());
    for (at, line) in lines {
        let words: Vec<&str> = line.split_whitespace().collect();
        if words.len() != betas.len() + 1 || gammas.len() == MOST {
            return Err(bad(at, line, &format!("tan(gamma) and {} values, in at most {MOST} rows", betas.len())));
        }
        let tan = number(at, words[0])?;
        let gamma = atan2(tan, 1.0);
        let follows = gammas.last().map_or(tan == 0.0, |&last| gamma > last);
        if !follows || gamma * 180.0 / PI >= OBSERVER {
            return Err(bad(at, words[0], "tan(gamma) ascending from 0, below 57"));
        }
        let given: Vec<Option<f64>> = words[1..]
            .iter()
            .map(|w| if *w == "-" { Ok(None) } else { number(at, w).map(Some) })
            .collect::<Result<_>>()?;
        let cos = 1.0 / (1.0 + tan * tan).sqrt();
        let row = filled(&given).ok_or_else(|| bad(at, line, "at least one value"))?;
        gammas.push(gamma);
        rows.push(row.into_iter().map(|r| 1e-4 * r / (cos * cos * cos)).collect::<Vec<f64>>());
    }
    let last = rows.last().cloned().ok_or_else(|| bad(1, "(no rows)", "at least one row"))?;
    gammas.push(OBSERVER * PI / 180.0);
    rows.push(last);
    Ok(written(&gammas, &betas, &rows))
}

/// The values, and for those that are not given the nearest one.
fn filled(given: &[Option<f64>]) -> Option<Vec<f64>> {
    let nearest = |i: usize| {
        let known = given.iter().enumerate().filter_map(|(j, value)| value.map(|v| (j.abs_diff(i), v)));
        known.min_by_key(|(distance, _)| *distance).map(|(_, value)| value)
    };
    (0..given.len()).map(nearest).collect()
}

fn written(gammas: &[f64], betas: &[f64], q: &[Vec<f64>]) -> String {
    let mut text =
        String::from("lampyris-brdf 1\n# from an r-table: f = q(min(theta, theta'), 180 - phi)\nchannels 1\ntheta");
    for gamma in gammas {
        write!(text, " {}", gamma * 180.0 / PI).expect("a string takes all");
    }
    text.push_str("\nphi");
    for beta in betas.iter().rev() {
        write!(text, " {}", 180.0 - beta).expect("a string takes all");
    }
    text.push('\n');
    for i in 0..gammas.len() {
        for j in 0..gammas.len() {
            let words: Vec<String> = q[i.min(j)].iter().rev().map(f64::to_string).collect();
            text.push_str(&words.join(" "));
            text.push('\n');
        }
    }
    text
}
