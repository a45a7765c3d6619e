//! Contract section 1: the state, member by member.

use policy::Policy;

use crate::program::{Literal, MappingCode, SignalPort, StateMember, StateValue, bits};

/// The members in contract order; numbers first, so that in binary64 they lie without a gap.
pub fn members(
    policy: &Policy,
    signals: &[SignalPort],
    memory_words: usize,
    mapping: Option<&MappingCode>,
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
    let initial = policy.limits.initial_duty;
    members.push(member(
        "previous_duty",
        "duty of the last chosen action",
        number(initial),
    ));
    members.push(member("previous_command", "last command", number(initial)));
    if let Some(soft) = policy.limits.soft_start {
        members.push(member("soft_cap", "rising upper limit", number(soft.from)));
    }
    for (name, value, ..) in mapping.iter().flat_map(|mapping| &mapping.coefficients) {
        let meaning = "coefficient of the duty ratio mapping";
        let name = format!("mapping_{}", name.name());
        members.push(member(&name, meaning, StateValue::Coefficient(*value)));
    }
    if let Some(mapping) = mapping {
        let coefficients = mapping.coefficients.iter();
        let check = coefficients.fold(mapping.check_constant, |check, (_, value, ..)| {
            check ^ bits(scalar, value.value())
        });
        let meaning = "check word of the coefficients: a flipped bit of one of them is seen";
        members.push(member("mapping_check", meaning, StateValue::Check(check)));
    }
    let meaning = "consecutive steps with an invalid sample";
    members.push(member("bad_count", meaning, StateValue::Word));
    members.push(member(
        "primed",
        "1 once the filters hold good samples, 2 after a damaged state",
        StateValue::Word,
    ));
    members
}
