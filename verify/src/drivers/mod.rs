//! Driver programs: read events, call the generated code, write what it answers (see [`crate::protocol`]).

pub mod c;
pub mod kit;
pub mod measure;
pub mod rust;

use policy::Policy;

/// What a driver stands on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// The standard library of this machine.
    Hosted,
    /// `board.h` of the crate `targets`. Emulated floats are slow, so that the purity of `eval` is looked at in every
    /// sixteenth step only.
    Board,
}

impl Form {
    /// Steps from one look at the purity of `eval` to the next, less one: a mask of the step counter.
    fn purity_mask(self) -> u32 {
        match self {
            Self::Hosted => 0,
            Self::Board => 15,
        }
    }
}

/// Whether `set_mapping` exists, and if it takes `r`.
fn mapping_terms(policy: &Policy) -> Option<usize> {
    policy
        .mapping
        .as_ref()
        .map(|mapping| if mapping.coefficients.r.is_some() { 4 } else { 3 })
}
