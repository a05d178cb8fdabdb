//! The text of a photometric file: lines and numbers, each with the place where it stands.

use crate::error::{Error, Result};

/// Longest file \[bytes\]: a web of a thousand by a thousand directions is shorter.
const LONGEST: usize = 1 << 24;

/// A file of text under the name by which it is called in errors.
#[derive(Clone, Copy)]
pub struct Named<'a>(pub &'a str);

impl Named<'_> {
    /// The error that `field` on line `line`, counted from 1, holds `value` where only `allowed` is accepted.
    pub fn bad(self, line: usize, field: &str, value: impl ToString, allowed: impl ToString) -> Error {
        Error::input(self.0, format!("{field} (line {line})"), value, allowed)
    }
}

/// The lines of a file: UTF-8, or else one character for each byte, as files of the nineties have it. All three ends of
/// line are understood, and what follows the end-of-file character of DOS is not text.
///
/// # Errors
/// [`Error::Input`] for a file that is too long or no text.
pub fn lines(name: Named, bytes: &[u8]) -> Result<Vec<String>> {
    if bytes.len() > LONGEST {
        return Err(name.bad(1, "file", format!("{} bytes", bytes.len()), format!("at most {LONGEST} bytes")));
    }
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    let bytes = bytes.split(|&b| b == 0x1A).next().unwrap_or_default();
    if bytes.contains(&0) {
        return Err(name.bad(1, "file", "bytes of value 0", "text in UTF-8 or Latin-1"));
    }
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    };
    // Sent as text by a program that thought it was not, a line ends twice.
    let text = text.replace("\r\r\n", "\n");
    Ok(text.replace("\r\n", "\n").replace('\r', "\n").split('\n').map(|line| line.trim().to_owned()).collect())
}

/// A finite number; with a point, or with a comma in its place where `comma` allows it.
pub fn number(text: &str, comma: bool) -> Option<f64> {
    let text = text.trim();
    let pointed = if comma { text.replacen(',', ".", 1) } else { text.to_owned() };
    pointed.parse().ok().filter(|x: &f64| x.is_finite())
}

/// What is wanted of a number.
#[derive(Clone, Copy)]
pub struct Wanted<'a> {
    field: &'a str,
    low: f64,
    high: f64,
    /// Whether `low` itself is refused.
    above: bool,
    unit: &'a str,
}

impl<'a> Wanted<'a> {
    /// A number in `low ..= high`.
    pub fn between(field: &'a str, low: f64, high: f64, unit: &'a str) -> Self {
        Wanted { field, low, high, above: false, unit }
    }

    /// A number above 0, at most `high`.
    pub fn positive(field: &'a str, high: f64, unit: &'a str) -> Self {
        Wanted { field, low: 0.0, high, above: true, unit }
    }

    /// The name of the field.
    pub fn field(&self) -> &'a str {
        self.field
    }

    /// True for what is accepted.
    pub fn accepts(&self, x: f64) -> bool {
        x <= self.high && (x > self.low || (x == self.low && !self.above))
    }

    /// What is accepted, in words.
    pub fn allowed(&self) -> String {
        let Wanted { low, high, unit, .. } = self;
        let text = if self.above {
            format!("above {low}, at most {high:e} {unit}")
        } else if self.high == f64::MAX {
            "a number".to_owned()
        } else {
            format!("{low} .. {} {unit}", if *high < 1e7 { high.to_string() } else { format!("{high:e}") })
        };
        text.trim_end().to_owned()
    }
}

/// Numbers one after the other, whatever the lines they stand on.
pub struct Numbers<'a> {
    name: Named<'a>,
    tokens: Vec<(usize, &'a str)>,
    comma: bool,
    next: usize,
    last_line: usize,
}

impl<'a> Numbers<'a> {
    /// The numbers of `lines`, the first of which has the number `first`, counted from 1. A comma is the decimal mark where `comma`
    /// says so, else it stands between numbers.
    pub fn new(name: Named<'a>, lines: &'a [String], first: usize, comma: bool) -> Self {
        let between = move |c: char| c.is_whitespace() || (!comma && c == ',');
        let words = move |line: &'a String| line.split(between).filter(|word| !word.is_empty());
        let tokens: Vec<_> =
            (first..).zip(lines).flat_map(|(n, line)| words(line).map(move |word| (n, word))).collect();
        Numbers { name, tokens, comma, next: 0, last_line: first + lines.len().saturating_sub(1) }
    }

    /// The line of the next number.
    pub fn line(&self) -> usize {
        self.tokens.get(self.next).map_or(self.last_line, |(line, _)| *line)
    }

    /// How many are left.
    pub fn left(&self) -> usize {
        self.tokens.len() - self.next
    }

    /// The next number, which must be as `wanted`.
    ///
    /// # Errors
    /// [`Error::Input`] where it is not, or the file ends.
    pub fn take(&mut self, wanted: Wanted) -> Result<f64> {
        let Some(&(line, word)) = self.tokens.get(self.next) else {
            return Err(self.name.bad(self.last_line, wanted.field, "the end of the file", wanted.allowed()));
        };
        self.next += 1;
        let accepted = number(word, self.comma).filter(|&x| wanted.accepts(x));
        accepted.ok_or_else(|| self.name.bad(line, wanted.field, word, wanted.allowed()))
    }

    /// The next number, which must be a whole one in `low ..= high`.
    ///
    /// # Errors
    /// As [`Numbers::take`].
    pub fn whole(&mut self, field: &str, low: usize, high: usize) -> Result<usize> {
        let line = self.line();
        let number = self.take(Wanted::between(field, low as f64, high as f64, ""))?;
        match number.fract() == 0.0 {
            true => Ok(number as usize),
            false => Err(self.name.bad(line, field, number, format!("a whole number, {low} .. {high}"))),
        }
    }

    /// The next number, a flux \[lm\], or -1 for `None`.
    ///
    /// # Errors
    /// As [`Numbers::take`].
    pub fn lumens(&mut self, field: &str) -> Result<Option<f64>> {
        let line = self.line();
        let lumens = self.take(Wanted::between(field, -1.0, 1e12, "lm"))?;
        match lumens {
            -1.0 => Ok(None),
            lumens if lumens > 0.0 => Ok(Some(lumens)),
            other => Err(self.name.bad(line, field, other, "above 0, or -1 for absolute photometry")),
        }
    }

    /// The next `count` numbers, each as `wanted`; none is taken where there are not so many.
    ///
    /// # Errors
    /// As [`Numbers::take`].
    pub fn list(&mut self, count: usize, wanted: Wanted) -> Result<Vec<f64>> {
        if count > self.left() {
            let left = format!("{} to the end of the file", self.left());
            return Err(self.name.bad(self.line(), wanted.field, left, format!("{count} numbers")));
        }
        (0..count).map(|_| self.take(wanted)).collect()
    }

    /// The next `count` numbers, growing.
    ///
    /// # Errors
    /// As [`Numbers::take`].
    pub fn growing(&mut self, count: usize, wanted: Wanted) -> Result<Vec<f64>> {
        let line = self.line();
        let list = self.list(count, wanted)?;
        match list.windows(2).find(|pair| pair[0] >= pair[1]) {
            None => Ok(list),
            Some(pair) => {
                let allowed = format!("{}, each above the one before", wanted.allowed());
                Err(self.name.bad(line, wanted.field, format!("{} after {}", pair[1], pair[0]), allowed))
            }
        }
    }
}
