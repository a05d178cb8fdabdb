//! Directions spread evenly over the sphere: the corners of square cells on the faces of a cube, by lines of equal angles.

use crate::math::{DVec3, PI, tan};

/// A lattice with so many cells along each edge of the cube.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    cells: usize,
    /// Coordinates of its lines on a face, from -1 to 1.
    lines: Vec<f64>,
}

impl Lattice {
    /// Half the diagonal of a cell of one: no cell of `n` has more than 1/n of it \[rad\].
    const HALF_DIAGONAL: f64 = 0.25 * PI * std::f64::consts::SQRT_2;

    /// The lattice with `cells` cells along an edge.
    pub(super) fn new(cells: usize) -> Self {
        // Those of both signs alike to the last bit, so that directions that mirror each other are.
        let above = |i: usize| if i == cells { 1.0 } else { tan((2 * i - cells) as f64 / cells as f64 * 0.25 * PI) };
        let line = |i: usize| if 2 * i < cells { -above(cells - i) } else { above(i) };
        Lattice { cells, lines: (0..=cells).map(line).collect() }
    }

    /// Cells along an edge.
    pub(super) fn cells(&self) -> usize {
        self.cells
    }

    /// No direction is farther from one of the lattice \[rad\].
    pub(super) fn reach(&self) -> f64 {
        Self::HALF_DIAGONAL / self.cells as f64
    }

    /// The points with whole coordinates, 0 to `cells`, on the surface of the cube.
    pub(super) fn points(&self) -> impl Iterator<Item = [usize; 3]> {
        let n = self.cells;
        let ends = move |i: usize| i == 0 || i == n;
        (0..=n).flat_map(move |i| {
            (0..=n).flat_map(move |j| {
                let step = if ends(i) || ends(j) { 1 } else { n };
                (0..=n).step_by(step).map(move |k| [i, j, k])
            })
        })
    }

    /// One of each [`Self::round`] of its points.
    pub(super) fn rounds(&self) -> impl Iterator<Item = [usize; 3]> {
        let n = self.cells;
        let upper = n.div_ceil(2)..=n;
        upper.flat_map(move |i| {
            (n.div_ceil(2)..=i).flat_map(move |j| (0..=n).step_by(if i == n { 1 } else { n }).map(move |k| [i, j, k]))
        })
    }

    /// What mirrors in x, y and x = y make of a point, some twice where it lies on one: their directions have the same z and x^2 + y^2 to the
    /// last bit.
    pub(super) fn round(&self, [i, j, k]: [usize; 3]) -> [[usize; 3]; 8] {
        let n = self.cells;
        let quarter = |i: usize, j: usize| [[i, j, k], [n - i, j, k], [i, n - j, k], [n - i, n - j, k]];
        let [[a, b, c, d], [e, f, g, h]] = [quarter(i, j), quarter(j, i)];
        [a, b, c, d, e, f, g, h]
    }

    /// Where a point lies on the faces, as [`Self::on_face`] has it: on up to three.
    pub(super) fn faces(&self, at: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
        let ends = (0..3).filter(move |&axis| at[axis] == 0 || at[axis] == self.cells);
        ends.map(move |axis| [2 * axis + usize::from(at[axis] > 0), at[(axis + 1) % 3], at[(axis + 2) % 3]])
    }

    /// The number of the point (u, v) of a face among those of all faces, face by face, u by u.
    pub(super) fn number(&self, [face, u, v]: [usize; 3]) -> usize {
        (face * (self.cells + 1) + u) * (self.cells + 1) + v
    }

    /// The direction of such a point.
    pub(super) fn direction(&self, point: [usize; 3]) -> DVec3 {
        DVec3::from_array(point.map(|i| self.lines[i])).normalize()
    }

    /// The point (u, v) of the face number `face` of six: neighbours of the axis of the face, turning left about it on the faces
    /// with odd numbers, which lie where that is `cells`.
    pub(super) fn on_face(&self, [face, u, v]: [usize; 3]) -> [usize; 3] {
        let axis = face / 2;
        let mut at = [if face % 2 == 1 { self.cells } else { 0 }; 3];
        (at[(axis + 1) % 3], at[(axis + 2) % 3]) = (u, v);
        at
    }

    /// The face and the point on it nearest to the direction of `x`, or a neighbour of it.
    pub(super) fn beside(&self, x: DVec3) -> [usize; 3] {
        let size = x.abs().to_array();
        let axis = if size[0] >= size[1] && size[0] >= size[2] { 0 } else { usize::from(size[1] < size[2]) + 1 };
        let line = |k: usize| {
            let t = x[(axis + k) % 3] / size[axis];
            // 4/pi atan t to 0.005.
            let angle = t * (1.3476 - 0.3476 * t.abs());
            ((0.5 + 0.5 * angle) * self.cells as f64 + 0.5) as usize
        };
        [2 * axis + usize::from(x[axis] > 0.0), line(1).min(self.cells), line(2).min(self.cells)]
    }
}
