//! What the back-to-back kit compares with: the interpreter's answers on the policy and on the construct suite.

mod alike;
mod course;
mod damage;
mod directed;
mod place;
mod several;
mod sides;

use codegen::backend::kit::{Material, Trace};
use codegen::{Language, Output};
use interp::Real;
use policy::{Activation, NumericFormat, Policy, ReadOptions, Scalar};
use targets::{RowBlock, TargetSpec};

use self::course::Course;
use crate::session::VerifyError;

/// A small policy that uses every construct of the generated code.
const CONSTRUCTS: &[(&str, &[u8])] = &[
    (
        "policy.toml",
        // inside the program: a user of the tool has no checkout to read them from. Copies of tests/golden/cases/constructs: a
        // published crate holds no file of another
        include_bytes!("constructs/policy.toml"),
    ),
    ("drm.toml", include_bytes!("constructs/drm.toml")),
    ("weights.safetensors", include_bytes!("constructs/weights.safetensors")),
];

/// Control steps of the policy in a kit unless the user asks for another number.
// a step takes 4 (6 + signals) bytes of constant memory (docs/integrations/kit.md): 18 kB with three signals
pub const DEFAULT_STEPS: u32 = 500;
/// More control steps than a kit may have.
// 7 MB of constant memory: more than a board has, and a file that compilers still take
pub const MOST_STEPS: u32 = 200_000;
/// Control steps of each controller of the construct suite.
// a convention, as the seed: with it the moves reach all that a test below asks for
const SUITE_STEPS: u32 = 300;
/// Seed of the moves: one whose 300 steps on the suite reach all that a test below asks for.
const SEED: u64 = 28;
/// The block form of a layer, with a shorter last block.
// whatever the target's own shape is, so that the blocks are printed and tried on every board
const BLOCK: RowBlock = RowBlock::Rows(4);

/// What the kit compares with, if it is among the outputs; for [`codegen::generate`].
///
/// # Errors
/// Only for a fault in the compiler itself.
pub fn expected(
    policy: &Policy,
    target: &TargetSpec,
    outputs: &[Output],
    steps: u32,
) -> Result<Option<Material>, VerifyError> {
    let needed = outputs.contains(&Output::Kit);
    needed.then(|| material(policy, target, steps)).transpose()
}

/// Moves and expected answers for the kit of `policy`, `steps` of them control steps.
///
/// # Errors
/// Only for a fault in the compiler itself.
pub fn material(policy: &Policy, target: &TargetSpec, steps: u32) -> Result<Material, VerifyError> {
    let constructs = match policy.numeric_format.scalar() {
        Scalar::F32 => constructs()?,
        Scalar::F64 => constructs()?.with_format(NumericFormat::F64),
    };
    let legs = several::legs()?.with_format(constructs.numeric_format);
    let parts = [
        ("suite", target.c_row_block),
        ("blocks", BLOCK),
        ("legs", target.c_row_block),
    ];
    let suite = parts.map(|(name, block)| {
        let mut part = match name {
            "blocks" => others(&constructs),
            "legs" => legs.clone(),
            _ => constructs.clone(),
        };
        // the user may link several kits into one program
        part.name = format!("{}_kit_{name}", policy.name);
        let target = TargetSpec {
            c_row_block: block,
            ..target.clone()
        };
        let program = codegen::lower(&part, &target, Language::C);
        // the second differs from the first in its network alone, the third in its outputs: all moves of the first would only take
        // memory once more
        let moves = match name {
            "suite" => Moves::All,
            "blocks" => Moves::Network,
            _ => Moves::Random,
        };
        trace(&part, SUITE_STEPS, moves).map(|trace| (program, trace))
    });
    Ok(Material {
        policy: trace(policy, steps, Moves::All)?,
        suite: suite.into_iter().collect::<Result<_, _>>()?,
        asked: steps,
    })
}

/// The construct suite with the activations that its own contract has no room for.
fn others(constructs: &Policy) -> Policy {
    const OTHERS: [Activation; 6] = [
        Activation::Sigmoid,
        Activation::GeluTanh,
        Activation::Gelu,
        Activation::HardSwish,
        Activation::Softplus,
        Activation::HardSigmoid,
    ];
    // sums that could leave the format: those of this network are small, and a test asks for every activation
    constructs
        .with_activations(&OTHERS)
        .unwrap_or_else(|| constructs.clone())
}

/// The policy of the construct suite.
///
/// # Errors
/// If it does not pass the check: a fault of this program.
pub fn constructs() -> Result<Policy, VerifyError> {
    let options = ReadOptions::embedded(CONSTRUCTS.iter().copied());
    let raw = policy::read("policy.toml".as_ref(), &options);
    raw.and_then(policy::check)
        .map_err(|faults| VerifyError::Constructs(faults.to_string()))
}

/// Which moves a controller gets.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Moves {
    All,
    /// Those of the network, then random ones.
    Network,
    Random,
}

fn trace(policy: &Policy, steps: u32, moves: Moves) -> Result<Trace, VerifyError> {
    match policy.numeric_format.scalar() {
        Scalar::F32 => trace_in::<f32>(policy, steps, moves),
        Scalar::F64 => trace_in::<f64>(policy, steps, moves),
    }
}

/// Moves to the places where edits hide, states that are not sound, equal Q values, then random moves: `steps` control steps
/// together, or as many as the first parts take and a quarter of `steps` beside them.
fn trace_in<T: Real>(policy: &Policy, steps: u32, moves: Moves) -> Result<Trace, VerifyError> {
    let mut course = Course::<T>::new(policy);
    if moves == Moves::All {
        course.directed().map_err(VerifyError::Interpreter)?;
        course.damaged().map_err(VerifyError::Interpreter)?;
        course.capped().map_err(VerifyError::Interpreter)?;
        course.tied().map_err(VerifyError::Interpreter)?;
        course.sided().map_err(VerifyError::Interpreter)?;
        course.alike().map_err(VerifyError::Interpreter)?;
    }
    if moves != Moves::Random {
        course.summed().map_err(VerifyError::Interpreter)?;
    }
    course.random(steps, SEED).map_err(VerifyError::Interpreter)?;
    Ok(course.trace)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::mem::{Discriminant, discriminant};

    use codegen::program::{Literal, Loop, Op};

    use super::*;
    use crate::oracle::Oracle;
    use crate::traces::Stream;

    /// Every operation of the program; the match makes the compiler ask for new ones.
    fn all_operations() -> Vec<Op> {
        let all = [
            Op::Measured(0),
            Op::Code(0),
            Op::Held(0),
            Op::Sanitised(0),
            Op::Memory(0),
            Op::PreviousDuty(0),
            Op::PreviousCommand(0),
            Op::SoftCap(0),
            Op::Coefficient(0, codegen::program::Coefficient::A),
            Op::ChosenDuty(0),
            Op::Constant(Literal::nearest(Scalar::F32, 1.0)),
            Op::Neg(0),
            Op::Add(0, 0),
            Op::Sub(0, 0),
            Op::Mul(0, 0),
            Op::Select {
                flag: 0,
                then: 0,
                otherwise: 0,
            },
            Op::Clamp { x: 0, low: 0, high: 0 },
            Op::LineSum {
                word: 0,
                length: 0,
                newest: 0,
                primed: 0,
            },
            Op::Primed,
            Op::Usable,
            Op::Clipped,
            Op::HeldSample,
            Op::PrimedNow,
            Op::Within { x: 0, low: 0, high: 0 },
            Op::Outside { x: 0, low: 0, high: 0 },
            Op::Difference(0, 0),
            Op::NotZero(0),
            Op::Above(0, 0),
            Op::And(0, 0),
            Op::Or(0, 0),
        ];
        for op in &all {
            match op {
                Op::Measured(_) | Op::Code(_) | Op::Held(_) | Op::Sanitised(_) | Op::Memory(_) => {}
                Op::PreviousDuty(_) | Op::PreviousCommand(_) | Op::SoftCap(_) | Op::Coefficient(..) => {}
                Op::ChosenDuty(_) => {}
                Op::Constant(_) | Op::Neg(_) | Op::Add(..) | Op::Sub(..) | Op::Mul(..) | Op::Select { .. } => {}
                Op::Clamp { .. } | Op::LineSum { .. } | Op::Primed | Op::Usable | Op::Clipped => {}
                Op::HeldSample | Op::PrimedNow | Op::Within { .. } | Op::Outside { .. } => {}
                Op::Difference(..) | Op::NotZero(_) | Op::Above(..) | Op::And(..) | Op::Or(..) => {}
                // of a continuous head alone: where one is compiled, the moves of the policy itself run them
                Op::Output | Op::Squash(..) => {}
                // of a gain schedule and of several outputs, likewise
                Op::Gain(_) | Op::Factor(_) => {}
                // of a law of control alone, likewise
                Op::Base | Op::Still => {}
            }
        }
        all.to_vec()
    }

    fn suite() -> Vec<Program> {
        let target = targets::find("host").unwrap();
        let material = material(&constructs().unwrap(), target, 10).unwrap();
        material.suite.into_iter().map(|(program, _)| program).collect()
    }

    use codegen::Program;

    #[test]
    fn the_suite_uses_every_operation_of_the_program() {
        let suite = suite();
        let blocks = suite
            .iter()
            .flat_map(|p| [&p.front.block, &p.decide.block, &p.advance.block]);
        let used: Vec<Discriminant<Op>> = blocks.flat_map(|block| &block.ops).map(discriminant).collect();
        let missing: Vec<Op> = all_operations()
            .into_iter()
            .filter(|op| !used.contains(&discriminant(op)))
            .collect();
        assert_eq!(missing, []);
    }

    #[test]
    fn the_suite_uses_every_activation_and_every_form_of_a_layer() {
        let suite = suite();
        let nodes = || suite.iter().flat_map(|program| program.network.nodes());
        let used: BTreeSet<&str> = nodes()
            .filter_map(|node| match node {
                Loop::Store(store) => Some(store.activation.word()),
                _ => None,
            })
            .collect();
        assert_eq!(used, policy::Activation::EACH.iter().map(|kind| kind.word()).collect());
        let blocks: Vec<Vec<usize>> = nodes()
            .filter_map(|node| match node {
                Loop::Layer(layer) => Some(&layer.body),
                _ => None,
            })
            .map(|body| {
                let counts = body.iter().filter_map(|node| match node {
                    Loop::Repeat { count, .. } => Some(*count),
                    _ => None,
                });
                counts.collect()
            })
            .collect();
        assert!(blocks.iter().any(|blocks| matches!(blocks.as_slice(), [1])));
        assert!(
            blocks
                .iter()
                .any(|blocks| matches!(blocks.as_slice(), [full] if *full > 1))
        );
        assert!(
            blocks
                .iter()
                .any(|blocks| matches!(blocks.as_slice(), [full, 1] if *full > 1))
        );
    }

    /// A trace that never clips or falls back would check less than it says. Each action wins in moves that are looked for: `sides`.
    #[test]
    fn the_random_moves_of_the_suite_reach_every_status() {
        let constructs = constructs().unwrap();
        let mut oracle = Oracle::<f32>::new(&constructs);
        let mut stream = Stream::new(&constructs, SEED, &[]);
        oracle.next_chunk(&mut stream, u64::from(SUITE_STEPS)).unwrap();
        let coverage = oracle.coverage();
        let damaged = interp::status::STATE.trailing_zeros() as usize;
        for (bit, count) in coverage.status_bits.iter().enumerate() {
            // no move damages a state
            assert_eq!(*count == 0, bit == damaged, "bit {bit}: {coverage:?}");
        }
        assert!(coverage.resets > 0 && coverage.inits > 0, "{coverage:?}");
        assert!(
            coverage.mappings_accepted > 0 && coverage.mappings_refused > 0,
            "{coverage:?}"
        );
    }
}
