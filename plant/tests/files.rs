//! `plant.toml`: the presets read as documented, and every fault is named with its place.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // helpers of tests stand outside of #[test] functions

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
fn a_table_of_a_part_is_told_where_its_numbers_stand() {
    for (table, keys) in [
        ("[diode]\nv_f = 0.8\n", "`switch.v_f` and `switch.r_d`"),
        ("[MOSFET]\nr_on = 0.1\n", "`switch.r_ds_on`"),
    ] {
        let message = message(&format!("{CIRCUIT}{table}"));
        assert!(message.contains("plant.toml:6:") && message.contains(keys), "{message}");
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
fn a_time_constant_that_cannot_be_simulated_is_refused() {
    let fast = message(&format!("{CIRCUIT}[load]\ncpl_time_constant = 10e-60\n"));
    assert!(
        fast.contains("plant.toml:7:21") && fast.contains("at most 1e6"),
        "{fast}"
    );
    let circuit = message("[converter]\nv_in = 12\ninductance = 1e-9\ncapacitance = 1e-9\nf_sw = 1\n");
    assert!(
        circuit.contains("plant.toml:3:14") && circuit.contains("too short"),
        "{circuit}"
    );
    // a sensor may be as fast as it likes: its low-pass asks for no steps of the circuit
    assert!(read(&format!("{CIRCUIT}[sensors.v_out]\nlow_pass = 10e-60\n")).is_ok());
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

/// As the page writes a number: short, and powers of ten where digits would have to be counted.
fn written(number: f64) -> String {
    match number.abs() {
        0.0 => "0".to_owned(),
        size if (0.01..1e4).contains(&size) => format!("{number}"),
        _ => format!("{number:e}"),
    }
}

fn range((low, high): (f64, f64)) -> String {
    format!("{} .. {}", written(low), written(high))
}

/// What holds where the key is left out, as a file would write it.
fn default(parameter: &plant::Parameter) -> String {
    let (low, high) = parameter.allowed;
    match parameter.choices().first() {
        Some(word) => (*word).to_owned(),
        // where a file must say it, the neutral value of a catalogue is none that a plant takes
        None if NEEDED.contains(&parameter.key) => "must be given".to_owned(),
        None if (low..=high).contains(&parameter.neutral) => written(parameter.neutral),
        None => "with the effect".to_owned(),
    }
}

/// The four numbers that every file gives.
const NEEDED: [&str; 4] = [
    "converter.v_in",
    "converter.inductance",
    "converter.capacitance",
    "converter.f_sw",
];

/// The table of keys as the page has to show it; numbers that all sensors have stand once.
fn table() -> Vec<String> {
    let mut lines = Vec::new();
    for effect in plant::effects() {
        let (mut name, mut needs) = (effect.name, effect.needs.word());
        for parameter in effect.parameters {
            let parts: Vec<_> = parameter.key.split('.').collect();
            let (key, unit) = match parts[..] {
                ["sensors", "v_out", number] if parameter.unit == "V" => (format!("sensors.*.{number}"), "V, A"),
                ["sensors", "v_out", number] => (format!("sensors.*.{number}"), parameter.unit),
                ["sensors", _, _] => continue,
                _ => (parameter.key.to_owned(), parameter.unit),
            };
            let (allowed, typical) = match parameter.choices() {
                [] if parameter.key == "sensors.seed" => ("any".to_owned(), range(parameter.typical)),
                [] => (range(parameter.allowed), range(parameter.typical)),
                words => (words.join(", "), String::new()),
            };
            lines.push(format!(
                "| {name} | {needs} | `{key}` | {unit} | {} | {allowed} | {typical} | {} |",
                default(parameter),
                parameter.meaning
            ));
            (name, needs) = ("", "");
        }
    }
    lines
}

/// Compares, and with `POLICYC_BLESS=1` writes.
#[test]
fn the_pages_table_is_that_of_the_catalogue() {
    const PAGE: &str = "../docs/reference/plant-file.md";
    const HEAD: &str =
        "| effect | needs | key | unit | default | allowed | typical | meaning |\n|---|---|---|---|---|---|---|---|\n";
    let page = std::fs::read_to_string(PAGE).unwrap();
    let start = page.find(HEAD).expect("the table's head") + HEAD.len();
    let end = start + page[start..].find("\n\n").unwrap();
    let table = table().join("\n");
    if std::env::var_os("POLICYC_BLESS").is_some() {
        std::fs::write(PAGE, [&page[..start], &table, &page[end..]].concat()).unwrap();
        return;
    }
    for (found, expected) in page[start..end].lines().zip(table.lines()) {
        assert_eq!(found, expected);
    }
    assert_eq!(&page[start..end], table, "POLICYC_BLESS=1 writes the table");
}
