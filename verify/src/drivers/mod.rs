//! Driver programs: read events, call the generated code, write what it answers (see [`crate::protocol`]).

pub mod c;
pub mod rust;

use policy::Policy;

/// Whether `set_mapping` exists, and if it takes `r`.
fn mapping_terms(policy: &Policy) -> Option<usize> {
    policy
        .mapping
        .as_ref()
        .map(|mapping| if mapping.coefficients.r.is_some() { 4 } else { 3 })
}
