//! What one should know of the code of a policy, in words.

use std::fmt;
use std::path::Path;

use policy::{NumericFormat, Policy};
use report::{bytes, grouped, quantity};
use targets::{Fma, TargetSpec};

use crate::manifest::Sizes;

/// One sentence each, of the files of these names: where fused operations are no gain on the target, how far an integer network is
/// from overflow and from real arithmetic, and what was left out. `sizes` are those of the same policy and target.
#[must_use]
pub fn notes<'a>(
    policy: &Policy,
    target: &TargetSpec,
    sizes: &Sizes,
    files: impl IntoIterator<Item = &'a Path>,
) -> Vec<String> {
    let has_rust = files
        .into_iter()
        .any(|file| file.extension().is_some_and(|end| end == "rs"));
    let mut notes = fused(policy, target, has_rust);
    if let Some(bound) = sizes.accumulator_bound {
        notes.push(format!(
            "integer network: no 32-bit sum can overflow, the largest is {} of {} over the whole box of observations",
            grouped(bound.unsigned_abs()),
            grouped(u64::from(i32::MAX.unsigned_abs()))
        ));
    }
    let removed: usize = sizes.removed_neurons.iter().sum();
    if removed > 0 {
        let whole: usize = policy.layers.iter().map(|layer| layer.inputs * layer.outputs).sum();
        notes.push(format!(
            "{removed} neurons are 0 for every observation and left out: {} of {} MACs, the same bits",
            grouped(sizes.macs as u64),
            grouped(whole as u64)
        ));
    }
    if let Some(bound) = sizes.q_error_bound {
        notes.push(format!(
            "no Q value is further than {} from real arithmetic, for every observation the clips let through, however rare; \
             {}, and `policyc certify` says more",
            quantity(bound, "", 3),
            at_golden(policy)
        ));
    }
    if let Some(bound) = sizes.duty_error_bound {
        notes.push(format!(
            "no duty of the actor is further than {} from real arithmetic, for every observation the clips let through, however rare; \
             `policyc inspect` tells how far it is at the trainer's own observations, and `policyc certify` says more",
            quantity(bound, "", 3)
        ));
    }
    notes
}

/// Where it stands what the trainer's own observations lose.
fn at_golden(policy: &Policy) -> &'static str {
    match policy.golden {
        Some(_) => "what the trainer's own observations lose stands below `decisions` in `policyc inspect`",
        None => {
            "golden answers would tell what it changes where the converter lives (`policyc replay --golden` makes them of a log)"
        }
    }
}

/// Why fused operations are no gain on a processor, where they are none.
fn fused(policy: &Policy, target: &TargetSpec, has_rust: bool) -> Vec<String> {
    if policy.numeric_format != NumericFormat::F32Fma {
        return Vec::new();
    }
    let in_rust = has_rust.then(|| {
        "Rust has no fused multiply-add in `core`: the module computes it in software, many times slower than f32; take C".to_owned()
    });
    let on_target = match target.fma {
        Fma::Absent => Some(format!(
            "{} has no fused multiply-add; a library computes it, many times slower than f32",
            target.name
        )),
        Fma::Cycles { fused, apart } if fused >= apart => Some(format!(
            "on {} a fused multiply-add takes {fused} cycles, a product and a sum {apart}: f32 is faster",
            target.name
        )),
        _ => None,
    };
    [on_target, in_rust].into_iter().flatten().collect()
}

impl fmt::Display for Sizes {
    /// Work, tables and state: `1,312 MACs per step, 5.4 kB of tables, 64 B of state`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let macs = grouped(self.macs as u64);
        let (tables, state) = (bytes(self.table_bytes), bytes(self.state_bytes));
        write!(f, "{macs} MACs per step, {tables} of tables, {state} of state")
    }
}
