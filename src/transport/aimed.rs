//! Reflection outside, aimed at the openings through which light enters.
//!
//! What falls beside the openings is drawn rarely, so it has great weights, and little of it finds a window after a reflection. So a
//! history that is drawn rarely goes on in a direction from a mixture of its law and the openings as seen from there,
//!
//! ```text
//! W_{n+1} = W_n f |cos| / q,    q(v) = (p_law(v) + p_openings(v))/2
//! ```
//!
//! which is unbiased whatever the openings are, and gives what goes through them the small weights that it shall have inside.

use crate::geometry::Hit;
use crate::math::DVec3;
use crate::random::Generator;
use crate::scene::{Aim, Scattered, Scene};

/// A history that was drawn less than this times as often as its flux asks for is aimed.
const RARE: f64 = 0.25;

/// True for a history that goes on aimed.
pub fn is_aimed(scene: &Scene, emphasis: f64) -> bool {
    emphasis < RARE && !scene.openings().is_empty()
}

/// Draws the direction after a reflection at `hit`, and says whether an opening lies there; `None` where nothing was reflected.
pub fn scatter(scene: &Scene, hit: &Hit, w_in: DVec3, rng: &mut Generator) -> Option<(Scattered, bool)> {
    let reflectance = scene.reflectance(hit.primitive, hit.position);
    if reflectance.has_delta() || reflectance.sides().is_some() {
        return scene.scatter(hit, w_in, rng).map(|scattered| (scattered, false));
    }
    // From where the ray will start: in the plane of an opening there is no direction to it.
    let aim = Aim::new(scene.openings(), scene.geometry.lift(hit.position, hit.normal));
    let choice = rng.uniform();
    let direction = if choice < 0.5 {
        aim.direction(2.0 * choice, rng.uniform2())
    } else {
        reflectance.sample(hit.normal, w_in, rng)?.direction
    };
    let cosine = direction.dot(hit.normal);
    if cosine <= 0.0 {
        return None;
    }
    let through = aim.density(direction);
    let density = 0.5 * (reflectance.pdf(hit.normal, w_in, direction) + through);
    if density <= 0.0 {
        return None;
    }
    let factor = reflectance.evaluate(hit.normal, w_in, direction) * (cosine / density);
    Some((Scattered { direction, factor, delta: false, transmitted: false }, through > 0.0))
}
