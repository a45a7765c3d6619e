//! Contract section 1: the state, member by member.

use policy::Policy;

use crate::program::{Literal, OutputCode, SignalPort, StateMember, StateValue, bits};

/// The members in contract order; numbers first, so that in binary64 they lie without a gap.
pub fn members(
    policy: &Policy,
    signals: &[SignalPort],
    memory_words: usize,
    outputs: &[OutputCode],
) -> Vec<StateMember> {
    let scalar = policy.numeric_format.scalar();
    let member = |name: &str, meaning, value| StateMember {
        name: name.to_owned(),
        meaning,
        value,
    };
    let number = |value| StateValue::Number(Literal::nearest(scalar, value));
    let held = signals.iter().map(|signal| signal.initial).collect();
    let mut members = vec![member("held", "last good samples", StateValue::Numbers(held))];
    // C has no array of length 0
    if memory_words > 0 {
        let zeros = vec![Literal::nearest(scalar, 0.0); memory_words];
        let meaning = "filters, in feature order, oldest first";
        members.push(member("memory", meaning, StateValue::Numbers(zeros)));
    }
    let mut checks = Vec::new();
    for (path, output) in policy.paths().iter().zip(outputs) {
        let own = |name: &str, meaning, value| member(&output.named(name), meaning, value);
        let initial = path.limits.initial_duty;
        members.push(own("previous_duty", "duty of the last chosen action", number(initial)));
        members.push(own("previous_command", "last command", number(initial)));
        if let Some(soft) = path.limits.soft_start {
            members.push(own("soft_cap", "rising upper limit", number(soft.from)));
        }
        let Some(mapping) = &output.mapping else { continue };
        for (name, value, ..) in &mapping.coefficients {
            let meaning = "coefficient of the duty ratio mapping";
            let name = format!("mapping_{}", name.name());
            members.push(own(&name, meaning, StateValue::Coefficient(*value)));
        }
        let coefficients = mapping.coefficients.iter();
        let check = coefficients.fold(mapping.check_constant, |check, (_, value, ..)| {
            check ^ bits(scalar, value.value())
        });
        let meaning = "check word of the coefficients: a flipped bit of one of them is seen";
        checks.push(own("mapping_check", meaning, StateValue::Check(check)));
    }
    members.extend(checks);
    let meaning = "consecutive steps with an invalid sample";
    members.push(member("bad_count", meaning, StateValue::Word));
    members.push(member(
        "primed",
        "1 once the filters hold good samples, 2 after a damaged state",
        StateValue::Word,
    ));
    members
}
