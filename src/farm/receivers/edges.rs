//! Which bins of a film lie across an edge: positions in them differ most, so they have more of them.
//!
//! A straight edge that crosses a bin separates its corners. So the rays through the corners of all bins are followed to the first surface
//! (a mirror is one), and a bin is across an edge where neighbouring corners show different surfaces: one and nothing, planes that
//! are not each other's, other reflectances or other emissions. The choice is the same for every batch, and looks at no light that arrives.

use super::gaze_ray;
use crate::geometry::Ray;
use crate::math::{DVec2, DVec3};
use crate::scene::Scene;
use crate::transport::eye::Eye;
use rayon::prelude::*;
use std::ops::Range;

/// Rows of bins that one thread looks at.
const BAND: u32 = 16;
/// Cosine between normals below which surfaces are different.
const ALIKE: f64 = 0.8;
/// Sine of the angle with a surface above which the way to another point leaves it.
const STEEP: f64 = 0.3;
/// Relative difference above which reflectances or emissions are different.
const DIFFERENT: f64 = 0.1;

/// What is seen in a corner, as far as it tells surfaces apart.
#[derive(Clone, Copy)]
struct Corner {
    position: DVec3,
    normal: DVec3,
    reflectance: f64,
    emission: f64,
}

/// For each bin of the film of `eye`, row by row, whether it lies across an edge.
pub(super) fn across_edges(scene: &Scene, eye: &Eye, film: (u32, u32)) -> Vec<bool> {
    let bands: Vec<u32> = (0..film.1).step_by(BAND as usize).collect();
    let of_band = |first: u32| across_in(scene, eye, film, first..(first + BAND).min(film.1));
    bands.into_par_iter().flat_map_iter(of_band).collect()
}

/// The same for the bins of some rows.
fn across_in(scene: &Scene, eye: &Eye, (width, height): (u32, u32), rows: Range<u32>) -> Vec<bool> {
    let line = |row: u32| corners(scene, eye, width, f64::from(row) / f64::from(height));
    let mut above = line(rows.start);
    let mut across = Vec::with_capacity(rows.len() * width as usize);
    for row in rows {
        let below = line(row + 1);
        across.extend((0..width as usize).map(|i| {
            let around = [above[i], above[i + 1], below[i + 1], below[i], above[i]];
            around.windows(2).any(|pair| are_different(pair[0], pair[1]))
        }));
        above = below;
    }
    across
}

/// What `eye` sees in the corners of its bins that lie `down` its film.
fn corners(scene: &Scene, eye: &Eye, width: u32, down: f64) -> Vec<Option<Corner>> {
    let ray = |i: u32| gaze_ray(&eye.gaze(DVec2::new(f64::from(i) / f64::from(width), down)));
    let rays: Vec<Option<Ray>> = (0..=width).map(ray).collect();
    let there: Vec<Ray> = rays.iter().flatten().copied().collect();
    let mut hits = vec![None; there.len()];
    scene.geometry.closest_hits(&there, &mut hits);
    let mut hits = hits.into_iter();
    let corner = |ray: Option<Ray>| {
        let direction = ray?.direction;
        let hit = hits.next().flatten().filter(|hit| !scene.absorbs(hit))?;
        let reflectance = scene.reflectance(hit.primitive, hit.position).albedo(-direction.dot(hit.normal));
        let emission = scene.emitted(&hit, -direction).luminance();
        Some(Corner { position: hit.position, normal: hit.normal, reflectance: reflectance.luminance(), emission })
    };
    rays.into_iter().map(corner).collect()
}

fn are_different(a: Option<Corner>, b: Option<Corner>) -> bool {
    let (Some(a), Some(b)) = (a, b) else { return a.is_some() != b.is_some() };
    let way = b.position - a.position;
    let rise = way.dot(a.normal).abs().max(way.dot(b.normal).abs());
    let differ = |a: f64, b: f64| (a - b).abs() > DIFFERENT * a.max(b);
    a.normal.dot(b.normal) < ALIKE
        || rise > STEEP * way.length()
        || differ(a.reflectance, b.reflectance)
        || differ(a.emission, b.emission)
}
