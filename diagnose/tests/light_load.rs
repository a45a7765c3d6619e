//! Converters whose inductor current rests, or nearly, at the instants of its samples: a light load behind a diode, as on every bench. From a
//! circuit that shares nothing with the plant (`bench`).

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use bench::{Bench, Noise, Table, Wiring, of};
use diagnose::diagnosis::diagnose;
use diagnose::findings::{Findings, Verdict};
use plant::{Carrier, Parameters};

/// A boost of 24 V whose valleys are at 0 in most rows.
fn boost() -> Bench {
    Bench {
        wiring: Wiring::Boost,
        v_in: 24.0,
        inductance: 33e-6,
        capacitance: 150e-6,
        f_sw: 150e3,
        dcr: 0.04,
        esr: 0.03,
        r_ds_on: 0.05,
        v_f: 0.6,
        r_d: 0.02,
        rows: 400,
        sampled: 0.0,
        carrier: 0.0,
        duty: vec![(0, 0.42), (90, 0.5), (170, 0.36), (260, 0.46), (330, 0.4)],
        load: vec![
            (0.0, 0.011, 0.0),
            (130.0, 0.028, 0.0),
            (210.0, 0.009, 0.0),
            (300.0, 0.035, 0.0),
        ],
        ..Bench::default()
    }
}

fn model(bench: &Bench) -> Parameters {
    let mut p = of(bench);
    p.converter.topology = match bench.wiring {
        Wiring::Buck => plant::Topology::Buck,
        Wiring::Boost => plant::Topology::Boost,
        Wiring::BuckBoost => plant::Topology::BuckBoost,
    };
    p.pwm.sampling_phase = bench.sampled;
    p.pwm.carrier = if bench.carrier == 0.0 {
        Carrier::Trailing
    } else {
        Carrier::Leading
    };
    p
}

fn table(bench: &Bench, random: &mut Noise) -> Table {
    let at = |n: usize| bench.load.iter().rev().find(|step| step.0 <= n as f64);
    let ohms = (0..bench.rows)
        .map(|n| at(n).map_or(0.0, |step| 1.0 / step.1))
        .collect();
    let digits = [
        ("v_out", 0.03, 5e-3),
        ("i_l", 0.02, 2e-3),
        ("i_out", 0.01, 1e-3),
        ("v_in", 0.02, 5e-3),
    ];
    bench.run().with("r_load", ohms).measured(&digits, random)
}

fn found(model: &Parameters, table: &Table) -> Findings {
    let record = table.read("run", model).unwrap();
    diagnose(model, vec![record], &[], &|_| {}).findings
}

#[test]
fn samples_of_a_resting_current_are_no_other_unit() {
    let mut random = Noise(71);
    let table = table(&boost(), &mut random).without(&["i_out", "v_in"]);
    let mut shown = table.clone();
    let samples = shown.column("i_l");
    let resting = samples.iter().filter(|i| i.abs() < 0.1).count();
    assert!(2 * resting > samples.len(), "{resting} of {} rest", samples.len());
    let healthy = found(&model(&boost()), &table);
    assert_eq!(healthy.verdict, Verdict::Consistent, "{}", healthy.sentence);
}

/// The other column holds an inductor current that is 0 in most rows, and no load current is.
#[test]
fn currents_that_are_exchanged_are_named_where_one_of_them_rests() {
    let mut random = Noise(73);
    let mut table = table(&boost(), &mut random).without(&["v_in"]);
    // a sensor without an offset: what it shows where the current rests is its noise
    table
        .column("i_l")
        .iter_mut()
        .for_each(|i| *i *= if i.abs() < 0.1 { 0.1 } else { 1.0 });
    let old = table.column("i_l").clone();
    *table.column("i_l") = std::mem::replace(table.column("i_out"), old);
    let said = match table.read("run", &model(&boost())) {
        Ok(_) => String::new(),
        Err(faults) => faults.to_string(),
    };
    assert!(said.contains("the columns i_l and i_out look exchanged"), "{said}");
}

/// Sampled where the switch turns off, and no current is measured: the beginning is the peak of a ripple that touches 0, and from a current
/// that rests no step leads there.
#[test]
fn a_record_that_begins_at_the_peak_of_a_ripple_is_consistent() {
    let mut random = Noise(74);
    for (first, current) in [(0.875, 0.1), (0.885, 0.14), (0.895, 0.18)] {
        let bench = Bench {
            v_in: 380.0,
            inductance: 550e-6,
            capacitance: 3.3e-6,
            f_sw: 75e3,
            dcr: 4.7,
            esr: 0.48,
            r_ds_on: 4.3,
            v_f: 0.79,
            r_d: 0.39,
            rows: 180,
            sampled: 0.0,
            carrier: 1.0,
            duty: vec![
                (0, first),
                (11, 0.62),
                (36, 0.84),
                (55, 0.76),
                (70, 0.88),
                (100, 0.7),
                (130, 0.84),
            ],
            load: vec![(0.0, 1.0 / 900.0, current)],
            ..Bench::default()
        };
        let mut table = bench.run().without(&["i_l", "i_out", "v_in"]);
        let rows = table.rows();
        table = table
            .with("r_load", vec![900.0; rows])
            .with("i_load", vec![current; rows]);
        let table = table.measured(&[("v_out", 0.08, 0.02)], &mut random);
        let healthy = found(&model(&bench), &table);
        assert_eq!(healthy.verdict, Verdict::Consistent, "{first}: {}", healthy.sentence);
    }
}
