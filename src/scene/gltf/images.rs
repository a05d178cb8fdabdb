//! Textures, of which for now only the mean colour is used.
//!
//! Pixels are counted by value before anything is averaged, so that the mean does not depend on the order of
//! summation; the JPEG decoder is built without its CPU-specific paths for the same reason: same bits everywhere.

use std::collections::HashMap;
use std::io::Cursor;

use zune_core::bytestream::ZCursor;
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;

use super::buffers::Buffers;
use super::document::Document;
use super::problem::File;
use super::uri;
use crate::error::Result;
use crate::math::pow;

/// Most pixels of an image (8192 x 8192): a small file may claim any size.
const MAX_PIXELS: u64 = 1 << 26;

/// Mean of an image over all its pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    /// Of the linear values that sRGB encodes: a colour.
    pub colour: [f64; 3],
    /// Of the values as stored, 0 .. 1: data such as roughness.
    pub stored: [f64; 3],
}

/// The images of the file, each decoded at most once.
pub struct Images<'a> {
    file: File<'a>,
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    fetch: &'a mut dyn FnMut(&str) -> Result<Vec<u8>>,
    means: HashMap<usize, Mean>,
}

impl<'a> Images<'a> {
    /// Nothing is read before it is asked for.
    pub fn new(
        file: File<'a>,
        document: &'a Document,
        buffers: &'a Buffers<'a>,
        fetch: &'a mut dyn FnMut(&str) -> Result<Vec<u8>>,
    ) -> Self {
        Images { file, document, buffers, fetch, means: HashMap::new() }
    }

    /// Mean of texture `index`, which stands in `field`, and what to call it.
    pub fn mean(&mut self, index: usize, field: &str) -> Result<(Mean, String)> {
        let texture = self.file.item(&self.document.textures, "textures", index, field)?;
        let path = format!("textures[{index}].source");
        let Some(source) = texture.source else {
            return Err(self.file.bad(path, "none", "a PNG or JPEG image"));
        };
        let image = self.file.item(&self.document.images, "images", source, &path)?;
        let name = image.name.clone().or_else(|| texture.name.clone()).unwrap_or_else(|| format!("images[{source}]"));
        if let Some(&mean) = self.means.get(&source) {
            return Ok((mean, name));
        }
        let bytes = self.bytes(source)?;
        let mean = decode(&bytes).map_err(|reason| {
            self.file.bad(format_args!("images[{source}]"), &name, format!("a PNG or JPEG image ({reason})"))
        })?;
        self.means.insert(source, mean);
        Ok((mean, name))
    }

    /// The encoded bytes of image `index`.
    fn bytes(&mut self, index: usize) -> Result<Vec<u8>> {
        let image = &self.document.images[index];
        let path = format!("images[{index}]");
        match (&image.uri, image.buffer_view) {
            (Some(uri), None) => uri::resolve(self.file, &format!("{path}.uri"), uri, &mut *self.fetch),
            (None, Some(view)) => Ok(self.buffers.view(view, &format!("{path}.bufferView"))?.to_vec()),
            _ => Err(self.file.bad(path, "no source or two", "either `uri` or `bufferView`")),
        }
    }
}

/// Mean of an encoded image, or why it cannot be had.
fn decode(bytes: &[u8]) -> std::result::Result<Mean, String> {
    let histogram = match bytes {
        [0x89, b'P', b'N', b'G', ..] => png(bytes)?,
        [0xff, 0xd8, 0xff, ..] => jpeg(bytes)?,
        _ => return Err("it is in another format".to_owned()),
    };
    Ok(histogram.mean())
}

/// Counts the pixels of a PNG row by row, so that memory does not grow with the size it claims.
fn png(bytes: &[u8]) -> std::result::Result<Histogram, String> {
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(|error| error.to_string())?;
    let (width, height) = reader.info().size();
    check_size(width.into(), height.into())?;
    let (colour, depth) = reader.output_color_type();
    let grey = matches!(colour, png::ColorType::Grayscale | png::ColorType::GrayscaleAlpha);
    // EXPAND leaves no other depths.
    let (sample, levels) = if depth == png::BitDepth::Sixteen { (2, 1 << 16) } else { (1, 1 << 8) };
    let mut histogram = Histogram::new(levels);
    let mut counted = 0;
    while let Some(row) = reader.next_row().map_err(|error| error.to_string())? {
        for pixel in row.data().chunks_exact(colour.samples() * sample) {
            histogram.count([0, 1, 2].map(|channel| {
                let at = if grey { 0 } else { channel * sample };
                pixel[at..at + sample].iter().fold(0, |value, &byte| value << 8 | usize::from(byte))
            }));
            counted += 1;
        }
    }
    // An interlaced image passes every pixel once, in another order.
    (counted == u64::from(width) * u64::from(height)).then_some(histogram).ok_or_else(|| "it is incomplete".to_owned())
}

/// Counts the pixels of a JPEG.
fn jpeg(bytes: &[u8]) -> std::result::Result<Histogram, String> {
    // Strict: otherwise a truncated image ends in grey without a word.
    let options = DecoderOptions::new_safe().set_strict_mode(true).jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(|error| error.to_string())?;
    let size = decoder.info().ok_or("it has no header")?;
    check_size(size.width.into(), size.height.into())?;
    let pixels = decoder.decode().map_err(|error| error.to_string())?;
    let mut histogram = Histogram::new(1 << 8);
    for pixel in pixels.chunks_exact(3) {
        histogram.count([pixel[0], pixel[1], pixel[2]].map(usize::from));
    }
    Ok(histogram)
}

/// Refuses images without pixels and those beyond [`MAX_PIXELS`].
fn check_size(width: u64, height: u64) -> std::result::Result<(), String> {
    match width.checked_mul(height) {
        Some(1..=MAX_PIXELS) => Ok(()),
        _ => Err(format!("it has {width} x {height} pixels, allowed are 1 .. {MAX_PIXELS}")),
    }
}

/// How often each value occurs in each channel.
struct Histogram {
    counts: [Vec<u64>; 3],
}

impl Histogram {
    /// Of an image whose values are below `levels`.
    fn new(levels: usize) -> Self {
        Histogram { counts: std::array::from_fn(|_| vec![0; levels]) }
    }

    /// Counts one pixel.
    fn count(&mut self, pixel: [usize; 3]) {
        for (counts, value) in self.counts.iter_mut().zip(pixel) {
            counts[value] += 1;
        }
    }

    /// Mean of what was counted, at least one pixel.
    fn mean(&self) -> Mean {
        let of = |f: fn(f64) -> f64| [0, 1, 2].map(|channel| mean_of(&self.counts[channel], f));
        Mean { colour: of(linear), stored: of(|value| value) }
    }
}

/// Mean of `f(value / full scale)` over the counts of a channel.
fn mean_of(counts: &[u64], f: fn(f64) -> f64) -> f64 {
    let full = (counts.len() - 1) as f64;
    let seen = counts.iter().enumerate().filter(|&(_, &count)| count > 0);
    let sum: f64 = seen.map(|(value, &count)| count as f64 * f(value as f64 / full)).sum();
    (sum / counts.iter().sum::<u64>() as f64).min(1.0)
}

/// Linear value of the sRGB value `s` (IEC 61966-2-1).
fn linear(s: f64) -> f64 {
    if s <= 0.04045 { s / 12.92 } else { pow((s + 0.055) / 1.055, 2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_ends_are_exact_and_half_is_0_214() {
        assert_eq!((linear(0.0), linear(1.0)), (0.0, 1.0));
        assert!((linear(0.5) - 0.214_041_140_482).abs() < 1e-12);
    }

    #[test]
    fn sizes_that_do_not_fit_are_refused() {
        assert!(check_size(8192, 8192).is_ok());
        assert!(check_size(8193, 8192).is_err());
        assert!(check_size(0, 5).is_err());
        assert!(check_size(u64::MAX, 2).is_err());
    }
}
