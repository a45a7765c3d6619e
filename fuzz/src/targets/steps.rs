//! Policies drawn at random, stepped with whatever arrives: the duty lies within its limits or is the fallback.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;

use interp::{Controller, Real, Sample};
use policy::{NumericFormat, Policy, ReadOptions, Scalar};

use super::Target;
use crate::forms::Form;
use crate::guard::{Answer, Limits};

/// Policies that are kept: making one costs as much as a hundred steps.
const KEPT: usize = 512;
/// Bytes of an input that choose the policy.
const CHOICE: usize = 2;

pub(super) static TARGETS: &[Target] = &[Target {
    name: "generated-steps",
    about: "random policies in all formats, stepped with any measurement",
    form: Form::Bytes,
    words: &["\0\0\u{80}\x7f", "\0\0\0\0", "\0\0\u{0}\x7f"],
    limits: Limits::READER,
    seeds: || Ok((0..24).map(seed).collect()),
    reader: || {
        let kept: RefCell<BTreeMap<(u16, u8), Option<Policy>>> = RefCell::default();
        Ok(Box::new(move |bytes| {
            let Some((choice, events)) = bytes.split_first_chunk::<CHOICE>() else {
                return Answer::refused("no choice");
            };
            // the low bits choose the policy, so that a run meets some hundred of them; all formats of each
            let number = u16::from_le_bytes(*choice);
            let key = (number % 2_048, (number >> 11) as u8 % NumericFormat::ALL.len() as u8);
            let Ok(mut kept) = kept.try_borrow_mut() else {
                return Answer::refused("in use");
            };
            if kept.len() > KEPT {
                kept.clear();
            }
            match kept.entry(key).or_insert_with(|| drawn(key)) {
                None => Answer::refused("a policy that is not taken"),
                Some(policy) => match policy.numeric_format.scalar() {
                    Scalar::F32 => run::<f32>(policy, events),
                    Scalar::F64 => run::<f64>(policy, events),
                },
            }
        }))
    },
}];

/// A choice and some measurements: usual ones, zeros, infinities, a NaN.
fn seed(index: u16) -> Vec<u8> {
    let numbers = [
        1.0_f32,
        20.0,
        -3.5,
        f32::NAN,
        0.0,
        f32::INFINITY,
        -0.0,
        f32::NEG_INFINITY,
        f32::MAX,
        1e-40,
        48.0,
        5.0,
    ];
    let words = (0..120).map(|step: usize| {
        // mostly plausible numbers: after some bad steps only the fallback is commanded
        let number = if step.is_multiple_of(7) {
            numbers[(step / 7 + usize::from(index)) % numbers.len()]
        } else {
            12.0
        };
        number.to_le_bytes()
    });
    let choice = index.wrapping_mul(2_741).to_le_bytes();
    choice.into_iter().chain(words.flatten()).collect()
}

fn drawn((number, format): (u16, u8)) -> Option<Policy> {
    let files = tests::random::files(number.into()).ok()?;
    let options = ReadOptions::embedded([
        ("policy.toml", files.contract.into_bytes()),
        ("weights.safetensors", files.weights),
        ("drm.toml", files.mapping.into_bytes()),
    ]);
    let policy = policy::load_with(Path::new("policy.toml"), &options).ok()?;
    Some(policy.with_format(NumericFormat::ALL[usize::from(format)]))
}

fn run<T: Real>(policy: &Policy, events: &[u8]) -> Answer {
    let mut controller = Controller::<T>::new(policy);
    let mut words = events.chunks_exact(4).map(|word| [word[0], word[1], word[2], word[3]]);
    let limits = policy.limits.duty;
    let rounded = |x: f64| T::nearest(x).to_f64();
    // rounded to nearest is the wider range: whatever way the limits are rounded, the duty lies within
    let (low, high, fallback) = (rounded(limits.low), rounded(limits.high), rounded(policy.fallback.duty));
    let mut statuses = 0;
    loop {
        let mut samples = Vec::with_capacity(policy.signals.len());
        for signal in &policy.signals {
            let Some(word) = words.next() else {
                return Answer::accepted(format!("status {}", letters(statuses)));
            };
            samples.push(match (signal.adc.is_some(), policy.numeric_format.scalar()) {
                (true, _) => Sample::Code(i32::from_le_bytes(word)),
                (false, Scalar::F32) => Sample::Physical(f32::from_le_bytes(word)),
                (false, Scalar::F64) => Sample::Wide(f64::from(f32::from_le_bytes(word)) * 1.000_000_1),
            });
        }
        // an event between two steps now and then, by the bits of a measurement
        match samples.first() {
            Some(Sample::Physical(x)) if x.to_bits().is_multiple_of(61) => controller.reset(),
            Some(Sample::Physical(x)) if x.to_bits().is_multiple_of(53) => {
                let one = T::nearest(f64::from(*x));
                controller.set_mapping(one, one, one, None);
            }
            _ => {}
        }
        let trace = controller.step(&samples);
        assert!(trace.is_ok(), "refused measurements of the right kind: {trace:?}");
        let Ok(trace) = trace else { continue };
        let duty = trace.command.duty.to_f64();
        let is_within = (low..=high).contains(&duty) || duty == fallback;
        assert!(
            is_within,
            "{}: duty {duty} is neither within {low}..{high} nor {fallback}",
            policy.name
        );
        assert!(
            (trace.command.action_index as usize) < policy.outputs(),
            "an action that there is not"
        );
        assert!(
            !trace.command.duty_sim.to_f64().is_nan(),
            "a duty before the mapping that is no number"
        );
        statuses |= trace.command.status;
    }
}

/// A number in letters: the corpus takes answers for equal that differ in digits alone.
fn letters(number: u32) -> String {
    (0..32)
        .filter(|bit| number >> bit & 1 == 1)
        .map(|bit| char::from(b'a' + bit as u8 % 26))
        .collect()
}
