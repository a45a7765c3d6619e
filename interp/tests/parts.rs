//! Parts of a controller that a whole step does not show: its state, a choice made elsewhere, codes in binary64.

#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests stand outside of #[test] functions

#[allow(dead_code)] // another file of tests has the rest
mod common;

use common::{Dense, PLAIN, load, threshold, vectors};
use interp::Sample::{Code, Physical};
use interp::golden::{golden_result, refusal};
use interp::{Controller, status};
use ndarray::aview1;
use policy::{Golden, NumericFormat, Policy};

const SOURCE: &str = "source = \"u\"";
const FILTERED: &str = "source = \"u\"\nfilters = [\"backward_difference\"]";

fn of(feature: &str) -> Controller<f32> {
    Controller::new(&threshold(feature, PLAIN, &[]))
}

#[test]
fn an_action_chosen_elsewhere_is_commanded_and_one_beyond_the_last_is_the_last() {
    let controller = of(SOURCE);
    let samples = [Physical(2.0), Physical(1.0)];
    for (chosen, index, duty) in [(0, 0, 0.25), (1, 1, 0.75), (7, 1, 0.75)] {
        let mut trace = controller.blank_trace();
        controller.sense_into(&samples, &mut trace).unwrap();
        controller.choose(&mut trace, chosen);
        assert_eq!((trace.action_index, trace.duty_sim), (index, duty));
        assert_eq!((trace.command.action_index, trace.command.duty), (index, duty));
    }
    let mut trace = controller.blank_trace();
    controller.sense_into(&samples, &mut trace).unwrap();
    controller.give(&mut trace, 0.5);
    assert_eq!((trace.command.duty_sim, trace.command.duty), (0.5, 0.5));
}

#[test]
fn outputs_of_a_network_are_decided_if_they_are_as_many_as_there_are_actions() {
    let controller = of(SOURCE);
    assert_eq!(controller.decide(&aview1(&[5.0, 6.0])), Some((1, 0.75)));
    assert_eq!(
        controller.decide(&aview1(&[6.0, 6.0])),
        Some((0, 0.25)),
        "the lowest of equals"
    );
    assert_eq!(controller.decide(&aview1(&[6.0])), None);
}

#[test]
fn a_state_is_put_back_if_it_is_of_this_shape_and_otherwise_nothing_changes() {
    let mut controller = of(FILTERED);
    let fresh = controller.state().clone();
    controller.step(&[Physical(4.0), Physical(1.0)]).unwrap();
    let moved = controller.state().clone();
    assert_ne!(fresh.words(), moved.words());
    assert!(controller.restore(&fresh));
    assert_eq!(controller.state().words(), fresh.words());
    // no filter memory: every other part is alike
    let other = of(SOURCE).state().clone();
    assert!(!controller.restore(&other));
    // a soft start, which the others have not
    let soft = format!("{PLAIN}\n").replace(
        "initial_duty = 0.5",
        "initial_duty = 0.125\nsoft_start = { from = 0.125, steps = 4 }",
    );
    let mut with_cap = Controller::<f32>::new(&threshold(FILTERED, &soft, &[]));
    assert!(!with_cap.restore(&fresh) && !controller.restore(&with_cap.state().clone()));
    assert_eq!(controller.state().words(), fresh.words());
}

#[test]
fn the_numbers_of_a_state_are_its_words_in_order() {
    let mut controller = of(FILTERED);
    controller.step(&[Physical(4.0), Physical(1.0)]).unwrap();
    let mut state = controller.state().clone();
    let numbers: Vec<u32> = state.numbers_mut().map(|x| x.to_bits()).collect();
    // samples of u and i, the filter's memory, the last two duties; then bad_count and primed
    assert_eq!(numbers, [4.0_f32, 1.0, 4.0, 0.25, 0.25].map(f32::to_bits));
    assert_eq!(state.words()[..5], numbers[..]);
    assert_eq!(state.words()[5..], [0, 1]);
    for number in state.numbers_mut() {
        *number = 0.5;
    }
    assert_eq!(state.words()[..5], [0.5_f32.to_bits(); 5]);
}

#[test]
fn a_memory_is_sound_to_both_sides_of_zero() {
    let controller = of(FILTERED);
    let at = controller
        .state_names()
        .iter()
        .position(|name| name.starts_with("f.0."));
    let (low, high) = controller.sound_ends()[at.unwrap()].unwrap();
    // |u| <= 10, and a little for roundings (section 1)
    assert_eq!(low, -high);
    assert!((10.0..10.001).contains(&high), "{high}");
}

/// `x = gain * code + offset`, each operation rounded once to binary64; the state's numbers are two words each.
#[test]
fn codes_of_an_adc_in_binary64() {
    let contract = format!(
        "name = \"codes\"\nsample_period = 0.25\nnumeric_format = \"f64\"\n[[signal]]\nname = \"u\"\nrange = [0.0, 10.0]\n\
         adc = {{ gain = 0.003, offset = -0.1 }}\n[[feature]]\nname = \"x\"\nsource = \"u\"\n\
         [network]\nweights = \"weights.safetensors\"\n[actions]\nduties = [0.25, 0.75]\n{PLAIN}"
    );
    let network = Dense {
        inputs: 1,
        outputs: 2,
        weights: &[0.0, 1.0],
        bias: &[5.0, 0.0],
    };
    let mut controller = Controller::<f64>::new(&load(&contract, &[], &[network]));
    let trace = controller.step(&[Code(2000)]).unwrap();
    let physical: f64 = 0.003 * 2000.0 - 0.1;
    assert_eq!(trace.observation.to_vec(), [physical]);
    assert_eq!((trace.command.action_index, trace.command.status), (1, status::PRIMED));
    let words = controller.state_words();
    let bits = physical.to_bits();
    assert_eq!(words[..2], [bits as u32, (bits >> 32) as u32], "the low word first");
}

/// Two features, so that a row is not a number.
#[test]
fn answers_of_the_trainer_are_compared_row_by_row() {
    let contract = format!(
        "name = \"two\"\nsample_period = 0.25\n[[signal]]\nname = \"u\"\nrange = [0.0, 10.0]\n[[signal]]\nname = \"i\"\n\
         range = [0.0, 10.0]\n[[feature]]\nname = \"x\"\nsource = \"u\"\n[[feature]]\nname = \"y\"\nsource = \"i\"\n\
         [network]\nweights = \"weights.safetensors\"\n[actions]\nduties = [0.25, 0.75]\n{PLAIN}"
    );
    let network = Dense {
        inputs: 2,
        outputs: 2,
        weights: &[1.0, 0.0, 0.0, 1.0],
        bias: &[0.0, 0.0],
    };
    let mut policy = load(&contract, &[], &[network]);
    let golden = Golden {
        q_values: vec![3.0, 6.0, 4.0, 2.0, 1.0, 8.0],
        action_indices: vec![1, 0, 1],
        ..vectors(3, &[3.0, 6.0, 4.0, 2.0, 1.0, 8.0])
    };
    policy.golden = Some(golden.clone());
    let result = golden_result(&policy).unwrap();
    assert_eq!((result.actions_equal, result.actions_compared), (3, 3));
    assert_eq!(result.worst_relative_error, Some(0.0));
    assert!(result.passed() && refusal(&policy).is_none());
    assert_eq!(
        result.to_string(),
        "action equal in 3 of 3, largest relative error of Q 0.0e0 (allowed 1e-4)"
    );
    // without actions of the trainer none are spoken of
    policy.golden = Some(Golden {
        action_indices: Vec::new(),
        ..golden.clone()
    });
    assert!(!golden_result(&policy).unwrap().to_string().contains("action"));
    // a row of another network
    let mut q_values = golden.q_values.clone();
    q_values[4] = 1.5;
    policy.golden = Some(Golden { q_values, ..golden });
    let told = format!("{:?}", refusal(&policy).unwrap());
    // half of the largest |Q|, 8: 0.5 / 8
    assert!(told.contains("a relative error of Q of 6.2e-2, allowed 1e-4"), "{told}");
    // another format gives the same integers back
    let integer = policy.clone().with_format(NumericFormat::I16);
    assert!(refusal(&integer).is_some());
}

/// One hidden unit with ReLU behind u from -40 to 40, then two Q values. `hidden` is its weight and its bias.
fn deep(hidden: [f32; 2], weights: [f32; 2], bias: [f32; 2]) -> Policy {
    let contract = format!(
        "name = \"deep\"\nsample_period = 0.25\n[[signal]]\nname = \"u\"\nrange = [-40.0, 40.0]\n[[feature]]\nname = \"x\"\nsource = \"u\"\n\
         [network]\nweights = \"weights.safetensors\"\nhidden_activation = \"relu\"\n[actions]\nduties = [0.25, 0.75]\n{PLAIN}"
    );
    let layer = |outputs, weights, bias| Dense {
        inputs: 1,
        outputs,
        weights,
        bias,
    };
    let layers = [layer(1, &hidden[..1], &hidden[1..]), layer(2, &weights[..], &bias[..])];
    load(&contract, &[], &layers)
}

/// The trainer's network is one of tanh, and the contract says relu.
#[test]
fn an_activation_that_gives_every_golden_answer_is_the_hint() {
    let mut policy = deep([1.0, 0.5], [2.0, -1.0], [0.0, 0.25]);
    let observations = [-2.0, -0.5, 0.75, 3.0];
    let q = observations.iter().flat_map(|x: &f32| {
        let y = (f64::from(*x) + 0.5).tanh();
        [2.0 * y, 0.25 - y]
    });
    policy.golden = Some(Golden {
        q_values: q.map(|q| q as f32).collect(),
        tolerance: 1e-5,
        ..vectors(4, &observations)
    });
    let result = golden_result(&policy).unwrap();
    assert!(!result.passed());
    assert_eq!(result.activations, ["\"tanh\""]);
    assert!(
        result.hint().contains("hidden_activation = \"tanh\""),
        "{}",
        result.hint()
    );
    // where the answers are given nobody asks for another
    let tanh = policy::Activation::EACH.iter().find(|each| each.word() == "tanh");
    policy.layers[0].activation = *tanh.unwrap();
    let result = golden_result(&policy).unwrap();
    assert!(result.passed() && result.activations.is_empty(), "{result}");
}

/// Actions that are another than the most frequent one, here and there among them: from twenty on they tell an activation.
#[test]
fn few_actions_of_another_kind_tell_no_activation() {
    // Q = (0.5, y): behind ReLU action 1 for x above 0.5 alone
    let mut policy = deep([1.0, 0.0], [0.0, 1.0], [0.5, 0.0]);
    let with = |telling: usize| {
        let ones: Vec<usize> = (0..telling).map(|n| 2 * n).collect();
        let count = 2 * telling + 20;
        let observations: Vec<f32> = (0..count).map(|n| if ones.contains(&n) { 0.4 } else { -1.0 }).collect();
        Golden {
            action_indices: (0..count).map(|n| u32::from(ones.contains(&n))).collect(),
            tolerance: 1e-5,
            ..vectors(count, &observations)
        }
    };
    // sigmoid(0.4) is 0.6, above 0.5, and sigmoid(-1) 0.27 is not: with it all actions are given
    policy.golden = Some(with(20));
    let told = golden_result(&policy).unwrap();
    assert!(
        told.activations.contains(&"\"sigmoid\"".to_owned()),
        "{:?}",
        told.activations
    );
    policy.golden = Some(with(19));
    let told = golden_result(&policy).unwrap();
    assert!(!told.passed() && told.activations.is_empty(), "{:?}", told.activations);
}

/// The law is `u / 16`, the network adds a quarter of the duty to it where u is above 5.
fn residual(dead_zone: &str) -> Controller<f32> {
    let contract = format!(
        "name = \"law\"\nsample_period = 0.25\n[[signal]]\nname = \"u\"\nrange = [0.0, 10.0]\n[[signal]]\nname = \"i\"\n\
         range = [-5.0, 5.0]\n[[feature]]\nname = \"x\"\nsource = \"u\"\n[network]\nweights = \"weights.safetensors\"\n\
         [actions]\nbase = \"u / 16\"\noffsets = [0.0, 0.25]\n{dead_zone}\n{PLAIN}"
    );
    let network = Dense {
        inputs: 1,
        outputs: 2,
        weights: &[0.0, 1.0],
        bias: &[5.0, 0.0],
    };
    Controller::new(&load(&contract, &[], &[network]))
}

#[test]
fn nothing_is_added_to_a_law_where_all_of_its_dead_zone_is_small() {
    let duty = |dead_zone: &str, u: f32, i: f32| {
        let trace = residual(dead_zone).eval(&[Physical(u), Physical(i)]).unwrap();
        (trace.command.action_index, trace.command.duty_sim)
    };
    let both = "dead_zone = [{ source = \"u - 8\", within = 0.5 }, { source = \"i\", within = 1.0 }]";
    // no dead zone: the offset is added everywhere
    assert_eq!(duty("", 8.0, 0.0), (1, 0.75));
    assert_eq!(duty("", 4.0, 0.0), (0, 0.25));
    assert_eq!(duty(both, 8.0, 0.0).1, 0.5);
    assert_eq!(duty(both, 8.0, 1.0).1, 0.5, "its end belongs to it");
    // one of both is large
    assert_eq!(duty(both, 8.0, 2.0).1, 0.75);
    assert_eq!(duty(both, 9.0, 0.0).1, 0.8125);
}
