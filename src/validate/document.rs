//! What was found, as text for a terminal and as the document docs/validation.md, which is generated as a whole.

use super::{Comparison, Found, cases, comparisons, failures};
use crate::farm::plan::NUMERICS;
use crate::report::short;

/// Digits of references, estimates and intervals.
const DIGITS: usize = 6;

/// What the cases of physics cannot be expressed in a scene of this program, and why.
const NOT_EXPRESSIBLE: [(&str, &str); 8] = [
    ("point source with I cos^m", "no source has this law; a glTF spot has its own falloff (`direct/spot`)"),
    ("spot of uniform intensity", "the falloff of a glTF spot has a ramp of at least 0.001 in the cosine"),
    (
        "coaxial discs",
        "a disc is a polygon of 64 corners (`tests/daylight/sources.rs` has discs and spheres that shine)",
    ),
    ("endless line of light", "no source is a line"),
    ("sphere with zones", "a `[[sphere]]` has one reflectance"),
    ("receiver of any law in a furnace", "not a surface of the scene; `tests/glossy.rs` has it"),
    ("two infinite planes that emit", "a `[[plane]]` does not emit"),
    ("planes cut at a radius", "a `[[plane]]` is infinite, which is what removes the bias of the cut"),
];

/// Head of the table on a terminal.
pub fn header() -> String {
    line(["case", "quantity", "reference", "estimate", "interval at 95 %", "z"])
}

/// The comparisons of a case as lines of that table.
pub fn rows(found: &Found) -> String {
    found.comparisons.iter().map(|c| line_of(found.case.name, c)).collect()
}

fn line_of(case: &str, c: &Comparison) -> String {
    let Cells { reference, estimate, interval, z } = Cells::of(c);
    line([case, &c.name, &format!("{reference} {}", c.unit), &estimate, &interval, &z])
}

fn line([case, quantity, reference, estimate, interval, z]: [&str; 6]) -> String {
    format!("{case:<30} {quantity:<38} {reference:>16} {estimate:>11} {interval:>24} {z:>6}\n")
}

/// The numbers of a comparison as text.
struct Cells {
    reference: String,
    estimate: String,
    interval: String,
    z: String,
}

impl Cells {
    fn of(c: &Comparison) -> Cells {
        let number = |x| short(x, DIGITS);
        let (low, high) = c.interval();
        let (interval, z) = match c.z() {
            Some(z) => (format!("{} .. {}", number(low), number(high)), format!("{z:.2}")),
            None => ("exact".to_owned(), "exact".to_owned()),
        };
        Cells { reference: number(c.reference), estimate: number(c.estimate.mean), interval, z }
    }
}

/// How many comparisons hold, how far the worst lies off, and every failure in words.
pub fn summary(found: &[Found]) -> String {
    let failures = failures(found);
    let all = || found.iter().flat_map(|f| &f.comparisons);
    let random = || all().filter(|c| c.z().is_some());
    let covered = random().filter(|c| c.covers()).count();
    let worst = random().filter_map(Comparison::z).fold(0.0, |worst: f64, z| worst.max(z.abs()));
    let widest = random().map(|c| 100.0 * c.estimate.standard_error / c.reference.abs()).fold(0.0, f64::max);
    let count = comparisons(found);
    let mut text = format!(
        "{} of {count} comparisons hold in {} cases; {covered} of {} intervals at 95 % contain the reference; \
         largest |z| {worst:.2}, largest standard error {widest:.2} %\n",
        count - failures.len(),
        found.len(),
        random().count(),
    );
    for failure in failures {
        text += &format!("FAILS {failure}\n");
    }
    text
}

/// The whole document; `note` says what the program cannot know: commit, date, machine.
pub fn markdown(found: &[Found], note: Option<&str>) -> String {
    let mut text = introduction(found, note);
    let mut theme = "";
    for f in found {
        if f.case.theme != theme {
            theme = f.case.theme;
            text += &section(theme, found);
        }
    }
    text += "\n## What a scene cannot express\n\n| case of physics | why not |\n|---|---|\n";
    NOT_EXPRESSIBLE.iter().for_each(|(what, why)| text += &format!("| {what} | {why} |\n"));
    text
}

fn introduction(found: &[Found], note: Option<&str>) -> String {
    let version = env!("CARGO_PKG_VERSION");
    let of_all = match (found.len(), cases().len()) {
        (some, all) if some < all => format!(" Only {some} of {all} cases were asked for."),
        _ => String::new(),
    };
    let note = note.map(|n| format!("\n{n}\n")).unwrap_or_default();
    let summary = summary(found).replace('\n', "\n\n");
    format!(
        "# Validation\n\n\
         Written by `lampyris validate --markdown`; do not edit. Program {version}, NUMERICS {NUMERICS}.{of_all}\n{note}\n\
         {summary}\
         Each case isolates one property and has an exact answer. A comparison holds when the estimate lies within\n\
         t standard errors of the reference, t being Student's quantile at which a right program fails anywhere in\n\
         all comparisons together with probability 1e-6, and when its standard error is at most 0.5 %. To t standard\n\
         errors comes the accuracy of coordinates, 2e-6 of the reference (f32), or what the reference is known to: 1e-5\n\
         for the sum over a grid, 1e-4 for means by a Gauss rule, 2e-4 and near corners 1e-3 for the cube's table.\n\
         Values marked *exact* are the same in every batch: their standard error is 0, and that accuracy alone decides.\n\
         Comparisons of one case share their histories, so their errors go together.\n"
    )
}

fn section(theme: &str, found: &[Found]) -> String {
    let of_theme = || found.iter().filter(|f| f.case.theme == theme);
    let family = comparisons(found);
    let mut text = format!("\n## {theme}\n\n| case | checks | reference |\n|---|---|---|\n");
    for Found { case, .. } in of_theme() {
        text += &format!("| `{}` | {} | {} |\n", case.name, case.checks, case.reference);
    }
    text += "\n| case | quantity | unit | reference | estimate | interval at 95 % | z | holds |\n\
             |---|---|---|---:|---:|---:|---:|---|\n";
    for (f, c) in of_theme().flat_map(|f| f.comparisons.iter().map(move |c| (f, c))) {
        let Cells { reference, estimate, interval, z } = Cells::of(c);
        let holds = if c.failure(family).is_none() { "yes" } else { "**no**" };
        let (name, what, unit) = (f.case.name, &c.name, c.unit);
        text += &format!("| {name} | {what} | {unit} | {reference} | {estimate} | {interval} | {z} | {holds} |\n");
    }
    text
}
