//! Which of many lights some neighbouring receivers ask, here called a tile.
//!
//! Each light j has a bound B_j of what it can give anywhere in the tile, and is asked with the probability p_j = min(1, c B_j), where the
//! p_j add up to the number of lights wanted; what it gives counts 1/p_j. The strong ones are asked for certain, and are exact.
//! Those asked are found by one number u: light j lies on the interval [p_1 + .. + p_(j-1), .. + p_j) and is asked if a number of u + Z
//! does (systematic sampling). So each is asked with its p_j, the mean is that of asking all, and as many are asked
//! as are wanted, spread over the list of lights.
//!
//! A light is left out only where nothing of it can arrive: below the horizon of the whole tile, or outside a cone that ends.

use super::receiver::Receiver;
use crate::random::Generator;
use crate::scene::{Outlook, Scene};

/// So many lights, or fewer, are all asked.
const FEW: usize = 16;
/// Lights chosen where a rough mean is enough.
const ROUGHLY: u32 = 8;

/// A light to be asked: its number, and what its light is multiplied by.
pub type Asked = (usize, f64);

/// The lights that `receivers` ask, `wanted` on the average besides parallel light; all where there are no more, or few.
///
/// A number is drawn where there is a choice.
pub fn ask(scene: &Scene, receivers: &[Receiver], wanted: u64, rng: &mut Generator) -> Vec<Asked> {
    if !is_choice(scene, wanted) {
        return all(scene);
    }
    let tile = Outlook::of(receivers.iter().map(|r| (r.position, r.normal)));
    let bounds: Vec<f64> =
        scene.sources.beams().iter().map(|b| b.as_ref().map_or(f64::INFINITY, |b| tile.bound(b))).collect();
    systematic(&probabilities(&bounds, wanted as f64), rng.uniform())
}

/// True where there are more lights than are wanted, and more than few.
pub fn is_choice(scene: &Scene, wanted: u64) -> bool {
    let lights = scene.sources.lights.len();
    lights > FEW && lights as u64 > wanted
}

/// All lights.
pub fn all(scene: &Scene) -> Vec<Asked> {
    (0..scene.sources.lights.len()).map(|light| (light, 1.0)).collect()
}

/// All lights, or of many the parallel ones and some of the others chosen in proportion to flux alone: cheap, for one receiver, where a
/// rough mean is enough.
pub fn some_by_flux(scene: &Scene, rng: &mut Generator) -> Vec<Asked> {
    if scene.sources.lights.len() <= FEW {
        return all(scene);
    }
    let (among, beams) = (scene.sources.lights_by_flux(), scene.sources.beams());
    let parallel = (0..beams.len()).filter(|&light| beams[light].is_none()).map(|light| (light, 1.0));
    let mut asked: Vec<Asked> = parallel.collect();
    let u = rng.uniform();
    // Under a sky parallel light has no flux of its own here.
    let others = if among.all() > 0.0 { ROUGHLY } else { 0 };
    for k in 0..others {
        let light = among.choose((f64::from(k) + u) / f64::from(ROUGHLY));
        if beams[light].is_some() {
            asked.push((light, 1.0 / (f64::from(ROUGHLY) * among.probability(light))));
        }
    }
    asked
}

/// The probabilities for `bounds`, in proportion to them and at most 1, that add up to `wanted`: infinite bounds are certain besides.
fn probabilities(bounds: &[f64], wanted: f64) -> Vec<f64> {
    let mut certain: Vec<bool> = bounds.iter().map(|bound| bound.is_infinite()).collect();
    let mut left = wanted;
    // Each round makes at least one more light certain.
    let scale = loop {
        let rest: f64 = bounds.iter().zip(&certain).filter(|(_, certain)| !**certain).map(|(bound, _)| bound).sum();
        let scale = if rest > 0.0 { left / rest } else { 0.0 };
        let before = left;
        for (bound, certain) in bounds.iter().zip(&mut certain) {
            if !*certain && bound * scale >= 1.0 {
                *certain = true;
                left -= 1.0;
            }
        }
        if left == before {
            break scale;
        }
    };
    bounds.iter().zip(&certain).map(|(bound, certain)| if *certain { 1.0 } else { bound * scale }).collect()
}

/// Those asked: each with its probability, by one uniform number.
fn systematic(probabilities: &[f64], u: f64) -> Vec<Asked> {
    let mut asked = Vec::new();
    let mut next = u;
    for (light, &p) in probabilities.iter().enumerate() {
        if p >= 1.0 {
            asked.push((light, 1.0));
        } else if next < p {
            asked.push((light, 1.0 / p));
            next += 1.0 - p;
        } else {
            next -= p;
        }
    }
    asked
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_add_up_to_what_is_wanted_and_the_strong_are_certain() {
        let p = probabilities(&[100.0, 1.0, 2.0, 0.0, 1.0, f64::INFINITY], 2.0);
        assert_eq!(p, [1.0, 0.25, 0.5, 0.0, 0.25, 1.0]);
        // More are wanted than there are: all that give light.
        assert_eq!(probabilities(&[1.0, 2.0, 0.0], 5.0), [1.0, 1.0, 0.0]);
        assert_eq!(probabilities(&[0.0, 0.0], 5.0), [0.0, 0.0]);
    }

    #[test]
    fn each_is_asked_with_its_probability_and_counts_its_inverse() {
        let p = [0.2, 1.0, 0.35, 0.0, 0.45, 0.8, 0.2];
        let mut asked = [0.0; 7];
        let n = 4000;
        for k in 0..n {
            let chosen = systematic(&p, (f64::from(k) + 0.5) / f64::from(n));
            assert_eq!(chosen.len(), 3, "one for certain, and two of those that add up to 2");
            for (light, weight) in chosen {
                assert_eq!(weight, 1.0 / p[light]);
                asked[light] += weight / f64::from(n);
            }
        }
        for (light, mean) in asked.into_iter().enumerate() {
            let expected = if p[light] > 0.0 { 1.0 } else { 0.0 };
            assert!((mean - expected).abs() < 2e-3, "light {light}: {mean}");
        }
    }
}
