//! The content of a `.harmonic` file: a series with its centre (docs/harmonic-format.md).
//!
//! ```text
//! lampyris harmonic 1
//! convention schmidt-real
//! center 0.01 -0.2 1.5
//! degree 32
//! numbers f32
//! <empty line, then (N+1)^2 numbers, little-endian: of each degree k = 0 ..= N c_k0, c_k1, s_k1, ... c_kk, s_kk>
//! ```

use super::{MAX_DEGREE, Series};
use crate::error::{Error, Result};
use crate::math::DVec3;

const VERSION: &str = "lampyris harmonic 1";
const CONVENTION: &str = "schmidt-real";
/// Bytes of a header, at most.
const LONGEST: usize = 512;
/// The farthest coordinate of a centre \[m\].
const FARTHEST: f64 = 1e12;

/// How the coefficients are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Numbers {
    /// Four bytes each.
    F32,
    /// Eight bytes each.
    F64,
}

impl Numbers {
    /// Both.
    pub const ALL: [Numbers; 2] = [Numbers::F32, Numbers::F64];

    /// As it stands in a file.
    pub fn name(self) -> &'static str {
        match self {
            Numbers::F32 => "f32",
            Numbers::F64 => "f64",
        }
    }

    fn bytes(self) -> usize {
        match self {
            Numbers::F32 => 4,
            Numbers::F64 => 8,
        }
    }
}

/// What a file says: |x - center| = r in the coordinates of the mesh that it stands for.
#[derive(Clone, Debug, PartialEq)]
pub struct File {
    /// The centre \[m\].
    pub center: DVec3,
    /// r \[m\].
    pub series: Series,
}

impl File {
    /// The bytes of the file.
    pub fn bytes(&self, numbers: Numbers) -> Vec<u8> {
        let DVec3 { x, y, z } = self.center;
        let (degree, kind) = (self.series.degree(), numbers.name());
        let header = format!(
            "{VERSION}\nconvention {CONVENTION}\ncenter {x:?} {y:?} {z:?}\ndegree {degree}\nnumbers {kind}\n\n"
        );
        let mut bytes = header.into_bytes();
        let pairs = self.series.pairs();
        for k in 0..=degree {
            for m in 0..=k {
                let pair = pairs[k * (k + 1) / 2 + m];
                for &coefficient in if m == 0 { &pair[..1] } else { &pair[..] } {
                    match numbers {
                        Numbers::F32 => bytes.extend((coefficient as f32).to_le_bytes()),
                        Numbers::F64 => bytes.extend(coefficient.to_le_bytes()),
                    }
                }
            }
        }
        bytes
    }

    /// The content of the file called `name`, whoever wrote it.
    ///
    /// # Errors
    /// [`Error::Input`] for whatever is not as the format says; nothing is allocated on the word of a header.
    pub fn parse(name: &str, bytes: &[u8]) -> Result<File> {
        let bad = |field: &str, value: &str, allowed: String| Error::input(name, field, value, allowed);
        let end = bytes.windows(2).take(LONGEST).position(|w| w == b"\n\n");
        let end =
            end.ok_or_else(|| bad("header", "none", format!("lines of text, then an empty one: `{VERSION}` ...")))?;
        let header = std::str::from_utf8(&bytes[..end]).map_err(|_| bad("header", "not UTF-8", "UTF-8 text".into()))?;
        let mut lines = header.lines();
        let first = lines.next().unwrap_or_default();
        if first != VERSION {
            return Err(bad("version", first, format!("`{VERSION}`")));
        }
        let mut field = |key: &str| match lines.next().and_then(|line| line.split_once(' ')) {
            Some((found, value)) if found == key => Ok(value),
            other => Err(bad(key, &format!("{other:?}"), format!("a line `{key} ...` here"))),
        };
        let convention = field("convention")?;
        if convention != CONVENTION {
            return Err(bad("convention", convention, format!("`{CONVENTION}`")));
        }
        let center = field("center")?;
        let center = triple(center).ok_or_else(|| {
            bad("center", center, format!("three numbers within {FARTHEST:e} m, with a space between"))
        })?;
        let degree = field("degree")?;
        let n: usize = degree
            .parse()
            .ok()
            .filter(|&n| n <= MAX_DEGREE)
            .ok_or_else(|| bad("degree", degree, format!("0 ..= {MAX_DEGREE}")))?;
        let kind = field("numbers")?;
        let numbers = Numbers::ALL.into_iter().find(|n| n.name() == kind);
        let numbers = numbers.ok_or_else(|| bad("numbers", kind, "`f32` or `f64`".into()))?;
        if let Some(line) = lines.next() {
            return Err(bad("header", line, "no more lines".into()));
        }
        let (body, expected) = (&bytes[end + 2..], (n + 1) * (n + 1) * numbers.bytes());
        if body.len() != expected {
            let allowed = format!("{expected} of degree {n} in {kind}");
            return Err(bad("bytes of coefficients", &body.len().to_string(), allowed));
        }
        let mut coefficients = body.chunks_exact(numbers.bytes()).map(|b| match numbers {
            Numbers::F32 => f64::from(f32::from_le_bytes(b.try_into().expect("4 bytes"))),
            Numbers::F64 => f64::from_le_bytes(b.try_into().expect("8 bytes")),
        });
        let mut pairs = Vec::with_capacity((n + 1) * (n + 2) / 2);
        for k in 0..=n {
            for m in 0..=k {
                let mut next = || coefficients.next().expect("as many as were counted");
                pairs.push([next(), if m == 0 { 0.0 } else { next() }]);
            }
        }
        let series = Series::new(&pairs).map_err(|e| bad("coefficients", "refused", e.to_string()))?;
        Ok(File { center, series })
    }
}

fn triple(text: &str) -> Option<DVec3> {
    let mut numbers = text.split(' ').map(|n| n.parse::<f64>().ok().filter(|n| n.abs() <= FARTHEST));
    let triple = DVec3::new(numbers.next()??, numbers.next()??, numbers.next()??);
    numbers.next().is_none().then_some(triple)
}
