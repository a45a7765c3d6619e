//! Records that are read wrongly in a way that no cause is: the fault is the verdict's word, no cause is sought, and no cause that comes near
//! is taken for it. From a circuit that shares nothing with the plant (`bench`).

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use bench::{Bench, Noise, Table, Wiring, of};
use diagnose::diagnosis::diagnose;
use diagnose::findings::{Findings, Verdict};
use plant::Parameters;

const ROWS: usize = 300;

/// A converter of 24 V and 100 kHz behind a diode.
fn small() -> Bench {
    Bench {
        v_in: 24.0,
        inductance: 47e-6,
        capacitance: 100e-6,
        f_sw: 100e3,
        dcr: 0.034,
        esr: 0.01,
        r_ds_on: 0.02,
        v_f: 0.45,
        r_d: 0.01,
        rows: ROWS,
        duty: vec![(0, 0.5)],
        load: vec![(0.0, 0.0, 2.0), (60.0, 0.0, 4.5), (130.0, 0.0, 3.0), (220.0, 0.0, 1.6)],
        ..Bench::default()
    }
}

/// Ripple as large as the mean, sampled where the current is least: its size alone says little.
fn in_the_valley() -> Bench {
    Bench {
        inductance: 12e-6,
        sampled: 0.02,
        ..small()
    }
}

fn table(bench: &Bench, random: &mut Noise) -> Table {
    let at = |n: usize| bench.load.iter().rev().find(|step| step.0 <= n as f64);
    let set = (0..bench.rows).map(|n| at(n).map_or(0.0, |step| step.2)).collect();
    let digits = ["v_out", "i_l", "i_out", "v_in"].map(|name| (name, 0.02, 2e-3));
    bench.run().with("i_load", set).measured(&digits, random)
}

fn found(model: &Parameters, table: &Table) -> Findings {
    let record = table.read("run", model).unwrap();
    diagnose(model, vec![record], &[], &|_| {}).findings
}

/// Nothing is named, and the sentence says what is wrong.
fn is_named(what: &str, findings: &Findings, words: &str) {
    println!("{what}: {}", findings.sentence);
    assert_eq!(findings.verdict, Verdict::Unexplained, "{what}");
    assert!(findings.causes.is_empty() && findings.partial.is_empty(), "{what}");
    assert!(
        findings
            .sentence
            .starts_with("The records are not read as they were made"),
        "{what}: {}",
        findings.sentence
    );
    assert!(findings.sentence.contains(words), "{what}: {}", findings.sentence);
}

#[test]
fn a_duty_of_the_other_switch_around_one_half_is_named() {
    let mut random = Noise(61);
    let bench = Bench {
        duty: vec![(0, 0.47), (100, 0.53), (190, 0.46)],
        ..small()
    };
    let mut table = table(&bench, &mut random);
    table.column("duty").iter_mut().for_each(|d| *d = 1.0 - *d);
    // the voltage falls as the duty rises: that is seen while the record is read
    let faults = table.read("run", &of(&small())).map(|_| ()).unwrap_err().to_string();
    assert!(faults.contains("1 - d"), "{faults}");
}

#[test]
fn a_current_of_another_ratio_is_named_in_the_valley_of_its_ripple() {
    let mut random = Noise(62);
    let mut model = of(&in_the_valley());
    model.pwm.sampling_phase = 0.02;
    for (times, words) in [(2.0, "showed 2 times"), (0.5, "showed 0.5 times")] {
        let mut table = table(&in_the_valley(), &mut random);
        table.column("i_l").iter_mut().for_each(|i| *i *= times);
        is_named(words, &found(&model, &table), words);
    }
}

#[test]
fn another_kind_of_converter_is_named_at_one_duty() {
    let mut random = Noise(63);
    let bench = Bench {
        wiring: Wiring::BuckBoost,
        duty: vec![(0, 0.3)],
        esr: 0.002,
        ..small()
    };
    let findings = found(&of(&small()), &table(&bench, &mut random));
    is_named("buck-boost", &findings, "looks like that of a buck-boost");
}

/// Its inductor carries more than thirty times what a buck's would: no unit is wrong.
#[test]
fn settled_points_of_a_buck_boost_near_its_largest_duty_are_named() {
    let model =
        "[converter]\nrectifier = \"synchronous\"\nv_in = 5.0\ninductance = 1e-4\ncapacitance = 4e-5\nf_sw = 3e4\n";
    let model = Parameters::from_toml("plant.toml".as_ref(), model).unwrap();
    let mut columns: [Vec<f64>; 6] = Default::default();
    for n in 0..12 {
        let (d, ohm) = ([0.93, 0.93, 0.45, 0.7][n % 4], 3.0 + 0.6 * n as f64);
        // volt-seconds: d v_in = (1 - d) v + 0.01 ohm of the inductor's v / ohm / (1 - d)
        let v = d * 5.0 / (1.0 - d + 0.01 / (ohm * (1.0 - d)));
        let noise = 1.0 + 1e-3 * ((n * 7 % 5) as f64 - 2.0);
        let row = [d, v * noise, v / ohm / (1.0 - d) / noise, v / ohm, 5.0, ohm];
        (columns.iter_mut().zip(row)).for_each(|(column, value)| column.push(value));
    }
    let names = ["duty", "v_out", "i_l", "i_out", "v_in", "r_load"];
    let table = Table(names.map(str::to_owned).into_iter().zip(columns).collect());
    is_named("settled", &found(&model, &table), "looks like that of a buck-boost");
}

/// Each stands near a fault of the bench, and is a cause: a supply by as much as 1 - 2 d, a gain on the way to a half.
#[test]
fn a_cause_that_comes_near_a_misreading_is_sought() {
    let mut random = Noise(64);
    let mut model = of(&small());
    model.converter.v_in = 22.2;
    let supply = Bench {
        duty: vec![(0, 0.48)],
        ..small()
    };
    let findings = found(&model, &table(&supply, &mut random).without(&["v_in"]));
    println!("{}", findings.sentence);
    assert_eq!(findings.causes.first().map(|cause| cause.id), Some("v_in_wrong"));
    let gain = Bench {
        gain: [1.0, 0.62, 1.0, 1.0],
        ..small()
    };
    let findings = found(&of(&small()), &table(&gain, &mut random));
    println!("{}", findings.sentence);
    assert_eq!(findings.causes.first().map(|cause| cause.id), Some("i_gain"));
}
