//! The kernel: vertices of histories connected to tiles of receivers.
//!
//! One estimator for illuminance and luminance; see the equations in [`super`]. A connection of a vertex x to a
//! receiver r carries the share min(1, b/(G s_x s_r)) of the light on its way, with G the geometric factor, s >= 1
//! the peaks of the two laws of reflection in these directions (1 where they are not peaked) and b the bound of the
//! kernel: so a connection scores at most W b f_x f_r/(s_x s_r), with f/s = rho/pi of matt laws and at most 4/pi of peaked
//! ones. What is left reaches the receiver through [`super::continuation`], whose points
//! are receivers of the same owner. b is infinite for the plain local estimate, and for light that a delta
//! scatterer sent to the vertex: no continuation could find it. How much that is, and how much comes by continuations, is
//! summed beside, for the health of the result.
//!
//! Loop order is tile -> history -> vertex: a tile stays in the first cache, a history's vertices are summed in f32
//! (one channel or three), and its total goes once, in f64, to the sum of the link. Sums run in the order of the histories, so
//! scores do not depend on by whom tiles are computed. Numbers come from plain f32 operations without contraction, which give the
//! same bits whatever the width of the vectors they are compiled to; see [`crate::geometry::simd`].

#![allow(clippy::needless_range_loop, reason = "several arrays go by one axis, lane or channel")]

use super::connectors::Connector;
use super::receiver::Receiver;
use super::totals::{Column, Sums, Totals};
use super::varying::Varying;
use super::veils;
use crate::geometry::Apex;
use crate::geometry::simd::exact::{Triple, dot, scale, splat, sub};
use crate::geometry::simd::{Isa, Kernel, Vector};
use crate::geometry::visibility::{BUNDLE, BUNDLES, Lanes, Points, Scratch};
use crate::math::Vec3;
use crate::photometry::Colour;
use crate::scene::{Scene, weights_over_tolerated};
use std::ops::Range;

pub use super::connectors::{Connectors, LitPoint, dealing};
pub use crate::geometry::visibility::TILE;

/// Squared lengths below this are taken for it: a receiver there is at the vertex itself \[m2\].
const NOWHERE: f32 = 1e-30;

/// A point to which histories are connected on behalf of an owner: the receiver itself, or a point of its continuation.
#[derive(Clone, Copy, Debug)]
pub struct Link {
    /// Number of the owner.
    pub owner: u32,
    /// Where the histories are connected to.
    pub receiver: Receiver,
    /// What every history has here before it is connected: direct light at a point of a continuation \[lx or cd/m2\].
    pub start: Colour,
    /// True where the total of every history is wanted.
    pub watched: bool,
}

/// What histories give one link \[lx or cd/m2\]: sums over histories, not yet divided by their number.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Connected {
    /// Sum of the totals of all histories.
    pub sum: Colour,
    /// The largest luminous total of a single history.
    pub peak: f64,
    /// The luminous part of `sum` by vertices that a delta scatterer lit straight.
    pub mirrored: f64,
    /// The luminous total of every history, where it is wanted.
    pub totals: Option<Vec<f64>>,
}

/// How histories are connected.
#[derive(Clone, Debug)]
pub struct Rule {
    /// b of the bounded kernel \[1/m2\]; infinite for the plain estimate.
    pub bound: f64,
    /// 1: the first channel stands for all three.
    pub channels: usize,
    /// Reflections before the receiver that count: for tests order by order.
    pub orders: Range<u32>,
}

/// Connects the `histories` of `connectors` to all links of `tile`: entry i belongs to link i.
pub fn connect(
    scene: &Scene,
    connectors: &Connectors,
    histories: Range<usize>,
    tile: &Tile,
    rule: &Rule,
) -> Vec<Connected> {
    let connection = Connection { scene, connectors, histories, tile, rule };
    match rule.channels {
        1 => scene.geometry.path().run(Channels::<1>(connection)),
        _ => scene.geometry.path().run(Channels::<3>(connection)),
    }
}

struct Connection<'a> {
    scene: &'a Scene,
    connectors: &'a Connectors,
    histories: Range<usize>,
    tile: &'a Tile,
    rule: &'a Rule,
}

/// A connection in `C` channels.
struct Channels<'a, const C: usize>(Connection<'a>);

impl<const C: usize> Kernel for Channels<'_, C> {
    type Output = Vec<Connected>;

    #[inline(always)]
    fn run<I: Isa>(self) -> Vec<Connected> {
        let Connection { scene, connectors, histories, tile, rule } = self.0;
        let mut sums = Sums::<C>::new();
        let mut totals = Totals::<C>::new(tile);
        let mut scratch = Scratch::default();
        // Where nothing is known beforehand and nobody counts histories, those without vertices need not be looked at.
        let idle = tile.links.iter().all(|l| l.start.is_black() && !l.watched);
        for history in connectors.iter(histories).filter(|h| !(idle && h.is_empty())) {
            sums.clear();
            for vertex in history.iter().filter(|v| rule.orders.contains(&(v.order + tile.depth))) {
                tile.add::<I, C>(scene, (vertex, connectors.apex(vertex)), rule.bound as f32, &mut sums, &mut scratch);
            }
            totals.add(&sums, tile);
        }
        totals.connected(tile)
    }
}

#[inline(always)]
fn lanes<I: Isa>(columns: &[Column; 3], bundle: usize) -> Triple<I::Sixteen> {
    let [x, y, z] = columns;
    [I::Sixteen::load(&x[bundle]), I::Sixteen::load(&y[bundle]), I::Sixteen::load(&z[bundle])]
}

/// At most [`TILE`] links as a structure of arrays.
#[derive(Debug)]
pub struct Tile {
    pub(super) links: Vec<Link>,
    /// Reflections between these receivers and their owners.
    depth: u32,
    position: [Column; 3],
    normal: [Column; 3],
    lifted: Points,
    /// Response of each receiver where it does not depend on direction.
    pub(super) constant: Vec<Option<Colour>>,
    varying: Option<Box<Varying>>,
    /// Receivers that take no light from the shared points of an emitter.
    refused: Vec<(u32, Lanes)>,
}

impl Tile {
    /// The tile of `links`, at most [`TILE`], which lie `depth` reflections before their owners.
    pub fn new(scene: &Scene, links: Vec<Link>, depth: u32) -> Self {
        assert!(links.len() <= TILE, "a tile holds {TILE} receivers");
        let constant: Vec<_> = links.iter().map(|l| l.receiver.response.constant(scene, l.receiver.normal)).collect();
        let column = |f: &dyn Fn(&Receiver) -> f64| {
            let mut column: Column = [[0.0; BUNDLE]; BUNDLES];
            column.as_flattened_mut().iter_mut().zip(&links).for_each(|(c, l)| *c = f(&l.receiver) as f32);
            column
        };
        let lift = |l: &Link| scene.geometry.lift(l.receiver.position, l.receiver.normal).as_vec3();
        let lifted: Vec<Vec3> = links.iter().map(lift).collect();
        Tile {
            depth,
            position: [column(&|r| r.position.x), column(&|r| r.position.y), column(&|r| r.position.z)],
            normal: [column(&|r| r.normal.x), column(&|r| r.normal.y), column(&|r| r.normal.z)],
            lifted: Points::new(&scene.geometry, &lifted),
            varying: Varying::new(scene, &links),
            constant,
            links,
            refused: Vec::new(),
        }
    }

    /// The same tile without the light of the shared points of emitters at some of its receivers: entry by entry the number of
    /// an emitter, and for each receiver whether it refuses.
    pub fn refusing(mut self, refused: impl Iterator<Item = (u32, Vec<bool>)>) -> Self {
        let lanes = |all: Vec<bool>| {
            let mut lanes: Lanes = [0; BUNDLES];
            for (i, refused) in all.into_iter().enumerate() {
                lanes[i / BUNDLE] |= u16::from(refused) << (i % BUNDLE);
            }
            lanes
        };
        self.refused = refused.map(|(emitter, all)| (emitter, lanes(all))).collect();
        self
    }

    /// The links, in the order in which they were given.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    #[inline(always)]
    pub(super) fn bundles(&self) -> usize {
        self.links.len().div_ceil(BUNDLE)
    }

    /// Adds what `vertex` gives each receiver, a constant response left out.
    #[inline(always)]
    fn add<I: Isa, const C: usize>(
        &self,
        scene: &Scene,
        (vertex, apex): (&Connector, &Apex),
        bound: f32,
        sums: &mut Sums<C>,
        scratch: &mut Scratch,
    ) {
        let mut factors: Column = [[0.0; BUNDLE]; BUNDLES];
        let mut seen: Lanes = [0; BUNDLES];
        self.factors::<I>(vertex, &mut factors, &mut seen);
        for (_, refused) in self.refused.iter().filter(|(emitter, _)| Some(*emitter) == vertex.emitter) {
            seen.iter_mut().zip(refused).for_each(|(seen, refused)| *seen &= !refused);
        }
        if seen == [0; BUNDLES] {
            return;
        }
        scene.geometry.hide(apex, &self.lifted, &mut seen, scratch);
        let veiled =
            scene.geometry.has_veils() && veils::let_through(scene, apex.at, &self.lifted, &seen, &mut sums.through);
        let through = veiled.then_some(&sums.through);
        // No continuation finds what came from a delta scatterer: all of it is connected.
        let bound = if vertex.after_delta { f32::INFINITY } else { bound };
        let carrying = Carrying { factors: &factors, seen: &seen, bound, through };
        self.spread::<I, C>(vertex, &carrying, &mut sums.light);
        if vertex.after_delta {
            sums.has_mirrored = true;
            self.spread::<I, C>(vertex, &carrying, &mut sums.mirrored);
        }
    }

    /// Geometric factors G without visibility; 0 where vertex or receiver faces away, and not `seen` \[1/m2\].
    #[inline(always)]
    fn factors<I: Isa>(&self, vertex: &Connector, factors: &mut Column, seen: &mut Lanes) {
        let (p, n) = (splat(vertex.position), splat(vertex.normal));
        let zero = I::Sixteen::splat(0.0);
        for bundle in 0..self.bundles().min(BUNDLES) {
            let w = sub(&lanes::<I>(&self.position, bundle), &p);
            let leaving = dot(&n, &w).max(zero);
            let arriving = zero.sub(dot(&lanes::<I>(&self.normal, bundle), &w)).max(zero);
            // A receiver at the vertex itself has no direction and gets nothing, not NaN.
            let inverse = I::Sixteen::splat(1.0).div(dot(&w, &w).max(I::Sixteen::splat(NOWHERE)));
            let factor = leaving.mul(inverse).mul(arriving.mul(inverse));
            factor.store(&mut factors[bundle]);
            seen[bundle] = zero.less(factor) as u16;
        }
    }

    /// Adds to `sums` what `vertex` sends each receiver seen, over its geometric factor up to the bound over the peaks of both
    /// laws.
    #[inline(always)]
    fn spread<I: Isa, const C: usize>(&self, vertex: &Connector, carrying: &Carrying<C>, sums: &mut [Column; C]) {
        if vertex.glossy.is_some() || self.varying.is_some() {
            return self.spread_varying::<I, C>(vertex, carrying, sums);
        }
        match carrying.through {
            None => self.spread_matt::<I, C>(vertex, carrying, sums),
            Some(through) => self.spread_through::<I, C>(vertex, carrying, through, sums),
        }
    }

    /// The same where both laws are matt and no veil is in the way.
    #[inline(always)]
    fn spread_matt<I: Isa, const C: usize>(&self, vertex: &Connector, carrying: &Carrying<C>, sums: &mut [Column; C]) {
        let Carrying { factors, seen, bound, .. } = *carrying;
        let most = I::Sixteen::splat(bound);
        for bundle in 0..self.bundles().min(BUNDLES) {
            let carried = I::Sixteen::load(&factors[bundle]).min(most).select(u32::from(seen[bundle]));
            for c in 0..C {
                let sum = I::Sixteen::load(&sums[c][bundle]);
                sum.add(carried.mul(I::Sixteen::splat(vertex.intensity[c]))).store(&mut sums[c][bundle]);
            }
        }
    }

    /// The same where veils let part of it `through`: a loop of its own, so that the other pays nothing for it.
    #[inline(always)]
    fn spread_through<I: Isa, const C: usize>(
        &self,
        vertex: &Connector,
        carrying: &Carrying<C>,
        through: &[Column; C],
        sums: &mut [Column; C],
    ) {
        let Carrying { factors, seen, bound, .. } = *carrying;
        let most = I::Sixteen::splat(bound);
        for bundle in 0..self.bundles().min(BUNDLES) {
            let carried = I::Sixteen::load(&factors[bundle]).min(most).select(u32::from(seen[bundle]));
            for c in 0..C {
                let sum = I::Sixteen::load(&sums[c][bundle]);
                let light = carried.mul(I::Sixteen::splat(vertex.intensity[c]));
                sum.add(light.mul(I::Sixteen::load(&through[c][bundle]))).store(&mut sums[c][bundle]);
            }
        }
    }

    /// The same where it needs the direction of each connection, at the vertex or at the receiver.
    #[inline(always)]
    fn spread_varying<I: Isa, const C: usize>(
        &self,
        vertex: &Connector,
        carrying: &Carrying<C>,
        sums: &mut [Column; C],
    ) {
        let Carrying { factors, seen, bound, through } = *carrying;
        let (p, n) = (splat(vertex.position), splat(vertex.normal));
        for bundle in 0..self.bundles().min(BUNDLES) {
            let here = u32::from(seen[bundle]);
            if here == 0 {
                continue;
            }
            let w = sub(&lanes::<I>(&self.position, bundle), &p);
            let length = dot(&w, &w).max(I::Sixteen::splat(NOWHERE)).sqrt();
            let w = scale(&w, I::Sixteen::splat(1.0).div(length));
            let (mut value, mut peak) = sent::<I, C>(vertex, &n, &w);
            if let Some(varying) = &self.varying {
                let from = scale(&w, I::Sixteen::splat(-1.0));
                let normal = lanes::<I>(&self.normal, bundle);
                let (response, of_receiver) = varying.respond::<I, C>(bundle, here, &normal, &from);
                for c in 0..C {
                    value[c] = value[c].mul(response[c]);
                }
                peak = peak.mul(of_receiver);
            }
            let carried = I::Sixteen::load(&factors[bundle]).min(I::Sixteen::splat(bound).div(peak));
            for c in 0..C {
                let sum = I::Sixteen::load(&sums[c][bundle]);
                let mut light = value[c].mul(carried);
                if let Some(through) = through {
                    light = light.mul(I::Sixteen::load(&through[c][bundle]));
                }
                sum.add(light.select(here)).store(&mut sums[c][bundle]);
            }
        }
    }
}

/// What connections from one vertex to a tile carry.
struct Carrying<'a, const C: usize> {
    /// Geometric factors G without visibility \[1/m2\].
    factors: &'a Column,
    seen: &'a Lanes,
    /// b where it applies \[1/m2\].
    bound: f32,
    /// What veils on the way let through, where there are any \[1\].
    through: Option<&'a [Column; C]>,
}

/// W f of `vertex` with the normal `n` along the unit vectors `w` \[lm/sr\], and the peak of f.
#[inline(always)]
fn sent<I: Isa, const C: usize>(
    vertex: &Connector,
    n: &Triple<I::Sixteen>,
    w: &Triple<I::Sixteen>,
) -> ([I::Sixteen; C], I::Sixteen) {
    let one = I::Sixteen::splat(1.0);
    let mut sent = [one; C];
    for c in 0..C {
        sent[c] = I::Sixteen::splat(vertex.intensity[c]);
    }
    let Some(glossy) = &vertex.glossy else { return (sent, one) };
    let mut through = [one; C];
    for c in 0..C {
        through[c] = I::Sixteen::splat(glossy.through[c]);
    }
    let f = glossy.law.evaluate::<I::Sixteen, C>(n, (&splat(glossy.from), &through), w);
    let peak = if glossy.is_peaked { weights_over_tolerated(&f) } else { one };
    for c in 0..C {
        sent[c] = f[c].mul(I::Sixteen::splat(glossy.weight[c]));
    }
    (sent, peak)
}
