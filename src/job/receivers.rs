//! Receiver sets of a job: what they are called, how many bins they have, where a bin lies.

use super::Channels;
use serde::{Deserialize, Serialize};

/// `[[camera]]`: luminance map by double local estimation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Name of the map and of its files.
    pub name: String,
    /// A camera node of the scene; or `eye`, `target`, `up`, `vertical_fov_degrees`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub node: Option<String>,
    /// Position of the eye \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub eye: Option<[f64; 3]>,
    /// Point in the centre of the picture \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<[f64; 3]>,
    /// Direction that points up in the picture; +Y when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<[f64; 3]>,
    /// Vertical field of view \[degrees\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertical_fov_degrees: Option<f64>,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Positions in a pixel and batch: 1, 4, 9 or 16, one in each stratum.
    #[serde(default = "four")]
    pub pixel_samples: u32,
    /// Bins, as \[column, row\], whose single histories are watched for the health of their intervals.
    #[serde(default)]
    pub monitor: Vec<[u32; 2]>,
}

/// Where a camera without a node stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Position of the eye \[m\].
    pub eye: [f64; 3],
    /// Point in the centre of the picture \[m\].
    pub target: [f64; 3],
    /// Direction that points up in the picture.
    pub up: [f64; 3],
    /// Vertical field of view \[degrees\].
    pub vertical_fov_degrees: f64,
}

/// `[[grid]]`: illuminance by local estimation at cell centres, row-major, u fastest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    /// Name of the grid and of its files.
    pub name: String,
    /// Corner of cell (0, 0) \[m\].
    pub origin: [f64; 3],
    /// Edge along a row \[m\].
    pub u: [f64; 3],
    /// Edge along a column \[m\].
    pub v: [f64; 3],
    /// Direction that the lux-meters face; normalised here, need not be u x v.
    pub normal: [f64; 3],
    /// Cells along u.
    pub columns: u32,
    /// Cells along v.
    pub rows: u32,
    /// Keep every batch's score (variance of the variance, jackknife) or moments only.
    #[serde(default = "yes")]
    pub keep_batches: bool,
    /// Bins, as \[column, row\], whose single histories are watched for the health of their intervals.
    #[serde(default)]
    pub monitor: Vec<[u32; 2]>,
}

/// `[[point]]`: one lux-meter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// Name of the lux-meter.
    pub name: String,
    /// Position \[m\].
    pub position: [f64; 3],
    /// Direction that it faces.
    pub normal: [f64; 3],
}

/// `[[gonio]]`: luminance at one point in many directions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gonio {
    /// Name of the map and of its files.
    pub name: String,
    /// The point \[m\].
    pub position: [f64; 3],
    /// False: luminance seen from the free point. True: luminance leaving the surface point found there.
    #[serde(default)]
    pub surface: bool,
    /// Normal of the surface point; only with `surface = true`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal: Option<[f64; 3]>,
    /// Directions along the equator.
    pub width: u32,
    /// Directions from pole to pole.
    pub height: u32,
    /// Directions in a texel and batch: 1, 4, 9 or 16, one in each stratum.
    #[serde(default = "four")]
    pub pixel_samples: u32,
    /// Bins, as \[column, row\], whose single histories are watched for the health of their intervals.
    #[serde(default)]
    pub monitor: Vec<[u32; 2]>,
}

/// `[[region]]`: mean luminance of a part of a camera's map, one number a batch.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Name of the region.
    pub name: String,
    /// Name of the camera.
    pub camera: String,
    /// First column, first row, columns, rows of a rectangle of pixels; or `node`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rectangle: Option<[u32; 4]>,
    /// A node of the scene: the pixels in whose centre it, or a node below it, is seen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub node: Option<String>,
}

/// What is remembered of the scores of a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kept {
    /// Number, mean and sum of squares of batch scores, and with `colour` the mean of R, G and B.
    Moments {
        /// True when R, G, B differ.
        colour: bool,
    },
    /// Every batch's score.
    EveryBatch,
}

/// What a receiver set measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ReceiverKind {
    /// Luminance map of a camera \[cd/m2\].
    Camera,
    /// Luminance over directions \[cd/m2\].
    Gonio,
    /// Illuminance grid \[lx\].
    Grid,
    /// One lux-meter \[lx\].
    Point,
    /// Mean luminance of a part of a camera's map \[cd/m2\].
    Region,
}

impl ReceiverKind {
    /// What its tables are called in a job file.
    pub fn table(self) -> &'static str {
        match self {
            ReceiverKind::Camera => "camera",
            ReceiverKind::Gonio => "gonio",
            ReceiverKind::Grid => "grid",
            ReceiverKind::Point => "point",
            ReceiverKind::Region => "region",
        }
    }
}

/// Name, size and keeping of one receiver set: all that plans, tallies and checkpoints know of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SetShape {
    /// Unique name.
    pub name: String,
    /// What it measures.
    pub kind: ReceiverKind,
    /// Bins in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// What is remembered of its scores.
    pub kept: Kept,
    /// Bins whose single histories are watched, in ascending order.
    pub monitored: Vec<u32>,
}

impl SetShape {
    /// A set of one bin of which every batch is kept.
    fn single(name: &str, kind: ReceiverKind, monitored: Vec<u32>) -> Self {
        SetShape { name: name.to_owned(), kind, width: 1, height: 1, kept: Kept::EveryBatch, monitored }
    }

    /// Number of bins.
    pub fn bins(&self) -> usize {
        self.width as usize * self.height as usize
    }
}

impl Camera {
    /// The view typed into the job, when the camera has no node. Checked when the job was read.
    pub fn view(&self) -> Option<View> {
        Some(View {
            eye: self.eye?,
            target: self.target?,
            up: self.up.unwrap_or([0.0, 1.0, 0.0]),
            vertical_fov_degrees: self.vertical_fov_degrees?,
        })
    }

    pub(super) fn shape(&self, channels: Channels) -> SetShape {
        let kept = Kept::Moments { colour: channels == Channels::Rgb };
        let monitored = monitored(&self.monitor, self.width);
        let (width, height) = (self.width, self.height);
        SetShape { name: self.name.clone(), kind: ReceiverKind::Camera, width, height, kept, monitored }
    }
}

impl Gonio {
    pub(super) fn shape(&self, channels: Channels) -> SetShape {
        let kept = Kept::Moments { colour: channels == Channels::Rgb };
        let monitored = monitored(&self.monitor, self.width);
        let (width, height) = (self.width, self.height);
        SetShape { name: self.name.clone(), kind: ReceiverKind::Gonio, width, height, kept, monitored }
    }
}

impl Grid {
    /// Centre of the cell number `index` \[m\].
    pub fn position(&self, index: usize) -> [f64; 3] {
        let (column, row) = (index % self.columns as usize, index / self.columns as usize);
        let a = (column as f64 + 0.5) / f64::from(self.columns);
        let b = (row as f64 + 0.5) / f64::from(self.rows);
        std::array::from_fn(|i| self.origin[i] + a * self.u[i] + b * self.v[i])
    }

    pub(super) fn shape(&self) -> SetShape {
        let kept = if self.keep_batches { Kept::EveryBatch } else { Kept::Moments { colour: false } };
        let monitored = monitored(&self.monitor, self.columns);
        let (width, height) = (self.columns, self.rows);
        SetShape { name: self.name.clone(), kind: ReceiverKind::Grid, width, height, kept, monitored }
    }
}

impl Point {
    pub(super) fn shape(&self) -> SetShape {
        SetShape::single(&self.name, ReceiverKind::Point, vec![0])
    }
}

impl Region {
    pub(super) fn shape(&self) -> SetShape {
        SetShape::single(&self.name, ReceiverKind::Region, Vec::new())
    }
}

/// The bins named by \[column, row\] in a set of `width` columns, each once, in ascending order.
fn monitored(places: &[[u32; 2]], width: u32) -> Vec<u32> {
    // A checked job has no more than 2^28 bins, and names none beyond them.
    let mut bins: Vec<u32> =
        places.iter().map(|[column, row]| row.saturating_mul(width).saturating_add(*column)).collect();
    bins.sort_unstable();
    bins.dedup();
    bins
}

fn four() -> u32 {
    4
}

fn yes() -> bool {
    true
}
