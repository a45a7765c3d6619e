//! Contract sections 8 to 10: mapping, limits, status, and what the command path remembers.
//!
//! ```text
//!  chosen duty ─► mapping ─► slew ─► soft start ─► limits ─► is it a number? ─► command
//!                    │        │         │            │
//!                    └────────┴─────────┴────────────┴─► status bits
//! ```
//!
//! In: the contract's mapping and limits. Out: a block for the command, one for what is remembered. The one invariant: everything
//! is computed in every step, and the backend selects the fallback where the step is not usable.

use policy::{DutyPath, Limits, Mapping, Policy, Scalar};

use super::head;
use crate::program::{Advance, Block, Coefficient, Decide, Duty, Literal, Op, ValueId, Within};

/// One bit of the status word.
#[derive(Debug, Clone, Copy)]
pub struct StatusBit {
    /// Name in generated code.
    pub name: &'static str,
    /// Number of the bit.
    pub number: u32,
    /// What the user of generated code reads beside it; one sentence.
    pub meaning: &'static str,
}

/// The status word (contract section 9).
pub const STATUS: [StatusBit; 9] = [
    status_bit("HELD", 0, "Held samples bridge an invalid measurement."),
    status_bit(
        "FALLBACK",
        1,
        "The fallback duty is commanded: no usable measurement, or no sound state.",
    ),
    status_bit("PRIMED", 2, "This step primed the filters."),
    status_bit("CLIPPED", 3, "An observation was clipped."),
    status_bit("MAPPING_RANGE", 4, "Outside the mapping's validity range."),
    status_bit("SLEW_LIMITED", 5, "The slew limit was active."),
    status_bit("SOFT_START", 6, "The soft start was active."),
    status_bit("LIMITED", 7, "A duty limit was active."),
    status_bit(
        "STATE",
        8,
        "The state was damaged: the fallback duty is commanded until init, or until reset where the mapping is intact.",
    ),
];

const fn status_bit(name: &'static str, number: u32, meaning: &'static str) -> StatusBit {
    StatusBit { name, number, meaning }
}

/// The number of the bit of that name.
pub fn bit(name: &str) -> u32 {
    // names below are those of the table above, so that 0 is never taken for one that is missing
    STATUS.iter().find(|bit| bit.name == name).map_or(0, |bit| bit.number)
}

/// Lowers the way from the chosen duties to the command.
pub fn decide(policy: &Policy) -> Decide {
    let scalar = policy.numeric_format.scalar();
    let mut block = Block::default();
    let mut status = vec![
        (bit("HELD"), block.value(Op::HeldSample)),
        (bit("PRIMED"), block.value(Op::PrimedNow)),
    ];
    if policy.features.iter().any(|feature| feature.clip.is_some()) {
        status.push((bit("CLIPPED"), block.value(Op::Clipped)));
    }
    let paths = policy.paths();
    let duty = |(index, path): (usize, &DutyPath<'_>)| limited(scalar, path, index, &mut block, &mut status);
    let duties = paths.iter().enumerate().map(duty).collect();
    Decide {
        block,
        duties,
        // behind the last clamp a duty is outside only if it is no number: to ask that alone costs one comparison less
        within: Within::of(
            scalar,
            (Literal::exact(f64::NEG_INFINITY), Literal::exact(f64::INFINITY)),
        ),
        status,
    }
}

/// The duty of the output of that index, from what the network says to the last limiter.
fn limited(
    scalar: Scalar,
    path: &DutyPath<'_>,
    index: usize,
    block: &mut Block,
    status: &mut Vec<(u32, ValueId)>,
) -> Duty {
    // each limiter takes what the one before left, in the order of section 9: the duty limits have the last word
    let duty_sim = head::duty(scalar, path, index, block);
    let mut duty = duty_sim;
    if let Some(map) = path.mapping {
        let outside;
        (duty, outside) = mapping(scalar, block, (index, map), duty_sim);
        status.push((bit("MAPPING_RANGE"), outside));
    }
    if let Some(slew) = path.limits.slew {
        let step = block.constant(Literal::down(scalar, slew));
        // around what left the controller, not around the chosen duty: the hardware moves from the former
        let before = block.value(Op::PreviousCommand(index));
        let low = block.value(Op::Sub(before, step));
        let high = block.value(Op::Add(before, step));
        let limited = block.value(Op::Clamp { x: duty, low, high });
        status.push((bit("SLEW_LIMITED"), changed(block, duty, limited)));
        duty = limited;
    }
    if path.limits.soft_start.is_some() {
        let cap = block.value(Op::SoftCap(index));
        // from above alone: a soft start never raises a duty
        let above = block.value(Op::Above(duty, cap));
        status.push((bit("SOFT_START"), above));
        duty = block.value(Op::Select {
            flag: above,
            then: cap,
            otherwise: duty,
        });
    }
    let range = Literal::inward(scalar, path.limits.duty);
    let (low, high) = (block.constant(range.0), block.constant(range.1));
    let limited = block.value(Op::Clamp { x: duty, low, high });
    status.push((bit("LIMITED"), changed(block, duty, limited)));
    Duty {
        duty: limited,
        duty_sim,
    }
}

/// The flag that a clamp has changed a value.
fn changed(block: &mut Block, value: ValueId, clamped: ValueId) -> ValueId {
    // a clamp hands its value on unless it is active: different bits say so without two more comparisons of floats
    let difference = block.value(Op::Difference(value, clamped));
    block.value(Op::NotZero(difference))
}

/// Mapped duty and the flag that it was extrapolated.
fn mapping(scalar: Scalar, block: &mut Block, (output, map): (usize, &Mapping), duty: ValueId) -> (ValueId, ValueId) {
    let current = block.value(Op::Sanitised(map.load_current));
    let a = block.value(Op::Coefficient(output, Coefficient::A));
    let b = block.value(Op::Coefficient(output, Coefficient::B));
    let c = block.value(Op::Coefficient(output, Coefficient::C));
    let gain = block.value(Op::Mul(a, duty));
    let load = block.value(Op::Mul(b, current));
    let sum = block.value(Op::Add(gain, load));
    let mut mapped = block.value(Op::Add(sum, c));
    if map.coefficients.r.is_some() {
        let r = block.value(Op::Coefficient(output, Coefficient::R));
        let scaled = block.value(Op::Mul(r, current));
        let product = block.value(Op::Mul(scaled, duty));
        mapped = block.value(Op::Add(mapped, product));
    }
    let mut outside = |x: ValueId, range: policy::Interval| {
        // to nearest, as the actions are: one at the end of the range is inside
        let low = block.constant(Literal::nearest(scalar, range.low));
        let high = block.constant(Literal::nearest(scalar, range.high));
        block.value(Op::Outside { x, low, high })
    };
    let duty_outside = outside(duty, map.valid_d_sim);
    let current_outside = outside(current, map.valid_i_out);
    (mapped, block.value(Op::Or(duty_outside, current_outside)))
}

/// Lowers the next soft-start limits.
pub fn advance(policy: &Policy) -> Advance {
    let scalar = policy.numeric_format.scalar();
    let mut block = Block::default();
    let paths = policy.paths();
    let cap = |(index, path): (usize, &DutyPath<'_>)| soft_cap(scalar, path.limits, index, &mut block);
    let soft_caps = paths.iter().enumerate().map(cap).collect();
    Advance { block, soft_caps }
}

fn soft_cap(scalar: Scalar, limits: &Limits, index: usize, block: &mut Block) -> Option<ValueId> {
    let soft = limits.soft_start?;
    let increment = (limits.duty.high - soft.from) / f64::from(soft.steps);
    let cap = block.value(Op::SoftCap(index));
    let increment = block.constant(Literal::nearest(scalar, increment));
    let risen = block.value(Op::Add(cap, increment));
    let max = block.constant(Literal::down(scalar, limits.duty.high));
    // `c if c < max else max`: equal values have equal bits, duties are never -0 here
    let above = block.value(Op::Above(risen, max));
    let capped = block.value(Op::Select {
        flag: above,
        then: max,
        otherwise: risen,
    });
    // a soft start begins again behind a fallback
    let usable = block.value(Op::Usable);
    let from = block.constant(Literal::nearest(scalar, soft.from));
    Some(block.value(Op::Select {
        flag: usable,
        then: capped,
        otherwise: from,
    }))
}
