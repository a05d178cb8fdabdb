//! A thin pane of clear glass: what it reflects as a mirror, lets through straight on, and absorbs.
//!
//! One face reflects by Fresnel's equations, s and p apart; inside, the sheet goes to and fro between the faces, and all of that is
//! summed. With rho the reflectance of a face and t = t0^(1/cos') what is left of light that crosses the glass once at
//! the angle of refraction, for s and for p
//!
//! ```text
//! T = (1 - rho)^2 t/(1 - rho^2 t^2),     R = rho (1 + t T),     1 - R - T is absorbed
//! ```
//!
//! and for unpolarised light the means of the two. Thickness, interference and the small shift of a ray are left out.

use crate::photometry::Colour;

/// A pane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pane {
    index: f64,
    /// t0, what is left of light that crosses the glass once along the normal \[1\].
    internal: Colour,
}

impl Pane {
    /// Of refractive index `index`, 1 or more, that leaves the share `internal` of light that crosses the glass once along the normal.
    pub fn new(index: f64, internal: Colour) -> Self {
        assert!(index >= 1.0 && internal.0.iter().all(|t| (0.0..=1.0).contains(t)), "a pane of {index}, {internal:?}");
        Pane { index, internal }
    }

    /// The pane with the transmittance `at_normal` along the normal, all reflections counted; `None` where that is more than glass
    /// of this index can have.
    pub fn of_transmittance(index: f64, at_normal: Colour) -> Option<Self> {
        let [rho, _] = face(index, 1.0)?.reflectances;
        let passed = (1.0 - rho) * (1.0 - rho);
        // T (1 - rho^2 t^2) = (1 - rho)^2 t, solved without the difference of near numbers.
        let internal = at_normal.map(|t| 2.0 * t / (passed + (passed * passed + 4.0 * rho * rho * t * t).sqrt()));
        let possible = internal.0.iter().all(|t| (0.0..=1.0 + 1e-12).contains(t));
        possible.then(|| Pane { index, internal: internal.map(|t| t.min(1.0)) })
    }

    /// The greatest transmittance along the normal that glass of this index can have.
    pub fn clearest(index: f64) -> f64 {
        Pane::new(index, Colour::WHITE).transmittance(1.0).0[0]
    }

    /// Shares of light at the cosine of incidence that are let through and mirrored, together at most 1.
    pub fn shares(&self, cosine: f64) -> (Colour, Colour) {
        let Some(face) = face(self.index, cosine) else { return (Colour::BLACK, Colour::WHITE) };
        if face.reflectances.contains(&1.0) {
            return (Colour::BLACK, Colour::WHITE);
        }
        let crossed = self.internal.map(|t0| if t0 == 1.0 { 1.0 } else { crate::math::pow(t0, 1.0 / face.inside) });
        let [s, p] = face.reflectances.map(|rho| {
            let through = crossed.map(|t| (1.0 - rho) * (1.0 - rho) * t / (1.0 - rho * rho * t * t));
            (through, Colour(std::array::from_fn(|c| rho * (1.0 + crossed.0[c] * through.0[c]))))
        });
        ((s.0 + p.0) * 0.5, (s.1 + p.1) * 0.5)
    }

    /// The share let through straight on.
    pub fn transmittance(&self, cosine: f64) -> Colour {
        self.shares(cosine).0
    }

    /// Of what is not let through, the share that is mirrored.
    pub(super) fn mirrored(&self, cosine: f64) -> Colour {
        let (through, mirrored) = self.shares(cosine);
        let share = |c: usize| match 1.0 - through.0[c] {
            // A pane of index 1 stops nothing: 0/0 means nothing.
            rest if rest > 0.0 => (mirrored.0[c] / rest).min(1.0),
            _ => 0.0,
        };
        Colour(std::array::from_fn(share))
    }

    pub(super) fn grey(self) -> Self {
        Pane { internal: Colour::grey(self.internal.luminance()), ..self }
    }
}

/// A face of glass at one angle.
pub(super) struct Face {
    /// Of s and of p polarised light.
    pub(super) reflectances: [f64; 2],
    /// Cosine on the other side.
    pub(super) inside: f64,
}

/// A face towards a medium `index` times as dense optically, met at `cosine`; `None` where all is reflected.
pub(super) fn face(index: f64, cosine: f64) -> Option<Face> {
    let squared = 1.0 - (1.0 - cosine * cosine) / (index * index);
    if squared <= 0.0 || cosine <= 0.0 {
        return None;
    }
    let inside = squared.sqrt();
    let square = |x: f64| x * x;
    let s = square((cosine - index * inside) / (cosine + index * inside));
    let p = square((index * cosine - inside) / (index * cosine + inside));
    Some(Face { reflectances: [s, p], inside })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_over_reflections_inside_is_the_series() {
        for (index, t0) in [(1.5, 1.0), (1.5, 0.8), (1.9, 0.3), (1.0, 0.5), (1.33, 1.0)] {
            let pane = Pane::new(index, Colour::grey(t0));
            for cosine in [1.0, 0.8, 0.5, 0.2, 0.01] {
                let face = face(index, cosine).unwrap();
                let t = crate::math::pow(t0, 1.0 / face.inside);
                let (mut through, mut mirrored) = (0.0, 0.0);
                for rho in face.reflectances {
                    mirrored += 0.5 * rho;
                    let mut inside = 0.5 * (1.0 - rho);
                    for crossing in 1..4000 {
                        inside *= t;
                        let out = if crossing % 2 == 1 { &mut through } else { &mut mirrored };
                        *out += inside * (1.0 - rho);
                        inside *= rho;
                    }
                }
                let shares = pane.shares(cosine);
                assert!((shares.0.0[0] - through).abs() < 1e-9, "{index} {t0} {cosine}");
                assert!((shares.1.0[0] - mirrored).abs() < 1e-9, "{index} {t0} {cosine}");
                assert!(t0 < 1.0 || (through + mirrored - 1.0).abs() < 1e-9, "clear glass absorbs nothing");
            }
        }
    }

    #[test]
    fn the_numbers_of_window_glass() {
        // n = 1.5: one face reflects 0.04, a pane 2 0.04/1.04; Brewster's angle lets all p polarised light through.
        let pane = Pane::new(1.5, Colour::WHITE);
        assert!((pane.transmittance(1.0).0[0] - 12.0 / 13.0).abs() < 1e-12);
        let brewster = 1.0 / (1.0f64 + 1.5 * 1.5).sqrt();
        assert!(face(1.5, brewster).unwrap().reflectances[1] < 1e-30);
        assert_eq!(pane.shares(0.0), (Colour::BLACK, Colour::WHITE));
        assert_eq!(Pane::new(1.0, Colour::WHITE).shares(0.5), (Colour::WHITE, Colour::BLACK));
        assert_eq!(Pane::new(1.0, Colour::WHITE).mirrored(0.5), Colour::BLACK);
        // A pane made from what it lets through along the normal.
        for t in [0.9, 0.5, 0.01, 0.0, 12.0 / 13.0] {
            let made = Pane::of_transmittance(1.5, Colour::grey(t)).unwrap();
            assert!((made.transmittance(1.0).0[0] - t).abs() < 1e-12, "{t}");
        }
        assert_eq!(Pane::of_transmittance(1.5, Colour::grey(0.93)), None);
        assert!((Pane::clearest(1.5) - 12.0 / 13.0).abs() < 1e-12);
    }
}
