//! Contract sections 7b and 8: from the outputs of the network to a duty before the mapping.

use policy::{Continuous, Interval, Policy, Scalar, Squash};

use crate::program::{Block, Head, Literal, Op, ValueId};

/// What the outputs mean.
pub fn lower(policy: &Policy) -> Head {
    let scalar = policy.numeric_format.scalar();
    match &policy.head {
        policy::Head::Choice(actions) => {
            let duties = actions.iter().map(|action| Literal::nearest(scalar, action.duty));
            Head::Choice(duties.collect())
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
    let Some(head) = policy.head.continuous() else {
        return block.value(Op::ChosenDuty);
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

/// The duties of all actions, or of a continuous head those at both ends of its squash: all others lie between.
pub fn duties(policy: &Policy) -> Vec<Literal> {
    let scalar = policy.numeric_format.scalar();
    match &policy.head {
        policy::Head::Choice(actions) => {
            let duty = |action: &policy::Action| Literal::nearest(scalar, action.duty);
            actions.iter().map(duty).collect()
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
