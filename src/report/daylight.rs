//! Daylight factors: illuminance indoors over that of the unobstructed horizontal plane under the same sky, in percent.
//!
//! The denominator is a quadrature of the sky's formula and has no error, so the intervals are those of the illuminance.

use super::derived::Quantity;
use crate::job::Job;
use crate::scene::Sky;
use serde::Serialize;

const HOW: &str = "interval of the illuminance, divided by the outdoor one, which has no error";

/// Illuminance of a set in percent of the outdoor one.
#[derive(Debug, Serialize)]
pub(super) struct DaylightFactor {
    /// Illuminance of the unobstructed horizontal plane by the sky \[lx\].
    pub outdoor_lx: f64,
    /// Of a point, or of the mean over the points of a grid \[%\].
    pub mean: Quantity,
    /// Of the least point of a grid \[%\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<Quantity>,
}

impl DaylightFactor {
    /// The factors of a mean and a least illuminance over `outdoor` \[lx\].
    pub fn new(outdoor: f64, mean: &Quantity, min: Option<&Quantity>) -> Self {
        let over = |q: &Quantity| {
            let [value, ci_lower, ci_upper] = [q.value, q.ci_lower, q.ci_upper].map(|e| 100.0 * e / outdoor);
            let standard_error = q.standard_error.map(|e| 100.0 * e / outdoor);
            Quantity { value, standard_error, ci_lower, ci_upper, how: HOW, note: q.note, marks: q.marks.clone() }
        };
        DaylightFactor { outdoor_lx: outdoor, mean: over(mean), min: min.map(over) }
    }
}

/// The outdoor illuminance, where `job` asks for daylight factors \[lx\].
pub(super) fn outdoor(job: &Job) -> Option<f64> {
    job.sky.as_ref().filter(|sky| sky.daylight_factor).map(|sky| Sky::of_job(sky).horizontal_illuminance())
}
