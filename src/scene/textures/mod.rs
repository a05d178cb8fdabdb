//! Surfaces whose law of reflection and emission depend on the place: textures and colours at vertices.
//!
//! ```text
//! rho       = factor x texture (linear) x colour of the vertices, blended over the triangle
//! metallic  = factor x blue,    roughness = factor x green, rounded to the nearest 1/255
//! t         = factor x red of a texture of its own
//! L         = factor x strength x texture (linear)
//! ```
//!
//! The law at a place is made from these when it is asked for. Its base colour and metallic are exact; only the tables of a roughness
//! take milliseconds, so they are made beforehand for every step that occurs. What is read is what stands at the place: a hit,
//! a vertex, a receiver, always by position.

mod charts;
mod glow;
mod image;
mod layer;

pub use charts::Charts;
pub use glow::Glow;
pub use image::{Coding, Image, Texels};
pub use layer::{Filter, Layer, Transform, Wrap};

use super::reflectance::{Dielectric, Finish, Reflectance};
use crate::math::{DVec2, DVec3};
use crate::photometry::Colour;
use rayon::prelude::*;

/// How much of the light that meets a place the surface covers there; the rest goes straight on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Coverage {
    /// All of it.
    Whole,
    /// All where alpha is this or more, and nothing elsewhere.
    Mask(f64),
    /// The share alpha.
    Blend,
}

/// Steps of roughness between 0 and 1.
const STEPS: f64 = 255.0;

/// What varies on a surface.
#[derive(Clone, Debug)]
pub struct Textured {
    /// Pairs of coordinates that each corner has.
    pub sets: usize,
    /// True where each corner has a colour, which multiplies the base colour.
    pub coloured: bool,
    /// The base colour without texture.
    pub base: Colour,
    /// What multiplies it.
    pub base_layer: Option<Layer>,
    /// Metallic and roughness without texture.
    pub factors: [f64; 2],
    /// What multiplies them: roughness is its green, metallic its blue.
    pub data_layer: Option<Layer>,
    /// What it is where there is no metal, its transmission without texture.
    pub dielectric: Dielectric,
    /// What multiplies the transmission, by its red.
    pub transmission_layer: Option<Layer>,
    /// Emitted luminance without texture \[cd/m2\].
    pub emission: Colour,
    /// What multiplies it.
    pub emission_layer: Option<Layer>,
    /// True where a job has given it a law, the same everywhere.
    pub uniform_law: bool,
    /// What alpha means.
    pub coverage: Coverage,
    /// Alpha without texture: that of the base colour's, and of the vertices, multiply it.
    pub alpha: f64,
}

/// All surfaces that vary.
#[derive(Clone, Debug, Default)]
pub struct Textures {
    /// Of each surface what varies; surfaces behind the last entry are uniform.
    pub of_surface: Vec<Option<Textured>>,
    /// Where textures lie.
    pub charts: Charts,
    /// The finish of each step of roughness that occurs.
    finishes: Vec<Option<Finish>>,
    /// True where all colours are replaced by their luminance.
    grey: bool,
}

/// A place on a triangle: its number, and the barycentric coordinates.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// The triangle.
    pub triangle: u32,
    /// Weights of its corners.
    pub weights: [f64; 3],
}

impl Place {
    /// The place at `position` in the triangle with `corners`.
    pub fn new(triangle: u32, [a, b, c]: [DVec3; 3], position: DVec3) -> Self {
        let (u, v, w) = (b - a, c - a, position - a);
        let normal = u.cross(v);
        let inverse = 1.0 / normal.length_squared();
        let (q, r) = (w.cross(v).dot(normal) * inverse, u.cross(w).dot(normal) * inverse);
        // Rounding must not lead out of the triangle, nor one without area to NaN.
        let (q, r) = if inverse.is_finite() { (q.clamp(0.0, 1.0), r.clamp(0.0, 1.0)) } else { (0.0, 0.0) };
        let r = r.min(1.0 - q);
        Place { triangle, weights: [1.0 - q - r, q, r] }
    }
}

impl Textures {
    /// What varies on each surface, and where.
    pub fn new(of_surface: Vec<Option<Textured>>, charts: Charts) -> Self {
        Textures { of_surface, charts, ..Textures::default() }
    }

    /// Makes the tables of every roughness that occurs, and all colours grey where that is asked for.
    pub(super) fn prepared(mut self, grey: bool) -> Self {
        let mut wanted = vec![false; STEPS as usize + 1];
        for textured in self.of_surface.iter().flatten() {
            if let Some(layer) = &textured.data_layer {
                let (low, high) = layer.image.range(1);
                let step = |green: f64| step_of(textured.factors[1] * green);
                // Blending may round beyond either.
                wanted[step(low).saturating_sub(1)..=(step(high) + 1).min(STEPS as usize)].fill(true);
            }
        }
        let finish = |(step, wanted): (usize, bool)| wanted.then(|| Finish::new(step as f64 / STEPS));
        self.finishes = wanted.into_par_iter().enumerate().map(finish).collect();
        self.grey = grey;
        self
    }

    /// Lets the law of `surface`, but not its emission, be the same everywhere.
    pub(super) fn make_uniform(&mut self, surface: usize) {
        if let Some(Some(textured)) = self.of_surface.get_mut(surface) {
            (textured.uniform_law, textured.coverage) = (true, Coverage::Whole);
        }
    }

    /// Lets what varies on the surface `from` vary on `to`, a new one, as well.
    pub(super) fn copy(&mut self, from: usize, to: usize) {
        if let Some(Some(textured)) = self.of_surface.get(from).cloned() {
            self.of_surface.resize(to + 1, None);
            self.of_surface[to] = Some(textured);
        }
    }

    /// What varies on `surface`, where `triangle` is laid out on it.
    pub(super) fn of(&self, surface: u32, triangle: u32) -> Option<&Textured> {
        if !self.charts.has(triangle) {
            return None;
        }
        self.of_surface.get(surface as usize)?.as_ref()
    }

    /// The law of `textured` at `place`, where `uniform` is that of its factors and means.
    pub(super) fn law(&self, textured: &Textured, uniform: &Reflectance, place: Place) -> Reflectance {
        if textured.uniform_law {
            return uniform.clone();
        }
        let base = self.painted(self.base(textured, place));
        let transmission = textured.transmission_layer.as_ref().map(|layer| {
            let [red, ..] = self.read(textured, layer, place);
            (textured.dielectric.transmission * red).clamp(0.0, 1.0)
        });
        let Some(layer) = &textured.data_layer else {
            let law = uniform.with_base(base);
            return match transmission {
                Some(share) => law.with_transmission(share),
                None => law,
            };
        };
        let [_, green, blue, _] = self.read(textured, layer, place);
        let [metallic, roughness] = textured.factors;
        let (metallic, step) = ((metallic * blue).clamp(0.0, 1.0), step_of(roughness * green));
        let Dielectric { f0, f90, transmission: most } = textured.dielectric;
        // Where a material may transmit it has its outer surface everywhere: a texture of it draws no edges of another finish.
        if metallic == 0.0 && most == 0.0 && (step == STEPS as usize || f90 == 0.0) {
            return Reflectance::Lambert(base);
        }
        let finish = self.finishes[step].as_ref().expect("every step between the least and the greatest was made");
        let dielectric = Dielectric { f0: self.painted(f0), f90, transmission: transmission.unwrap_or(most) };
        Reflectance::finished(base, metallic, dielectric, finish)
    }

    /// True where the emission of `triangle` on `surface` varies.
    pub(super) fn varies(&self, surface: u32, triangle: u32) -> bool {
        self.of(surface, triangle).is_some_and(|textured| textured.emission_layer.is_some())
    }

    /// Emitted luminance of `triangle` on `surface`, as it varies; `None` where it does not.
    pub(super) fn glow(&self, surface: u32, triangle: u32) -> Option<Glow> {
        let textured = self.of(surface, triangle)?;
        let layer = textured.emission_layer.clone()?;
        let corners = self.charts.corners(triangle, textured.width(), layer.set);
        Some(Glow::new(layer, corners, textured.emission, self.grey))
    }

    /// True where light may go straight on through `triangle` on `surface`.
    pub(super) fn is_veil(&self, surface: u32, triangle: u32) -> bool {
        self.of(surface, triangle).is_some_and(|textured| textured.coverage != Coverage::Whole)
    }

    /// The share of light that `textured` covers at `place`.
    pub(super) fn covered(&self, textured: &Textured, place: Place) -> f64 {
        let mut alpha = textured.alpha;
        if let Some(layer) = &textured.base_layer {
            alpha *= self.read(textured, layer, place)[3];
        }
        if textured.coloured {
            let Place { triangle, weights } = place;
            let [of_vertices] = self.charts.blend(triangle, textured.width(), 2 * textured.sets + 3, weights);
            alpha *= of_vertices;
        }
        match textured.coverage {
            Coverage::Whole => 1.0,
            Coverage::Mask(cutoff) => f64::from(u8::from(alpha >= cutoff)),
            Coverage::Blend => alpha.clamp(0.0, 1.0),
        }
    }

    /// Base colour at `place`.
    fn base(&self, textured: &Textured, place: Place) -> Colour {
        let mut base = textured.base;
        if let Some(layer) = &textured.base_layer {
            let [r, g, b, _] = self.read(textured, layer, place);
            base = base * Colour([r, g, b]);
        }
        if textured.coloured {
            let Place { triangle, weights } = place;
            base = base * Colour(self.charts.blend(triangle, textured.width(), 2 * textured.sets, weights));
        }
        // Blending may round to a little more than one.
        base.map(|c| c.min(1.0))
    }

    fn read(&self, textured: &Textured, layer: &Layer, Place { triangle, weights }: Place) -> [f64; 4] {
        let uv: [f64; 2] = self.charts.blend(triangle, textured.width(), 2 * layer.set, weights);
        layer.at(DVec2::from_array(uv))
    }

    fn painted(&self, colour: Colour) -> Colour {
        if self.grey { Colour::grey(colour.luminance()) } else { colour }
    }

    /// Laws as bright and with as narrow a lobe as any place of a surface that varies has, where `uniform` are the laws by their means.
    pub(super) fn extremes<'a>(
        &'a self,
        uniform: impl Fn(usize) -> &'a Reflectance + 'a,
    ) -> impl Iterator<Item = Reflectance> + 'a {
        let varying = self.of_surface.iter().enumerate().filter_map(|(i, textured)| Some((i, textured.as_ref()?)));
        let varying = varying.filter(|(_, textured)| !textured.uniform_law);
        varying.map(move |(i, textured)| {
            let opaque = Dielectric { transmission: 0.0, ..textured.dielectric };
            let finest = textured
                .data_layer
                .as_ref()
                .and_then(|layer| self.finishes[step_of(textured.factors[1] * layer.image.range(1).0)].as_ref());
            match finest {
                Some(finish) => Reflectance::finished(Colour::WHITE, textured.factors[0], opaque, finish),
                None => uniform(i).with_base(Colour::WHITE),
            }
        })
    }

    /// Memory \[bytes\].
    pub fn bytes(&self) -> u64 {
        let mut images: Vec<&std::sync::Arc<Image>> = Vec::new();
        for textured in self.of_surface.iter().flatten() {
            let layers =
                [&textured.base_layer, &textured.data_layer, &textured.transmission_layer, &textured.emission_layer];
            for layer in layers.into_iter().flatten() {
                if !images.iter().any(|known| std::sync::Arc::ptr_eq(known, &layer.image)) {
                    images.push(&layer.image);
                }
            }
        }
        self.charts.bytes() + images.into_iter().map(|image| image.bytes()).sum::<u64>()
    }
}

impl Textured {
    /// Numbers at each corner.
    pub fn width(&self) -> usize {
        2 * self.sets + if self.coloured { 4 } else { 0 }
    }
}

/// The step nearest to `roughness`.
fn step_of(roughness: f64) -> usize {
    (roughness.clamp(0.0, 1.0) * STEPS + 0.5) as usize
}
