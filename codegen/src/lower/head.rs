//! Contract sections 7b, 7c and 8: from the outputs of the network to a duty before the mapping.

use policy::{Continuous, DutyPath, Factor, Gain, Interval, Output, Policy, Residual, Scalar, Schedule, Squash};

use crate::program::{Block, Head, HeadPart, Literal, Op, ValueId};

/// What the outputs mean.
pub fn lower(policy: &Policy) -> Head {
    let scalar = policy.numeric_format.scalar();
    match &policy.head {
        policy::Head::Choice(actions) => {
            let duties = actions.iter().map(|action| Literal::nearest(scalar, action.duty));
            Head::Choice(duties.collect())
        }
        policy::Head::Residual(head) => {
            let offsets = head.offsets.iter().map(|action| Literal::nearest(scalar, action.duty));
            Head::Choice(offsets.collect())
        }
        policy::Head::Continuous(head) => Head::Output {
            curve: curve(Some(head.squash)),
        },
        policy::Head::Schedule(head) => Head::Gains {
            curves: head.gains.iter().map(|gain| curve(gain.squash)).collect(),
        },
        policy::Head::Several(outputs) => several(scalar, outputs),
    }
}

fn several(scalar: Scalar, outputs: &[Output]) -> Head {
    let columns = outputs.iter().map(|output| output.head.outputs()).sum();
    let mut curves = vec![None; columns];
    for output in outputs {
        let own = output.head.continuous().and_then(|head| curve(Some(head.squash)));
        if let Some(at) = curves.get_mut(output.column) {
            *at = own;
        }
    }
    let part = |output: &Output| HeadPart {
        column: output.column,
        duties: (output.head.actions().iter())
            .map(|action| Literal::nearest(scalar, action.duty))
            .collect(),
    };
    Head::Several {
        parts: outputs.iter().map(part).collect(),
        curves,
    }
}

fn curve(squash: Option<Squash>) -> Option<policy::Activation> {
    match squash {
        Some(Squash::Curve(curve)) => Some(curve),
        Some(Squash::Clip(_)) | None => None,
    }
}

/// The duty of the output of that index as operations.
pub fn duty(scalar: Scalar, path: &DutyPath<'_>, index: usize, block: &mut Block) -> ValueId {
    let head = match path.head {
        // an output has one of the others
        policy::Head::Choice(_) | policy::Head::Several(_) => return block.value(Op::ChosenDuty(index)),
        policy::Head::Residual(head) => return residual(scalar, head, block),
        policy::Head::Schedule(head) => return schedule(scalar, head, block),
        policy::Head::Continuous(head) => head,
    };
    let (op, column) = match path.name {
        None => (Op::Output, 0),
        Some(_) => (Op::Gain(path.column), path.column),
    };
    let output = block.value(op);
    mapped(
        scalar,
        Some(head.squash),
        (head.scale, head.offset),
        (output, column),
        block,
    )
}

/// A value, the output of that index, behind squash, scale and offset.
fn mapped(
    scalar: Scalar,
    squash: Option<Squash>,
    (scale, offset): (f64, f64),
    (output, index): (ValueId, usize),
    block: &mut Block,
) -> ValueId {
    let squashed = match squash {
        Some(Squash::Curve(_)) => block.value(Op::Squash(output, index)),
        Some(Squash::Clip(clip)) => clamped(scalar, clip, output, block),
        None => output,
    };
    let scaled = match scale {
        1.0 => squashed,
        scale => {
            let scale = block.constant(Literal::nearest(scalar, scale));
            block.value(Op::Mul(squashed, scale))
        }
    };
    match offset {
        0.0 => scaled,
        offset => {
            let offset = block.constant(Literal::nearest(scalar, offset));
            block.value(Op::Add(scaled, offset))
        }
    }
}

/// A value between ends that are rounded to nearest.
fn clamped(scalar: Scalar, ends: Interval, x: ValueId, block: &mut Block) -> ValueId {
    let low = block.constant(Literal::nearest(scalar, ends.low));
    let high = block.constant(Literal::nearest(scalar, ends.high));
    block.value(Op::Clamp { x, low, high })
}

/// The law with its products added one after the other, in the order of the gains.
fn schedule(scalar: Scalar, head: &Schedule, block: &mut Block) -> ValueId {
    let base = block.value(Op::Base);
    let (mut sum, mut multiplied) = (base, 0);
    for (index, gain) in head.gains.iter().enumerate() {
        let Gain { factor, squash, .. } = gain;
        let output = block.value(Op::Gain(index));
        let mut value = mapped(scalar, *squash, (gain.scale, gain.offset), (output, index), block);
        if let Some(limits) = gain.limits {
            value = clamped(scalar, limits, value, block);
        }
        if !matches!(factor, Factor::One) {
            let factor = block.value(Op::Factor(multiplied));
            multiplied += 1;
            value = block.value(Op::Mul(value, factor));
        }
        sum = block.value(Op::Add(sum, value));
    }
    if !head.dead_zone.is_empty() {
        let flag = block.value(Op::Still);
        sum = block.value(Op::Select {
            flag,
            then: base,
            otherwise: sum,
        });
    }
    let (low, high) = Literal::inward(scalar, head.limits);
    let (low, high) = (block.constant(low), block.constant(high));
    block.value(Op::Clamp { x: sum, low, high })
}

/// The law's duty with the offset, but where nothing is to be added.
fn residual(scalar: Scalar, head: &Residual, block: &mut Block) -> ValueId {
    let mut offset = block.value(Op::ChosenDuty(0));
    if !head.dead_zone.is_empty() {
        let flag = block.value(Op::Still);
        let then = block.constant(Literal::nearest(scalar, 0.0));
        offset = block.value(Op::Select {
            flag,
            then,
            otherwise: offset,
        });
    }
    let base = block.value(Op::Base);
    let x = block.value(Op::Add(base, offset));
    let (low, high) = Literal::inward(scalar, head.limits);
    let (low, high) = (block.constant(low), block.constant(high));
    block.value(Op::Clamp { x, low, high })
}

/// The duties of all actions, or of any other head the ends: all others lie between.
pub fn duties(scalar: Scalar, head: &policy::Head) -> Vec<Literal> {
    match head {
        policy::Head::Choice(actions) => {
            let duty = |action: &policy::Action| Literal::nearest(scalar, action.duty);
            actions.iter().map(duty).collect()
        }
        policy::Head::Residual(Residual { limits, .. }) | policy::Head::Schedule(Schedule { limits, .. }) => {
            let (low, high) = Literal::inward(scalar, *limits);
            vec![low, high]
        }
        policy::Head::Continuous(head) => ends(scalar, head).to_vec(),
        policy::Head::Several(outputs) => outputs.iter().flat_map(|own| duties(scalar, &own.head)).collect(),
    }
}

fn ends(scalar: Scalar, head: &Continuous) -> [Literal; 2] {
    let Interval { low, high } = head.squashed();
    // a product with 1 and a sum with 0 are exact, so that leaving them out changes neither end
    [low, high].map(|s| match scalar {
        Scalar::F32 => Literal::exact(s as f32 * head.scale as f32 + head.offset as f32),
        Scalar::F64 => Literal::exact(s * head.scale + head.offset),
    })
}
