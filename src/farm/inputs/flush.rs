//! Luminous openings that lie in the plane of a surface: a line of sight cannot tell which of the two it meets. Light is not
//! concerned, for it leaves openings and arrives at surfaces on points that are lifted off them.

use crate::geometry::Ray;
use crate::math::DVec2;
use crate::scene::{Panel, Scene};

/// Places of an opening that are looked at, from both sides.
const PLACES: u32 = 16;
/// Where the looks start, and what counts as the plane of the opening, in lengths by which points are lifted.
const AWAY: f64 = 256.0;
const NEAR: f64 = 4.0;

/// What is said of the flat openings of `scene` that lie in a surface.
pub(super) fn warning(scene: &Scene) -> Option<String> {
    let flush: Vec<&Panel> =
        scene.sources.panels.iter().filter(|panel| panel.is_flat() && is_flush(scene, panel)).collect();
    let [x, y, z] = (flush.first()?.luminaire.position - scene.place([0.0; 3])).to_array();
    let others = if flush.len() > 1 { format!(", as {} others do", flush.len() - 1) } else { String::new() };
    Some(format!(
        "the luminous opening of the luminaire at [{x:.3}, {y:.3}, {z:.3}] lies in the plane of a surface{others}: illuminance is right, but \
         cameras see the one or the other; hang it 1 mm off"
    ))
}

/// True where a look at a flat panel ends on something else in its plane.
fn is_flush(scene: &Scene, panel: &Panel) -> bool {
    let lift = scene.geometry.lift_length();
    let ends_elsewhere = |k: u32, side: f64| {
        let face = &panel.faces[k as usize * panel.faces.len() / PLACES as usize];
        let place = face.point(DVec2::new((f64::from(k) + 0.5) / f64::from(PLACES), (0.618 * f64::from(k)).fract()));
        let ray = Ray { origin: place + side * AWAY * lift * face.normal, direction: -side * face.normal };
        let hit = scene.geometry.closest_hit_within(&ray, (AWAY + NEAR) * lift);
        let its = |primitive: u32| panel.faces.iter().any(|face| face.primitive == primitive);
        hit.is_some_and(|hit| hit.distance > (AWAY - NEAR) * lift && !its(hit.primitive))
    };
    (0..PLACES).any(|k| ends_elsewhere(k, 1.0) || ends_elsewhere(k, -1.0))
}
