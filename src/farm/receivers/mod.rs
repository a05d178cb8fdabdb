//! Receiver sets: the bins of a camera, goniometer, grid or point as receivers, batch by batch.
//!
//! The bin of a map has one position in each of its strata and batch, for direct light; one of them, its stratum
//! drawn anew each batch, carries the connections. A bin across an edge has more, and some of them carry. A lux-meter stays where it is, and its direct light from lights
//! without extent is computed once. How histories are turned into scores is in [`super::local`].

mod edges;
mod horizon;
mod sense;
mod sight;

pub use sense::Sensed;
pub use sight::CentreSight;

mod crossing;
mod reverse;

use crate::error::{Error, Result, listed};
use crate::geometry::Ray;
use crate::job::{Camera, Estimator, Grid, Job, Point, Sampling, SetShape};
use crate::math::{DVec2, DVec3};
use crate::photometry::Colour;
use crate::random::sobol::PointSet;
use crate::random::{Domain, Generator, Stream};
use crate::scene::Scene;
use crate::transport::eye::{Eye, Gaze, latitude};
use crate::transport::lamps::all;
use crate::transport::receiver::{Receiver, Response, Seen, look, look_at};
use crate::transport::shared::of_lights;
use edges::across_edges;
use horizon::Sight;

/// One receiver set of a job, placed in a scene.
pub struct ReceiverSet {
    shape: SetShape,
    bins: Bins,
    stream: Stream,
    /// Of the points of emitters that receivers share.
    emitters: Stream,
    /// Of the receiver-side continuations.
    continuations: Stream,
    /// Of the directions in which they start.
    directions: Stream,
    /// Of the vertices that tiles choose.
    choices: Stream,
    histories: u64,
    /// Whether the job asks for quasi-random histories: continuations follow.
    quasi_random: bool,
    /// b of the bounded kernel \[1/m2\]; infinite where nothing is bounded.
    bound: f64,
    /// Where each bin lies, of a surface point seen from all directions; empty for others.
    sights: Vec<Sight>,
    /// Whether each bin lies across an edge, of what is seen from a place; empty for others.
    edges: Vec<bool>,
}

/// What the bins are.
enum Bins {
    /// Film of an eye with `strata` x `strata` positions in a bin.
    Film { eye: Eye, strata: u32 },
    /// Lux-meters; `None` inside a solid.
    Meters(Vec<Option<Receiver>>),
}

/// Draws after which a bin across the horizon is taken to show nothing of what lies above.
const DRAWS: u32 = 1 << 16;

/// Random numbers of the paths that continue one bin in one batch: in a quasi-random job, where their number is a power of two,
/// they start with the points of a scrambled quasi-random set, so that their directions do not leave a part of the hemisphere out.
pub struct Paths {
    rng: Generator,
    points: Option<PointSet>,
    next: u32,
}

/// Distance between the numbers of the receivers of a bin: no job has so many bins and batches.
const BETWEEN_RECEIVERS: u64 = 1 << 60;

/// Quasi-random coordinates of a path: two directions at matt surfaces.
const COORDINATES: usize = 4;

impl Paths {
    /// The numbers of the next path.
    pub fn next(&mut self) -> &mut Generator {
        if let Some(points) = &self.points {
            self.rng = self.rng.clone().after(points.start::<COORDINATES>(self.next));
            self.next += 1;
        }
        &mut self.rng
    }
}

impl ReceiverSet {
    /// All receiver sets of `job` in the order of [`Job::sets`], regions left out; the job has passed
    /// [`ReceiverSet::check`]. `bounds` holds b of each set \[1/m2\], or is empty where nothing is bounded.
    pub fn all(job: &Job, scene: &Scene, bounds: &[f64]) -> Vec<ReceiverSet> {
        let mut bins = Vec::new();
        for camera in &job.cameras {
            let eye = camera_eye(scene, camera);
            bins.push(Bins::Film { eye, strata: camera.pixel_samples.isqrt() });
        }
        for gonio in &job.gonios {
            let eye = Eye::from_gonio(scene, gonio).expect("the surface was found when the job was planned");
            bins.push(Bins::Film { eye, strata: gonio.pixel_samples.isqrt() });
        }
        for grid in &job.grids {
            let normal = grid.normal;
            let cells = 0..grid.columns as usize * grid.rows as usize;
            bins.push(Bins::Meters(cells.map(|i| meter(scene, grid.position(i), normal)).collect()));
        }
        for point in &job.points {
            bins.push(Bins::Meters(vec![meter(scene, point.position, point.normal)]));
        }
        let bound = |set: usize| bounds.get(set).copied().unwrap_or(f64::INFINITY);
        let sets = job.sets().into_iter().zip(bins).enumerate();
        sets.map(|(i, (shape, bins))| ReceiverSet::new(job, scene, (shape, bins), bound(i))).collect()
    }

    fn new(job: &Job, scene: &Scene, (shape, bins): (SetShape, Bins), bound: f64) -> Self {
        let stream = Stream::new(job.run.seed, Domain::Receiver, &shape.name);
        let emitters = Stream::new(job.run.seed, Domain::Emitter, &shape.name);
        let continuations = Stream::new(job.run.seed, Domain::Continuation, &shape.name);
        let directions = Stream::new(job.run.seed, Domain::Direction, &shape.name);
        let histories = job.run.histories_per_batch;
        let quasi_random = job.run.sampling == Sampling::Rqmc;
        let choices = Stream::new(job.run.seed, Domain::Choice, &shape.name);
        let mut set = ReceiverSet {
            shape,
            bins,
            stream,
            emitters,
            continuations,
            directions,
            choices,
            histories,
            quasi_random,
            bound,
            sights: Vec::new(),
            edges: Vec::new(),
        };
        match &set.bins {
            Bins::Film { eye: eye @ Eye::Surface { point }, .. } => {
                set.sights = (0..set.shape.bins()).map(|i| set.sight(eye, point.normal, i)).collect();
            }
            Bins::Film { eye, .. } if job.transport.estimator == Estimator::Local => {
                set.edges = across_edges(scene, eye, (set.shape.width, set.shape.height));
            }
            Bins::Film { .. } | Bins::Meters(_) => {}
        }
        set
    }

    /// Name, size and keeping.
    pub fn shape(&self) -> &SetShape {
        &self.shape
    }

    /// b of the bounded kernel \[1/m2\]; infinite where nothing is bounded.
    pub fn bound(&self) -> f64 {
        self.bound
    }

    /// The paths that continue receiver number `receiver` of bin `bin` in a batch, `count` in number.
    pub fn continuations(&self, (bin, receiver): (u32, usize), batch: u64, count: usize) -> Paths {
        let index = batch * self.shape.bins() as u64 + u64::from(bin) + receiver as u64 * BETWEEN_RECEIVERS;
        let points = (self.quasi_random && count.is_power_of_two())
            .then(|| PointSet::new(&self.directions, index, count.ilog2()));
        Paths { rng: self.continuations.generator(index), points, next: 0 }
    }

    /// The numbers by which the tiles of the block that begins with `bin` choose their vertices in a batch.
    pub fn choice(&self, bin: u32, batch: u64) -> Generator {
        self.choices.generator(batch * self.shape.bins() as u64 + u64::from(bin))
    }

    /// Where the centre of bin `i` looks, for the order of the tiles alone; infinite where nothing is seen.
    pub fn center(&self, scene: &Scene, i: usize) -> DVec3 {
        match &self.bins {
            Bins::Meters(meters) => meters[i].map_or(DVec3::INFINITY, |r| r.position),
            Bins::Film { eye, .. } => match eye.gaze(self.film(i, 1, 0, DVec2::splat(0.5))) {
                Gaze::Along(ray) => scene.geometry.closest_hit(&ray).map_or(DVec3::INFINITY, |h| h.position),
                Gaze::At(hit, _) => hit.position,
                Gaze::Nowhere => DVec3::INFINITY,
            },
        }
    }

    /// Refuses receivers of `job`, read from `file`, that cannot be placed in `scene`; says what the two say
    /// differently, and which receivers have no finite value.
    ///
    /// # Errors
    /// [`Error::Input`] for a camera node that the scene has not, or a surface point without a surface.
    pub fn check(job: &Job, scene: &Scene, file: &str) -> Result<Vec<String>> {
        let mut warnings = Vec::new();
        for (i, camera) in job.cameras.iter().enumerate() {
            let Some(name) = &camera.node else { continue };
            let Some(node) = scene.camera(name) else {
                let names = listed(name, scene.cameras.iter().map(|c| c.name.as_str()));
                let allowed = format!("a perspective camera of the scene: {names}");
                return Err(Error::input(file, format!("camera[{i}].node"), name, allowed));
            };
            let asked = f64::from(camera.width) / f64::from(camera.height);
            if let Some(given) = node.aspect.filter(|given| (asked / given - 1.0).abs() > 1e-3) {
                let name = &camera.name;
                warnings.push(format!("camera {name}: aspectRatio {given} of the scene is ignored, {asked} is used"));
            }
        }
        for (i, gonio) in job.gonios.iter().enumerate() {
            if Eye::from_gonio(scene, gonio).is_none() {
                let allowed = "a point within 1 mm of a surface that reflects, with the normal of its reflecting side";
                return Err(Error::input(
                    file,
                    format!("gonio[{i}].position"),
                    format!("{:?}", gonio.position),
                    allowed,
                ));
            }
        }
        warnings.extend(meters_on_lamps(job, scene));
        Ok(warnings)
    }

    /// Direct light of `bins`, at most a tile, that is the same in every batch \[lx or cd/m2\]: of lux-meters the light of all sources
    /// without extent, NaN inside a solid; of a map 0, NaN where no direction of the bin is above the surface.
    pub fn fixed_direct(&self, scene: &Scene, bins: &[u32]) -> Vec<f64> {
        match &self.bins {
            Bins::Meters(meters) => {
                let there: Vec<Receiver> = bins.iter().filter_map(|&bin| meters[bin as usize]).collect();
                let mut light = of_lights(scene, &there, &all(scene)).into_iter().map(Colour::luminance);
                let of = |&bin: &u32| meters[bin as usize].and_then(|_| light.next()).unwrap_or(f64::NAN);
                bins.iter().map(of).collect()
            }
            Bins::Film { .. } => {
                let below = |&bin: &u32| self.sights.get(bin as usize) == Some(&Sight::Below);
                bins.iter().map(|bin| if below(bin) { f64::NAN } else { 0.0 }).collect()
            }
        }
    }

    /// True when direct light is zero and the same in every batch for all bins, so that none need be kept.
    pub fn has_no_fixed_direct(&self) -> bool {
        matches!(&self.bins, Bins::Film { eye: Eye::Camera { .. } | Eye::Sphere { .. }, .. })
    }

    /// Film position, in the unit square, at the place `within` the stratum number `stratum` of the
    /// `strata` x `strata` of bin `i`.
    fn film(&self, i: usize, strata: u32, stratum: u32, within: DVec2) -> DVec2 {
        let (width, height) = (self.shape.width as usize, f64::from(self.shape.height));
        let (column, row) = ((i % width) as f64, (i / width) as f64);
        let (across, down) = (f64::from(stratum % strata), f64::from(stratum / strata));
        let x = (column + (across + within.x) / f64::from(strata)) / width as f64;
        let v = (down + within.y) / f64::from(strata);
        let y = match &self.bins {
            Bins::Film { eye: Eye::Sphere { .. } | Eye::Surface { .. }, .. } => {
                latitude(row / height, (row + 1.0) / height, v)
            }
            _ => (row + v) / height,
        };
        DVec2::new(x, y)
    }

    /// A film position of bin `bin`: in its stratum of `strata` x `strata`, or across the horizon anywhere in the bin, but above.
    fn draw(&self, eye: &Eye, (strata, stratum): (u32, u32), bin: usize, rng: &mut Generator) -> DVec2 {
        if self.sights.get(bin) != Some(&Sight::Across) {
            return self.film(bin, strata, stratum, rng.uniform2());
        }
        let mut film = self.film(bin, 1, 0, rng.uniform2());
        for _ in 0..DRAWS {
            if !matches!(eye.gaze(film), Gaze::Nowhere) {
                break;
            }
            film = self.film(bin, 1, 0, rng.uniform2());
        }
        film
    }

    /// A receiver such as bin `bin` has in a batch, if anything reflects there; without direct light, which costs more.
    pub fn receiver(&self, scene: &Scene, bin: usize) -> Option<Receiver> {
        match &self.bins {
            Bins::Meters(meters) => meters[bin],
            Bins::Film { eye, strata } => {
                let mut rng = self.stream.generator(bin as u64);
                let stratum = rng.below(strata * strata);
                let film = self.draw(eye, (*strata, stratum), bin, &mut rng);
                gaze(scene, eye, film, &mut rng).receiver
            }
        }
    }
}

/// The ray to follow, where there is one.
fn gaze_ray(gaze: &Gaze) -> Option<Ray> {
    match gaze {
        Gaze::Along(ray) => Some(*ray),
        Gaze::At(..) | Gaze::Nowhere => None,
    }
}

fn gaze(scene: &Scene, eye: &Eye, film: DVec2, rng: &mut Generator) -> Seen {
    match eye.gaze(film) {
        Gaze::Along(ray) => look(scene, &ray, rng),
        Gaze::At(hit, direction) => look_at(scene, hit, direction, rng),
        Gaze::Nowhere => Seen::NOTHING,
    }
}

/// The eye of a camera of a checked job.
pub(super) fn camera_eye(scene: &Scene, camera: &Camera) -> Eye {
    let aspect = f64::from(camera.width) / f64::from(camera.height);
    match &camera.node {
        Some(name) => Eye::from_node(scene.camera(name).expect("the node was found when the job was planned"), aspect),
        None => Eye::from_view(scene, &camera.view().expect("a job is checked when it is read"), aspect),
    }
}

/// A warning for each point and each grid of `job` with a lux-meter on a lamp without extent; of a grid the first cell.
fn meters_on_lamps(job: &Job, scene: &Scene) -> Vec<String> {
    let of_point = |p: &Point| is_on_lamp(scene, p.position).then(|| format!("point {}", p.name));
    let of_grid = |g: &Grid| {
        let cells = 0..g.columns as usize * g.rows as usize;
        let cell = cells.into_iter().find(|&i| is_on_lamp(scene, g.position(i)))?;
        Some(format!("grid {}, cell [{}, {}]", g.name, cell % g.columns as usize, cell / g.columns as usize))
    };
    let meters = job.points.iter().filter_map(of_point).chain(job.grids.iter().filter_map(of_grid));
    meters
        .map(|meter| format!("{meter} lies on a lamp without extent, where illuminance has no finite value"))
        .collect()
}

/// True nearer to a lamp than points are lifted off their surfaces: rounding alone may hide the coincidence.
fn is_on_lamp(scene: &Scene, position: [f64; 3]) -> bool {
    let position = scene.place(position);
    let is_here = |lamp: DVec3| lamp.distance(position) <= scene.geometry.lift_length();
    scene.sources.lights.iter().any(|light| light.at(position).0.is_some_and(is_here))
}

fn meter(scene: &Scene, position: [f64; 3], normal: [f64; 3]) -> Option<Receiver> {
    let (position, normal) = (scene.place(position), DVec3::from(normal).normalize());
    let lifted = scene.geometry.lift(position, normal);
    let inside = scene.geometry.is_inside(lifted, |hit| scene.absorbs(hit));
    (!inside).then_some(Receiver { position, normal, response: Response::Cosine })
}

#[cfg(test)]
mod tests;
