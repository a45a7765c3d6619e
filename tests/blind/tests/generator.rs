//! The generator against the schematic's arithmetic, against the plant, and against itself.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use blind::bench::Bench;
use blind::case::measure;
use blind::effects::effect;
use blind::experiment::{Extent, Load, Record};
use blind::netlist::netlist;
use blind::plan::{plan, plan_of};
use blind::rng::Rng;
use blind::{ngspice, sensing};
use plant::{Parameters, Plant};

/// One duty and one load for so long that nothing moves any more, then what `rows` says.
fn record(rows: Vec<(f64, Load)>) -> Record {
    Record {
        name: "test",
        heldout: false,
        duty: rows.iter().map(|row| row.0).collect(),
        load: rows.iter().map(|row| row.1).collect(),
        closed: false,
        lead: 400,
    }
}

fn run(bench: &Bench, record: &Record) -> sensing::Samples {
    let mut random = Rng::new(0, &[]);
    let signals = ngspice::run(&netlist(bench, record, &mut random), 0).unwrap();
    sensing::exact(bench, record, &signals, &mut random)
}

/// In continuous conduction the mean voltage across the inductor is 0: the sum over the loop gives the output voltage.
#[test]
fn settled_voltage_is_the_one_of_the_loop_equation() {
    let resistance = 14.0;
    let load = Load {
        conductance: 1.0 / resistance,
        ..Load::default()
    };
    let cases: [&[(&str, usize, f64)]; 6] = [
        &[],
        &[("dcr", 0, 0.5)],
        &[("r_ds_on", 0, 0.6)],
        &[("diode", 0, 2.0), ("diode", 1, 0.1)],
        &[("dead_time", 0, 2e-6), ("turn_on_delay", 0, 1e-6)],
        &[("source_impedance", 0, 0.8), ("v_in_wrong", 0, 190.0)],
    ];
    for changes in cases {
        let mut bench = Bench::nominal();
        for &(id, place, value) in changes {
            effect(id).unwrap().parameters[place].set(&mut bench, value);
        }
        let c = &bench.circuit;
        let duty = 0.55 - (bench.modulator.dead_time + bench.modulator.turn_on_delay) / 1e-4;
        let r = duty * (c.r_ds_on + c.source_resistance) + (1.0 - duty) * c.r_d + c.dcr;
        let expected = (duty * c.v_in - (1.0 - duty) * c.v_f) / (1.0 + r / resistance);
        let text = netlist(&bench, &record(vec![(0.55, load); 20]), &mut Rng::new(0, &[]));
        let v_o = ngspice::run(&text, 0).unwrap().v_o;
        let mean = v_o[41_000..42_000].iter().sum::<f64>() / 1000.0;
        // what is left: the curve of the exponential diode
        assert!(
            (mean - expected).abs() < 0.01,
            "{changes:?}: {mean} instead of {expected}"
        );
    }
}

/// Where both know the circuit, a record of the nominal bench must not look like an effect.
#[test]
fn nominal_records_are_those_of_the_nominal_plant() {
    let at = |duty, conductance, current, power| {
        let load = Load {
            conductance,
            current,
            power,
        };
        (duty, load)
    };
    let mut rows = vec![at(0.5, 0.05, 0.0, 0.0); 5];
    rows.extend(vec![at(0.44, 0.05, 0.0, 0.0); 40]);
    rows.extend(vec![at(0.55, 0.05, 0.0, 250.0); 40]);
    rows.extend(vec![at(0.5, 0.025, 4.0, 0.0); 40]);
    let record = record(rows);
    let bench = Bench::nominal();
    let samples = run(&bench, &record);

    let mut plant = Plant::new(&quiet()).unwrap();
    let load = |row: usize| set(&record.load[row]);
    plant.reset_at(100.0, 5.0, &load(0));
    for _ in 0..record.lead {
        plant.step(record.duty[0], &load(0));
    }
    let mut largest = [0.0_f64; 3];
    for (row, sample) in samples.iter().enumerate().skip(1) {
        let shown = plant
            .step_with_change(record.duty[row], &load(row - 1), &load(row), 0.5)
            .measured;
        for (channel, value) in [shown.v_out, shown.i_l, shown.i_out].into_iter().enumerate() {
            largest[channel] = largest[channel].max((value - sample[channel]).abs());
        }
    }
    // a tenth of the noise: 0.1 V, 0.05 A
    assert!(
        largest[0] < 0.01 && largest[1] < 0.005 && largest[2] < 0.005,
        "{largest:?}"
    );
}

/// The nominal plant without noise.
fn quiet() -> Parameters {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/blind/plant.toml");
    let mut parameters = Parameters::from_file(file).unwrap();
    let s = &mut parameters.sensors;
    for sensor in [&mut s.v_out, &mut s.i_l, &mut s.i_out, &mut s.v_in] {
        sensor.noise = 0.0;
    }
    parameters
}

fn set(load: &Load) -> plant::Load {
    plant::Load {
        conductance: load.conductance,
        current: load.current,
        power: load.power,
    }
}

/// The duty column of a controlled record is what the switch did in the period that starts with the row.
#[test]
fn controlled_records_are_those_of_the_nominal_plant_given_their_duties() {
    let watts = |power| Load {
        power,
        ..Load::default()
    };
    let mut record = record([vec![(0.5, watts(450.0)); 20], vec![(0.5, watts(800.0)); 20]].concat());
    (record.closed, record.lead) = (true, 100);
    let mut bench = Bench::nominal();
    bench.sensors.low_pass = 0.0;
    let text = netlist(&bench, &record, &mut Rng::new(0, &[]));
    let signals = ngspice::run(&text, 0).unwrap();
    let samples = sensing::exact(&bench, &record, &signals, &mut Rng::new(0, &[]));
    let duty = sensing::duty(&record, &signals);

    let mut parameters = quiet();
    parameters.pwm.sampling_phase = 0.0;
    let s = &mut parameters.sensors;
    (s.v_out.low_pass, s.i_l.low_pass, s.i_out.low_pass) = (0.0, 0.0, 0.0);
    let mut plant = Plant::new(&parameters).unwrap();
    // constant power is unstable without its controller: a few periods at a time
    for start in (0..36_usize).step_by(4) {
        let before = set(&record.load[start.saturating_sub(1)]);
        plant.reset_at(samples[start][0], samples[start][1], &before);
        for row in start..start + 3 {
            let shown = plant.step(duty[row], &set(&record.load[row])).measured;
            let [v, i, ..] = samples[row + 1];
            assert!((shown.v_out - v).abs() < 0.02, "row {row}: {} {v}", shown.v_out);
            assert!((shown.i_l - i).abs() < 0.02, "row {row}: {} {i}", shown.i_l);
        }
    }
}

#[test]
fn a_case_has_the_same_bytes_again_and_no_two_cases_are_alike() {
    let measured = |seed, index| measure(&plan(seed, index, Extent::Short), false).unwrap();
    assert_eq!(measured(4, 1), measured(4, 1));
    assert_ne!(measured(4, 1).files, measured(4, 2).files);
    assert_ne!(measured(4, 1).files, measured(5, 1).files);
}

/// Hidden effects that no data can show would make the set meaningless.
#[test]
fn effects_move_the_records_far_beyond_the_noise() {
    for id in [
        "esr",
        "sampling_delay",
        "cpl_fold",
        "duty_quantisation",
        "eddy_currents",
        "shift_in_record",
    ] {
        let case = measure(&plan_of(9, 0, &[id], Extent::Short).unwrap(), false).unwrap();
        assert!(case.truth.chi2 > 50.0, "{id}: {}", case.truth.chi2);
    }
    let none = measure(&plan_of(9, 0, &[], Extent::Short).unwrap(), false).unwrap();
    assert_eq!(none.truth.chi2, 0.0);
}
