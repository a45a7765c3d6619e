//! What imitates a cause and is none, and a cause that imitates another: whole rows, a few levels of the duty, permuted rows. From a circuit that shares nothing with the plant (`bench`).

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use bench::{Bench, Noise, Table, of};
use diagnose::diagnosis::diagnose;
use diagnose::findings::{Findings, Verdict};
use diagnose::record::Record;
use plant::{Carrier, Parameters};

/// A buck of 36 V and 400 kHz, sampled where the switch turns on.
fn small() -> Bench {
    Bench {
        v_in: 36.0,
        inductance: 15e-6,
        capacitance: 47e-6,
        f_sw: 400e3,
        dcr: 0.035,
        esr: 0.012,
        r_ds_on: 0.04,
        v_f: 0.42,
        r_d: 0.015,
        rows: 300,
        sampled: 0.0,
        carrier: 0.0,
        duty: vec![(0, 0.22), (60, 0.3), (130, 0.18), (190, 0.26), (250, 0.21)],
        load: vec![(0.0, 0.0, 2.5)],
        ..Bench::default()
    }
}

fn model() -> Parameters {
    let mut p = of(&small());
    (p.pwm.sampling_phase, p.pwm.carrier) = (0.0, Carrier::Trailing);
    p
}

/// Loads of the first record stand still, of the second they step.
fn stepped(bench: &Bench) -> Bench {
    Bench {
        duty: vec![(0, 0.24)],
        load: vec![(0.0, 0.0, 2.5), (70.0, 0.0, 3.1), (150.0, 0.0, 2.2), (230.0, 0.0, 2.8)],
        ..bench.clone()
    }
}

fn table(bench: &Bench, random: &mut Noise) -> Table {
    let at = |n: usize| bench.load.iter().rev().find(|step| step.0 <= n as f64);
    let set = (0..bench.rows).map(|n| at(n).map_or(0.0, |step| step.2)).collect();
    let digits = [("v_out", 5e-3, 1e-3), ("i_l", 0.015, 1e-3)];
    bench
        .run()
        .without(&["i_out", "v_in"])
        .with("i_load", set)
        .measured(&digits, random)
}

fn found(records: Vec<Record>) -> Findings {
    diagnose(&model(), records, &[], &|_| {}).findings
}

/// Rows by which what was measured stands too late in the file.
fn late(mut table: Table, rows: usize) -> Table {
    for name in ["v_out", "i_l"] {
        let old = table.column(name).clone();
        *table.column(name) = (0..old.len()).map(|row| old[row.saturating_sub(rows)]).collect();
    }
    table
}

/// A delay of the duty and a sampling instant do together what a buffer does, but for the load, whose instants then seem to be off.
#[test]
fn columns_two_and_three_rows_late_are_no_pair_of_causes() {
    let mut random = Noise(81);
    for rows in [2, 3] {
        let records = [small(), stepped(&small())].map(|bench| late(table(&bench, &mut random), rows));
        let records = records
            .iter()
            .map(|table| table.read("run", &model()).unwrap())
            .collect();
        let findings = found(records);
        let ids: Vec<&str> = findings.causes.iter().map(|cause| cause.id).collect();
        // one instrument that is late by as much is a cause of the list
        assert!(
            ids.is_empty() || ids == ["sensor_delay"],
            "{rows}: {}",
            findings.sentence
        );
        let words = format!("shifted by {rows} rows");
        assert!(
            findings.sentence.contains(&words) || !ids.is_empty(),
            "{}",
            findings.sentence
        );
    }
}

/// Five levels of the duty: a counter rounds them nearly as one likes.
#[test]
fn a_diode_at_five_duties_is_no_step_of_the_duty() {
    let mut random = Noise(82);
    for v_f in [0.55, 0.8] {
        let table = table(&Bench { v_f, ..small() }, &mut random);
        let findings = found(vec![table.read("run", &model()).unwrap()]);
        let named = findings.causes.iter().flat_map(|cause| {
            let rivals = cause.rivals.iter().flatten().copied();
            [cause.id].into_iter().chain(rivals)
        });
        let named: Vec<&str> = named.collect();
        assert!(!named.contains(&"duty_quantisation"), "{v_f}: {}", findings.sentence);
        assert_ne!(findings.verdict, Verdict::Unexplained, "{v_f}: {}", findings.sentence);
    }
}

/// A term would describe the disorder, and spoil the model.
#[test]
fn no_term_is_fitted_to_rows_in_disorder() {
    let mut random = Noise(83);
    let mut table = table(&small(), &mut random);
    let order: Vec<usize> = (0..table.rows()).map(|_| random.below(300)).collect();
    for name in ["v_out", "i_l"] {
        let old = table.column(name).clone();
        *table.column(name) = order.iter().map(|row| old[*row]).collect();
    }
    let findings = found(vec![table.read("run", &model()).unwrap()]);
    assert_eq!(findings.verdict, Verdict::Unexplained, "{}", findings.sentence);
    assert!(findings.empirical.is_none(), "{:?}", findings.empirical);
}
