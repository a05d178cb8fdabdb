//! Systematic choice: things in a fixed order, each chosen in proportion to its worth, by one uniform number u.
//!
//! With W_i the sum of the worths up to thing i, and a step D, thing i is chosen once for each of u D, (u + 1) D, ... that
//! lies in [W_(i-1), W_i). That is w_i/D times on average, so that a weight of D/w_i for each time keeps the mean of
//! every sum over the things; and neighbours in the order stand for each other.

/// A choice under way.
pub struct Systematic {
    step: f64,
    next: f64,
    passed: f64,
}

impl Systematic {
    /// A choice of one for each `step` of worth; `start` is u, in [0, 1).
    pub fn new(step: f64, start: f64) -> Self {
        Systematic { step, next: step * start, passed: 0.0 }
    }

    /// How many times the next thing, of that `worth`, is chosen.
    pub fn times(&mut self, worth: f64) -> u32 {
        self.passed += worth;
        let mut times = 0;
        while self.next < self.passed {
            self.next += self.step;
            times += 1;
        }
        times
    }

    /// Passes the next things, of that `worth` together, if none of them is chosen; returns whether it did.
    pub fn skips(&mut self, worth: f64) -> bool {
        let skips = self.next >= self.passed + worth;
        if skips {
            self.passed += worth;
        }
        skips
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Domain, Stream};

    const WORTHS: [f64; 6] = [0.5, 3.0, 0.0, 0.25, 1.25, 2.0];

    /// How often each is chosen, one for a unit of worth; the runs of three are skipped together where that is possible.
    fn choose(index: u64, skipping: bool) -> Vec<u32> {
        let mut choice = Systematic::new(1.0, Stream::new(1, Domain::Choice, "").generator(index).uniform());
        let of_run = |run: &[f64]| {
            if skipping && choice.skips(run.iter().sum()) {
                return vec![0; run.len()];
            }
            run.iter().map(|&worth| choice.times(worth)).collect()
        };
        WORTHS.chunks(3).flat_map(of_run).collect()
    }

    #[test]
    fn each_is_chosen_as_often_as_it_is_worth() {
        const STARTS: u64 = 4000;
        let all: Vec<Vec<u32>> = (0..STARTS).map(|index| choose(index, false)).collect();
        for (i, worth) in WORTHS.into_iter().enumerate() {
            let mean = all.iter().map(|chosen| f64::from(chosen[i])).sum::<f64>() / STARTS as f64;
            // A count is one of two neighbouring numbers, so its variance is 1/4 at most.
            assert!((mean - worth).abs() < 4.0 * 0.5 / (STARTS as f64).sqrt(), "{mean} times for {worth}");
        }
        assert!(all.iter().all(|chosen| chosen.iter().sum::<u32>() == 7));
    }

    #[test]
    fn what_is_skipped_is_what_would_not_be_chosen() {
        assert!((0..1000).all(|index| choose(index, true) == choose(index, false)));
    }
}
