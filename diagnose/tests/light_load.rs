//! Converters whose inductor current rests, or nearly, at the instants of its samples: a light load behind a diode, as on every bench. From a
//! circuit that shares nothing with the plant (`bench`).

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use bench::{Bench, Noise, Table, Wiring, at, integrate, of};
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

const CORE: &str = "[converter]\nv_in = 48.0\ninductance = 47e-6\ncapacitance = 100e-6\nf_sw = 100e3\n\
                    [inductor]\ndcr = 0.05\n[capacitor]\nesr = 0.02\n[switch]\nr_ds_on = 0.04\nv_f = 0.6\nr_d = 0.02\n\
                    [pwm]\nsampling_phase = 0.2\n";

/// A conductance across the inductance of a buck that rests in each period: what it draws flows through the leg beside the inductor's
/// current, and the diode ends both. `(row, duty, ohm)` from rows on.
fn lossy(core: f64, course: &[(usize, f64, f64)], seed: u64) -> Table {
    const H: f64 = 10e-6;
    // current of the leg, and voltage across the inductance
    let leg = |x: [f64; 2], is_on: bool, ohm: f64| {
        let (source, r) = if is_on { (48.0, 0.09) } else { (-0.6, 0.07) };
        // out = (v + esr i) / (1 + esr / ohm), i = x + core across, across = source - r i - out
        let share = 1.0 / (1.0 + 0.02 / ohm);
        let across = (source - share * x[1] - (r + share * 0.02) * x[0]) / (1.0 + core * (r + share * 0.02));
        [x[0] + core * across, across]
    };
    let out = |x: [f64; 2], i: f64, ohm: f64| (x[1] + 0.02 * i) / (1.0 + 0.02 / ohm);
    let (mut x, mut random) = ([0.0, 24.0], Noise(seed));
    let mut table = Table::of(&["t", "duty", "v_out", "i_l", "r_load"]);
    for row in -3000..260isize {
        let (_, duty, ohm) = *at(course, row, |step| step.0);
        // sampled while the switch is on
        for (is_on, share, shows) in [(true, 0.2, true), (true, duty - 0.2, false), (false, 1.0 - duty, false)] {
            let mut rests = false;
            for _ in 0..120 {
                integrate(&mut x, share * H / 120.0, 1, |x| {
                    let [i, across] = if rests { [0.0; 2] } else { leg(x, is_on, ohm) };
                    [across / 47e-6, (i - out(x, i, ohm) / ohm) / 100e-6]
                });
                if !is_on && leg(x, is_on, ohm)[0] <= 0.0 {
                    (rests, x[0]) = (true, 0.0);
                }
            }
            if shows && row >= 0 {
                let i = leg(x, is_on, ohm)[0];
                table.push(&[
                    (row as f64 + 0.2) * H,
                    duty,
                    out(x, i, ohm) + 5e-3 * random.normal(),
                    i + 5e-3 * random.normal(),
                    ohm,
                ]);
            }
        }
    }
    table
}

/// 20 V and 28 V across 0.75 millisiemens, for half of a period together, are 0.22 W of 9 W.
#[test]
fn a_core_s_loss_is_among_what_is_named_where_the_current_rests() {
    let model = Parameters::from_toml("plant.toml".as_ref(), CORE).unwrap();
    let courses: [&[(usize, f64, f64)]; 2] = [
        &[(0, 0.3, 70.0), (90, 0.3, 110.0), (180, 0.3, 55.0)],
        &[(0, 0.28, 80.0), (70, 0.34, 80.0), (140, 0.26, 80.0), (200, 0.31, 80.0)],
    ];
    let of = |core: f64| {
        let tables = [0, 1].map(|n| lossy(core, courses[n], 81 + n as u64));
        let records = tables.iter().zip(["load", "duty"]);
        let records = records.map(|(table, name)| table.read(name, &model).unwrap());
        let findings = diagnose(&model, records.collect(), &[], &|_| ()).findings;
        println!("{:?}: {}", findings.verdict, findings.sentence);
        findings
    };
    let healthy = of(0.0);
    assert_eq!(healthy.verdict, Verdict::Consistent, "{}", healthy.sentence);
    let findings = of(7.5e-4);
    let names = findings
        .causes
        .iter()
        .flat_map(|cause| cause.rivals.iter().flatten().copied().chain([cause.id]));
    assert!(names.into_iter().any(|id| id == "core_loss"), "{}", findings.sentence);
}

/// An output that a resistor of 435 ohm empties within hundreds of rows stays where a wrong probe had it begin, so that the first look at the record
/// does not show the probe.
#[test]
fn a_probe_of_twice_the_ratio_is_told_at_an_output_that_hardly_moves() {
    let bench = Bench {
        v_in: 200.0,
        inductance: 86e-6,
        capacitance: 3.8e-6,
        f_sw: 237e3,
        dcr: 1.2,
        r_ds_on: 2.3,
        v_f: 1.1,
        rows: 120,
        duty: vec![(0, 0.57), (11, 0.5), (49, 0.79), (101, 0.63)],
        load: vec![
            (0.0, 1.0 / 435.0, 0.64),
            (11.0, 1.0 / 435.0, 0.05),
            (49.0, 1.0 / 435.0, 0.77),
        ],
        gain: [2.0, 1.0, 1.0, 1.0],
        ..Bench::default()
    };
    let model = model(&bench);
    let mut random = Noise(77);
    let drawn = |row: usize| at(&bench.load, row as isize, |step| step.0 as usize).2;
    let table = (bench.run().without(&["i_l", "i_out"]))
        .with("r_load", vec![435.0; bench.rows])
        .with("i_load", (0..bench.rows).map(drawn).collect())
        .measured(&[("v_out", 0.1, 0.046), ("v_in", 0.1, 0.07)], &mut random);
    let found = found(&model, &table);
    assert!(found.sentence.contains("2 times what there is"), "{}", found.sentence);
}
