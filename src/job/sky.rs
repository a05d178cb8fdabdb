//! What a job says of daylight: the sky, the sun in it, the openings through which it enters.

use super::Job;
use super::check::Checker;
use crate::error::Result;
use serde::{Deserialize, Serialize};

/// Largest luminance \[cd/m2\] and illuminance \[lx\] of a sky and its sun.
const MOST_DAYLIGHT: f64 = 1e9;
/// Most corners of an opening.
const MOST_CORNERS: usize = 64;
/// Most openings.
const MOST_OPENINGS: usize = 1024;
/// How far corners may lie off their plane, in units of the size of the opening.
const FLATNESS: f64 = 1e-3;

/// `[sky]`: what surrounds the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sky {
    /// Distribution of luminance.
    pub model: SkyModel,
    /// Luminance of the zenith \[cd/m2\]; either this or the next.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zenith_luminance: Option<f64>,
    /// Illuminance of the unobstructed horizontal plane by the sky without the sun \[lx\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub horizontal_illuminance: Option<f64>,
    /// Where the zenith is.
    #[serde(default = "up")]
    pub up: [f64; 3],
    /// Where north is; what of it lies along `up` does not count.
    #[serde(default = "north")]
    pub north: [f64; 3],
    /// Reflectance of the even ground below the horizon, lit by sky and sun, 0 ..= 1.
    #[serde(default)]
    pub ground_reflectance: f64,
    /// The sun.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sun: Option<Sun>,
    /// Whether grids and points are also given in percent of the outdoor illuminance.
    #[serde(default)]
    pub daylight_factor: bool,
}

/// Distribution of the luminance of the sky.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged, expecting = "\"uniform\", \"overcast\" or 1 .. 15, a type of the CIE standard general sky")]
pub enum SkyModel {
    /// Type 1 ..= 15 of the CIE standard general sky (CIE S 011, ISO 15469).
    Standard(u8),
    /// One of the skies with a name.
    Named(NamedSky),
}

/// A sky with a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NamedSky {
    /// The same luminance everywhere above the horizon.
    Uniform,
    /// The traditional overcast sky, Lz (1 + 2 cos z)/3.
    Overcast,
}

/// `[sky.sun]`: parallel light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sun {
    /// From north through east.
    pub azimuth_degrees: f64,
    /// Above the horizon.
    pub elevation_degrees: f64,
    /// Illuminance across its rays \[lx\]; 0: it only shapes the sky.
    #[serde(default)]
    pub illuminance: f64,
}

/// `[[opening]]`: a flat convex polygon through which daylight enters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Opening {
    /// Its corners in order, either way round \[m\].
    pub corners: Vec<[f64; 3]>,
}

impl SkyModel {
    /// Whether the distribution depends on where the sun is.
    fn needs_sun(self) -> bool {
        matches!(self, SkyModel::Standard(number) if ![1, 3, 5].contains(&number))
    }
}

fn up() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}

fn north() -> [f64; 3] {
    [0.0, 0.0, -1.0]
}

/// Refuses a sky and openings out of range.
pub(super) fn check(c: &Checker, job: &Job) -> Result<()> {
    if let Some(sky) = &job.sky {
        check_sky(c, job, sky)?;
    }
    let count = job.openings.len();
    c.that("opening", count, count <= MOST_OPENINGS, "at most 1024 openings")?;
    for (i, opening) in job.openings.iter().enumerate() {
        check_opening(c, &format!("opening[{i}].corners"), &opening.corners)?;
    }
    Ok(())
}

fn check_sky(c: &Checker, job: &Job, sky: &Sky) -> Result<()> {
    if let SkyModel::Standard(number) = sky.model {
        c.that("sky.model", number, (1..=15).contains(&number), "uniform, overcast, or a CIE type 1 .. 15")?;
    }
    let scales = [("zenith_luminance", sky.zenith_luminance), ("horizontal_illuminance", sky.horizontal_illuminance)];
    let [zenith, horizontal] = scales.map(|(_, scale)| scale.is_some());
    let allowed = "either zenith_luminance or horizontal_illuminance";
    c.that("sky", if zenith { "(both)" } else { "(neither)" }, zenith != horizontal, allowed)?;
    for (name, scale) in scales {
        let fits = scale.is_none_or(|x| x > 0.0 && x <= MOST_DAYLIGHT);
        c.that(&format!("sky.{name}"), scale.unwrap_or_default(), fits, "above 0, at most 1e9")?;
    }
    c.direction("sky.up", sky.up)?;
    c.direction("sky.north", sky.north)?;
    let apart = super::check::are_apart(sky.up, sky.north);
    c.that("sky.north", format!("{:?}", sky.north), apart, "not parallel to up")?;
    c.share("sky.ground_reflectance", sky.ground_reflectance)?;
    c.that("sky.sun", "(missing)", sky.sun.is_some() || !sky.model.needs_sun(), "a sun: this model depends on it")?;
    if let Some(sun) = &sky.sun {
        let (azimuth, elevation) = (sun.azimuth_degrees, sun.elevation_degrees);
        c.that("sky.sun.azimuth_degrees", azimuth, (-360.0..=360.0).contains(&azimuth), "-360 .. 360")?;
        c.that("sky.sun.elevation_degrees", elevation, (0.0..=90.0).contains(&elevation), "0 .. 90")?;
        let fits = (0.0..=MOST_DAYLIGHT).contains(&sun.illuminance);
        c.that("sky.sun.illuminance", sun.illuminance, fits, "0 .. 1e9 lx")?;
    }
    check_daylight_factor(c, job, sky)
}

/// A daylight factor is a share of the light of the sky alone, and of nothing else.
fn check_daylight_factor(c: &Checker, job: &Job, sky: &Sky) -> Result<()> {
    let sun = sky.sun.as_ref().map_or(0.0, |sun| sun.illuminance);
    let others = job.sources.len() + job.luminaires.len();
    let allowed = "false with a sun of illuminance above 0, a [[source]] or a [[luminaire]]: it is of the sky alone";
    c.that("sky.daylight_factor", "true", !sky.daylight_factor || (sun == 0.0 && others == 0), allowed)
}

fn check_opening(c: &Checker, field: &str, corners: &[[f64; 3]]) -> Result<()> {
    let count = corners.len();
    c.that(field, format!("{count} corners"), (3..=MOST_CORNERS).contains(&count), "3 .. 64 corners")?;
    for (i, &corner) in corners.iter().enumerate() {
        c.position(&format!("{field}[{i}]"), corner)?;
    }
    let allowed = "a flat convex polygon that has an area, each corner given once";
    c.that(field, format!("{corners:?}"), is_flat_and_convex(corners), allowed)
}

fn is_flat_and_convex(corners: &[[f64; 3]]) -> bool {
    use super::check::{cross, dot, length, minus};
    let (count, first) = (corners.len(), corners[0]);
    let size = corners.iter().map(|&p| length(minus(p, first))).fold(0.0, f64::max);
    let sum = (2..count).fold([0.0; 3], |sum: [f64; 3], i| {
        let part = cross(minus(corners[i - 1], first), minus(corners[i], first));
        std::array::from_fn(|k| sum[k] + part[k])
    });
    let area = length(sum);
    if area.is_nan() || area <= 1e-9 * size * size {
        return false;
    }
    let differ = |i: usize| corners[..i].iter().all(|&p| length(minus(p, corners[i])) > 1e-6 * size);
    if !(1..count).all(differ) {
        return false;
    }
    let normal = sum.map(|x| x / area);
    let beside = |a: [f64; 3], b: [f64; 3], p: [f64; 3]| dot(cross(minus(b, a), minus(p, a)), normal);
    (0..count).all(|i| {
        let (a, b) = (corners[i], corners[(i + 1) % count]);
        let flat = dot(minus(a, first), normal).abs() <= FLATNESS * size;
        flat && corners.iter().all(|&p| beside(a, b, p) >= -1e-9 * size * size)
    })
}
