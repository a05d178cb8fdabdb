//! Luminous openings that lie in the plane of a surface, where a line of sight cannot tell which of the two it meets, or that a surface
//! cuts, behind which part of their light is lost.

use crate::geometry::Ray;
use crate::math::{DVec2, DVec3};
use crate::scene::{Emitter, Panel, Scene};

/// Places of an opening that are looked at.
const PLACES: usize = 16;
/// Where the looks start, and what counts as the plane of the opening, in lengths by which points are lifted.
const AWAY: f64 = 256.0;
const NEAR: f64 = 4.0;
/// The share of its size to which a face is shrunk before its edges are followed: what it touches does not cut it.
const SHRUNK: f64 = 0.98;

const FLUSH: &str = "lies in the plane of a surface: direct illuminance is right, but cameras and gloss see the one or the other; hang it 1 mm off";
const CUT: &str = "is cut by a surface: what shines behind that is lost; a box, cylinder or ball stands about the place where it hangs, half of it \
                   above";

/// What is said of the openings of `scene` that lie in a surface, and of those that are cut by one.
pub(super) fn warnings(scene: &Scene) -> Vec<String> {
    let all = &scene.sources.panels;
    let flush: Vec<&Panel> = all.iter().filter(|panel| is_flush(scene, panel)).collect();
    let cut: Vec<&Panel> = all.iter().filter(|panel| is_cut(scene, panel)).collect();
    [(flush, FLUSH), (cut, CUT)].iter().filter_map(|(panels, what)| sentence(scene, panels, what)).collect()
}

fn sentence(scene: &Scene, panels: &[&Panel], what: &str) -> Option<String> {
    let [x, y, z] = (panels.first()?.luminaire.position - scene.place([0.0; 3])).to_array();
    let others = if panels.len() > 1 { format!(", like {} others,", panels.len() - 1) } else { String::new() };
    Some(format!("the luminous opening of the luminaire at [{x:.3}, {y:.3}, {z:.3}]{others} {what}"))
}

fn is_of(scene: &Scene, panel: &Panel, primitive: u32) -> bool {
    scene.sources.panel_face(primitive).is_some_and(|(_, other, _)| std::ptr::eq(panel, other))
}

/// True where a look at a face of a panel, from a side on which it shines, ends on something else in its plane.
fn is_flush(scene: &Scene, panel: &Panel) -> bool {
    let lift = scene.geometry.lift_length();
    let sides = if panel.is_flat() { &[1.0, -1.0][..] } else { &[1.0] };
    let ends_elsewhere = |k: usize, face: &Emitter, normal: DVec3| {
        let share = (k as f64 + 0.5) / PLACES as f64;
        let place = face.point(DVec2::new(share, (0.618 * k as f64).fract()));
        let ray = Ray { origin: place + AWAY * lift * normal, direction: -normal };
        let hit = scene.geometry.closest_hit_within(&ray, (AWAY + NEAR) * lift);
        hit.is_some_and(|hit| hit.distance > (AWAY - NEAR) * lift && !is_of(scene, panel, hit.primitive))
    };
    (0..PLACES).any(|k| {
        let face = &panel.faces[k * panel.faces.len() / PLACES];
        let mut shining = sides.iter().map(|side| *side * face.normal).filter(|n| !panel.luminance(*n).is_black());
        shining.any(|normal| ends_elsewhere(k, face, normal))
    })
}

/// True where ways around the faces of a panel that is not flat, just before them, meet something: where it hangs, or both a little to one side
/// and to the other, for edges between faces may lie in the very surface. What it touches is met on one side alone.
fn is_cut(scene: &Scene, panel: &Panel) -> bool {
    let corners = || panel.faces.iter().flat_map(|face| face.corners);
    let [low, high] = [corners().reduce(DVec3::min), corners().reduce(DVec3::max)].map(Option::unwrap_or_default);
    let aside = (1.0 - SHRUNK) * (high - low).max_element();
    let both = |axis: DVec3| is_met(scene, panel, aside * axis) && is_met(scene, panel, -aside * axis);
    !panel.is_flat() && (is_met(scene, panel, DVec3::ZERO) || DVec3::AXES.into_iter().any(both))
}

/// The same for the panel moved by so much.
fn is_met(scene: &Scene, panel: &Panel, by: DVec3) -> bool {
    let off = AWAY * scene.geometry.lift_length();
    let meets = |from: DVec3, to: DVec3| {
        let way = to - from;
        let ray = Ray { origin: from, direction: way.normalize() };
        scene.geometry.closest_hit_within(&ray, way.length()).is_some_and(|hit| !is_of(scene, panel, hit.primitive))
    };
    panel.faces.iter().any(|face| {
        let middle = face.corners.iter().sum::<DVec3>() / 3.0;
        let corner = |i: usize| middle + by + SHRUNK * (face.corners[i % 3] - middle) + off * face.normal;
        (0..3).any(|i| meets(corner(i), corner(i + 1)))
    })
}
