//! The outer surface of a material, whatever its colour: what of a law takes milliseconds to prepare, and may be shared.

use super::albedo::{AlbedoTable, Coefficients};
use super::lanes::SpecularInLanes;
use super::microfacet::Microfacets;
use std::sync::Arc;

/// Below this alpha a surface is a mirror: its lobe would be narrower than any receiver resolves.
const MIRROR: f64 = 1e-3;

/// How smooth a surface is, with the albedo tables of that; to clone it costs nothing.
#[derive(Clone, Debug)]
pub struct Finish(pub(super) Arc<Specular>);

impl Finish {
    /// The finish of `roughness` \[1\]; its tables take a few milliseconds.
    pub fn new(roughness: f64) -> Self {
        Finish(Arc::new(Specular::new(roughness * roughness)))
    }
}

/// How the outer surface reflects.
#[derive(Debug)]
pub(super) struct Specular {
    pub kind: Kind,
    /// Cosine-weighted mean of `albedo` over the hemisphere.
    pub mean: Coefficients,
    pub lanes: Arc<SpecularInLanes>,
}

#[derive(Debug)]
pub(super) enum Kind {
    Mirror,
    Rough(Microfacets, AlbedoTable),
}

impl Specular {
    fn new(alpha: f64) -> Self {
        if alpha < MIRROR {
            let lanes = Arc::new(SpecularInLanes::Mirror);
            return Specular { kind: Kind::Mirror, mean: Coefficients::MIRROR_MEAN, lanes };
        }
        let facets = Microfacets::new(alpha);
        let table = AlbedoTable::new(&facets);
        let lanes = Arc::new(SpecularInLanes::rough(facets.alpha2(), table.nodes()));
        Specular { mean: table.mean(), kind: Kind::Rough(facets, table), lanes }
    }

    /// Directional albedo as A and B.
    pub fn albedo(&self, mu: f64) -> Coefficients {
        match &self.kind {
            Kind::Mirror => Coefficients::mirror(mu),
            Kind::Rough(_, table) => table.at(mu),
        }
    }

    /// The facets of a rough surface.
    pub fn rough(&self) -> Option<&Microfacets> {
        match &self.kind {
            Kind::Mirror => None,
            Kind::Rough(facets, _) => Some(facets),
        }
    }
}
