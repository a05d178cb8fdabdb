//! Where textures lie on triangles: coordinates and colours at their corners.

use crate::math::DVec2;

/// No corner has anything.
const NONE: u32 = u32::MAX;

/// What stands at the corners of triangles on surfaces that vary.
#[derive(Clone, Debug, Default)]
pub struct Charts {
    /// Of each triangle where its own numbers begin in `values`; shorter than the list of triangles, and empty where nothing varies.
    first: Vec<u32>,
    /// Corner by corner: pairs of coordinates, and then, where the surface has them, four of colour and alpha.
    values: Vec<f32>,
}

impl Charts {
    /// Adds the numbers of the corners of triangle number `triangle`, which comes after all that were added.
    pub fn push(&mut self, triangle: usize, corners: [&[f32]; 3]) {
        self.first.resize(triangle, NONE);
        self.first.push(u32::try_from(self.values.len()).expect("there are fewer triangles than that"));
        corners.into_iter().for_each(|corner| self.values.extend_from_slice(corner));
    }

    /// True where `triangle` has a chart.
    pub fn has(&self, triangle: u32) -> bool {
        self.first.get(triangle as usize).is_some_and(|&first| first != NONE)
    }

    /// What stands at the corners of `triangle`, weighed: the numbers from `from` on of the `width` that a corner has.
    pub fn blend<const N: usize>(&self, triangle: u32, width: usize, from: usize, weights: [f64; 3]) -> [f64; N] {
        let first = self.first[triangle as usize] as usize;
        let mut blend = [0.0; N];
        for (corner, weight) in weights.into_iter().enumerate() {
            let at = first + corner * width + from;
            for (sum, value) in blend.iter_mut().zip(&self.values[at..at + N]) {
                *sum += weight * f64::from(*value);
            }
        }
        blend
    }

    /// The coordinates number `set` at the corners of `triangle`, of `width` numbers each.
    pub fn corners(&self, triangle: u32, width: usize, set: usize) -> [DVec2; 3] {
        let at = |weights| DVec2::from_array(self.blend(triangle, width, 2 * set, weights));
        [at([1.0, 0.0, 0.0]), at([0.0, 1.0, 0.0]), at([0.0, 0.0, 1.0])]
    }

    /// Keeps the triangles of which `kept` says so.
    pub fn retain(&mut self, kept: &[bool]) {
        let mut flags = kept.iter();
        self.first.retain(|_| *flags.next().expect("no more charts than triangles"));
    }

    /// Memory \[bytes\].
    pub fn bytes(&self) -> u64 {
        4 * (self.first.len() + self.values.len()) as u64
    }
}
