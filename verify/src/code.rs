//! The generated code of a policy as `policyc compile` makes it, and what there is to say of it.

use std::path::Path;

use codegen::output::with_cores;
use codegen::{Output, manifest};
use interp::decisions::{Decisions, decisions};
use interp::golden::{golden_result, unproven};
use policy::Policy;
use targets::TargetSpec;
use toml_input::{Faults, Message};

use crate::session::Files;
use crate::{kit, text};

/// Generated files.
#[derive(Debug, Clone)]
pub struct Code {
    /// What was made: what was asked for, and the cores that it calls.
    pub outputs: Vec<Output>,
    /// Texts by name.
    pub files: Files,
    /// What the format does to the trainer's decisions, in words; empty where floats change none.
    pub decisions: Vec<String>,
}

/// [`Code::decisions`] as notes beside others, without a mark of their own.
pub fn decision_notes(decisions: &[String]) -> impl Iterator<Item = String> {
    let told = |line: &String| line.trim().trim_start_matches("note: ").to_owned();
    decisions.iter().map(told)
}

/// Generates the files of `emit`; `kit_steps` control steps are in a kit. `golden_decisions`: share of the golden decisions that the
/// numeric format may change, 0..1; nothing: as the contract says.
///
/// # Errors
/// If the network does not give the trainer's answers, the format changes too many of them, or an output cannot be made.
pub fn make(
    policy: &Policy,
    target: &TargetSpec,
    emit: &[Output],
    kit_steps: u32,
    golden_decisions: Option<f64>,
) -> Result<Code, Faults> {
    let decisions = accepted(policy, golden_decisions)?;
    let outputs = with_cores(emit);
    let expected = kit::expected(policy, target, &outputs, kit_steps)?;
    let files = codegen::generate(policy, target, &outputs, expected.as_ref())?.files;
    Ok(Code {
        outputs,
        files,
        decisions,
    })
}

/// What the user should know of the policy and its code, one sentence each.
#[must_use]
pub fn notes<'f>(
    policy: &Policy,
    target: &TargetSpec,
    sizes: &manifest::Sizes,
    files: impl Iterator<Item = &'f Path>,
) -> Vec<String> {
    let open = policy.golden.is_none().then(|| unproven(policy));
    let of_policy = policy.notes.iter().cloned().chain(open);
    of_policy.chain(codegen::notes(policy, target, sizes, files)).collect()
}

/// What `verify` has to be told, too, where the command line alone accepts what the format changes.
fn accepted_here(policy: &Policy, golden_decisions: Option<f64>) -> Option<String> {
    let share = golden_decisions?;
    let by_contract = decisions(policy, None)?;
    (!by_contract.kept()).then(|| {
        format!(
            "note: accepted for this run alone: the files do not carry it, so give `verify` --golden-decisions {share} as well, or write \
             golden_decisions = {share} into [network] of the contract, which both read"
        )
    })
}

/// Refuses a policy whose network does not give the trainer's answers, or whose format changes too many of them; says of the rest
/// which are changed.
fn accepted(policy: &Policy, golden_decisions: Option<f64>) -> Result<Vec<String>, Message> {
    if let Some(golden) = golden_result(policy).filter(|golden| !golden.passed()) {
        let message = Message::new("the network does not give the trainer's golden answers; nothing was written");
        return Err(message.found(golden.to_string()).hint(golden.hint()));
    }
    match decisions(policy, golden_decisions) {
        None => Ok(Vec::new()),
        Some(decisions) if decisions.kept() => {
            // integers are expected to change some, so that none is told, too
            let is_integer = policy.numeric_format.is_integer();
            let lines_of = |own: &Decisions| match own {
                Decisions::Choice(choices) if choices.changed > 0 => 2,
                Decisions::Choice(_) => usize::from(is_integer),
                _ => 2 * usize::from(is_integer),
            };
            // the counts; where it changes most is told by `inspect`
            let told = |(output, own): (Option<&str>, &Decisions)| {
                let lines = text::of_output(policy, output, own);
                lines.into_iter().take(lines_of(own))
            };
            let mut lines: Vec<String> = decisions.each().into_iter().flat_map(told).collect();
            if lines.is_empty() {
                return Ok(lines);
            }
            lines.extend(accepted_here(policy, golden_decisions));
            Ok(lines)
        }
        Some(decisions) => {
            let remedy = decisions.remedy();
            let what = decisions.beyond().next().map(|(_, own)| own);
            let problem = match what {
                Some(Decisions::Continuous(_)) => {
                    "the numeric format changes the trainer's duties more than allowed; nothing was written"
                }
                Some(Decisions::Schedule(_)) => {
                    "the numeric format changes the trainer's gains more than allowed; nothing was written"
                }
                _ => "the numeric format changes more of the trainer's decisions than allowed; nothing was written",
            };
            let hint = match decisions.accepting_share() {
                Some(share) => format!(
                    "see what they cost with `policyc certify` and `policyc simulate`; to accept them, {remedy} in \
                     [network] of the contract, which `verify` reads too, or --golden-decisions {share} for this run"
                ),
                None => of_numbers(&remedy),
            };
            let found = text::decisions(policy, &decisions).join("\n");
            Err(Message::new(problem).found(found).hint(hint))
        }
    }
}

fn of_numbers(remedy: &str) -> String {
    format!("see what it costs with `policyc simulate`; to accept it, {remedy} in [network] of the contract")
}
