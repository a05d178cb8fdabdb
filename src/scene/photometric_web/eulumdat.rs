//! EULUMDAT: one field a line, intensities in cd for 1000 lm of the lamps.
//!
//! ```text
//! 1 company  2 type  3 symmetry  4 planes Mc  5 -  6 angles Ng  7 -  8-12 names  13-15 luminaire [mm]
//! 16-21 luminous area [mm]: length along C90-C270, width (0: round), heights at C0, C90, C180, C270
//! 22 downward flux [%]  23 light output ratio [%]  24 conversion factor  25 tilt  26 sets of lamps n
//! then n numbers of lamps (negative: absolute), types, fluxes [lm], colours, rendering, powers [W]
//! 10 direct ratios, Mc angles C, Ng angles G, intensities [cd/klm] of the planes that symmetry leaves
//! ```

use super::symmetry::{Kind, Measured};
use super::text::{Named, Wanted, number};
use super::{MOST_CANDELA, MOST_VALUES, Opening, Photometry, woven};
use crate::error::Result;

/// Lines before the sets of lamps.
const HEAD: usize = 26;
/// Fields of a set of lamps.
const FIELDS: usize = 6;
/// Direct ratios, which nothing here needs.
const RATIOS: usize = 10;
/// Most planes, and most angles in each.
const MOST: usize = 100_000;

/// The lines of a file, by number from 1.
#[derive(Clone, Copy)]
struct Sheet<'a> {
    name: Named<'a>,
    lines: &'a [String],
}

/// The lamps that the intensities are for: the first set.
struct Lamps {
    /// Negative in absolute photometry.
    count: f64,
    flux: f64,
    watts: f64,
}

/// True where some of the numbers that come first are in their places.
pub(super) fn is_like(lines: &[String]) -> bool {
    lines.iter().take(7).skip(2).any(|line| number(line, true).is_some())
}

/// Reads `lines`.
pub(super) fn parse(name: Named, lines: &[String]) -> Result<Photometry> {
    let sheet = Sheet { name, lines };
    let sets = sheet.whole(HEAD, "sets of lamps", 1, 100)?;
    let lamps = sheet.lamps(sets)?;
    let ratio = sheet.number(23, Wanted::between("light output ratio", 0.0, 1000.0, "%"))? / 100.0;
    let conversion = sheet.number(24, Wanted::positive("conversion factor", 1e9, ""))?;
    let factor = conversion * lamps.flux / 1000.0;
    let first = HEAD + FIELDS * sets + RATIOS + 1;
    let measured = sheet.table(first, factor)?;
    let (web, symmetry) = woven(name, first, &measured)?;
    let mut photometry = Photometry {
        format: "EULUMDAT".to_owned(),
        labels: sheet.labels(),
        measured,
        symmetry,
        web,
        lamps: (lamps.count > 0.0).then_some((lamps.count, lamps.flux)),
        stated_flux: (ratio > 0.0).then_some(lamps.flux * ratio),
        factor,
        watts: lamps.watts,
        opening: sheet.opening()?,
        tilt: None,
        warnings: sheet.remarks(sets),
    };
    photometry.compare();
    Ok(photometry)
}

impl<'a> Sheet<'a> {
    fn text(&self, line: usize) -> &'a str {
        self.lines.get(line - 1).map_or("", String::as_str)
    }

    fn number(&self, line: usize, wanted: Wanted) -> Result<f64> {
        let accepted = number(self.text(line), true).filter(|&x| wanted.accepts(x));
        accepted.ok_or_else(|| match self.lines.get(line - 1) {
            Some(text) => self.name.bad(line, wanted.field(), text, wanted.allowed()),
            None => self.name.bad(
                self.lines.len(),
                wanted.field(),
                "the end of the file",
                format!("{} lines or more", line),
            ),
        })
    }

    fn whole(&self, line: usize, field: &str, low: usize, high: usize) -> Result<usize> {
        let x = self.number(line, Wanted::between(field, low as f64, high as f64, ""))?;
        match x.fract() == 0.0 {
            true => Ok(x as usize),
            false => Err(self.name.bad(line, field, x, format!("a whole number, {low} .. {high}"))),
        }
    }

    fn list(&self, first: usize, count: usize, wanted: Wanted) -> Result<Vec<f64>> {
        let there = (self.lines.len() + 1).saturating_sub(first);
        if count > there {
            let allowed = format!("{count} lines from line {first} on");
            return Err(self.name.bad(self.lines.len(), wanted.field(), format!("{there} lines"), allowed));
        }
        (first..first + count).map(|line| self.number(line, wanted)).collect()
    }

    /// The first of `sets` sets. Some programs write field by field, others set by set.
    fn lamps(&self, sets: usize) -> Result<Lamps> {
        let is_number = |line: usize| number(self.text(line), true).is_some();
        let first = HEAD + 1;
        let by_field = (0..sets).all(|k| is_number(first + k) && is_number(first + 2 * sets + k));
        let step = if by_field { sets } else { 1 };
        let count = self.number(first, Wanted::between("number of lamps", -1e6, 1e6, ""))?;
        if count == 0.0 {
            return Err(self.name.bad(
                first,
                "number of lamps",
                count,
                "1 or more, or negative for absolute photometry",
            ));
        }
        let flux = self.number(first + 2 * step, Wanted::positive("flux of the lamps", 1e12, "lm"))?;
        let watts = self.text(first + 5 * step);
        let wanted = Wanted::between("watts", 0.0, 1e9, "W");
        let watts = if watts.is_empty() { 0.0 } else { self.number(first + 5 * step, wanted)? };
        Ok(Lamps { count, flux, watts })
    }

    /// Angles and intensities from line `first` on, times `factor`.
    fn table(&self, first: usize, factor: f64) -> Result<Measured> {
        let symmetry = self.whole(3, "symmetry", 0, 4)?;
        let all = self.whole(4, "number of C-planes", 1, MOST)?;
        let count = self.whole(6, "number of angles", 2, MOST)?;
        let planes = self.planes(symmetry, first, all)?;
        let angles = self.growing(first + all, count, Wanted::between("angles G", 0.0, 180.0, "degrees"))?;
        let wanted = Wanted::between("intensities", 0.0, MOST_CANDELA / factor, "cd/klm");
        if planes.len() * count > MOST_VALUES {
            let value = format!("{} x {count}", planes.len());
            return Err(self.name.bad(6, "intensities", value, format!("at most {MOST_VALUES} of them")));
        }
        let candela = self.list(first + all + count, planes.len() * count, wanted)?;
        let candela = candela.into_iter().map(|x| x * factor).collect();
        Ok(Measured { kind: Kind::C, planes, angles, candela })
    }

    /// The planes whose intensities are in the file, of `all` from line `first` on.
    fn planes(&self, symmetry: usize, first: usize, all: usize) -> Result<Vec<f64>> {
        let divisor = [1, 1, 2, 4, 4][symmetry];
        if !all.is_multiple_of(divisor) {
            let allowed = format!("a multiple of {divisor} with symmetry {symmetry}");
            return Err(self.name.bad(4, "number of C-planes", all, allowed));
        }
        let angles = self.growing(first, all, Wanted::between("angles C", 0.0, 360.0, "degrees"))?;
        let up_to = |k: usize| angles.iter().copied().chain([360.0]).take(k + 1);
        let (planes, ends): (Vec<f64>, _) = match symmetry {
            0 => return Ok(angles),
            1 => return Ok(vec![0.0]),
            2 => (up_to(all / 2).collect(), (0.0, 180.0)),
            // From C270 by way of C0 to C90.
            3 => (angles[3 * all / 4..].iter().map(|c| c - 360.0).chain(up_to(all / 4)).collect(), (-90.0, 90.0)),
            _ => (up_to(all / 4).collect(), (0.0, 90.0)),
        };
        let (low, high) = (planes[0], planes[planes.len() - 1]);
        match (low, high) == ends {
            true => Ok(planes),
            false => {
                let allowed = format!("planes from {} to {} with symmetry {symmetry}", ends.0, ends.1);
                Err(self.name.bad(first, "angles C", format!("{low} .. {high}"), allowed))
            }
        }
    }

    fn growing(&self, first: usize, count: usize, wanted: Wanted) -> Result<Vec<f64>> {
        let list = self.list(first, count, wanted)?;
        match list.windows(2).position(|pair| pair[0] >= pair[1]) {
            None => Ok(list),
            Some(k) => {
                let allowed = format!("{}, each above the one before", wanted.allowed());
                Err(self.name.bad(first + k + 1, wanted.field(), list[k + 1], allowed))
            }
        }
    }

    fn opening(&self) -> Result<Opening> {
        let length = |line, field| -> Result<f64> {
            match self.text(line) {
                "" => Ok(0.0),
                _ => Ok(self.number(line, Wanted::between(field, 0.0, 1e7, "mm"))? / 1000.0),
            }
        };
        let heights: Vec<f64> =
            (18..=21).map(|line| length(line, "height of the luminous area")).collect::<Result<_>>()?;
        let height = heights.into_iter().fold(0.0, f64::max);
        Ok(Opening::of_eulumdat(
            length(16, "length of the luminous area")?,
            length(17, "width of the luminous area")?,
            height,
        ))
    }

    /// Names, as LM-63 calls them.
    fn labels(&self) -> Vec<(String, String)> {
        let fields = [(1, "MANUFAC"), (8, "TEST"), (9, "LUMINAIRE"), (10, "LUMCAT"), (12, "DATE")];
        let labels = fields.iter().map(|&(line, label)| (label.to_owned(), self.text(line).to_owned()));
        labels.filter(|(_, value)| !value.is_empty()).collect()
    }

    /// What is odd, or not used.
    fn remarks(&self, sets: usize) -> Vec<String> {
        let mut remarks = Vec::new();
        if sets > 1 {
            remarks.push(format!("of {sets} sets of lamps the first is used"));
        }
        let tilt = self.text(25);
        if number(tilt, true).is_some_and(|tilt| tilt != 0.0) {
            remarks.push(format!("it was measured at a tilt of {tilt} degrees: that is not undone"));
        }
        remarks
    }
}
