//! Observers of every circuit and carrier (contract section 2b) against converters integrated in small steps, and against steps
//! worked out by hand.

#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests stand outside of #[test] functions

#[allow(dead_code)] // another file of tests has the rest
mod common;

use common::{Dense, PLAIN, load};
use interp::Sample::Physical;
use interp::{Command, Controller, Trace};
use policy::NumericFormat;

const PERIOD: f64 = 1e-5;
const INDUCTANCE: f64 = 100e-6;
const CAPACITANCE: f64 = 150e-6;
const V_IN: f64 = 24.0;

/// A controller whose observations are all estimates; `observer` are further keys of the observer.
fn controller(period: f64, [inductance, capacitance]: [f64; 2], observer: &str) -> Controller<f64> {
    let estimates = if observer.contains("hold") { 4 } else { 3 };
    let features: String = ["current", "voltage", "bias", "surplus"][..estimates]
        .iter()
        .map(|word| format!("[[feature]]\nname = \"{word}\"\nsource = \"m_{word}\"\n"))
        .collect();
    let contract = format!(
        "name = \"seen\"\nsample_period = {period:?}\n\
         [[signal]]\nname = \"v_out\"\nrange = [0.0, 80.0]\n[[signal]]\nname = \"i_out\"\nrange = [-1.0, 20.0]\n\
         [[observer]]\nname = \"m\"\ninductance = {inductance:?}\ncapacitance = {capacitance:?}\n\
         output_voltage = \"v_out\"\nload_current = \"i_out\"\nbias = [-6.0, 6.0]\n{observer}\n{features}\
         [network]\nweights = \"weights.safetensors\"\n[actions]\nduties = [0.25, 0.75]\n{PLAIN}"
    );
    let network = Dense {
        inputs: estimates,
        outputs: 2,
        weights: &vec![0.0; 2 * estimates],
        bias: &[0.0; 2],
    };
    Controller::new(&load(&contract, &[], &[network]).with_format(NumericFormat::F64))
}

/// A converter as its differential equations are, in steps of a thousandth of the period.
#[derive(Clone, Copy)]
struct Converter {
    topology: &'static str,
    carrier: &'static str,
    /// In series with the inductor, ohm.
    resistance: f64,
    current: f64,
    voltage: f64,
}

impl Converter {
    fn period(&mut self, duty: f64, load: f64) {
        const STEPS: u32 = 1000;
        let dt = PERIOD / f64::from(STEPS);
        for step in 0..STEPS {
            let at = (f64::from(step) + 0.5) / f64::from(STEPS);
            let is_on = match self.carrier {
                "trailing" => at < duty,
                _ => (at - 0.5).abs() < 0.5 * duty,
            };
            let (source, sink) = match (self.topology, is_on) {
                ("buck", true) => (V_IN, 1.0),
                ("boost", true) | ("buck-boost", true) => (V_IN, 0.0),
                ("boost", false) => (V_IN, 1.0),
                _ => (0.0, 1.0),
            };
            let across = source - sink * self.voltage - self.resistance * self.current;
            self.voltage += dt / CAPACITANCE * (sink * self.current - load);
            self.current += dt / INDUCTANCE * across;
        }
    }
}

/// Gains of a filter of about ten periods with the values above.
const KEYS: &str = "input_voltage = 24.0\ncurrent = [-20.0, 60.0]\n\
                    gains = { current = 0.3, voltage = 0.3, bias = 0.1 }";

/// Duties about which the circuits are driven, and the voltage there.
const CIRCUITS: [(&str, f64, f64); 3] = [("buck", 0.5, 12.0), ("boost", 0.4, 40.0), ("buck-boost", 0.45, 19.6)];

fn each() -> impl Iterator<Item = (Converter, f64)> {
    CIRCUITS.into_iter().flat_map(|(topology, duty, voltage)| {
        ["trailing", "centre"].map(|carrier| {
            let converter = Converter {
                topology,
                carrier,
                resistance: 0.0,
                current: 4.0,
                voltage,
            };
            (converter, duty)
        })
    })
}

/// Estimates, and the truth of the instant that they are of.
struct Seen {
    estimates: [f64; 4],
    truth: [f64; 2],
    load: f64,
}

/// Drives both with a duty that jumps about `rest` by `by`, from where everything has settled on.
fn drive(keys: &str, mut converter: Converter, delay: usize, rest: f64, by: f64) -> Vec<Seen> {
    let keys = format!("{keys}\ncompute_delay = {delay}");
    let mut own = controller(PERIOD, [INDUCTANCE, CAPACITANCE], &keys);
    let resistance = converter.voltage / 4.0;
    let mut seen = Vec::new();
    let mut commanded = vec![rest; delay];
    for step in 0..1500 {
        // a resistor, as it is at the start of the period: a current would leave the converter without damping
        let load = converter.voltage / resistance * if by > 0.0 && (step / 70) % 2 == 0 { 1.3 } else { 1.0 };
        let duty = rest + if (step / 50) % 2 == 0 { 0.0 } else { by };
        let samples = [converter.voltage as f32, load as f32].map(Physical);
        let trace = own.eval(&samples).unwrap();
        let before = [converter.current, converter.voltage];
        let command = Command {
            duty,
            duty_sim: duty,
            ..trace.command
        };
        let estimates = trace.estimates[0];
        own.commit(&samples, &command).unwrap();
        commanded.push(duty);
        converter.period(commanded[step], load);
        // with a delay the estimates are those of the next instant
        let truth = match delay {
            1 => [converter.current, converter.voltage],
            _ => before,
        };
        seen.push(Seen { estimates, truth, load });
    }
    seen.split_off(500)
}

fn worst(seen: &[Seen], which: usize) -> f64 {
    let errors = seen.iter().map(|one| (one.estimates[which] - one.truth[which]).abs());
    errors.fold(0.0, f64::max)
}

fn keys(topology: &str, carrier: &str) -> String {
    format!("topology = \"{topology}\"\ncarrier = \"{carrier}\"\n{KEYS}")
}

#[test]
fn estimates_follow_every_circuit_with_either_carrier_at_either_delay() {
    for (converter, rest) in each() {
        let Converter { topology, carrier, .. } = converter;
        for delay in [0, 1] {
            let seen = drive(&keys(topology, carrier), converter, delay, rest, 0.02);
            let (amperes, volts) = (worst(&seen, 0), worst(&seen, 1));
            // the trapezoid of the prediction leaves some hundredths of a ripple of 1 A and of one of 0.1 to 0.3 V
            assert!(
                amperes < 0.1 && volts < 0.03,
                "{topology} {carrier} {delay}: {amperes} A, {volts} V"
            );
        }
    }
}

#[test]
fn another_carrier_and_another_circuit_are_seen_to_be_others() {
    for (converter, rest) in each() {
        let Converter { topology, carrier, .. } = converter;
        let right = drive(&keys(topology, carrier), converter, 1, rest, 0.02);
        let other = if carrier == "centre" { "trailing" } else { "centre" };
        let wrong = drive(&keys(topology, other), converter, 1, rest, 0.02);
        // half a ripple of 1 A
        assert!(worst(&wrong, 0) > worst(&right, 0) + 0.2, "{topology} {carrier}");
        for (circuit, ..) in CIRCUITS.iter().filter(|(circuit, ..)| *circuit != topology) {
            let wrong = drive(&keys(circuit, carrier), converter, 1, rest, 0.02);
            assert!(worst(&wrong, 0) > 1.0, "{circuit} for {topology}");
        }
    }
}

#[test]
fn the_surplus_of_a_settled_converter_is_none_whatever_it_loses() {
    for (converter, rest) in each().filter(|(converter, _)| converter.topology != "buck") {
        let Converter { topology, carrier, .. } = converter;
        let lossy = Converter {
            resistance: 0.2,
            ..converter
        };
        // where it settles is what it holds
        let settled = drive(&keys(topology, carrier), lossy, 1, rest, 0.0);
        let voltage = settled.last().unwrap().truth[1];
        let held = |volts: f64| {
            let keys = format!("{}\nhold = {volts:?}", keys(topology, carrier));
            drive(&keys, lossy, 1, rest, 0.0).pop().unwrap()
        };
        let last = held(voltage);
        let [current, .., surplus] = last.estimates;
        // of a load of about 4 A; the voltage falls while the output receives nothing, which the mean duty does not know
        assert!(
            surplus.abs() < 0.03,
            "{topology} {carrier}: {surplus} A of {} A",
            last.load
        );
        // without the bias the losses would be missing: 0.2 ohm times the current is 5 % of the source
        let span = if topology == "boost" { voltage } else { V_IN + voltage };
        let half_ripple = if carrier == "centre" {
            0.0
        } else {
            0.5 * V_IN * rest * PERIOD / INDUCTANCE
        };
        let blind = V_IN / span * (current + half_ripple) - last.load;
        assert!(blind > 0.1, "{topology} {carrier}: {blind} A");
        // 5 % more of the current for the output of the buck-boost, 11 % more for that of the boost
        assert!(held(0.9 * voltage).estimates[3] > 0.1, "a smaller voltage needs less");
    }
}

/// Numbers that binary64 holds: T/L = T/C = 1/8, and a memory whose voltage is the measured one, so that nothing is corrected.
fn worked_out(keys: &str, [i, v, b]: [f64; 3], load: f32) -> (Trace<f64>, Vec<f64>) {
    let keys = format!(
        "input_voltage = 8.0\ncompute_delay = 1\ncurrent = [0.0, 16.0]\ngains = {{ current = 0.5, voltage = 0.25, bias = 0.125 }}\n{keys}"
    );
    let mut own = controller(0.25, [2.0, 2.0], &keys);
    let mut state = own.state().clone();
    state.memory = vec![i, v, b];
    (state.primed, state.previous_command) = (1, 0.5);
    assert!(own.restore(&state));
    let trace = own.step(&[v as f32, load].map(Physical)).unwrap();
    (trace, own.state().memory.clone())
}

#[test]
fn a_step_of_a_boost_whose_switch_is_on_first() {
    // r = 0.5; w(4) = 8 - 2 + 0.5; a = 6.5/2 + 8 * 0.5/2; the output receives half of the mean
    let mean = 1.0 + 5.25 / 8.0;
    let next = 4.0 + (0.5 * mean - 1.0) / 8.0;
    let end = 1.0 + (8.0 - 0.5 * ((4.0 + next) * 0.5) + 0.5) / 8.0;
    // q = 8.5/16, and half of the ripple is added
    let share = 8.5 / 16.0;
    let surplus = share * (end + 8.0 * (1.0 - share) * 0.5 / 8.0) - 1.0;
    let (trace, memory) = worked_out("topology = \"boost\"\nhold = 16.0", [1.0, 4.0, 0.5], 1.0);
    assert_eq!(trace.estimates[0], [end, next, 0.5, surplus]);
    assert_eq!(memory, [end, next, 0.5], "the surplus is no state");
}

#[test]
fn a_step_of_a_buck_boost_whose_switch_is_on_in_the_middle() {
    // r = 0.5; w(4) = 4 - 2 + 0.5
    let mean = 1.0 + 1.25 / 8.0;
    let next = 4.0 + (0.5 * mean - 1.0) / 8.0;
    let end = 1.0 + (4.0 - 0.5 * ((4.0 + next) * 0.5) + 0.5) / 8.0;
    // k = 1/(8 + 8)
    let surplus = 8.5 / 16.0 * end - 1.0;
    let keys = "topology = \"buck-boost\"\ncarrier = \"centre\"\nhold = 8.0";
    let (trace, _) = worked_out(keys, [1.0, 4.0, 0.5], 1.0);
    assert_eq!(trace.estimates[0], [end, next, 0.5, surplus]);
}

#[test]
fn a_step_of_a_buck_whose_switch_is_on_in_the_middle_and_has_no_surplus() {
    // m = 0.25
    let mean = 1.0 + (8.0 * 0.25 - 2.0 + 0.25) / 8.0;
    let next = 4.0 + (mean - 1.0) / 8.0;
    let end = 1.0 + (4.0 - (4.0 + next) / 2.0 + 0.5) / 8.0;
    let (trace, _) = worked_out("carrier = \"centre\"", [1.0, 4.0, 0.5], 1.0);
    assert_eq!(trace.estimates[0], [end, next, 0.5, 0.0]);
}

#[test]
fn a_model_with_a_voltage_to_hold_begins_at_the_current_that_holds_it() {
    for (keys, current) in [
        ("topology = \"boost\"\nhold = 16.0", 2.0),
        ("topology = \"buck-boost\"\nhold = 16.0", 3.0),
        ("topology = \"buck-boost\"", 1.0),
    ] {
        let keys = format!(
            "input_voltage = 8.0\ncompute_delay = 0\ncurrent = [0.0, 16.0]\n\
             gains = {{ current = 0.5, voltage = 0.25, bias = 0.125 }}\n{keys}"
        );
        let mut own = controller(0.25, [2.0, 2.0], &keys);
        let trace = own.step(&[16.0, 1.0].map(Physical)).unwrap();
        assert_eq!(trace.estimates[0][..3], [current, 16.0, 0.0], "{keys}");
    }
}

#[test]
fn a_surplus_stays_in_its_range() {
    // the current of 0 to 16 A less a load of -1 to 20 A
    let (trace, _) = worked_out("topology = \"boost\"\nhold = 1.0", [16.0, 4.0, 6.0], -1.0);
    assert_eq!(trace.estimates[0][3], 17.0);
    let (trace, _) = worked_out("topology = \"boost\"\nhold = 16.0", [0.0, 64.0, -6.0], 20.0);
    assert!(
        (-20.0..-19.0).contains(&trace.estimates[0][3]),
        "{:?}",
        trace.estimates[0]
    );
}
