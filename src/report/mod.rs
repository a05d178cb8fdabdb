//! What is shown: the files of a results folder.
//!
//! | file | content |
//! |---|---|
//! | `<camera>.exr`, `<gonio>.exr` | luminance map: `R,G,B`, `luminance.*`, `direct.Y`, see below |
//! | `<grid>.csv` | illuminance, one row for each grid point, row-major |
//! | `points.csv` | the same for all lux-meters `[[point]]`, with their names |
//! | `regions.csv` | mean luminance of every `[[region]]` |
//! | `<name>.png` | false-colour picture of a camera, goniometer or grid and of its relative error |
//! | `summary.json` | one line of statistics for each receiver set, what is derived from several bins, flux
//!   balance, timings, what ended the run, digest of all numbers |
//!
//! Channels of an EXR file, 32-bit float, row 0 on top, \[cd/m2\] except where said:
//!
//! | channel | content |
//! |---|---|
//! | `R`, `G`, `B` | linear Rec.709 whose luminance is `luminance.Y` (`whiteLuminance` = 1); grey in luminance mode |
//! | `luminance.Y` | mean over the batches |
//! | `luminance.variance` | of that mean: the square of the next \[cd2/m4\] |
//! | `luminance.standardError` | of that mean |
//! | `luminance.ciLower`, `luminance.ciUpper` | Student's interval at the confidence of the job, not clamped at 0 |
//! | `luminance.peak` | largest single history over the sum of all \[1\], direct light left out |
//! | `luminance.health` | 0, or why the interval should not be trusted: a sum of codes \[1\] |
//! | `direct.Y` | the part of `luminance.Y` that is emitted or reflected once (L0 + K L0) |
//!
//! Codes of the health: 1 no information, 2 few batches, 4 relative error, 8 peak, 16 vov (not in maps), 32 tail, 64
//! checks, 128 caustic; `tally::health` says when each is set. The note of a table has the same words.
//!
//! NaN stands wherever nothing is known: no receiver, no batch, no history that reached it. The report turns counted numbers into
//! files; how they were produced it does not know, and it never recomputes them.

mod canvas;
mod csv;
mod daylight;
mod derived;
mod derived_text;
mod exr;
mod health;
mod luminaire;
mod number;
mod png;
mod polar;
mod reflectance;
mod regions;
mod scale;
mod stopping;
mod summary;
mod text;
mod values;
mod views;

pub use luminaire::luminaire_text;
pub use number::short;
pub use png::MAP_ORIGIN;
pub use polar::write_polar;
pub use reflectance::reflectance_text;
pub use views::{View, write_views};

use crate::error::{Error, Result};
use crate::farm::durable::replace;
use crate::farm::merge::Merged;
use crate::farm::plan::Plan;
use crate::job::ReceiverKind;
use std::path::Path;
use summary::Collector;
use values::SetValues;

/// Writes all results of `plan` into the folder `dir`; `summary.json` last, so that it stands for a whole set. Returns the
/// summary as a short table for a terminal: a line for each receiver set, the flux balance, the warnings.
///
/// # Errors
/// [`Error::Io`] naming the file that could not be written.
pub fn write(plan: &Plan, merged: &Merged, dir: &Path) -> Result<String> {
    std::fs::create_dir_all(dir).map_err(Error::io(dir))?;
    let mut collector = Collector::new(plan, merged);
    let (mut points, mut regions) = (Vec::new(), Vec::new());
    for values in SetValues::all(plan, merged) {
        let values = values.map_err(Error::io(dir))?;
        collector.add(&values).map_err(Error::io(dir))?;
        match values.shape.kind {
            ReceiverKind::Point => points.push(values),
            ReceiverKind::Region => regions.push(values),
            ReceiverKind::Camera | ReceiverKind::Gonio | ReceiverKind::Grid => write_set(plan, merged, &values, dir)?,
        }
    }
    if !points.is_empty() {
        replace(&dir.join("points.csv"), |to| csv::write_points(plan, merged, &points, to))?;
    }
    if !regions.is_empty() {
        replace(&dir.join("regions.csv"), |to| regions::write(plan, merged, &regions, to))?;
    }
    let summary = collector.finish().map_err(Error::io(dir))?;
    replace(&dir.join("summary.json"), |to| summary::write_json(&summary, to))?;
    Ok(text::table_of(&summary))
}

/// The files of one receiver set that is neither point nor region.
fn write_set(plan: &Plan, merged: &Merged, values: &SetValues, dir: &Path) -> Result<()> {
    let name = &values.shape.name;
    if values.shape.kind == ReceiverKind::Grid {
        replace(&dir.join(format!("{name}.csv")), |to| csv::write_grid(plan, merged, values, to))?;
    } else {
        replace(&dir.join(format!("{name}.exr")), |to| exr::write(plan, merged, values, to))?;
    }
    replace(&dir.join(format!("{name}.png")), |to| png::write(plan, merged, values, to))
}

/// Batches that are missing, first and last of each range, `32-63, 96-127`; empty when complete.
/// A long list is cut short: the whole of it is in `summary.json`.
fn missing_text(merged: &Merged) -> String {
    const MOST: usize = 8;
    let mut ranges: Vec<String> =
        merged.missing.iter().take(MOST).map(|r| format!("{}-{}", r.start, r.end - 1)).collect();
    if merged.missing.len() > MOST {
        ranges.push(format!("and {} more ranges", merged.missing.len() - MOST));
    }
    ranges.join(", ")
}
