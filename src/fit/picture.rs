//! Mesh, series and the radial error between them, side by side, by parallel rays from one side.
//!
//! Where a pixel sees the series is found on points of it joined by small triangles, which stray from it by far less than a
//! pixel; its normal and its error there are its own. First hits by safe steps would take minutes for the same picture.

use super::radial::Radial;
use super::{Fitted, Request};
use crate::error::Result;
use crate::geometry::harmonic::Star;
use crate::geometry::{Geometry, Mesh, Ray};
use crate::math::{DVec3, PI, sin_cos};
use crate::report::{View, short, write_views};
use std::path::Path;

/// Pixels along a side of each view.
const SIDE: u32 = 400;
/// Steps from pole to pole between the points of the series; around the poles twice as many.
const STEPS: u32 = 192;
/// From where it is seen: the front left, from above; +Y is up.
const SEEN_FROM: DVec3 = DVec3::new(0.45, 0.35, 0.82);
/// From where it is lit, in the axes right, up and towards the viewer.
const LIT_FROM: DVec3 = DVec3::new(-0.4, 0.5, 0.77);

/// Parallel rays through the pixels of a view.
struct Eye {
    right: DVec3,
    up: DVec3,
    back: DVec3,
    light: DVec3,
    /// Half the side of the view, and the distance from which rays start \[m\].
    half: f64,
}

/// Writes the picture of `fitted` to `path`; the largest radial error in it \[m\].
pub fn write(path: &Path, request: &Request, fitted: &Fitted) -> Result<f64> {
    let Fitted { star, radial, .. } = fitted;
    let corners = radial.faces.iter().flat_map(|face| face.corners).map(DVec3::length);
    let eye = Eye::new(1.03 * corners.fold(star.radii().1, f64::max));
    let mesh = eye.pixels(|ray| radial.geometry.closest_hit(ray).map(|hit| hit.normal));
    let drawn = triangles(star);
    let series = eye.pixels(|ray| drawn.closest_hit(ray).map(|hit| hit.position.normalize()));
    let error = numbers(&series, |&direction| radial_error(star, radial, direction));
    let mesh = numbers(&mesh, |&normal| Some(eye.shade(normal)));
    let series = numbers(&series, |&direction| Some(eye.shade(star.normal_and_area(direction).0)));
    let largest = error.iter().copied().fold(0.0, f64::max);
    let n = request.degree;
    let views = [
        View::shaded(format!("mesh: {} triangles", fitted.solid.triangles), mesh),
        View::shaded(format!("series of degree {n}"), series),
        View::measured(format!("radial error [m], largest here {}", short(largest, 3)), "m", error),
    ];
    let title = request.mesh.file_name().unwrap_or_default().to_string_lossy().into_owned();
    write_views(path, &format!("{title}: {} coefficients", (n + 1) * (n + 1)), SIDE, &views)?;
    Ok(largest)
}

/// Points of the surface of `star`, joined.
fn triangles(star: &Star) -> Geometry {
    let around = 2 * STEPS;
    let point = |(i, j): (u32, u32)| {
        let (across, z) = sin_cos(PI * f64::from(i) / f64::from(STEPS));
        let (sin, cos) = sin_cos(2.0 * PI * f64::from(j) / f64::from(around));
        let direction = DVec3::new(across * cos, across * sin, z);
        (star.series().value(direction) * direction).as_vec3()
    };
    let points: Vec<_> = (0..=STEPS).flat_map(|i| (0..around).map(move |j| (i, j))).map(point).collect();
    let at = |i: u32, j: u32| points[(i * around + j % around) as usize];
    let cells = (0..STEPS).flat_map(|i| (0..around).map(move |j| (i, j)));
    let cell = |(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    let triangles: Vec<_> = cells.flat_map(cell).collect();
    Geometry::new(Mesh::new(&triangles), Vec::new(), Vec::new())
}

fn radial_error(star: &Star, radial: &Radial, direction: DVec3) -> Option<f64> {
    radial.along(direction).map(|met| (star.series().value(direction) - met.radius).abs())
}

/// What `of` says of each pixel; NaN where nothing was met or is to be said.
fn numbers<T>(pixels: &[Option<T>], of: impl Fn(&T) -> Option<f64>) -> Vec<f64> {
    pixels.iter().map(|pixel| pixel.as_ref().and_then(&of).unwrap_or(f64::NAN)).collect()
}

impl Eye {
    fn new(half: f64) -> Eye {
        let back = SEEN_FROM.normalize();
        let right = DVec3::Y.cross(back).normalize();
        let up = back.cross(right);
        let light = LIT_FROM.normalize();
        Eye { right, up, back, light: light.x * right + light.y * up + light.z * back, half }
    }

    /// What the ray of each pixel meets, row 0 on top.
    fn pixels<T>(&self, met: impl Fn(&Ray) -> Option<T>) -> Vec<Option<T>> {
        let along = |i: u32| (f64::from(2 * i + 1) / f64::from(SIDE) - 1.0) * self.half;
        let ray = |(x, y): (u32, u32)| {
            let origin = along(x) * self.right - along(y) * self.up + 2.0 * self.half * self.back;
            Ray { origin, direction: -self.back }
        };
        let all = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y)));
        all.map(|at| met(&ray(at))).collect()
    }

    /// Brightness of a surface with this normal, 0 .. 1: the cosine, raised so that no side is black.
    fn shade(&self, normal: DVec3) -> f64 {
        let raised = 0.5 * (1.0 + normal.dot(self.light));
        raised * raised
    }
}
