//! What a job says of lights: sources by formula, luminaires by their files.

use super::Job;
use super::check::Checker;
use crate::error::Result;
use serde::{Deserialize, Serialize};

/// Largest intensity \[cd\] and flux \[lm\] that can be typed.
const MOST_LIGHT: f64 = 1e12;
/// Largest factor on the intensities of a file.
const MOST_FACTOR: f64 = 1e6;
/// Least and greatest length of an area source \[m\].
const SHORTEST: f64 = 1e-6;
const LONGEST: f64 = 1e6;
/// Largest exponent of a cosine: a beam of a fifth of a degree.
const MOST_EXPONENT: f64 = 1e6;

/// `[[source]]`: a light source given by a formula.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, tag = "kind", rename_all = "snake_case")]
pub enum Source {
    /// The same intensity in all directions.
    Omni {
        /// Position \[m\].
        position: [f64; 3],
        /// Luminous intensity \[cd\].
        intensity: f64,
    },
    /// Full intensity inside a cone, none outside another, between them as a spot of KHR_lights_punctual.
    Spot {
        /// Position \[m\].
        position: [f64; 3],
        /// Axis; need not be a unit vector.
        direction: [f64; 3],
        /// Luminous intensity on the axis \[cd\].
        intensity: f64,
        /// Half angle of the inner cone.
        inner_degrees: f64,
        /// Half angle of the outer cone.
        outer_degrees: f64,
    },
    /// Intensity times a power of the cosine to the axis, in the hemisphere around it.
    CosPower {
        /// Position \[m\].
        position: [f64; 3],
        /// Axis; need not be a unit vector.
        direction: [f64; 3],
        /// Luminous intensity on the axis \[cd\].
        intensity: f64,
        /// The power: 1 for a small Lambert surface.
        exponent: f64,
    },
    /// A rectangle of even luminance.
    Rectangle {
        /// Its middle \[m\].
        position: [f64; 3],
        /// Normal of the side that shines; need not be a unit vector.
        direction: [f64; 3],
        /// Where its first edge points; what of it lies along `direction` does not count.
        along: [f64; 3],
        /// Lengths of the first edge and of the other \[m\].
        size: [f64; 2],
        /// Luminance \[cd/m2\]; either this or the next.
        luminance: Option<f64>,
        /// Flux of all that shines \[lm\].
        flux: Option<f64>,
        /// Whether the other side shines as well; else it absorbs.
        #[serde(default)]
        two_sided: bool,
        /// Reflectance of what shines, 0 ..= 1.
        #[serde(default)]
        reflectance: f64,
    },
    /// A disc of even luminance.
    Disc {
        /// Its middle \[m\].
        position: [f64; 3],
        /// Normal of the side that shines; need not be a unit vector.
        direction: [f64; 3],
        /// Radius \[m\].
        radius: f64,
        /// Luminance \[cd/m2\]; either this or the next.
        luminance: Option<f64>,
        /// Flux of all that shines \[lm\].
        flux: Option<f64>,
        /// Whether the other side shines as well; else it absorbs.
        #[serde(default)]
        two_sided: bool,
        /// Reflectance of what shines, 0 ..= 1.
        #[serde(default)]
        reflectance: f64,
    },
    /// A sphere of even luminance.
    Sphere {
        /// Its middle \[m\].
        position: [f64; 3],
        /// Radius \[m\].
        radius: f64,
        /// Luminance \[cd/m2\]; either this or the next.
        luminance: Option<f64>,
        /// Flux \[lm\].
        flux: Option<f64>,
        /// Reflectance, 0 ..= 1.
        #[serde(default)]
        reflectance: f64,
    },
}

impl Source {
    /// Its place, or its middle \[m\].
    pub fn position(&self) -> [f64; 3] {
        match self {
            Source::Omni { position, .. }
            | Source::Spot { position, .. }
            | Source::CosPower { position, .. }
            | Source::Rectangle { position, .. }
            | Source::Disc { position, .. }
            | Source::Sphere { position, .. } => *position,
        }
    }
}

/// `[[luminaire]]`: the photometric web of an IES or EULUMDAT file at a place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Luminaire {
    /// The file, relative to the job file.
    pub file: String,
    /// Node of the scene in whose coordinates the following are given; left out: those of the world.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub node: Option<String>,
    /// Position of the photometric centre \[m\]; left out, with a node: its origin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position: Option<[f64; 3]>,
    /// Where the direction of the two angles 0 points.
    #[serde(default = "down")]
    pub aim: [f64; 3],
    /// Where C0 points; what of it lies along the aim does not count.
    #[serde(default = "right")]
    pub c0: [f64; 3],
    /// Factor on the intensities.
    #[serde(default = "one")]
    pub multiplier: f64,
    /// Another, 0 ..= 1.
    #[serde(default = "one")]
    pub dimming: f64,
    /// What shines: the luminous opening that the file describes, or a point.
    #[serde(default)]
    pub extent: Extent,
    /// Node of the scene whose mesh, and what hangs below, shines in the place of both; left out: as `extent` says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<String>,
    /// Flux to which the web is scaled before the two factors \[lm\]; left out: as the file has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flux: Option<f64>,
}

/// What of a luminaire shines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Extent {
    /// The opening in the file where it has an area, else a point.
    #[default]
    File,
    /// A point: right from some five times its size on.
    Point,
    /// The opening in the file, with the luminance that its intensities ask for; a file without one is refused.
    Opening,
}

fn down() -> [f64; 3] {
    [0.0, -1.0, 0.0]
}

fn right() -> [f64; 3] {
    [1.0, 0.0, 0.0]
}

fn one() -> f64 {
    1.0
}

impl Job {
    /// The files of luminaires, each once, in the order in which the job first names them.
    pub fn luminaire_files(&self) -> Vec<&str> {
        let mut files: Vec<&str> = Vec::new();
        let mut known = std::collections::HashSet::new();
        files.extend(self.luminaires.iter().map(|l| l.file.as_str()).filter(|file| known.insert(*file)));
        files
    }

    /// True where the job adds to its scene a single `[[source]]`, and nothing else that shines or reflects.
    pub fn adds_one_source(&self) -> bool {
        self.sources.len() == 1
            && self.luminaires.is_empty()
            && self.planes.is_empty()
            && self.spheres.is_empty()
            && self.sky.is_none()
    }
}

/// Refuses lights out of range, and a job without any.
pub(super) fn check(c: &Checker, job: &Job) -> Result<()> {
    for (i, source) in job.sources.iter().enumerate() {
        check_source(c, &format!("source[{i}]"), source)?;
    }
    for (i, luminaire) in job.luminaires.iter().enumerate() {
        check_luminaire(c, &format!("luminaire[{i}]"), luminaire, job.scene.is_some())?;
    }
    let lit = job.scene.is_some() || !job.sources.is_empty() || !job.luminaires.is_empty() || job.sky.is_some();
    c.that("scene", "(missing)", lit, "a scene file, or at least one [[source]] or [[luminaire]], or a [sky]")
}

fn check_source(c: &Checker, at: &str, source: &Source) -> Result<()> {
    match source {
        Source::Omni { position, intensity } => check_point(c, at, *position, None, *intensity),
        Source::Spot { position, direction, intensity, inner_degrees: inner, outer_degrees: outer } => {
            check_point(c, at, *position, Some(*direction), *intensity)?;
            let fits = *outer > 0.0 && *outer <= 90.0;
            c.that(&format!("{at}.outer_degrees"), outer, fits, "above 0, at most 90")?;
            let fits = *inner >= 0.0 && inner < outer;
            c.that(&format!("{at}.inner_degrees"), inner, fits, "0 or more, below outer_degrees")
        }
        Source::CosPower { position, direction, intensity, exponent } => {
            check_point(c, at, *position, Some(*direction), *intensity)?;
            let fits = (0.0..=MOST_EXPONENT).contains(exponent);
            c.that(&format!("{at}.exponent"), exponent, fits, "0 .. 1e6")
        }
        Source::Rectangle { position, direction, along, size, luminance, flux, reflectance, .. } => {
            c.direction(&format!("{at}.direction"), *direction)?;
            c.direction(&format!("{at}.along"), *along)?;
            let apart = super::check::are_apart(*direction, *along);
            c.that(&format!("{at}.along"), format!("{along:?}"), apart, "not parallel to direction")?;
            check_area(c, at, *position, ("size", size), (*luminance, *flux), *reflectance)
        }
        Source::Disc { position, direction, radius, luminance, flux, reflectance, .. } => {
            c.direction(&format!("{at}.direction"), *direction)?;
            check_area(c, at, *position, ("radius", &[*radius]), (*luminance, *flux), *reflectance)
        }
        Source::Sphere { position, radius, luminance, flux, reflectance } => {
            check_area(c, at, *position, ("radius", &[*radius]), (*luminance, *flux), *reflectance)
        }
    }
}

fn check_point(c: &Checker, at: &str, place: [f64; 3], direction: Option<[f64; 3]>, intensity: f64) -> Result<()> {
    c.position(&format!("{at}.position"), place)?;
    let fits = intensity > 0.0 && intensity <= MOST_LIGHT;
    c.that(&format!("{at}.intensity"), intensity, fits, "above 0, at most 1e12 cd")?;
    direction.map_or(Ok(()), |direction| c.direction(&format!("{at}.direction"), direction))
}

fn check_area(
    c: &Checker,
    at: &str,
    place: [f64; 3],
    (name, lengths): (&str, &[f64]),
    (luminance, flux): (Option<f64>, Option<f64>),
    reflectance: f64,
) -> Result<()> {
    c.position(&format!("{at}.position"), place)?;
    let fits = lengths.iter().all(|length| (SHORTEST..=LONGEST).contains(length));
    let shown = if let [length] = lengths { length.to_string() } else { format!("{lengths:?}") };
    c.that(&format!("{at}.{name}"), shown, fits, "1e-6 .. 1e6 m")?;
    let both = luminance.is_some();
    let allowed = "either luminance or flux";
    c.that(at, if both { "(both)" } else { "(neither)" }, both != flux.is_some(), allowed)?;
    for (name, value) in [("luminance", luminance), ("flux", flux)] {
        let fits = value.is_none_or(|x| x > 0.0 && x <= MOST_LIGHT);
        c.that(&format!("{at}.{name}"), value.unwrap_or_default(), fits, "above 0, at most 1e12")?;
    }
    c.share(&format!("{at}.reflectance"), reflectance)
}

fn check_luminaire(c: &Checker, at: &str, luminaire: &Luminaire, has_scene: bool) -> Result<()> {
    if let Some(node) = &luminaire.node {
        c.that(&format!("{at}.node"), node, has_scene, "a node only with a scene")?;
    }
    if let Some(mesh) = &luminaire.mesh {
        c.that(&format!("{at}.mesh"), mesh, has_scene, "a mesh only with a scene")?;
        let (alone, said) = (luminaire.extent == Extent::File, format!("{:?}", luminaire.extent).to_lowercase());
        c.that(&format!("{at}.extent"), said, alone, "left out beside a mesh, which is what shines")?;
    }
    let placed = luminaire.node.is_some() || luminaire.position.is_some() || luminaire.mesh.is_some();
    c.that(&format!("{at}.position"), "(missing)", placed, "a position, a node or a mesh")?;
    c.position(&format!("{at}.position"), luminaire.position.unwrap_or_default())?;
    c.direction(&format!("{at}.aim"), luminaire.aim)?;
    c.direction(&format!("{at}.c0"), luminaire.c0)?;
    let factor = luminaire.multiplier;
    c.that(&format!("{at}.multiplier"), factor, factor > 0.0 && factor <= MOST_FACTOR, "above 0, at most 1e6")?;
    c.share(&format!("{at}.dimming"), luminaire.dimming)?;
    let flux = luminaire.flux.unwrap_or(1.0);
    c.that(&format!("{at}.flux"), flux, flux > 0.0 && flux <= MOST_LIGHT, "above 0, at most 1e12 lm")
}
