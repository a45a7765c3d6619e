//! What a controller does at rest: figures against closed forms, and where they are shown.

#![allow(clippy::unwrap_used)] // helpers of tests stand outside of #[test] functions

use std::path::{Path, PathBuf};

use closed_loop::baselines::{Baseline, Kind};
use closed_loop::chatter::Chatter;
use closed_loop::scenario::{Instant, Task, load_step};
use closed_loop::simulation::{Findings, PAGE, Setting, simulate};
use closed_loop::{Answer, Controller, Converter, Error, LoadKind, LoadStep, Named, Scenario};
use plant::{Parameters, Sample, Signals};

/// At rest on a resistor, long after its only step.
fn at_rest(parameters: &Parameters, controller: impl FnMut(&Sample) -> f64) -> Chatter {
    let task = Task {
        lead: 1,
        // the circuit rings on 5 ohm with a time constant of 150 periods
        after: 4000,
        ..Task::default()
    };
    let step = LoadStep {
        kind: LoadKind::Resistance,
        values: [5.0, 5.0],
        source: None,
        reference: None,
    };
    let first = Instant { periods: 0, phase: 0.0 };
    let environment = Converter::new(parameters).unwrap();
    let (metrics, _) = load_step(environment, controller, 100.0, &task, step, first).unwrap();
    metrics.chatter
}

/// A duty of `rest` plus and minus `swing`, in turn.
fn alternating(rest: f64, swing: f64) -> impl FnMut(&Sample) -> f64 {
    let mut sign = 1.0;
    move |_| {
        sign = -sign;
        rest + sign * swing
    }
}

/// In a period the current rises by `v_in (d - d_rest) T/L` more than it falls, so its samples swing by `v_in swing T/L`, and the
/// ripple is `v_in d (1 - d) T/L`. A boost's switch node swings by `v_out`, its ripple is `v_in d T/L`.
#[test]
fn a_duty_that_alternates_shows_in_all_three_figures() {
    let buck = Parameters::paper_model();
    let mut boost = Parameters::ideal(50.0, 2e-3, 1.5e-3, 10e3);
    boost.converter.topology = plant::Topology::Boost;
    for (plant, swing_in_ripples) in [(&buck, 0.02 / (0.5 * 0.5)), (&boost, 100.0 * 0.02 / (50.0 * 0.5))] {
        let found = at_rest(plant, alternating(0.5, 0.02));
        assert!((found.duty_activity - 0.04).abs() < 1e-9, "{found:?}");
        assert!(
            (found.subharmonic - 0.02).abs() < 1e-9 && found.subharmonic_periods == 2,
            "{found:?}"
        );
        // voltage and share of the output swing along a little
        let off = found.current_swing / swing_in_ripples - 1.0;
        assert!(off.abs() < 0.03, "{found:?}, {swing_in_ripples}");
    }
}

#[test]
fn a_pid_controller_at_rest_does_nothing() {
    let plant = Parameters::paper_model();
    let mut pid = Baseline::new(Kind::Pid, &plant, 100.0, 20.0).unwrap();
    let found = at_rest(&plant, |sample| pid.step(sample));
    assert!(
        found.duty_activity < 1e-6 && found.current_swing < 1e-4 && found.subharmonic < 1e-6,
        "{found:?}"
    );
}

struct Alternating(bool);

impl Controller for Alternating {
    fn restart(&mut self) -> Result<(), Error> {
        self.0 = false;
        Ok(())
    }

    fn step(&mut self, _: &Signals) -> Result<Answer, Error> {
        self.0 = !self.0;
        Ok(Answer {
            duty: if self.0 { 0.6 } else { 0.4 },
            action: None,
            status: 0,
        })
    }
}

fn simulated() -> Findings {
    let examples: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    let file = examples.join("s.toml");
    let text = "plant = \"plants/paper-model.toml\"\nresistance_steps = [[50, 40]]\nbaselines = [\"pid\"]\nlimit = false\n\
                instants = 2\nsampling_instants = 2\nlead = 100\nafter = 200\n";
    let scenario = Scenario::from_toml(&file, text).unwrap();
    let policy = policy::load(&examples.join("buck12/policy.toml")).unwrap();
    let setting = Setting::new(&file, scenario, policy, None).unwrap();
    let alternating = Named {
        name: "alternating".to_owned(),
        controller: Box::new(Alternating(false)),
    };
    simulate(setting, vec![alternating], &mut |_| Ok(())).unwrap()
}

#[test]
fn the_figures_stand_in_summary_table_page_and_json_of_each_controller() {
    let found = simulated();
    let files = found.files().unwrap();
    let summary = &files["summary.txt"];
    let row = |name: &str| {
        let rows = summary.lines().skip_while(|line| !line.starts_with("at rest after it"));
        rows.into_iter().find(|line| line.starts_with(name)).unwrap().to_owned()
    };
    assert!(
        row("policy").contains("0.2000 / 0.2000") && row("policy").contains("0.1000 at f/2"),
        "{summary}"
    );
    assert!(
        row("pid").contains("0.0000 / 0.0000") && row("pid").contains("none"),
        "{summary}"
    );
    assert!(files[PAGE].contains("0.1000 at f/2"));
    let json: serde_json::Value = serde_json::from_str(&files["metrics.json"]).unwrap();
    let worst = &json["load_steps"][0]["controllers"]["policy"]["worst"];
    let near = |key: &str, value: f64| (worst[key].as_f64().unwrap() - value).abs() < 1e-9;
    assert!(near("duty_activity", 0.2) && near("subharmonic", 0.1), "{worst}");
    assert_eq!(worst["subharmonic_periods"], 2);
    let csv = &files["metrics.csv"];
    let columns = |line: &str| line.split(',').count();
    assert!(
        csv.lines()
            .all(|line| columns(line) == columns(csv.lines().next().unwrap()))
    );
    assert!(csv.starts_with("controller,") && csv.lines().next().unwrap().contains("duty_activity,current_swing"));
}
