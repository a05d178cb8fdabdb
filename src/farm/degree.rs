//! The degree of a series where the job leaves it to the pictures.
//!
//! What a truncated series leaves out displaces its surface by at most the sum of |c_k| over the degrees k above, along the
//! radius. The degree is the least for which that, seen from the nearest camera, is below the error asked for; so an object far
//! away is summed to fewer degrees, as the paper suggests.

use super::receivers::camera_eye;
use crate::geometry::Harmonic;
use crate::job::{Degree, DegreeWord, Job};
use crate::scene::Scene;
use crate::transport::eye::Eye;

/// Error where the job names none \[pixels\].
const ERROR: f64 = 0.25;

/// Fixes every degree that `job` leaves open; the objects of `scene` are its replacements, summed whole.
pub fn fix(job: &mut Job, scene: &Scene) {
    let allowed: Vec<f64> = scene.geometry.harmonics().iter().map(|object| pixel(job, scene, object)).collect();
    for ((replacement, object), pixel) in job.replacements.iter_mut().zip(scene.geometry.harmonics()).zip(allowed) {
        if let Some(Degree::Word(DegreeWord::Auto)) = replacement.degree {
            let error = replacement.error_pixels.take().unwrap_or(ERROR);
            let degree = truncation(&object.star().series().norms(), error * pixel);
            replacement.degree = Some(Degree::Number(degree));
        }
    }
}

/// True where there is a degree to fix.
pub fn is_open(job: &Job) -> bool {
    job.replacements.iter().any(|r| matches!(r.degree, Some(Degree::Word(_))))
}

/// The least degree above which `norms` sum to at most `allowed`.
fn truncation(norms: &[f64], allowed: f64) -> u32 {
    let mut left = 0.0;
    let too_much = |norm: &f64| {
        left += norm;
        left > allowed
    };
    let dropped = norms.iter().rev().position(too_much).unwrap_or(norms.len());
    (norms.len() - dropped).saturating_sub(1) as u32
}

/// The size of a pixel at `object` in the units of its series, of the camera in which that is least.
fn pixel(job: &Job, scene: &Scene, object: &Harmonic) -> f64 {
    let (center, radius, stretch) = object.around();
    let seen = |camera| match camera_eye(scene, camera) {
        Eye::Camera { eye, up, .. } => {
            let distance = ((eye - center).length() - radius).max(0.0);
            distance * 2.0 * up.length() / f64::from(camera.height)
        }
        Eye::Sphere { .. } | Eye::Surface { .. } => 0.0,
    };
    job.cameras.iter().map(seen).fold(f64::INFINITY, f64::min) / stretch
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_out_stays_below_what_is_allowed() {
        let norms = [1.0, 0.5, 0.25, 0.125];
        for (allowed, degree) in [(0.0, 3), (0.124, 3), (0.125, 2), (0.375, 1), (0.5, 1), (0.875, 0), (100.0, 0)] {
            assert_eq!(truncation(&norms, allowed), degree, "{allowed}");
        }
    }
}
