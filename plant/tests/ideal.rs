//! The ideal converter against closed forms and a fine integration, and against itself along other ways.

#![allow(clippy::unwrap_used)] // helpers of tests stand outside of #[test] functions

use plant::{Batch, Carrier, Load, Model, Parameters, Plant, Rectifier};

fn plant(p: &Parameters) -> Plant {
    Plant::new(p).unwrap()
}

/// A duty that wanders, without a random generator.
fn duty(n: usize) -> f64 {
    [0.5, 0.44, 0.55, 0.3, 0.7, 0.513, 0.0, 1.0, 0.62, 0.05][n * 7 % 10]
}

/// Euler-free reference: classical Runge-Kutta with 20,000 steps a period, the crossing found by the step that makes it.
fn fine_period(p: &Parameters, load: &Load, duty: f64, start: (f64, f64)) -> (f64, f64) {
    let (c, steps) = (&p.converter, 20_000);
    let (t, on) = (p.t_sw(), duty * p.t_sw());
    let slopes = |x: (f64, f64), emf: f64, open: bool| {
        let i_out = load.conductance * x.1 + load.current + load.power / x.1;
        let di = if open { 0.0 } else { (emf - x.1) / c.inductance };
        (di, (x.0 - i_out) / c.capacitance)
    };
    let step = |x: (f64, f64), h: f64, emf: f64, open: bool| {
        let by = |x: (f64, f64), k: (f64, f64), h: f64| (x.0 + h * k.0, x.1 + h * k.1);
        let k1 = slopes(x, emf, open);
        let k2 = slopes(by(x, k1, 0.5 * h), emf, open);
        let k3 = slopes(by(x, k2, 0.5 * h), emf, open);
        let k4 = slopes(by(x, k3, h), emf, open);
        let mean = |a: f64, b: f64, c: f64, d: f64| (a + 2.0 * (b + c) + d) / 6.0;
        by(x, (mean(k1.0, k2.0, k3.0, k4.0), mean(k1.1, k2.1, k3.1, k4.1)), h)
    };
    let mut x = start;
    for (length, emf) in [(on, c.v_in), (t - on, 0.0)] {
        let h = length / f64::from(steps);
        for _ in 0..steps {
            let open = emf == 0.0 && x.0 <= 0.0;
            let next = step(x, h, emf, open);
            x = if emf == 0.0 && next.0 < 0.0 {
                let part = h * x.0 / (x.0 - next.0);
                let (_, v) = step(x, part, emf, false);
                step((0.0, v), h - part, emf, true)
            } else {
                next
            };
        }
    }
    x
}

#[test]
fn a_period_is_within_a_microvolt_of_a_fine_integration() {
    let mut worst = 0.0_f64;
    for p in [Parameters::paper_model(), Parameters::paper_table()] {
        for load in [
            Load::power(200.0),
            Load::power(1000.0),
            Load::resistor(25.0),
            Load::current(0.3),
        ] {
            for (d, i, v) in [
                (0.5, 1.0, 100.0),
                (0.44, 0.2, 99.0),
                (0.9, 5.0, 80.0),
                (0.1, 3.0, 110.0),
                (0.2, 0.0, 130.0),
            ] {
                let mut plant = plant(&p);
                plant.reset_at(v, i, &load);
                let sample = plant.step(d, &load);
                let (i_fine, v_fine) = fine_period(&p, &load, d, (i, v));
                worst = worst.max((sample.v_out - v_fine).abs());
                assert!(
                    (sample.v_out - v_fine).abs() < 1e-6,
                    "{d} {i} {v} {load:?}: {} {v_fine}",
                    sample.v_out
                );
                assert!(
                    (sample.i_l - i_fine).abs() < 1e-6,
                    "{d} {i} {v} {load:?}: {} {i_fine}",
                    sample.i_l
                );
            }
        }
    }
    println!("worst {worst:e} V");
}

#[test]
fn dcm_conversion_ratio_is_the_closed_form() {
    // Erickson and Maksimovic, Fundamentals of Power Electronics, eq. 5.26: M = 2 / (1 + sqrt(1 + 4 K / D^2)), K = 2 L / (R T)
    let p = Parameters::ideal(200.0, 2e-3, 1e-2, 10e3);
    let (r, d) = (400.0, 0.4);
    let k = 2.0 * p.converter.inductance / (r * p.t_sw());
    let ratio = 2.0 / (1.0 + (1.0 + 4.0 * k / (d * d)).sqrt());
    let load = Load::resistor(r);
    let mut plant = plant(&p);
    plant.reset_at(200.0 * ratio, 0.0, &load);
    let mut mean = 0.0;
    for n in 0..400_000 {
        let sample = plant.step(d, &load);
        assert!(sample.discontinuous && sample.i_l == 0.0);
        mean = if n < 399_000 {
            0.0
        } else {
            mean + 0.5e-3 * (sample.v_min + sample.v_max)
        };
    }
    assert!((mean / 200.0 / ratio - 1.0).abs() < 2e-5, "{mean} {}", 200.0 * ratio);
}

#[test]
fn settled_losses_follow_the_exact_formula() {
    // v = d (v_in - r_on i) - (1 - d) (v_f + r_d i) - dcr i, facts of the four-term mapping; a large C makes i constant
    let mut p = Parameters::ideal(200.0, 20e-3, 20e-3, 10e3);
    (p.inductor.dcr, p.switch.r_ds_on, p.switch.v_f, p.switch.r_d) = (0.1, 0.2, 0.8, 0.05);
    for (v, i) in [(100.0, 5.0), (60.0, 8.0), (140.0, 3.0)] {
        let settled = plant(&p).settle(v, &Load::current(i));
        let exact = (v + 0.8 + i * (0.1 + 0.05)) / (200.0 + 0.8 - i * (0.2 - 0.05));
        assert!(
            settled.converged && (settled.duty - exact).abs() < 2e-6,
            "{settled:?} {exact}"
        );
    }
}

#[test]
fn ccm_ripple_is_the_closed_form() {
    // di = v (1 - d) T / L, dv = di T / (8 C)
    for p in [Parameters::paper_table(), Parameters::paper_model()] {
        let load = Load::resistor(25.0);
        let mut plant = plant(&p);
        let duty = plant.settle(100.0, &load).duty;
        let sample = plant.step(duty, &load);
        let di = 100.0 * 0.5 * 1e-4 / 2e-3;
        let dv = di * 1e-4 / (8.0 * p.converter.capacitance);
        assert!((sample.i_max - sample.i_min - di).abs() < 2e-3, "{sample:?}");
        assert!(
            ((sample.v_max - sample.v_min) / dv - 1.0).abs() < 2e-3,
            "{sample:?} {dv}"
        );
    }
}

#[test]
fn full_duty_rings_as_an_rlc_circuit() {
    // series R-L-C without load, switched on from rest: v = V (1 - e^(-a t) (cos w t + a / w sin w t))
    let mut p = Parameters::paper_table();
    p.inductor.dcr = 1.0;
    p.converter.rectifier = Rectifier::Synchronous;
    let (l, c) = (p.converter.inductance, p.converter.capacitance);
    let a = 1.0 / (2.0 * l);
    let w = (1.0 / (l * c) - a * a).sqrt();
    let mut plant = plant(&p);
    for n in 1..=60 {
        let v = plant.step(1.0, &Load::default()).v_out;
        let t = f64::from(n) * 1e-4;
        let exact = 200.0 * (1.0 - (-a * t).exp() * ((w * t).cos() + a / w * (w * t).sin()));
        assert!((v - exact).abs() < 1e-4, "{n} {v} {exact}");
    }
}

#[test]
fn energy_is_balanced() {
    // loss-free with a current load: v_in times the charge drawn is the energy stored and delivered
    let p = Parameters::paper_table();
    let load = Load::current(3.0);
    let mut plant = plant(&p);
    plant.reset_at(100.0, 3.0, &load);
    let energy = |i: f64, v: f64| 0.5 * (p.converter.inductance * i * i + p.converter.capacitance * v * v);
    // d = 1: the source delivers v_in times the charge; charge = C dv + I t
    let before = plant.sample();
    let after = plant.step(1.0, &load);
    let charge = p.converter.capacitance * (after.v_out - before.v_out) + 3.0 * 1e-4;
    let stored = energy(after.i_l, after.v_out) - energy(before.i_l, before.v_out);
    // L di/dt = v_in - v gives the mean of v exactly
    let mean_v = 200.0 - p.converter.inductance * (after.i_l - before.i_l) / 1e-4;
    assert!((200.0 * charge - stored - 3.0 * mean_v * 1e-4).abs() < 1e-9);
}

#[test]
fn averaged_model_is_the_papers_equation_two() {
    let mut p = Parameters::paper_table();
    p.converter.model = Model::Averaged;
    let load = Load {
        conductance: 0.01,
        power: 300.0,
        ..Load::default()
    };
    let mut plant = plant(&p);
    plant.reset_at(98.0, 2.0, &load);
    let (mut i, mut v) = (2.0, 98.0);
    for n in 0..20 {
        let d = duty(n);
        let sample = plant.step(d, &load);
        for _ in 0..100_000 {
            let (i_mid, v_mid) = (
                i + 0.5e-9 * (200.0 * d - v) / 2e-3,
                v + 0.5e-9 * (i - 0.01 * v - 300.0 / v) / 150e-6,
            );
            i += 1e-9 * (200.0 * d - v_mid) / 2e-3;
            v += 1e-9 * (i_mid - 0.01 * v_mid - 300.0 / v_mid) / 150e-6;
        }
        assert!(
            (sample.v_out - v).abs() < 1e-6 && (sample.i_l - i).abs() < 1e-6,
            "{n} {sample:?} {v} {i}"
        );
    }
}

#[test]
fn a_period_in_pieces_is_the_period_at_once() {
    for rectifier in [Rectifier::Diode, Rectifier::Synchronous] {
        let mut p = Parameters::paper_table();
        p.converter.rectifier = rectifier;
        let load = Load {
            conductance: 0.01,
            power: 100.0,
            ..Load::default()
        };
        let (mut fast, mut walk) = (plant(&p), plant(&p));
        fast.reset_at(100.0, 1.0, &load);
        walk.reset_at(100.0, 1.0, &load);
        for n in 0..200 {
            // a change to the same load splits the period in two
            let (a, b) = (
                fast.step(duty(n), &load),
                walk.step_with_change(duty(n), &load, &load, 0.37),
            );
            assert!(
                (a.v_out - b.v_out).abs() < 1e-6 && (a.i_l - b.i_l).abs() < 1e-6,
                "{n} {a:?} {b:?}"
            );
            walk.restore(fast.state());
        }
    }
}

#[test]
fn carriers_differ_by_where_the_pulse_lies_only() {
    // without load and capacitor ripple of note the mean voltage is the same
    for carrier in [Carrier::Trailing, Carrier::Leading, Carrier::Centre] {
        let mut p = Parameters::paper_model();
        p.pwm.carrier = carrier;
        let settled = plant(&p).settle(100.0, &Load::resistor(20.0));
        assert!(
            settled.converged && (settled.duty - 0.5).abs() < 1e-4,
            "{carrier:?} {settled:?}"
        );
    }
}

#[test]
fn batch_gives_the_bits_of_the_plant() {
    let mut losses = Parameters::paper_table();
    (
        losses.inductor.dcr,
        losses.switch.v_f,
        losses.load.bleed,
        losses.load.v_fold,
    ) = (0.1, 0.8, 1e-4, 20.0);
    let mut synchronous = Parameters::paper_model();
    synchronous.converter.rectifier = Rectifier::Synchronous;
    synchronous.pwm.duty_lsb = 0.01;
    let kinds = [Parameters::paper_model(), losses, synchronous];
    let all: Vec<_> = (0..19).map(|n| kinds[n % 3].clone()).collect();
    let mut batch = Batch::new(&all).unwrap();
    let mut plants: Vec<_> = all.iter().map(plant).collect();
    let loads: Vec<_> = (0..19).map(|n| Load::power(30.0 * n as f64)).collect();
    for (n, plant) in plants.iter_mut().enumerate() {
        plant.reset_at(100.0, n as f64 - 2.0, &loads[n]);
        batch.reset_at(n, 100.0, n as f64 - 2.0, &loads[n]);
    }
    for step in 0..300 {
        let duties: Vec<_> = (0..19).map(|n| duty(step + n)).collect();
        batch.step(&duties, &loads);
        for (n, plant) in plants.iter_mut().enumerate() {
            let sample = plant.step(duties[n], &loads[n]);
            let (v, i) = (batch.v_out()[n], batch.i_l()[n]);
            assert_eq!(
                (sample.v_out.to_bits(), sample.i_l.to_bits()),
                (v.to_bits(), i.to_bits()),
                "{step} {n} {sample:?} {v} {i}"
            );
        }
    }
}

#[test]
fn a_batch_refuses_what_it_cannot_hold() {
    let mut p = Parameters::paper_model();
    p.cable.inductance = 1e-6;
    p.cable.capacitance = 1e-6;
    let faults = Batch::new(&[Parameters::paper_model(), p]).unwrap_err();
    assert!(faults.to_string().contains("converter 1"), "{faults}");
}

#[test]
fn extreme_starts_stay_finite() {
    let p = Parameters::paper_table();
    for (v, i, load) in [
        (0.0, 0.0, Load::power(1000.0)),
        (4.999, 0.0, Load::power(1000.0)),
        (250.0, 30.0, Load::default()),
        (20.0, -5.0, Load::power(2000.0)),
    ] {
        let mut plant = plant(&p);
        plant.reset_at(v, i, &load);
        for n in 0..500 {
            let sample = plant.step(duty(n), &load);
            assert!(sample.v_out.is_finite() && sample.i_l.is_finite(), "{v} {i} {n}");
            assert!(sample.v_min <= sample.v_out && sample.v_out <= sample.v_max);
        }
    }
    let mut plant = plant(&p);
    assert!(plant.step(f64::NAN, &Load::power(1.0)).v_out.is_finite());
}
