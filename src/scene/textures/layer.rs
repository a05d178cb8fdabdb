//! A texture as a material uses it: an image, how it is laid on a surface, and how it is read between its texels.
//!
//! With (u, v) the coordinates of a place after the transform, wrapped into the unit square, and W x H the size of the image, the
//! texel (i, j) has its centre at ((i + 1/2)/W, (j + 1/2)/H), v downwards. Filtering is done on linear values; there are no
//! mipmaps: a pixel takes its mean over many positions, as over all else that varies in it.

use super::image::{Coding, Image};
use crate::math::DVec2;
use std::sync::Arc;

/// How a texture is read between its texels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filter {
    /// The value of the nearest texel.
    Nearest,
    /// Linear in both directions between the centres of four.
    Bilinear,
}

/// How a texture goes on beyond its edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wrap {
    /// By its last texels.
    Clamp,
    /// Turned round, each time.
    Mirror,
    /// Again and again.
    Repeat,
}

/// KHR_texture_transform: offset + rotation (counter-clockwise about the origin, v downwards) of the scaled coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// The image of (1, 0).
    pub u: DVec2,
    /// The image of (0, 1).
    pub v: DVec2,
    /// The image of (0, 0).
    pub offset: DVec2,
}

impl Transform {
    /// Leaves everything where it is.
    pub const IDENTITY: Transform = Transform { u: DVec2::X, v: DVec2::Y, offset: DVec2::ZERO };

    /// The coordinates in the image of the coordinates `uv` of a surface.
    pub fn apply(&self, uv: DVec2) -> DVec2 {
        self.u * uv.x + self.v * uv.y + self.offset
    }
}

/// A texture of a material.
#[derive(Clone, Debug)]
pub struct Layer {
    /// Its texels.
    pub image: Arc<Image>,
    /// What they are.
    pub coding: Coding,
    /// Between its texels.
    pub filter: Filter,
    /// Beyond its edges, along u and v.
    pub wrap: [Wrap; 2],
    /// Which of the coordinates of the surface it uses: a place in the list of those kept.
    pub set: usize,
    /// From these to its own.
    pub transform: Transform,
}

impl Layer {
    /// Red, green, blue and alpha at the coordinates `uv` of the surface, 0 .. 1.
    pub fn at(&self, uv: DVec2) -> [f64; 4] {
        let [width, height] = self.image.size();
        let uv = self.transform.apply(uv);
        let x = self.wrap[0].inside(uv.x) * width as f64;
        let y = self.wrap[1].inside(uv.y) * height as f64;
        match self.filter {
            Filter::Nearest => self.image.texel((x as usize).min(width - 1), (y as usize).min(height - 1), self.coding),
            Filter::Bilinear => self.between(x - 0.5, y - 0.5),
        }
    }

    /// Whether a texel may be bright between the coordinates `low` and `high` of the image: false is a proof.
    pub fn has_light(&self, low: DVec2, high: DVec2) -> bool {
        let [width, height] = self.image.size();
        // Filtering reaches a texel farther.
        let across = self.wrap[0].reach(low.x, high.x, 1.0 / width as f64);
        let down = self.wrap[1].reach(low.y, high.y, 1.0 / height as f64);
        self.image.has_light(across, down)
    }

    /// The linear mean of the four texels around `x` and `y`, counted from the centre of the first.
    fn between(&self, x: f64, y: f64) -> [f64; 4] {
        let [width, height] = self.image.size();
        let columns = self.wrap[0].neighbours(x, width);
        let rows = self.wrap[1].neighbours(y, height);
        let (p, q) = (x - x.floor(), y - y.floor());
        let texel = |i: usize, j: usize| self.image.texel(columns[i], rows[j], self.coding);
        let (a, b, c, d) = (texel(0, 0), texel(1, 0), texel(0, 1), texel(1, 1));
        let mut value = [0.0; 4];
        for k in 0..4 {
            let upper = a[k] + (b[k] - a[k]) * p;
            let lower = c[k] + (d[k] - c[k]) * p;
            value[k] = upper + (lower - upper) * q;
        }
        value
    }
}

impl Wrap {
    /// The coordinate `t` wrapped into 0 ..= 1.
    fn inside(self, t: f64) -> f64 {
        match self {
            Wrap::Clamp => t.clamp(0.0, 1.0),
            Wrap::Repeat => t - t.floor(),
            Wrap::Mirror => {
                let twice = t - 2.0 * (0.5 * t).floor();
                twice.min(2.0 - twice)
            }
        }
    }

    /// Where in the unit interval the coordinates from `low` to `high`, and `more` on both sides, may come to lie.
    fn reach(self, low: f64, high: f64, more: f64) -> [f64; 2] {
        let from_0_to_1 = |low: f64, high: f64| low >= 0.0 && high <= 1.0;
        let ends = [low - more, high + more];
        match self {
            // Beyond its edges there is what lies at its edges.
            Wrap::Clamp => ends.map(|t| t.clamp(0.0, 1.0)),
            Wrap::Mirror if from_0_to_1(low, high) => ends.map(|t| t.clamp(0.0, 1.0)),
            Wrap::Repeat if from_0_to_1(ends[0], ends[1]) => ends,
            Wrap::Mirror | Wrap::Repeat => [0.0, 1.0],
        }
    }

    /// The texels on both sides of `x` in -1/2 ..= `count` - 1/2.
    fn neighbours(self, x: f64, count: usize) -> [usize; 2] {
        let last = count - 1;
        // One more than the number of the first, which may be -1.
        let after = (x + 1.0).floor() as usize;
        match self {
            Wrap::Repeat => [if after == 0 { last } else { after - 1 }, after % count],
            // Beyond an edge the mirrored image begins with the same texel.
            Wrap::Clamp | Wrap::Mirror => [after.saturating_sub(1).min(last), after.min(last)],
        }
    }
}
