//! PNG and JPEG bytes to texels; any other bytes to a reason.
//!
//! The JPEG decoder is built without its CPU-specific paths: same bits everywhere.

use std::io::Cursor;

use zune_core::bytestream::ZCursor;
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;

use crate::scene::textures::{Image, Texels};

/// Most pixels of an image (8192 x 8192): a small file may claim any size.
const MAX_PIXELS: u64 = 1 << 26;

type Decoded<T> = Result<T, String>;

/// The image in `bytes`, or why it cannot be had.
pub fn decode(bytes: &[u8]) -> Decoded<Image> {
    match bytes {
        [] => Err("it is empty".to_owned()),
        [0x89, b'P', b'N', b'G', ..] => png(bytes),
        [0xff, 0xd8, 0xff, ..] => jpeg(bytes),
        [0xab, b'K', b'T', b'X', ..] => Err(other("KTX2")),
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Err(other("WebP")),
        [_, _, _, _, b'f', b't', b'y', b'p', b'a', b'v', b'i', b'f', ..] => Err(other("AVIF")),
        [b'D', b'D', b'S', b' ', ..] => Err(other("DDS")),
        _ => Err("it is in another format".to_owned()),
    }
}

fn other(format: &str) -> String {
    format!("it is {format}: export the scene with PNG or JPEG textures")
}

/// Reads a PNG row by row, so that memory grows with the rows that are there, not with the size it claims.
fn png(bytes: &[u8]) -> Decoded<Image> {
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(|error| error.to_string())?;
    let (width, height) = reader.info().size();
    check_size(width.into(), height.into())?;
    if reader.info().interlaced {
        // Rows come in another order: only a whole frame puts them right.
        return interlaced(reader, width as usize);
    }
    let kind = reader.output_color_type();
    let mut texels = empty(kind.1);
    while let Some(row) = reader.next_row().map_err(|error| error.to_string())? {
        append(&mut texels, kind, row.data());
    }
    whole(width, height, texels)
}

/// Reads an interlaced PNG.
fn interlaced(mut reader: png::Reader<Cursor<&[u8]>>, width: usize) -> Decoded<Image> {
    let size = reader.output_buffer_size().ok_or("it is too large")?;
    let mut frame = vec![0; size];
    let info = reader.next_frame(&mut frame).map_err(|error| error.to_string())?;
    let mut texels = empty(info.bit_depth);
    append(&mut texels, (info.color_type, info.bit_depth), &frame[..info.buffer_size()]);
    whole(width as u32, info.height, texels)
}

/// No texels yet. EXPAND leaves no depths but 8 and 16 bits.
fn empty(depth: png::BitDepth) -> Texels {
    match depth {
        png::BitDepth::Sixteen => Texels::Sixteen(Vec::new()),
        _ => Texels::Eight(Vec::new()),
    }
}

/// Appends the pixels in `data` to `texels`.
fn append(texels: &mut Texels, (colour, _): (png::ColorType, png::BitDepth), data: &[u8]) {
    let samples = colour.samples();
    match texels {
        Texels::Eight(texels) => texels.extend(data.chunks_exact(samples).map(|p| filled(p, u8::MAX))),
        Texels::Sixteen(texels) => {
            let value = |p: &[u8], i: usize| u16::from_be_bytes([p[2 * i], p[2 * i + 1]]);
            texels.extend(data.chunks_exact(2 * samples).map(|p| {
                let all = [0, 1, 2, 3].map(|i| if i < samples { value(p, i) } else { 0 });
                filled(&all[..samples], u16::MAX)
            }));
        }
    }
}

/// Red, green, blue and alpha of one to four samples; without alpha it is `opaque`.
fn filled<T: Copy>(samples: &[T], opaque: T) -> [T; 4] {
    match *samples {
        [grey] => [grey, grey, grey, opaque],
        [grey, alpha] => [grey, grey, grey, alpha],
        [r, g, b] => [r, g, b, opaque],
        [r, g, b, alpha, ..] => [r, g, b, alpha],
        [] => unreachable!("every pixel has a sample"),
    }
}

/// The pixels of a JPEG.
fn jpeg(bytes: &[u8]) -> Decoded<Image> {
    // Strict: otherwise a truncated image ends in grey without a word.
    let options = DecoderOptions::new_safe().set_strict_mode(true).jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(|error| error.to_string())?;
    let size = decoder.info().ok_or("it has no header")?;
    check_size(size.width.into(), size.height.into())?;
    let pixels = decoder.decode().map_err(|error| error.to_string())?;
    let texels = pixels.chunks_exact(3).map(|p| filled(p, u8::MAX)).collect();
    whole(size.width.into(), size.height.into(), Texels::Eight(texels))
}

fn whole(width: u32, height: u32, texels: Texels) -> Decoded<Image> {
    let image = Image::new(width as usize, texels).filter(|image| image.size()[1] == height as usize);
    image.ok_or_else(|| "it is incomplete".to_owned())
}

/// Refuses images without pixels and those beyond [`MAX_PIXELS`].
fn check_size(width: u64, height: u64) -> Decoded<()> {
    match width.checked_mul(height) {
        Some(1..=MAX_PIXELS) => Ok(()),
        _ => Err(format!("it has {width} x {height} pixels, allowed are 1 .. {MAX_PIXELS}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_that_do_not_fit_are_refused() {
        assert!(check_size(8192, 8192).is_ok());
        assert!(check_size(8193, 8192).is_err());
        assert!(check_size(0, 5).is_err());
        assert!(check_size(u64::MAX, 2).is_err());
    }
}
