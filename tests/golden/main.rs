//! Golden files. Every folder of `cases/` is a policy with the code it yields in `expected/`; files are compared byte by
//! byte, `POLICYC_BLESS=1` rewrites them. So that no expected file is one that nobody has checked, the modules below
//! build each of them with every compiler and dialect that is promised.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod c;
mod copies;
mod determinism;
mod rust;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use codegen::Output;
use policy::{Activation, Policy};
use targets::TargetSpec;
use tests::fixture::{Recipe, generate};
use tests::tools::{bless, listing};

/// A policy and the code that it yields today.
struct Case {
    name: String,
    folder: PathBuf,
    policy: Policy,
    files: BTreeMap<String, String>,
}

fn host() -> &'static TargetSpec {
    targets::find("host").unwrap()
}

fn case_folders() -> Vec<PathBuf> {
    let entries = std::fs::read_dir(tests::root().join("tests/golden/cases")).unwrap();
    let mut folders: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    folders.sort();
    folders
}

fn case(folder: &Path) -> Case {
    let policy = policy::load_with(&folder.join("policy.toml"), &tests::random::several::options());
    let policy = policy.unwrap_or_else(|faults| panic!("{faults}"));
    Case {
        name: folder.file_name().unwrap().to_string_lossy().into_owned(),
        folder: folder.to_owned(),
        files: generate(&policy, host(), &Output::CORES).unwrap(),
        policy,
    }
}

/// The folders of `cases/` and the example of the README.
fn cases() -> &'static [Case] {
    static CASES: OnceLock<Vec<Case>> = OnceLock::new();
    CASES.get_or_init(|| {
        make_networks();
        let example = tests::root().join("examples/buck12");
        case_folders()
            .iter()
            .chain([&example])
            .map(|folder| case(folder))
            .collect()
    })
}

/// With `POLICYC_BLESS=1`, draws the networks anew before anything reads them.
fn make_networks() {
    for folder in case_folders().iter().filter(|_| bless()) {
        let contract = std::fs::read_to_string(folder.join("policy.toml")).unwrap();
        if let Some(recipe) = Recipe::of(&contract) {
            std::fs::write(folder.join("weights.safetensors"), recipe.network().unwrap()).unwrap();
        }
    }
}

/// Compares a folder with files, or rewrites it; the first difference of each file as one line.
fn differences(folder: &Path, files: &BTreeMap<String, String>) -> Vec<String> {
    if bless() {
        if folder.exists() {
            std::fs::remove_dir_all(folder).unwrap();
        }
        std::fs::create_dir_all(folder).unwrap();
        for (name, text) in files {
            std::fs::write(folder.join(name), text).unwrap();
        }
    }
    let names = if folder.exists() { listing(folder) } else { Vec::new() };
    let read = |name: String| (std::fs::read_to_string(folder.join(&name)).unwrap(), name);
    let expected: BTreeMap<String, String> = names.into_iter().map(read).map(|(text, name)| (name, text)).collect();
    let drift = verify::drift::compare(&expected, files);
    let shown = folder.display();
    let missing = drift
        .missing
        .iter()
        .map(|name| format!("{shown}/{name}: is not generated any more"));
    let extra = drift.extra.iter().map(|name| format!("{shown}/{name}: is missing"));
    let changed = drift.changed.iter().map(|change| {
        let line = |text: &Option<String>| text.clone().unwrap_or_else(|| "(end of file)".to_owned());
        let (expected, found) = (line(&change.expected), line(&change.found));
        format!(
            "{shown}/{}:{}\n  expected  {expected}\n  generated {found}",
            change.path, change.line
        )
    });
    missing.chain(extra).chain(changed).collect()
}

const HINT: &str = "`cargo xtask bless` rewrites the golden files if the change is meant";

#[test]
fn every_case_yields_its_golden_files() {
    let differing: Vec<String> = cases()
        .iter()
        .filter(|case| case.folder.ends_with(Path::new("cases").join(&case.name)))
        .flat_map(|case| differences(&case.folder.join("expected"), &case.files))
        .collect();
    assert!(differing.is_empty(), "{}\n{HINT}", differing.join("\n"));
}

/// `(name, meaning)` of each status bit of a C header.
fn bits_of_header(header: &str) -> Vec<(String, String)> {
    let defines = header.lines().filter_map(|line| line.strip_prefix("#define "));
    let bits = defines.filter_map(|define| define.split_once("_STATUS_"));
    bits.map(|(_, rest)| {
        let (name, meaning) = (rest.split(' ').next().unwrap(), rest.split_once("/* "));
        let meaning = meaning.map_or("", |(_, comment)| comment.trim_end_matches(" */"));
        (name.to_owned(), meaning.to_owned())
    })
    .collect()
}

/// `(name, meaning)` of each status bit of a Rust file.
fn bits_of_module(text: &str) -> Vec<(String, String)> {
    let module = text
        .split("pub mod status {")
        .nth(1)
        .unwrap()
        .split('}')
        .next()
        .unwrap();
    let lines: Vec<&str> = module.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    let bit = |pair: &[&str]| {
        let name = pair[1].trim_start_matches("pub const ").split(':').next().unwrap();
        (name.to_owned(), pair[0].trim_start_matches("/// ").to_owned())
    };
    lines.chunks(2).map(bit).collect()
}

#[test]
fn every_status_bit_says_what_it_means_in_c_as_in_rust() {
    for case in cases() {
        let bits = bits_of_header(&case.files[&format!("{}.h", case.name)]);
        assert_eq!(bits.len(), 9, "{}", case.name);
        assert!(bits.iter().all(|(_, meaning)| meaning.ends_with('.')), "{bits:?}");
        assert_eq!(bits, bits_of_module(&case.files[&format!("{}.rs", case.name)]));
    }
}

/// The example's code is long: its golden file is the manifest, which holds length and checksum of each file.
#[test]
fn the_example_yields_its_golden_manifest() {
    let example = cases().iter().find(|case| case.name == "buck12").unwrap();
    let manifest = BTreeMap::from([("manifest.json".to_owned(), example.files["manifest.json"].clone())]);
    let differing = differences(&tests::root().join("tests/golden/buck12"), &manifest);
    assert!(differing.is_empty(), "{}\n{HINT}", differing.join("\n"));
}

/// Files of the integrations for a case without mapping and one with ADC codes and the four-term mapping; of the kit, which is
/// long, the entry in the manifest.
#[test]
fn the_integrations_yield_their_golden_files() {
    for name in ["minimal", "adc_mapping"] {
        let case = cases().iter().find(|case| case.name == name).unwrap();
        let integrations: Vec<Output> = Output::ALL.iter().copied().filter(|output| !output.is_core()).collect();
        let expected = verify::kit::expected(&case.policy, host(), &integrations, 20).unwrap();
        let generated = codegen::generate(&case.policy, host(), &integrations, expected.as_ref());
        let mut files = generated.unwrap().files;
        files.retain(|file, _| !case.files.contains_key(file) || file == "manifest.json");
        files.remove(&format!("{name}_kit.c")).unwrap();
        if name == "minimal" {
            // these differ from the other case's in the name only
            for shell in ["fmi2.c", "fmi2.h", "fmi3.c", "fmi3.h"] {
                files.remove(&format!("{name}_{shell}")).unwrap();
            }
        }
        let differing = differences(&tests::root().join("tests/golden/integrations").join(name), &files);
        assert!(differing.is_empty(), "{}\n{HINT}", differing.join("\n"));
    }
}

#[test]
fn the_networks_can_be_made_again_from_their_seeds() {
    for case in cases().iter().filter(|case| case.name != "buck12") {
        let contract = std::fs::read_to_string(case.folder.join("policy.toml")).unwrap();
        let recipe = Recipe::of(&contract).unwrap_or_else(|| panic!("{}: no `# network:` line", case.name));
        let stored = std::fs::read(case.folder.join("weights.safetensors")).unwrap();
        assert!(stored == recipe.network().unwrap(), "{}: other weights", case.name);
    }
}

/// A set of cases that lost, say, its integrator would check less without anybody noticing.
#[test]
fn together_the_cases_hold_every_part_of_a_contract() {
    let shown: String = cases().iter().map(|case| format!("{:?}\n", case.policy)).collect();
    let parts = [
        "Delay {",
        "BackwardDifference",
        "LowPass {",
        "FilteredDerivative {",
        "MovingAverage {",
        "Integrator {",
        "leak: 1.0",
        "leak: 0.",
        "pair: Some(",
        "adc: Some(",
        "adc: None",
        "mapping: Some(",
        "mapping: None",
        "r: Some(",
        "r: None",
        "slew: Some(",
        "slew: None",
        "soft_start: Some(",
        "soft_start: None",
        "clip: Some(",
        "clip: None",
        "PreviousDuty",
        "PreviousCommand",
        "Estimate(0, Current)",
        "Estimate(0, Voltage)",
        "Estimate(1, Bias)",
        "Estimate(1, Surplus)",
        "topology: Boost",
        "topology: BuckBoost",
        "carrier: Centre",
        "input_voltage: Constant(",
        "input_voltage: Signal(",
        "compute_delay: 0",
        "compute_delay: 1",
        "Residual(",
        "Still {",
        "Several([",
        "OutputDuty(0)",
        "OutputCommand(1)",
        "OutputCommand(2)",
        "output: 1,",
    ];
    let missing: Vec<_> = parts.iter().filter(|part| !shown.contains(**part)).collect();
    assert!(missing.is_empty(), "{missing:?}\n{shown}");
    let has = |activation: &Activation| {
        let layers = cases().iter().flat_map(|case| &case.policy.layers);
        layers
            .map(|layer| layer.activation.word())
            .any(|word| word == activation.word())
    };
    let missing: Vec<_> = Activation::EACH.iter().filter(|each| !has(each)).collect();
    assert!(missing.is_empty(), "no case has the activations {missing:?}");
    assert!(cases().iter().any(|case| case.policy.layers.len() == 1));
    let last = |case: &Case| case.policy.outputs();
    assert!(cases().iter().any(|case| last(case) > 16 && last(case) % 16 != 0));
}

#[test]
fn a_changed_missing_or_additional_file_is_named_with_the_first_line_that_differs() {
    if bless() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("a.c", "1\n2\n3\n"), ("b.c", "1\n"), ("c.c", "")] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let files = |list: &[(&str, &str)]| list.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect();
    let found = differences(
        folder.path(),
        &files(&[("a.c", "1\n2\n4\n"), ("b.c", "1\n"), ("d.c", "")]),
    );
    assert_eq!(found.len(), 3, "{found:?}");
    assert!(found[0].ends_with("/c.c: is not generated any more"), "{found:?}");
    assert!(found[1].ends_with("/d.c: is missing"), "{found:?}");
    assert!(found[2].ends_with("/a.c:3\n  expected  3\n  generated 4"), "{found:?}");
    let same = differences(
        folder.path(),
        &files(&[("a.c", "1\n2\n3\n"), ("b.c", "1\n"), ("c.c", "")]),
    );
    assert!(same.is_empty(), "{same:?}");
}
