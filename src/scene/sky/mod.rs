//! The sky: luminance by direction, horizontal illuminance, and directions drawn in proportion to luminance.
//!
//! ```text
//! L(v) = Lz l(v) above the horizon,   rho (E_sky + E_sun sin h)/pi below it,   E_sky = int L cos dw        [cd/m2], [lx]
//! ```
//!
//! v is the unit vector towards the sky. The sky is grey. Its sun is parallel light, a light of its own.

mod cells;
mod standard;

use self::cells::Cells;
use self::standard::Standard;
use super::Light;
use crate::job::{self, NamedSky, SkyModel};
use crate::math::{DVec2, DVec3, PI, gauss_legendre, sin_cos};
use crate::photometry::Colour;

/// Rows of cells between horizon and zenith, where the luminance is not the same everywhere.
const ROWS: usize = 64;
/// Columns of cells, where the luminance depends on the azimuth.
const COLUMNS: usize = 128;
/// Nodes of the quadrature in azimuth, and in height above and below the sun.
const NODES: usize = 96;

/// The sky around a scene.
#[derive(Clone, Debug)]
pub struct Sky {
    /// Horizontal axes, the first towards the azimuth of the sun, and the zenith.
    axes: [DVec3; 3],
    shape: Shape,
    /// Lz \[cd/m2\].
    zenith: f64,
    /// Luminance below the horizon \[cd/m2\].
    ground: f64,
    /// Of the unobstructed plane, by the sky alone \[lx\].
    horizontal: f64,
    /// The sun, where it shines.
    pub(super) sun: Option<Light>,
    cells: Cells,
}

/// Luminance over that of the zenith.
#[derive(Clone, Debug)]
enum Shape {
    Uniform,
    Overcast,
    Standard(Standard),
}

impl Shape {
    /// For the unit vector `v` in the axes of the sky, above the horizon.
    fn relative(&self, v: DVec3) -> f64 {
        match self {
            Shape::Uniform => 1.0,
            Shape::Overcast => (1.0 + 2.0 * v.z) / 3.0,
            Shape::Standard(standard) => standard.relative(v),
        }
    }

    /// Rows and columns of cells in which it hardly varies.
    fn divisions(&self) -> (usize, usize) {
        match self {
            Shape::Uniform => (1, 1),
            Shape::Standard(standard) if standard.depends_on_azimuth() => (ROWS, COLUMNS),
            Shape::Overcast | Shape::Standard(_) => (ROWS, 1),
        }
    }

    /// Its integral times the cosine to the zenith over the upper hemisphere \[sr\]; the sun is at the height `sun`.
    fn horizontal(&self, sun: f64) -> f64 {
        let rule = gauss_legendre(NODES);
        let mut sum = 0.0;
        for (low, high) in [(0.0, sun), (sun, 1.0)] {
            for &(x, of_height) in &rule {
                let z = 0.5 * ((high - low) * x + high + low);
                let across = (1.0 - z * z).max(0.0).sqrt();
                for &(x, of_azimuth) in &rule {
                    let (sin, cos) = sin_cos(0.5 * PI * (1.0 + x));
                    let l = self.relative(DVec3::new(across * cos, across * sin, z));
                    // Both halves beside the sun are the same.
                    sum += 0.5 * (high - low) * of_height * PI * of_azimuth * l * z;
                }
            }
        }
        sum
    }
}

impl Sky {
    /// The sky of a checked job.
    pub fn of_job(sky: &job::Sky) -> Sky {
        let up = DVec3::from(sky.up).normalize();
        let north = DVec3::from(sky.north).reject_from_normalized(up).normalize();
        let degrees = PI / 180.0;
        let sun = sky.sun.as_ref();
        let (sin, cos) = sin_cos(sun.map_or(0.0, |sun| sun.azimuth_degrees) * degrees);
        let towards = cos * north + sin * north.cross(up);
        let axes = [towards, up.cross(towards), up];
        let (height, across) = sin_cos(sun.map_or(0.0, |sun| sun.elevation_degrees) * degrees);
        let shape = match sky.model {
            SkyModel::Named(NamedSky::Uniform) => Shape::Uniform,
            SkyModel::Named(NamedSky::Overcast) => Shape::Overcast,
            SkyModel::Standard(number) => Shape::Standard(Standard::new(number, DVec3::new(across, 0.0, height))),
        };
        let integral = shape.horizontal(height.clamp(0.0, 1.0));
        let zenith = match (sky.zenith_luminance, sky.horizontal_illuminance) {
            (Some(zenith), _) => zenith,
            (None, illuminance) => illuminance.unwrap_or(0.0) / integral,
        };
        let horizontal = zenith * integral;
        let illuminance = sun.map_or(0.0, |sun| sun.illuminance);
        let ground = sky.ground_reflectance * (horizontal + illuminance * height) / PI;
        let direction = -(across * towards + height * up);
        let sun = (illuminance > 0.0).then(|| Light::Directional { direction, illuminance: Colour::grey(illuminance) });
        let cells = Cells::new(shape.divisions(), ground, |v| zenith * shape.relative(v));
        Sky { axes, shape, zenith, ground, horizontal, sun, cells }
    }

    /// Illuminance of the unobstructed horizontal plane by the sky without the sun \[lx\].
    pub fn horizontal_illuminance(&self) -> f64 {
        self.horizontal
    }

    fn own(&self, v: DVec3) -> DVec3 {
        let [x, y, z] = self.axes;
        DVec3::new(v.dot(x), v.dot(y), v.dot(z))
    }

    /// Luminance of what lies in the direction of the unit vector `v` \[cd/m2\].
    pub fn luminance(&self, v: DVec3) -> Colour {
        let own = self.own(v);
        Colour::grey(if own.z >= 0.0 { self.zenith * self.shape.relative(own) } else { self.ground })
    }

    /// Integral of the luminance over all directions, as its cells have it \[cd/m2 sr\].
    pub(super) fn integral(&self) -> f64 {
        self.cells.integral()
    }

    /// A direction towards the sky, nearly in proportion to luminance.
    pub fn sample(&self, u: DVec2) -> DVec3 {
        let [x, y, z] = self.axes;
        let own = self.cells.sample(u);
        (own.x * x + own.y * y + own.z * z).normalize()
    }

    /// Density with which [`Sky::sample`] draws the unit vector `v` \[1/sr\].
    pub fn density(&self, v: DVec3) -> f64 {
        self.cells.density(self.own(v))
    }

    /// The same with what would leave through the plane with the unit normal `n` mirrored there: all on its side.
    pub fn sample_above(&self, n: DVec3, u: DVec2) -> DVec3 {
        let v = self.sample(u);
        if v.dot(n) < 0.0 { mirrored(v, n) } else { v }
    }

    /// Density with which [`Sky::sample_above`] draws the unit vector `v` \[1/sr\].
    pub fn density_above(&self, n: DVec3, v: DVec3) -> f64 {
        if v.dot(n) < 0.0 { 0.0 } else { self.density(v) + self.density(mirrored(v, n)) }
    }
}

fn mirrored(v: DVec3, n: DVec3) -> DVec3 {
    (v - 2.0 * v.dot(n) * n).normalize()
}
