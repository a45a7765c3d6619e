//! What the stream must reach.

use std::path::Path;

use interp::{Sample, status};

use super::*;
use crate::oracle::{Chunk, Oracle};

fn example() -> Policy {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/buck12/policy.toml");
    policy::load(&path).unwrap_or_else(|faults| panic!("{faults:#?}"))
}

fn chunk(policy: &Policy, seed: u64, steps: u64, recorded: &[Recorded]) -> (Chunk, Oracle<f32>) {
    let mut oracle = Oracle::<f32>::new(policy);
    let mut stream = Stream::new(policy, seed, recorded);
    let chunk = oracle.next_chunk(&mut stream, steps).unwrap();
    (chunk, oracle)
}

fn samples(chunk: &Chunk) -> impl Iterator<Item = &Vec<Sample>> {
    chunk.events.iter().filter_map(|event| match event {
        Event::Step(samples) => Some(samples),
        _ => None,
    })
}

#[test]
fn a_seed_gives_the_same_words_again_and_another_seed_others() {
    let policy = example();
    let (first, oracle) = chunk(&policy, 5, 3000, &[]);
    let (again, _) = chunk(&policy, 5, 3000, &[]);
    let (other, _) = chunk(&policy, 6, 3000, &[]);
    assert!(first.input == again.input && first.expected == again.expected);
    assert_ne!(first.input, other.input);
    assert_eq!(oracle.steps(), 3000);
}

#[test]
fn chunks_join_to_the_same_stream() {
    let policy = example();
    let (whole, one) = chunk(&policy, 5, 2000, &[]);
    let mut two = Oracle::<f32>::new(&policy);
    let mut stream = Stream::new(&policy, 5, &[]);
    let first = two.next_chunk(&mut stream, 700).unwrap();
    let second = two.next_chunk(&mut stream, 1300).unwrap();
    assert_eq!(second.first_step, 700);
    assert_eq!([first.expected, second.expected].concat(), whole.expected);
    assert_eq!(one.checksum(), two.checksum());
}

#[test]
fn the_example_reaches_every_status_it_can_and_most_actions() {
    let (_, oracle) = chunk(&example(), 1, 20_000, &[]);
    let coverage = oracle.coverage();
    // neither slew limit nor soft start in the example
    for bit in [0, 1, 2, 3, 4, 7] {
        assert!(coverage.status_bits[bit] > 100, "{}: {coverage:?}", status::NAMES[bit]);
    }
    assert!(
        coverage.actions.iter().filter(|count| **count > 0).count() > 8,
        "{coverage:?}"
    );
    assert!(
        coverage.mappings_accepted > 50 && coverage.mappings_refused > 50,
        "{coverage:?}"
    );
    assert!(coverage.resets > 10 && coverage.inits > 3, "{coverage:?}");
}

#[test]
fn every_kind_of_bad_sample_occurs() {
    let (chunk, _) = chunk(&example(), 1, 20_000, &[]);
    let values: Vec<f32> = samples(&chunk)
        .flatten()
        .filter_map(|sample| match sample {
            Sample::Physical(x) => Some(*x),
            Sample::Wide(_) | Sample::Code(_) => None,
        })
        .collect();
    type Kind = (&'static str, fn(&f32) -> bool);
    let kinds: [Kind; 9] = [
        ("quiet NaN", |x| x.to_bits() == 0x7fc0_0000),
        ("negative NaN", |x| x.to_bits() == 0xffc0_0000),
        ("signalling NaN", |x| x.to_bits() == 0x7f80_0001),
        ("infinity", |x| *x == f32::INFINITY),
        ("-infinity", |x| *x == f32::NEG_INFINITY),
        ("-0", |x| x.to_bits() == 1 << 31),
        ("subnormal", |x| x.is_subnormal()),
        ("largest", |x| *x == f32::MAX),
        ("just outside", |x| *x == 250.0_f32.next_up()),
    ];
    for (name, is) in kinds {
        assert!(values.iter().any(is), "no {name}");
    }
}

#[test]
fn bursts_end_around_the_hold_count() {
    let policy = example();
    let (chunk, _) = chunk(&policy, 1, 20_000, &[]);
    let inside = |(sample, signal): (&Sample, &policy::Signal)| match sample {
        Sample::Physical(x) => (signal.range.low..=signal.range.high).contains(&f64::from(*x)),
        Sample::Wide(_) | Sample::Code(_) => false,
    };
    let mut lengths = vec![0; 64];
    let mut run = 0;
    for samples in samples(&chunk) {
        if samples.iter().zip(&policy.signals).all(inside) {
            lengths[run] += 1;
            run = 0;
        } else {
            run = (run + 1).min(63);
        }
    }
    // K = 3
    for (length, times) in lengths.iter().enumerate().take(6).skip(1) {
        assert!(*times > 10, "bursts of {length}: {times}");
    }
}

#[test]
fn observations_come_within_a_few_units_of_their_clips_on_both_sides() {
    let policy = example();
    let mut oracle = Oracle::<f32>::new(&policy);
    let mut stream = Stream::new(&policy, 1, &[]);
    let (mut just_inside, mut just_outside) = (0, 0);
    for _ in 0..20_000 {
        let event = stream.next_event(oracle.controller());
        if let Event::Step(samples) = &event {
            for feature in oracle.controller().eval(samples).unwrap().features {
                let distance = (20.0_f32.to_bits() as i64 - i64::from(feature.unclipped.abs().to_bits())).abs();
                if distance <= 4 {
                    just_outside += usize::from(feature.clipped);
                    just_inside += usize::from(!feature.clipped);
                }
            }
        }
        oracle.chunk_of(vec![event]).unwrap();
    }
    assert!(just_inside > 100 && just_outside > 100, "{just_inside} {just_outside}");
}

#[test]
fn recordings_come_first_and_whole() {
    let policy = example();
    let text = "t, i_out, v_out, i_l\n# volts and amperes\n0, 1.5, 99, nan\n\n1e-4, 2.5, 98, 7\n";
    let recorded = recorded(&policy, text).unwrap();
    assert_eq!(recorded.notes, ["column not used: `t`"]);
    let (chunk, _) = chunk(&policy, 1, 10, &[recorded]);
    assert_eq!(chunk.events[0], Event::Reset);
    let Event::Step(first) = &chunk.events[1] else {
        panic!("{:?}", chunk.events[1])
    };
    assert_eq!((first[0], first[2]), (Sample::Physical(99.0), Sample::Physical(1.5)));
    assert!(matches!(first[1], Sample::Physical(x) if x.is_nan()));
    assert_eq!(
        chunk.events[2],
        Event::Step([98.0, 7.0, 2.5].map(Sample::Physical).to_vec())
    );
}

#[test]
fn a_faulty_recording_is_refused_with_its_place() {
    let policy = example();
    for (text, problem, place) in [
        ("v_out,i_l\n1,2\n", "no column for the signal `i_out`", (1, 1)),
        (
            "v_out,i_l,i_out,i_l\n1,2,3,4\n",
            "two columns are called `i_l`",
            (1, 17),
        ),
        ("v_out,i_l,i_out,i_o\n1,2,3,4\n", "two columns are `i_out`", (1, 17)),
        ("v_out,i_l,i_out\n1,2,3\n1,x,3\n", "`i_l` is not a number", (3, 3)),
        ("v_out,i_out,i_l\n1,2\n", "cells are missing", (2, 1)),
        ("v_out,i_out,i_l\n1,2,\n", "a cell of `i_l` is empty", (2, 5)),
        ("v_out,i_l,i_out\n1,2,3,4\n", "more cells", (2, 1)),
    ] {
        let faults = recorded(&policy, text).unwrap_err();
        let (fault, all) = (&faults.list[0], faults.to_string());
        assert!(
            fault.problem.contains(problem) && fault.line_column() == Some(place),
            "{all}"
        );
    }
}

#[test]
fn short_forms_units_and_decimal_commas_are_read_to_the_same_samples() {
    let policy = example();
    let plain = recorded(&policy, "v_out,i_l,i_out\n98.5,-0,2.5\n").unwrap();
    let other = recorded(&policy, "i_l;v_o [mV];i_o\n-0;98500;2,5\n").unwrap();
    assert_eq!(plain.steps(), other.steps());
    let Sample::Physical(i_l) = plain.steps()[0][1] else {
        panic!()
    };
    assert_eq!(i_l.to_bits(), 1 << 31, "the sign of a zero is kept");
}

fn recorded(policy: &Policy, text: &str) -> Result<Recorded, toml_input::Faults> {
    let options = measured::Options::default();
    Recorded::read(
        policy,
        &measured::Sheet::parse(Path::new("trace.csv"), text.into(), &options)?,
        "",
    )
}

#[test]
fn an_adc_sample_is_the_nearest_code_and_saturates() {
    let adc = Some(policy::Adc {
        gain: -0.5,
        offset: 3.0,
        bits: None,
    });
    let signal = policy::Signal {
        name: "x".into(),
        unit: String::new(),
        range: Interval { low: 0.0, high: 1.0 },
        adc,
    };
    assert_eq!(sample_of(policy::Scalar::F32, &signal, 1.1), Sample::Code(4));
    assert_eq!(sample_of(policy::Scalar::F32, &signal, -1e30), Sample::Code(i32::MAX));
}
