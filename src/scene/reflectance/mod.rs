//! Laws of reflection. f = sigma/pi \[1/sr\]; directions are propagation directions of light.
//!
//! The interface is two-sided: `normal` is the surface normal on the side on which light arrives
//! (`w_in . normal < 0`), `w_out` may lie on either side of it. Every law but opal returns zero below the surface, and all
//! are reciprocal: f(w_in -> w_out) = f(-w_out -> -w_in), bit for bit.
//!
//! A law may have a delta component, a mirror: `evaluate` and `pdf` leave it out, `sample` draws it and says so,
//! `delta_reflectance` is its reflectance. Knows no geometry, no receivers and no wavelengths beyond three channels.

mod albedo;
mod delta;
mod directional;
mod glass;
mod glossy;
mod lanes;
mod microfacet;
mod pane;
mod phong;
mod specular;
mod tabulated;

use crate::math::{DVec3, PI, to_world};
use crate::photometry::Colour;
use crate::random::{Generator, cosine_hemisphere};
use directional::Directional;
use glossy::Glossy;
use phong::Phong;

pub use delta::Delta;
pub use glass::Glass;
pub use glossy::Dielectric;
pub use lanes::{LawInLanes, Tint, Tints, weights_over_tolerated};
pub use pane::Pane;
pub use specular::Finish;
pub use tabulated::Tabulated;

/// pi f from which on a law counts as peaked: a connection may then weigh this many times one to a white matt surface.
const PEAK: f64 = 4.0;
/// Cosine of the angle, 60 degrees, at which it is decided whether vertices of a law are spiky: nearer to grazing every
/// lobe is, and light comes from there more and more rarely. Chosen by coverage (docs/coverage.md).
const PEAKED_COSINE: f64 = 0.5;

/// How a surface reflects.
#[derive(Clone, Debug)]
pub enum Reflectance {
    /// The same luminance in all directions; f = rho/pi.
    Lambert(Colour),
    /// A specular part, rough or a mirror, over a diffuse one; from [`Reflectance::metallic_roughness`].
    Glossy(Box<Glossy>),
    /// Delta components alone: mirrors and glass.
    Delta(Delta),
    /// Lambert on the side where light arrives, and on the other: f = rho/pi and tau/pi; from [`Reflectance::opal`].
    Opal {
        /// Reflectance.
        rho: Colour,
        /// Transmittance.
        tau: Colour,
    },
    /// A finite law of both directions, and the same for many at once; from [`Reflectance::phong`].
    Directional(Box<(Directional, LawInLanes)>),
}

/// A sampled continuation of a trajectory.
#[derive(Clone, Copy, Debug)]
pub struct Scattered {
    /// New propagation direction.
    pub direction: DVec3,
    /// f |cos| / pdf, the factor on the weight.
    pub factor: Colour,
    /// True when a delta component was chosen (a mirror).
    pub delta: bool,
    /// True when it leaves on the other side.
    pub transmitted: bool,
}

impl Reflectance {
    /// The metallic-roughness law of glTF, made reciprocal and conserving energy (its own mix of a diffuse and a
    /// specular part is replaced: it reflects up to 1.3 times the light received).
    ///
    /// `metallic == 0.0 && roughness == 1.0` exactly is Lambert with `base` as its reflectance: the way a file says
    /// "matt". Anything else is GGX with alpha = roughness^2 and Schlick's Fresnel factor over the diffuse part; alpha
    /// below 1e-3 is a mirror. Building the law integrates its albedo table, a few milliseconds.
    ///
    /// # Panics
    /// When an argument lies outside 0 ..= 1: the reader of a file checks first.
    pub fn metallic_roughness(base: Colour, metallic: f64, roughness: f64) -> Self {
        Self::layered(base, metallic, roughness, Dielectric::PLAIN)
    }

    /// The same over another dielectric; one that reflects nothing is Lambert whatever its roughness, and one that transmits never is.
    ///
    /// # Panics
    /// As [`Reflectance::metallic_roughness`], and where `dielectric` is not in 0 ..= 1 or has an `f0` above its `f90`.
    pub fn layered(base: Colour, metallic: f64, roughness: f64, dielectric: Dielectric) -> Self {
        let allowed = |x: f64| (0.0..=1.0).contains(&x);
        assert!(base.0.into_iter().all(allowed), "base colour outside 0 ..= 1: {base:?}");
        assert!(allowed(metallic) && allowed(roughness), "metallic or roughness outside 0 ..= 1");
        let Dielectric { f0, f90, transmission } = dielectric;
        assert!(
            allowed(transmission) && allowed(f90) && f0.0.into_iter().all(|f0| f0 >= 0.0 && f0 <= f90),
            "{dielectric:?}"
        );
        if metallic == 0.0 && transmission == 0.0 && (roughness == 1.0 || f90 == 0.0) {
            Reflectance::Lambert(base)
        } else {
            Self::finished(base, metallic, dielectric, &Finish::new(roughness))
        }
    }

    /// The same of a finish that is ready, and with a specular part in any case; what it is called with is not checked again.
    pub fn finished(base: Colour, metallic: f64, dielectric: Dielectric, finish: &Finish) -> Self {
        Reflectance::Glossy(Box::new(Glossy::new(base, metallic, dielectric, finish.clone())))
    }

    /// The law of the same material with another base colour; only those of glTF that are matt or glossy have one.
    pub fn with_base(&self, base: Colour) -> Self {
        match self {
            Reflectance::Lambert(_) => Reflectance::Lambert(base),
            Reflectance::Glossy(law) => Reflectance::Glossy(Box::new(law.with_base(base))),
            other => other.clone(),
        }
    }

    /// The law of the same material of which another share transmits; only glossy ones can.
    pub fn with_transmission(&self, transmission: f64) -> Self {
        match self {
            Reflectance::Glossy(law) => Reflectance::Glossy(Box::new(law.with_transmission(transmission))),
            other => other.clone(),
        }
    }

    /// Lambert reflectance and transmittance, together at most 1, of a surface that is the same from both sides.
    pub fn opal(rho: Colour, tau: Colour) -> Self {
        assert!((rho + tau).max() <= 1.0 + 1e-12, "opal of {rho:?} and {tau:?}");
        Reflectance::Opal { rho, tau }
    }

    /// The modified Phong law: reflectances of the Lambert part and of the lobe, together at most 1, and its exponent.
    pub fn phong(diffuse: Colour, specular: Colour, exponent: f64) -> Self {
        assert!((diffuse + specular).max() <= 1.0 + 1e-12 && exponent >= 0.0, "phong {diffuse:?}, {specular:?}");
        Self::directional(Directional::Phong(Phong::new(diffuse, specular, exponent)))
    }

    /// A tabulated law.
    pub fn tabulated(law: Tabulated) -> Self {
        Self::directional(Directional::Tabulated(law))
    }

    fn directional(law: Directional) -> Self {
        Reflectance::Directional(Box::new((law.clone(), LawInLanes::one_by_one(law))))
    }

    /// f(w_in -> w_out) \[1/sr\] without delta components.
    pub fn evaluate(&self, normal: DVec3, w_in: DVec3, w_out: DVec3) -> Colour {
        match self {
            Reflectance::Lambert(rho) if above(normal, w_in, w_out) => *rho / PI,
            Reflectance::Lambert(_) => Colour::BLACK,
            Reflectance::Glossy(law) => law.evaluate(normal, w_in, w_out),
            Reflectance::Delta(_) => Colour::BLACK,
            Reflectance::Opal { rho, tau } => match (w_in.dot(normal) < 0.0, w_out.dot(normal)) {
                (true, side) if side > 0.0 => *rho / PI,
                (true, side) if side < 0.0 => *tau / PI,
                _ => Colour::BLACK,
            },
            Reflectance::Directional(law) => law.0.evaluate(normal, w_in, w_out),
        }
    }

    /// Draws a continuation; `None` when nothing is reflected (the weight is absorbed). Of a body of glass it is that of light from
    /// outside.
    pub fn sample(&self, normal: DVec3, w_in: DVec3, rng: &mut Generator) -> Option<Scattered> {
        self.sample_from(true, normal, w_in, rng)
    }

    /// The same for light that arrives on the `front` of the surface, or on its back: bodies of glass differ.
    pub fn sample_from(&self, front: bool, normal: DVec3, w_in: DVec3, rng: &mut Generator) -> Option<Scattered> {
        match self {
            Reflectance::Lambert(rho) => {
                let direction = to_world(normal, cosine_hemisphere(rng.uniform2()));
                Some(Scattered { direction, factor: *rho, delta: false, transmitted: false })
            }
            Reflectance::Glossy(law) => law.sample(normal, w_in, rng),
            Reflectance::Delta(law) => law.sample(front, normal, w_in, rng),
            Reflectance::Opal { rho, tau } => {
                let (reflected, all) = (rho.luminance(), (*rho + *tau).luminance());
                // One coordinate more than of a Lambert surface, for the side.
                let transmitted = all > 0.0 && rng.uniform() * all >= reflected;
                let (side, colour) = if transmitted { (-normal, *tau) } else { (normal, *rho) };
                let direction = to_world(side, cosine_hemisphere(rng.uniform2()));
                let factor = if all > 0.0 { colour * (all / colour.luminance()) } else { Colour::BLACK };
                Some(Scattered { direction, factor, delta: false, transmitted })
            }
            Reflectance::Directional(law) => law.0.sample(normal, w_in, rng),
        }
    }

    /// Density in solid angle with which `sample` draws `w_out`, choices included, delta components excluded
    /// \[1/sr\]. Its integral is the probability of a continuation that is not a delta one.
    pub fn pdf(&self, normal: DVec3, w_in: DVec3, w_out: DVec3) -> f64 {
        match self {
            Reflectance::Lambert(_) if above(normal, w_in, w_out) => w_out.dot(normal) / PI,
            Reflectance::Lambert(_) => 0.0,
            Reflectance::Glossy(law) => law.pdf(normal, w_in, w_out),
            Reflectance::Delta(_) => 0.0,
            Reflectance::Opal { rho, tau } => {
                let (side, all) = (w_out.dot(normal), (*rho + *tau).luminance());
                let share = if side > 0.0 { *rho } else { *tau }.luminance() / all;
                if w_in.dot(normal) < 0.0 && all > 0.0 { share * side.abs() / PI } else { 0.0 }
            }
            Reflectance::Directional(law) => law.0.pdf(normal, w_in, w_out),
        }
    }

    /// Directional albedo at the cosine of incidence, delta components included; at most one, and within 5e-4 of
    /// the integral of the law (the error of the table).
    pub fn albedo(&self, cosine: f64) -> Colour {
        match self {
            Reflectance::Lambert(rho) => *rho,
            Reflectance::Glossy(law) => law.albedo(cosine),
            Reflectance::Delta(law) => law.reflectance(cosine),
            Reflectance::Opal { rho, tau } => *rho + *tau,
            Reflectance::Directional(law) => law.0.albedo(cosine),
        }
    }

    /// Shares of light at the cosine of incidence that are reflected and that are transmitted, on a straight line or not.
    pub fn shares(&self, cosine: f64) -> (Colour, Colour) {
        match self {
            Reflectance::Opal { rho, tau } => (*rho, *tau),
            Reflectance::Delta(Delta::Pane(pane)) => {
                let (through, mirrored) = pane.shares(cosine);
                (mirrored, through)
            }
            Reflectance::Delta(Delta::Glass(glass)) => {
                let mirrored = Colour::grey(glass.reflectance(cosine));
                (mirrored, Colour::WHITE + mirrored * -1.0)
            }
            _ => (self.albedo(cosine), self.straight(cosine)),
        }
    }

    /// True when it lets light through straight on.
    pub fn is_veil(&self) -> bool {
        matches!(self, Reflectance::Delta(Delta::Pane(_))) || self.is_sheet()
    }

    /// True of a veil whose `evaluate` and `sample` are shares of all light that arrives; of other veils they are shares of what does not
    /// go straight on.
    pub fn is_sheet(&self) -> bool {
        matches!(self, Reflectance::Glossy(law) if law.transmits())
    }

    /// The share of light that goes straight on through a veil at the cosine of incidence, above 0.
    pub fn straight(&self, cosine: f64) -> Colour {
        match self {
            Reflectance::Delta(Delta::Pane(pane)) => pane.transmittance(cosine),
            Reflectance::Glossy(law) => law.straight(cosine),
            _ => Colour::BLACK,
        }
    }

    /// Reflectance of the delta component at the cosine of incidence; `None` without one.
    pub fn delta_reflectance(&self, cosine: f64) -> Option<Colour> {
        match self {
            Reflectance::Lambert(_) | Reflectance::Opal { .. } | Reflectance::Directional(_) => None,
            Reflectance::Glossy(law) => law.delta_reflectance(cosine),
            Reflectance::Delta(law) => Some(law.reflectance(cosine)),
        }
    }

    /// The reflectance of a Lambert surface: f is `rho/pi` whatever the directions.
    pub fn lambert(&self) -> Option<Colour> {
        match self {
            Reflectance::Lambert(rho) => Some(*rho),
            _ => None,
        }
    }

    /// Of a surface that sends light to both sides: what of the light that arrives on one side it sends to the same side, and to the
    /// other.
    pub fn sides(&self) -> Option<(Colour, Colour)> {
        match self {
            Reflectance::Opal { rho, tau } => Some((*rho, *tau)),
            _ => None,
        }
    }

    /// The law where f depends on the directions, for many of them at once; `None` of Lambert surfaces.
    pub fn lanes(&self) -> Option<&LawInLanes> {
        match self {
            Reflectance::Lambert(_) | Reflectance::Delta(_) | Reflectance::Opal { .. } => None,
            Reflectance::Glossy(law) => Some(law.lanes()),
            Reflectance::Directional(law) => Some(&law.1),
        }
    }

    /// The share of light that gets through the specular part at the cosine of incidence, where there is something under it.
    pub fn through(&self, cosine: f64) -> Colour {
        match self {
            Reflectance::Glossy(law) => law.through(cosine),
            _ => Colour::WHITE,
        }
    }

    /// True when part of the light is reflected by a delta component, which no connection can carry.
    pub fn has_delta(&self) -> bool {
        match self {
            Reflectance::Glossy(law) => law.has_delta(),
            Reflectance::Delta(_) => true,
            Reflectance::Lambert(_) | Reflectance::Opal { .. } | Reflectance::Directional(_) => false,
        }
    }

    /// True when nothing is reflected by the finite part: no receiver can stand here.
    pub fn is_black(&self) -> bool {
        match self {
            Reflectance::Lambert(rho) => rho.is_black(),
            Reflectance::Glossy(law) => law.is_black(),
            Reflectance::Delta(_) => true,
            Reflectance::Opal { rho, tau } => (*rho + *tau).is_black(),
            Reflectance::Directional(law) => law.0.is_black(),
        }
    }

    /// True when the finite part has a lobe so narrow that connections from it alone would be spiky: its pi f exceeds 4 where
    /// a direction 60 degrees from the normal is mirrored.
    pub fn is_peaked(&self) -> bool {
        match self {
            Reflectance::Glossy(law) => law.is_peaked(),
            Reflectance::Directional(law) => law.0.is_peaked(),
            Reflectance::Lambert(_) | Reflectance::Delta(_) | Reflectance::Opal { .. } => false,
        }
    }

    /// The same where a direction at `cosine` from the normal is mirrored: towards grazing directions every lobe grows a
    /// peak.
    pub fn is_peaked_at(&self, cosine: f64) -> bool {
        match self {
            Reflectance::Glossy(law) => law.is_peaked_at(cosine),
            Reflectance::Directional(law) => law.0.is_peaked(),
            Reflectance::Lambert(_) | Reflectance::Delta(_) | Reflectance::Opal { .. } => false,
        }
    }

    /// alpha of the lobe: 0 of a delta component, 1 of a matt surface \[1\].
    pub fn lobe_width(&self) -> f64 {
        match self {
            Reflectance::Lambert(_) | Reflectance::Opal { .. } => 1.0,
            Reflectance::Glossy(law) => law.lobe_width(),
            Reflectance::Directional(law) => law.0.lobe_width(),
            Reflectance::Delta(_) => 0.0,
        }
    }

    /// How many times the tolerated weight a connection from a vertex with this value of `f` has: at least 1, and 1 for
    /// every law that is not peaked.
    pub fn peak(&self, f: Colour) -> f64 {
        if self.is_peaked() { weight_over_tolerated(f) } else { 1.0 }
    }

    /// The same law with every colour replaced by its luminance, for one photometric channel. Exact for grey
    /// materials; metallic and roughness stay.
    pub fn grey(self) -> Self {
        match self {
            Reflectance::Lambert(rho) => Reflectance::Lambert(Colour::grey(rho.luminance())),
            Reflectance::Glossy(law) => Reflectance::Glossy(Box::new(law.grey())),
            Reflectance::Delta(law) => Reflectance::Delta(law.grey()),
            Reflectance::Opal { rho, tau } => {
                Reflectance::Opal { rho: Colour::grey(rho.luminance()), tau: Colour::grey(tau.luminance()) }
            }
            Reflectance::Directional(law) => Self::directional(law.0.grey()),
        }
    }
}

/// How many times the tolerated weight a connection with this value of `f` has, at least 1.
pub fn weight_over_tolerated(f: Colour) -> f64 {
    (PI / PEAK * f.luminance()).max(1.0)
}

/// True when light arrives and leaves on the side of `normal`.
fn above(normal: DVec3, w_in: DVec3, w_out: DVec3) -> bool {
    w_in.dot(normal) < 0.0 && w_out.dot(normal) > 0.0
}

/// (1 - c)^5: how far Schlick's factor has risen from F0 towards one at the cosine `c`.
fn fresnel_rise(c: f64) -> f64 {
    let x = (1.0 - c).max(0.0);
    let x2 = x * x;
    x2 * x2 * x
}
