//! What the back-to-back kit compares with: the interpreter's answers on the policy and on the construct suite.

use codegen::backend::kit::{Material, Trace};
use codegen::{Language, Output};
use interp::{Controller, Real};
use policy::{NumericFormat, Policy, ReadOptions, Scalar};
use targets::{RowBlock, TargetSpec};

use crate::oracle::{Chunk, Oracle};
use crate::protocol::{Layout, sample_words};
use crate::session::VerifyError;
use crate::traces::{Event, Stream, directed};

/// A small policy that uses every construct of the generated code.
const CONSTRUCTS: &[(&str, &[u8])] = &[
    (
        "policy.toml",
        // inside the program: a user of the tool has no checkout to read them from
        include_bytes!("../../tests/golden/cases/constructs/policy.toml"),
    ),
    (
        "drm.toml",
        include_bytes!("../../tests/golden/cases/constructs/drm.toml"),
    ),
    (
        "weights.safetensors",
        include_bytes!("../../tests/golden/cases/constructs/weights.safetensors"),
    ),
];

/// Control steps of the policy in a kit unless the user asks for another number.
// a step takes 4 (6 + signals) bytes of constant memory (docs/integrations/kit.md): 18 kB with three signals
pub const DEFAULT_STEPS: u32 = 500;
/// Control steps of each controller of the construct suite.
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
    let suite = [("suite", target.c_row_block), ("blocks", BLOCK)].map(|(name, block)| {
        let mut part = constructs.clone();
        // the user may link several kits into one program
        part.name = format!("{}_kit_{name}", policy.name);
        let target = TargetSpec {
            c_row_block: block,
            ..target.clone()
        };
        let program = codegen::lower(&part, &target, Language::C);
        trace(&part, SUITE_STEPS).map(|trace| (program, trace))
    });
    Ok(Material {
        policy: trace(policy, steps)?,
        suite: suite.into_iter().collect::<Result<_, _>>()?,
    })
}

/// The policy of the construct suite.
///
/// # Errors
/// If it does not pass the check: a fault of this program.
pub fn constructs() -> Result<Policy, VerifyError> {
    let options = ReadOptions::embedded(CONSTRUCTS);
    let raw = policy::read("policy.toml".as_ref(), &options);
    raw.and_then(policy::check)
        .map_err(|faults| VerifyError::Constructs(faults.to_string()))
}

fn trace(policy: &Policy, steps: u32) -> Result<Trace, VerifyError> {
    match policy.numeric_format.scalar() {
        Scalar::F32 => trace_in::<f32>(policy, steps),
        Scalar::F64 => trace_in::<f64>(policy, steps),
    }
}

/// Moves to the places where edits hide, damages of the state, then random moves: `steps` control steps together, or as
/// many as the first two parts take.
fn trace_in<T: Real>(policy: &Policy, steps: u32) -> Result<Trace, VerifyError> {
    let mut oracle = Oracle::<T>::new(policy);
    let layout = oracle.layout().clone();
    let mut trace = Trace::default();
    let directed = oracle
        .chunk_of(directed::moves(policy))
        .map_err(VerifyError::Interpreter)?;
    append(policy, &layout, &directed, &mut trace);
    let damages = damages(policy, &Controller::<T>::new(policy));
    for damage in damages {
        let events = vec![Event::Init];
        append(
            policy,
            &layout,
            &oracle.chunk_of(events).map_err(VerifyError::Interpreter)?,
            &mut trace,
        );
        damage_state(&damage, &mut oracle, &mut trace);
        let events = vec![Event::Step(directed::usual(policy))];
        append(
            policy,
            &layout,
            &oracle.chunk_of(events).map_err(VerifyError::Interpreter)?,
            &mut trace,
        );
    }
    let left = u64::from(steps).saturating_sub(u64::from(trace.steps()));
    let mut stream = Stream::new(policy, SEED, &[]);
    let chunk = oracle.next_chunk(&mut stream, left).map_err(VerifyError::Interpreter)?;
    append(policy, &layout, &chunk, &mut trace);
    Ok(trace)
}

/// Words of the state that get other values, by their place among the numbers; the counters stand behind these.
#[derive(Debug, Clone, PartialEq)]
struct Damage<T> {
    numbers: Vec<(usize, T)>,
    counters: Option<(u32, u32)>,
}

/// Each number of the state just outside of what a sound state holds; all of them at either end; the counters at their ends
/// and beyond.
fn damages<T: Real>(policy: &Policy, fresh: &Controller<T>) -> Vec<Damage<T>> {
    let (scalar, hold) = (policy.numeric_format.scalar(), policy.fallback.hold);
    let ends: Vec<(usize, (T, T))> = fresh
        .sound_ends()
        .into_iter()
        .enumerate()
        .filter_map(|(at, ends)| Some((at, ends?)))
        .collect();
    let of_numbers = |numbers: Vec<(usize, T)>| Damage {
        numbers,
        counters: None,
    };
    let all = |pick: fn((T, T)) -> T| of_numbers(ends.iter().map(|(at, ends)| (*at, pick(*ends))).collect());
    let mut damages = vec![all(|ends| ends.0), all(|ends| ends.1)];
    for &(at, (low, high)) in &ends {
        let (below, above) = (scalar.next_down(low.to_f64()), scalar.next_up(high.to_f64()));
        // what is no number gives one of many in the observation, and the contract does not say which
        let finite = [below, above].into_iter().filter(|end| end.is_finite());
        damages.extend(finite.map(|end| of_numbers(vec![(at, T::nearest(end))])));
    }
    let counters = [
        (hold.saturating_add(1), 1),
        (hold.saturating_add(2), 1),
        (u32::MAX, 1),
        (0, 2),
        (0, u32::MAX),
    ];
    damages.extend(counters.map(|counters| Damage {
        numbers: Vec::new(),
        counters: Some(counters),
    }));
    damages
}

/// Puts the damage into the interpreter's state and into the trace, word by word.
fn damage_state<T: Real>(damage: &Damage<T>, oracle: &mut Oracle<T>, trace: &mut Trace) {
    let mut state = oracle.controller().state().clone();
    let before = state.words();
    for (at, value) in &damage.numbers {
        if let Some(number) = state.numbers_mut().nth(*at) {
            *number = *value;
        }
    }
    if let Some((bad_count, primed)) = damage.counters {
        (state.bad_count, state.primed) = (bad_count, primed);
    }
    let mut words = before;
    for (at, word) in state.words().into_iter().enumerate() {
        if words[at] != word {
            words[at] = word;
            trace.damage(at as u32, word, words.iter().copied());
        }
    }
    oracle.restore(&state);
}

/// Appends the words of a chunk in the form of the kit: its layout is that of [`crate::protocol`].
fn append(policy: &Policy, layout: &Layout, chunk: &Chunk, trace: &mut Trace) {
    let number = layout.scalar().words();
    let values = number * (policy.features.len() + policy.actions.len());
    let (mut input, mut expected) = (chunk.input.as_slice(), chunk.expected.as_slice());
    for event in &chunk.events {
        let answer = take(&mut expected, layout.answer(event).len());
        // the kind comes first
        take(&mut input, 1);
        match event {
            Event::Step(_) => {
                let (before, rest) = answer.split_at(values);
                let (command, state) = rest.split_at(2 * number + 2);
                // the last word is the driver's verdict on purity
                let state = &state[..state.len() - 1];
                let rest = before.iter().chain(state).copied();
                trace.step(take(&mut input, sample_words(policy)), command, rest);
            }
            Event::SetMapping { r, .. } => {
                let coefficients = take(&mut input, 4 * number);
                // four numbers travel in any case; the kit calls a function of three
                let given = if r.is_some() {
                    coefficients
                } else {
                    &coefficients[..3 * number]
                };
                trace.set_mapping(given, answer[0], answer[1..].iter().copied());
            }
            Event::Reset => trace.reset(answer.iter().copied()),
            Event::Init => trace.init(answer.iter().copied()),
            // the stream has none of these; the generated code has its own known answers
            Event::Network(observation) => {
                take(&mut input, number * observation.len());
            }
        }
    }
}

fn take<'a>(words: &mut &'a [u32], count: usize) -> &'a [u32] {
    let (first, rest) = words.split_at(count.min(words.len()));
    *words = rest;
    first
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::mem::{Discriminant, discriminant};

    use codegen::program::{Literal, Loop, Op};

    use super::*;

    /// Every operation of the program; the match makes the compiler ask for new ones.
    fn all_operations() -> Vec<Op> {
        let all = [
            Op::Measured(0),
            Op::Code(0),
            Op::Held(0),
            Op::Sanitised(0),
            Op::Memory(0),
            Op::PreviousDuty,
            Op::PreviousCommand,
            Op::SoftCap,
            Op::Coefficient(codegen::program::Coefficient::A),
            Op::ChosenDuty,
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
                Op::PreviousDuty | Op::PreviousCommand | Op::SoftCap | Op::Coefficient(_) | Op::ChosenDuty => {}
                Op::Constant(_) | Op::Neg(_) | Op::Add(..) | Op::Sub(..) | Op::Mul(..) | Op::Select { .. } => {}
                Op::Clamp { .. } | Op::LineSum { .. } | Op::Primed | Op::Usable | Op::Clipped => {}
                Op::HeldSample | Op::PrimedNow | Op::Within { .. } | Op::Outside { .. } => {}
                Op::Difference(..) | Op::NotZero(_) | Op::Above(..) | Op::And(..) | Op::Or(..) => {}
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

    /// A trace that never clips or falls back would check less than it says.
    #[test]
    fn the_moves_of_the_suite_reach_every_status_and_action() {
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
        assert!(
            coverage.actions.iter().filter(|count| **count > 0).count() >= 4,
            "{coverage:?}"
        );
        assert!(coverage.resets > 0 && coverage.inits > 0, "{coverage:?}");
        assert!(
            coverage.mappings_accepted > 0 && coverage.mappings_refused > 0,
            "{coverage:?}"
        );
    }
}
