//! The battery: cases with an exact answer, each of which isolates one property, run in this process and judged.
//!
//! ```text
//! Case -> jobs and models -> Experiment (batches of a realization) -> Estimate beside reference -> Comparison -> verdict
//! ```
//!
//! References are closed forms in code ([`closed_forms`]) where there is one, else tables ([`mod@reference`]). This module
//! does not know files, printing, nor why a case is asked for.

mod bounces;
mod cavities;
pub mod clipping;
pub mod closed_forms;
mod comparison;
mod cube;
pub mod daylight;
mod direct;
mod document;
pub mod experiment;
mod form_factors;
mod glass;
mod luminaires;
mod openings;
pub mod reference;
pub mod scenes;
pub mod sobolev;

pub use comparison::Comparison;
pub use document::{header, markdown, rows, summary};
pub use experiment::Experiment;

use crate::error::{Error, Result};

/// What a case computes.
type Run = Box<dyn Fn() -> Result<Vec<Comparison>>>;

/// One property with an exact answer.
pub struct Case {
    /// Heading under which it stands.
    pub theme: &'static str,
    /// Its name, `theme/what`.
    pub name: &'static str,
    /// What it checks.
    pub checks: &'static str,
    /// Where its references come from.
    pub reference: &'static str,
    run: Run,
}

/// A case with what was found.
pub struct Found {
    /// The case.
    pub case: Case,
    /// Estimates beside their references; never empty.
    pub comparisons: Vec<Comparison>,
}

/// A heading, under which cases stand.
struct Theme(&'static str);

impl Theme {
    fn case(
        &self,
        name: &'static str,
        checks: &'static str,
        reference: &'static str,
        run: impl Fn() -> Result<Vec<Comparison>> + 'static,
    ) -> Case {
        Case { theme: self.0, name, checks, reference, run: Box::new(run) }
    }
}

impl Case {
    /// Runs all jobs of the case.
    ///
    /// # Errors
    /// What the job or the scene refuses; not that a comparison fails.
    pub fn run(self) -> Result<Found> {
        let comparisons = (self.run)()?;
        assert!(!comparisons.is_empty(), "{} compares nothing", self.name);
        Ok(Found { case: self, comparisons })
    }
}

/// All cases, in order.
pub fn cases() -> Vec<Case> {
    let themes = [direct::cases(), form_factors::cases(), cavities::cases(), bounces::cases()];
    let themes = themes.into_iter().flatten().chain(cube::cases()).chain(glass::cases()).chain(sobolev::cases());
    themes.chain(luminaires::cases()).chain(openings::cases()).chain(daylight::cases()).collect()
}

/// The cases whose names contain `part`; all without it.
///
/// # Errors
/// [`Error::Input`] with all names if there is none.
pub fn select(part: Option<&str>) -> Result<Vec<Case>> {
    let part = part.unwrap_or_default();
    let found: Vec<Case> = cases().into_iter().filter(|c| c.name.contains(part)).collect();
    if found.is_empty() {
        let names: Vec<&str> = cases().iter().map(|c| c.name).collect();
        return Err(Error::input("command line", "--case", part, format!("a part of one of {}", names.join(", "))));
    }
    Ok(found)
}

/// What is wrong with each comparison that fails, all judged as one family; empty if all hold.
pub fn failures(found: &[Found]) -> Vec<String> {
    let family = comparisons(found);
    let of = |f: &Found| {
        let named = |c: &Comparison| c.failure(family).map(|why| format!("{}: {why}", f.case.name));
        f.comparisons.iter().filter_map(named).collect::<Vec<_>>()
    };
    found.iter().flat_map(of).collect()
}

/// Number of comparisons.
pub fn comparisons(found: &[Found]) -> usize {
    found.iter().map(|f| f.comparisons.len()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn names_are_different_and_plain() {
        let mut seen = HashSet::new();
        for case in cases() {
            assert!(seen.insert(case.name) && !case.name.contains('|'), "{}", case.name);
        }
    }

    #[test]
    fn a_case_is_found_by_part_of_its_name_or_all_are_listed() {
        let names: Vec<_> = select(Some("sobolev/o")).unwrap().iter().map(|c| c.name).collect();
        assert_eq!(names, ["sobolev/orders-A", "sobolev/orders-B"]);
        let error = select(Some("nothing")).err().unwrap().to_string();
        assert!(cases().iter().all(|c| error.contains(c.name)), "{error}");
    }
}
