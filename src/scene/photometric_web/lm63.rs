//! IES LM-63 of 1986, 1991, 1995, 2002 and 2019.
//!
//! Keywords up to the line `TILT=`; then numbers, whatever the lines they stand on:
//!
//! ```text
//! lamps  lumens per lamp (-1: absolute)  factor  vertical angles  horizontal angles  type  unit  width  length  height
//! ballast factor  [1986, 1991: another factor; later reserved]  watts
//! vertical angles ...  horizontal angles ...  intensities [cd], for each horizontal angle all vertical ones
//! ```
//!
//! The factors are linear and applied once. The lumens of the lamps scale nothing: the table is in candela.

use super::symmetry::{Kind, Measured};
use super::text::{Named, Numbers, Wanted};
use super::tilt::Tilt;
use super::{MOST_CANDELA, MOST_VALUES, Opening, Photometry, woven};
use crate::error::Result;

/// Most angles in one direction.
const MOST_ANGLES: usize = 100_000;
/// A foot \[m\].
const FOOT: f64 = 0.3048;

/// The edition of the standard, as far as the numbers depend on it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Edition {
    Of1986,
    Of1991,
    Of1995,
    Of2002,
    Of2019,
}

/// True for the line between keywords and numbers.
pub(super) fn is_tilt(line: &str) -> bool {
    let compact: String = line.chars().filter(|c| !c.is_whitespace()).take(5).collect();
    compact.eq_ignore_ascii_case("TILT=")
}

/// Reads `lines`, of which number `tilt`, counted from 0, says whether a table of tilts follows.
pub(super) fn parse(name: Named, lines: &[String], tilt: usize) -> Result<Photometry> {
    // By the standard a comma stands between numbers. Where that does not fit and decimal commas do, they are meant.
    body(name, lines, tilt, false).or_else(|error| {
        let mut photometry = body(name, lines, tilt, true).map_err(|_| error)?;
        photometry.warnings.push("its commas are read as decimal marks: between numbers they would not fit".to_owned());
        Ok(photometry)
    })
}

/// The whole file, with a comma as decimal mark where `comma` says so.
fn body(name: Named, lines: &[String], tilt_line: usize, comma: bool) -> Result<Photometry> {
    let mut numbers = Numbers::new(name, &lines[tilt_line + 1..], tilt_line + 2, comma);
    let value = lines[tilt_line].split_once('=').map_or("", |(_, value)| value.trim());
    let tilt = match value.to_ascii_uppercase().as_str() {
        "NONE" => None,
        "INCLUDE" => Some(Tilt::read(name, &mut numbers)?),
        _ => {
            return Err(name.bad(
                tilt_line + 1,
                "TILT",
                value,
                "NONE, or INCLUDE with the table of that file in the lines below this one",
            ));
        }
    };
    let (edition, odd) = edition(&lines[..tilt_line]);
    let head = Head::read(&mut numbers, edition)?;
    let (measured, line) = head.table(name, &mut numbers)?;
    let (web, symmetry) = woven(name, line, &measured)?;
    let mut photometry = Photometry {
        format: format!("IES LM-63-{}, type {:?}", edition.year(), head.kind),
        labels: labels(&lines[..tilt_line]),
        measured,
        symmetry,
        web,
        lamps: head.lumens.map(|each| (head.lamps, head.lamps * each * head.ballast)),
        stated_flux: None,
        factor: head.factor,
        watts: head.watts,
        opening: head.opening,
        tilt,
        warnings: odd.into_iter().collect(),
    };
    photometry.compare();
    Ok(photometry)
}

/// The numbers before the angles.
struct Head {
    lamps: f64,
    /// Of each lamp \[lm\]; `None` in absolute photometry.
    lumens: Option<f64>,
    ballast: f64,
    /// On the numbers of the table.
    factor: f64,
    /// Vertical and horizontal angles.
    size: (usize, usize),
    kind: Kind,
    opening: Opening,
    watts: f64,
}

impl Head {
    fn read(numbers: &mut Numbers, edition: Edition) -> Result<Head> {
        let factor = |field| Wanted::positive(field, 1e9, "");
        let lamps = numbers.whole("number of lamps", 1, 1_000_000)? as f64;
        let lumens = numbers.lumens("lumens per lamp")?;
        let multiplier = numbers.take(factor("candela multiplier"))?;
        let along = numbers.whole("number of vertical angles", 2, MOST_ANGLES)?;
        let across = numbers.whole("number of horizontal angles", 1, MOST_ANGLES)?;
        let kind = [Kind::C, Kind::B, Kind::A][numbers.whole("photometric type", 1, 3)? - 1];
        let unit = [FOOT, 1.0][numbers.whole("units", 1, 2)? - 1];
        let mut length = |field| Ok(unit * numbers.take(Wanted::between(field, -1e4, 1e4, ""))?);
        let opening = Opening::of_lm63(length("width")?, length("length")?, length("height")?);
        let ballast = numbers.take(factor("ballast factor"))?;
        let second = match edition < Edition::Of1995 {
            true => numbers.take(factor("ballast-lamp photometric factor"))?,
            // Reserved in 1995 and 2002, how the file was made in 2019: no factor.
            false => numbers.take(Wanted::between("reserved number", f64::MIN, f64::MAX, "")).map(|_| 1.0)?,
        };
        let watts = numbers.take(Wanted::between("input watts", 0.0, 1e9, "W"))?;
        let factor = multiplier * ballast * second;
        Ok(Head { lamps, lumens, ballast, factor, size: (along, across), kind, opening, watts })
    }

    /// Angles and intensities, which must end the file, and the line of the horizontal angles.
    fn table(&self, name: Named, numbers: &mut Numbers) -> Result<(Measured, usize)> {
        let ((along, across), kind, factor) = (self.size, self.kind, self.factor);
        let (low, high, turn) = if kind == Kind::C { (0.0, 180.0, 360.0) } else { (-90.0, 90.0, 180.0) };
        let angles = numbers.growing(along, Wanted::between("vertical angles", low, high, "degrees"))?;
        let line = numbers.line();
        let planes = numbers.growing(across, Wanted::between("horizontal angles", -turn, turn, "degrees"))?;
        let wanted = Wanted::between("candela values", 0.0, MOST_CANDELA / factor, "cd before the factors");
        if along * across > MOST_VALUES {
            let value = format!("{along} x {across}");
            return Err(name.bad(line, "candela values", value, format!("at most {MOST_VALUES} of them")));
        }
        let candela = numbers.list(along * across, wanted)?.into_iter().map(|x| x * factor).collect();
        if numbers.left() > 0 {
            let allowed = format!("the end of the file after {along} x {across} candela values");
            return Err(name.bad(
                numbers.line(),
                "candela values",
                format!("{} more numbers", numbers.left()),
                allowed,
            ));
        }
        Ok((Measured { kind, planes, angles, candela }, line))
    }
}

impl Edition {
    fn year(self) -> u32 {
        match self {
            Edition::Of1986 => 1986,
            Edition::Of1991 => 1991,
            Edition::Of1995 => 1995,
            Edition::Of2002 => 2002,
            Edition::Of2019 => 2019,
        }
    }
}

/// The edition that the first line names, and what is odd about it. The first edition has no such line, and no keywords.
fn edition(head: &[String]) -> (Edition, Option<String>) {
    let first = head.iter().find(|line| !line.is_empty()).map_or("", String::as_str);
    let Some(rest) = first.to_ascii_uppercase().strip_prefix("IES").map(str::to_owned) else {
        let odd = head.iter().any(|line| line.starts_with('['));
        let warning = "its first line names no edition (IESNA:LM-63-...): it is read as LM-63-1986";
        return (Edition::Of1986, odd.then(|| warning.to_owned()));
    };
    let ends = [
        ("2019", Edition::Of2019),
        ("-19", Edition::Of2019),
        ("02", Edition::Of2002),
        ("95", Edition::Of1995),
        ("91", Edition::Of1991),
        ("86", Edition::Of1986),
    ];
    match ends.iter().find(|(end, _)| rest.ends_with(end)) {
        Some((_, edition)) => (*edition, None),
        None => (Edition::Of1991, Some(format!("the edition `{first}` is not known: it is read as LM-63-1991"))),
    }
}

/// The keywords with their values; `[MORE]` goes on with the one before. Lines of the first edition have none.
fn labels(head: &[String]) -> Vec<(String, String)> {
    let mut labels: Vec<(String, String)> = Vec::new();
    for line in head.iter().filter(|line| !line.to_ascii_uppercase().starts_with("IES")) {
        let (keyword, value) = match line.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
            Some((keyword, value)) => (keyword.trim().to_ascii_uppercase(), value.trim()),
            None => (String::new(), line.as_str()),
        };
        match labels.last_mut() {
            Some((_, before)) if keyword == "MORE" => *before = format!("{before} {value}"),
            _ if value.is_empty() => {}
            _ => labels.push((keyword, value.to_owned())),
        }
    }
    labels
}
