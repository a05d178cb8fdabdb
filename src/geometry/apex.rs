//! A point that many tiles of others are asked about.

use super::Geometry;
use super::harmonic::Prospect;
use crate::math::Vec3;

/// A lifted point, and what is found out once for it.
#[derive(Clone, Debug)]
pub struct Apex {
    /// The point \[m\].
    pub at: Vec3,
    /// Of each star-shaped object, how it is seen from there.
    pub(super) prospects: Box<[Prospect]>,
}

impl Geometry {
    /// The apex at the lifted point `at` \[m\].
    pub fn apex(&self, at: Vec3) -> Apex {
        Apex { at, prospects: self.harmonics.iter().map(|_| Prospect::default()).collect() }
    }
}
