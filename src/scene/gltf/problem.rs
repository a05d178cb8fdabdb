//! How a fault in the file is named, and how what is ignored is collected.

use std::collections::HashSet;
use std::fmt::Display;

use crate::error::{Error, Result};

/// The name of the scene file, for errors.
#[derive(Clone, Copy)]
pub struct File<'a>(pub &'a str);

impl File<'_> {
    /// The error that `field` holds `value` where only `allowed` is accepted.
    pub fn bad(self, field: impl Display, value: impl Display, allowed: impl Display) -> Error {
        Error::input(self.0, field, value, allowed)
    }

    /// Item `index` of `list`, which is called `name`; `field` is where the index stands.
    pub fn item<'a, T>(self, list: &'a [T], name: &str, index: usize, field: impl Display) -> Result<&'a T> {
        list.get(index).ok_or_else(|| {
            let count = list.len();
            self.bad(field, index, format!("an index into `{name}`, which has {count}"))
        })
    }

    /// `value`, if it lies in `low ..= high`.
    pub fn between(self, field: impl Display, value: f64, low: f64, high: f64) -> Result<f64> {
        if value >= low && value <= high {
            return Ok(value);
        }
        let allowed = if high == f64::MAX { format!("{low} or more") } else { format!("{low} .. {high}") };
        Err(self.bad(field, value, allowed))
    }

    /// `values`, if each lies in `low ..= high`.
    pub fn all_between<const N: usize>(
        self,
        field: impl Display,
        values: [f64; N],
        low: f64,
        high: f64,
    ) -> Result<[f64; N]> {
        for (i, &value) in values.iter().enumerate() {
            self.between(format_args!("{field}[{i}]"), value, low, high)?;
        }
        Ok(values)
    }
}

/// What was ignored or replaced; each message once, in order of appearance.
#[derive(Default)]
pub struct Warnings {
    list: Vec<String>,
    seen: HashSet<String>,
}

impl Warnings {
    /// Adds `message` unless it is there.
    pub fn add(&mut self, message: impl ToString) {
        let message = message.to_string();
        if self.seen.insert(message.clone()) {
            self.list.push(message);
        }
    }

    /// The messages.
    pub fn into_list(self) -> Vec<String> {
        self.list
    }
}
