//! A load current whose meter has less noise than a digit: nearly all rows lie on a level, the others a digit beside.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use std::path::Path;

use bench::{Bench, Noise, Table, of};
use diagnose::diagnosis::{Diagnosis, diagnose};
use diagnose::drive::Model;
use diagnose::findings::Verdict;
use diagnose::gain::Regime;
use diagnose::problem::Problem;
use diagnose::record::Record;
use measured::{ColumnMap, Sheet};
use plant::{Parameters, Rectifier};

/// A synchronous leg, whose current stays above 0, sampled where its period starts, under load steps just before such instants.
fn stepped(capacitance: f64) -> Bench {
    Bench {
        rows: 320,
        sampled: 0.0,
        carrier: 0.0,
        capacitance,
        v_f: 0.0,
        r_d: 0.04,
        load: vec![
            (0.0, 0.0, 8.0),
            (60.92, 0.0, 10.5),
            (127.95, 0.0, 9.0),
            (189.97, 0.0, 12.0),
            (259.94, 0.0, 8.0),
        ],
        ..Bench::default()
    }
}

fn model() -> Parameters {
    let mut model = of(&stepped(150e-6));
    model.converter.rectifier = Rectifier::Synchronous;
    (model.switch.r_ds_on_low, model.switch.r_d, model.switch.v_f) = (0.04, 0.0, 0.0);
    (model.pwm.sampling_phase, model.pwm.carrier) = (0.0, plant::Carrier::Trailing);
    model
}

/// The meter of the load shows `digit`, with noise of `noise` digits; the others are finer.
fn table(bench: &Bench, noise: f64, digit: f64, seed: u64) -> Table {
    let columns = [
        ("v_out", 0.05, 0.01),
        ("i_l", 0.02, 0.005),
        ("i_out", noise * digit, digit),
    ];
    bench.run().measured(&columns, &mut Noise(seed)).without(&["v_in"])
}

fn diagnosed(train: &Table, held: &Table) -> Diagnosis {
    let read = |table: &Table, name: &str| table.read(name, &model()).unwrap();
    let found = diagnose(&model(), vec![read(train, "fitted")], &[read(held, "held")], &|_| ());
    println!("{}\n{:#?}", found.findings.sentence, found.findings.noise);
    found
}

#[test]
fn levels_are_found_below_a_digit_of_noise_and_nothing_is_left_out_but_their_steps() {
    for (noise, digit, seed) in [(0.4, 0.02, 11), (0.35, 0.05, 12), (0.45, 0.01, 13)] {
        let record = table(&stepped(150e-6), noise, digit, seed)
            .read("bench", &model())
            .unwrap();
        let levels = record.load.windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert!((4..=8).contains(&levels), "{levels} steps, {:?}", record.repairs);
        let seen = record.metered.unwrap();
        assert!((0.3..0.7).contains(&(seen / digit)), "{seen} of digits of {digit}");
        let problem = Problem::new(vec![record], Model::new(&model()));
        let left = problem.masked[0][0].iter().filter(|masked| **masked).count();
        assert!(left <= 12, "{left} rows of v_out");
    }
}

#[test]
fn a_capacitor_that_lost_a_third_is_found_below_a_coarse_meter() {
    let bench = stepped(100e-6);
    let found = diagnosed(&table(&bench, 0.4, 0.02, 21), &table(&bench, 0.4, 0.02, 22));
    let causes = &found.findings.causes;
    // the digit is one of the bench that the model has not, and is named as such
    let ids: Vec<&str> = causes.iter().map(|cause| cause.id).collect();
    assert_eq!(ids, ["c_wrong", "adc_quantisation"]);
    let c = causes[0].parameters["capacitance"].value;
    assert!((c / 100e-6 - 1.0).abs() < 0.02, "{c}");
    let notes = found.findings.noise.repairs.join("\n");
    for wanted in [
        "i_out is taken for a load current in 5 stretches at rest",
        "fitted: ",
        "rows of v_o",
        "are left out",
    ] {
        assert!(notes.contains(wanted), "{wanted}: {notes}");
    }
    // what the circuit has not is not hidden in it, and nothing is said twice
    let hidden: Vec<_> = found
        .findings
        .not_detectable
        .iter()
        .map(|one| (one.id, one.parameter))
        .collect();
    assert!(hidden.iter().all(|(id, _)| *id != "diode"), "{hidden:?}");
    assert!(
        hidden.iter().enumerate().all(|(n, one)| !hidden[..n].contains(one)),
        "{hidden:?}"
    );
}

/// Of a meter that shows the set value in four rows of five the errors of all rows are counted, not those of the fifth alone.
#[test]
fn a_meter_that_is_right_to_its_digit_counts_in_every_row() {
    let bench = stepped(150e-6);
    let set: Vec<f64> = (0..bench.rows)
        .map(|row| {
            bench
                .load
                .iter()
                .rev()
                .find(|step| step.0 <= row as f64 + 1e-9)
                .unwrap()
                .2
        })
        .collect();
    let whole = |seed| table(&bench, 0.4, 0.02, seed).with("i_load", set.clone());
    let mut held = whole(32);
    let off: Vec<f64> = held.column("i_out").iter().zip(&set).map(|(i, set)| i - set).collect();
    let found = diagnosed(&whole(31), &held);
    assert_eq!(found.findings.verdict, Verdict::Consistent);
    let gain = &found.findings.gain.heldout;
    let one = gain
        .iter()
        .find(|one| one.channel == "i_o" && one.regime == Regime::All)
        .unwrap();
    assert!(one.rows > bench.rows - 40, "{} rows", one.rows);
    let rms = (off.iter().map(|e| e * e).sum::<f64>() / off.len() as f64).sqrt();
    assert!((one.rmse_after / rms - 1.0).abs() < 0.1, "{} of {rms}", one.rmse_after);
    assert!((one.floor / rms - 1.0).abs() < 0.3, "{} of {rms}", one.floor);
}

#[test]
fn names_without_a_map_are_one_fault_that_is_alike_in_all_files() {
    let text = |seed| {
        let text = table(&stepped(150e-6), 0.4, 0.02, seed).text();
        text.replacen("v_out,i_l,i_out", "Vout,IL,Iload", 1)
    };
    let fault = |file: &str, seed| {
        let sheet = Sheet::parse(Path::new(file), text(seed).into(), &Record::file_options()).unwrap();
        let faults = Record::read(&sheet, &ColumnMap::default(), &model()).unwrap_err();
        assert_eq!(faults.list.len(), 1, "{faults}");
        faults.list[0].clone()
    };
    let (one, other) = (fault("one.csv", 1), fault("other.csv", 2));
    assert!(one.problem.contains("no map"), "{}", one.problem);
    assert_eq!(
        (&one.problem, &one.hint, &one.found),
        (&other.problem, &other.hint, &other.found)
    );
    let hint = one.hint.unwrap();
    assert!(hint.ends_with("--map v_out=Vout,i_l=IL,i_out=Iload"), "{hint}");
}

/// The source stands still between two digits, and rounding shifts the mean of what its meter shows by the same in every row.
#[test]
fn a_source_whose_meter_flickers_is_as_the_plant_file_has_it() {
    for (digit, noise, seed) in [(0.7, 0.26, 31), (0.9, 0.22, 32), (0.47, 0.24, 33)] {
        let bench = Bench {
            rows: 900,
            ..stepped(150e-6)
        };
        let set = |row: usize| bench.load.iter().rev().find(|step| step.0 <= row as f64).unwrap().2;
        let loads = (0..900).map(set).collect();
        let columns = [
            ("v_out", 0.05, 0.01),
            ("i_l", 0.02, 0.005),
            ("i_out", 0.02, 0.005),
            ("v_in", noise * digit, digit),
        ];
        let table = bench.run().with("i_load", loads).measured(&columns, &mut Noise(seed));
        let record = table.read("bench", &model()).unwrap();
        // no row of it is at the end of a range
        assert!(record.measured[3].iter().all(|v| v.is_finite()), "{:?}", record.repairs);
        let found = diagnose(&model(), vec![record], &[], &|_| ());
        println!("{}\n{:?}", found.findings.sentence, found.findings.noise);
        assert_eq!(
            found.findings.verdict,
            Verdict::Consistent,
            "{}",
            found.findings.sentence
        );
    }
}
