//! A choice among things with weights, by a running sum.

use crate::photometry::Colour;

/// A choice among things with weights.
#[derive(Clone, Debug, Default)]
pub struct Choice {
    weights: Vec<f64>,
    sums: Vec<f64>,
}

impl Choice {
    /// In proportion to `weights`, none of them negative.
    pub fn new(weights: Vec<f64>) -> Self {
        let add = |sum: &mut f64, weight: &f64| {
            *sum += weight;
            Some(*sum)
        };
        let sums = weights.iter().scan(0.0, add).collect();
        Choice { weights, sums }
    }

    /// In proportion to luminous flux.
    pub(super) fn by_flux(fluxes: impl Iterator<Item = Colour>) -> Self {
        Choice::new(fluxes.map(Colour::luminance).collect())
    }

    /// Number of things.
    pub fn len(&self) -> usize {
        self.weights.len()
    }

    /// True where there is nothing to choose.
    pub fn is_empty(&self) -> bool {
        self.weights.is_empty()
    }

    /// Sum of the weights.
    pub fn all(&self) -> f64 {
        self.sums.last().copied().unwrap_or(0.0)
    }

    /// The weight of the thing `number`.
    pub fn weight(&self, number: usize) -> f64 {
        self.weights[number]
    }

    /// The number of the thing in whose share of the running sum `target` lies.
    pub fn at(&self, target: f64) -> usize {
        let number = self.sums.partition_point(|&sum| sum <= target);
        // Rounding may put the target behind the last share; things without weight may stand there.
        if number < self.sums.len() { number } else { self.sums.partition_point(|&sum| sum < self.all()) }
    }

    /// The number of the thing that `u` in [0, 1) chooses.
    pub fn choose(&self, u: f64) -> usize {
        self.at(u * self.all())
    }

    /// Probability with which the thing `number` is chosen.
    pub fn probability(&self, number: usize) -> f64 {
        self.weights[number] / self.all()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn things_are_chosen_by_their_shares_and_none_without_weight() {
        let choice = Choice::new(vec![0.0, 1.0, 0.0, 3.0, 0.0]);
        assert_eq!([0.0, 0.125, 0.25, 0.625].map(|u| choice.choose(u)), [1, 1, 3, 3]);
        assert_eq!([choice.at(4.0), choice.at(5.0)], [3, 3]);
        assert_eq!([0, 1, 3].map(|i| choice.probability(i)), [0.0, 0.25, 0.75]);
        assert!(Choice::default().is_empty() && Choice::default().all() == 0.0);
    }
}
