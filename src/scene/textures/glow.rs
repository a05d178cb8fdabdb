//! Emission that varies over a triangle.
//!
//! The luminance of light is always that of the place where it starts. A mean is needed for the choice among emitters alone, and its
//! error cannot bias anything as long as nothing that emits has the mean 0.

use super::Layer;
use crate::math::{DVec2, ceil};
use crate::photometry::Colour;

/// Most points at which the means of all triangles together are taken.
const MOST: usize = 1 << 24;
/// Most of them along an edge of a triangle.
const ALONG: f64 = 1024.0;
/// Fewest of them, unless triangles are too many.
const FEW: f64 = 64.0;
/// What a white texture counts where all points are dark and some texel may not be.
const UNSEEN: f64 = 1e-3;

/// Luminance over a triangle.
#[derive(Clone, Debug)]
pub struct Glow {
    layer: Layer,
    /// Coordinates at its corners.
    corners: [DVec2; 3],
    /// Luminance where the texture is white \[cd/m2\].
    emission: Colour,
    /// True where colours are replaced by their luminance.
    grey: bool,
}

impl Glow {
    /// The texture of `layer` times `emission` on the triangle with these coordinates at its `corners`.
    pub fn new(layer: Layer, corners: [DVec2; 3], emission: Colour, grey: bool) -> Self {
        Glow { layer, corners, emission, grey }
    }

    /// Luminance where the corners have these weights \[cd/m2\].
    pub fn at(&self, [a, b, c]: [f64; 3]) -> Colour {
        let [p, q, r] = self.corners;
        let [red, green, blue, _] = self.layer.at(p * a + q * b + r * c);
        let luminance = self.emission * Colour([red, green, blue]);
        if self.grey { Colour::grey(luminance.luminance()) } else { luminance }
    }

    /// About the mean over the triangle, one of `count`, for the choice of an emitter: from points a texel apart, farther apart where
    /// that would be too many; black only where all is \[cd/m2\].
    pub fn mean(&self, count: usize) -> Colour {
        let (mut sum, mut brightest) = (Colour::BLACK, 0.0f64);
        let n = self.points(count);
        for i in 0..n {
            for j in 0..2 * i + 1 {
                let luminance = self.at(centre(i, j, n));
                sum += luminance;
                brightest = brightest.max(luminance.luminance());
            }
        }
        if brightest > 0.0 {
            return sum / (n * n) as f64;
        }
        let [a, b, c] = self.corners.map(|uv| self.layer.transform.apply(uv));
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        if self.layer.has_light(low, high) { self.emission * UNSEEN } else { Colour::BLACK }
    }

    /// Parts of an edge, so that each is about a texel.
    fn points(&self, count: usize) -> usize {
        let [width, height] = self.layer.image.size();
        let texels = |a: DVec2, b: DVec2| {
            let way = self.layer.transform.u * (b - a).x + self.layer.transform.v * (b - a).y;
            (way * DVec2::new(width as f64, height as f64)).length()
        };
        let [a, b, c] = self.corners;
        let longest = texels(a, b).max(texels(b, c)).max(texels(c, a));
        let most = ((MOST / count.max(1)) as f64).sqrt().clamp(4.0, ALONG);
        ceil(longest.max(FEW).min(most)) as usize
    }
}

/// Barycentric coordinates of the centre of triangle `j` in row `i` of a triangle cut into `n` x `n`.
fn centre(i: usize, j: usize, n: usize) -> [f64; 3] {
    let third = 1.0 / (3 * n) as f64;
    // Row i lies between the shares i/n and (i + 1)/n from the first corner; even triangles point to it, odd ones away.
    let (far, along) = if j.is_multiple_of(2) { (3 * i + 2, 3 * (j / 2) + 1) } else { (3 * i + 1, 3 * (j / 2) + 2) };
    let (far, along) = (far as f64 * third, along as f64 * third);
    [1.0 - far, far - along, along]
}
