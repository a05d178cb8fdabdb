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
use ::exr::block::writer::ChunksWriter;
use ::exr::block::{BlockIndex, UncompressedBlock};
use ::exr::compression::Compression;
use ::exr::math::Vec2;
use ::exr::meta::BlockDescription;
use ::exr::meta::attribute::{AttributeValue, ChannelDescription, Chromaticities, LineOrder, SampleType, Text};
use ::exr::meta::header::{Header, ImageAttributes, LayerAttributes};
use smallvec::smallvec;
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

/// Lines that are compressed together.
const LINES: usize = 16;

/// Writes the map `values` to `to`, some lines at a time.
pub(super) fn write(plan: &Plan, merged: &Merged, values: &SetValues, to: &mut (impl Write + Seek)) -> Result<()> {
    let mut channels = CHANNELS;
    channels.sort_unstable_by_key(|(name, _)| *name);
    let [width, height] = [values.shape.width as usize, values.shape.height as usize];
    let described = channels.iter().map(|(name, _)| ChannelDescription::named(*name, SampleType::F32)).collect();
    let mut shared = ImageAttributes::with_size((width, height));
    shared.chromaticities = Some(REC709);
    let header = Header::new(Text::default(), (width, height), described)
        .with_encoding(Compression::ZIP16, BlockDescription::ScanLines, LineOrder::Increasing)
        .with_attributes(attributes(plan, merged, values))
        .with_shared_attributes(shared);
    let mut lines = Lines { channels, width, samples: Vec::new() };
    let written = ::exr::block::write(to, smallvec![header], true, |meta, writer| {
        let mut compressor = writer.sequential_blocks_compressor(&meta);
        let mut compress = |first: usize, data: Vec<u8>| {
            let lines = LINES.min(height - first);
            let (pixel_position, pixel_size) = (Vec2(0, first), Vec2(width, lines));
            let index = BlockIndex { layer: 0, pixel_position, pixel_size, level: Vec2(0, 0) };
            compressor.compress_block(first / LINES, UncompressedBlock { index, data })
        };
        let mut first = 0;
        values.each(|i, bin| {
            lines.take(bin);
            let end = (i + 1) / width;
            if (i + 1) % width == 0 && (end % LINES == 0 || end == height) {
                compress(first, lines.bytes()).map_err(failed)?;
                first = end;
            }
            Ok(())
        })?;
        Ok(())
    });
    written.map_err(failed)
}

fn failed(error: ::exr::error::Error) -> std::io::Error {
    std::io::Error::other(error.to_string())
}

/// Some lines of all channels, as they come: bin by bin.
struct Lines {
    channels: [Channel; CHANNELS.len()],
    width: usize,
    /// All channels of a bin, and so on.
    samples: Vec<f32>,
}

impl Lines {
    fn take(&mut self, bin: &Bin) {
        self.samples.extend(self.channels.iter().map(|(_, number)| number(bin) as f32));
    }

    /// The bytes of the lines so far, as a file has them: in each line channel after channel.
    fn bytes(&mut self) -> Vec<u8> {
        let count = self.channels.len();
        let mut bytes = Vec::with_capacity(4 * self.samples.len());
        for line in self.samples.chunks_exact(self.width * count) {
            for channel in 0..count {
                line[channel..].iter().step_by(count).for_each(|x| bytes.extend(x.to_ne_bytes()));
            }
        }
        self.samples.clear();
        bytes
    }
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
