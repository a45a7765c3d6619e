//! Limits and classical controllers of converters whose output answers the wrong way at first.

#![allow(clippy::unwrap_used)] // helpers of tests stand outside of #[test] functions

use closed_loop::baselines::{Baseline, Kind};
use closed_loop::limit::{Question, averaged};
use closed_loop::scenario::{Finding, Task, survey};
use closed_loop::{Converter, LoadStep};
use plant::{Load, Parameters, Plant, Rectifier, Sample, Topology};

const STEPS: [[f64; 2]; 2] = [[20.0, 120.0], [120.0, 20.0]];

/// 24 V to 48 V, and 12 V to 24 V the other way up.
fn boost() -> (Parameters, f64) {
    let mut p = Parameters::ideal(24.0, 68e-6, 100e-6, 100e3);
    p.converter.topology = Topology::Boost;
    p.converter.rectifier = Rectifier::Synchronous;
    (p, 48.0)
}

fn buck_boost() -> (Parameters, f64) {
    let mut p = Parameters::ideal(12.0, 22e-6, 220e-6, 200e3);
    p.converter.topology = Topology::BuckBoost;
    p.converter.rectifier = Rectifier::Synchronous;
    (p, 24.0)
}

fn question(p: &Parameters, v_ref: f64, step: [f64; 2]) -> Question {
    Question::new(p, v_ref, step.into(), [0.0, 1.0]).unwrap()
}

fn found(kind: Kind, design: &Parameters, plant: &Parameters, v_ref: f64, step: [f64; 2]) -> Finding {
    let mut baseline = Baseline::new(kind, design, v_ref, 120.0 / v_ref).unwrap();
    let controller = move |sample: &Sample| baseline.step(sample);
    let (environment, task) = (Converter::new(plant).unwrap(), Task::default());
    survey(&environment, &controller, v_ref, &task, step, &task.all_instants()).unwrap()
}

/// With the main switch on, the current rises by `v_in/L` and the capacitor alone feeds the load, until the current is that
/// which holds the voltage: a boost's `P/v_in`, a buck-boost's `P (1/v_in + 1/v)`. With it off, the current falls by
/// `(v - v_in)/L` or `v/L`, all of it into the output, from the one to the other.
#[test]
fn the_averaged_limit_is_the_charge_while_the_current_is_on_its_way() {
    for (mut p, v_ref) in [boost(), buck_boost()] {
        // so large that the voltage hardly moves on the way
        p.converter.capacitance *= 20.0;
        let (v_in, l, c) = (p.converter.v_in, p.converter.inductance, p.converter.capacitance);
        let boost = p.converter.topology == Topology::Boost;
        let falling = if boost { v_ref - v_in } else { v_ref };
        let current = |power: f64| match boost {
            true => power / v_in,
            false => power * (1.0 / v_in + 1.0 / v_ref),
        };
        for [from, to] in STEPS {
            let (i_0, i_1, i_out) = (current(from), current(to), to / v_ref);
            let expected = if to > from {
                i_out * l * (i_1 - i_0) / v_in / c
            } else {
                (0.5 * (i_0 + i_1) - i_out) * l * (i_0 - i_1) / falling / c
            };
            let found = averaged(&p, v_ref, [from, to].into(), [0.0, 1.0]).unwrap();
            assert!(
                (found / expected - 1.0).abs() < 0.01,
                "{from} {to}: {found}, {expected}"
            );
        }
    }
}

/// All sequences of these duties over so many periods, from rest under the load before; the least of their largest errors. A
/// sequence counts if it ends with the current that holds its voltage: others have the worst before them.
fn least_of_all(p: &Parameters, v_ref: f64, [from, to]: [f64; 2], duties: &[f64], periods: u32) -> f64 {
    let mut plant = Plant::new(p).unwrap();
    plant.settle(v_ref, &Load::power(from));
    let up = to > from;
    let holding = |v: f64| {
        to / v
            / p.converter
                .topology
                .give(p.converter.topology.duty(p.converter.v_in, v))
    };
    // the current at the sampling instant is at its valley
    let half_ripple = 0.5 * p.ideal_ripple(v_ref);
    let mut stack = vec![(plant, 0, 0.0_f64)];
    let mut least = f64::INFINITY;
    while let Some((plant, depth, worst)) = stack.pop() {
        for duty in duties {
            let mut next = plant.clone();
            let sample = next.step(*duty, &Load::power(to));
            let worst = worst.max((sample.v_out - v_ref).abs());
            let surplus = sample.i_l + half_ripple - holding(sample.v_out);
            if worst >= least {
                continue;
            }
            if (surplus > 0.0) == up {
                least = worst;
            } else if depth + 1 < periods {
                stack.push((next, depth + 1, worst));
            }
        }
    }
    least
}

#[test]
fn no_sequence_of_duties_deviates_less_than_the_limit_and_some_come_near() {
    let duties: Vec<f64> = (0..=16).map(|n| f64::from(n) / 16.0).collect();
    for (p, v_ref, periods) in [(boost().0, 48.0, 4), (buck_boost().0, 24.0, 6)] {
        for step in STEPS {
            let limit = question(&p, v_ref, step).bound(0.0).deviation;
            let least = least_of_all(&p, v_ref, step, &duties, periods);
            assert!(
                least > 0.98 * limit && least < 1.1 * limit,
                "{:?} {step:?}: {least} against {limit}",
                p.converter.topology
            );
        }
    }
}

#[test]
fn no_classical_controller_beats_the_limit_and_those_that_know_the_current_come_near() {
    let phases: Vec<f64> = Task::default()
        .all_instants()
        .iter()
        .map(|instant| instant.phase)
        .collect();
    for (nominal, v_ref) in [boost(), buck_boost()] {
        for delay in [0, 1] {
            let mut p = nominal.clone();
            p.pwm.duty_delay = delay;
            for step in STEPS {
                let limit = question(&p, v_ref, step).answer(&phases);
                for kind in [Kind::Cascade, Kind::FeedForward, Kind::Deadbeat] {
                    let finding = found(kind, &p, &p, v_ref, step);
                    let (ours, theirs) = (&limit.worst, &finding.worst);
                    assert!(theirs.deviation > 0.999 * ours.deviation - 1e-3, "{kind} {step:?}");
                    let (reach, tail) = match kind {
                        Kind::FeedForward => (1.3, 0.011),
                        // it goes for time, not for the dip
                        Kind::Deadbeat => (f64::INFINITY, 1e-3),
                        _ => (5.0, 0.5),
                    };
                    assert!(
                        theirs.deviation < reach * ours.deviation,
                        "{kind} {step:?}: {theirs:?} {ours:?}"
                    );
                    assert!(theirs.tail_max < tail, "{kind} {step:?}: {theirs:?}");
                    if kind == Kind::Deadbeat {
                        let period = 1.0 / p.converter.f_sw;
                        // two periods at most behind the fastest way there is
                        assert!(
                            theirs.settling < ours.settling + 2.01 * period,
                            "{step:?}: {theirs:?} {ours:?}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn deadbeat_and_feed_forward_hold_a_plant_whose_parts_are_smaller_than_their_print() {
    for (design, v_ref) in [boost(), buck_boost()] {
        let mut p = design.clone();
        p.converter.inductance *= 0.85;
        p.converter.capacitance *= 0.85;
        for step in STEPS {
            for kind in [Kind::FeedForward, Kind::Deadbeat] {
                let worst = found(kind, &design, &p, v_ref, step).worst;
                assert!(
                    worst.is_settled() && worst.tail_max < 1e-3 * v_ref,
                    "{kind} {step:?}: {worst:?}"
                );
            }
        }
    }
}

#[test]
fn a_voltage_loop_near_the_zero_is_refused_by_name_and_one_far_from_it_is_not() {
    let (p, v_ref) = buck_boost();
    let said = Baseline::new(Kind::Pid, &p, v_ref, 5.0).unwrap_err().to_string();
    // D'^2 R/(D L) = (1/3)^2 4.8 ohm/(2/3 22 uH) = 36.36 krad/s; D'/sqrt(L C) = 4.791 krad/s
    for part in ["PID", "buck-boost", "5.787 kHz", "0.763 kHz", "`feed-forward`"] {
        assert!(said.contains(part), "{part}\n{said}");
    }
    assert!(
        Baseline::new(Kind::Pid, &p, v_ref, 0.5).is_ok(),
        "a light load has its zero far up"
    );
    let (p, v_ref) = boost();
    for step in STEPS {
        let worst = found(Kind::Pid, &p, &p, v_ref, step).worst;
        assert!(worst.is_settled(), "{step:?}: {worst:?}");
    }
}

#[test]
fn a_voltage_that_the_topology_cannot_make_has_no_limit() {
    let (p, _) = boost();
    let refused = Question::new(&p, 12.0, LoadStep::from(STEPS[0]), [0.0, 1.0])
        .err()
        .unwrap();
    assert!(refused.to_string().contains("does not rest at 12 V"), "{refused}");
}
