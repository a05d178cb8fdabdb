//! `reflectance` and `brdf`: what laws of reflection do, and where one comes from.

use super::{Exit, Outcome};
use lampyris::error::{Error, Result};
use lampyris::farm::inputs::read_scene;
use lampyris::report;
use lampyris::scene::{Tabulated, law_of_road};
use std::path::Path;

/// What each material of the job reflects and transmits.
pub fn reflectance(job: &Path) -> Result<Outcome> {
    let scene = read_scene(job)?;
    Ok(Outcome { text: report::reflectance_text(&scene), exit: Exit::Done })
}

/// Writes the tabulated law of an r-table.
pub fn brdf(table: &Path, output: &Path) -> Result<Outcome> {
    let name = table.display().to_string();
    let text = std::fs::read_to_string(table)
        .map_err(|e| Error::input("command line", "TABLE", &name, format!("a text with an r-table ({e})")))?;
    let law = law_of_road(&name, &text)?;
    Tabulated::parse(&name, law.as_bytes())?;
    std::fs::write(output, &law).map_err(Error::io(output))?;
    Ok(Outcome { text: format!("tabulated law in {}\n", output.display()), exit: Exit::Done })
}
