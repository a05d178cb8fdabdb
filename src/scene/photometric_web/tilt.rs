//! What a lamp gives when its luminaire is tilted: the table behind `TILT=INCLUDE`.

use super::text::{Named, Numbers, Wanted};
use crate::error::Result;

/// Most angles of a table.
const MOST: usize = 1000;

/// How the lamp sits in its luminaire, which looks straight down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lamp {
    /// Upright; it tilts with the luminaire.
    Upright,
    /// Lying; it stays so when the luminaire is tilted.
    Lying,
    /// Lying; it tilts with the luminaire.
    LyingAndTilting,
}

/// Factor on the intensities by the angle of tilt.
#[derive(Clone, Debug, PartialEq)]
pub struct Tilt {
    /// How the lamp sits.
    pub lamp: Lamp,
    /// Angles, growing \[degrees\].
    angles: Vec<f64>,
    /// Factors at the angles \[1\].
    factors: Vec<f64>,
}

impl Tilt {
    /// The table that follows in `numbers`.
    pub(super) fn read(name: Named, numbers: &mut Numbers) -> Result<Tilt> {
        let lamp = match numbers.whole("lamp-to-luminaire geometry", 1, 3)? {
            1 => Lamp::Upright,
            2 => Lamp::Lying,
            _ => Lamp::LyingAndTilting,
        };
        let count = numbers.whole("pairs of angles and factors", 1, MOST)?;
        let line = numbers.line();
        let angles = numbers.growing(count, Wanted::between("tilt angles", 0.0, 180.0, "degrees"))?;
        if angles[0] != 0.0 {
            return Err(name.bad(line, "tilt angles", angles[0], "0 as the first"));
        }
        let factors = numbers.list(count, Wanted::positive("tilt factors", 10.0, ""))?;
        Ok(Tilt { lamp, angles, factors })
    }

    /// The factor for a luminaire whose aim is `tilt` from straight down \[degrees\]. A table that ends at 90 degrees holds for
    /// the angles above as for those as far below.
    pub fn factor(&self, tilt: f64) -> f64 {
        let last = self.angles.len() - 1;
        let tilt = match self.lamp {
            Lamp::Lying => 0.0,
            _ if tilt > 90.0 && self.angles[last] <= 90.0 => 180.0 - tilt,
            _ => tilt,
        };
        match self.angles.partition_point(|&angle| angle <= tilt) {
            0 => self.factors[0],
            n if n > last => self.factors[last],
            n => {
                let share = (tilt - self.angles[n - 1]) / (self.angles[n] - self.angles[n - 1]);
                self.factors[n - 1] + share * (self.factors[n] - self.factors[n - 1])
            }
        }
    }
}
