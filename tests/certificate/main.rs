//! Bounds of the numeric formats against what is seen, and against another verifier.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod exact;
mod marabou;

use std::collections::BTreeMap;

use certify::{Certifier, Domain, Memory};
use interp::{Controller, Sample};
use ndarray::aview1;
use policy::{Activation, Continuous, Estimate, Factor, Gain, Head, Interval, NumericFormat, Policy, Schedule, Squash};
use random::{Random, SplitMix};

fn example(format: NumericFormat) -> Policy {
    policy::load(&tests::example()).unwrap().with_format(format)
}

/// Q values as the interpreter computes them in the format.
fn held(controller: &Controller<f32>, observation: &[f32]) -> Vec<f64> {
    let q_values = controller.q_values(&aview1(observation)).unwrap();
    q_values.iter().map(|q| f64::from(*q)).collect()
}

/// A box inside a domain, of a random size in each direction.
fn cell(rng: &mut SplitMix, domain: &Domain) -> Vec<Interval> {
    let size = 10_f64.powf(rng.uniform(-5.0, 0.0));
    let one = |range: Interval| {
        let width = size * rng.uniform(0.0, 1.0) * (range.high - range.low);
        let low = rng.uniform(range.low, range.high - width);
        Interval {
            low,
            high: (low + width).min(range.high),
        }
    };
    domain.whole().into_iter().map(one).collect()
}

/// A point of a box: a corner as often as not.
fn point(rng: &mut SplitMix, cell: &[Interval]) -> Vec<f64> {
    let is_corner = rng.one_in(2);
    let one = |range: &Interval| match (is_corner, rng.below(2)) {
        (true, 0) => range.low,
        (true, _) => range.high,
        (false, _) => rng.uniform(range.low, range.high),
    };
    cell.iter().map(one).collect()
}

fn argmax(q_values: &[f64]) -> usize {
    let largest = q_values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    q_values.iter().position(|q| *q == largest).unwrap()
}

/// What a continuous actor makes of its output in real arithmetic.
fn real_duty(head: &Continuous, y: f64) -> f64 {
    let s = match head.squash {
        Squash::Curve(Activation::Tanh) => y.tanh(),
        Squash::Curve(Activation::Sigmoid) => 1.0 / (1.0 + (-y).exp()),
        Squash::Curve(Activation::HardSigmoid) => ((y + 3.0) / 6.0).clamp(0.0, 1.0),
        Squash::Curve(_) => y / (1.0 + y.abs()),
        Squash::Clip(clip) => y.clamp(clip.low, clip.high),
    };
    head.scale * s + head.offset
}

/// The same in the format: duties of all outputs.
fn held_duties(controller: &Controller<f32>, held: &[f64]) -> Vec<f64> {
    let outputs: Vec<f32> = held.iter().map(|y| *y as f32).collect();
    let view = aview1(&outputs);
    let one = || vec![controller.decide(&view).unwrap()];
    let each = controller.decide_each(&view).unwrap_or_else(one);
    each.into_iter().map(|(_, duty)| f64::from(duty)).collect()
}

/// What is bounded, output by output: errors of Q values, or of the duty.
fn errors(
    policy: &Policy,
    controller: &Controller<f32>,
    (held, real): (&[f64], &[f64]),
    rng: &mut SplitMix,
) -> Vec<Vec<f64>> {
    let of = |(index, path): (usize, policy::DutyPath<'_>)| {
        let columns = path.columns();
        match path.head {
            Head::Continuous(head) => {
                vec![(held_duties(controller, held)[index] - real_duty(head, real[path.column])).abs()]
            }
            Head::Schedule(head) => vec![law_error(head, controller, (held, real), rng)],
            _ => columns.map(|column| (held[column] - real[column]).abs()).collect(),
        }
    };
    policy.paths().into_iter().enumerate().map(of).collect()
}

/// Error of the law's duty at a base and factors that are drawn, most of them at an end of what they can be.
fn law_error(head: &Schedule, controller: &Controller<f32>, (held, real): (&[f64], &[f64]), rng: &mut SplitMix) -> f64 {
    let mut drawn = |range: Interval| match rng.below(3) {
        0 => range.low as f32,
        1 => range.high as f32,
        _ => rng.uniform(range.low, range.high) as f32,
    };
    let base = drawn(head.base_bound);
    let outputs: Vec<f32> = held.iter().map(|y| *y as f32).collect();
    let gains = controller.gains(&aview1(&outputs)).unwrap();
    let (mut d, mut exact) = (base, f64::from(base));
    for ((gain, g), y) in head.gains.iter().zip(gains).zip(real) {
        let x = drawn(gain.factor_bound);
        d += if matches!(gain.factor, Factor::One) { g } else { g * x };
        exact += real_gain(gain, *y) * f64::from(x);
    }
    let (low, high) = (head.limits.low, head.limits.high);
    (f64::from(d).clamp(low, high) - exact.clamp(low, high)).abs()
}

/// A gain in exact arithmetic, up to the rounding of binary64.
fn real_gain(gain: &Gain, y: f64) -> f64 {
    let s = match gain.squash {
        None => y,
        Some(squash) => real_duty(
            &Continuous {
                squash,
                scale: 1.0,
                offset: 0.0,
            },
            y,
        ),
    };
    let g = gain.scale * s + gain.offset;
    gain.limits.map_or(g, |limits| g.clamp(limits.low, limits.high))
}

/// Boxes and points of a policy's observations: how near the bounds come, or what contradicts them.
fn check(policy: &Policy, rng: &mut SplitMix, boxes: usize) -> (f64, usize) {
    let certifier = Certifier::new(policy);
    let controller = Controller::<f32>::new(policy);
    let domain = certifier.observations().clone();
    let whole = certifier.box_bounds();
    let (mut nearest, mut decided) = (0.0_f64, 0);
    for _ in 0..boxes {
        let cell = cell(rng, &domain);
        let bounds = certifier.bounds_over(&domain, &cell);
        let q_ranges = certifier.q_values_over(&domain, &cell);
        let actions = certifier.decided(&domain, &cell);
        decided += actions.iter().flatten().count();
        assert_eq!(
            (bounds.len(), actions.len()),
            (policy.paths().len(), policy.paths().len())
        );
        for _ in 0..12 {
            let point = point(rng, &cell);
            // the nearest binary32 may lie just outside of the box
            let inside =
                |(x, range): (f64, &Interval)| f64::from(x as f32) >= range.low && f64::from(x as f32) <= range.high;
            if !point.iter().copied().zip(&cell).all(inside) {
                continue;
            }
            let observation: Vec<f32> = point.iter().map(|x| *x as f32).collect();
            let (real, held) = (exact::q_values(policy, &observation), held(&controller, &observation));
            let place = format!("{} {:?} at {observation:?}", policy.name, policy.numeric_format);
            for (range, real) in q_ranges.iter().zip(&real) {
                assert!(range.low <= *real && *real <= range.high, "{place}: real Q outside");
            }
            let errors = errors(policy, &controller, (&held, &real), rng);
            for (output, errors) in errors.into_iter().enumerate() {
                let (bound, whole) = (&bounds[output].per_action, &whole[output].per_action);
                assert_eq!(errors.len(), bound.len(), "{place}");
                for (n, error) in errors.into_iter().enumerate() {
                    let place = format!("{place}: {n} of output {output}");
                    assert!(error <= bound[n], "{place}: {error} > {}", bound[n]);
                    assert!(bound[n] <= whole[n] * 1.000_001, "{place}: a part beyond the whole");
                    nearest = nearest.max(error / bound[n]);
                }
            }
            for (path, action) in policy.paths().iter().zip(&actions) {
                let Some(action) = action else { continue };
                let own = |q: &[f64]| argmax(&q[path.columns()]);
                assert_eq!((own(&real), own(&held)), (*action, *action), "{place}");
            }
        }
    }
    (nearest, decided)
}

#[test]
fn the_examples_error_stays_within_its_bound() {
    for format in NumericFormat::ALL {
        let policy = example(format);
        let (nearest, decided) = check(&policy, &mut SplitMix::new(1), 150);
        println!("{format:?}: nearest {nearest:.3} of the bound, {decided} of 150 boxes decided");
        // roundings of single operations hardly ever add up as they could
        let is_integer = format.is_integer();
        assert!(
            nearest > if is_integer { 0.2 } else { 0.02 },
            "{format:?}: a bound that is never approached: {nearest}"
        );
        assert!(decided > 10, "{format:?}: no claim was tested");
    }
}

#[test]
fn random_policies_stay_within_their_bounds() {
    let mut rng = SplitMix::new(2);
    for seed in 500..530 {
        let folder = tests::random::policy(seed).unwrap();
        let policy = policy::load(&folder.path()).unwrap();
        for format in NumericFormat::ALL {
            check(&policy.clone().with_format(format), &mut rng, 10);
        }
    }
}

#[test]
fn several_outputs_stay_within_the_bounds_of_each() {
    let mut rng = SplitMix::new(5);
    let (mut decided, mut drives) = (0, 0);
    for seed in 700..720 {
        let folder = tests::random::several::policy(seed).unwrap();
        let policy = policy::load_with(&folder.path(), &tests::random::several::options()).unwrap();
        drives += policy.paths().iter().filter(|path| !path.head.is_choice()).count();
        for format in NumericFormat::ALL {
            decided += check(&policy.clone().with_format(format), &mut rng, 10).1;
        }
    }
    assert!(decided > 100 && drives > 10, "{decided} decisions, {drives} drives");
}

/// What is said of one output does not depend on the others: its bounds are those of a contract that has no others. Floats only,
/// for in integers the scale of the last layer is that of all columns.
#[test]
fn an_output_among_several_has_the_bounds_that_it_has_alone() {
    for seed in 720..730 {
        let folder = tests::random::several::policy(seed).unwrap();
        let policy = policy::load_with(&folder.path(), &tests::random::several::options()).unwrap();
        let certifier = Certifier::new(&policy);
        let bounds = certifier.box_bounds();
        for (path, bound) in policy.paths().iter().zip(&bounds) {
            let mut alone = policy.clone();
            alone.head = path.head.clone();
            let last = alone.layers.last_mut().unwrap();
            let rows = path.columns();
            last.weights = last.weights[rows.start * last.inputs..rows.end * last.inputs].to_vec();
            last.bias = last.bias[rows.clone()].to_vec();
            last.outputs = rows.len();
            // the symbols of other outputs stand between, so that sums of magnitudes are made in another order
            let alone = Certifier::new(&alone).box_bound();
            for (alone, among) in alone.per_action.iter().zip(&bound.per_action) {
                assert!(
                    (alone - among).abs() <= 1e-12 * alone,
                    "seed {seed}: {alone:e} {among:e}"
                );
            }
            assert_eq!(alone.per_action.len(), bound.per_action.len(), "seed {seed}");
        }
        let states = Domain::of(&policy, Memory::Free);
        let split = certifier.state_bounds(&states, 60);
        let of_whole = certifier.bounds_over(&states, &states.whole());
        assert!(
            split
                .iter()
                .zip(&of_whole)
                .all(|(split, whole)| split.bound.largest <= whole.largest)
        );
        assert!(
            split
                .iter()
                .zip(&of_whole)
                .any(|(split, whole)| split.bound.largest < whole.largest),
            "seed {seed}: splitting tightens no output"
        );
    }
}

/// An output without weights: the rounding of its bias is all that is wrong with it.
#[test]
fn the_rounding_of_a_bias_is_in_the_bound() {
    let path = tests::root().join("tests/golden/cases/minimal/policy.toml");
    let mut policy = policy::load(&path).unwrap().with_format(NumericFormat::I8);
    let last = policy.layers.last_mut().unwrap();
    last.weights[last.inputs..2 * last.inputs].fill(0.0);
    last.bias[1] = 0.3;
    let held = held(&Controller::<f32>::new(&policy), &[100.0, 5.0])[1];
    let error = (held - f64::from(0.3_f32)).abs();
    assert!(error > 0.0, "0.3 lies on no grid");
    let bound = Certifier::new(&policy).box_bound().per_action[1];
    assert!(error <= bound && bound <= 1.001 * error, "{error} {bound}");
}

#[test]
fn the_examples_features_come_in_pairs_of_opposite_sign() {
    let copies = Domain::of(&example(NumericFormat::F32), Memory::Free).copies();
    let found: Vec<_> = copies
        .iter()
        .map(|copy| (copy.feature, copy.of, copy.factor, copy.offset))
        .collect();
    assert_eq!(found, [(3, 0, -1.0, 0.0), (4, 1, -1.0, 0.0), (5, 2, -1.0, 0.0)]);
}

/// States are described by coordinates; the controller's own observation must be what they say.
#[test]
fn the_observation_of_a_controller_lies_where_its_coordinates_say() {
    let mut rng = SplitMix::new(3);
    let one = (600..640).map(|seed| tests::random::policy(seed).unwrap());
    let several = (740..760).map(|seed| tests::random::several::policy(seed).unwrap());
    for folder in one.chain(several) {
        let policy = policy::load_with(&folder.path(), &tests::random::several::options()).unwrap();
        let certifier = Certifier::new(&policy);
        let domain = Domain::of(&policy, Memory::Free);
        let mut controller = Controller::<f32>::new(&policy);
        let mut past: Vec<BTreeMap<String, f64>> = Vec::new();
        for _ in 0..30 {
            let values: Vec<f64> = policy
                .signals
                .iter()
                .map(|signal| rng.uniform(signal.range.low, signal.range.high))
                .collect();
            let samples: Vec<Sample> = policy
                .signals
                .iter()
                .zip(&values)
                .map(|(signal, value)| verify::traces::sample_of(policy::Scalar::F32, signal, *value))
                .collect();
            let state = controller.state();
            let paths = policy.paths();
            let duties = paths.iter().enumerate().flat_map(|(index, path)| {
                let own = state.output(index);
                let called = |word: &str| path.name.map_or(word.to_owned(), |name| format!("{name}_{word}"));
                [
                    (called("previous_duty"), f64::from(own.previous_duty)),
                    (called("previous_command"), f64::from(own.previous_command)),
                ]
            });
            let duties: Vec<(String, f64)> = duties.collect();
            let trace = controller.step(&samples).unwrap();
            let signals = policy.signals.iter().zip(&trace.signals);
            let signals = signals.map(|(signal, x)| (signal.name.clone(), f64::from(*x)));
            let estimates = policy
                .observers
                .iter()
                .zip(&trace.estimates)
                .flat_map(|(observer, seen)| {
                    let each = Estimate::ALL.into_iter().zip(seen);
                    each.map(|(estimate, x)| (format!("{}_{}", observer.name, estimate.word()), f64::from(*x)))
                });
            past.push(signals.chain(estimates).chain(duties).collect());
            let observation = trace.observation.to_vec();
            let point: Vec<f64> = domain
                .coordinates()
                .iter()
                .map(|coordinate| coordinate_value(&policy, &coordinate.name, &past, &observation))
                .collect();
            let cell: Vec<Interval> = point.iter().map(|&x| Interval { low: x, high: x }).collect();
            let real = exact::q_values(&policy, &observation);
            for (range, q) in certifier.q_values_over(&domain, &cell).iter().zip(&real) {
                assert!(
                    range.low <= *q && *q <= range.high,
                    "{range:?} {q}\n{}",
                    folder.contract
                );
            }
        }
    }
}

/// A coordinate by its name, from what the controller has seen; before the first sample everything was as then.
fn coordinate_value(policy: &Policy, name: &str, past: &[BTreeMap<String, f64>], observation: &[f32]) -> f64 {
    if let Some(index) = policy.features.iter().position(|feature| feature.name == name) {
        return f64::from(observation[index]);
    }
    let (name, ago) = name.split_once(", ").unwrap_or((name, "0 "));
    let ago: usize = ago.split(' ').next().unwrap().parse().unwrap();
    past[past.len().saturating_sub(1 + ago)][name]
}
