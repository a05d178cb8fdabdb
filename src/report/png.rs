//! False-colour pictures: the map and, beside or below it, its relative standard error, each with its scale.
//!
//! Every bin is a rectangle of whole pixels, so that small maps are legible; the cells of a grid keep their shape
//! as nearly as whole pixels can. Row 0 is on top, as in the files. Grey means that there is no number.

use super::canvas::{Canvas, Font, Rgb};
use super::missing_text;
use super::number::{label, short};
use super::scale::{NOTHING, Scale};
use super::values::{SetValues, kind_name};
use crate::farm::merge::Merged;
use crate::farm::plan::Plan;
use crate::job::{ReceiverKind, SetShape};
use crate::tally::health::FEW_BATCHES;
use std::io::{Result, Write};

/// Upper left pixel of the first map in every picture.
pub const MAP_ORIGIN: [u32; 2] = [13, 74];

/// Small maps are enlarged towards this many pixels on their long side.
const LONG_SIDE: u32 = 400;
/// A line of bins is drawn at least this wide \[pixels\].
const SHORT_SIDE: u32 = 24;
/// Maps beyond this many bins on a side show every second, third, ... of them.
const LARGEST_SIDE: u32 = 2000;
/// Two panels stand side by side up to this width \[pixels\], else one below the other.
const WIDEST: u32 = 1500;
/// Shortest scale bar \[pixels\].
const BAR_HEIGHT: u32 = 200;
const BAR_WIDTH: u32 = 16;
const MARGIN: u32 = 12;
const LINE: u32 = 16;
const BLACK: Rgb = [0, 0, 0];

/// Writes the picture of `values` to `to`.
pub(super) fn write(plan: &Plan, merged: &Merged, values: &SetValues, to: &mut impl Write) -> Result<()> {
    let (quantity, unit) = match values.shape.kind {
        ReceiverKind::Camera | ReceiverKind::Gonio | ReceiverKind::Region => ("luminance", "cd/m²"),
        ReceiverKind::Grid | ReceiverKind::Point => ("illuminance", "lx"),
    };
    let zoom = Zoom::new(&values.shape, cell_shape(plan, values));
    let drawn = Drawn::new(values, &zoom)?;
    let value = Panel::new(format!("{quantity} [{unit}]"), unit, drawn.values, colorous::INFERNO);
    let error = Panel::new("relative standard error [%]".to_owned(), "%", drawn.errors, colorous::VIRIDIS);
    let title = format!("{}: {} {}", plan.name, kind_name(values.shape.kind), values.shape.name);
    let picture = Picture {
        title,
        subtitle: subtitle(plan, merged),
        panels: [value, error],
        remarks: remarks(merged, values, &zoom, drawn.grey),
        zoom,
    };
    picture.draw(&values.shape).write_png(to)
}

/// The bins that are drawn, however large the map.
struct Drawn {
    values: Numbers,
    /// Relative standard errors \[%\].
    errors: Numbers,
    /// True when some bin, drawn or not, has no error.
    grey: bool,
}

/// Numbers of one panel.
struct Numbers {
    /// Of the bins drawn, row by row.
    drawn: Vec<f64>,
    /// Least and largest finite one of all bins.
    extremes: [f64; 2],
}

impl Numbers {
    fn take(&mut self, number: f64, drawn: bool) {
        if drawn {
            self.drawn.push(number);
        }
        if number.is_finite() {
            self.extremes = [self.extremes[0].min(number), self.extremes[1].max(number)];
        }
    }
}

impl Drawn {
    fn new(values: &SetValues, zoom: &Zoom) -> Result<Self> {
        let none = || Numbers { drawn: Vec::new(), extremes: [f64::NAN; 2] };
        let mut all = Drawn { values: none(), errors: none(), grey: false };
        let (width, step) = (values.shape.width as usize, zoom.step as usize);
        values.each(|i, bin| {
            let drawn = (i / width).is_multiple_of(step) && (i % width).is_multiple_of(step);
            all.values.take(bin.value, drawn);
            all.errors.take(100.0 * bin.relative_error, drawn);
            all.grey |= bin.relative_error.is_nan();
            Ok(())
        })?;
        Ok(all)
    }
}

/// Height over width of a cell as it lies in space; 1 for pixels and directions.
fn cell_shape(plan: &Plan, values: &SetValues) -> f64 {
    let Some(grid) = plan.job.grids.iter().find(|g| g.name == values.shape.name) else { return 1.0 };
    let length = |v: [f64; 3]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    let shape = length(grid.v) / f64::from(grid.rows) / (length(grid.u) / f64::from(grid.columns));
    // A grid may be a line or a point.
    if shape.is_finite() && shape > 0.0 { shape } else { 1.0 }
}

fn subtitle(plan: &Plan, merged: &Merged) -> String {
    let run = &plan.job.run;
    format!("{} batches of {} histories, seed {}", merged.batches, run.histories_per_batch, run.seed)
}

/// What a reader must know, one line each.
fn remarks(merged: &Merged, values: &SetValues, zoom: &Zoom, grey: bool) -> Vec<String> {
    let [width, height] = [values.shape.width, values.shape.height];
    let mut remarks = vec![match values.shape.kind {
        ReceiverKind::Camera => format!("{width} x {height} pixels, row 0 on top"),
        ReceiverKind::Gonio => {
            format!("{width} x {height} directions: +Y on top, -Z in the centre, +X right of it")
        }
        _ => format!("{width} x {height} points: columns along u to the right, rows along v downwards, row 0 on top"),
    }];
    if zoom.step > 1 {
        remarks.push(format!("one of {} bins drawn in each direction", zoom.step));
    }
    if grey {
        remarks.push("grey: no receiver or no information".to_owned());
    }
    if merged.batches < FEW_BATCHES {
        remarks.push(format!("few batches: errors are uncertain below {FEW_BATCHES}"));
    }
    if !merged.missing.is_empty() {
        remarks.push(format!("incomplete: batches {} are missing", missing_text(merged)));
    }
    remarks
}

/// How many pixels a bin takes, and which bins are drawn.
struct Zoom {
    cell: [u32; 2],
    step: u32,
}

impl Zoom {
    fn new(set: &SetShape, shape: f64) -> Self {
        let bins = [set.width, set.height];
        let step = bins[0].max(bins[1]).div_ceil(LARGEST_SIDE);
        let bins = bins.map(|n| n.div_ceil(step));
        let fit = |side: f64, n: u32| (side.round() as u32).clamp(SHORT_SIDE.div_ceil(n), (2 * LONG_SIDE / n).max(1));
        let wide = f64::from(bins[0]) >= f64::from(bins[1]) * shape;
        let unit = LONG_SIDE / if wide { bins[0] } else { bins[1] };
        let unit = f64::from(unit.max(1));
        let cell = if wide { [unit, unit * shape] } else { [unit / shape, unit] };
        Zoom { cell: [fit(cell[0], bins[0]), fit(cell[1], bins[1])], step }
    }

    /// Pixels of the whole map.
    fn size(&self, set: &SetShape) -> [u32; 2] {
        let bins = [set.width, set.height];
        std::array::from_fn(|i| bins[i].div_ceil(self.step) * self.cell[i])
    }
}

/// One map with its scale bar.
struct Panel {
    title: String,
    /// Of the bins drawn.
    numbers: Vec<f64>,
    scale: Scale,
    labels: Vec<String>,
    words: String,
    extremes: String,
}

impl Panel {
    fn new(title: String, unit: &str, numbers: Numbers, gradient: colorous::Gradient) -> Self {
        let Numbers { drawn: numbers, extremes: [least, most] } = numbers;
        // An error is small or large against nothing; a value may vary little around a large mean.
        let scale = Scale::fit(numbers.iter().copied().filter(|x| x.is_finite()), gradient, unit == "%");
        let labels = scale.ticks().into_iter().map(label).collect();
        let extremes = format!("{} .. {} {unit} found", short(least, 4), short(most, 4));
        Panel { title, numbers, labels, words: scale.words(unit), extremes, scale }
    }

    /// Size of the map, the bar and the words around them.
    fn size(&self, map: [u32; 2]) -> [u32; 2] {
        let labels = self.labels.iter().map(|l| Font::Small.width(l)).max().unwrap_or(0);
        let lines = [&self.title, &self.words, &self.extremes];
        let words = lines.iter().map(|l| Font::Small.width(l)).max().unwrap_or(0);
        let width = (map[0] + MARGIN + BAR_WIDTH + 8 + labels).max(words);
        [width, LINE + map[1].max(BAR_HEIGHT) + 8 + 2 * LINE]
    }

    fn draw(&self, canvas: &mut Canvas, at: [u32; 2], set: &SetShape, zoom: &Zoom) {
        canvas.text(at, &self.title, Font::Small);
        let map = zoom.size(set);
        let top = [at[0], at[1] + LINE];
        self.draw_map(canvas, top, set, zoom);
        canvas.frame(top, map, BLACK);
        let height = map[1].max(BAR_HEIGHT);
        self.draw_bar(canvas, [top[0] + map[0] + MARGIN, top[1]], height);
        canvas.text([at[0], top[1] + height + 8], &self.words, Font::Small);
        canvas.text([at[0], top[1] + height + 8 + LINE], &self.extremes, Font::Small);
    }

    fn draw_map(&self, canvas: &mut Canvas, at: [u32; 2], set: &SetShape, zoom: &Zoom) {
        let [wide, tall] = zoom.cell;
        let rows = self.numbers.chunks(set.width.div_ceil(zoom.step) as usize);
        for (y, row) in (0u32..).zip(rows) {
            for (x, &number) in (0u32..).zip(row) {
                let colour = self.scale.colour(number);
                canvas.fill([at[0] + x * wide, at[1] + y * tall], [wide, tall], colour);
            }
        }
    }

    fn draw_bar(&self, canvas: &mut Canvas, at: [u32; 2], height: u32) {
        let last = f64::from(height - 1);
        for y in 0..height {
            let colour = self.scale.colour_at(1.0 - f64::from(y) / last);
            canvas.fill([at[0], at[1] + y], [BAR_WIDTH, 1], colour);
        }
        canvas.frame(at, [BAR_WIDTH, height], BLACK);
        for (tick, label) in self.scale.ticks().into_iter().zip(&self.labels) {
            let y = at[1] + (last * (1.0 - self.scale.position(tick))).round() as u32;
            canvas.fill([at[0] + BAR_WIDTH, y], [4, 1], BLACK);
            canvas.text([at[0] + BAR_WIDTH + 7, y - Font::Small.height() / 2], label, Font::Small);
        }
    }
}

/// A whole picture.
struct Picture {
    title: String,
    subtitle: String,
    panels: [Panel; 2],
    remarks: Vec<String>,
    zoom: Zoom,
}

impl Picture {
    fn draw(&self, set: &SetShape) -> Canvas {
        let map = self.zoom.size(set);
        let sizes = [0, 1].map(|i| self.panels[i].size(map));
        let (places, [right, bottom]) = place(sizes);
        let top = bottom + 6;
        let texts = self.remarks.iter().chain([&self.subtitle]).map(|t| Font::Small.width(t));
        let words = texts.chain([Font::Title.width(&self.title)]).max().unwrap_or(0);
        let width = right.max(MAP_ORIGIN[0] + words) + MARGIN;
        let mut canvas = Canvas::new(width, top + MARGIN + self.remarks.len() as u32 * LINE);
        canvas.text([MAP_ORIGIN[0], MARGIN], &self.title, Font::Title);
        canvas.text([MAP_ORIGIN[0], MARGIN + 22], &self.subtitle, Font::Small);
        for (panel, at) in self.panels.iter().zip(places) {
            panel.draw(&mut canvas, at, set, &self.zoom);
        }
        for (i, remark) in (0u32..).zip(&self.remarks) {
            canvas.text([MAP_ORIGIN[0], top + i * LINE], remark, Font::Small);
        }
        self.mark_grey(&mut canvas, top);
        canvas
    }

    /// Draws a patch of grey behind the remark that explains it, if there is one.
    fn mark_grey(&self, canvas: &mut Canvas, top: u32) {
        let Some(i) = self.remarks.iter().position(|r| r.starts_with("grey")) else { return };
        let at = [MAP_ORIGIN[0] + Font::Small.width(&self.remarks[i]) + 8, top + i as u32 * LINE + 2];
        canvas.fill(at, [10, 10], NOTHING);
        canvas.frame(at, [10, 10], BLACK);
    }
}

/// Upper left corners of two panels of these sizes, side by side or one below the other, and their common end.
fn place(sizes: [[u32; 2]; 2]) -> ([[u32; 2]; 2], [u32; 2]) {
    let first = [MAP_ORIGIN[0], MAP_ORIGIN[1] - LINE];
    let beside = [first[0] + sizes[0][0] + 3 * MARGIN, first[1]];
    let second = if beside[0] + sizes[1][0] <= WIDEST { beside } else { [first[0], first[1] + sizes[0][1] + MARGIN] };
    let end = |i: usize| (first[i] + sizes[0][i]).max(second[i] + sizes[1][i]);
    ([first, second], [end(0), end(1)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::Kept;

    /// Pixels of a cell, of the whole map, and the step between bins drawn.
    fn zoom(width: u32, height: u32, shape: f64) -> ([u32; 2], [u32; 2], u32) {
        let kept = Kept::Moments { colour: false };
        let shape_of_set =
            SetShape { name: "x".into(), kind: ReceiverKind::Grid, width, height, kept, monitored: Vec::new() };
        let zoom = Zoom::new(&shape_of_set, shape);
        (zoom.cell, zoom.size(&shape_of_set), zoom.step)
    }

    #[test]
    fn bins_become_rectangles_of_whole_pixels() {
        assert_eq!(zoom(256, 256, 1.0), ([1, 1], [256, 256], 1));
        assert_eq!(zoom(64, 32, 1.0), ([6, 6], [384, 192], 1));
        // 6 x 4 m in 32 x 32 cells keep their shape.
        assert_eq!(zoom(32, 32, 4.0 / 6.0), ([12, 8], [384, 256], 1));
        assert_eq!(zoom(10, 40, 1.0), ([10, 10], [100, 400], 1));
        // A line is drawn thick enough to be seen, a needle no longer than twice the usual side.
        assert_eq!(zoom(61, 1, 1.0), ([6, 24], [366, 24], 1));
        assert_eq!(zoom(1, 1, 1e9), ([24, 400], [24, 400], 1));
        assert_eq!(zoom(1200, 300, 1.0), ([1, 1], [1200, 300], 1));
        assert_eq!(zoom(5000, 4001, 1.0), ([1, 1], [1667, 1334], 3));
        assert_eq!(zoom(65536, 1, 1e-6).2, 33);
    }

    #[test]
    fn panels_stand_side_by_side_while_they_fit() {
        let [x, y] = [MAP_ORIGIN[0], MAP_ORIGIN[1] - LINE];
        assert_eq!(place([[400, 300], [450, 310]]).0, [[x, y], [x + 436, y]]);
        assert_eq!(place([[1300, 300], [1310, 300]]), ([[x, y], [x, y + 312]], [x + 1310, y + 612]));
    }
}
