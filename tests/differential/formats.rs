//! The other numeric formats: generated code against the interpreter, bit by bit.

use interp::Controller;
use policy::{NumericFormat, Policy, scales};
use random::{Random, SplitMix};
use verify::{Files, Options};

use super::{COMPILERS, assert_equal, assert_random_policies_are_equal, run};

const OTHERS: [NumericFormat; 4] = [
    NumericFormat::F32Fma,
    NumericFormat::F64,
    NumericFormat::I16,
    NumericFormat::I8,
];

fn example(format: NumericFormat) -> Policy {
    policy::load(&tests::example()).unwrap().with_format(format)
}

#[test]
fn the_example_is_equal_in_every_format_and_build() {
    for format in OTHERS {
        let report = run(&example(format), 20_000, 5, &[]);
        assert_equal(&report, format.name());
        let golden = report.golden.unwrap();
        assert_eq!(
            golden.actions_equal, golden.actions_compared,
            "the network was read rightly"
        );
    }
}

#[test]
fn random_policies_are_equal_in_every_format() {
    for seed in 300..306 {
        let folder = tests::random::policy(seed).unwrap();
        let policy = policy::load(&folder.path()).unwrap();
        for (turn, format) in OTHERS.into_iter().enumerate() {
            let compiler = COMPILERS[(seed as usize + turn) % 3];
            let report = run(&policy.clone().with_format(format), 1000, seed, &[compiler]);
            assert_equal(&report, &format!("{} {compiler}\n{}", format.name(), folder.contract));
        }
    }
}

/// On this one gcc 11 and 12 at -O3 left out the rounding between two fused operations that were emulated through binary64.
#[test]
fn emulated_fused_operations_are_rounded_one_by_one() {
    assert_random_policies_are_equal(2862..2863, NumericFormat::F32Fma, 200);
}

#[test]
fn random_policies_are_equal_in_binary64() {
    let count = if tests::full() { 60 } else { 6 };
    assert_random_policies_are_equal(400..400 + count, NumericFormat::F64, 2000);
}

/// Else a verification that took the wrong interpreter would not be seen.
#[test]
fn binary64_gives_other_q_values_than_binary32() {
    let policy = policy::load(&tests::example()).unwrap();
    let (wide, single) = (Controller::<f64>::new(&policy), Controller::<f32>::new(&policy));
    let observation = [0.3, -0.7, 0.1, 0.2, -0.4, 0.9];
    let q = wide.q_values(&ndarray::aview1(&observation)).unwrap();
    let near = single
        .q_values(&ndarray::aview1(&observation.map(|o| o as f32)))
        .unwrap();
    let distances = q.iter().zip(&near).map(|(q, near)| (q - f64::from(*near)).abs());
    let worst = distances.fold(0.0, f64::max);
    assert!(worst > 1e-9 && worst < 1e-3, "{worst}");
}

/// A number that is rounded to binary32 on its way.
#[test]
fn planted_defects_in_binary64_are_caught() {
    let policy = example(NumericFormat::F64);
    let host = targets::find("host").unwrap();
    let clean: Files = codegen::sources(&policy, host, &[codegen::Output::C], None)
        .unwrap()
        .files;
    let edits = [
        (
            "select(f0, measured->v_out",
            "select(f0, (double)(float)measured->v_out",
        ),
        (
            "out[o] = out[o] + ((double)w[o] * input)",
            "out[o] = (double)(float)(out[o] + ((double)w[o] * input))",
        ),
        ("front->observation[0] = ", "front->observation[0] = (double)(float)"),
        (
            "chosen = buck12_duties[index]",
            "chosen = (double)(float)buck12_duties[index]",
        ),
        (
            "state->previous_command = ",
            "state->previous_command = (double)(float)",
        ),
    ];
    for (from, to) in edits {
        let mut files = clean.clone();
        let text = files.get_mut("buck12.c").unwrap();
        let edited = text.replacen(from, to, 1);
        assert!(*text != edited, "{from}: the edit has found its place");
        *text = edited;
        let options = Options {
            steps: 5000,
            generated: Some(&files),
            compilers: vec!["gcc".into()],
            ..Options::default()
        };
        assert!(!verify::run(&policy, options).unwrap().passed(), "{from}");
    }
}

/// A change to a source text.
type Edit<'a> = &'a dyn Fn(&str) -> String;

/// Defects of the integer network: one bit of a weight, of a bias, of the shift, the clamp of the input.
#[test]
fn planted_defects_in_the_integer_network_are_caught() {
    let policy = example(NumericFormat::I16);
    let host = targets::find("host").unwrap();
    let clean: Files = codegen::sources(&policy, host, &[codegen::Output::C], None)
        .unwrap()
        .files;
    let shift = scales::of(&policy).unwrap().layers[1].shift;
    let edits: [(&str, Edit<'_>); 4] = [
        ("weight", &|text| flipped(text, "buck12_weights1[4096] = {")),
        ("bias", &|text| flipped(text, "buck12_bias1[64] = {")),
        ("shift", &|text| {
            text.replacen(&format!(">> {shift})"), &format!(">> {})", shift - 1), 1)
        }),
        ("order", &|text| {
            text.replacen("((int32_t)w[0] * x0)", "((int32_t)w[0] * x1)", 1)
        }),
    ];
    for (name, edit) in edits {
        let mut files = clean.clone();
        let text = files.get_mut("buck12.c").unwrap();
        let edited = edit(text);
        assert_ne!(*text, edited, "{name}: the edit has found its place");
        *text = edited;
        let options = Options {
            steps: 5000,
            generated: Some(&files),
            compilers: vec!["gcc".into()],
            ..Options::default()
        };
        let report = verify::run(&policy, options).unwrap();
        assert!(!report.passed(), "{name}");
    }
}

/// The first literal of a table with its last bit inverted.
fn flipped(text: &str, table: &str) -> String {
    let start = text.find(table).unwrap() + table.len();
    let end = start + text[start..].find(',').unwrap();
    let value: i32 = text[start..end].trim().parse().unwrap();
    format!("{}{}{}", &text[..start], value ^ 1, &text[end..])
}

/// Largest |Q_int - Q_real| over pseudo-random observations of the box, relative to the range of the real Q values.
fn worst_error(policy: &Policy, format: NumericFormat) -> f64 {
    let real = Controller::<f64>::new(policy);
    let integer = Controller::<f32>::new(&policy.clone().with_format(format));
    let mut rng = SplitMix::new(3);
    let (mut worst, mut low, mut high) = (0.0_f64, f64::INFINITY, f64::NEG_INFINITY);
    for _ in 0..4000 {
        let o: Vec<f32> = policy
            .features
            .iter()
            .map(|feature| rng.uniform(feature.bound.low, feature.bound.high) as f32)
            .collect();
        let wide: Vec<f64> = o.iter().map(|o| f64::from(*o)).collect();
        let exact = real.q_values(&ndarray::aview1(&wide)).unwrap();
        let rounded = integer.q_values(&ndarray::aview1(&o)).unwrap();
        for (exact, rounded) in exact.iter().zip(&rounded) {
            worst = worst.max((exact - f64::from(*rounded)).abs());
            (low, high) = (low.min(*exact), high.max(*exact));
        }
    }
    worst / (high - low)
}

/// i16: a tenth of what TensorFlow Lite's int8 errs by on a network of this size (`bench`, 1.8e-2 of the range). i8: clearly less
/// than one scale a layer would leave in the example (3.2e-2).
fn assert_accurate(policy: &Policy, case: &str) {
    for (format, limit) in [(NumericFormat::I16, 1.8e-3), (NumericFormat::I8, 2.5e-2)] {
        let error = worst_error(policy, format);
        println!("{case}, {}: {error:.1e} of the range", format.name());
        assert!(error <= limit, "{case}, {}: {error}", format.name());
    }
}

/// One weight of the example's second layer is fifty times the mean.
#[test]
fn the_integer_networks_stay_near_the_real_one() {
    assert_accurate(&policy::load(&tests::example()).unwrap(), "buck12");
    let bench = tests::root().join("bench/policy/policy.toml");
    assert_accurate(&policy::load(&bench).unwrap(), "bench");
}

/// A ReLU neuron may count in other units than its neighbours without changing the function: row times z, column over z.
/// z = 2^k, so the real Q values are the same bit for bit, and a scale that all neurons share would drown most of them.
#[test]
fn neurons_of_very_different_sizes_are_no_worse() {
    let example = policy::load(&tests::example()).unwrap();
    let mut rng = SplitMix::new(11);
    let mut policy = example.clone();
    for index in 0..policy.layers.len() - 1 {
        for neuron in 0..policy.layers[index].outputs {
            let factor = rng.uniform(-8.0, 8.0).round().exp2() as f32;
            let [layer, next] = &mut policy.layers[index..index + 2] else {
                unreachable!()
            };
            let row = neuron * layer.inputs..(neuron + 1) * layer.inputs;
            layer.weights[row].iter_mut().for_each(|w| *w *= factor);
            layer.bias[neuron] *= factor;
            let column = next.weights.iter_mut().skip(neuron).step_by(next.inputs);
            column.for_each(|w| *w /= factor);
        }
    }
    let q = |policy: &Policy| {
        Controller::<f64>::new(policy)
            .q_values(&ndarray::aview1(&[1.0; 6]))
            .unwrap()
    };
    assert_eq!(q(&example), q(&policy), "the same function");
    assert_accurate(&policy, "neurons rescaled");
}

/// A neuron that nothing drives but a large bias must not take the bits of the others.
#[test]
fn a_neuron_of_bias_alone_does_no_harm() {
    let mut policy = policy::load(&tests::example()).unwrap();
    for layer in &mut policy.layers[..2] {
        let inputs = layer.inputs;
        layer.weights[..2 * inputs].iter_mut().for_each(|w| *w *= 1e-6);
        (layer.bias[0], layer.bias[1]) = (3.0, -3.0);
    }
    assert_accurate(&policy, "bias alone");
}
