//! Contract sections 7b and 8: from the outputs of the network to a duty before the mapping.

use policy::{Continuous, Interval, Policy, Residual, Scalar, Squash};

use crate::program::{Block, Head, Literal, Op, ValueId};

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
            curve: match head.squash {
                Squash::Curve(curve) => Some(curve),
                Squash::Clip(_) => None,
            },
        },
    }
}

/// The duty as operations.
pub fn duty(policy: &Policy, block: &mut Block) -> ValueId {
    let scalar = policy.numeric_format.scalar();
    let head = match &policy.head {
        policy::Head::Choice(_) => return block.value(Op::ChosenDuty),
        policy::Head::Residual(head) => return residual(scalar, head, block),
        policy::Head::Continuous(head) => head,
    };
    let output = block.value(Op::Output);
    let squashed = match head.squash {
        Squash::Curve(_) => block.value(Op::Squash(output)),
        Squash::Clip(clip) => {
            let low = block.constant(Literal::nearest(scalar, clip.low));
            let high = block.constant(Literal::nearest(scalar, clip.high));
            block.value(Op::Clamp { x: output, low, high })
        }
    };
    let scaled = match head.scale {
        1.0 => squashed,
        scale => {
            let scale = block.constant(Literal::nearest(scalar, scale));
            block.value(Op::Mul(squashed, scale))
        }
    };
    match head.offset {
        0.0 => scaled,
        offset => {
            let offset = block.constant(Literal::nearest(scalar, offset));
            block.value(Op::Add(scaled, offset))
        }
    }
}

/// The law's duty with the offset, but where nothing is to be added.
fn residual(scalar: Scalar, head: &Residual, block: &mut Block) -> ValueId {
    let mut offset = block.value(Op::ChosenDuty);
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

/// The duties of all actions, or of a continuous or residual head the ends: all others lie between.
pub fn duties(policy: &Policy) -> Vec<Literal> {
    let scalar = policy.numeric_format.scalar();
    match &policy.head {
        policy::Head::Choice(actions) => {
            let duty = |action: &policy::Action| Literal::nearest(scalar, action.duty);
            actions.iter().map(duty).collect()
        }
        policy::Head::Residual(head) => {
            let (low, high) = Literal::inward(scalar, head.limits);
            vec![low, high]
        }
        policy::Head::Continuous(head) => ends(scalar, head).to_vec(),
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
