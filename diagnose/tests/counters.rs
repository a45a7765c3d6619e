//! A modulator of few counts, seen in records over time: the duty that acts is the nearest count to the one that was commanded.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use bench::{Bench, Noise, Table, model};
use diagnose::diagnosis::diagnose;
use diagnose::findings::{Findings, Verdict};

/// The bench carries out the nearest count, and its table holds what was commanded.
fn commanded(duty: &[(usize, f64)], rows: usize, counts: f64, seed: u64) -> Table {
    // at the start of a period, as the table says
    let load = vec![(0.0, 0.0, 5.0), ((3 * rows / 5) as f64, 0.0, 7.0)];
    let applied = duty.iter().map(|(row, d)| (*row, (d * counts).round() / counts));
    let bench = Bench {
        rows,
        duty: applied.collect(),
        load: load.clone(),
        ..Bench::default()
    };
    let of = |row: usize| duty.iter().rev().find(|step| step.0 <= row).map_or(0.0, |step| step.1);
    let set = |row: usize| {
        let step = load.iter().rev().find(|step| step.0 <= row as f64);
        step.map_or(0.0, |step| step.2)
    };
    let mut table = bench.run().without(&["i_out", "v_in"]);
    *table.column("duty") = (0..rows).map(of).collect();
    let table = table.with("i_load", (0..rows).map(set).collect());
    let digits = [("v_out", 0.1, 0.061), ("i_l", 0.05, 0.0049)];
    table.measured(&digits, &mut Noise(seed))
}

fn found(tables: &[Table]) -> Findings {
    let records = tables.iter().zip(["first", "second"]);
    let records = records.map(|(table, name)| table.read(name, &model()).unwrap());
    let findings = diagnose(&model(), records.collect(), &[], &|_| ()).findings;
    println!("{:?}: {}", findings.verdict, findings.sentence);
    findings
}

/// Levels of duty, each at most a tenth beside the one before: the filter swings over by as much again, and an output above the source would
/// feed it back through a switch that the bench has not.
fn levels(count: usize, length: usize, random: &mut Noise) -> Vec<(usize, f64)> {
    let mut last = 0.7;
    (0..count)
        .map(|n| {
            let level = random.between(f64::max(0.56, last - 0.1), f64::min(0.86, last + 0.1));
            last = (level * 1e4).round() / 1e4;
            (n * length, last)
        })
        .collect()
}

#[test]
fn a_step_of_no_whole_number_of_counts_is_found_among_a_dozen_levels() {
    for (count, seed) in [(12, 24), (13, 25), (14, 26)] {
        let length = 252 / count;
        let course = levels(count, length, &mut Noise(seed));
        let mut record = commanded(&course, count * length, 105.35, seed);
        let highest = record.column("v_out").iter().copied().fold(0.0, f64::max);
        assert!(highest < Bench::default().v_in, "{highest}");
        let findings = found(&[record]);
        let ids: Vec<&str> = findings.causes.iter().map(|cause| cause.id).collect();
        assert_eq!(
            (findings.verdict, &ids[..]),
            (Verdict::Explained, &["duty_quantisation"][..]),
            "{count}: {}",
            findings.sentence
        );
        let step = findings.causes[0].parameters["duty_lsb"].value;
        assert!((step * 105.35 - 1.0).abs() < 1e-3, "{count}: {step}");
    }
}

/// The filter rings over 34 rows and never comes to rest between two steps.
#[test]
fn a_step_is_found_in_a_duty_that_goes_to_and_fro() {
    let rhythm = |low: f64, high: f64| {
        let levels = (0..40).map(|n| (5 * n, if n % 2 == 0 { low } else { high }));
        levels.collect::<Vec<(usize, f64)>>()
    };
    // 26.15 and 24.58 counts, 29.29 and 31.90
    let runs = [rhythm(0.5, 0.47), rhythm(0.56, 0.61)];
    let [first, second] = &runs;
    let findings = found(&[commanded(first, 200, 52.3, 31), commanded(second, 200, 52.3, 32)]);
    let mut ids = findings.causes.iter().map(|cause| cause.id);
    assert!(ids.any(|id| id == "duty_quantisation"), "{}", findings.sentence);
}
