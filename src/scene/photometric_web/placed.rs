//! A web at its place in a scene: which way its aim and its C0 direction point.

use super::{Kind, Opening, Photometry, Web};
use crate::math::{DMat3, DVec2, DVec3, PI, acos, atan2, sin_cos};
use crate::photometry::Colour;
use std::sync::Arc;

/// Where a luminaire hangs, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Position of the photometric centre \[m\].
    pub position: DVec3,
    /// Unit vector along the direction of the two angles 0.
    aim: DVec3,
    /// Unit vector across the aim, along C0.
    c0: DVec3,
    /// Unit vector along C90: a quarter turn from C0, counter-clockwise for whoever looks along the aim from behind.
    c90: DVec3,
}

impl Placement {
    /// A luminaire at `position` with `aim` and `c0` in the axes of `frame`; `None` where no direction is left of either.
    /// A frame that mirrors mirrors the light.
    pub fn new(position: DVec3, frame: DMat3, aim: DVec3, c0: DVec3) -> Option<Placement> {
        let aim = (frame * aim.try_normalize()?).try_normalize()?;
        let c0 = (frame * c0.try_normalize()?).try_normalize()?;
        let c0 = c0 - c0.dot(aim) * aim;
        // Nearly parallel directions leave the turn around the aim to rounding.
        let c0 = (c0.length() > 1e-6).then(|| c0.normalize())?;
        let c90 = c0.cross(aim) * if frame.determinant() < 0.0 { -1.0 } else { 1.0 };
        Some(Placement { position, aim, c0, c90 })
    }

    /// Half the edges of `opening`: along its length, its width and its height. In type A the aim is the photometric horizontal, along
    /// which a length is given, and the C0 direction is up.
    pub(in crate::scene) fn edges(&self, opening: &Opening, kind: Kind) -> [DVec3; 3] {
        let (along, up) = if kind == Kind::A { (self.aim, self.c0) } else { (self.c0, self.aim) };
        [0.5 * opening.length * along, 0.5 * opening.width * self.c90, 0.5 * opening.height * up]
    }

    /// The angle between the aim and straight down \[degrees\].
    pub fn tilt(&self) -> f64 {
        acos((-self.aim.y).clamp(-1.0, 1.0)) * 180.0 / PI
    }
}

/// A photometric web as a light source without extent.
#[derive(Clone, Debug, PartialEq)]
pub struct Luminaire {
    /// Position \[m\].
    pub position: DVec3,
    /// Where the azimuth is 0, where it is a quarter turn, and the pole.
    axes: [DVec3; 3],
    /// On the intensities of the web \[1\].
    factor: Colour,
    kind: Kind,
    web: Arc<Web>,
}

impl Luminaire {
    /// `photometry` placed, its intensities times `factor` and what the tilt of its lamp leaves.
    pub fn new(photometry: &Photometry, placement: &Placement, factor: Colour) -> Luminaire {
        let Placement { position, aim, c0, c90 } = *placement;
        let kind = photometry.measured.kind;
        let axes = match kind {
            Kind::C => [c0, c90, aim],
            // Horizontal angles run clockwise.
            Kind::A | Kind::B => [aim, -c90, c0],
        };
        let tilt = photometry.tilt.as_ref().map_or(1.0, |tilt| tilt.factor(placement.tilt()));
        Luminaire { position, axes, factor: factor * tilt, kind, web: photometry.web.clone() }
    }

    /// The same elsewhere.
    pub(in crate::scene) fn moved(self, offset: DVec3) -> Self {
        Luminaire { position: self.position + offset, ..self }
    }

    /// The same with its colour through `f`.
    pub(in crate::scene) fn recoloured(self, f: impl Fn(Colour) -> Colour) -> Self {
        Luminaire { factor: f(self.factor), ..self }
    }

    /// Type of goniometer of its web.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Flux \[lm\].
    pub fn flux(&self) -> Colour {
        self.factor * self.web.flux()
    }

    /// Luminous intensity towards `direction`, of any length \[cd\].
    pub fn intensity(&self, direction: DVec3) -> Colour {
        let [x, y, z] = self.axes.map(|axis| axis.dot(direction));
        self.factor * self.web.intensity(atan2((x * x + y * y).sqrt(), z), atan2(y, x))
    }

    /// The direction to which `u`, uniform in the unit square, is mapped with density intensity over flux.
    pub fn sample(&self, u: DVec2) -> DVec3 {
        let (t, p) = self.web.sample(u);
        self.direction(t, p)
    }

    /// The unit vector at the angle `t` from the pole of the web and the azimuth `p` \[rad\].
    pub fn direction(&self, t: f64, p: f64) -> DVec3 {
        let ((st, ct), (sp, cp)) = (sin_cos(t), sin_cos(p));
        st * cp * self.axes[0] + st * sp * self.axes[1] + ct * self.axes[2]
    }
}
