//! Derived quantities for a terminal: a line for each grid, region and ratio.

use super::daylight::DaylightFactor;
use super::derived::{OfGrid, OfRatio, Quantity};
use super::number::{percent, short};
use super::summary::{SetSummary, Summary};

/// Lines of one kind beyond this number are left to the files.
const MOST: usize = 12;

/// The lines of all that is derived, below a heading; none where there is nothing.
pub(super) fn lines(summary: &Summary) -> Vec<String> {
    let of_sets = |line: fn(&SetSummary) -> Option<String>| summary.sets.iter().filter_map(line).collect();
    let grids = cut(of_sets(grid_line), "grids", "summary.json");
    let regions = cut(of_sets(region_line), "regions", "regions.csv");
    let ratios = cut(summary.ratios.iter().map(ratio_line).collect(), "ratios", "summary.json");
    let factors = cut(of_sets(factor_line), "daylight factors", "summary.json");
    let lines: Vec<String> = [grids, factors, regions, ratios].concat();
    if lines.is_empty() {
        return lines;
    }
    let heading = format!("  derived, intervals at {}:", percent(summary.confidence));
    std::iter::once(heading).chain(lines).collect()
}

fn cut(mut lines: Vec<String>, what: &str, file: &str) -> Vec<String> {
    let all = lines.len();
    if all > MOST {
        lines.truncate(MOST);
        lines.push(format!("    {} more {what}: see {file}", all - MOST));
    }
    lines
}

fn grid_line(set: &SetSummary) -> Option<String> {
    let OfGrid { mean, min, uniformity, .. } = set.of_set.derived.as_ref()?;
    let unit = format!(" {}", set.unit);
    let (mean, min, uo) = (about(mean, &unit), between(min, &unit), between(uniformity, ""));
    Some(format!("    {}: mean {mean}, min {min}, Uo {uo}", set.name))
}

fn factor_line(set: &SetSummary) -> Option<String> {
    let DaylightFactor { outdoor_lx, mean, min } = set.of_set.daylight_factor.as_ref()?;
    let least = min.as_ref().map(|min| format!(", min {}", between(min, " %"))).unwrap_or_default();
    let (mean, outdoor) = (about(mean, " %"), short(*outdoor_lx, 5));
    Some(format!("    {}: daylight factor {mean}{least} of {outdoor} lx outdoors", set.name))
}

fn region_line(set: &SetSummary) -> Option<String> {
    let mean = about(set.of_set.interval.as_ref()?, &format!(" {}", set.unit));
    Some(format!("    {}: mean {mean}", set.name))
}

fn ratio_line(ratio: &OfRatio) -> String {
    let OfRatio { name, numerator, denominator, quantity } = ratio;
    format!("    {name}: {numerator} / {denominator} = {}", about(quantity, ""))
}

/// Value +- half the width of the interval; `unit` begins with a space, or is empty.
fn about(q: &Quantity, unit: &str) -> String {
    let half = 0.5 * (q.ci_upper - q.ci_lower);
    if half.is_finite() {
        format!("{} +- {}{unit}{}", short(q.value, 4), short(half, 2), marks(q))
    } else {
        format!("{}{unit} ({})", short(q.value, 4), reason(q))
    }
}

/// Value (from .. to); `unit` begins with a space, or is empty.
fn between(q: &Quantity, unit: &str) -> String {
    let [value, low, high] = [q.value, q.ci_lower, q.ci_upper].map(|x| short(x, 4));
    if q.ci_lower.is_finite() && q.ci_upper.is_finite() {
        format!("{value} ({low} .. {high}){unit}{}", marks(q))
    } else {
        format!("{value}{unit} ({})", reason(q))
    }
}

/// Why the interval should not be trusted; empty when healthy.
fn marks(q: &Quantity) -> String {
    if q.marks.is_empty() { String::new() } else { format!(" [marked: {}]", q.marks.join(", ")) }
}

fn reason(q: &Quantity) -> String {
    format!("no interval: {}", q.note)
}
