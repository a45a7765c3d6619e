//! ngspice under control, period by period, against the plant: the same commands, the same samples.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use closed_loop::{Converter, Environment, LoadPath, Start};
use plant::{Carrier, Load, Model, Parameters, Rectifier, Sample, ShortPulse};
use spice::SpiceConverter;

fn lossy() -> Parameters {
    let mut p = Parameters::paper_table();
    (p.inductor.dcr, p.switch.r_ds_on, p.switch.r_ds_on_low) = (0.1, 0.05, 0.05);
    (p.switch.v_f, p.switch.r_d) = (0.8, 0.02);
    p
}

fn start() -> Start<'static> {
    Start {
        v_out: 100.0,
        i_l: 3.0,
        load: Load::power(200.0),
        seed: 0,
        varied: &[],
    }
}

/// Steps of duty and load; the load changes inside a period.
fn command(n: usize) -> (f64, LoadPath) {
    let duty = [0.5, 0.56, 0.47, 0.52][n / 5 % 4];
    let load = |n: usize| Load::power(if n < 12 { 200.0 } else { 350.0 });
    let path = LoadPath {
        before: load(n),
        change: (n == 11).then(|| (0.37, load(12))),
    };
    (duty, path)
}

fn run(mut environment: impl Environment, periods: usize) -> Vec<Sample> {
    let first = environment.restart(&start()).unwrap();
    let rest = (0..periods).map(|n| {
        let (duty, path) = command(n);
        environment.step(duty, &path)
    });
    std::iter::once(first).chain(rest).collect()
}

#[track_caller]
fn assert_agreement(name: &str, p: &Parameters) {
    let ours = run(Converter::new(p).unwrap(), 40);
    let theirs = run(SpiceConverter::new(p).unwrap(), 40);
    assert_eq!(theirs.len(), 41);
    for (n, (a, b)) in ours.iter().zip(&theirs).enumerate() {
        let off = [
            a.measured.v_out - b.measured.v_out,
            a.i_l - b.i_l,
            a.i_out - b.i_out,
            a.v_min - b.v_min,
            a.v_max - b.v_max,
        ];
        // the bounds of the plant's own comparison with ngspice, docs/results/plant.md
        let bounds = [1.5e-3, 1.5e-3, 1e-3, 2e-3, 2e-3];
        let within = off.iter().zip(bounds).all(|(x, bound)| x.abs() <= bound);
        assert!(within, "{name}, sample {n}: {off:?}\n{a:?}\n{b:?}");
    }
}

#[test]
fn ngspice_follows_the_same_commands_to_the_same_samples() {
    assert_agreement("diode", &lossy());
    let mut p = lossy();
    p.converter.rectifier = Rectifier::Synchronous;
    (p.switch.dead_time, p.switch.turn_off_delay) = (1e-6, 0.4e-6);
    p.pwm.duty_delay = 1;
    assert_agreement("synchronous, delay", &p);
    let mut p = lossy();
    (p.pwm.sampling_phase, p.pwm.carrier) = (0.3, Carrier::Centre);
    (p.sensors.v_out.gain, p.sensors.v_out.offset) = (1.005, -0.2);
    assert_agreement("sampled later", &p);
    let mut p = lossy();
    p.load.v_fold = 130.0;
    assert_agreement("below the fold", &p);
}

#[test]
fn a_copy_goes_on_from_the_same_state() {
    let mut one = SpiceConverter::new(&lossy()).unwrap();
    one.restart(&start()).unwrap();
    for n in 0..5 {
        let (duty, path) = command(n);
        one.step(duty, &path);
    }
    let mut other = one.clone();
    for n in 5..8 {
        let (duty, path) = command(n);
        assert_eq!(one.step(duty, &path), other.step(duty, &path));
    }
    let mut third = other.clone();
    let (_, path) = command(8);
    assert_ne!(one.step(0.5, &path), third.step(0.6, &path));
}

#[test]
fn what_ngspice_does_not_do_is_said() {
    let refused: [(&str, fn(&mut Parameters)); 5] = [
        ("sensor_delay", |p| p.sensors.i_l.delay = 1e-6),
        ("sensor_low_pass", |p| p.sensors.v_out.low_pass = 1e-6),
        ("sensor_noise", |p| p.sensors.v_in.noise = 0.1),
        ("averaged", |p| p.converter.model = Model::Averaged),
        ("extend", |p| {
            (p.pwm.min_on_time, p.pwm.short_pulse) = (1e-6, ShortPulse::Extend)
        }),
    ];
    for (said, change) in refused {
        let mut p = lossy();
        change(&mut p);
        let error = SpiceConverter::new(&p).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
}
