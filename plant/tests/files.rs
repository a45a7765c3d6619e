//! `plant.toml`: the presets read as documented, and every fault is named with its place.

#![allow(clippy::unwrap_used)] // helpers of tests stand outside of #[test] functions

use std::path::Path;

use plant::{Faults, Parameters, Plant};

const CIRCUIT: &str = "[converter]\nv_in = 200\ninductance = 2e-3\ncapacitance = 150e-6\nf_sw = 10e3\n";

fn read(text: &str) -> Result<Parameters, Faults> {
    Parameters::from_toml(Path::new("plant.toml"), text)
}

fn message(text: &str) -> String {
    read(text).unwrap_err().to_string()
}

#[test]
fn presets_are_the_papers_circuits() {
    let preset = |name: &str| Parameters::from_file(&Path::new("../examples/plants").join(name)).unwrap();
    assert_eq!(preset("paper-table.toml"), Parameters::paper_table());
    assert_eq!(preset("paper-model.toml"), Parameters::paper_model());
    let sb3 = preset("sb3-buck12.toml");
    assert_eq!((sb3.switch.r_ds_on, sb3.switch.v_f, sb3.load.v_fold), (0.1, 0.8, 20.0));
    assert!(Plant::new(&sb3).is_ok());
}

#[test]
fn all_faults_come_at_once_with_place_and_hint() {
    let text = format!(
        "{CIRCUIT}[capacitor]\nesr = \"30 mohm\"\nesrr = 1\n[inductor]\nesl = 1e-9\n[pwm]\ncarrier = \"center\"\n"
    );
    let message = message(&text);
    for part in [
        "plant.toml:7:7",
        "the text \"30 mohm\"",
        "no unit and no quotes",
        "plant.toml:8:1",
        "did you mean `esr`?",
        "plant.toml:10:1",
        "did you mean `capacitor.esl`?",
        "plant.toml:12:11",
        "trailing, leading, centre",
        "did you mean \"centre\"?",
    ] {
        assert!(message.contains(part), "{part} in\n{message}");
    }
}

#[test]
fn ranges_and_partners_are_checked() {
    let out = message(&format!("{CIRCUIT}[switch]\ndead_time = 2\n"));
    assert!(out.contains("plant.toml:7:13") && out.contains("0 to 0.001 s"), "{out}");
    let alone = message(&format!("{CIRCUIT}[cable]\ninductance = 1e-6\n"));
    assert!(
        alone.contains("plant.toml:7:14") && alone.contains("cable.capacitance"),
        "{alone}"
    );
    let beyond = message(&format!("{CIRCUIT}[sensors.v_out]\ndelay = 0.01\n"));
    assert!(beyond.contains("8 periods"), "{beyond}");
}

#[test]
fn a_circuit_without_values_is_refused() {
    let out = message("[converter]\nv_in = 12\n");
    assert!(
        out.contains("`converter.f_sw` is missing") && out.contains("`converter.inductance` is missing"),
        "{out}"
    );
}

#[test]
fn broken_toml_is_one_fault_with_a_line() {
    let out = message("[converter\nv_in = 12\n");
    assert!(out.contains("plant.toml:1:"), "{out}");
}

#[test]
fn a_missing_file_is_named() {
    let out = Parameters::from_file(Path::new("no/such.toml"))
        .unwrap_err()
        .to_string();
    assert!(out.contains("no/such.toml"), "{out}");
}

#[test]
fn not_a_number_is_refused() {
    let mut p = Parameters::paper_table();
    p.capacitor.esr = f64::NAN;
    assert!(Plant::new(&p).unwrap_err().to_string().contains("capacitor.esr"));
    assert!(message(&format!("{CIRCUIT}[capacitor]\nesr = inf\n")).contains("finite"));
}

#[test]
fn every_key_is_documented() {
    let page = include_str!("../../docs/reference/plant-file.md");
    for parameter in plant::parameters() {
        let key = ["v_out", "i_l", "i_out", "v_in"]
            .iter()
            .fold(parameter.key.to_owned(), |key, channel| {
                key.replace(&format!("sensors.{channel}."), "sensors.*.")
            });
        assert!(
            page.contains(&format!("`{key}`")),
            "{key} is missing in docs/reference/plant-file.md"
        );
    }
}
