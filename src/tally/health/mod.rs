//! Which intervals should not be trusted, and why: pure functions of what was counted.
//!
//! Every bin gets its [`Health`], a set of [`Mark`]s. A mark says that the interval may not hold what it promises;
//! no mark says that nothing suspicious was seen, which is necessary and not sufficient. The thresholds stand in
//! this file and nowhere else.
//!
//! | mark | code | set when | bins |
//! |---|---|---|---|
//! | no information | 1 | the receiver existed and no history ever reached it, or there is no batch | all |
//! | few batches | 2 | fewer than [`FEW_BATCHES`] | all |
//! | relative error | 4 | standard error over mean above [`RELATIVE_ERROR`] | all |
//! | peak | 8 | one history gave more than [`PEAK`] of the sum of all | all |
//! | vov | 16 | variance of the variance of the batch scores above [`VOV`], from [`VOV_BATCHES`] batches on | every batch kept |
//! | vov | 16 | variance of the variance of single histories above [`VOV`] | monitored |
//! | tail | 32 | slope of the tail of single histories at most [`SLOPE`], and this tail matters: the variance may be infinite | monitored |
//! | checks | 64 | [`FAILED_CHECKS`] or more of the first nine of the ten checks failed | monitored |
//! | caustic | 128 | light that no bound holds is above [`CAUSTIC`] standard errors, and fewer than [`LOBE`] histories fall in the narrowest lobe | all |
//!
//! A bin that is the same in every batch is known exactly and has no mark. One failed check is no mark: of healthy
//! runs some percent fail one by chance (`checks`).
//!
//! **Caustics** are what no sign of the scores can tell of: light of a lamp without extent in a narrow lobe, and light
//! from a mirror beside an edge. A run may contain none of the rare histories that carry them, and then looks at its healthiest. So
//! their size is estimated beforehand, as if lobes were matt, and compared with the error; it stops to matter once
//! enough histories, N alpha^2 of N, have fallen in the lobe. A mirror has alpha 0.
//!
//! **Single histories** tell more of the tail than batch scores, in quasi-random batches too: each point of a scrambled
//! set has by itself the density of random sampling. Their VOV says nothing there about the error of the mean, but does
//! say whether a few histories make up the variance. A slope is fitted to the shape of the largest totals whatever their
//! size; where the VOV is below [`NEGLIGIBLE_VOV`] they make up so little of the variance that their slope is no matter.
//! How often the marks are right is measured in docs/coverage.md.

pub mod checks;
mod signs;
pub mod tail;

pub use signs::{Common, Counted, Examined, Signs};

/// Below this number of batches an interval is marked: Student's quantile is then more than 9 % wider than a normal
/// one, and batch means of skewed scores cover less than they promise.
pub const FEW_BATCHES: u64 = 16;
/// Largest relative error that is not marked \[1\].
pub const RELATIVE_ERROR: f64 = 0.1;
/// Largest share of one history in the sum of all that is not marked \[1\].
pub const PEAK: f64 = 0.05;
/// Largest variance of the variance, of batch scores or of single histories, that is not marked \[1\].
pub const VOV: f64 = 0.1;
/// Batches from which on the variance of the variance of batch scores says something: of n normal scores it is
/// about 2/n.
pub const VOV_BATCHES: u64 = 50;
/// Slope of a tail at and below which its variance is infinite.
pub const SLOPE: f64 = 3.0;
/// Variance of the variance of single histories up to which the slope of their tail is no matter \[1\]: where the
/// variance is infinite it stays near 0.1 and above, however many they are.
pub const NEGLIGIBLE_VOV: f64 = 0.02;
/// Largest light that no bound holds and that is not marked \[standard errors\]: if all of it were missing, an interval of
/// 95 % would be off by a tenth of its half-width.
pub const CAUSTIC: f64 = 0.2;
/// Histories in the narrowest lobe, N alpha^2, from which on its caustics are known well.
pub const LOBE: f64 = 30.0;
/// Failed checks, of the first nine, that make a mark.
pub const FAILED_CHECKS: usize = 3;

/// A reason not to trust an interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// No history ever reached the receiver.
    NoInformation,
    /// Too few batches.
    FewBatches,
    /// A large relative error.
    RelativeError,
    /// One history is a large part of the result.
    Peak,
    /// The variance is itself uncertain.
    Vov,
    /// The density of single histories falls off too slowly.
    Tail,
    /// Several of the ten checks failed.
    Checks,
    /// Light that no bound holds, met by few histories.
    Caustic,
}

impl Mark {
    /// All marks in the order of their codes.
    pub const ALL: [Mark; 8] = [
        Mark::NoInformation,
        Mark::FewBatches,
        Mark::RelativeError,
        Mark::Peak,
        Mark::Vov,
        Mark::Tail,
        Mark::Checks,
        Mark::Caustic,
    ];

    /// A power of two.
    pub fn code(self) -> u32 {
        1 << self as u32
    }

    /// One or two words.
    pub fn word(self) -> &'static str {
        match self {
            Mark::NoInformation => "no information",
            Mark::FewBatches => "few batches",
            Mark::RelativeError => "relative error",
            Mark::Peak => "peak",
            Mark::Vov => "vov",
            Mark::Tail => "tail",
            Mark::Checks => "checks",
            Mark::Caustic => "caustic",
        }
    }
}

/// A set of marks; empty for an interval against which nothing is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Health(u32);

impl Health {
    /// Sum of the codes of the marks; 0 when there is none.
    pub fn code(self) -> u32 {
        self.0
    }

    /// True without a mark.
    pub fn is_healthy(self) -> bool {
        self.0 == 0
    }

    /// Whether `mark` is set.
    pub fn has(self, mark: Mark) -> bool {
        self.0 & mark.code() != 0
    }

    /// The marks of both.
    pub fn and(self, other: Health) -> Health {
        Health(self.0 | other.0)
    }

    /// The marks that are set.
    pub fn marks(self) -> impl Iterator<Item = Mark> {
        Mark::ALL.into_iter().filter(move |&mark| self.has(mark))
    }
}

/// The marks that `signs` set.
pub fn health(signs: &Signs) -> Health {
    let few = Mark::FewBatches.code() * u32::from(signs.batches < FEW_BATCHES);
    if !signs.informed {
        return Health(Mark::NoInformation.code() | few);
    }
    if signs.relative_error == 0.0 {
        return Health::default();
    }
    let set = |mark: Mark| match mark {
        Mark::NoInformation => false,
        Mark::FewBatches => signs.batches < FEW_BATCHES,
        Mark::RelativeError => signs.relative_error > RELATIVE_ERROR,
        Mark::Peak => signs.peak > PEAK,
        Mark::Vov => (signs.batches >= VOV_BATCHES && signs.vov > VOV) || signs.history_vov > VOV,
        Mark::Tail => signs.slope.is_some_and(|slope| slope <= SLOPE) && signs.history_vov > NEGLIGIBLE_VOV,
        Mark::Checks => signs.failed_checks >= FAILED_CHECKS,
        Mark::Caustic => signs.caustic > CAUSTIC && signs.histories_in_lobe < LOBE,
    };
    Health(Mark::ALL.into_iter().filter(|&mark| set(mark)).map(Mark::code).sum())
}

#[cfg(test)]
mod tests;
