//! Photometric webs: IES LM-63 and EULUMDAT files in, luminous intensity in every direction out.
//!
//! | file | content |
//! |---|---|
//! | `lm63`, `eulumdat` | the two formats |
//! | `text` | lines, and numbers with their places |
//! | `tilt`, `opening` | lamps that care how they hang; the shape that shines |
//! | `symmetry` | what a file leaves out |
//! | `grid` | intensity between the angles, flux in closed form, directions drawn by exact inversion |
//! | `placed` | a web at its place in a scene |
//!
//! Such files come from anywhere: every number is checked before it is used, and no memory is taken on the word of a header. How they
//! are read, and which way C0 points, is in docs/luminaires.md.

mod eulumdat;
mod grid;
mod lm63;
mod opening;
mod placed;
mod symmetry;
mod text;
mod tilt;

pub use grid::Web;
pub use opening::{Opening, Shape};
pub use placed::{Luminaire, Placement};
pub use symmetry::{Kind, Measured, Symmetry, radians};
pub use tilt::{Lamp, Tilt};

use crate::error::Result;
use crate::math::PI;
use std::sync::Arc;
use text::Named;

/// Largest intensity of a file \[cd\].
const MOST_CANDELA: f64 = 1e12;
/// Most intensities of a file: half a degree by half a degree, all around, are 261 000.
const MOST_VALUES: usize = 1 << 22;
/// Lengths beyond which an opening is mentioned \[m\].
const SHORTEST: f64 = 1e-3;
const LONGEST: f64 = 20.0;
/// From this share on a disagreement of two fluxes is reported.
const DISAGREEMENT: f64 = 0.02;

/// Intensities over directions, on their way from a file to a [`Web`].
struct Grid {
    /// Angles from the pole, growing \[rad\].
    polar: Vec<f64>,
    /// Azimuths, growing \[rad\].
    azimuth: Vec<f64>,
    /// Of each polar angle the intensities at all azimuths \[cd\].
    intensity: Vec<f64>,
}

/// What a photometric file says.
#[derive(Clone, Debug, PartialEq)]
pub struct Photometry {
    /// The format, as people call it.
    pub format: String,
    /// Names and remarks, each with what it is called in the file.
    pub labels: Vec<(String, String)>,
    /// What was measured, with every factor of the file applied.
    pub measured: Measured,
    /// What was filled in.
    pub symmetry: Symmetry,
    /// Intensity in every direction.
    pub web: Arc<Web>,
    /// Number of lamps and their flux together \[lm\]; `None` in absolute photometry.
    pub lamps: Option<(f64, f64)>,
    /// Flux of the luminaire as the file states it \[lm\].
    pub stated_flux: Option<f64>,
    /// All factors of the file on the numbers in its table \[1\].
    pub factor: f64,
    /// Electric power \[W\]; 0 where the file does not know.
    pub watts: f64,
    /// The luminous opening.
    pub opening: Opening,
    /// What tilting does to the lamp.
    pub tilt: Option<Tilt>,
    /// What is odd in the file, each with what was made of it.
    pub warnings: Vec<String>,
}

impl Photometry {
    /// Reads the file called `name` with the content `bytes`: LM-63 where a line begins with `TILT=`, else EULUMDAT where there are
    /// numbers in its places.
    ///
    /// # Errors
    /// [`Error::Input`](crate::error::Error::Input) with field, line, value and what is allowed.
    pub fn parse(name: &str, bytes: &[u8]) -> Result<Photometry> {
        let lines = text::lines(Named(name), bytes)?;
        match lines.iter().position(|line| lm63::is_tilt(line)) {
            Some(tilt) => lm63::parse(Named(name), &lines, tilt),
            None if eulumdat::is_like(&lines) => eulumdat::parse(Named(name), &lines),
            None => {
                let (line, first) = (1..).zip(&lines).find(|(_, line)| !line.is_empty()).unwrap_or((1, &lines[0]));
                let begins = if first.is_empty() { "empty" } else { first };
                let allowed = "IES LM-63, in which a line begins with TILT=, or EULUMDAT, with numbers on lines 3 to 7";
                Err(Named(name).bad(line, "file", begins, allowed))
            }
        }
    }

    /// Memory of what was measured and of the web, about \[bytes\].
    pub fn bytes(&self) -> u64 {
        (8 * self.measured.candela.len()) as u64 + self.web.bytes()
    }

    /// Luminous flux, integrated in closed form \[lm\].
    pub fn flux(&self) -> f64 {
        self.web.flux()
    }

    /// Share of the flux within 90 degrees of the aim, in type C, else `None` \[1\].
    pub fn forward_share(&self) -> Option<f64> {
        (self.measured.kind == Kind::C).then(|| self.web.flux_within(0.5 * PI) / self.flux())
    }

    /// Flux over that of the lamps \[1\]; `None` in absolute photometry.
    pub fn light_output_ratio(&self) -> Option<f64> {
        self.lamps.map(|(_, lamps)| self.flux() / lamps)
    }

    /// Notes where the flux of the web is not what the file says of it, and an opening that no luminaire has.
    fn compare(&mut self) {
        let Opening { width, length, height, .. } = self.opening;
        let longest = width.max(length).max(height);
        if longest > 0.0 && !(SHORTEST..=LONGEST).contains(&longest) {
            self.warnings.push(format!("its luminous opening is {longest} m long: are its numbers in another unit?"));
        }
        let flux = self.flux();
        if let Some(stated) = self.stated_flux.filter(|s| (flux / s - 1.0).abs() > DISAGREEMENT) {
            let percent = 100.0 * (flux / stated - 1.0);
            self.warnings.push(format!(
                "the web has {flux:.1} lm, the file states {stated:.1} lm ({percent:+.1} %): the web is used as it is"
            ));
        }
        if let Some((_, lamps)) = self.lamps.filter(|(_, lamps)| flux / lamps > 1.0 + DISAGREEMENT) {
            self.warnings.push(format!(
                "the web has {flux:.1} lm, more than the {lamps:.1} lm of its lamps: it is used as it is"
            ));
        }
    }
}

/// The web of what was measured; `line` is where the angles of its planes stand.
fn woven(name: Named, line: usize, measured: &Measured) -> Result<(Arc<Web>, Symmetry)> {
    let (first, last) = (measured.planes[0], measured.planes[measured.planes.len() - 1]);
    let shown = format!("{first} .. {last} degrees");
    if last - first > 360.0 {
        return Err(name.bad(line, "planes", shown, "at most a full turn"));
    }
    let (grid, symmetry) = measured.grid().map_err(|allowed| name.bad(line, "planes", shown, allowed))?;
    let web = Web::new(grid);
    match web.flux() > 0.0 {
        true => Ok((Arc::new(web), symmetry)),
        false => Err(name.bad(line, "intensities", "no flux", "light in some direction")),
    }
}
