//! Area sources of a job: rectangles, discs and spheres that are surfaces, of even luminance in all directions.
//!
//! ```text
//! L = Phi/(pi A) for each side that shines
//! ```
//!
//! A disc is a polygon of 64 corners with its area: the rim is within 0.08 % of the radius. A sphere is a series of spherical
//! harmonics of degree 0, and exact.

use super::panel::{CORNERS, around, fan};
use super::{Model, Reflectance, Replaced, Surface};
use crate::error::Result;
use crate::geometry::Harmonic;
use crate::geometry::harmonic::{Series, Star};
use crate::job::Source;
use crate::math::{DMat3, DVec3, PI, frame};
use crate::photometry::Colour;

/// How much an area source shines, and what it reflects.
struct Shine {
    luminance: Option<f64>,
    flux: Option<f64>,
    reflectance: f64,
    two_sided: bool,
}

impl Shine {
    /// The surface of a source of this area \[m2\].
    fn surface(&self, area: f64) -> Surface {
        let sides = if self.two_sided { 2.0 } else { 1.0 };
        let of_flux = self.flux.unwrap_or_default() / (PI * area * sides);
        Surface {
            name: "area source".to_owned(),
            reflectance: Reflectance::Lambert(Colour::grey(self.reflectance)),
            double_sided: self.two_sided,
            emission: Colour::grey(self.luminance.unwrap_or(of_flux)),
        }
    }
}

impl Model {
    /// Adds `source` where it is a surface.
    ///
    /// # Errors
    /// None for a source of a checked job.
    pub(super) fn add_area_source(&mut self, source: &Source) -> Result<()> {
        match *source {
            Source::Rectangle { position, direction, along, size, luminance, flux, two_sided, reflectance } => {
                let normal = DVec3::from(direction).normalize();
                let u = DVec3::from(along).reject_from_normalized(normal).normalize();
                let (u, v) = (0.5 * size[0] * u, 0.5 * size[1] * normal.cross(u));
                let shine = Shine { luminance, flux, reflectance, two_sided };
                self.add_flat(position.into(), normal, around(u, v, 4), &shine.surface(size[0] * size[1]));
            }
            Source::Disc { position, direction, radius, luminance, flux, two_sided, reflectance } => {
                let normal = DVec3::from(direction).normalize();
                let (u, v) = frame(normal);
                let shine = Shine { luminance, flux, reflectance, two_sided };
                let corners = around(radius * u, radius * v, CORNERS);
                self.add_flat(position.into(), normal, corners, &shine.surface(PI * radius * radius));
            }
            Source::Sphere { position, radius, luminance, flux, reflectance } => {
                let star = Star::new(Series::constant(radius))?;
                let harmonic = Harmonic::new(star, position.into(), DMat3::IDENTITY)?;
                let shine = Shine { luminance, flux, reflectance, two_sided: false };
                self.replacements.push(Replaced { harmonic, surface: self.surfaces.len() as u32, node: None });
                self.surfaces.push(shine.surface(4.0 * PI * radius * radius));
            }
            Source::Omni { .. } | Source::Spot { .. } | Source::CosPower { .. } => {}
        }
        Ok(())
    }

    /// Adds the polygon with `corners` about `center`, its front on the side of `normal`.
    fn add_flat(&mut self, center: DVec3, normal: DVec3, corners: Vec<DVec3>, surface: &Surface) {
        for [a, b, c] in fan(&corners) {
            let first = self.positions.len() as u32;
            let [b, c] = if (b - a).cross(c - a).dot(normal) < 0.0 { [c, b] } else { [b, c] };
            self.positions.extend([a, b, c].map(|p| center + p));
            self.triangles.push([first, first + 1, first + 2]);
            self.surface_of.push(self.surfaces.len() as u32);
        }
        self.surfaces.push(surface.clone());
    }
}
