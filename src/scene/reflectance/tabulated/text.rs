//! The text of a tabulated law (docs/brdf-format.md).

use super::Tabulated;
use crate::error::{Error, Result};
use crate::math::PI;
use crate::photometry::Colour;

/// First words of a file.
const MAGIC: &str = "lampyris-brdf 1";
/// Most polar angles, and most azimuths.
const MOST_ANGLES: usize = 256;
/// Greatest value \[1/sr\].
const MOST: f64 = 1e6;
/// How much a value may differ from that of the exchanged directions, as a share of the greater.
const TOLERATED: f64 = 0.1;
/// How much of what it receives a table may seem to reflect: what rounded decimals make of all.
const FULL: f64 = 1.0 + 1e-6;

impl Tabulated {
    /// Reads the table `bytes` of the file `name`.
    ///
    /// # Errors
    /// [`Error::Input`] naming line, value and what is allowed: for a text of another form, values out of range, a law that is not
    /// reciprocal within a tenth, and one that reflects more than it receives.
    pub fn parse(name: &str, bytes: &[u8]) -> Result<Tabulated> {
        let text =
            std::str::from_utf8(bytes).map_err(|_| Error::input(name, "(encoding)", "not UTF-8", "UTF-8 text"))?;
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut lines = Lines { name, lines: text.lines().enumerate(), at: 1, said: "" };
        let first = lines.next("lampyris-brdf 1")?;
        if first.split_whitespace().collect::<Vec<_>>().join(" ") != MAGIC {
            return Err(lines.bad(first, "the words `lampyris-brdf 1`"));
        }
        let channels = match lines.named("channels")?[..] {
            [1.0] => 1,
            [3.0] => 3,
            _ => return Err(lines.bad(lines.said, "channels 1, or channels 3")),
        };
        let polar = lines.angles("theta", 90.0)?;
        let azimuths = lines.angles("phi", 180.0)?;
        // As much memory as there is text: the angles alone promise what they like.
        let (mut values, mut places) = (Vec::new(), Vec::new());
        for _ in 0..polar.len() * polar.len() {
            let row = lines.numbers(azimuths.len() * channels)?;
            places.push(lines.at);
            values.extend(row.chunks(channels).map(|c| Colour(std::array::from_fn(|k| c[k.min(channels - 1)]))));
        }
        if let Ok(more) = lines.next("") {
            return Err(lines.bad(more, "no line after the last value"));
        }
        let values = symmetric(name, (&polar, &azimuths), values, &places)?;
        let law = Tabulated::new(polar, azimuths, values);
        law.check_energy(name)?;
        Ok(law)
    }

    fn check_energy(&self, name: &str) -> Result<()> {
        for (theta, albedo) in self.0.polar.iter().zip(&self.0.albedos) {
            if albedo.max() > FULL {
                let field = format!("reflectance at theta {}", (theta * 18000.0 / PI).round() / 100.0);
                let allowed = "at most 1: no law reflects more than it receives";
                return Err(Error::input(name, field, format!("{:.4}", albedo.max()), allowed));
            }
        }
        Ok(())
    }
}

/// The mean of `values` and those of the exchanged directions, which must be nearly the same; along the normal also over the azimuth.
/// `places` are the lines of the pairs of polar angles.
fn symmetric(name: &str, (polar, phi): (&[f64], &[f64]), values: Vec<Colour>, places: &[usize]) -> Result<Vec<Colour>> {
    let (n, azimuths) = (polar.len(), phi.len());
    let mut both = values.clone();
    for i in 0..n {
        for j in 0..n {
            for k in 0..azimuths {
                let (a, b) = (values[(i * n + j) * azimuths + k], values[(j * n + i) * azimuths + k]);
                let far = |c: &usize| (a.0[*c] - b.0[*c]).abs() > TOLERATED * a.0[*c].max(b.0[*c]);
                if let Some(c) = (0..3).find(far) {
                    let [from, to, phi] = [polar[i], polar[j], phi[k]].map(|x| (x * 18000.0 / PI).round() / 100.0);
                    let field = format!("f for theta {from} and {to}, phi {phi} (line {})", places[i * n + j]);
                    let allowed = format!(
                        "within a tenth of {}, for theta {to} and {from} (line {}): a law is reciprocal",
                        b.0[c],
                        places[j * n + i]
                    );
                    return Err(Error::input(name, field, a.0[c], allowed));
                }
                // In one order, so that both have the same bits.
                let (first, second) = if i <= j { (a, b) } else { (b, a) };
                both[(i * n + j) * azimuths + k] = (first + second) * 0.5;
            }
        }
    }
    // Along the normal there is no azimuth.
    for (number, row) in both.chunks_mut(azimuths).enumerate() {
        if number < n || number % n == 0 {
            let mean = row.iter().copied().sum::<Colour>() / azimuths as f64;
            row.fill(mean);
        }
    }
    Ok(both)
}

/// The lines that say something.
struct Lines<'a> {
    name: &'a str,
    lines: std::iter::Enumerate<std::str::Lines<'a>>,
    /// Number and text of the last one.
    at: usize,
    said: &'a str,
}

impl<'a> Lines<'a> {
    fn bad(&self, value: &str, allowed: &str) -> Error {
        Error::input(self.name, format!("line {}", self.at), value, allowed)
    }

    fn next(&mut self, wanted: &str) -> Result<&'a str> {
        for (number, line) in self.lines.by_ref() {
            let said = line.split('#').next().unwrap_or("").trim();
            if !said.is_empty() {
                (self.at, self.said) = (number + 1, said);
                return Ok(said);
            }
        }
        Err(self.bad("(end of the file)", wanted))
    }

    fn parsed(&self, words: &str) -> Result<Vec<f64>> {
        let number = |word: &str| {
            let parsed = word.parse::<f64>().ok().filter(|x| (0.0..=MOST).contains(x));
            parsed.ok_or_else(|| self.bad(word, "numbers of 0 .. 1e6, with a decimal point"))
        };
        words.split_whitespace().map(number).collect()
    }

    /// The numbers after the word `key`.
    fn named(&mut self, key: &str) -> Result<Vec<f64>> {
        let line = self.next(key)?;
        let rest = line.strip_prefix(key).filter(|rest| rest.starts_with(char::is_whitespace));
        self.parsed(rest.ok_or_else(|| self.bad(line, &format!("the word {key} and numbers")))?)
    }

    fn numbers(&mut self, count: usize) -> Result<Vec<f64>> {
        let line = self.next("a line of values")?;
        let numbers = self.parsed(line)?;
        match numbers.len() == count {
            true => Ok(numbers),
            false => {
                let allowed = format!("{count} numbers: one for each phi and channel");
                Err(self.bad(&format!("{} numbers", numbers.len()), &allowed))
            }
        }
    }

    /// Angles in degrees, from 0 on, to radians.
    fn angles(&mut self, key: &str, most: f64) -> Result<Vec<f64>> {
        let degrees = self.named(key)?;
        let ascend = degrees.windows(2).all(|w| w[0] < w[1]);
        let inside = degrees.first() == Some(&0.0) && degrees.last().is_some_and(|&last| last <= most);
        if !(ascend && inside && degrees.len() <= MOST_ANGLES) {
            let allowed = format!("1 .. {MOST_ANGLES} ascending angles from 0 to at most {most}");
            return Err(self.bad(self.said, &allowed));
        }
        Ok(degrees.into_iter().map(|x| x * PI / 180.0).collect())
    }
}
