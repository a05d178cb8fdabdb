//! Square views side by side: shaded surfaces in grey, and numbers on them in colours with their scale.

use super::canvas::{Canvas, Font, Rgb};
use super::number::label;
use super::scale::Scale;
use crate::error::Result;
use crate::farm::durable::replace;
use std::path::Path;

const MARGIN: u32 = 12;
const TITLE: u32 = 30;
const LINE: u32 = 18;
const BAR_WIDTH: u32 = 16;
/// Room for a bar and its labels \[pixels\].
const BAR_ROOM: u32 = 100;
const BLACK: Rgb = [0, 0, 0];
const BACKGROUND: Rgb = [255, 255, 255];

/// A square of numbers, row 0 on top; NaN where nothing is.
pub struct View {
    title: String,
    pixels: Vec<f64>,
    scale: Option<Scale>,
    words: String,
}

impl View {
    /// Brightness between 0 and 1, in grey.
    pub fn shaded(title: String, pixels: Vec<f64>) -> View {
        View { title, pixels, scale: None, words: String::new() }
    }

    /// Magnitudes in `unit`, in colours.
    pub fn measured(title: String, unit: &str, pixels: Vec<f64>) -> View {
        let scale = Scale::up_to(pixels.iter().copied().fold(0.0, f64::max), colorous::VIRIDIS);
        let words = scale.words(unit);
        View { title, pixels, scale: Some(scale), words }
    }

    fn colour(&self, pixel: f64) -> Rgb {
        match &self.scale {
            _ if pixel.is_nan() => BACKGROUND,
            Some(scale) => scale.colour(pixel),
            // The inverse of the display's curve, nearly: equal steps of light are not equal steps of numbers.
            None => [(255.0 * pixel.clamp(0.0, 1.0).sqrt()).round() as u8; 3],
        }
    }

    fn draw(&self, canvas: &mut Canvas, at: [u32; 2], side: u32) {
        canvas.text([at[0], at[1] - LINE], &self.title, Font::Small);
        canvas.frame(at, [side, side], BLACK);
        for (i, &pixel) in (0u32..).zip(&self.pixels) {
            canvas.fill([at[0] + i % side, at[1] + i / side], [1, 1], self.colour(pixel));
        }
        if let Some(scale) = &self.scale {
            draw_bar(canvas, scale, [at[0] + side + MARGIN, at[1]], side);
            canvas.text([at[0], at[1] + side + 4], &self.words, Font::Small);
        }
    }
}

fn draw_bar(canvas: &mut Canvas, scale: &Scale, at: [u32; 2], height: u32) {
    let last = f64::from(height - 1);
    for y in 0..height {
        canvas.fill([at[0], at[1] + y], [BAR_WIDTH, 1], scale.colour_at(1.0 - f64::from(y) / last));
    }
    canvas.frame(at, [BAR_WIDTH, height], BLACK);
    for tick in scale.ticks() {
        let y = at[1] + (last * (1.0 - scale.position(tick))).round() as u32;
        canvas.fill([at[0] + BAR_WIDTH, y], [4, 1], BLACK);
        canvas.text([at[0] + BAR_WIDTH + 7, y - Font::Small.height() / 2], &label(tick), Font::Small);
    }
}

/// Writes `views`, `side` pixels wide and high, as one PNG to `path`.
///
/// # Errors
/// [`crate::error::Error::Io`].
pub fn write_views(path: &Path, title: &str, side: u32, views: &[View]) -> Result<()> {
    let count = views.len() as u32;
    let mut canvas = Canvas::new(count * (side + MARGIN) + MARGIN + BAR_ROOM, TITLE + 2 * LINE + side + 2 * MARGIN);
    canvas.text([MARGIN, MARGIN], title, Font::Title);
    for (i, view) in (0u32..).zip(views) {
        view.draw(&mut canvas, [MARGIN + i * (side + MARGIN), TITLE + LINE + MARGIN], side);
    }
    replace(path, |to| canvas.write_png(to))
}
