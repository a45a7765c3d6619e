//! A channel that stands in a record and is not compared: the verdict line says so.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use bench::{Bench, Noise, Table, model};
use diagnose::diagnosis::{Diagnosis, diagnose};
use diagnose::results;
use measured::ColumnMap;

/// A healthy record of duty steps, with `v_out` called as given.
fn table(v_out: &str) -> Table {
    let bench = Bench {
        rows: 120,
        duty: vec![(0, 0.5), (50, 0.55)],
        ..Bench::default()
    };
    let set = vec![5.0; bench.rows];
    let mut table = bench.run().without(&["i_out", "v_in"]).with("i_load", set);
    table = table.measured(&[("v_out", 0.1, 0.02), ("i_l", 0.05, 5e-3)], &mut Noise(3));
    for (name, _) in &mut table.0 {
        if name == "v_out" {
            v_out.clone_into(name);
        }
    }
    table
}

fn diagnosed(table: &Table, map: &ColumnMap) -> Diagnosis {
    let record = table.read_mapped("run", &model(), map).unwrap();
    diagnose(&model(), vec![record], &[], &|_| ())
}

fn line(found: &Diagnosis) -> String {
    let lines = results::answer(&ColumnMap::default(), &[], &found.findings);
    lines[0].lines().next().unwrap().to_owned()
}

#[test]
fn a_verdict_on_one_channel_says_which_was_not_read() {
    let found = diagnosed(&table("Vout"), &ColumnMap::default());
    assert_eq!(line(&found), "verdict: consistent in i_l alone; v_out was not read");
    let findings = &found.findings;
    assert!(findings.compared.leaves_out());
    assert!(findings.sentence.contains("--map v_out=Vout"), "{}", findings.sentence);
    let json = serde_json::to_value(findings).unwrap();
    assert_eq!(json["compared"]["channels"], serde_json::json!(["i_l"]));
    assert_eq!(json["compared"]["missing"][0]["column"], "Vout");
}

#[test]
fn a_verdict_on_all_channels_says_nothing_more() {
    let found = diagnosed(&table("v_out"), &ColumnMap::default());
    assert_eq!(line(&found), "verdict: consistent");
    let mapped = diagnosed(&table("Vout"), &ColumnMap::parse("v_out=Vout").unwrap());
    assert_eq!(line(&mapped), "verdict: consistent");
}

#[test]
fn who_says_that_a_column_is_another_signal_is_believed() {
    let map = ColumnMap::from_text(std::path::Path::new("map.toml"), "[columns]\nv_out = false\n").unwrap();
    let found = diagnosed(&table("Vout"), &map);
    assert_eq!(line(&found), "verdict: consistent in i_l alone; no record has v_out");
    assert!(!found.findings.compared.leaves_out());
}

#[test]
fn a_voltage_that_never_moves_is_not_compared() {
    let mut stuck = table("v_out");
    stuck.column("v_out").fill(100.0);
    let found = diagnosed(&stuck, &ColumnMap::default());
    assert!(
        line(&found).ends_with(" in i_l alone; v_out was not read"),
        "{}",
        line(&found)
    );
    assert!(!found.findings.compared.leaves_out());
    assert!(found.findings.sentence.contains("never moves"));
}

#[test]
fn a_record_whose_voltage_never_moves_says_nothing_about_its_noise() {
    let noise = |tables: &[Table]| {
        let read = |(n, table): (usize, &Table)| {
            table
                .read_mapped(&format!("run{n}"), &model(), &ColumnMap::default())
                .unwrap()
        };
        let records = tables.iter().enumerate().map(read).collect();
        let json = serde_json::to_value(&diagnose(&model(), records, &[], &|_| ()).findings).unwrap();
        json["noise"]["sigma"]["v_o"].as_f64().unwrap()
    };
    let (sound, mut stuck) = (table("v_out"), table("v_out"));
    stuck.column("v_out").fill(100.0);
    let alone = noise(std::slice::from_ref(&sound));
    assert!((alone / 0.1 - 1.0).abs() < 0.25, "{alone}");
    let beside = noise(&[sound, stuck]);
    // the fit of both is another one, by a little
    assert!((beside / alone - 1.0).abs() < 0.05, "{beside} for {alone}");
}
