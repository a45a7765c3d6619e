//! Observers (contract section 2b) against a converter integrated in small steps, and against a step worked out by hand.

#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests stand outside of #[test] functions

#[allow(dead_code)] // another file of tests has the rest
mod common;

use common::{Dense, PLAIN, load};
use interp::Sample::Physical;
use interp::{Command, Controller, Trace};
use policy::NumericFormat;

const PERIOD: f64 = 1e-5;
const INDUCTANCE: f64 = 100e-6;
const CAPACITANCE: f64 = 60e-6;
const V_IN: f32 = 48.0;

/// A controller whose observations are the three estimates; `observer` are further keys of the observer.
fn controller(period: f64, [inductance, capacitance]: [f64; 2], observer: &str) -> Controller<f64> {
    let contract = format!(
        "name = \"seen\"\nsample_period = {period:?}\n\
         [[signal]]\nname = \"v_out\"\nrange = [0.0, 40.0]\n[[signal]]\nname = \"i_out\"\nrange = [-1.0, 20.0]\n\
         [[signal]]\nname = \"v_in\"\nrange = [5.0, 60.0]\n\
         [[observer]]\nname = \"m\"\ninductance = {inductance:?}\ncapacitance = {capacitance:?}\n\
         output_voltage = \"v_out\"\nload_current = \"i_out\"\nbias = [-6.0, 6.0]\n{observer}\n\
         [[feature]]\nname = \"i\"\nsource = \"m_current\"\n[[feature]]\nname = \"v\"\nsource = \"m_voltage\"\n\
         [[feature]]\nname = \"b\"\nsource = \"m_bias\"\n\
         [network]\nweights = \"weights.safetensors\"\n[actions]\nduties = [0.25, 0.75]\n{PLAIN}"
    );
    let network = Dense {
        inputs: 3,
        outputs: 2,
        weights: &[0.0; 6],
        bias: &[0.0; 2],
    };
    Controller::new(&load(&contract, &[], &[network]).with_format(NumericFormat::F64))
}

/// Gains whose poles are at most 0.86 with the values above.
const GAINS: &str = "gains = { current = 0.5, voltage = 0.6, bias = 0.1 }";

/// A buck converter as its differential equations are, in steps of a thousandth of the period.
struct Converter {
    current: f64,
    voltage: f64,
    /// In series with the inductor, ohm.
    resistance: f64,
    has_diode: bool,
}

impl Converter {
    fn period(&mut self, duty: f64, load: f64) {
        const STEPS: u32 = 1000;
        let dt = PERIOD / f64::from(STEPS);
        for step in 0..STEPS {
            let is_on = f64::from(step) + 0.5 < duty * f64::from(STEPS);
            let node = if is_on { f64::from(V_IN) } else { 0.0 };
            let slope = (node - self.voltage - self.resistance * self.current) / INDUCTANCE;
            self.voltage += (self.current - load) / CAPACITANCE * dt;
            self.current += slope * dt;
            if self.has_diode {
                self.current = self.current.max(0.0);
            }
        }
    }
}

/// Estimates less truth of every step, from the step on at which everything has settled; the duty and the load jump.
fn errors(controller: &mut Controller<f64>, mut converter: Converter, delay: usize) -> Vec<[f64; 2]> {
    let mut errors = Vec::new();
    let mut commanded = vec![0.5; delay];
    for step in 0..600 {
        // a resistor, as it is at the start of the period: a current would leave the converter without damping
        let load = converter.voltage / if (step / 70) % 2 == 0 { 3.0 } else { 2.0 };
        let duty = if (step / 50) % 2 == 0 { 0.25 } else { 0.28 };
        let samples = [converter.voltage as f32, load as f32, V_IN].map(Physical);
        let trace = controller.eval(&samples).unwrap();
        let seen = trace.estimates[0];
        let before = [converter.current, converter.voltage];
        let command = Command {
            duty,
            duty_sim: duty,
            ..trace.command
        };
        controller.commit(&samples, &command).unwrap();
        commanded.push(duty);
        converter.period(commanded[step], load);
        // with a delay the estimates are those of the next instant
        let truth = if delay == 1 {
            [converter.current, converter.voltage]
        } else {
            before
        };
        if step >= 120 {
            errors.push([seen[0] - truth[0], seen[1] - truth[1]]);
        }
    }
    errors
}

fn worst(errors: &[[f64; 2]], which: usize) -> f64 {
    errors.iter().map(|error| error[which].abs()).fold(0.0, f64::max)
}

fn ideal() -> Converter {
    Converter {
        current: 4.0,
        voltage: 12.0,
        resistance: 0.0,
        has_diode: false,
    }
}

#[test]
fn estimates_follow_a_loss_free_converter_at_either_delay_and_with_either_input_voltage() {
    for (delay, source) in [(0, "48.0"), (1, "48.0"), (0, "\"v_in\""), (1, "\"v_in\"")] {
        let keys = format!("input_voltage = {source}\ncompute_delay = {delay}\n{GAINS}\ncurrent = [-20.0, 40.0]");
        let mut own = controller(PERIOD, [INDUCTANCE, CAPACITANCE], &keys);
        let errors = errors(&mut own, ideal(), delay);
        // what the trapezoid of the prediction leaves of a ripple of 3.6 A
        assert!(worst(&errors, 0) < 0.02, "{keys}: {} A", worst(&errors, 0));
        assert!(worst(&errors, 1) < 0.02, "{keys}: {} V", worst(&errors, 1));
        // the other delay is another converter, and seen to be
        let mut other = controller(PERIOD, [INDUCTANCE, CAPACITANCE], &keys);
        let wrong = self::errors(&mut other, ideal(), 1 - delay);
        assert!(worst(&wrong, 0) > 0.1, "{keys}");
    }
}

#[test]
fn the_bias_stands_for_losses_that_the_model_does_not_know() {
    let lossy = || Converter {
        resistance: 0.3,
        ..ideal()
    };
    let settled = |gain: f64| {
        let keys = format!(
            "input_voltage = 48.0\ncompute_delay = 1\ncurrent = [-20.0, 40.0]\n\
             gains = {{ current = 0.5, voltage = 0.6, bias = {gain:?} }}"
        );
        let mut own = controller(PERIOD, [INDUCTANCE, CAPACITANCE], &keys);
        let errors = errors(&mut own, lossy(), 1);
        errors.iter().map(|error| error[0]).sum::<f64>() / errors.len() as f64
    };
    let (with, without) = (settled(0.1), settled(0.0));
    assert!(with.abs() < 0.05, "{with} A");
    assert!(without.abs() > 0.5, "{without} A: the losses have to go somewhere");
}

#[test]
fn a_current_that_is_clamped_to_0_is_that_of_a_diode() {
    // 100 ohm: 2 L/(R T) is 0.2, so the current stops in every period, and the gain is 2/(1 + sqrt(1 + 4 * 0.2/d^2)) = 0.2
    let light = |lowest: f64| {
        let mut converter = Converter {
            current: 0.0,
            voltage: 9.6,
            has_diode: true,
            ..ideal()
        };
        let keys = format!("input_voltage = 48.0\ncompute_delay = 0\n{GAINS}\ncurrent = [{lowest:?}, 40.0]");
        let mut own = controller(PERIOD, [INDUCTANCE, CAPACITANCE], &keys);
        let mut seen = 0.0;
        for _ in 0..400 {
            let load = converter.voltage / 100.0;
            let samples = [converter.voltage as f32, load as f32, V_IN].map(Physical);
            let trace = own.eval(&samples).unwrap();
            seen = trace.estimates[0][0];
            let command = Command {
                duty: 0.1,
                duty_sim: 0.1,
                ..trace.command
            };
            own.commit(&samples, &command).unwrap();
            converter.period(0.1, load);
        }
        assert!((converter.voltage - 9.6).abs() < 0.2, "{} V", converter.voltage);
        assert_eq!(converter.current, 0.0);
        seen
    };
    let (diode, both) = (light(0.0), light(-20.0));
    assert!((0.0..0.01).contains(&diode), "{diode} A");
    assert!(
        both < -0.05,
        "{both} A: without the clamp the model has a current that flows back"
    );
}

/// Numbers that binary64 holds: T/L = T/C = 1/8.
fn worked_out(keys: &str) -> Controller<f64> {
    controller(
        0.25,
        [2.0, 2.0],
        &format!(
            "input_voltage = 8.0\ncurrent = [0.0, 16.0]\ngains = {{ current = 0.5, voltage = 0.25, bias = 0.125 }}\n{keys}"
        ),
    )
}

fn at(controller: &mut Controller<f64>, memory: &[f64], samples: [f32; 3]) -> Trace<f64> {
    let mut state = controller.state().clone();
    state.memory = memory.to_vec();
    (state.primed, state.previous_command) = (1, 0.5);
    assert!(controller.restore(&state));
    controller.step(&samples.map(Physical)).unwrap()
}

#[test]
fn a_step_with_a_compute_delay_corrects_and_then_predicts() {
    let mut own = worked_out("compute_delay = 1");
    // e = 2 - 1 = 1: i = 0.5 + 0.5, v = 1 + 0.25, b = 0.375 + 0.125
    // m = 0.375; a = 8 m - 0.625 + 0.25 = 2.625; mean = 1 + 2.625/8; v' = 1.25 + (mean - 1)/8
    // s = 4 - (v + v')/2 + 0.5; i' = 1 + s/8
    let mean = 1.328125;
    let next = 1.25 + (mean - 1.0) / 8.0;
    let expected = [1.0 + (4.5 - (1.25 + next) / 2.0) / 8.0, next, 0.5];
    let trace = at(&mut own, &[0.5, 1.0, 0.375], [2.0, 1.0, 20.0]);
    assert_eq!(trace.estimates[0][..3], expected);
    assert_eq!(own.state().memory, expected, "the prediction is the memory");
    let names: Vec<_> = own.state_names().iter().skip(3).take(3).cloned().collect();
    assert_eq!(names, ["m.current", "m.voltage", "m.bias"]);
}

#[test]
fn a_step_without_one_predicts_from_what_was_measured_before_and_then_corrects() {
    let mut own = worked_out("compute_delay = 0");
    // the load before was 1: i' and v' as above from (1, 1.25, 0.5); e = v' + 1 - v' = 1
    let next = 1.25 + 0.328125 / 8.0;
    let predicted = [1.0 + (4.5 - (1.25 + next) / 2.0) / 8.0, next, 0.5];
    let trace = at(&mut own, &[1.0, 1.25, 0.5, 1.0], [(next + 1.0) as f32, 3.0, 20.0]);
    let expected = [predicted[0] + 0.5, next + 0.25, 0.625];
    assert_eq!(trace.estimates[0][..3], expected);
    let mut kept = expected.to_vec();
    kept.push(3.0);
    assert_eq!(own.state().memory, kept, "the load of this step waits for the next");
}

#[test]
fn a_held_sample_corrects_nothing() {
    let predicted = at(
        &mut worked_out("compute_delay = 1"),
        &[1.0, 1.25, 0.5],
        [1.25, 1.0, 20.0],
    );
    let held = at(
        &mut worked_out("compute_delay = 1"),
        &[1.0, 1.25, 0.5],
        [f32::NAN, 1.0, 20.0],
    );
    assert_eq!(
        held.estimates, predicted.estimates,
        "as if the measurement were what was expected"
    );
    let off = at(
        &mut worked_out("compute_delay = 1"),
        &[1.0, 1.25, 0.5],
        [1.5, 1.0, 20.0],
    );
    assert_ne!(off.estimates, predicted.estimates);
}

#[test]
fn an_observer_begins_at_the_load_current_and_the_measured_voltage() {
    for delay in [0, 1] {
        let mut own = worked_out(&format!("compute_delay = {delay}"));
        let trace = own.step(&[3.0, 2.0, 20.0].map(Physical)).unwrap();
        let start = [2.0, 3.0, 0.0];
        if delay == 0 {
            assert_eq!(trace.estimates[0][..3], start);
        } else {
            let rest = at(&mut worked_out("compute_delay = 1"), &start, [3.0, 2.0, 20.0]);
            assert_eq!(
                trace.estimates, rest.estimates,
                "the same from a memory with these numbers"
            );
        }
    }
}

#[test]
fn estimates_are_clamped_to_their_ranges() {
    let trace = at(
        &mut worked_out("compute_delay = 1"),
        &[16.0, 39.0, 6.0],
        [40.0, 0.0, 20.0],
    );
    assert_eq!(trace.estimates[0][1..3], [40.0, 6.0]);
    let trace = at(
        &mut worked_out("compute_delay = 1"),
        &[0.0, 39.0, -6.0],
        [0.0, 20.0, 20.0],
    );
    assert_eq!(trace.estimates[0][0], 0.0);
}
