//! The network: what is left of it behind dead neurons, in floats or in integers.

use policy::Policy;
use targets::TargetSpec;

use super::simplify::{self, Simplified};
use super::{integer, real};
use crate::output::Language;
use crate::program::{Network, Table};

/// The network in the policy's numeric format, and its tables.
pub fn lower(policy: &Policy, target: &TargetSpec, language: Language) -> (Network, Vec<Table>) {
    let Simplified { policy, scales } = simplify::simplified(policy);
    match scales {
        Some(scales) => integer::lower(&policy, &scales, target, language),
        None => real::lower(&policy, target, language),
    }
}
