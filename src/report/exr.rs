//! Luminance maps as OpenEXR: one part, 32-bit float, ZIP of 16 scan lines, row 0 on top.
//!
//! Channels are listed in the module documentation of `report`. What a number needs to be understood later is in
//! the header: units, confidence, batches, histories, seed, digests, version. Counts are texts, because an integer
//! attribute has 32 bits.

use super::health::estimate_label;
use super::missing_text;
use super::values::{Bin, SetValues, unit};
use crate::farm::merge::Merged;
use crate::farm::plan::Plan;
use ::exr::image::write::WritableImage;
use ::exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer};
use ::exr::math::Vec2;
use ::exr::meta::attribute::{AttributeValue, Chromaticities, Text};
use ::exr::meta::header::LayerAttributes;
use std::io::{Result, Seek, Write};

/// Name of a channel and where its numbers come from.
type Channel = (&'static str, fn(&Bin) -> f64);

const CHANNELS: [Channel; 11] = [
    ("R", |b| b.colour[0]),
    ("G", |b| b.colour[1]),
    ("B", |b| b.colour[2]),
    ("luminance.Y", |b| b.value),
    ("luminance.variance", |b| b.standard_error * b.standard_error),
    ("luminance.standardError", |b| b.standard_error),
    ("luminance.ciLower", |b| b.low),
    ("luminance.ciUpper", |b| b.high),
    ("luminance.peak", |b| b.peak),
    ("luminance.health", Bin::health_code),
    ("direct.Y", |b| b.direct),
];

/// Primaries and white of Rec.709, the space of `R`, `G`, `B`.
const REC709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.30, 0.60),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};

/// Writes the map `values` to `to`.
pub(super) fn write(plan: &Plan, merged: &Merged, values: &SetValues, to: &mut (impl Write + Seek)) -> Result<()> {
    let channel = |&(name, number): &Channel| {
        let samples = values.bins.iter().map(|b| number(b) as f32).collect();
        AnyChannel::new(name, FlatSamples::F32(samples))
    };
    let channels = AnyChannels::sort(CHANNELS.iter().map(channel).collect());
    let size = Vec2(values.shape.width as usize, values.shape.height as usize);
    let layer = Layer::new(size, attributes(plan, merged, values), Encoding::SMALL_LOSSLESS, channels);
    let mut image = Image::from_layer(layer);
    image.attributes.chromaticities = Some(REC709);
    image.write().to_buffered(to).map_err(|e| std::io::Error::other(e.to_string()))
}

fn attributes(plan: &Plan, merged: &Merged, values: &SetValues) -> LayerAttributes {
    let run = &plan.job.run;
    let inputs: Vec<String> = plan.inputs.iter().map(|i| format!("{} {}", i.digest, i.name)).collect();
    let texts = [
        ("units", unit(values.shape.kind).to_owned()),
        ("estimate", estimate_label(plan).to_owned()),
        ("batches", merged.batches.to_string()),
        ("historiesPerBatch", run.histories_per_batch.to_string()),
        ("thinning", run.thinning.to_string()),
        ("histories", (merged.batches * run.histories_per_batch).to_string()),
        ("seed", run.seed.to_string()),
        ("planDigest", plan.digest.clone()),
        ("jobDigest", plan.job_file.digest.clone()),
        ("inputDigests", inputs.join("; ")),
        ("programVersion", plan.program.clone()),
        ("complete", merged.missing.is_empty().to_string()),
        ("missingBatches", missing_text(merged)),
    ];
    let mut attributes = LayerAttributes { white_luminance: Some(1.0), ..LayerAttributes::default() };
    for (name, value) in texts {
        attributes.other.insert(text(name), AttributeValue::Text(text(&value)));
    }
    attributes.other.insert(text("confidence"), AttributeValue::F64(run.confidence));
    attributes
}

/// `value` in the one-byte characters of OpenEXR; a character beyond them becomes `?`.
fn text(value: &str) -> Text {
    let plain: String = value.chars().map(|c| if c.is_ascii() { c } else { '?' }).collect();
    Text::from(plain.as_str())
}
