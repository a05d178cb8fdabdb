//! Scores of a grid by counting (`estimator = "direct_simulation"`).
//!
//! The score of a cell is what the histories carry through it, over its area and their number. Direct light comes with the
//! histories here; it is `direct`, and left out of `peak` as everywhere. A cell whose centre lies inside a solid has no
//! value, as with local estimation; one that a solid covers in part is counted over its whole area.

use super::{Bins, ReceiverSet};
use crate::job::Grid;
use crate::math::DVec3;
use crate::photometry::Colour;
use crate::scene::Scene;
use crate::tally::Scores;
use crate::transport::crossing::Cells;
use crate::transport::trajectory::Segment;

/// What one history carries through one cell.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Carried {
    bin: u32,
    direct: Colour,
    reflected: Colour,
}

impl ReceiverSet {
    /// Direct light that is known without histories \[lx\]: none; NaN for a cell with its centre inside a solid.
    pub fn counted_beforehand(&self, i: usize) -> f64 {
        match &self.bins {
            Bins::Meters(meters) if meters[i].is_none() => f64::NAN,
            _ => 0.0,
        }
    }

    /// The scores of this set, the cells of `grid`, from the segments of every history of a batch.
    pub fn counted<'a>(&self, scene: &Scene, grid: &Grid, batch: impl Iterator<Item = &'a [Segment]>) -> Scores {
        let cells = cells(scene, grid);
        let mut scores = Scores::zero(&self.shape);
        let mut sums = vec![[Colour::BLACK; 2]; self.shape.bins()];
        for segments in batch {
            scores.watched.iter_mut().for_each(|w| w.totals.push(0.0));
            for Carried { bin, direct, reflected } in carried(&cells, segments) {
                let sum = &mut sums[bin as usize];
                *sum = [sum[0] + direct, sum[1] + reflected];
                let peak = &mut scores.peak[bin as usize];
                *peak = peak.max(reflected.luminance() / cells.area());
                if let Ok(place) = self.shape.monitored.binary_search(&bin) {
                    let total = scores.watched[place].totals.last_mut().expect("one was pushed for this history");
                    *total = (direct + reflected).luminance() / cells.area();
                }
            }
        }
        for (bin, [direct, reflected]) in sums.into_iter().enumerate() {
            let share = 1.0 / (cells.area() * self.histories as f64);
            scores.value[bin] = (direct + reflected).luminance() * share;
            scores.direct[bin] = direct.luminance() * share;
            scores.existed[bin] = scene.reflects() && !self.counted_beforehand(bin).is_nan();
        }
        scores
    }
}

/// The cells of `grid`, as they lie in `scene`.
fn cells(scene: &Scene, grid: &Grid) -> Cells {
    let edges = [grid.u, grid.v].map(DVec3::from);
    Cells::new(scene, scene.place(grid.origin), edges, grid.normal.into(), grid.columns, grid.rows)
}

/// What the history with `segments` carries through the cells, each once, in ascending order.
fn carried(cells: &Cells, segments: &[Segment]) -> Vec<Carried> {
    let crossing = |segment: &Segment| {
        let bin = cells.crossed(segment)?;
        let (direct, reflected) =
            if segment.order == 0 { (segment.weight, Colour::BLACK) } else { (Colour::BLACK, segment.weight) };
        Some(Carried { bin, direct, reflected })
    };
    let mut all: Vec<Carried> = segments.iter().filter_map(crossing).collect();
    all.sort_by_key(|c| c.bin);
    all.dedup_by(|next, kept| {
        let same = next.bin == kept.bin;
        if same {
            kept.direct += next.direct;
            kept.reflected += next.reflected;
        }
        same
    });
    all
}
