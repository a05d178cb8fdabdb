//! How bright a source can be from where: a bound that costs little, by which many sources are told apart.
//!
//! The intensity towards a direction at the angle t from the axis of a source is at most `envelope(t)`, which does not grow with t. Of webs
//! it is found at the points of a lattice; what may stand out between them is why nothing there is taken for dark.

use super::light::Light;
use super::panel::Panel;
use super::photometric_web::Luminaire;
use super::source::Emitter;
use crate::math::{DVec2, DVec3, PI, acos, asin, cos, to_world};
use crate::random::around_z;

/// Steps of the envelope, even in sin(t/2): the finest near the axis, where beams are narrow.
const STEPS: usize = 24;
/// Azimuths at which a web is looked at.
const AZIMUTHS: u32 = 16;
/// Directions drawn from a web, a square: for its axis, and for beams that no azimuth of the lattice meets.
const DRAWN: u32 = 12;
/// Least share of its greatest intensity that a web is taken to have everywhere.
const FLOOR: f64 = 1e-3;

/// A bound of the light of one source.
#[derive(Clone, Debug)]
pub struct Beam {
    /// Middle of the source \[m\].
    pub center: DVec3,
    /// Radius of a ball around it \[m\].
    pub radius: f64,
    /// Unit vector.
    pub axis: DVec3,
    /// Bound of the intensity from the lower end of each step on \[cd\].
    envelope: [f64; STEPS + 1],
}

impl Beam {
    /// That of a light; `None` of parallel light, which is everywhere the same.
    pub(super) fn of_light(light: &Light) -> Option<Beam> {
        match light {
            Light::Directional { .. } => None,
            Light::Luminaire(luminaire) => Some(Beam::of_web(luminaire, 0.0)),
            Light::Omni { position, .. } => Some(Beam::falling(light, *position, DVec3::Y)),
            Light::Spot { position, direction, .. } | Light::CosPower { position, direction, .. } => {
                Some(Beam::falling(light, *position, *direction))
            }
        }
    }

    /// That of a luminaire with extent.
    pub(super) fn of_panel(panel: &Panel) -> Beam {
        let corners = panel.faces.iter().flat_map(|face| face.corners);
        let radius = corners.map(|corner| corner.distance(panel.luminaire.position)).fold(0.0, f64::max);
        Beam::of_web(&panel.luminaire, radius)
    }

    /// Of a light whose intensity falls with the angle from its axis.
    fn falling(light: &Light, center: DVec3, axis: DVec3) -> Beam {
        let at = |step: usize| light.at(center + direction(axis, lower_end(step), 0.0)).2.luminance();
        Beam { center, radius: 0.0, axis, envelope: std::array::from_fn(at) }
    }

    fn of_web(luminaire: &Luminaire, radius: f64) -> Beam {
        let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(DRAWN);
        let drawn = (0..DRAWN * DRAWN).map(|i| luminaire.sample(DVec2::new(middle(i % DRAWN), middle(i / DRAWN))));
        let drawn: Vec<DVec3> = drawn.collect();
        let axis = drawn.iter().sum::<DVec3>().try_normalize().unwrap_or(DVec3::Y);
        let azimuths = (0..AZIMUTHS).map(|k| f64::from(k) / f64::from(AZIMUTHS));
        let lattice = (0..=2 * STEPS).flat_map(|half| azimuths.clone().map(move |turn| (0.5 * half as f64, turn)));
        let lattice = lattice.map(|(step, turn)| direction(axis, step / STEPS as f64, turn));
        let mut envelope = [0.0; STEPS + 1];
        for w in lattice.chain(drawn.iter().copied()) {
            let intensity = luminaire.intensity(w).luminance();
            // A step more than where it lies: rounding puts points of the lattice on either side of its ends.
            let last = (step_of(axis.dot(w)) + 1).min(STEPS);
            envelope[..=last].iter_mut().for_each(|bound| *bound = f64::max(*bound, intensity));
        }
        let floor = FLOOR * envelope[0];
        Beam { center: luminaire.position, radius, axis, envelope: envelope.map(|bound| bound.max(floor)) }
    }

    /// Of a group of emissive triangles.
    pub(super) fn of_emitters(group: &[&Emitter]) -> Beam {
        let corners = || group.iter().flat_map(|emitter| emitter.corners);
        let (low, high) = corners().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        let center = 0.5 * (low + high);
        let radius = corners().map(|corner| corner.distance(center)).fold(0.0, f64::max);
        let sum = group.iter().map(|e| e.normal * e.flux().luminance()).sum::<DVec3>();
        let axis = sum.try_normalize().unwrap_or(DVec3::Y);
        let least = group.iter().map(|e| e.normal.dot(axis)).fold(1.0, f64::min);
        let spread = if group.iter().any(|e| e.double_sided) { PI } else { acos(least.clamp(-1.0, 1.0)) };
        let across: f64 = group.iter().map(|e| e.luminance.luminance() * e.area).sum();
        // Light leaves each at no more than 90 degrees from its normal.
        let at = |step: usize| across * cos((2.0 * asin(lower_end(step)) - spread).max(0.0)).max(0.0);
        Beam { center, radius, axis, envelope: std::array::from_fn(at) }
    }

    /// Bound of the intensity towards directions with at most this cosine to the axis \[cd\].
    pub fn envelope(&self, cosine: f64) -> f64 {
        self.envelope[step_of(cosine)]
    }
}

/// sin(t/2) at the lower end of a step.
fn lower_end(step: usize) -> f64 {
    step as f64 / STEPS as f64
}

/// The step in which directions lie that have this cosine to the axis.
fn step_of(cosine: f64) -> usize {
    // As a cast takes NaN for zero, it bounds by the greatest intensity.
    ((0.5 * (1.0 - cosine)).max(0.0).sqrt() * STEPS as f64) as usize
}

/// The direction at the angle t from `axis` with sin(t/2) = `half`, at the azimuth 2 pi `turn`.
fn direction(axis: DVec3, half: f64, turn: f64) -> DVec3 {
    to_world(axis, around_z(1.0 - 2.0 * half * half, turn))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photometry::Colour;
    use crate::random::{Domain, Stream, sphere};

    #[test]
    fn no_light_is_above_its_envelope() {
        let position = DVec3::new(1.0, 2.0, 3.0);
        let direction = DVec3::new(0.3, -1.0, 0.2).normalize();
        let intensity = Colour::grey(7.0);
        let mut rng = Stream::new(1, Domain::Pilot, "beam").generator(0);
        for light in [
            Light::Omni { position, intensity },
            Light::Spot { position, direction, intensity, inner: 0.05, outer: 0.1 },
            Light::Spot { position, direction, intensity, inner: 0.5, outer: 1.5 },
            Light::CosPower { position, direction, intensity, exponent: 30.0 },
        ] {
            let beam = Beam::of_light(&light).unwrap();
            for _ in 0..4096 {
                let w = sphere(rng.uniform2());
                let value = light.at(position + w).2.luminance();
                let bound = beam.envelope(beam.axis.dot(w));
                assert!(value <= bound * (1.0 + 1e-9), "{light:?} towards {w}: {value} above {bound}");
                assert!(bound <= 7.0 * (1.0 + 1e-9));
            }
        }
        let parallel = Light::Directional { direction, illuminance: intensity };
        assert!(Beam::of_light(&parallel).is_none());
        assert_eq!(step_of(-1.0), STEPS);
        assert!(step_of(1.0 + 1e-12) == 0 && step_of(0.0) < STEPS);
    }
}
