//! Converters with an ESR and what may stand beside it, side by side against each alone.

#![allow(clippy::unwrap_used)] // helpers of tests stand outside of #[test] functions

use plant::{Batch, Load, Parameters, Plant, Rectifier, Topology};

/// A converter of the paper with an ESR and changes.
fn with_esr(change: impl Fn(&mut Parameters)) -> Parameters {
    let mut p = Parameters::paper_model();
    p.capacitor.esr = 0.03;
    change(&mut p);
    p
}

/// What a bench has: losses, a dead time, sensors with steps and noise.
fn bench(p: &mut Parameters) {
    p.converter.rectifier = Rectifier::Synchronous;
    (p.inductor.dcr, p.switch.dead_time) = (0.05, 5e-7);
    (p.switch.v_f, p.switch.r_d) = (0.7, 0.02);
    (p.sensors.v_out.lsb, p.sensors.i_l.lsb) = (0.05, 0.02);
    (p.sensors.v_out.noise, p.sensors.seed) = (0.02, 7);
}

/// Kinds of circuits; groups of eight are of one kind or of several.
fn kinds() -> Vec<Parameters> {
    vec![
        with_esr(|_| ()),
        with_esr(bench),
        with_esr(|p| (p.capacitor.esl, p.inductor.core_conductance) = (2e-8, 1e-4)),
        with_esr(|p| (p.source.resistance, p.converter.capacitance) = (0.2, 150e-6)),
        with_esr(|p| {
            bench(p);
            p.converter.topology = Topology::BuckBoost;
        }),
        with_esr(|p| {
            // several steps an interval
            (p.converter.inductance, p.converter.capacitance) = (2e-5, 2e-5);
            (p.pwm.duty_lsb, p.load.bleed) = (0.01, 1e-3);
        }),
        with_esr(|p| (p.switch.dead_time, p.switch.v_f) = (1e-6, 0.8)),
        with_esr(|p| p.converter.topology = Topology::Boost),
    ]
}

fn load(n: usize) -> Load {
    [
        Load::power(200.0),
        Load::resistor(20.0),
        Load::current(3.0),
        Load {
            conductance: 0.02,
            current: 0.5,
            power: 60.0,
        },
        Load::power(6.0),
    ][n % 5]
}

/// Duties of regular periods, of those at both ends, and of pulses that a dead time takes away.
fn duty(n: usize) -> f64 {
    [
        0.5, 0.44, 0.55, 0.3, 0.7, 0.513, 0.0, 1.0, 0.62, 0.05, 0.003, 0.997, 0.5, 0.48,
    ][n * 11 % 14]
}

/// Steps all and each alone, with loads that change within a period now and then.
fn hold_against_each_other(all: &[Parameters], duty: impl Fn(usize) -> f64) {
    let count = all.len();
    let mut batch = Batch::new(all).unwrap();
    let mut plants: Vec<_> = all.iter().map(|p| Plant::new(p).unwrap()).collect();
    let mut loads: Vec<_> = (0..count).map(load).collect();
    for (n, plant) in plants.iter_mut().enumerate() {
        plant.reset_at(100.0, n as f64 - 2.0, &loads[n]);
        batch.reset_at(n, 100.0, n as f64 - 2.0, &loads[n]);
    }
    for step in 0..300 {
        let duties: Vec<_> = (0..count).map(|n| duty(step + n)).collect();
        let changes: Vec<_> = (0..count)
            .filter(|n| (step + 5 * n) % 17 == 0)
            .map(|n| (n, [0.0, 0.3, 0.9, 1.0 - 1e-9][(step + n) % 4], load(step / 17 + n + 1)))
            .collect();
        batch.step_with_changes(&duties, &loads, &changes);
        for (n, plant) in plants.iter_mut().enumerate() {
            let sample = match changes.iter().find(|change| change.0 == n) {
                Some((_, at, after)) => plant.step_with_change(duties[n], &loads[n], after, *at),
                None => plant.step(duties[n], &loads[n]),
            };
            if let Some((_, _, after)) = changes.iter().find(|change| change.0 == n) {
                loads[n] = *after;
            }
            let bits = |s: plant::Signals| [s.v_out, s.i_l, s.i_out, s.v_in].map(f64::to_bits);
            let place = format!("period {step}, converter {n}: {sample:?}");
            assert_eq!(bits(batch.signals(n, &loads[n])), bits(sample.signals()), "{place}");
            assert_eq!(bits(batch.measured(n, &loads[n])), bits(sample.measured), "{place}");
            assert_eq!(
                (batch.v_out()[n], batch.i_l()[n]),
                (sample.v_out, sample.i_l),
                "{place}"
            );
        }
    }
}

#[test]
fn a_batch_gives_the_bits_of_each_plant_with_an_esr() {
    for kind in kinds() {
        hold_against_each_other(&vec![kind; 11], duty);
    }
}

#[test]
fn so_it_does_where_converters_differ_in_a_group() {
    let kinds = kinds();
    let plain = Parameters::paper_model();
    let all: Vec<_> = (0..27)
        .map(|n| match n {
            // a group in which some have an ESR, and some do not
            8..16 if n % 2 == 0 => plain.clone(),
            _ => kinds[n % kinds.len()].clone(),
        })
        .collect();
    hold_against_each_other(&all, duty);
}

#[test]
fn so_it_does_in_steady_operation() {
    for kind in kinds() {
        hold_against_each_other(&vec![kind; 8], |n| 0.49 + 0.002 * (n % 5) as f64);
    }
}

#[test]
fn noise_of_a_plain_converter_is_that_of_the_plant() {
    let mut p = Parameters::paper_model();
    (p.sensors.v_out.noise, p.sensors.i_l.lsb) = (0.1, 0.05);
    hold_against_each_other(&vec![p; 9], duty);
}
