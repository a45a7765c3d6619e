//! Gain schedules (contract section 7c) as whole controllers: the order of the sum, each gain's map, sign and limits.

#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests stand outside of #[test] functions

#[allow(dead_code)] // another file of tests has the rest
mod common;

use common::{Dense, PLAIN, load, vectors};
use interp::decisions::{Decisions, decisions};
use interp::{Controller, Sample, Trace};
use policy::{Golden, Policy};

/// A controller of `u` (0..10) and `i` (-5..5) whose network gives these outputs whatever it sees. Feature `f` is the integral of
/// u, scaled by 0.5 and clipped; feature `g` is i.
fn policy(outputs: &[f32], actions: &str) -> Policy {
    let contract = format!(
        "name = \"schedule\"\nsample_period = 0.25\n[[signal]]\nname = \"u\"\nrange = [0.0, 10.0]\n\
         [[signal]]\nname = \"i\"\nrange = [-5.0, 5.0]\n\
         [[feature]]\nname = \"f\"\nsource = \"u\"\nfilters = [{{ integrator = {{ min = -3.0, max = 3.0 }} }}]\nscale = 0.5\n\
         offset = 7.0\nclip = [-1.0, 1.0]\n[[feature]]\nname = \"g\"\nsource = \"i\"\n\
         [network]\nweights = \"weights.safetensors\"\n[actions]\n{actions}\n{PLAIN}"
    );
    let weights = vec![0.0; 2 * outputs.len()];
    let network = Dense {
        inputs: 2,
        outputs: outputs.len(),
        weights: &weights,
        bias: outputs,
    };
    load(&contract, &[], &[network])
}

fn step(outputs: &[f32], actions: &str, u: f32, i: f32) -> Trace<f32> {
    let controller = Controller::<f32>::new(&policy(outputs, actions));
    controller.eval(&[Sample::Physical(u), Sample::Physical(i)]).unwrap()
}

fn duty(outputs: &[f32], actions: &str, u: f32, i: f32) -> f32 {
    step(outputs, actions, u, i).duty_sim
}

#[test]
fn the_duty_is_base_and_gains_times_factors() {
    let actions = "base = \"0.25 + i / 100\"\ngains = [{ source = \"u - 4\", clip = [-1, 1], scale = 0.125 }, { clip = [-1, 1], scale = 0.5 }]";
    let trace = step(&[0.5, 0.125], actions, 6.0, -5.0);
    // 0.2 + 0.5 / 8 * 2 + 0.0625
    assert_eq!((trace.action_index, trace.duty_sim), (0, 0.2 + 0.125 + 0.0625));
    assert_eq!(trace.factors, [2.0, 1.0]);
    // a wrong sign would raise the duty
    assert!(duty(&[-0.5, 0.125], actions, 6.0, -5.0) < 0.2);
}

/// 2^24 takes all of what stands before it, and gives back nothing.
#[test]
fn products_are_added_in_the_order_of_the_gains() {
    let big = "{ source = \"u\", clip = [-1, 1], scale = 33554432.0 }";
    let small = "{ clip = [-1, 1], scale = 0.5 }";
    let of = |gains: [&str; 3], outputs: [f32; 3]| duty(&outputs, &format!("gains = [{}]", gains.join(", ")), 4.0, 0.0);
    // 2^25 - 2^25 + 0.5, and 0.5 + 2^25 - 2^25, which ends at the lower limit
    assert_eq!(of([big, big, small], [0.25, -0.25, 1.0]), 0.5);
    assert_eq!(of([small, big, big], [1.0, 0.25, -0.25]), 0.125);
    // a base is the first of all
    let with_base = format!("base = \"0.5\"\ngains = [{big}, {big}]");
    assert_eq!(duty(&[0.25, -0.25], &with_base, 4.0, 0.0), 0.125);
}

#[test]
fn each_gain_has_its_own_squash_scale_offset_and_limits() {
    let gain = |map: &str, output: f32| duty(&[output], &format!("gains = [{{ source = \"u\", {map} }}]"), 1.0, 0.0);
    assert_eq!(gain("clip = [-1, 1], scale = 0.25, offset = 0.5", 7.0), 0.75);
    assert_eq!(gain("clip = [-1, 1], scale = -0.25, offset = 0.5", 7.0), 0.25);
    assert_eq!(
        gain("clip = [-1, 1], scale = 0.25, offset = 0.5, limits = [0.4, 0.625]", 7.0),
        0.625
    );
    assert_eq!(
        gain(
            "clip = [-1, 1], scale = 0.25, offset = 0.5, limits = [0.375, 0.6]",
            -7.0
        ),
        0.375
    );
    assert_eq!(gain("scale = 0.25, offset = 0.5, limits = [-3.0, 3.0]", 0.5), 0.625);
    // 1 is a number as any other, for a scale and for an offset
    assert_eq!(gain("clip = [-1, 1], scale = 1.0, offset = 1.0", -0.5), 0.5);
    assert_eq!(gain("clip = [-1, 1], scale = 2.0, offset = 1.0", -0.25), 0.5);
    // without squash and clip the limits act on what scale and offset made
    assert_eq!(gain("scale = 0.5, offset = 0.25, limits = [0.5, 0.75]", 64.0), 0.75);
    let tanh = f64::from(gain("squash = \"tanh\", scale = 0.25, offset = 0.5", 0.75));
    assert!((tanh - (0.5 + 0.25 * 0.75_f64.tanh())).abs() < 2e-7, "{tanh}");
}

#[test]
fn a_feature_is_taken_behind_its_filters_and_before_scale_offset_and_clip() {
    let actions = "base = \"0.5\"\ngains = [{ feature = \"f\", clip = [-1, 1], scale = 0.125 }]";
    let mut controller = Controller::<f32>::new(&policy(&[1.0], actions));
    // the integral of 4 over 0.25 s a step: 1, 2, 3, and there its own clamp
    for expected in [0.625, 0.75, 0.875, 0.875] {
        let trace = controller
            .step(&[Sample::Physical(4.0), Sample::Physical(0.0)])
            .unwrap();
        assert_eq!(trace.duty_sim, expected);
    }
}

#[test]
fn in_the_dead_zone_the_base_alone_is_commanded() {
    let actions = "base = \"0.5\"\ngains = [{ clip = [-1, 1] }]\ndead_zone = [{ source = \"i\", within = 1.0 }]";
    assert_eq!(duty(&[0.25], actions, 0.0, 1.0), 0.5);
    assert_eq!(duty(&[0.25], actions, 0.0, -1.0), 0.5);
    assert_eq!(duty(&[0.25], actions, 0.0, 1.25), 0.75);
}

#[test]
fn the_sum_is_clamped_to_the_limits_and_no_part_of_it_is() {
    let actions = "base = \"u\"\ngains = [{ source = \"u\", clip = [-1, 1] }]";
    assert_eq!(duty(&[1.0], actions, 8.0, 0.0), 0.875);
    // 8 - 7.5: a base that was clamped before would end at the lower limit
    assert_eq!(duty(&[-0.9375], actions, 8.0, 0.0), 0.5);
}

/// `previous_duty` lies within the limits, whatever the gains reach.
#[test]
fn a_sound_duty_lies_within_the_limits() {
    let actions = "base = \"previous_duty\"\ngains = [{ clip = [-1, 1] }]";
    let controller = Controller::<f32>::new(&policy(&[1.0], actions));
    let at = controller.state_names().iter().position(|name| name == "previous_duty");
    // 0.0625 is the fallback
    assert_eq!(controller.sound_ends()[at.unwrap()].unwrap(), (0.0625, 0.875));
}

#[test]
fn nothing_can_be_chosen_and_gains_are_given_for_outputs() {
    let actions = "gains = [{ source = \"u\", clip = [-1, 1], scale = 0.5 }, { clip = [-1, 1] }]";
    let controller = Controller::<f32>::new(&policy(&[1.0, 0.25], actions));
    let outputs = ndarray::aview1(&[0.5_f32, 3.0]);
    assert_eq!(controller.gains(&outputs), Some(vec![0.25, 1.0]));
    assert_eq!(controller.decide(&outputs), None);
    assert_eq!(
        controller.gains(&ndarray::aview1(&[0.5_f32])),
        None,
        "one output is missing"
    );
}

/// The second gain of the second row is off by a quarter of an output, an eighth of its range from -0.5 to 0.5.
#[test]
fn gains_in_a_format_are_held_against_those_of_the_trainers_outputs() {
    let actions =
        "base = \"0.25\"\ngains = [{ source = \"u\", clip = [-1, 1], scale = 0.125 }, { clip = [-1, 1], scale = 0.5 }]";
    let mut policy = policy(&[0.5, 0.125], actions);
    policy.golden = Some(Golden {
        q_values: vec![0.5, 0.125, 0.5, 0.375],
        ..vectors(2, &[0.25, 1.0, -0.5, 2.0])
    });
    let Some(Decisions::Schedule(found)) = decisions(&policy, None) else {
        panic!("no schedule");
    };
    assert_eq!((found.observations, found.largest, found.mean), (2, 0.125, 0.0625));
    assert!(!found.kept());
    let worst = found.worst.unwrap();
    assert_eq!((worst.row, worst.gain, worst.range), (1, 1, 1.0));
    assert_eq!((worst.expected, worst.found), (0.1875, 0.0625));
    assert_eq!(worst.observation, [-0.5, 2.0]);
    // without outputs binary64 stands for them, which these numbers are exact in
    if let Some(golden) = &mut policy.golden {
        golden.q_values.clear();
    }
    let Some(Decisions::Schedule(found)) = decisions(&policy, None) else {
        panic!("no schedule");
    };
    assert_eq!((found.observations, found.largest), (2, 0.0));
    // of equal errors the first row and the first gain
    let worst = found.worst.unwrap();
    assert_eq!((worst.row, worst.gain), (0, 0));
}
