//! The summary as a short table for a terminal.

use super::derived_text;
use super::number::short;
use super::summary::{SetSummary, Summary, Term};

/// Points beyond this number are left to `points.csv`.
const MOST_POINTS: usize = 12;

/// A short table of the results: a line for each receiver set, the flux balance, the warnings.
pub(super) fn table_of(summary: &Summary) -> String {
    let mut lines = vec![head(summary)];
    lines.extend(summary.stopped_by.as_ref().map(|by| by.line(summary.confidence)));
    lines.extend(table(&summary.sets));
    lines.extend(derived_text::lines(summary));
    lines.push(balance(summary));
    lines.extend(summary.warnings.iter().map(|w| format!("warning: {w}")));
    lines.join("\n") + "\n"
}

fn head(summary: &Summary) -> String {
    let state = if summary.complete { "" } else { " (incomplete)" };
    let Summary { name, batches, histories_per_batch, seed, .. } = summary;
    format!("{name}: {batches} batches of {histories_per_batch} histories, seed {seed}{state}")
}

fn table(sets: &[SetSummary]) -> Vec<String> {
    let head = ["set", "bins", "unit", "mean", "min", "max", "median error", "worst error"].map(str::to_owned);
    let points = sets.iter().filter(|s| s.kind == "point").count();
    // A region has a line of its own, with its interval.
    let shown = sets.iter().filter(|s| s.kind != "region" && (s.kind != "point" || points <= MOST_POINTS));
    let rows: Vec<[String; 8]> = std::iter::once(head).chain(shown.map(row)).collect();
    let width = |column: usize| rows.iter().map(|r| r[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; 8] = std::array::from_fn(width);
    let mut lines: Vec<String> = rows.iter().map(|row| line(row, &widths)).collect();
    if points > MOST_POINTS {
        lines.push(format!("  {points} points: see points.csv"));
    }
    lines
}

fn row(set: &SetSummary) -> [String; 8] {
    let percent = |x: f64| if x.is_finite() { format!("{} %", short(100.0 * x, 3)) } else { "-".to_owned() };
    let number = |x: f64| if x.is_finite() { short(x, 4) } else { "-".to_owned() };
    [
        set.name.clone(),
        set.bins.to_string(),
        set.unit.to_owned(),
        number(set.mean),
        number(set.min),
        number(set.max),
        percent(set.median_relative_error),
        percent(set.worst_relative_error),
    ]
}

/// The name to the left, the rest to the right of its column.
fn line(row: &[String; 8], widths: &[usize; 8]) -> String {
    let rest = (1..8).map(|i| format!("  {:>1$}", row[i], widths[i]));
    format!("  {:<1$}", row[0], widths[0]) + &rest.collect::<String>()
}

fn balance(summary: &Summary) -> String {
    let flux = &summary.flux_lm;
    let term = |t: &Term| {
        let error = if t.standard_error > 0.0 { format!(" +- {}", short(t.standard_error, 2)) } else { String::new() };
        short(t.mean, 6) + &error
    };
    format!(
        "  flux [lm]: emitted {} = absorbed {} + escaped {} + lost {}, difference {}",
        term(&flux.emitted),
        term(&flux.absorbed),
        term(&flux.escaped),
        term(&flux.lost),
        term(&flux.difference)
    )
}
