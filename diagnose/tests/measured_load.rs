//! A load that only its own current meter knows: noise and steps of the converter that read it are no load.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use bench::{Bench, Noise, model};
use diagnose::diagnosis::{Diagnosis, diagnose};
use diagnose::drive::Model;
use diagnose::findings::Verdict;
use diagnose::problem::Problem;
use diagnose::record::Record;

/// Load current steps at any instant of a period, at a steady duty.
fn steps() -> Bench {
    Bench {
        rows: 240,
        load: vec![
            (0.0, 0.0, 5.0),
            (48.45, 0.0, 8.2),
            (96.92, 0.0, 3.4),
            (143.51, 0.0, 6.1),
            (191.18, 0.0, 4.3),
        ],
        ..Bench::default()
    }
}

/// A record of `v_out`, `i_l` and `i_out`, the last with this noise, on steps of a 12-bit converter over 20 A and 250 V.
fn record(bench: &Bench, noise: f64, seed: u64) -> Record {
    let columns = [("v_out", 0.1, 0.061), ("i_l", 0.05, 0.0049), ("i_out", noise, 0.0049)];
    let table = bench.run().measured(&columns, &mut Noise(seed)).without(&["v_in"]);
    table.read("bench", &model()).unwrap()
}

fn diagnosed(bench: &Bench, noise: f64) -> Diagnosis {
    let found = diagnose(
        &model(),
        vec![record(bench, noise, 3)],
        &[record(bench, noise, 4)],
        &|_| (),
    );
    println!("{}\n{:#?}", found.findings.sentence, found.findings.noise);
    found
}

fn leading(found: &Diagnosis, id: &str) -> f64 {
    let causes = &found.findings.causes;
    assert_eq!(causes.iter().map(|cause| cause.id).collect::<Vec<_>>(), [id]);
    causes[0].parameters.values().next().unwrap().value
}

#[test]
fn a_healthy_bench_with_a_noisy_load_current_is_consistent() {
    for noise in [0.02, 0.05, 0.1] {
        let found = diagnosed(&steps(), noise);
        assert_eq!(found.findings.verdict, Verdict::Consistent, "noise {noise} A");
        let notes = found.findings.noise.repairs.join("\n");
        assert!(
            notes.contains("i_out is taken for a load current in 5 stretches at rest"),
            "{notes}"
        );
    }
}

/// Light loads at which the current rests in each period: nothing but the load's own resistance holds the voltage, and a level that is read off
/// a noisy meter a hundredth of an ampere wrong drifts by tenths of a volt.
fn light() -> Bench {
    Bench {
        load: vec![
            (0.0, 0.0, 5.0),
            (40.45, 0.0, 0.5),
            (96.92, 0.0, 3.4),
            (143.51, 0.0, 0.3),
            (191.18, 0.0, 0.7),
        ],
        ..steps()
    }
}

#[test]
fn a_level_of_a_noisy_meter_is_uncertain_while_the_current_rests() {
    for (noise, seed) in [(0.03, 3), (0.05, 5), (0.05, 6), (0.1, 7), (0.1, 8)] {
        let found = diagnose(
            &model(),
            vec![record(&light(), noise, seed)],
            &[record(&light(), noise, seed + 10)],
            &|_| (),
        );
        println!(
            "{noise} {seed}: {:?} {}\n{:#?}",
            found.findings.verdict, found.findings.sentence, found.findings.noise
        );
        assert_eq!(
            found.findings.verdict,
            Verdict::Consistent,
            "noise {noise} A, seed {seed}"
        );
    }
}

#[test]
fn a_capacitor_that_lost_a_fifth_is_found_while_the_current_rests() {
    let bench = Bench {
        capacitance: 120e-6,
        ..light()
    };
    let found = diagnose(
        &model(),
        vec![record(&bench, 0.05, 3)],
        &[record(&bench, 0.05, 4)],
        &|_| (),
    );
    let c = leading(&found, "c_wrong");
    assert!((c / 120e-6 - 1.0).abs() < 0.02, "{c}");
}

#[test]
fn a_capacitor_that_lost_a_fifth_is_found_below_a_noisy_load_current() {
    let bench = Bench {
        capacitance: 120e-6,
        ..steps()
    };
    let c = leading(&diagnosed(&bench, 0.05), "c_wrong");
    assert!((c / 120e-6 - 1.0).abs() < 0.02, "{c}");
}

/// An electronic load takes half a period from one level to the next: rows lie in some of its slopes.
fn slopes() -> Bench {
    Bench { slope: 0.55, ..steps() }
}

#[test]
fn a_load_that_slopes_from_level_to_level_is_one_step_inside_a_period() {
    for noise in [0.02, 0.05] {
        let found = diagnosed(&slopes(), noise);
        assert_eq!(found.findings.verdict, Verdict::Consistent, "noise {noise} A");
        println!("{}", found.findings.sentence);
        let notes = found.findings.noise.repairs.join("\n");
        for wanted in [
            "a load current in 5 stretches at rest, with",
            "4 load steps are taken to lie inside a switching period",
        ] {
            assert!(notes.contains(wanted), "{wanted}: {notes}");
        }
        assert!(!notes.contains("shifted"), "{notes}");
    }
}

#[test]
fn a_capacitor_that_lost_a_fifth_is_found_below_a_load_that_slopes() {
    let bench = Bench {
        capacitance: 120e-6,
        ..slopes()
    };
    let c = leading(&diagnosed(&bench, 0.05), "c_wrong");
    assert!((c / 120e-6 - 1.0).abs() < 0.02, "{c}");
}

#[test]
fn a_duty_step_at_a_resistor_is_no_step_of_the_load() {
    let bench = Bench {
        duty: vec![(0, 0.5), (60, 0.42), (150, 0.55)],
        load: vec![(0.0, 0.05, 0.0)],
        rows: 240,
        ..Bench::default()
    };
    let found = diagnosed(&bench, 0.1);
    assert_eq!(found.findings.verdict, Verdict::Consistent);
    println!("{}", found.findings.sentence);
    let notes = found.findings.noise.repairs.join("\n");
    assert!(
        notes.contains("i_out is taken for a resistor in 1 stretch at rest"),
        "{notes}"
    );
}

#[test]
fn a_ramp_stays_a_ramp() {
    let bench = Bench {
        ramp: 0.02,
        rows: 240,
        ..Bench::default()
    };
    let record = record(&bench, 0.05, 3);
    let drawn: Vec<f64> = record.load.iter().map(|load| load.current).collect();
    let off = (0..240).map(|n| drawn[n] - 5.0 - 0.02 * (n as f64 + 0.5));
    let worst = off.fold(0.0f64, |worst, off| worst.max(off.abs()));
    // four standard errors of a line through 240 rows at its ends
    assert!(worst < 4.0 * 0.05 * 2.0 / 240f64.sqrt(), "{worst}");
    let found = diagnosed(&bench, 0.05);
    assert_eq!(found.findings.verdict, Verdict::Consistent);
}

/// A load that swings is neither levels nor lines: it is taken as it was measured, and that is said.
#[test]
fn a_load_that_swings_is_left_as_it_was_measured() {
    let table = steps().run();
    let swing: Vec<f64> = (0..240)
        .map(|n| 5.0 + 0.8 * (n as f64 * 0.31).sin() + 0.5 * (n as f64 * 0.073).sin())
        .collect();
    let mut table = table.without(&["i_out", "v_in"]).with("i_out", swing);
    table = table.measured(&[("i_out", 0.05, 0.0049), ("v_out", 0.1, 0.061)], &mut Noise(5));
    let seen = table.column("i_out").clone();
    let record = table.read("bench", &model()).unwrap();
    let drawn: Vec<f64> = record.load.iter().map(|load| load.current).collect();
    assert!(drawn.iter().zip(&seen).all(|(a, b)| (a - b).abs() < 1e-4));
    assert!(
        record.repairs.iter().any(|note| note.contains("as it was measured")),
        "{:?}",
        record.repairs
    );
}

/// A column of the load that is two rows late: the instants are sought as far as they may go, and that they end there is said.
#[test]
fn instants_that_end_at_their_limit_are_said() {
    let bench = steps();
    let late: Vec<f64> = (0..bench.rows)
        .map(|row| {
            let at = row as f64 - 2.0;
            bench
                .load
                .iter()
                .rev()
                .find(|step| step.0 <= at + 1.0)
                .unwrap_or(&bench.load[0])
                .2
        })
        .collect();
    let columns = [("v_out", 0.1, 0.061), ("i_l", 0.05, 0.0049)];
    let table = bench.run().without(&["i_out", "v_in"]).with("i_load", late);
    let record = table.measured(&columns, &mut Noise(3)).read("bench", &model()).unwrap();
    let found = diagnose(&model(), vec![record], &[], &|_| ());
    println!("{}", found.findings.sentence);
    let notes = found.findings.noise.repairs.join("\n");
    assert!(
        notes.contains("end at the limit of one period"),
        "{}\n{notes}",
        found.findings.sentence
    );
}

/// A table of a simulation without noise, sampled where the period starts: its load current has no levels and changes in every row.
/// None of these changes is a step at a sample, and the voltage counts.
#[test]
fn a_load_that_changes_in_every_row_leaves_the_voltage_compared() {
    let conductances = [(0.0, 0.05, 0.0), (80.0, 0.09, 0.0), (160.0, 0.04, 0.0)];
    let bench = Bench {
        load: conductances.to_vec(),
        duty: (0..24)
            .map(|n| (10 * n, 0.5 + 0.02 * f64::from(n as u32 % 3)))
            .collect(),
        ..steps()
    };
    let mut table = bench.run().without(&["v_in"]);
    // what no level and no conductance gives: the meter's own lag
    let meter = table.column("i_out");
    for n in 1..meter.len() {
        meter[n] = 0.7 * meter[n] + 0.3 * meter[n - 1];
    }
    let record = table.read("bench", &model()).unwrap();
    for phase in [0.0, 0.5] {
        let record = Record {
            phase,
            ..record.clone()
        };
        let changed = record.load.windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert!(2 * changed > record.rows(), "{changed} changes: the case is none");
        let problem = Problem::new(vec![record], Model::new(&model()));
        let masked = problem.masked[0][0].iter().filter(|row| **row).count();
        assert!(
            2 * masked < problem.records[0].rows(),
            "{masked} rows of v_out at phase {phase}"
        );
    }
}
