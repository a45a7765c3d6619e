//! Steps of the voltage to hold: how a scenario writes them, and that a policy which is told holds the new one.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;

use closed_loop::scenario::{Instant, Task};
use closed_loop::{Answer, Controller, Converter, Error, LoadKind, LoadStep, Scenario, follow};
use plant::{Parameters, Signals};

fn read(text: &str) -> Result<Vec<LoadStep>, String> {
    let scenario = Scenario::from_toml(Path::new("s.toml"), text);
    scenario
        .map(|read| read.load_steps)
        .map_err(|faults| faults.to_string())
}

#[test]
fn a_reference_steps_at_the_load_that_is_given_or_that_of_the_first_load_step() {
    let steps = read("reference_steps = [[10, 12.5]]\nreference_load = { current = 3 }\n").unwrap();
    assert_eq!(steps, [LoadStep::of_reference([10.0, 12.5], LoadKind::Current, 3.0)]);
    assert_eq!(
        (steps[0].to_string(), steps[0].stem()),
        ("v_ref 10 -> 12.5 V".into(), "v_ref-10-12.5V".into())
    );
    let steps = read("load_steps = [[20, 50]]\nsource_steps = [[40, 50]]\nreference_steps = [[10, 12]]\n").unwrap();
    let shown: Vec<String> = steps.iter().map(ToString::to_string).collect();
    assert_eq!(shown, ["20 -> 50 W", "v_in 40 -> 50 V", "v_ref 10 -> 12 V"]);
    assert_eq!(steps[2].values, [20.0; 2]);
    for (text, words) in [
        (
            "reference_steps = [[10, 12]]\n",
            "steps of the reference without a load",
        ),
        (
            "load_steps = [[1, 2]]\nreference_load = { power = 1 }\n",
            "no such steps",
        ),
        (
            "reference_steps = [[0, 12]]\nreference_load = { power = 1 }\n",
            "s.toml:1:",
        ),
    ] {
        let said = read(text).unwrap_err();
        assert!(said.contains(words), "{text}: {said}");
    }
}

/// Commands the share of the source that it is told, and writes down when.
struct Share {
    told: Vec<(usize, f64)>,
    steps: usize,
    v_ref: f64,
}

impl Controller for Share {
    fn restart(&mut self) -> Result<(), Error> {
        Ok(())
    }

    fn set_reference(&mut self, v_ref: f64) {
        self.told.push((self.steps, v_ref));
        self.v_ref = v_ref;
    }

    fn step(&mut self, measured: &Signals) -> Result<Answer, Error> {
        self.steps += 1;
        Ok(Answer {
            duty: self.v_ref / measured.v_in,
            action: None,
            status: 0,
        })
    }
}

/// A buck without losses rests at `d v_in`. Its damped swing overshoots, which is the deviation; the way there is none.
#[test]
fn a_controller_is_told_at_the_step_and_errors_are_those_from_the_new_reference() {
    let environment = Converter::new(&Parameters::paper_model()).unwrap();
    let task = Task {
        lead: 4000,
        after: 4000,
        ..Task::default()
    };
    let mut share = Share {
        told: Vec::new(),
        steps: 0,
        v_ref: 0.0,
    };
    let step = LoadStep::of_reference([90.0, 110.0], LoadKind::Resistance, 1.0);
    let instant = Instant { periods: 2, phase: 0.3 };
    let trajectory = follow(&environment, &mut share, 100.0, &task, step, instant).unwrap();
    assert_eq!(share.told, [(0, 90.0), (4002, 110.0)]);
    let first = &trajectory.periods[4002];
    assert_eq!(
        first.record.time, 0.0,
        "the sample at the step is the first that finds it"
    );
    assert!((first.record.duty - 0.55).abs() < 1e-12 && (trajectory.periods[4001].record.duty - 0.45).abs() < 1e-12);
    let metrics = trajectory.metrics;
    assert!(metrics.pre_error < 0.1 && metrics.tail_max < 0.1, "{metrics:?}");
    // 2 mH, 1.5 mF and 1 ohm: zeta = sqrt(L/C)/(2 R) = 0.577, an overshoot of exp(-pi zeta/sqrt(1 - zeta^2)) = 10.8 % of 20 V
    assert!((metrics.deviation - 2.17).abs() < 0.1, "{metrics:?}");
    assert!(metrics.settling > 1e-3 && metrics.settling < 50e-3, "{metrics:?}");
}

/// The step of a load leaps over a capacitor's series resistance within no time. The sample at that instant shows it, and is none before the step.
#[test]
fn the_sample_at_which_the_load_steps_is_not_before_it() {
    let mut plant = Parameters::paper_model();
    plant.capacitor.esr = 0.05;
    let environment = Converter::new(&plant).unwrap();
    let mut share = Share {
        told: Vec::new(),
        steps: 0,
        v_ref: 0.0,
    };
    let step = read("resistance_steps = [[50, 10]]\n").unwrap()[0];
    // until the start has died away
    let task = Task {
        lead: 4000,
        ..Task::default()
    };
    for phase in [0.0, 0.4] {
        let instant = Instant { periods: 0, phase };
        let trajectory = follow(&environment, &mut share, 100.0, &task, step, instant).unwrap();
        // 8 A over 50 mohm are .4 V
        assert!(trajectory.metrics.pre_error < 0.1, "{phase}: {:?}", trajectory.metrics);
    }
}
