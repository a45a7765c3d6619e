//! Steps of the source: what is read of them, and what the converter does, against closed forms.

#![allow(clippy::unwrap_used)] // helpers of tests stand outside of #[test] functions

use std::path::Path;

use closed_loop::scenario::{Instant, Task, load_step, survey};
use closed_loop::{Converter, LoadKind, LoadStep, Scenario};
use plant::Parameters;

fn read(text: &str) -> Result<Scenario, String> {
    Scenario::from_toml(Path::new("s.toml"), text).map_err(|faults| faults.to_string())
}

#[test]
fn a_source_steps_at_the_load_that_is_given_or_that_of_the_first_load_step() {
    let shown = |text: &str| -> Vec<String> {
        let scenario = read(text).unwrap();
        assert!(!scenario.default_steps);
        scenario.load_steps.iter().map(LoadStep::to_string).collect()
    };
    assert_eq!(
        shown("source_steps = [[180, 220], [220, 180]]\nsource_load = { current = 3 }\n"),
        ["v_in 180 -> 220 V", "v_in 220 -> 180 V"],
        "no loads unless asked for"
    );
    let steps = read("source_steps = [[180, 220]]\nsource_load = { resistance = 3 }\n")
        .unwrap()
        .load_steps;
    assert_eq!(steps, [LoadStep::of_source([180.0, 220.0], LoadKind::Resistance, 3.0)]);
    assert_eq!(
        shown("load_steps = [[200, 500]]\nsource_steps = [[180, 220]]\n"),
        ["200 -> 500 W", "v_in 180 -> 220 V"]
    );
    let stem = read("source_steps = [[180, 220.5]]\nsource_load = { power = 1 }\n")
        .unwrap()
        .load_steps[0]
        .stem();
    assert_eq!(stem, "v_in-180-220.5V");
}

#[test]
fn what_no_source_can_do_is_refused_at_its_place() {
    for (text, words) in [
        (
            "source_steps = [[180, 220]]\n",
            ["without a load", "source_load = { power = 500.0 }"],
        ),
        (
            "source_load = { power = 5 }\n",
            ["no such steps", "source_steps = [[180, 220]]"],
        ),
        (
            "source_steps = [[0, 220]]\nsource_load = { power = 5 }\n",
            ["s.toml:1:", "0.001"],
        ),
        (
            "source_steps = [[1, 2]]\nsource_load = { power = 5, current = 1 }\n",
            ["s.toml:2:", "`resistance`"],
        ),
        ("source_steps = [[1, 2]]\nsource_load = {}\n", ["s.toml:2:", "`power`"]),
        (
            "source_steps = [[1, 2]]\nsource_load = { watts = 5 }\n",
            ["s.toml:2:", "watts"],
        ),
    ] {
        let said = read(text).unwrap_err();
        assert!(words.iter().all(|word| said.contains(word)), "{text}: {said}");
    }
}

/// A buck without losses rests at `d v_in`, whatever the resistor; a fixed duty shows both voltages, and the sample at the step
/// still shows the old source.
#[test]
fn a_fixed_duty_goes_from_one_share_of_the_source_to_the_other() {
    let environment = Converter::new(&Parameters::paper_model()).unwrap();
    let task = Task {
        lead: 4000,
        after: 4000,
        ..Task::default()
    };
    let step = LoadStep::of_source([180.0, 220.0], LoadKind::Resistance, 5.0);
    let instant = Instant { periods: 0, phase: 0.3 };
    let (_, records) = load_step(environment.clone(), |_| 0.5, 90.0, &task, step, instant).unwrap();
    let at = |time: f64| records.iter().find(|record| record.time >= time - 1e-9).unwrap();
    let mean = |records: &[closed_loop::scenario::Record]| {
        records.iter().map(|record| record.sample.v_out).sum::<f64>() / records.len() as f64
    };
    let (before, after) = records.split_at(4000);
    // the ripple of the paper's filter at the sampling instant is 0.02 V
    assert!((mean(&before[3900..]) - 90.0).abs() < 0.1, "{}", mean(&before[3900..]));
    assert!((mean(&after[3900..]) - 110.0).abs() < 0.1, "{}", mean(&after[3900..]));
    let (first, second) = (at(0.0), at(1e-4));
    assert_eq!(
        (first.time, first.sample.v_in),
        (0.0, 180.0),
        "the period of the step begins with it"
    );
    assert_eq!(second.sample.v_in, 220.0);
    // L di/dt = v_in - v_out while the switch is on: 40 V more over 50 us and 2 mH
    let rise = second.sample.i_l - first.sample.i_l;
    assert!((rise - 40.0 * 50e-6 / 2e-3).abs() < 0.03, "{rise}");
    let finding = survey(
        &environment,
        &|_: &plant::Sample| 0.5,
        90.0,
        &Task {
            lead: 4000,
            instants: 2,
            ..task
        },
        step,
        &[instant],
    );
    // the damped swing overshoots its 20 V
    let deviation = finding.unwrap().worst.deviation;
    assert!((20.0..40.0).contains(&deviation), "{deviation}");
}
