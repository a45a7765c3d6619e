//! Classical controllers on the paper's plants, against figures found with another simulation.

#![allow(clippy::unwrap_used)] // helpers of tests stand outside of #[test] functions

use closed_loop::baselines::{Baseline, Kind};
use closed_loop::scenario::{Finding, Task, survey_all};
use closed_loop::{Classical, Converter, LoadKind, LoadStep, Trajectory, follow};
use plant::{Carrier, Parameters, Sample};

fn task() -> Task {
    Task {
        load_steps: vec![[200.0, 1000.0], [1000.0, 200.0]],
        ..Task::default()
    }
}

fn findings(kind: Kind, parameters: &Parameters) -> Vec<Finding> {
    let task = task();
    let mut baseline = Baseline::new(kind, parameters, 100.0, 10.0).unwrap();
    let controller = move |sample: &Sample| baseline.step(sample);
    let environment = Converter::new(parameters).unwrap();
    survey_all(&environment, &controller, 100.0, &task, &task.all_instants()).unwrap()
}

/// Every instant from a fresh start.
fn examine(kind: Kind, parameters: &Parameters, step: LoadStep) -> (Finding, Vec<Trajectory>) {
    let environment = Converter::new(parameters).unwrap();
    let mut controller = Classical::from(Baseline::new(kind, parameters, 100.0, 10.0).unwrap());
    let (task, mut finding) = (task(), Finding::new(step));
    let run = |instant| {
        let trajectory = follow(&environment, &mut controller, 100.0, &task, step, instant).unwrap();
        finding.add(instant, trajectory.metrics);
        trajectory
    };
    let trajectories = task.all_instants().into_iter().map(run).collect();
    (finding, trajectories)
}

/// Without and with delay: deviation of the step up and down, V.
type Deviations = [[f64; 2]; 2];

/// Deviation of the step up and down (V) at 1.5 mF and at 150 uF that others have found for the same kind of controller: without delay at the sampling instant,
/// and with a period of delay at the worst one.
const KNOWN: [(Kind, Deviations, Deviations); 4] = [
    (Kind::Pid, [[1.12, 0.83], [1.72, 1.43]], [[11.9, 8.2], [18.7, 14.3]]),
    (Kind::Cascade, [[1.34, 1.20], [2.00, 1.81]], [[11.9, 8.2], [22.3, 17.5]]),
    (
        Kind::FeedForward,
        [[0.58, 0.30], [1.65, 1.34]],
        [[6.1, 3.0], [17.7, 12.9]],
    ),
    (Kind::Deadbeat, [[0.58, 0.30], [1.63, 1.35]], [[6.1, 3.0], [17.5, 12.9]]),
];

#[test]
fn classical_controllers_do_as_well_as_others_have_found() {
    for (kind, model, table) in KNOWN {
        for (nominal, known) in [(Parameters::paper_model(), model), (Parameters::paper_table(), table)] {
            for (delay, known) in known.iter().enumerate() {
                let mut parameters = nominal.clone();
                parameters.pwm.duty_delay = delay as u32;
                for (finding, known) in findings(kind, &parameters).iter().zip(known) {
                    let metrics = if delay == 0 { &finding.at_sample } else { &finding.worst };
                    assert!(
                        metrics.deviation < 1.05 * known,
                        "{kind}, delay {delay}: {finding:?}, known {known}"
                    );
                    assert!(finding.worst.settling < 6e-3, "{kind}, delay {delay}: {finding:?}");
                    assert!(finding.worst.tail_max < 0.06, "{kind}, delay {delay}: {finding:?}");
                }
            }
        }
    }
}

#[test]
fn losses_that_the_designs_do_not_know_leave_no_error_behind() {
    let mut lossy = Parameters::paper_model();
    lossy.switch.r_ds_on = 0.1;
    lossy.switch.v_f = 0.8;
    lossy.inductor.dcr = 0.1;
    for kind in Kind::ALL {
        for finding in findings(kind, &lossy) {
            assert!(finding.worst.tail_mean < 0.05, "{kind}: {finding:?}");
        }
    }
}

#[test]
fn resistors_and_current_sinks_are_load_steps_too() {
    let parameters = Parameters::paper_model();
    let steps = [
        (LoadKind::Current, [2.0, 10.0]),
        (LoadKind::Resistance, [50.0, 10.0]),
        (LoadKind::Power, [200.0, 1000.0]),
    ];
    let deviations = steps.map(|(kind, values)| {
        let (finding, trajectories) = examine(Kind::Deadbeat, &parameters, LoadStep { kind, ..values.into() });
        let load = trajectories[0].periods.last().unwrap().record.load;
        assert!((kind.value(&load) - values[1]).abs() < 1e-9 * values[1]);
        assert!(finding.worst.tail_max < 0.01, "{finding:?}");
        finding.worst.deviation
    });
    // the same current at 100 V, which falls, stays or grows where the voltage dips
    assert!(
        deviations[1] < deviations[0] && deviations[0] < deviations[2],
        "{deviations:?}"
    );
}

#[test]
fn runs_from_the_start_find_what_the_survey_finds() {
    let mut parameters = Parameters::paper_model();
    parameters.sensors.v_out.noise = 0.05;
    let (finding, _) = examine(Kind::Cascade, &parameters, LoadStep::from([200.0, 1000.0]));
    assert_eq!(finding, findings(Kind::Cascade, &parameters)[0]);
}

/// A sample inside of the period is acted on at the next start, so it costs less than a whole period of delay.
#[test]
fn sampled_inside_of_the_period_they_do_no_worse_than_a_period_late() {
    for (kind, _, late) in KNOWN {
        for phase in [0.2, 0.5, 0.8] {
            for carrier in [Carrier::Trailing, Carrier::Centre] {
                let mut parameters = Parameters::paper_model();
                (parameters.pwm.sampling_phase, parameters.pwm.carrier) = (phase, carrier);
                for (finding, known) in findings(kind, &parameters).iter().zip(late[1]) {
                    let what = format!("{kind}, {carrier:?} sampled at {phase}: {finding:?}");
                    assert!(finding.worst.deviation < 1.05 * known, "{what}, known {known}");
                    assert!(finding.worst.settling < 6e-3, "{what}");
                    assert!(finding.worst.tail_max < 0.06, "{what}");
                }
            }
        }
    }
}
