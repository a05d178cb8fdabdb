//! Rough specular reflection without its Fresnel factor: GGX normals, height-correlated Smith shadowing.
//!
//! With mu the cosine of arrival, mu' of departure, h the unit half vector, and
//! t(mu) = sqrt(alpha^2 + (1 - alpha^2) mu^2):
//!
//! ```text
//! D(h)     = alpha^2 / (pi (alpha^2 (n,h)^2 + |n x h|^2)^2)                                        [1/sr]
//! law      = D V,  V = 1 / (2 (mu' t(mu) + mu t(mu')))         (Heitz 2014; 4 mu mu' is inside V)  [1/sr]
//! density  = D / (2 (k mu + t(mu)))                              of the directions that `Cap` draws [1/sr]
//! ```
//!
//! Directions are drawn from the visible normals by the spherical cap of Dupuy and Benyoub (2023), cut by the
//! bound k of Eto and Tokuyoshi (2023), so that few of them fall below the surface; k = 1 would be the whole cap.
//! Knows neither colours nor what lies under the facets.

use crate::math::{DVec3, PI};

/// A cosine below this counts as below the surface: high powers of smaller ones underflow, and no flux is lost.
const HORIZON: f64 = 1e-50;

/// The scalars of one pair of directions; equal bits for the pair and for its reverse, up to the two cosines'
/// exchange.
#[derive(Clone, Copy)]
pub(super) struct Pair {
    /// Cosine of arrival, positive.
    pub arriving: f64,
    /// Cosine of departure, positive.
    pub leaving: f64,
    /// Cosine between either direction and the half vector.
    pub half: f64,
    // With s the sum of the two unit vectors away from the surface (h is s over its length): |s|^2, (n,s)^2 and
    // |n x s|^2. The cross product has no cancellation where h is close to the normal.
    length2: f64,
    along2: f64,
    across2: f64,
}

impl Pair {
    /// The pair of propagation directions at a surface, or `None` when one of them lies below it.
    pub fn new(normal: DVec3, w_in: DVec3, w_out: DVec3) -> Option<Pair> {
        let (arriving, leaving) = (-w_in.dot(normal), w_out.dot(normal));
        if !(arriving > HORIZON && leaving > HORIZON) {
            return None;
        }
        let sum = w_out - w_in;
        let (length2, along) = (sum.length_squared(), arriving + leaving);
        let across2 = normal.cross(sum).length_squared();
        Some(Pair { arriving, leaving, half: 0.5 * length2.sqrt(), length2, along2: along * along, across2 })
    }
}

/// A rough surface of one alpha.
#[derive(Clone, Debug)]
pub(super) struct Microfacets {
    alpha: f64,
    alpha2: f64,
}

impl Microfacets {
    pub fn new(alpha: f64) -> Self {
        Microfacets { alpha, alpha2: alpha * alpha }
    }

    /// The roughness it was made of.
    pub fn alpha(&self) -> f64 {
        self.alpha
    }

    /// Its square.
    pub fn alpha2(&self) -> f64 {
        self.alpha2
    }

    /// D / (2 `divisor`), in one division.
    fn normals_over(&self, pair: &Pair, divisor: f64) -> f64 {
        let d = self.alpha2 * pair.along2 + pair.across2;
        0.5 * self.alpha2 * pair.length2 * pair.length2 / (PI * d * d * divisor)
    }

    /// Length t(mu) of the unit vector of cosine `mu` after stretching the surface to alpha = 1.
    pub fn stretched(&self, mu: f64) -> f64 {
        (self.alpha2 + (1.0 - self.alpha2) * mu * mu).sqrt()
    }

    /// The bound k(mu) of the cap.
    fn bound(&self, mu: f64) -> f64 {
        let s = 1.0 + (1.0 - mu * mu).max(0.0).sqrt();
        (1.0 - self.alpha2) * s * s / (s * s + self.alpha2 * mu * mu)
    }

    /// Half the reciprocal of D / `density`, k mu + t(mu).
    pub fn reach(&self, mu: f64) -> f64 {
        self.bound(mu) * mu + self.stretched(mu)
    }

    /// The law of reflection at Fresnel factor one \[1/sr\].
    pub fn law(&self, pair: &Pair) -> f64 {
        let Pair { arriving, leaving, .. } = *pair;
        self.normals_over(pair, leaving * self.stretched(arriving) + arriving * self.stretched(leaving))
    }

    /// Density in solid angle with which [`Cap`] draws the direction of departure \[1/sr\].
    pub fn density(&self, pair: &Pair) -> f64 {
        self.normals_over(pair, self.reach(pair.arriving))
    }

    /// The normals visible from `arrival`, the unit vector towards the light's origin in the surface's frame.
    pub fn cap(&self, arrival: DVec3) -> Cap {
        let stretched = DVec3::new(self.alpha * arrival.x, self.alpha * arrival.y, arrival.z).normalize();
        Cap { arrival, stretched, alpha: self.alpha, depth: self.bound(arrival.z) * stretched.z }
    }
}

/// Visible normals as a cap of the unit sphere: its uniform points are visible normals drawn by their share.
pub(super) struct Cap {
    arrival: DVec3,
    stretched: DVec3,
    alpha: f64,
    /// The cap is z > -depth.
    pub depth: f64,
}

impl Cap {
    /// The half vector of the cap's point `c`, or `None` where it is undefined.
    pub fn half_vector(&self, c: DVec3) -> Option<DVec3> {
        let h = c + self.stretched;
        DVec3::new(self.alpha * h.x, self.alpha * h.y, h.z).try_normalize()
    }

    /// The direction of departure after reflection at the half vector `h`.
    pub fn reflect(&self, h: DVec3) -> DVec3 {
        2.0 * self.arrival.dot(h) * h - self.arrival
    }
}
