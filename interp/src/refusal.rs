//! Why no code should be made of a policy.

use policy::Policy;
use toml_input::Message;

use crate::decisions::{Choices, Decisions, decisions};
use crate::golden::golden_result;

/// Why no code should be made of a policy: it was not read as the trainer meant, or its format changes more of his decisions
/// than the contract allows. `None` if neither, or without golden vectors.
#[must_use]
pub fn refusal(policy: &Policy) -> Option<Message> {
    // reading comes first: of a network that was read wrongly the decisions say nothing about the format
    let result = golden_result(policy)?;
    if !result.passed() {
        let found = match result.worst_relative_error {
            _ if result.is_of_numbers() || !result.outputs.is_empty() => result.to_string(),
            Some(error) => format!("a relative error of Q of {error:.1e}, allowed {:.0e}", result.tolerance),
            None => format!("{} of {} actions equal", result.actions_equal, result.actions_compared),
        };
        return Some(
            Message::new("the network does not give the trainer's golden answers")
                .found(found)
                .hint(result.hint()),
        );
    }
    let decisions = decisions(policy, None)?;
    // the first is enough to stop; `inspect` tells all
    let (output, changed) = decisions.beyond().next()?;
    let output = output.map_or_else(String::new, |name| format!("output {name}: "));
    Some(match changed {
        Decisions::Choice(choices) => choices_changed(&output, choices),
        Decisions::Continuous(duties) => numbers_changed(
            "duties",
            (&output, duties.largest),
            duties.numeric_format,
            duties.allowed,
        ),
        Decisions::Schedule(gains) => {
            numbers_changed("gains", (&output, gains.largest), gains.numeric_format, gains.allowed)
        }
        // outputs have none of their own
        Decisions::Several(_) => return None,
    })
}

fn choices_changed(output: &str, choices: &Choices) -> Message {
    let Choices {
        numeric_format,
        observations,
        changed,
        allowed,
        ..
    } = choices;
    Message::new("the numeric format changes more of the trainer's decisions than allowed")
        .found(format!(
            "{output}{changed} of {observations} changed in {numeric_format}, allowed {} %",
            // to hundredths of a percent: 100 * 0.07 is 7.000000000000001
            (1e4 * allowed).round() / 100.0
        ))
        .hint("`policyc inspect` tells what they cost; to accept them: golden_decisions in [network], a share from 0 to 1")
}

/// Duties or gains that are off by more than the contract allows.
fn numbers_changed(what: &str, (output, largest): (&str, f64), numeric_format: &str, allowed: f64) -> Message {
    Message::new(format!(
        "the numeric format changes the trainer's {what} more than allowed"
    ))
    .found(format!(
        "{output}an error of {largest:.1e} of its range in {numeric_format}, allowed {allowed:.0e}"
    ))
    .hint("to accept it: golden_duty in [network], a share of the range from 0 to 1")
}
