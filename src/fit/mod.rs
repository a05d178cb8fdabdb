//! A closed mesh in, a star-shaped object out: spherical harmonics fitted to a mesh, and how far they are from it.
//!
//! ```text
//! mesh -> welded, closed Solid -> centre from which all faces are seen from within -> r(n) by rays -> series -> file
//! ```
//!
//! The coefficients are the projection of r(n), the distance of the mesh from the centre c in the direction n, on the
//! functions of [`geometry::harmonic`](crate::geometry::harmonic): a mesh for which r is not a function is refused, never
//! fitted silently. What is reported is measured with the numbers that the file holds, against the mesh as it was read.
//!
//! The order of the work, a file each: `input` and `obj` (files), `solid` (welding, closedness), `star_shape` (the
//! centre), `radial` (rays), `errors` (the comparison), `text` and `picture` (what is shown).

mod errors;
mod input;
mod obj;
mod picture;
mod radial;
mod solid;
mod star_shape;
mod text;

use crate::error::{Error, Result};
use crate::farm::durable::{check_output, replace};
use crate::geometry::harmonic::file::{File as Stored, Numbers};
use crate::geometry::harmonic::{MAX_DEGREE, Series, Star, projection};
use crate::math::{PI, pow, sin};
use errors::Errors;
use radial::Radial;
use solid::Solid;
use star_shape::Centre;
use std::io::Write;
use std::path::PathBuf;

/// The largest power of the Lanczos factor.
pub const MAX_LANCZOS: f64 = 16.0;

/// Nodes of the rule in z for series of low degree: a mesh has details that are not of its degree.
const FEWEST_NODES: usize = 64;

/// What is to be fitted, and how.
#[derive(Clone, Debug)]
pub struct Request {
    /// A .glb, .gltf or .obj file.
    pub mesh: PathBuf,
    /// The node whose mesh is meant, where the file has several.
    pub node: Option<String>,
    /// Degree N of the series, up to [`MAX_DEGREE`].
    pub degree: usize,
    /// How the coefficients are stored.
    pub numbers: Numbers,
    /// Power of the factor sin(x)/x, x = pi k/(N + 1), on the coefficients of degree k; 0 for none.
    pub lanczos: f64,
    /// The file to write; the picture gets its name with `.png`.
    pub output: PathBuf,
}

/// An object fitted to a mesh.
struct Fitted {
    solid: Solid,
    centre: Centre,
    radial: Radial,
    star: Star,
    /// Content of the file.
    bytes: Vec<u8>,
}

/// Fits as `request` says, writes the file and the picture, and says how far the two surfaces are apart.
///
/// # Errors
/// [`Error::Input`] for a mesh that is not closed or not star-shaped, with the place, and for whatever else is wrong in
/// the request or in the file; [`Error::Io`].
pub fn run(request: &Request) -> Result<String> {
    checked(request)?;
    let fitted = fit(request)?;
    let errors = Errors::measure(&fitted.solid, &fitted.centre, &fitted.radial, &fitted.star);
    replace(&request.output, |to| to.write_all(&fitted.bytes))?;
    let seen = picture::write(&request.output.with_extension("png"), request, &fitted)?;
    Ok(text::report(request, &fitted, &errors, seen))
}

/// Refuses what is out of range.
fn checked(request: &Request) -> Result<()> {
    let bad = |field: &str, value: String, allowed: String| Err(Error::input("command line", field, value, allowed));
    if request.degree > MAX_DEGREE {
        return bad("--degree", request.degree.to_string(), format!("0 .. {MAX_DEGREE}"));
    }
    if !(0.0..=MAX_LANCZOS).contains(&request.lanczos) {
        return bad("--lanczos", request.lanczos.to_string(), format!("0 .. {MAX_LANCZOS}"));
    }
    check_output(&request.output, "harmonic")
}

fn fit(request: &Request) -> Result<Fitted> {
    let name = request.mesh.display().to_string();
    let solid = Solid::new(&name, input::read(&request.mesh, request.node.as_deref())?)?;
    let centre = star_shape::centre(&name, &solid)?;
    let radial = Radial::new(&name, &solid, centre.position);
    let n = request.degree;
    // Twice the nodes that a series of this degree needs: what lies beyond the degree is then not taken for what lies below.
    let series = projection(n, (2 * (n + 1)).max(FEWEST_NODES), |directions| radial.radii(directions))?;
    let series = damped(&series, request.lanczos)?;
    let bytes = Stored { center: centre.position, series }.bytes(request.numbers);
    let series = Stored::parse(&name, &bytes)?.series;
    let star = Star::new(series).map_err(|e| {
        let allowed = format!("a degree whose series has positive radii everywhere; --lanczos may help ({e})");
        Error::input(&name, "--degree", n, allowed)
    })?;
    Ok(Fitted { solid, centre, radial, star, bytes })
}

/// `series` with the coefficients of degree k times (sin(x)/x)^`power`, x = pi k/(N + 1), which takes ripples off edges.
fn damped(series: &Series, power: f64) -> Result<Series> {
    let n = series.degree();
    let mut pairs = series.pairs();
    for k in 1..=n {
        let x = PI * k as f64 / (n + 1) as f64;
        let factor = pow(sin(x) / x, power);
        pairs[k * (k + 1) / 2..(k + 1) * (k + 2) / 2].iter_mut().for_each(|pair| *pair = pair.map(|c| c * factor));
    }
    Series::new(&pairs)
}
