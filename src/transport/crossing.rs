//! Where light crosses the cells of a grid: what direct simulation counts.
//!
//! The trajectories of a grid's map are the same as those of local estimation; instead of being connected to points they
//! are counted where they cross its cells, of area A each:
//!
//! ```text
//! mean of E over a cell = E[ sum of the weights on the segments that cross it from the side of the normal ] / A
//! ```
//!
//! The segment from the source counts too, so direct light is in it. A segment is counted once, where it passes from above the
//! plane of the grid to no higher than a tolerance of four lifts above it: a grid that lies on a surface counts the light that
//! ends there, whatever rounding makes of either. In return, light that ends or starts elsewhere but less than four lifts
//! above the plane is counted as if it had crossed, or is not, in a margin of that width along a wall.
//!
//! Light that a mirror sent straight to a cell is counted as well: no connection can carry it, so beside mirrors this mean is
//! higher than that of the other estimators.
//!
//! A grid is a plane with cells here: no light, no batch, no receiver.

use super::trajectory::Segment;
use crate::math::DVec3;
use crate::scene::Scene;

/// How far above the plane a segment may end that crosses it, in lifts of the grid's remotest corner.
const TOLERANCE: f64 = 4.0;

/// A parallelogram of `columns` x `rows` cells.
#[derive(Clone, Debug)]
pub struct Cells {
    origin: DVec3,
    /// Unit normal on the side from which light counts.
    normal: DVec3,
    /// Their scalar products with a point of the plane, seen from `origin`, are its shares of the two edges.
    along: [DVec3; 2],
    columns: u32,
    rows: u32,
    area: f64,
    tolerance: f64,
}

impl Cells {
    /// The parallelogram at `origin` with edges `u` (a row) and `v` (a column), light counting from the side of
    /// `side`, as placed in `scene`.
    pub fn new(scene: &Scene, origin: DVec3, [u, v]: [DVec3; 2], side: DVec3, columns: u32, rows: u32) -> Self {
        let across = u.cross(v);
        let normal = (across * across.dot(side)).normalize();
        let lift = |corner: DVec3| (scene.geometry.lift(corner, normal) - corner).length();
        let lifts = [origin, origin + u, origin + v, origin + u + v].map(lift);
        Cells {
            origin,
            normal,
            along: [v.cross(across), across.cross(u)].map(|d| d / across.length_squared()),
            columns,
            rows,
            area: across.length() / (f64::from(columns) * f64::from(rows)),
            tolerance: TOLERANCE * lifts.into_iter().fold(0.0, f64::max),
        }
    }

    /// Area of one cell \[m2\].
    pub fn area(&self) -> f64 {
        self.area
    }

    /// Number of the cell that `segment` crosses from the side of the normal, row by row.
    pub fn crossed(&self, segment: &Segment) -> Option<u32> {
        let height = (segment.ray.origin - self.origin).dot(self.normal);
        let falling = -segment.ray.direction.dot(self.normal);
        let ends_below = height - falling * segment.length <= self.tolerance;
        if falling <= 0.0 || height <= self.tolerance || !ends_below {
            return None;
        }
        let at = segment.ray.origin + (height / falling).min(segment.length) * segment.ray.direction - self.origin;
        let [a, b] = self.along.map(|d| d.dot(at));
        let inside = (0.0..1.0).contains(&a) && (0.0..1.0).contains(&b);
        // Rounding may take a share just below one to one.
        let place = |share: f64, cells: u32| ((share * f64::from(cells)) as u32).min(cells - 1);
        inside.then(|| place(b, self.rows) * self.columns + place(a, self.columns))
    }
}
