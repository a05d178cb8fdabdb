//! The Markov chain of one history: vertices with the weights that arrive at them.
//!
//! A vertex is scored before it is decided whether the history goes on, so its weight is the one that arrives.
//! The flux balance counts, in luminous flux, what each event takes: what a surface does not reflect is absorbed,
//! what meets nothing has escaped, what a numerical guard stopped is lost. Russian roulette takes nothing on
//! average, so emitted = absorbed + escaped + lost holds within the error of the roulette alone.

use super::aimed::{is_aimed, scatter};
use crate::geometry::{Hit, Ray};
use crate::job::{Roulette, Transport};
use crate::math::DVec3;
use crate::photometry::Colour;
use crate::random::Generator;
use crate::scene::{Meeting, Scene};

/// Guard against chains that never end (a closed scene that absorbs nothing): more vertices are lost flux.
const MAX_VERTICES: u32 = 1 << 16;

/// One surface point of a trajectory that can be connected to receivers.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Position \[m\].
    pub position: DVec3,
    /// Unit geometric normal on the side on which the light arrived.
    pub normal: DVec3,
    /// Propagation direction of the arriving light.
    pub w_in: DVec3,
    /// W_n, the flux weight arriving \[lm\].
    pub weight: Colour,
    /// The surface it lies on.
    pub primitive: u32,
    /// n: reflections that light scattered here has seen, this one included.
    pub order: u32,
    /// True when the light came from a delta scatterer: no receiver-side path can find it.
    pub after_delta: bool,
    /// How much more often than in proportion to flux its trajectory is drawn, at most 1.
    pub emphasis: f64,
}

/// The straight way of light from one surface, or from its source, to the next.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    /// Where it starts, and its direction.
    pub ray: Ray,
    /// Its length \[m\]; infinite where it meets nothing.
    pub length: f64,
    /// The flux weight on the way \[lm\].
    pub weight: Colour,
    /// Reflections that the light has seen; 0 on the way from the source.
    pub order: u32,
}

/// What is taken down of a history as it goes.
pub trait Record {
    /// The history went along `segment`.
    fn segment(&mut self, segment: Segment);
    /// The segment ended at `vertex`, where connections may start.
    fn vertex(&mut self, vertex: Vertex);
}

impl Record for Vec<Vertex> {
    fn segment(&mut self, _: Segment) {}

    fn vertex(&mut self, vertex: Vertex) {
        self.push(vertex);
    }
}

impl Record for Vec<Segment> {
    fn segment(&mut self, segment: Segment) {
        self.push(segment);
    }

    fn vertex(&mut self, _: Vertex) {}
}

/// Luminous flux of one or more histories by its fate \[lm\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FluxBalance {
    /// Left the sources.
    pub emitted: f64,
    /// Not reflected by a surface.
    pub absorbed: f64,
    /// Met no surface.
    pub escaped: f64,
    /// Stopped by a numerical guard.
    pub lost: f64,
    /// Met a delta scatterer (a mirror), where vertices do not score.
    pub met_delta: f64,
}

impl FluxBalance {
    /// In the order of the bins of the flux balance, `tally::FLUX_BINS`, each times `share` \[lm\].
    pub fn scores(&self, share: f64) -> [f64; 5] {
        let FluxBalance { emitted, absorbed, escaped, lost, met_delta } = *self;
        [emitted, absorbed, escaped, lost, met_delta].map(|x| x * share)
    }

    /// Adds the balance of another history.
    pub fn add(&mut self, other: &FluxBalance) {
        self.emitted += other.emitted;
        self.absorbed += other.absorbed;
        self.escaped += other.escaped;
        self.lost += other.lost;
        self.met_delta += other.met_delta;
    }
}

/// Traces one history; its vertices or its segments are appended to `record`.
pub fn trace(scene: &Scene, transport: &Transport, rng: &mut Generator, record: &mut impl Record) -> FluxBalance {
    let start = scene.sources.emit(&scene.geometry, rng);
    let (mut first, mut emphasis) = (start.weight.luminance(), start.emphasis);
    let mut flux = FluxBalance { emitted: first, ..FluxBalance::default() };
    let mut ray = Ray { origin: start.origin, direction: start.direction };
    let mut weight = start.weight;
    let mut after_delta = false;
    for order in 1..=MAX_VERTICES {
        let way = Segment { ray, length: f64::INFINITY, weight, order: order - 1 };
        let Some((hit, met)) = advance(scene, way, &mut flux, rng, record) else { return flux };
        weight = met;
        if scene.absorbs(&hit) {
            flux.absorbed += weight.luminance();
            return flux;
        }
        let reflectance = scene.reflectance(hit.primitive, hit.position);
        if !reflectance.is_black() {
            let (position, normal, w_in) = (hit.position, hit.normal, ray.direction);
            record.vertex(Vertex {
                position,
                normal,
                w_in,
                weight,
                primitive: hit.primitive,
                order,
                after_delta,
                emphasis,
            });
        }
        if reflectance.has_delta() {
            flux.met_delta += weight.luminance();
        }
        let drawn = match is_aimed(scene, emphasis) {
            true => scatter(scene, &hit, ray.direction, rng),
            false => scene.scatter(&hit, ray.direction, rng).map(|scattered| (scattered, false)),
        };
        let Some((scattered, enters)) = drawn else {
            flux.absorbed += weight.luminance();
            return flux;
        };
        let reflected = weight * scattered.factor;
        if enters && !reflected.is_black() {
            // Inside it counts like those that were drawn through the opening.
            emphasis = (emphasis * first / reflected.luminance()).min(1.0);
            first = reflected.luminance();
        }
        flux.absorbed += weight.luminance() - reflected.luminance();
        let Some(survivor) = play(transport.roulette_below, first, weight, reflected, rng) else {
            return flux;
        };
        weight = survivor;
        after_delta = scattered.delta;
        ray = scene.leaving(&hit, &scattered);
    }
    flux.lost += weight.luminance();
    flux
}

/// Follows light straight on, through veils, to the surface where it is met: there, with its weight; `None` where it meets none.
fn advance(
    scene: &Scene,
    mut way: Segment,
    flux: &mut FluxBalance,
    rng: &mut Generator,
    record: &mut impl Record,
) -> Option<(Hit, Colour)> {
    for _ in 0..MAX_VERTICES {
        let hit = scene.geometry.closest_hit(&way.ray);
        record.segment(Segment { length: hit.map_or(f64::INFINITY, |h| h.distance), ..way });
        let Some(hit) = hit else {
            flux.escaped += way.weight.luminance();
            return None;
        };
        let meeting = scene.meet(&hit, way.ray.direction, true, rng);
        let (Meeting::Met(share) | Meeting::Through(share)) = meeting;
        let left = way.weight * share;
        flux.absorbed += way.weight.luminance() - left.luminance();
        if let Meeting::Met(_) = meeting {
            return Some((hit, left));
        }
        way = Segment { ray: scene.onward(&hit, way.ray.direction), weight: left, ..way };
    }
    flux.lost += way.weight.luminance();
    None
}

/// Russian roulette: the weight with which the history goes on, `reflected` over its survival probability, or
/// `None` where it ends. `first` is the luminous weight W_1, `weight` the W_n that arrived.
fn play(roulette: Roulette, first: f64, weight: Colour, reflected: Colour, rng: &mut Generator) -> Option<Colour> {
    let survival = match roulette {
        Roulette::Below(below) => weight.luminance() / (below * first),
        Roulette::Analog(_) => reflected.luminance() / weight.luminance(),
    };
    if reflected.is_black() {
        return None;
    }
    if survival >= 1.0 {
        return Some(reflected);
    }
    rng.chance(survival).then(|| reflected / survival)
}
