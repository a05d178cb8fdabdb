//! Receiver-side continuation: what the bounded kernel leaves of the light near edges and in peaked reflections.
//!
//! G = |cos| |cos| V / d^2 is unbounded where surfaces meet, and a law f with a narrow lobe has peaks of its own. The
//! variance of a plain connection grows as 1/d^2 towards an edge, and is infinite for a pixel that contains it.
//! So a connection from a vertex x to a receiver y carries only the share q of the light on its way, and a path
//! that starts at the receiver carries the rest (docs/method.md, section 6):
//!
//! ```text
//! q(x -> y) = min(1, b / (G(x,y) s_x s_y)),   s = max(1, pi f / 4) where the law is peaked, else 1
//!
//! J   = sum_k T_k { 1{k>=1} D_k + sum_n W_n f(x_n) q(x_n -> y_k) G(x_n,y_k) g_k },   y_0 = receiver, T_0 = 1
//! g_k = f(y_k; u -> y_{k-1}) (1 - q(y_k -> y_{k-1})),   g_0 = the response of the receiver
//! T_{k+1} = T_k g_k |cos| / pdf
//! ```
//!
//! At a vertex x a law is peaked if it is 60 degrees from the normal, at a receiver y if it is towards the eye.
//!
//! D_k is direct light reflected at y_k. Where y_k is matt, 1 - q is the factor (1 - b/G)_+ and the equations are
//! those of the note on edges. Where it is peaked, q depends on the direction of the light that arrives at y_k, which is not known
//! when the step is drawn: so 1 - q is a factor of its response. Emission is never added: it is in the direct light of
//! the point before.
//!
//! The path does not know the trajectories, so all its points may be connected to the same histories. It ends at a delta
//! component: light that a mirror sends to y_k is carried by connections alone (their b is infinite then), so
//! bounded and plain estimates have the same mean.

use super::direct::from_lights_as_if_matt;
use super::receiver::{Receiver, Response};
use crate::geometry::{Hit, Ray};
use crate::math::DVec3;
use crate::photometry::Colour;
use crate::random::Generator;
use crate::scene::Scene;

/// Share of the first step's weight below which Russian roulette is played.
const ROULETTE_BELOW: f64 = 0.5;
/// Guard against paths that never end between surfaces that absorb nothing.
const MAX_POINTS: u32 = 1 << 12;

/// A path from a receiver.
#[derive(Clone, Debug, Default)]
pub struct Continuation {
    /// y_1, y_2, ... as receivers whose response holds T_k: direct light at them counts as any other.
    pub points: Vec<Receiver>,
    /// Luminous light of sources without extent at the peaked points, as the receiver would respond to it if they were
    /// matt \[lx or cd/m2\]. What they really reflect of it has this order of magnitude and comes in spikes: no
    /// direction can be drawn towards such a source, so that its image in a narrow lobe is met by chance alone.
    pub caustic: f64,
    /// True where y_1 is drawn for neighbours as well: it then counts in full, as [`super::neighbours`] wants it.
    pub shared: bool,
}

/// True when connections may leave something of the light that arrives at `receiver`: a continuation is due.
///
/// Conservative: false is a proof for this very point, whatever light arrives.
pub fn is_due(scene: &Scene, receiver: &Receiver, bound: f64) -> bool {
    bound.is_finite()
        && (scene.has_peaks()
            || receiver.response.is_peaked()
            || scene.geometry.may_exceed(receiver.position, receiver.normal, bound))
}

/// Draws a path from `receiver`; where it `may_share` y_1, and both are matt, y_1 is drawn for its neighbours as well.
pub fn continue_from(
    scene: &Scene,
    receiver: &Receiver,
    bound: f64,
    may_share: bool,
    rng: &mut Generator,
) -> Continuation {
    let mut path = Continuation::default();
    let Some((mut weight, mut found)) = step(scene, receiver, bound, rng) else { return path };
    let is_matt = receiver.response.constant(scene, receiver.normal).is_some() && found.is_matt(scene);
    path.shared = may_share && is_matt;
    if path.shared {
        (weight, found.carried) = (Colour::WHITE, 0.0);
    }
    let first = weight.luminance();
    for _ in 0..MAX_POINTS {
        let next = found.receiver(scene, weight).on_one_side(scene, rng);
        if next.response.is_peaked() {
            path.caustic += from_lights_as_if_matt(scene, &next, rng).luminance();
        }
        path.points.push(next);
        let Some(further) = step(scene, &next, bound, rng) else { break };
        (weight, found) = further;
        let survival = weight.luminance() / (ROULETTE_BELOW * first);
        if survival < 1.0 {
            if !rng.chance(survival) {
                break;
            }
            weight = weight / survival;
        }
    }
    path
}

/// A surface point found by a step.
#[derive(Clone, Copy)]
struct Found {
    hit: Hit,
    /// From the surface back to where the step began.
    back: DVec3,
    /// b/(G s) of the step \[1\].
    carried: f64,
}

impl Found {
    fn is_matt(&self, scene: &Scene) -> bool {
        scene.reflectance(self.hit.primitive, self.hit.position).lambert().is_some()
    }

    /// The receiver of light that is reflected here and then counts with `weight`.
    fn receiver(self, scene: &Scene, weight: Colour) -> Receiver {
        let Found { hit, back, carried } = self;
        let response = Response::reflectance(scene, (hit.primitive, hit.position, hit.normal), back, weight, carried);
        Receiver { position: hit.position, normal: hit.normal, response }
    }
}

/// One step of a path: the weight T with which light from the point found counts; `None` where the path ends.
fn step(scene: &Scene, at: &Receiver, bound: f64, rng: &mut Generator) -> Option<(Colour, Found)> {
    let (direction, weight) = at.response.sample(scene, at.normal, rng)?;
    if weight.is_black() {
        return None;
    }
    let origin = scene.geometry.lift(at.position, at.normal);
    let reach = if scene.has_peaks() || at.response.is_peaked() {
        f64::INFINITY
    } else {
        // From farther away no factor exceeds b, and the path would end there.
        1.0 / bound.sqrt() * (1.0 + 1e-6) + 2.0 * origin.distance(at.position)
    };
    let first = scene.geometry.closest_hit_within(&Ray { origin, direction }, reach)?;
    // What a pane mirrors is carried by connections alone, as of every mirror.
    let (hit, share) = scene.met_from(first, direction, false, rng);
    let (hit, weight) = (hit.filter(|h| !scene.absorbs(h))?, weight * share);
    let reflectance = scene.reflectance(hit.primitive, hit.position);
    if reflectance.is_black() {
        return None;
    }
    let way = hit.position - at.position;
    let d2 = way.length_squared();
    let factor = way.dot(at.normal).max(0.0) * (-way.dot(hit.normal)).max(0.0) / (d2 * d2);
    let (_, peak) = at.response.with_peak(scene, at.normal, -direction);
    let carried = bound / (factor * peak);
    // Written so that NaN, a point met at its own place, ends the path.
    if !(carried < 1.0 || (reflectance.is_peaked() && carried.is_finite())) {
        return None;
    }
    Some((weight, Found { hit, back: -direction, carried }))
}
