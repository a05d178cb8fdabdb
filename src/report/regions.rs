//! `regions.csv`: the mean luminance of every region of the job.

use super::csv::note;
use super::values::SetValues;
use crate::farm::merge::Merged;
use crate::farm::plan::Plan;
use std::io::{Result, Write};

const HEADER: [&str; 9] = [
    "name",
    "camera",
    "direct_cd_m2",
    "luminance_cd_m2",
    "standard_error_cd_m2",
    "ci_lower_cd_m2",
    "ci_upper_cd_m2",
    "vov",
    "note",
];

/// Writes all `regions`, in job order.
pub(super) fn write(plan: &Plan, merged: &Merged, regions: &[SetValues], to: &mut impl Write) -> Result<()> {
    let mut table = ::csv::Writer::from_writer(to);
    table.write_record(HEADER)?;
    for (values, region) in regions.iter().zip(&plan.job.regions) {
        assert_eq!(values.shape.name, region.name, "regions come in job order");
        let bin = values.single()?;
        let numbers = [bin.direct, bin.value, bin.standard_error, bin.low, bin.high, bin.vov];
        // Debug prints the shortest text that reads back to the same bits.
        let numbers = numbers.map(|x| format!("{x:?}"));
        let names = [region.name.clone(), region.camera.clone()];
        table.write_record(names.iter().chain(&numbers).chain([&note(&bin, plan, merged)]))?;
    }
    table.flush()
}
