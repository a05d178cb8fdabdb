//! Light from outside: the sky, parallel light, and the openings to which their lines are drawn.
//!
//! A history of such light starts on a line: a direction and a place across it. Lines are drawn over the disc that covers the
//! scene, and through each opening. All ways of drawing belong to one mixture, and a line has the weight
//!
//! ```text
//! W_1 = L(v) / sum_k P_k q_k(v, x)        sky:       q = p(v)/(pi R^2)  or  (p(v) + p(mirrored v))/(A |cos|) through an opening
//! W_1 = E    / sum_k P_k q_k(x)           parallel:  q = 1/(pi R^2)     or  1/(A |cos|) through an opening
//! ```
//!
//! over all k that could have drawn it: openings change no mean, wherever they are, and light that passes beside them is not lost.
//! P_k follows the flux that a few fixed lines find to come through; it decides on the variance alone.

use super::opening::Opening;
use super::{Emission, Light, Sky};
use crate::geometry::Geometry;
use crate::job::{self, Estimator, Job};
use crate::math::{DVec2, DVec3, PI, to_world};
use crate::photometry::Colour;
use crate::random::{Generator, disc, evenly};

/// Lines that tell how much light comes through an opening.
const PROBES: u32 = 128;
/// Least share of the light of an unobstructed opening that it is taken to give.
const LEAST: f64 = 1.0 / 16.0;
/// Share of the histories of light from outside that cover the whole scene, where there are openings.
const WHOLE: f64 = 0.25;

/// Light from outside.
#[derive(Clone, Debug)]
pub struct Environment {
    /// What rays meet that leave the scene.
    pub sky: Option<Sky>,
    /// Where daylight enters.
    pub openings: Vec<Opening>,
    /// Directions of propagation and illuminances across them \[lx\].
    parallel: Vec<(DVec3, Colour)>,
    starts: Vec<Start>,
    /// Centre and radius of the ball around the scene \[m\].
    covered: (DVec3, f64),
}

/// A way to draw lines.
#[derive(Clone, Debug)]
struct Start {
    of: Source,
    /// Number of the opening, and its unit normal on the side from which the light comes; `None` for the whole scene.
    through: Option<(usize, DVec3)>,
    /// What it is chosen in proportion to \[lm\].
    flux: f64,
}

/// What shines along the lines.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Source {
    Sky,
    Parallel(usize),
}

/// Centre and radius of the ball that light from outside must cover: all surfaces, and the cells in which direct simulation counts it \[m\].
pub(super) fn covered(geometry: &Geometry, job: &Job, offset: DVec3) -> (DVec3, f64) {
    let (center, mut radius) = geometry.bounding_sphere();
    if job.transport.estimator == Estimator::DirectSimulation {
        for grid in &job.grids {
            let [origin, u, v] = [grid.origin, grid.u, grid.v].map(DVec3::from);
            let corners = [origin, origin + u, origin + v, origin + u + v];
            radius = corners.into_iter().map(|corner| (corner + offset).distance(center)).fold(radius, f64::max);
        }
    }
    (center, radius)
}

/// A line on which light comes.
struct Line {
    point: DVec3,
    /// Unit vector to where it comes from.
    towards: DVec3,
}

impl Environment {
    /// The sky and the parallel ones of `lights`, over what is `covered`, and the openings of a job, moved by `offset`; `None` without a sky, where there is not both of
    /// the others.
    pub(super) fn new(
        sky: Option<Sky>,
        lights: &[Light],
        (openings, offset): (&[job::Opening], DVec3),
        geometry: &Geometry,
        covered: (DVec3, f64),
    ) -> Option<Environment> {
        let parallel = lights.iter().filter_map(|light| match light {
            Light::Directional { direction, illuminance } => Some((*direction, *illuminance)),
            _ => None,
        });
        let parallel: Vec<_> = parallel.collect();
        if sky.is_none() && (openings.is_empty() || parallel.is_empty()) {
            return None;
        }
        let corner = |&p: &[f64; 3]| DVec3::from(p) + offset;
        let opening = |o: &job::Opening| Opening::new(&o.corners.iter().map(corner).collect::<Vec<_>>());
        let mut all = Environment {
            sky,
            openings: openings.iter().map(opening).collect(),
            parallel,
            starts: Vec::new(),
            covered,
        };
        all.starts = all.ways(geometry);
        Some(all)
    }

    /// All ways to draw lines, each with the flux that it stands for.
    fn ways(&self, geometry: &Geometry) -> Vec<Start> {
        let sources = self.sky.iter().map(|_| Source::Sky).chain((0..self.parallel.len()).map(Source::Parallel));
        let mut all = Vec::new();
        for of in sources {
            let mut through: Vec<Start> = Vec::new();
            for (number, opening) in self.openings.iter().enumerate() {
                for side in [opening.normal, -opening.normal] {
                    let flux = self.passing(of, opening, side, geometry);
                    through.push(Start { of, through: Some((number, side)), flux });
                }
            }
            through.retain(|start| start.flux > 0.0);
            let sum: f64 = through.iter().map(|start| start.flux).sum();
            let flux = if sum > 0.0 { sum * WHOLE / (1.0 - WHOLE) } else { self.flux_of(of) };
            all.push(Start { of, through: None, flux });
            all.extend(through);
        }
        all
    }

    /// About the flux of `of` through an opening from one side \[lm\]; 0 only where there can be none.
    fn passing(&self, of: Source, opening: &Opening, side: DVec3, geometry: &Geometry) -> f64 {
        let (mut open, mut all) = (0.0, 0.0);
        for k in 0..PROBES {
            let u = |start: f64| evenly(DVec2::splat(start), k.into());
            let (towards, weight) = match of {
                Source::Sky => {
                    let Some(sky) = &self.sky else { return 0.0 };
                    let v = sky.sample_above(side, u(0.5));
                    (v, sky.luminance(v).luminance() / sky.density_above(side, v))
                }
                Source::Parallel(i) => (-self.parallel[i].0, self.parallel[i].1.luminance()),
            };
            let flux = weight * opening.area * towards.dot(side).max(0.0) / f64::from(PROBES);
            let origin = geometry.lift(opening.point(u(0.25)), side);
            all += flux;
            // A pane in the opening does not close it.
            if geometry.visible(origin.as_vec3(), (origin + towards * (4.0 * self.covered.1)).as_vec3()) {
                open += flux;
            }
        }
        if all.is_finite() { f64::max(open, LEAST * all) } else { 0.0 }
    }

    fn flux_of(&self, of: Source) -> f64 {
        let area = PI * self.covered.1 * self.covered.1;
        match of {
            Source::Sky => self.sky.as_ref().map_or(0.0, Sky::integral) * area,
            Source::Parallel(i) => self.parallel[i].1.luminance() * area,
        }
    }

    /// Flux of the sky on the disc that covers the scene, all directions together \[lm\].
    pub(super) fn sky_flux(&self) -> f64 {
        self.flux_of(Source::Sky)
    }

    /// What each way to draw lines is chosen in proportion to \[lm\].
    pub(super) fn fluxes(&self) -> impl Iterator<Item = f64> {
        self.starts.iter().map(|start| start.flux)
    }

    /// Starts a history in the way `number`, all of which are chosen with the probability of their fluxes over `all`.
    pub(super) fn emit(&self, number: usize, all: f64, rng: &mut Generator) -> Emission {
        let start = &self.starts[number];
        let line = self.draw(start, rng);
        let density: f64 =
            self.starts.iter().filter(|s| s.of == start.of).map(|s| s.flux * self.density(s, &line)).sum();
        let bright = match start.of {
            Source::Sky => self.sky.as_ref().map_or(Colour::BLACK, |sky| sky.luminance(line.towards)),
            Source::Parallel(i) => self.parallel[i].1,
        };
        // From before all that is there.
        let (center, radius) = self.covered;
        let origin = line.point + (2.0 * radius - (line.point - center).dot(line.towards)) * line.towards;
        let weight = if density > 0.0 { bright * (all / density) } else { Colour::BLACK };
        let emphasis = f64::min(1.0, all / weight.luminance());
        Emission { origin, direction: -line.towards, weight, emphasis }
    }

    fn draw(&self, start: &Start, rng: &mut Generator) -> Line {
        let towards = match (start.of, &self.sky, start.through) {
            (Source::Sky, Some(sky), Some((_, side))) => sky.sample_above(side, rng.uniform2()),
            (Source::Sky, Some(sky), None) => sky.sample(rng.uniform2()),
            (Source::Sky, None, _) => DVec3::Z,
            (Source::Parallel(i), ..) => -self.parallel[i].0,
        };
        let u = rng.uniform2();
        let point = match start.through {
            Some((number, _)) => self.openings[number].point(u),
            None => {
                let across = disc(u) * self.covered.1;
                self.covered.0 + to_world(towards, DVec3::new(across.x, across.y, 0.0))
            }
        };
        Line { point, towards }
    }

    /// Density with which `start` draws `line` \[1/(m2 sr), or 1/m2 of parallel light\].
    fn density(&self, start: &Start, line: &Line) -> f64 {
        let Line { point, towards } = *line;
        let across = match start.through {
            None => {
                let (center, radius) = self.covered;
                let off = (point - center).reject_from_normalized(towards);
                // What rounding adds to the rim.
                let inside = off.length_squared() <= radius * radius * (1.0 + 1e-9);
                if inside { 1.0 / (PI * radius * radius) } else { 0.0 }
            }
            Some((number, side)) => {
                let opening = &self.openings[number];
                let cosine = towards.dot(side);
                let passes = cosine > 0.0 && opening.crossing(point, towards).is_some();
                if passes { 1.0 / (opening.area * cosine) } else { 0.0 }
            }
        };
        let direction = match (start.of, &self.sky, start.through) {
            _ if across == 0.0 => 0.0,
            (Source::Sky, Some(sky), Some((_, side))) => sky.density_above(side, towards),
            (Source::Sky, Some(sky), None) => sky.density(towards),
            _ => 1.0,
        };
        across * direction
    }
}
