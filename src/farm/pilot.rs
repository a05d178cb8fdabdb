//! The bound of the kernel, fixed before the run and written into the plan (docs/method.md, section 6).

use crate::job::{Estimator, Job};
use crate::scene::Scene;

/// b of each receiver set of `job`, in job order \[1/m2\]; empty where nothing is bounded.
pub fn bounds(job: &Job, _scene: &Scene) -> Vec<f64> {
    if job.transport.estimator != Estimator::Local || !job.transport.bounded {
        return Vec::new();
    }
    vec![f64::INFINITY; job.sets().len()]
}
