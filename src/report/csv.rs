//! Illuminance as tables: one row for each grid point or lux-meter, every number with all its digits.

use super::derived::{family_interval, quantile_of};
use super::health::is_plain;
use super::values::{Bin, SetValues};
use crate::farm::merge::Merged;
use crate::farm::plan::Plan;
use crate::math::DVec3;
use crate::tally::health::Mark;
use std::io::{Result, Write};

const HEADER: [&str; 16] = [
    "index",
    "column",
    "row",
    "x_m",
    "y_m",
    "z_m",
    "nx",
    "ny",
    "nz",
    "direct_lx",
    "illuminance_lx",
    "standard_error_lx",
    "ci_lower_lx",
    "ci_upper_lx",
    "vov",
    "note",
];

/// Of grids alone, before `vov`: ends of intervals that hold for every point of the grid together.
const FAMILY: [&str; 2] = ["family_lower_lx", "family_upper_lx"];

/// Place of `FAMILY` in a row: before the last two columns.
const FAMILY_AT: usize = HEADER.len() - 2;

/// Writes the grid `values`, row-major, column fastest.
pub(super) fn write_grid(plan: &Plan, merged: &Merged, values: &SetValues, to: &mut impl Write) -> Result<()> {
    let grid = plan.job.grids.iter().find(|g| g.name == values.shape.name).expect("a set comes from its job");
    let mut table = ::csv::Writer::from_writer(to);
    let mut header = HEADER.to_vec();
    header.splice(FAMILY_AT..FAMILY_AT, FAMILY);
    table.write_record(header)?;
    let quantile = quantile_of(values, plan.job.run.confidence, merged.batches)?;
    let columns = values.shape.width as usize;
    values.each(|index, bin| {
        let place = [index, index % columns, index / columns];
        let mut row = row(place, grid.position(index), grid.normal, bin, &note(bin, plan, merged));
        row.splice(FAMILY_AT..FAMILY_AT, family_interval(bin, quantile).map(|x| format!("{x:?}")));
        Ok(table.write_record(row)?)
    })?;
    table.flush()
}

/// Writes all lux-meters `points`, in job order, each with its name in front.
pub(super) fn write_points(plan: &Plan, merged: &Merged, points: &[SetValues], to: &mut impl Write) -> Result<()> {
    let mut table = ::csv::Writer::from_writer(to);
    table.write_record(["name"].iter().chain(&HEADER))?;
    for (index, (values, point)) in points.iter().zip(&plan.job.points).enumerate() {
        assert_eq!(values.shape.name, point.name, "points come in job order");
        let bin = values.single()?;
        let row = row([index, 0, 0], point.position, point.normal, &bin, &note(&bin, plan, merged));
        table.write_record([point.name.clone()].iter().chain(&row))?;
    }
    table.flush()
}

fn row(place: [usize; 3], position: [f64; 3], normal: [f64; 3], bin: &Bin, note: &str) -> Vec<String> {
    let normal = DVec3::from_array(normal).normalize().to_array();
    let light = [bin.direct, bin.value, bin.standard_error, bin.low, bin.high, bin.vov];
    // Debug prints the shortest text that reads back to the same bits, with an exponent where one is due.
    let numbers = position.iter().chain(&normal).chain(&light).map(|x| format!("{x:?}"));
    place.iter().map(usize::to_string).chain(numbers).chain([note.to_owned()]).collect()
}

/// What a reader must know before using the numbers of `bin`.
pub(super) fn note(bin: &Bin, plan: &Plan, merged: &Merged) -> String {
    let Some(health) = bin.health else { return "inside".to_owned() };
    let others = [(is_plain(plan), "plain"), (!merged.missing.is_empty(), "incomplete")];
    let others = others.iter().filter(|(holds, _)| *holds).map(|&(_, text)| text);
    health.marks().map(Mark::word).chain(others).collect::<Vec<_>>().join("; ")
}
