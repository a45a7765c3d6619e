//! Driver programs: read events, call the generated code, write what it answers (see [`crate::protocol`]).

pub mod c;
pub mod kit;
pub mod measure;
pub mod rust;

use policy::{DutyPath, Policy};

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

/// An output whose mapping can be set.
struct Settable {
    /// Index among the outputs.
    output: usize,
    /// Function that sets it, without the policy's name.
    function: String,
    /// Whether it takes `r`.
    has_product: bool,
}

fn settable(policy: &Policy) -> Vec<Settable> {
    let paths = policy.paths();
    let one = |(output, path): (usize, &DutyPath<'_>)| {
        Some(Settable {
            output,
            function: path.named("set_mapping"),
            has_product: path.mapping?.coefficients.r.is_some(),
        })
    };
    paths.iter().enumerate().filter_map(one).collect()
}
