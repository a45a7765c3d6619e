//! Each effect moves what its physics says; without effects nothing moves.

#![allow(clippy::unwrap_used)] // helpers of tests stand outside of #[test] functions

use plant::{Batch, Effect, Load, Parameters, Plant, Sample, ShortPulse, Way};

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
    for effect in plant::effects().filter(|effect| effect.name != CIRCUIT) {
        let mut p = Parameters::paper_table();
        for parameter in effect.parameters {
            parameter.set(&mut p, parameter.neutral);
        }
        assert!(!effect.is_on(&p), "{}", effect.name);
        assert_eq!(run(&p, &LOAD), ideal, "{}", effect.name);
        // what only shapes an effect does nothing without it
        for detail in effect.parameters.iter().filter(|parameter| !parameter.switches_on) {
            detail.set(&mut p, detail.typical.1);
        }
        assert!(!effect.is_on(&p), "{}", effect.name);
        assert_eq!(run(&p, &LOAD), ideal, "{}", effect.name);
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

/// The converter itself, whose numbers are never absent.
const CIRCUIT: &str = "converter";

/// The paper's converter with one effect, all its numbers in the middle of their typical range.
fn with(effect: &Effect) -> Parameters {
    changed(|p| {
        for parameter in effect.parameters {
            parameter.set(p, 0.5 * (parameter.typical.0 + parameter.typical.1));
        }
    })
}

#[test]
fn every_effect_moves_something() {
    // what these change does not happen in this run: no short pulse, no low voltage, no second switch
    let silent = [
        "pwm.short_pulse",
        "pwm.min_on_time",
        "load.v_fold",
        "switch.r_ds_on_low",
        "converter.rectifier",
    ];
    for effect in plant::effects() {
        for parameter in effect.parameters.iter().filter(|p| !silent.contains(&p.key)) {
            let mut base = match effect.name {
                CIRCUIT => Parameters::paper_table(),
                _ => with(effect),
            };
            // a source voltage that moves, for the sensor of it
            base.source.resistance = 0.5;
            let (mut p, value) = (base.clone(), parameter.typical.1);
            parameter.set(&mut p, value);
            assert!(run(&p, &LOAD) != run(&base, &LOAD), "{} = {value}", parameter.key);
        }
    }
}

/// An effect that is written into one way of computing and declared for another shows here: it is computed the way it asks
/// for, and again by the way that can do everything.
#[test]
fn every_effect_is_computed_alike_by_the_way_it_needs_and_by_all_further_ones() {
    for effect in plant::effects().filter(|e| e.name != CIRCUIT && e.needs < Way::Full) {
        let p = with(effect);
        let mut full = p.clone();
        // an ESR of a picoohm asks for the circuit of all states
        full.capacitor.esr = 1e-12;
        let lsb = p.sensors.v_out.lsb.max(p.sensors.i_l.lsb);
        for (a, b) in run(&p, &LOAD).iter().zip(run(&full, &LOAD)) {
            for (a, b, step) in [
                (a.v_out, b.v_out, 0.0),
                (a.i_l, b.i_l, 0.0),
                (a.i_out, b.i_out, 0.0),
                (a.measured.v_out, b.measured.v_out, lsb),
                (a.measured.i_l, b.measured.i_l, lsb),
            ] {
                assert!((a - b).abs() < 1e-5 + step, "{}: {a} {b}", effect.name);
            }
        }
    }
}

/// Effects of the full circuit with which it has two states all the same.
const FEW: [&str; 3] = ["esr", "esl", "core_loss"];

#[test]
fn a_batch_computes_every_effect_that_needs_no_more() {
    for effect in plant::effects().filter(|effect| effect.name != CIRCUIT) {
        let mut p = with(effect);
        // the loss of a conductor; a core of another law is of the full circuit alone
        p.inductor.core_exponent = 2.0;
        let batch = Batch::new(&vec![p.clone(); 8]);
        let fits = effect.needs == Way::Batch || FEW.contains(&effect.name);
        assert_eq!(batch.is_ok(), fits, "{}", effect.name);
        let Ok(mut batch) = batch else { continue };
        let mut one = plant(&p);
        one.reset_at(100.0, 3.0, &LOAD);
        for lane in 0..8 {
            batch.reset_at(lane, 100.0, 3.0, &LOAD);
        }
        for n in 0..60 {
            let duty = [0.5, 0.533, 0.46, 0.2, 0.004][n / 7 % 5];
            let sample = one.step(duty, &LOAD);
            batch.step(&[duty; 8], &[LOAD; 8]);
            assert_eq!(batch.signals(3, &LOAD), sample.signals(), "{}", effect.name);
            assert_eq!(batch.measured(3, &LOAD), sample.measured, "{}", effect.name);
        }
    }
}

#[test]
fn every_field_of_a_plant_is_in_the_catalogue_and_every_effect_has_its_file() {
    fn keys(value: &serde_json::Value, path: &str, list: &mut Vec<String>) {
        match value.as_object() {
            Some(table) => table
                .iter()
                .for_each(|(key, value)| keys(value, &format!("{path}.{key}"), list)),
            None => list.push(path.trim_start_matches('.').to_owned()),
        }
    }
    let mut fields = Vec::new();
    keys(&serde_json::to_value(Parameters::default()).unwrap(), "", &mut fields);
    let mut listed: Vec<_> = plant::parameters().map(|parameter| parameter.key.to_owned()).collect();
    fields.sort();
    listed.sort();
    assert_eq!(fields, listed);

    let files = std::fs::read_dir("src/effects")
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = files
        .map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned())
        .collect();
    let mut names: Vec<_> = plant::effects()
        .map(|effect| effect.name.replace(CIRCUIT, "mod"))
        .collect();
    files.sort();
    names.sort();
    assert_eq!(files, names);
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
        (loss(|p| p.pwm.duty_offset = -0.01), 0.01),
    ];
    for (n, (found, expected)) in expect.into_iter().enumerate() {
        assert!(
            (found - expected).abs() < 0.02 * f64::abs(expected),
            "{n}: {found} {expected}"
        );
    }
}

/// `v = d v_in - (dcr + heating i^2) i`; and a run stays as warm as where it began.
#[test]
fn a_winding_that_warms_has_the_resistance_of_its_steady_current() {
    let p = changed(|p| (p.inductor.dcr, p.inductor.heating) = (0.2, 0.01));
    let mut plant = plant(&p);
    let at_rest = |plant: &mut Plant, i: f64| plant.rest(0.5, &Load::current(i)).0.v_out;
    for (i, expected) in [(2.0, 100.0 - 0.24 * 2.0), (5.0, 100.0 - 0.45 * 5.0)] {
        let v = at_rest(&mut plant, i);
        // the ripple's own share, a third of a percent of what is lost
        assert!((v - expected).abs() < 0.02, "{i} A: {v}, {expected}");
    }
    // from the point at 5 A on
    let last = (0..20_000)
        .map(|_| plant.step(0.5, &Load::current(2.0)).v_out)
        .last()
        .unwrap();
    assert!((last - (100.0 - 0.45 * 2.0)).abs() < 0.02, "{last}");
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
        p.switch.node_capacitance = 2e-8;
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

/// The correction by its formula: a constant moves the settled voltage by its share of the source, and beyond its range a term
/// stays what it is at the edge.
#[test]
fn an_empirical_term_adds_its_duty_and_stays_what_it_is_beyond_its_range() {
    let settled = |change: &dyn Fn(&mut plant::Empirical), duty: f64| {
        let p = changed(|p| change(&mut p.empirical));
        let load = Load::resistor(20.0);
        let mut plant = plant(&p);
        plant.reset_at(duty * 200.0, duty * 10.0, &load);
        let (sample, rests) = plant.rest(duty, &load);
        assert!(rests);
        sample.v_out
    };
    let moved =
        |change: &dyn Fn(&mut plant::Empirical), duty: f64| (settled(change, duty) - settled(&|_| (), duty)) / 200.0;
    let by_duty = |t: &mut plant::Empirical| (t.d, t.d_centre, t.d_span) = (0.01, 0.5, 0.1);
    for (duty, expected) in [(0.5, 0.0), (0.55, 0.005), (0.6, 0.01), (0.7, 0.01), (0.3, -0.01)] {
        let is = moved(&by_duty, duty);
        assert!((is - expected).abs() < 1e-4, "{duty}: {is}");
    }
    assert!((moved(&|t| t.constant = 0.02, 0.4) - 0.02).abs() < 1e-4);
    // a square, and a product with a rate, which is 0 at rest
    let square = |t: &mut plant::Empirical| (t.d_d, t.d_centre, t.d_span, t.d_rate) = (0.01, 0.5, 0.1, 0.3);
    assert!((moved(&square, 0.45) - 0.0025).abs() < 1e-4);
    // a switch that is told to stay off does
    assert!(settled(&|t| t.constant = 0.02, 0.0).abs() < 1e-6);
}

#[test]
fn the_rate_of_an_empirical_term_fades_with_its_time_constant() {
    let run = |rate: f64| {
        let p = changed(|p| {
            (p.empirical.rate, p.empirical.rate_span, p.empirical.rate_time) = (rate, 0.5, 5e-4);
            p.converter.model = plant::Model::Averaged;
        });
        let load = Load::resistor(20.0);
        let mut plant = plant(&p);
        plant.reset_at(100.0, 5.0, &load);
        (0..4000).map(|_| plant.step(0.6, &load).v_out).collect::<Vec<_>>()
    };
    let (with, without) = (run(0.05), run(0.0));
    // the duty that is added over all: 0.05 times (0.1 / 0.5) e^(-n / 5), a geometric sum; the filter hands its area on
    let area: f64 = with.iter().zip(&without).map(|(a, b)| a - b).sum::<f64>() / 200.0;
    let expected = 0.05 * 0.2 / (1.0 - (-0.2f64).exp());
    assert!((area - expected).abs() < 0.01 * expected, "{area} {expected}");
    assert!((with[3999] - without[3999]).abs() < 1e-3);
}

/// A plant that is put into the middle of a run goes on as the run does.
#[test]
fn the_rate_of_an_empirical_term_remembers_duties_behind_a_segment() {
    for delay in [0, 2] {
        let p = changed(|p| {
            (p.empirical.rate, p.empirical.rate_span, p.empirical.rate_time) = (0.1, 0.2, 1.7e-3);
            p.pwm.duty_delay = delay;
        });
        let load = Load::resistor(20.0);
        let mut whole = plant(&p);
        whole.reset_within(100.0, 5.0, &load, &[0.5; 9]);
        let mut duties = vec![0.5; 9];
        for n in 0..40 {
            let duty = if n < 20 { 0.5 } else { 0.6 };
            whole.step(duty, &load);
            duties.push(duty);
        }
        let now = whole.sample();
        let mut later = plant(&p);
        assert!(later.looks_back() >= 85, "{}", later.looks_back());
        later.reset_within(now.v_out, now.i_l, &load, &duties);
        for n in 0..30 {
            let (a, b) = (whole.step(0.6, &load).v_out, later.step(0.6, &load).v_out);
            assert!((a - b).abs() < 1e-9, "delay {delay}, period {n}: {a} V {b} V");
        }
    }
}

/// The instant lies between the end of the pulse without losses and that of the duty in force. The ESR's voltage is another on either side: the
/// output voltage that is given has to be that of the side on which the plant is.
#[test]
fn a_boost_put_beside_the_end_of_its_pulse_is_on_the_side_of_its_duty() {
    let text = "[converter]\ntopology = \"boost\"\nrectifier = \"synchronous\"\nv_in = 41.0\ninductance = 540e-6\ncapacitance = 1.8e-6\n\
                f_sw = 52e3\n[inductor]\ndcr = 0.6\n[capacitor]\nesr = 0.57\n[switch]\nr_ds_on = 0.5\nr_ds_on_low = 0.5\n\
                [pwm]\ncarrier = \"trailing\"\nsampling_phase = 0.6\n";
    let p = Parameters::from_toml("plant.toml".as_ref(), text).unwrap();
    let load = Load::resistor(180.0);
    let mut before = plant(&p);
    before.reset_within(100.0, 1.5, &load, &[0.615; 9]);
    let rest = before.rest(0.615, &load).0;
    // without losses a duty below the instant would do
    assert!(1.0 - 41.0 / rest.v_out < 0.6, "{rest:?}");
    let mut again = plant(&p);
    again.reset_within(rest.v_out, rest.i_l, &load, &[0.615; 9]);
    for period in 0..10 {
        let next = again.step(0.615, &load);
        // the ESR's leap is .57 ohm times 1.4 A
        assert!(
            (next.v_out - rest.v_out).abs() < 1e-3,
            "period {period}: {} V for {} V",
            next.v_out,
            rest.v_out
        );
    }
}
