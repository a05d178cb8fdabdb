//! What receivers are connected to: the vertices of histories, or points of emitters, as the kernel wants them.

use super::trajectory::Vertex;
use crate::geometry::Apex;
use crate::math::{DVec3, PI, Vec3};
use crate::photometry::Colour;
use crate::scene::{LawInLanes, Scene};
use std::ops::Range;
use std::sync::Arc;

/// The golden section.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// The numbers 0 .. `count` in an order of which any run, where there are more than a few, is spread evenly over them.
pub fn dealing(count: usize) -> impl Iterator<Item = usize> {
    let gcd = |mut a: usize, mut b: usize| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    // Without a common divisor with `count`, the multiples of a number meet all others.
    let golden = (count as f64 * GOLDEN) as usize;
    let stride = (golden..=count).find(|&n| gcd(n, count) == 1).unwrap_or(1);
    std::iter::successors(Some(0), move |at| Some((at + stride) % count)).take(count)
}

/// A vertex as the kernel wants it.
#[derive(Clone, Debug)]
pub(super) struct Connector {
    pub(super) position: Vec3,
    /// Number of the lifted point.
    apex: u32,
    pub(super) normal: Vec3,
    /// W_n rho / pi of a Lambert vertex \[lm/sr\].
    pub(super) intensity: [f32; 3],
    /// n, the reflections that light scattered here has seen.
    pub(super) order: u32,
    /// True where the bound does not apply.
    pub(super) after_delta: bool,
    /// Where the law of reflection depends on direction; apart, so that matt vertices stay small.
    pub(super) glossy: Option<Box<GlossyConnector>>,
    /// Number of the emitter of which this is a point and no vertex.
    pub(super) emitter: Option<u32>,
}

impl Connector {
    /// The same vertex, of which all light counts `factor` times.
    fn weighted(&self, factor: f32) -> Connector {
        let mut weighted = self.clone();
        weighted.intensity = weighted.intensity.map(|c| c * factor);
        if let Some(glossy) = &mut weighted.glossy {
            glossy.weight = glossy.weight.map(|c| c * factor);
        }
        weighted
    }
}

/// What a vertex of a law that depends on direction has besides.
#[derive(Clone, Debug)]
pub(super) struct GlossyConnector {
    /// The law.
    pub(super) law: LawInLanes,
    /// Whether connections from it are spiky.
    pub(super) is_peaked: bool,
    /// Unit vector to where the light came from.
    pub(super) from: Vec3,
    /// What gets through the specular part from there.
    pub(super) through: [f32; 3],
    /// W_n \[lm\].
    pub(super) weight: [f32; 3],
}

/// A point of an emitter, as the start of light to many receivers.
#[derive(Clone, Copy, Debug)]
pub struct LitPoint {
    /// Position \[m\].
    pub position: DVec3,
    /// Unit normal of the side that emits.
    pub normal: DVec3,
    /// Luminous intensity along the normal \[cd\].
    pub intensity: Colour,
    /// Number of the emitter.
    pub emitter: u32,
}

/// The vertices of many histories, ready to be connected.
#[derive(Debug, Default)]
pub struct Connectors {
    all: Vec<Connector>,
    /// Their lifted points.
    apexes: Arc<Vec<Apex>>,
    /// End of each history in `all`.
    ends: Vec<usize>,
}

impl Connectors {
    /// Appends the vertices of the next history.
    pub fn push(&mut self, scene: &Scene, history: &[Vertex]) {
        for vertex in history {
            let apex = self.lift(scene, vertex.position, vertex.normal);
            self.all.push(connector(scene, vertex, apex));
            if let Some((_, tau)) = scene.surface(vertex.primitive).reflectance.sides() {
                let apex = self.lift(scene, vertex.position, -vertex.normal);
                self.all.push(transmitting(scene, vertex, tau, apex));
            }
        }
        self.ends.push(self.all.len());
    }

    /// Appends points of emitters in the place of the vertices of a history; no reflection counts.
    pub fn push_lit(&mut self, scene: &Scene, points: &[LitPoint]) {
        for p in points {
            let apex = self.lift(scene, p.position, p.normal);
            self.all.push(Connector {
                position: p.position.as_vec3(),
                apex,
                normal: p.normal.as_vec3(),
                intensity: p.intensity.0.map(|c| c as f32),
                order: 0,
                after_delta: false,
                glossy: None,
                emitter: Some(p.emitter),
            });
        }
        self.ends.push(self.all.len());
    }

    /// The number of the lifted point of one more connector, on the side of `normal`.
    fn lift(&mut self, scene: &Scene, position: DVec3, normal: DVec3) -> u32 {
        let apexes = Arc::make_mut(&mut self.apexes);
        apexes.push(scene.geometry.apex(scene.geometry.lift(position, normal).as_vec3()));
        apexes.len() as u32 - 1
    }

    /// The lifted point of a connector.
    pub(super) fn apex(&self, of: &Connector) -> &Apex {
        &self.apexes[of.apex as usize]
    }

    /// Number of histories, those without vertices included.
    pub fn histories(&self) -> usize {
        self.ends.len()
    }

    /// Number of vertices.
    pub fn vertices(&self) -> usize {
        self.all.len()
    }

    /// Position and normal of each vertex.
    pub(super) fn places(&self) -> impl Iterator<Item = (Vec3, Vec3)> {
        self.all.iter().map(|vertex| (vertex.position, vertex.normal))
    }

    /// The vertices with the numbers `chosen`, each with a factor of its weight, dealt in turn to so many histories, of which any few that
    /// follow each other hold some from everywhere.
    pub(super) fn dealt(&self, chosen: &[(usize, f32)], histories: usize) -> Connectors {
        let mut dealt = Connectors { apexes: Arc::clone(&self.apexes), ..Connectors::default() };
        for first in dealing(histories) {
            for &(number, factor) in chosen.iter().skip(first).step_by(histories) {
                dealt.all.push(self.all[number].weighted(factor));
            }
            dealt.ends.push(dealt.all.len());
        }
        dealt
    }

    pub(super) fn iter(&self, histories: Range<usize>) -> impl Iterator<Item = &[Connector]> {
        let mut start = histories.start.checked_sub(1).map_or(0, |before| self.ends[before]);
        self.ends[histories].iter().map(move |&end| &self.all[std::mem::replace(&mut start, end)..end])
    }
}

fn connector(scene: &Scene, v: &Vertex, apex: u32) -> Connector {
    let reflectance = scene.reflectance(v.primitive, v.position);
    let lambert = reflectance.lambert().or(reflectance.sides().map(|(same_side, _)| same_side));
    let narrow = |c: Colour| c.0.map(|c| c as f32);
    Connector {
        position: v.position.as_vec3(),
        apex,
        normal: v.normal.as_vec3(),
        intensity: narrow(v.weight * lambert.unwrap_or(Colour::BLACK) / PI),
        order: v.order,
        after_delta: v.after_delta,
        glossy: reflectance.lanes().map(|law| {
            Box::new(GlossyConnector {
                law: law.clone(),
                is_peaked: reflectance.is_peaked(),
                from: -v.w_in.as_vec3(),
                through: narrow(reflectance.through(-v.w_in.dot(v.normal))),
                weight: narrow(v.weight),
            })
        }),
        emitter: None,
    }
}

/// What a vertex on a surface that sends the share `tau` of light to the other side sends there.
fn transmitting(scene: &Scene, v: &Vertex, tau: Colour, apex: u32) -> Connector {
    let intensity = (v.weight * tau / PI).0.map(|c| c as f32);
    Connector { normal: -v.normal.as_vec3(), intensity, ..connector(scene, v, apex) }
}

#[cfg(test)]
mod tests {
    use super::dealing;

    #[test]
    fn every_number_is_dealt_once_and_neighbours_lie_apart() {
        for count in 0..200 {
            let dealt: Vec<usize> = dealing(count).collect();
            let mut sorted = dealt.clone();
            sorted.sort_unstable();
            assert!(sorted.into_iter().eq(0..count), "{count}: {dealt:?}");
        }
        // Any eight of 64 that follow each other leave no gap of twice their mean distance.
        let dealt: Vec<usize> = dealing(64).collect();
        for run in dealt.windows(8) {
            let mut run = run.to_vec();
            run.sort_unstable();
            assert!(run.windows(2).all(|pair| pair[1] - pair[0] <= 16), "{run:?}");
        }
    }
}
