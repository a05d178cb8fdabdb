//! Single histories of the few bins whose intervals are examined closely. For diagnosis only: no interval comes from
//! them, since histories of a batch depend on each other.

/// What the histories of one batch gave one monitored bin.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Watched {
    /// The luminous total of every history, zeros included, in the order of the histories \[lx or cd/m2\].
    pub totals: Vec<f64>,
}
