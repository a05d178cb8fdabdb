//! What distinguishes two plans, in words: field paths with both values, input files by name.

use super::{Input, Plan};
use serde_json::Value;

/// Fields of a job that may change without touching the content of a shard: `scene` is a name, and inputs count
/// by content.
const FREE: [&str; 6] = ["scene", "run.batches", "run.confidence", "run.checkpoint_seconds", "stop", "ratio"];

impl Plan {
    /// What makes the shards of this plan differ from those of `old`, one line each; empty when nothing does.
    pub fn differences(&self, old: &Plan) -> Vec<String> {
        if self.digest == old.digest {
            return Vec::new();
        }
        let mut lines = Vec::new();
        if self.numerics != old.numerics {
            lines.push(line("numerics", old.numerics, self.numerics));
        }
        let value = |plan: &Plan| serde_json::to_value(&plan.job).expect("a job has string keys only");
        compare("", &value(old), &value(self), &mut lines);
        compare_inputs(&old.inputs, &self.inputs, &mut lines);
        if lines.is_empty() {
            lines.push(line("digest", &old.digest, &self.digest));
        }
        lines
    }

    /// What forbids this plan to continue the work of `old`: the differences, and fewer batches. More batches
    /// extend the work; confidence, checkpoint_seconds and the goal may change.
    pub fn obstacles(&self, old: &Plan) -> Vec<String> {
        let mut lines = self.differences(old);
        let (before, now) = (old.job.run.batches, self.job.run.batches);
        if now < before {
            lines.push(format!(
                "{} (more batches extend the work, fewer are refused)",
                line(self.job.batches_field(), before, now)
            ));
        }
        lines
    }
}

fn line(path: &str, old: impl std::fmt::Display, new: impl std::fmt::Display) -> String {
    format!("{path}: {old} in the plan, {new} now")
}

fn compare(path: &str, old: &Value, new: &Value, lines: &mut Vec<String>) {
    if old == new || FREE.contains(&path) {
        return;
    }
    match (old, new) {
        (Value::Object(a), Value::Object(b)) => {
            let added = b.keys().filter(|k| !a.contains_key(*k));
            for key in a.keys().chain(added) {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                compare(
                    &path,
                    &a.get(key).cloned().unwrap_or_default(),
                    &b.get(key).cloned().unwrap_or_default(),
                    lines,
                );
            }
        }
        (Value::Array(a), Value::Array(b)) if is_list(old) && is_list(new) => compare_lists(path, a, b, lines),
        (Value::Null, Value::Array(b)) if is_list(new) => compare_lists(path, &[], b, lines),
        (Value::Array(a), Value::Null) if is_list(old) => compare_lists(path, a, &[], lines),
        _ => lines.push(line(path, shown(old), shown(new))),
    }
}

/// True for a list of entries; vectors of numbers read better whole.
fn is_list(value: &Value) -> bool {
    value.as_array().is_some_and(|a| !a.iter().all(Value::is_number))
}

fn compare_lists(path: &str, old: &[Value], new: &[Value], lines: &mut Vec<String>) {
    for i in 0..old.len().max(new.len()) {
        match (old.get(i), new.get(i)) {
            (Some(a), Some(b)) => compare(&format!("{path}[{i}]"), a, b, lines),
            (a, b) => lines.push(line(&format!("{path}[{i}]"), entry(a), entry(b))),
        }
    }
}

/// An entry that only one of two lists has: its name where it has one.
fn entry(value: Option<&Value>) -> String {
    match value {
        None => "(none)".to_owned(),
        Some(v) => v.get("name").map_or_else(|| shown(v), shown),
    }
}

fn shown(value: &Value) -> String {
    if value.is_null() { "(none)".to_owned() } else { value.to_string() }
}

fn compare_inputs(old: &[Input], new: &[Input], lines: &mut Vec<String>) {
    for i in 0..old.len().max(new.len()) {
        match (old.get(i), new.get(i)) {
            (Some(a), Some(b)) if a.digest == b.digest => {}
            (Some(a), Some(b)) if a.name == b.name => {
                lines.push(format!("input \"{}\": its content has changed", a.name))
            }
            (a, b) => {
                let name = |x: Option<&Input>| x.map_or_else(|| "(none)".to_owned(), |x| format!("\"{}\"", x.name));
                lines.push(line(&format!("input {i}"), name(a), name(b)));
            }
        }
    }
}
