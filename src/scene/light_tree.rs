//! Many sources of a kind as a tree, so that each receiver chooses for itself among them at the cost of a logarithm.
//!
//! Neighbours stand together: a node has a bound of what all its sources give, see [`Beam`]. From the root on, the samples of a receiver go to
//! the two halves of a node in proportion to their bounds for that receiver, as evenly as whole numbers allow; in a leaf to its sources in
//! proportion to flux. So the probability of a source is a product of known shares, whatever the bounds are, and no source from which
//! light may arrive has none.

use super::beam::Beam;
use super::choice::Choice;
use super::outlook::Outlook;
use crate::math::DVec3;
use std::ops::Range;

/// No more leaves than this.
const MOST: usize = 1 << 14;

/// A source that a sample has gone to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chosen {
    /// Its number.
    pub number: usize,
    /// The probability with which a sample goes to it.
    pub probability: f64,
    /// How far through its share of the samples this one is, 0 .. 1.
    pub within: f64,
}

/// All sources of a kind.
#[derive(Clone, Debug, Default)]
pub struct LightTree {
    /// Bounds of the nodes: each is followed by its left half, and that by the right one.
    beams: Vec<Beam>,
    /// Numbers of the sources, leaf by leaf.
    numbers: Vec<u32>,
    /// Their fluxes in the same order \[lm\].
    fluxes: Vec<f64>,
    /// Where a source stands in `numbers`.
    place: Vec<u32>,
    /// Sources of a leaf; the last may have fewer.
    size: usize,
}

/// A node: its own number, the leaves below it, and the probability of coming here.
#[derive(Clone)]
struct Node {
    beam: usize,
    leaves: Range<usize>,
    probability: f64,
}

impl Node {
    /// The two halves of a node that is no leaf, without their probabilities.
    fn halves(&self) -> [Node; 2] {
        let middle = self.leaves.start + self.leaves.len().div_ceil(2);
        let half = |beam: usize, leaves: Range<usize>| Node { beam, leaves, probability: 0.0 };
        let left = self.leaves.start..middle;
        let right = self.beam + 2 * left.len();
        [half(self.beam + 1, left), half(right, middle..self.leaves.end)]
    }
}

impl LightTree {
    /// The tree of the sources with these middles \[m\] and fluxes \[lm\], and with the bounds that `beam` says of their numbers.
    pub(super) fn new(middles: &[DVec3], fluxes: &Choice, beam: impl Fn(usize) -> Beam) -> LightTree {
        let size = middles.len().div_ceil(MOST).max(1);
        let mut numbers: Vec<u32> = (0..middles.len() as u32).collect();
        arrange(middles, &mut numbers, size);
        let mut place = vec![0; middles.len()];
        numbers.iter().enumerate().for_each(|(at, &number)| place[number as usize] = at as u32);
        let of_leaf =
            |some: &[u32]| Beam::of_all(&some.iter().map(|&number| beam(number as usize)).collect::<Vec<_>>());
        let leaves: Vec<Beam> = numbers.chunks(size).map(of_leaf).collect();
        let fluxes = numbers.iter().map(|&number| fluxes.weight(number as usize)).collect();
        let mut tree = LightTree { beams: Vec::new(), numbers, fluxes, place, size };
        if let Some(root) = tree.root() {
            tree.grow(&leaves, &root);
        }
        tree
    }

    /// Appends the bounds of `node` and of all below it, down to those of its `leaves`.
    fn grow(&mut self, leaves: &[Beam], node: &Node) {
        self.beams.push(Beam::of_all(&leaves[node.leaves.clone()]));
        if node.leaves.len() > 1 {
            node.halves().iter().for_each(|half| self.grow(leaves, half));
        }
    }

    fn root(&self) -> Option<Node> {
        let leaves = self.numbers.len().div_ceil(self.size.max(1));
        (leaves > 0).then_some(Node { beam: 0, leaves: 0..leaves, probability: 1.0 })
    }

    /// Where the sources of `node` stand in `numbers`.
    fn places(&self, node: &Node) -> Range<usize> {
        node.leaves.start * self.size..(node.leaves.end * self.size).min(self.numbers.len())
    }

    /// False where no light of any of them arrives.
    pub fn gives_light(&self, at: &Outlook) -> bool {
        self.beams.first().is_some_and(|all| at.bound(all) > 0.0)
    }

    /// The sources to which the samples of the receiver `at` go, one for each number of `jitter` in [0, 1): sample k stands at
    /// (k + jitter)/n of the whole. In the order of the tree; samples that would go to sources without light here are missing.
    pub fn choose(&self, at: &Outlook, jitter: &[f64]) -> Vec<Chosen> {
        let mut chosen = Vec::with_capacity(jitter.len());
        if let Some(root) = self.root() {
            Spread { tree: self, at, jitter }.over(&root, 0.0, 0..jitter.len(), &mut chosen);
        }
        chosen
    }

    /// Probability with which a sample of the receiver `at` goes to the source `number`.
    pub fn probability(&self, at: &Outlook, number: usize) -> f64 {
        let place = self.place[number] as usize;
        let Some(mut node) = self.root() else { return 0.0 };
        while node.leaves.len() > 1 {
            let [left, right] = self.shared(at, &node);
            node = if place / self.size < left.leaves.end { left } else { right };
        }
        node.probability * self.fluxes[place] / self.fluxes[self.places(&node)].iter().sum::<f64>()
    }

    /// The two halves of a node that is no leaf, with their probabilities; 0 for both where neither has light.
    fn shared(&self, at: &Outlook, node: &Node) -> [Node; 2] {
        let [mut left, mut right] = node.halves();
        let [here, there] = [&left, &right].map(|half| at.bound(&self.beams[half.beam]));
        if here + there > 0.0 {
            let share = here / (here + there);
            left.probability = node.probability * share;
            right.probability = node.probability * (1.0 - share);
        }
        [left, right]
    }
}

/// How the samples of a receiver go.
struct Spread<'a> {
    tree: &'a LightTree,
    at: &'a Outlook,
    /// Where each sample stands in its part of the whole.
    jitter: &'a [f64],
}

impl Spread<'_> {
    /// Samples `some` go to `node`, whose share of the whole begins at `from`.
    fn over(&self, node: &Node, from: f64, some: Range<usize>, chosen: &mut Vec<Chosen>) {
        if some.is_empty() || node.probability == 0.0 {
            return;
        }
        if node.leaves.len() == 1 {
            return chosen.extend(some.map(|k| self.in_leaf(node, from, k)));
        }
        let [left, right] = self.tree.shared(self.at, node);
        let middle = from + left.probability;
        let first = if right.probability == 0.0 { some.end } else { self.first_behind(middle) };
        let first = first.clamp(some.start, some.end);
        self.over(&left, from, some.start..first, chosen);
        self.over(&right, middle, first..some.end, chosen);
    }

    /// The first sample that is not before `target` in [0, 1].
    fn first_behind(&self, target: f64) -> usize {
        let place = target * self.jitter.len() as f64;
        let k = place as usize;
        let is_before = self.jitter.get(k).is_some_and(|jitter| *jitter < place - k as f64);
        if is_before { k + 1 } else { k }
    }

    /// The source of a leaf to which sample `k` goes.
    fn in_leaf(&self, node: &Node, from: f64, k: usize) -> Chosen {
        let at = (k as f64 + self.jitter[k]) / self.jitter.len() as f64;
        let share = ((at - from) / node.probability).clamp(0.0, 1.0);
        let places = self.tree.places(node);
        let fluxes = &self.tree.fluxes[places.clone()];
        let all: f64 = fluxes.iter().sum();
        let mut left = share * all;
        let mut at = 0;
        // Rounding may leave a rest behind the last one.
        while at + 1 < fluxes.len() && left >= fluxes[at] {
            left -= fluxes[at];
            at += 1;
        }
        let within = (left / fluxes[at]).clamp(0.0, 1.0);
        let number = self.tree.numbers[places.start + at] as usize;
        Chosen { number, probability: node.probability * fluxes[at] / all, within }
    }
}

/// Puts `numbers` in an order in which the two halves of each node lie apart.
fn arrange(middles: &[DVec3], numbers: &mut [u32], size: usize) {
    let leaves = numbers.len().div_ceil(size);
    if leaves < 2 {
        return;
    }
    let at = |number: &u32| middles[*number as usize];
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = numbers.iter().fold(empty, |(low, high), number| (low.min(at(number)), high.max(at(number))));
    let axis = (high - low).max_position();
    let middle = leaves.div_ceil(2) * size;
    numbers.select_nth_unstable_by(middle, |a, b| at(a)[axis].total_cmp(&at(b)[axis]).then(a.cmp(b)));
    let (left, right) = numbers.split_at_mut(middle);
    arrange(middles, left, size);
    arrange(middles, right, size);
}

#[cfg(test)]
mod tests {
    use super::super::light::Light;
    use super::*;
    use crate::photometry::Colour;
    use crate::random::{Domain, Generator, Stream, sphere};

    fn random(name: &str) -> Generator {
        Stream::new(5, Domain::Pilot, name).generator(0)
    }

    fn place(rng: &mut Generator) -> DVec3 {
        8.0 * DVec3::new(rng.uniform(), rng.uniform(), 0.1 * rng.uniform())
    }

    /// So many spots of unlike strength in a slab.
    fn spots(count: usize) -> (Vec<Light>, LightTree) {
        let mut rng = random("spots");
        let spot = |i: usize| {
            let (position, direction) = (place(&mut rng), sphere(rng.uniform2()));
            Light::Spot { position, direction, intensity: Colour::grey((1 + i % 5) as f64), inner: 0.4, outer: 0.9 }
        };
        let lights: Vec<Light> = (0..count).map(spot).collect();
        let middles: Vec<DVec3> = lights.iter().map(|l| l.at(DVec3::ONE).0.unwrap()).collect();
        let fluxes = Choice::by_flux(lights.iter().map(|l| l.flux(1.0)));
        let tree = LightTree::new(&middles, &fluxes, |i| Beam::of_light(&lights[i]).unwrap());
        (lights, tree)
    }

    #[test]
    fn sources_are_chosen_as_often_as_their_probability_says() {
        for count in [1, 2, 7, 100] {
            let (_, tree) = spots(count);
            let mut rng = random("receivers");
            for _ in 0..20 {
                let at = Outlook::of_point(place(&mut rng) - DVec3::Z, sphere(rng.uniform2()));
                let samples = 20_000;
                let jitter: Vec<f64> = (0..samples).map(|_| rng.uniform()).collect();
                let chosen = tree.choose(&at, &jitter);
                let mut counts = vec![0; count];
                for c in &chosen {
                    counts[c.number] += 1;
                    assert!((c.probability - tree.probability(&at, c.number)).abs() <= 1e-12, "{c:?}");
                    assert!((0.0..=1.0).contains(&c.within));
                }
                for (number, count) in counts.into_iter().enumerate() {
                    let expected = f64::from(samples) * tree.probability(&at, number);
                    assert!((f64::from(count) - expected).abs() <= 2.0, "{number}: {count}, not {expected}");
                }
                let all: f64 = (0..count).map(|number| tree.probability(&at, number)).sum();
                // Less than 1 where a group has light for the receiver and none of its parts has.
                assert!(all <= 1.0 + 1e-12 && (all > 0.0 || chosen.is_empty()), "{all}");
            }
        }
    }

    #[test]
    fn no_source_from_which_light_arrives_is_left_out() {
        let (lights, tree) = spots(300);
        let mut rng = random("receivers");
        let mut lit = 0;
        for _ in 0..2000 {
            let (position, normal) = (place(&mut rng) - DVec3::Z, sphere(rng.uniform2()));
            let at = Outlook::of_point(position, normal);
            let given = |light: &Light| {
                let (_, w_in, across) = light.at(position);
                across.luminance() * (-normal.dot(w_in)).max(0.0)
            };
            for (number, _) in lights.iter().enumerate().filter(|(_, light)| given(light) > 0.0) {
                assert!(tree.probability(&at, number) > 0.0, "{number} at {position}");
                lit += 1;
            }
        }
        assert!(lit > 10_000, "{lit}");
    }

    /// Standard deviation of one sample over the sum of all, and the greatest sample over it, found by asking all.
    fn scatter(lights: &[Light], tree: &LightTree, position: DVec3, normal: DVec3) -> (f64, f64) {
        let at = Outlook::of_point(position, normal);
        let (mut all, mut squares, mut most) = (0.0, 0.0, 0f64);
        for (number, light) in lights.iter().enumerate() {
            let (_, w_in, across) = light.at(position);
            let given = across.luminance() * (-normal.dot(w_in)).max(0.0);
            if given > 0.0 {
                let sample = given / tree.probability(&at, number);
                (all, squares, most) = (all + given, squares + given * sample, most.max(sample));
            }
        }
        ((squares / (all * all) - 1.0).max(0.0).sqrt(), most / all)
    }

    #[test]
    fn a_sample_of_a_thousand_luminaires_is_near_their_sum() {
        // 60 x 40 m of small Lambert surfaces that look down, 1.5 m apart.
        let place = |i: usize| DVec3::new(1.5 * (i % 40) as f64, 5.5, 1.6 * (i / 40) as f64);
        let (direction, intensity) = (DVec3::NEG_Y, Colour::WHITE);
        let lamp = |i| Light::CosPower { position: place(i), direction, intensity, exponent: 1.0 };
        let lights: Vec<Light> = (0..1000).map(lamp).collect();
        let middles: Vec<DVec3> = (0..1000).map(place).collect();
        let fluxes = Choice::by_flux(lights.iter().map(|l| l.flux(1.0)));
        let tree = LightTree::new(&middles, &fluxes, |i| Beam::of_light(&lights[i]).unwrap());
        // The last: 30 cm below their plane, where cosines are small and the nearest is no longer a part of many.
        for (y, normal, sd, most) in [(0.8, DVec3::Y, 0.4, 2.0), (2.0, DVec3::Z, 1.1, 5.5), (5.2, DVec3::Y, 4.2, 29.0)]
        {
            let place = |k: u32| DVec3::new(1.37 * f64::from(k) + 2.0, y, 0.9 * f64::from(k) + 1.0);
            let found: Vec<(f64, f64)> = (0..40).map(|k| scatter(&lights, &tree, place(k), normal)).collect();
            let worst = found.iter().fold((0.0, 0.0), |a, b| (f64::max(a.0, b.0), f64::max(a.1, b.1)));
            assert!(worst.0 < sd && worst.1 < most, "{y} {normal}: {worst:?}");
        }
    }

    #[test]
    fn more_sources_than_leaves_are_chosen_by_flux_in_their_leaf() {
        let count = 3 * MOST + 5;
        let mut rng = random("many");
        let middles: Vec<DVec3> = (0..count).map(|_| place(&mut rng)).collect();
        let fluxes = Choice::new((0..count).map(|i| (1 + i % 4) as f64).collect());
        let light = Light::Omni { position: DVec3::ZERO, intensity: Colour::WHITE };
        let tree = LightTree::new(&middles, &fluxes, |_| Beam::of_light(&light).unwrap());
        let at = Outlook::of_point(DVec3::NEG_Z, DVec3::Z);
        let all: f64 = (0..count).map(|number| tree.probability(&at, number)).sum();
        assert!((all - 1.0).abs() < 1e-9, "{all}");
        assert!(tree.beams.len() < 2 * MOST);
        let chosen = tree.choose(&at, &[0.5; 1000]);
        assert!(chosen.len() == 1000 && chosen.windows(2).all(|c| c[0].number != c[1].number));
    }
}
