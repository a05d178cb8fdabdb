//! A picture in memory: an RGB buffer on which `embedded-graphics` draws text and rectangles.

use embedded_graphics::mono_font::iso_8859_1::{FONT_7X13, FONT_9X18_BOLD};
use embedded_graphics::mono_font::{MonoFont, MonoTextStyle};
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::{DrawTarget, Drawable, OriginDimensions, Pixel, Point, RgbColor, Size};
use embedded_graphics::text::{Baseline, Text};
use std::convert::Infallible;
use std::io::{Result, Write};

/// Red, green, blue as displayed (sRGB).
pub(super) type Rgb = [u8; 3];

/// Size of a text.
#[derive(Clone, Copy)]
pub(super) enum Font {
    /// Labels and remarks.
    Small,
    /// Titles.
    Title,
}

impl Font {
    fn mono(self) -> &'static MonoFont<'static> {
        match self {
            Font::Small => &FONT_7X13,
            Font::Title => &FONT_9X18_BOLD,
        }
    }

    /// Width of `text` \[pixels\].
    pub fn width(self, text: &str) -> u32 {
        text.chars().count() as u32 * self.mono().character_size.width
    }

    /// Height of a line \[pixels\].
    pub fn height(self) -> u32 {
        self.mono().character_size.height
    }
}

/// An RGB picture, row 0 on top.
pub(super) struct Canvas {
    width: u32,
    height: u32,
    rgb: Vec<u8>,
}

impl Canvas {
    /// A white canvas.
    pub fn new(width: u32, height: u32) -> Self {
        Canvas { width, height, rgb: vec![255; width as usize * height as usize * 3] }
    }

    /// Colours the rectangle of `size` pixels whose upper left corner is `at`; what lies outside is cut off.
    pub fn fill(&mut self, at: [u32; 2], size: [u32; 2], colour: Rgb) {
        let right = (at[0] + size[0]).min(self.width);
        for y in at[1]..(at[1] + size[1]).min(self.height) {
            for x in at[0]..right {
                self.set(x, y, colour);
            }
        }
    }

    /// Draws a frame of one pixel just outside the rectangle of `size` pixels at `at`.
    pub fn frame(&mut self, at: [u32; 2], size: [u32; 2], colour: Rgb) {
        let (left, top) = (at[0] - 1, at[1] - 1);
        let (wide, tall) = (size[0] + 2, size[1] + 2);
        self.fill([left, top], [wide, 1], colour);
        self.fill([left, top + tall - 1], [wide, 1], colour);
        self.fill([left, top], [1, tall], colour);
        self.fill([left + wide - 1, top], [1, tall], colour);
    }

    /// Draws a line through `points`, given in pixels, `width` pixels wide and smooth at its edges.
    pub fn stroke(&mut self, points: &[[f64; 2]], width: f64, colour: Rgb) {
        for pair in points.windows(2) {
            self.segment([pair[0], pair[1]], 0.5 * width, colour);
        }
    }

    fn segment(&mut self, [a, b]: [[f64; 2]; 2], half: f64, colour: Rgb) {
        let reach = |axis: usize, size: u32| {
            let (low, high) = (a[axis].min(b[axis]) - half - 1.0, a[axis].max(b[axis]) + half + 1.0);
            (low.max(0.0) as u32, (high.max(0.0) as u32 + 1).min(size))
        };
        let ((left, right), (top, bottom)) = (reach(0, self.width), reach(1, self.height));
        for (x, y) in (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y))) {
            let distance = distance([f64::from(x) + 0.5, f64::from(y) + 0.5], a, b);
            self.blend(x, y, colour, (half + 0.5 - distance).clamp(0.0, 1.0));
        }
    }

    /// Lays `colour` over the pixel, of which it covers the share `cover`.
    fn blend(&mut self, x: u32, y: u32, colour: Rgb, cover: f64) {
        let at = (y as usize * self.width as usize + x as usize) * 3;
        for (below, above) in self.rgb[at..at + 3].iter_mut().zip(colour) {
            *below = (f64::from(*below) + cover * (f64::from(above) - f64::from(*below))).round() as u8;
        }
    }

    /// Writes `text` in black, its upper left corner at `at`.
    pub fn text(&mut self, at: [u32; 2], text: &str, font: Font) {
        let style = MonoTextStyle::new(font.mono(), Rgb888::BLACK);
        let at = Point::new(at[0] as i32, at[1] as i32);
        let drawn: std::result::Result<_, Infallible> = Text::with_baseline(text, at, style, Baseline::Top).draw(self);
        drawn.expect("drawing into memory cannot fail");
    }

    /// Writes the picture as PNG.
    pub fn write_png(&self, to: &mut impl Write) -> Result<()> {
        let mut encoder = ::png::Encoder::new(to, self.width, self.height);
        encoder.set_color(::png::ColorType::Rgb);
        encoder.set_depth(::png::BitDepth::Eight);
        encoder.set_source_srgb(::png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.rgb)?;
        Ok(writer.finish()?)
    }

    fn set(&mut self, x: u32, y: u32, colour: Rgb) {
        let at = (y as usize * self.width as usize + x as usize) * 3;
        self.rgb[at..at + 3].copy_from_slice(&colour);
    }
}

/// Distance of `p` from the segment from `a` to `b`.
fn distance(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let (along, to) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let square = along[0] * along[0] + along[1] * along[1];
    let share = if square > 0.0 { (along[0] * to[0] + along[1] * to[1]) / square } else { 0.0 };
    let share = share.clamp(0.0, 1.0);
    let off = [to[0] - share * along[0], to[1] - share * along[1]];
    (off[0] * off[0] + off[1] * off[1]).sqrt()
}

impl OriginDimensions for Canvas {
    fn size(&self) -> Size {
        Size::new(self.width, self.height)
    }
}

impl DrawTarget for Canvas {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I>(&mut self, pixels: I) -> std::result::Result<(), Infallible>
    where
        I: IntoIterator<Item = Pixel<Rgb888>>,
    {
        for Pixel(at, colour) in pixels {
            let (Ok(x), Ok(y)) = (u32::try_from(at.x), u32::try_from(at.y)) else { continue };
            if x < self.width && y < self.height {
                self.set(x, y, [colour.r(), colour.g(), colour.b()]);
            }
        }
        Ok(())
    }
}
