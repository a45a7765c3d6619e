//! What is open without golden vectors.

use policy::Policy;

/// In one sentence, with what would show it. A log is named only where `replay --golden` takes it.
#[must_use]
pub fn unproven(policy: &Policy) -> String {
    let log = match policy.log_tells_answers() {
        true => ", or of its log (`policyc replay --golden`)",
        false => "",
    };
    format!(
        "no golden vectors: nothing shows that the weights were read as the trainer meant; answers of the trainer do{log}"
    )
}
