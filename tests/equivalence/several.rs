//! Contracts with several outputs: each output has goals of its own, and one status word is about all.

use policy::NumericFormat;

use super::{Code, assert_proved, load, solver};

const FORMATS: [NumericFormat; 5] = [
    NumericFormat::F32,
    NumericFormat::I16,
    NumericFormat::F64,
    NumericFormat::I8,
    NumericFormat::F32Fma,
];

#[test]
fn both_legs_do_what_their_contract_says() {
    let Some(solver) = solver() else { return };
    let count = if tests::full() { FORMATS.len() } else { 2 };
    for format in &FORMATS[..count] {
        assert_proved(&load("tests/fixtures/legs").with_format(*format), &solver);
    }
}

#[test]
fn random_policies_with_several_outputs_do_what_their_contracts_say() {
    let Some(solver) = solver() else { return };
    let count = if tests::full() { 15 } else { 1 };
    for seed in 940..940 + count {
        let folder = tests::random::several::policy(seed).unwrap();
        let policy = policy::load_with(&folder.path(), &tests::random::several::options()).unwrap();
        assert_proved(&policy.with_format(FORMATS[(seed % 5) as usize]), &solver);
    }
}

#[test]
fn goals_name_the_outputs_and_the_status_is_one() {
    let policy = load("tests/fixtures/legs");
    let names: Vec<String> = Code::of(&policy)
        .goals(&policy)
        .into_iter()
        .map(|goal| goal.name)
        .collect();
    for language in ["c", "eva", "rust"] {
        for part in [
            "duty",
            "duty_sim",
            "action_index",
            "commit.remembered",
            "commit.soft_cap",
            "commit.coefficients",
            "set_mapping",
        ] {
            for output in ["left", "right"] {
                let name = format!("{language}.{part}.{output}");
                assert!(names.contains(&name), "{name} in {names:?}");
            }
        }
        assert!(names.contains(&format!("{language}.status")));
    }
}
