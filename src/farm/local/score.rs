//! What histories give a bin, or a path of its continuation.

use crate::photometry::Colour;
use crate::tally::{Scores, Watched};
use crate::transport::connection::Connected;

/// What histories give \[lx or cd/m2\]: sums over them, at last their mean.
#[derive(Clone, Debug, Default)]
pub(super) struct Score {
    /// All of it.
    connected: Colour,
    /// The largest luminous total of a single history.
    peak: f64,
    /// As [`crate::transport::continuation::Continuation::caustic`].
    pub caustic: f64,
    /// Of `connected`, the luminous part by vertices that a delta scatterer lit straight.
    mirrored: f64,
    /// Of `connected`, the luminous part that came by continuations.
    continued: f64,
    /// The luminous total of every history, where it is wanted.
    watched: Option<Vec<f64>>,
}

impl Score {
    /// Nothing yet; the totals of so many histories are wanted, or of none.
    pub fn nothing(watched: Option<usize>) -> Self {
        Score { watched: watched.map(|histories| vec![0.0; histories]), ..Score::default() }
    }

    /// True when the total of every history is wanted.
    pub fn is_watched(&self) -> bool {
        self.watched.is_some()
    }

    /// Takes in what the histories from `first` on give a link that lies `depth` reflections before the receiver.
    pub fn add(&mut self, connected: &Connected, depth: u32, first: usize) {
        self.connected += connected.sum;
        // Of several receivers of a bin one history has at most the sum.
        self.peak = if depth == 0 { self.peak + connected.peak } else { self.peak.max(connected.peak) };
        self.mirrored += connected.mirrored;
        if depth > 0 {
            self.continued += connected.sum.luminance();
        }
        self.watch(connected.totals.as_deref(), first, 1.0);
    }

    /// Takes in what the histories from `first` on give a path, `factor` times.
    pub fn add_path(&mut self, path: &Score, factor: Colour, first: usize) {
        let (light, given) = (path.connected.luminance(), path.connected * factor);
        let factor = if light > 0.0 { given.luminance() / light } else { factor.luminance() };
        self.connected += given;
        self.peak = self.peak.max(factor * path.peak);
        self.caustic += factor * path.caustic;
        self.mirrored += factor * path.mirrored;
        self.continued += factor * path.continued;
        self.watch(path.watched.as_deref(), first, factor);
    }

    fn watch(&mut self, totals: Option<&[f64]>, first: usize, factor: f64) {
        if let (Some(watched), Some(totals)) = (&mut self.watched, totals) {
            watched[first..].iter_mut().zip(totals).for_each(|(watched, total)| *watched += factor * total);
        }
    }

    /// From sums over histories to their mean: `share` is one over their number.
    pub fn finish(&mut self, share: f64) {
        // Of what a mirror sends to the surfaces around the receiver no bound holds the share that continuations bring of
        // all other light. Nothing was mirrored where nothing came at all.
        let unbounded =
            if self.mirrored > 0.0 { self.mirrored * self.continued / self.connected.luminance() } else { 0.0 };
        self.caustic = (self.caustic + unbounded) * share;
        self.connected *= share;
    }

    /// Writes the score to the place of `bin` in those of its set, which watches the bins in `monitored`; `direct` is the light
    /// that came without histories, `existed` whether a surface that reflects was there.
    pub fn write(self, (direct, existed): (Colour, bool), bin: u32, monitored: &[u32], scores: &mut Scores) {
        if let (Ok(place), Some(totals)) = (monitored.binary_search(&bin), self.watched) {
            scores.watched[place] = Watched { totals };
        }
        let bin = bin as usize;
        let value = direct + self.connected;
        scores.value[bin] = value.luminance();
        scores.direct[bin] = direct.luminance();
        scores.peak[bin] = self.peak;
        scores.caustic[bin] = self.caustic;
        scores.existed[bin] = existed;
        if let Some(colour) = scores.colour.get_mut(bin) {
            *colour = value.0;
        }
    }
}
