//! Regions: the pixels of a camera of which one number a batch is kept, their mean.
//!
//! ```text
//! s_b(region) = (1/P) sum over the P pixels p of the region of s_b(p)         value and direct part alike
//! ```
//!
//! A rectangle is given; the pixels of a node are those in whose centre the node, or one below it, is the first
//! surface seen, or is seen straight through panes and veils. They are found once, so a region is the same in every batch, and its scores are a fixed linear
//! combination of the map's: they carry the correlation between its pixels, which the map's own errors do not. A pixel
//! that sees nothing counts as it does in the map, 0. Pixels are summed in their order: the same bits always.
//!
//! What single histories give a region is not known, only what each gives a pixel at most. The largest of these, shared
//! among the pixels of the region, is a lower bound of the region's peak; it is zero only where nothing is known.

use super::receivers::CentreSight;
use crate::error::{Error, Result};
use crate::job::{Job, Region};
use crate::scene::{Nodes, Scene};
use crate::tally::Scores;
use smallvec::SmallVec;
use std::ops::Range;

/// The regions of a job, in its order.
pub struct Regions(Vec<Part>);

/// The pixels of one region.
struct Part {
    /// Receiver set of the camera: cameras come first in a job's sets.
    camera: usize,
    /// Runs of pixels, in ascending order.
    runs: Vec<Range<u32>>,
    /// Their number, above 0.
    count: f64,
}

/// The surfaces seen in the centre of each pixel of a camera: panes and veils, and what stands behind them.
pub type Seen = Vec<SmallVec<[u32; 2]>>;

impl Regions {
    /// The regions of `job`, read from `file`, in `scene`; `look` follows the rays of a camera through the centres of
    /// its pixels, and is asked only for cameras with a region by node.
    ///
    /// # Errors
    /// [`Error::Input`] for a node that the scene has not or has twice, or a region without any pixel.
    pub fn place(job: &Job, scene: &Scene, file: &str, look: impl Fn(&CentreSight) -> Seen) -> Result<Regions> {
        let mut seen: Vec<Option<Seen>> = vec![None; job.cameras.len()];
        let mut parts = Vec::with_capacity(job.regions.len());
        for (i, region) in job.regions.iter().enumerate() {
            let at = job.cameras.iter().position(|c| c.name == region.camera);
            let at = at.expect("a region's camera was found when the job was read");
            let camera = &job.cameras[at];
            let runs = match (region.rectangle, &region.node) {
                (None, Some(name)) => {
                    let field = format!("region[{i}].node");
                    let node = scene.nodes.only_with_surface(name);
                    let node = node.map_err(|allowed| Error::input(file, &field, name, allowed))?;
                    let seen = seen[at].get_or_insert_with(|| look(&CentreSight::new(scene, camera)));
                    let runs = runs_of(seen, &scene.nodes, node);
                    if runs.is_empty() {
                        return Err(Error::input(file, &field, name, unseen(region)));
                    }
                    runs
                }
                (rectangle, _) => rows(rectangle.expect("a region has a rectangle or a node"), camera.width),
            };
            let count = runs.iter().map(|run| run.len() as f64).sum();
            parts.push(Part { camera: at, runs, count });
        }
        Ok(Regions(parts))
    }

    /// Refuses regions of `job`, read from `file`, that cannot be placed in `scene`.
    ///
    /// # Errors
    /// [`Error::Input`] as [`Regions::place`].
    pub fn check(job: &Job, scene: &Scene, file: &str) -> Result<()> {
        let look = |sight: &CentreSight| (0..sight.pixels()).map(|pixel| sight.surfaces(pixel)).collect();
        Regions::place(job, scene, file, look).map(|_| ())
    }

    /// Number of regions.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// The scores of each region from those of the other sets in the same batch.
    pub fn scores(&self, sets: &[Scores]) -> Vec<Scores> {
        self.0.iter().map(|part| part.score(&sets[part.camera])).collect()
    }
}

impl Part {
    /// One bin: means of value, direct and caustic part over the pixels, and whether any of them saw a surface.
    ///
    /// Its `peak` is the least that the largest total of a history can be, what the pixel with the largest one alone
    /// gives: zero where no history reached any pixel, and only there.
    fn score(&self, map: &Scores) -> Scores {
        let mean = |pixels: &[f64]| self.pixels().map(|p| pixels[p]).sum::<f64>() / self.count;
        let peak = self.pixels().map(|p| map.peak[p]).fold(0.0, f64::max) / self.count;
        Scores {
            value: vec![mean(&map.value)],
            direct: vec![mean(&map.direct)],
            peak: vec![peak],
            caustic: vec![mean(&map.caustic)],
            existed: vec![self.pixels().any(|p| map.existed[p])],
            ..Scores::default()
        }
    }

    fn pixels(&self) -> impl Iterator<Item = usize> + '_ {
        self.runs.iter().cloned().flatten().map(|p| p as usize)
    }
}

fn unseen(region: &Region) -> String {
    let camera = &region.camera;
    format!("a node that is the first surface in the centre of at least one pixel of camera {camera}, panes apart")
}

/// Runs of pixels in whose centre `node`, or one below it, is seen.
fn runs_of(seen: &Seen, nodes: &Nodes, node: usize) -> Vec<Range<u32>> {
    let inside = nodes.at_or_below(node);
    let mut runs: Vec<Range<u32>> = Vec::new();
    for (pixel, primitives) in (0u32..).zip(seen) {
        if !primitives.iter().any(|&p| nodes.of(p).is_some_and(|node| inside[node])) {
            continue;
        }
        match runs.last_mut() {
            Some(run) if run.end == pixel => run.end += 1,
            _ => runs.push(pixel..pixel + 1),
        }
    }
    runs
}

/// The runs of a rectangle (first column, first row, columns, rows) in a picture of `width` columns.
fn rows([column, row, columns, rows]: [u32; 4], width: u32) -> Vec<Range<u32>> {
    let start = |row: u32| row * width + column;
    (row..row + rows).map(|row| start(row)..start(row) + columns).collect()
}
