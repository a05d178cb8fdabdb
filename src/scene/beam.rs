//! How bright a source can be from where: a bound that costs little, by which many sources are told apart.
//!
//! The intensity towards a direction at the angle t from the axis of a source is at most `envelope(t)`, which does not grow with t. Of webs
//! it is found at the points of a lattice; what may stand out between them is why nothing there is taken for dark.

use super::body::Body;
use super::light::Light;
use super::panel::Panel;
use super::photometric_web::Luminaire;
use super::source::Emitter;
use crate::math::{DVec2, DVec3, PI, to_world};
use crate::random::around_z;

/// Steps of the envelope, even in sin(t/2): the finest near the axis, where beams are narrow.
const STEPS: usize = 24;
/// Azimuths at which a web is looked at.
const AZIMUTHS: u32 = 16;
/// Directions drawn from a web, a square: for its axis, and for beams that no azimuth of the lattice meets.
const DRAWN: u32 = 12;
/// Least share of its greatest intensity that a web is taken to have everywhere.
const FLOOR: f64 = 1e-3;
/// What rounding may take from sin(t/2) where an axis is turned by nothing: a fraction of the smallest step.
const ROUNDING: f64 = 1e-6;

/// A bound of the light of one source, or of several together.
#[derive(Clone, Debug)]
pub struct Beam {
    /// Lowest corner of the box around them \[m\].
    pub low: DVec3,
    /// Highest corner \[m\].
    pub high: DVec3,
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
            Light::Luminaire(luminaire) => Some(Beam::of_web(luminaire, luminaire.position, luminaire.position)),
            Light::Omni { position, .. } => Some(Beam::falling(light, *position, DVec3::Y)),
            Light::Spot { position, direction, .. } | Light::CosPower { position, direction, .. } => {
                Some(Beam::falling(light, *position, *direction))
            }
        }
    }

    /// That of a luminaire with extent.
    pub(super) fn of_panel(panel: &Panel) -> Beam {
        let (low, high) = around(panel.faces.iter().flat_map(|face| face.corners));
        Beam::of_web(&panel.luminaire, low, high)
    }

    /// That of an emissive triangle.
    pub(super) fn of_emitter(emitter: &Emitter) -> Beam {
        let (low, high) = around(emitter.corners.into_iter());
        let across = emitter.luminance.luminance() * emitter.area;
        let cosine = |step: usize| (1.0 - 2.0 * lower_end(step) * lower_end(step)).max(0.0);
        let at = |step: usize| across * if emitter.double_sided { 1.0 } else { cosine(step) };
        Beam { low, high, axis: emitter.normal, envelope: std::array::from_fn(at) }
    }

    /// That of an emissive object, as of a ball.
    pub(super) fn of_body(body: &Body, (center, radius): (DVec3, f64)) -> Beam {
        let intensity = body.flux().luminance() / (4.0 * PI);
        let out = DVec3::splat(radius);
        Beam { low: center - out, high: center + out, axis: DVec3::Y, envelope: [intensity; STEPS + 1] }
    }

    /// That of all of `beams`, as if they all stood at the same place of the box around them.
    pub(super) fn of_all(beams: &[Beam]) -> Beam {
        if let [one] = beams {
            return one.clone();
        }
        let (low, high) = around(beams.iter().flat_map(|beam| [beam.low, beam.high]));
        let axis = beams.iter().map(|beam| beam.axis * beam.envelope[0]).sum::<DVec3>();
        let axis = axis.try_normalize().unwrap_or(DVec3::Y);
        let mut envelope = [0.0; STEPS + 1];
        for beam in beams {
            let turned = beam.turned(axis);
            envelope.iter_mut().zip(turned).for_each(|(sum, bound)| *sum += bound);
        }
        Beam { low, high, axis, envelope }
    }

    /// The envelope around another axis.
    fn turned(&self, axis: DVec3) -> [f64; STEPS + 1] {
        let cosine = self.axis.dot(axis).clamp(-1.0, 1.0);
        let (cos_half, sin_half) = ((0.5 * (1.0 + cosine)).sqrt(), (0.5 * (1.0 - cosine)).sqrt());
        let at = |step: usize| {
            let half = lower_end(step);
            // sin((t - d)/2) of directions at the angle t from the new axis, the old one d beside it.
            let nearest = half * cos_half - (1.0 - half * half).max(0.0).sqrt() * sin_half;
            self.envelope[((nearest + ROUNDING).max(0.0) * STEPS as f64) as usize]
        };
        std::array::from_fn(at)
    }

    /// Of a light whose intensity falls with the angle from its axis.
    fn falling(light: &Light, center: DVec3, axis: DVec3) -> Beam {
        let at = |step: usize| light.at(center + direction(axis, lower_end(step), 0.0)).2.luminance();
        Beam { low: center, high: center, axis, envelope: std::array::from_fn(at) }
    }

    fn of_web(luminaire: &Luminaire, low: DVec3, high: DVec3) -> Beam {
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
        Beam { low, high, axis, envelope: envelope.map(|bound| bound.max(floor)) }
    }

    /// Bound of the intensity towards directions with at most this cosine to the axis \[cd\].
    pub fn envelope(&self, cosine: f64) -> f64 {
        self.envelope[step_of(cosine)]
    }
}

/// The lowest and the highest corner of the box around `points`.
fn around(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
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
