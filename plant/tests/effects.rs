//! Each effect moves what its physics says; without effects nothing moves.

#![allow(clippy::unwrap_used)] // helpers of tests stand outside of #[test] functions

use plant::{Load, Parameters, Plant, Sample, ShortPulse};

fn plant(p: &Parameters) -> Plant {
    Plant::new(p).unwrap()
}

fn run(p: &Parameters, load: &Load) -> Vec<Sample> {
    let mut plant = plant(p);
    plant.reset_at(100.0, 3.0, load);
    (0..60)
        .map(|n| plant.step([0.5, 0.533, 0.46, 0.2][n / 7 % 4], load))
        .collect()
}

fn changed(change: impl FnOnce(&mut Parameters)) -> Parameters {
    let mut p = Parameters::paper_table();
    change(&mut p);
    p
}

const LOAD: Load = Load {
    conductance: 0.04,
    current: 0.5,
    power: 50.0,
};

#[test]
fn every_default_is_neutral() {
    for parameter in plant::parameters() {
        assert_eq!(
            parameter.get(&Parameters::default()),
            parameter.neutral,
            "{}",
            parameter.key
        );
        let (low, high) = parameter.allowed;
        let (from, to) = parameter.typical;
        assert!(low <= from && from <= to && to <= high, "{}", parameter.key);
        let mut p = Parameters::default();
        parameter.set(&mut p, to);
        let expected = if parameter.unit == "1" && to.fract() == 0.0 {
            to.round()
        } else {
            to
        };
        assert_eq!(parameter.get(&p), expected, "{}", parameter.key);
    }
}

#[test]
fn effects_at_zero_are_the_ideal_plant_to_the_bit() {
    let ideal = run(&Parameters::paper_table(), &LOAD);
    for parameter in plant::parameters().filter(|p| !p.key.starts_with("converter")) {
        let mut p = Parameters::paper_table();
        parameter.set(&mut p, parameter.neutral);
        assert_eq!(run(&p, &LOAD), ideal, "{}", parameter.key);
    }
    // parameters that only shape an absent effect
    for key in [
        "inductor.i_sat",
        "capacitor.v_half",
        "source.ripple_frequency",
        "source.c_in",
        "pwm.short_pulse",
    ] {
        let parameter = plant::parameter(key).unwrap();
        let mut p = Parameters::paper_table();
        parameter.set(&mut p, parameter.typical.1);
        for (a, b) in run(&p, &LOAD).iter().zip(&ideal) {
            assert!(
                (a.v_out - b.v_out).abs() < 1e-5 && (a.i_l - b.i_l).abs() < 1e-5,
                "{key} {a:?} {b:?}"
            );
        }
    }
}

#[test]
fn the_two_integrators_agree() {
    // an ESR of a picoohm asks for the circuit of all states
    let full = run(&changed(|p| p.capacitor.esr = 1e-12), &LOAD);
    for (a, b) in full.iter().zip(run(&Parameters::paper_table(), &LOAD)) {
        assert!(
            (a.v_out - b.v_out).abs() < 1e-5 && (a.i_l - b.i_l).abs() < 1e-5,
            "{a:?} {b:?}"
        );
        assert!(
            (a.v_min - b.v_min).abs() < 1e-4 && (a.v_max - b.v_max).abs() < 1e-4,
            "{a:?} {b:?}"
        );
        assert_eq!(a.discontinuous, b.discontinuous);
    }
}

#[test]
fn every_effect_moves_something() {
    let partners: &[(&str, &str, f64)] = &[
        ("inductor.i_sat", "inductor.saturation", 0.5),
        ("capacitor.v_half", "capacitor.derating", 0.5),
        ("cable.resistance", "cable.inductance", 1e-6),
        ("cable.resistance", "cable.capacitance", 1e-5),
        ("source.inductance", "source.c_in", 1e-4),
        ("source.esr_in", "source.c_in", 1e-4),
        ("source.esr_in", "source.resistance", 0.5),
        ("source.c_in", "source.resistance", 0.5),
        ("source.ripple_frequency", "source.ripple", 5.0),
        ("source.ripple_phase", "source.ripple", 5.0),
        ("sensors.seed", "sensors.v_out.noise", 0.1),
    ];
    let silent = [
        "pwm.short_pulse",
        "pwm.min_on_time",
        "load.v_fold",
        "switch.r_ds_on_low",
        "converter.rectifier",
    ];
    for parameter in plant::parameters().filter(|p| !silent.contains(&p.key)) {
        let mut base = Parameters::paper_table();
        // a cable cannot lose its inductance or capacitance: there the base has another value
        if matches!(parameter.key, "cable.inductance" | "cable.capacitance") {
            (base.cable.inductance, base.cable.capacitance) = (2e-6, 2e-5);
        }
        for (_, partner, value) in partners.iter().filter(|(key, ..)| *key == parameter.key) {
            plant::parameter(partner).unwrap().set(&mut base, *value);
        }
        let mut p = base.clone();
        let far = if parameter.typical.1 == parameter.neutral {
            parameter.typical.0
        } else {
            parameter.typical.1
        };
        let value = match parameter.key {
            "source.ripple_phase" => 0.25,
            "sensors.v_in.lsb" => 0.07,
            _ => far,
        };
        parameter.set(&mut p, value);
        assert!(run(&p, &LOAD) != run(&base, &LOAD), "{} = {value}", parameter.key);
    }
}

#[test]
fn series_losses_lower_the_settled_voltage_as_computed() {
    let duty = |p: &Parameters| plant(p).settle(100.0, &Load::current(5.0)).duty;
    let ideal = duty(&Parameters::paper_model());
    let loss = |change: fn(&mut Parameters)| {
        let mut p = Parameters::paper_model();
        change(&mut p);
        duty(&p) - ideal
    };
    // volts at the switch node over v_in
    let expect = [
        (loss(|p| p.inductor.dcr = 0.2), 5.0 * 0.2 / 200.0),
        (loss(|p| p.switch.r_ds_on = 0.2), 0.5 * 5.0 * 0.2 / 200.0),
        (loss(|p| p.switch.v_f = 1.0), 0.5 / 201.0),
        (loss(|p| p.switch.r_d = 0.2), 0.5 * 5.0 * 0.2 / 200.0),
        (loss(|p| p.switch.dead_time = 1e-6), 0.01),
        (loss(|p| p.switch.turn_off_delay = 1e-6), -0.01),
        (loss(|p| p.switch.turn_on_delay = 1e-6), 0.01),
    ];
    for (n, (found, expected)) in expect.into_iter().enumerate() {
        assert!(
            (found - expected).abs() < 0.02 * f64::abs(expected),
            "{n}: {found} {expected}"
        );
    }
}

#[test]
fn a_late_sample_turns_ripple_into_bias() {
    // a sampling instant off the middle of a slope reads i off its mean
    let mean = |phase: f64| {
        let p = changed(|p| p.pwm.sampling_phase = phase);
        let mut plant = plant(&p);
        let duty = plant.settle(100.0, &Load::current(5.0)).duty;
        plant.step(duty, &Load::current(5.0)).i_l
    };
    for (phase, expected) in [(0.25, 5.0), (0.0, 3.75), (0.5, 6.25)] {
        assert!((mean(phase) - expected).abs() < 1e-2, "{phase}: {}", mean(phase));
    }
}

#[test]
fn minimum_on_time_drops_or_extends_short_pulses() {
    let i_max = |duty: f64, mode: ShortPulse| {
        let mut plant = plant(&changed(|p| (p.pwm.min_on_time, p.pwm.short_pulse) = (2e-6, mode)));
        plant.reset_at(100.0, 0.0, &LOAD);
        plant.step(duty, &LOAD).i_max
    };
    assert_eq!(i_max(0.01, ShortPulse::Drop), 0.0);
    assert!((i_max(0.01, ShortPulse::Extend) - 0.1).abs() < 1e-3 && i_max(0.0, ShortPulse::Extend) == 0.0);
}

#[test]
fn measured_values_follow_gain_offset_and_step() {
    let p = changed(|p| {
        (p.sensors.v_out.gain, p.sensors.v_out.offset, p.sensors.i_l.lsb) = (1.01, -0.5, 0.25);
    });
    for sample in run(&p, &LOAD) {
        assert!((sample.measured.v_out - (1.01 * sample.v_out - 0.5)).abs() < 1e-12);
        assert!((sample.measured.i_l - sample.i_l).abs() <= 0.125 && (sample.measured.i_l / 0.25).fract() == 0.0);
        assert_eq!(sample.measured.i_out, sample.i_out);
    }
}

#[test]
fn noise_is_seeded_and_goes_on_after_a_reset() {
    let p = changed(|p| p.sensors.v_out.noise = 0.1);
    assert_eq!(run(&p, &LOAD), run(&p, &LOAD));
    let mut plant = plant(&p);
    let errors: Vec<_> = (0..2000)
        .map(|n| {
            if n % 10 == 0 {
                plant.reset_at(100.0, 3.0, &LOAD);
            }
            let sample = plant.step(0.5, &LOAD);
            sample.measured.v_out - sample.v_out
        })
        .collect();
    let variance = errors.iter().map(|e| e * e).sum::<f64>() / 2000.0;
    assert!((variance.sqrt() - 0.1).abs() < 0.006, "{variance}");
    assert!(errors[..10] != errors[10..20]);
}

#[test]
fn a_sensor_delay_of_a_period_shows_the_sample_before() {
    let p = changed(|p| p.sensors.v_out.delay = 2e-4);
    let samples = run(&p, &LOAD);
    for pair in samples.windows(3) {
        assert!((pair[2].measured.v_out - pair[0].v_out).abs() < 1e-9, "{pair:?}");
    }
}

#[test]
fn a_checkpoint_continues_to_the_bit() {
    let p = changed(|p| {
        (p.sensors.v_out.noise, p.sensors.i_l.delay, p.pwm.duty_delay) = (0.1, 5e-5, 2);
        (p.capacitor.esr, p.load.cpl_time_constant, p.switch.turn_off_delay) = (0.05, 1e-4, 1e-6);
    });
    let mut plant = plant(&p);
    plant.reset_at(100.0, 3.0, &LOAD);
    for n in 0..25 {
        plant.step(0.4 + 0.01 * f64::from(n), &LOAD);
    }
    let text = serde_json::to_string(plant.state()).unwrap();
    let mut other = Plant::new(&p).unwrap();
    other.restore(&serde_json::from_str(&text).unwrap());
    for _ in 0..25 {
        assert_eq!(plant.step(0.47, &LOAD), other.step(0.47, &LOAD));
    }
}
