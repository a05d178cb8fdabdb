//! Faults of form in a job file, in the words of those who write one.
//!
//! serde speaks of the types of Rust, and of a table whose `kind` says which keys it has it does not say which of them is wrong. Both
//! are put right here, once reading has failed.

use super::Job;
use crate::error::{Error, Result, in_words, listed};
use serde::Deserialize;
use serde_path_to_error::{Path, Segment};
use std::ops::Range;
use toml::de::{DeTable, DeValue};

/// Tables that a job has once.
const SINGLE: [&str; 4] = ["run", "transport", "stop", "sky"];
/// How they are written.
const ONE_TABLE: &str = "one table: [...], in single brackets";

/// A step from a table or a list to what stands in it.
#[derive(Clone)]
enum Step {
    Key(String),
    Index(usize),
}

/// The job in `text`, nothing filled in or checked; `file` is its name in errors.
///
/// # Errors
/// [`Error::Input`] naming line, field, value and what is allowed.
pub(super) fn job(text: &str, file: &str) -> Result<Job> {
    let toml = toml::Deserializer::parse(text).map_err(|error| {
        let (number, line) = line_of(text, error.span());
        Error::input(file, format!("(syntax) (line {number})"), line, error.message())
    })?;
    serde_path_to_error::deserialize(toml).map_err(|error| fault(text, file, error.path(), error.inner()))
}

/// What is wrong at `path`, where reading failed with `error`.
fn fault(text: &str, file: &str, path: &Path, error: &toml::de::Error) -> Error {
    let message = error.message();
    let mut steps: Vec<Step> = path.iter().filter_map(step).collect();
    // Names stand between back quotes: first that which does not fit, then those that do.
    let names: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    let (missing, unknown) = (message.starts_with("missing field"), message.starts_with("unknown field"));
    let named = names.first().filter(|_| missing || unknown).map(|name| name.to_string());
    // A table read as a list: of which of its keys serde complains does not matter.
    let twice = matches!(&steps[..], [Step::Key(key), Step::Index(_), ..] if SINGLE.contains(&key.as_str()));
    if twice {
        steps.truncate(1);
    } else if let Some(key) = named.or_else(|| culprit(text, &steps, message))
        && !matches!(steps.last(), Some(Step::Key(last)) if *last == key)
    {
        steps.push(Step::Key(key));
    }
    let (place, value) = found(text, &steps).unwrap_or((error.span(), None));
    let (number, line) = line_of(text, place);
    let value = if missing { "(missing)" } else { value.unwrap_or(line) };
    let allowed = match names.split_first() {
        _ if twice => ONE_TABLE.to_owned(),
        Some((&"kind", _)) if missing => kinds(text, &steps),
        _ if missing => "a value: this key has no default".to_owned(),
        Some((&"scene", _)) if unknown => "above the first [table]: what stands below one belongs to it".to_owned(),
        Some((name, others)) if unknown => {
            format!("a key that is known here: {}", listed(name, others.iter().copied()))
        }
        Some((name, others)) if message.starts_with("unknown variant") => {
            format!("one of {}", listed(name, others.iter().copied()))
        }
        _ => wanted(message),
    };
    Error::input(file, format!("{} (line {number})", shown(&steps)), value, allowed)
}

fn step(segment: &Segment) -> Option<Step> {
    match segment {
        Segment::Map { key } => Some(Step::Key(key.clone())),
        Segment::Seq { index } => Some(Step::Index(*index)),
        Segment::Enum { .. } | Segment::Unknown => None,
    }
}

/// `source[0].size`.
fn shown(steps: &[Step]) -> String {
    let text: String = steps
        .iter()
        .map(|step| match step {
            Step::Key(key) => format!(".{key}"),
            Step::Index(index) => format!("[{index}]"),
        })
        .collect();
    text.trim_start_matches('.').to_owned()
}

/// The key of the table at `steps`, an entry with a `kind`, whose value brings about `message`: with this key alone it still comes, for
/// keys that are missing are complained of last.
fn culprit(text: &str, steps: &[Step], message: &str) -> Option<String> {
    let [Step::Key(list), Step::Index(index)] = steps else { return None };
    let mut job: toml::Table = text.parse().ok()?;
    let entry = job.get(list)?.get(index)?.as_table()?.clone();
    let mut alone = |key: &&String| {
        let part = entry.iter().filter(|(other, _)| other == key || *other == "kind");
        complaint(&mut job, (list, *index), part.map(|(k, v)| (k.clone(), v.clone())).collect()).as_deref()
            == Some(message)
    };
    // What comes with the kind alone is its own fault.
    let mut keys: Vec<&String> = entry.keys().collect();
    keys.sort_by_key(|key| *key != "kind");
    keys.into_iter().find(|key| alone(key)).cloned()
}

/// The kinds of the entry at `steps`, whose last is the key itself.
fn kinds(text: &str, steps: &[Step]) -> String {
    let [Step::Key(list), Step::Index(index), ..] = steps else { return String::new() };
    let none = toml::Table::from_iter([("kind".to_owned(), "".into())]);
    let said = text.parse().ok().and_then(|mut job| complaint(&mut job, (list, *index), none)).unwrap_or_default();
    format!("one of {}", listed("", said.split('`').skip(3).step_by(2)))
}

/// What serde says of `job` with `entry` in place number `index` of a list.
fn complaint(job: &mut toml::Table, (list, index): (&str, usize), entry: toml::Table) -> Option<String> {
    *job.get_mut(list)?.get_mut(index)? = entry.into();
    Some(Job::deserialize(job.clone()).err()?.message().to_owned())
}

/// Where the value at `steps` stands, or what it is missing from, and its text if it is there.
fn found<'a>(text: &'a str, steps: &[Step]) -> Option<(Option<Range<usize>>, Option<&'a str>)> {
    let root = DeTable::parse(text).ok()?;
    let (first, others) = match steps {
        [Step::Key(key), others @ ..] => (root.get_ref().get(key.as_str())?, others),
        _ => return None,
    };
    let mut value = first;
    for step in others {
        let next = match (step, value.get_ref()) {
            (Step::Key(key), DeValue::Table(table)) => table.get(key.as_str()),
            (Step::Index(index), DeValue::Array(array)) => array.get(*index),
            _ => None,
        };
        let Some(next) = next else { return Some((Some(value.span()), None)) };
        value = next;
    }
    Some((Some(value.span()), text.get(value.span())))
}

/// Number, from 1, and text of the line where `place` begins.
fn line_of(text: &str, place: Option<Range<usize>>) -> (usize, &str) {
    let before = text.get(..place.map_or(0, |place| place.start)).unwrap_or(text);
    let number = before.matches('\n').count();
    (number + 1, text.lines().nth(number).unwrap_or("").trim())
}

/// What `message` wants instead of what it has found.
fn wanted(message: &str) -> String {
    let Some((found, expected)) = message.split_once(", expected ") else {
        return if message == "wanted string or table" { in_words("a string") } else { message.to_owned() };
    };
    match expected {
        "a sequence" if found.ends_with("map") => "a list of tables: [[...]], in double brackets".to_owned(),
        _ if expected.starts_with("struct ") => ONE_TABLE.to_owned(),
        _ => in_words(expected),
    }
}
