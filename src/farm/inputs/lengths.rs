//! Signs that lengths are not in metres: each is a warning of the plan.

use crate::job::Job;
use crate::scene::Scene;

/// What stands farther from the middle of the scene than so many of its radii is mentioned.
const FAR: f64 = 50.0;

/// What seems odd about the size of `scene` and the places that `job` names.
pub(super) fn warnings(job: &Job, scene: &Scene) -> Vec<String> {
    lifted(scene).into_iter().chain(far(job, scene)).collect()
}

/// The scene is so large that f32 coordinates blur what stands in it.
fn lifted(scene: &Scene) -> Option<String> {
    let millimetres = 1e3 * scene.geometry.lift_length();
    (millimetres > 1.0).then(|| {
        format!(
            "the scene is so large that its points are lifted {millimetres:.1} mm off their surfaces: receivers see \
             through anything thinner or nearer than that; leave out far geometry, and mind that glTF is in metres"
        )
    })
}

/// Something stands far from all surfaces.
fn far(job: &Job, scene: &Scene) -> Option<String> {
    let (middle, radius) = scene.geometry.bounding_sphere();
    if radius == 0.0 || scene.geometry.is_unbounded() {
        return None;
    }
    let distance = |place: [f64; 3]| scene.place(place).distance(middle);
    let far: Vec<_> = places(job).into_iter().filter(|(_, place)| distance(*place) > FAR * radius).collect();
    let (field, place) = far.first()?;
    let others = if far.len() > 1 { format!(", as {} others do", far.len() - 1) } else { String::new() };
    Some(format!(
        "{field} lies {:.0} m from the middle of a scene with a radius of {radius:.1} m{others}: are lengths in metres?",
        distance(*place)
    ))
}

/// The places that `job` names, in the coordinates of the world \[m\].
fn places(job: &Job) -> Vec<(String, [f64; 3])> {
    fn of<'a, T>(
        table: &'a str,
        field: &'a str,
        list: &'a [T],
        place: impl Fn(&T) -> Option<[f64; 3]> + 'a,
    ) -> impl Iterator<Item = (String, [f64; 3])> + 'a {
        list.iter().enumerate().filter_map(move |(i, entry)| Some((format!("{table}[{i}].{field}"), place(entry)?)))
    }
    let hung = |l: &crate::job::Luminaire| l.position.filter(|_| l.node.is_none());
    of("camera", "eye", &job.cameras, |c| c.eye)
        .chain(of("grid", "origin", &job.grids, |g| Some(g.origin)))
        .chain(of("point", "position", &job.points, |p| Some(p.position)))
        .chain(of("gonio", "position", &job.gonios, |g| Some(g.position)))
        .chain(of("source", "position", &job.sources, |s| Some(s.position())))
        .chain(of("luminaire", "position", &job.luminaires, hung))
        .chain(of("opening", "corners[0]", &job.openings, |o| o.corners.first().copied()))
        .collect()
}
