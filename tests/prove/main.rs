//! What `docs/reference/prove.md` claims: the generated C is proved, and no planted defect is.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod defects;
mod table;

use std::collections::BTreeMap;

use codegen::Output;
use policy::{NumericFormat, Policy};
use prove::{Answer, Claim, Eva, Prover, Stop, Task, Verdict, Watch, eva};

fn load(path: &str) -> Policy {
    let path = tests::root().join(path).join("policy.toml");
    policy::load_with(&path, &tests::random::several::options()).unwrap_or_else(|faults| panic!("{faults}"))
}

fn in_format(path: &str, format: NumericFormat) -> Policy {
    let mut policy = load(path);
    policy.numeric_format = format;
    policy
}

fn task(policy: &Policy) -> Task<'_> {
    Task {
        policy,
        target: targets::find("host").unwrap(),
    }
}

fn sources(policy: &Policy) -> BTreeMap<String, String> {
    codegen::sources(policy, task(policy).target, &[Output::C], None)
        .unwrap()
        .files
}

fn watched<T>(run: impl FnOnce(&Watch<'_>) -> T) -> T {
    let stop = Stop::new(false);
    run(&Watch {
        say: &|_| {},
        stop: &stop,
    })
}

/// All claims that a run tried are proved; those that it leaves say why.
fn assert_proved(policy: &Policy) {
    let claims = watched(|watch| Eva.prove(task(policy), watch)).unwrap();
    let title = format!("{} in {}", policy.name, policy.numeric_format.name());
    for claim in &claims {
        let Claim {
            name, reason, details, ..
        } = claim;
        match claim.verdict {
            Verdict::Proved => {}
            Verdict::NotRun => assert!(!reason.is_empty(), "{title}: {name}"),
            verdict => panic!("{title}: {name} is {}: {reason} {details:?}", verdict.words()),
        }
    }
    let proved = claims.iter().filter(|claim| claim.verdict == Verdict::Proved).count();
    // step, damage, marks, choice, network, start-up, integrity, self test: each with a claim at least
    assert!(proved >= 20, "{title}: {proved} claims");
}

#[test]
fn nothing_goes_wrong_in_a_small_controller() {
    assert_proved(&load("tests/golden/cases/minimal"));
    assert_proved(&in_format("tests/golden/cases/minimal", NumericFormat::I16));
}

/// ELU and softplus, two layers in which intervals of their terms are far too wide, and one whose sums come near to 32 bits.
#[test]
fn sums_behind_curves_without_an_upper_end_fit() {
    for seed in [1_795_689_093, 1_795_689_092] {
        let folder = tests::random::policy(seed).unwrap();
        let policy = policy::load(&folder.path()).unwrap().with_format(NumericFormat::I16);
        let claims =
            watched(|watch| eva::prove_sources(task(&policy), &sources(&policy), Some("prove_network"), watch))
                .unwrap();
        let claim = claims.iter().find(|claim| claim.name == "network-runs").unwrap();
        assert_eq!(claim.verdict, Verdict::Proved, "{seed}: {:?}", claim.details);
    }
}

#[test]
fn nothing_goes_wrong_in_a_controller_with_two_outputs() {
    let formats = [
        NumericFormat::I16,
        NumericFormat::F32,
        NumericFormat::F64,
        NumericFormat::I8,
    ];
    let count = if tests::full() { formats.len() } else { 1 };
    for format in &formats[..count] {
        assert_proved(&in_format("tests/fixtures/legs", *format));
    }
}

#[test]
fn claims_name_the_outputs() {
    let policy = load("tests/fixtures/legs");
    let claims =
        watched(|watch| eva::prove_sources(task(&policy), &sources(&policy), Some("prove_step"), watch)).unwrap();
    let names: Vec<&str> = claims.iter().map(|claim| claim.name.as_str()).collect();
    for name in [
        "step-duty.left",
        "step-duty.right",
        "step-chosen.left",
        "step-action.right",
        "step-status",
    ] {
        assert!(names.contains(&name), "{name} in {names:?}");
    }
    let answer = Answer::new(&[task(&policy)], claims);
    assert_eq!(answer.outputs, ["left", "right"]);
    assert!(prove::page::page(&answer).unwrap().contains("left, right"));
}

#[test]
fn nothing_goes_wrong_in_random_policies_with_several_outputs() {
    // a minute each where others build
    let count = if tests::full() { 20 } else { 0 };
    for seed in 4300..4300 + count {
        let folder = tests::random::several::policy(seed).unwrap();
        let policy = policy::load_with(&folder.path(), &tests::random::several::options()).unwrap();
        let formats = [
            NumericFormat::F32,
            NumericFormat::I16,
            NumericFormat::F64,
            NumericFormat::I8,
        ];
        assert_proved(&policy.with_format(formats[(seed % 4) as usize]));
    }
}

#[test]
fn nothing_goes_wrong_where_the_network_gives_gains() {
    // a minute each where others build
    if tests::full() {
        for format in [NumericFormat::F32, NumericFormat::I16] {
            assert_proved(&in_format("tests/golden/cases/scheduled", format));
        }
    }
}

#[test]
fn nothing_goes_wrong_in_any_construct() {
    if tests::full() {
        for format in [NumericFormat::F32, NumericFormat::F64] {
            assert_proved(&in_format("tests/golden/cases/constructs", format));
        }
        for format in [
            NumericFormat::F32,
            NumericFormat::F64,
            NumericFormat::I16,
            NumericFormat::I8,
        ] {
            assert_proved(&in_format("examples/buck12", format));
        }
    }
}

/// `POLICYC_PROVE_SEEDS=4223,8001` takes other ones.
#[test]
fn nothing_goes_wrong_in_random_policies() {
    let seeds: Vec<u64> = match std::env::var("POLICYC_PROVE_SEEDS") {
        Ok(list) => list.split(',').map(|seed| seed.parse().unwrap()).collect(),
        // a minute each where others build
        Err(_) => (4200..4200 + if tests::full() { 50 } else { 0 }).collect(),
    };
    for seed in seeds {
        let folder = tests::random::policy(seed).unwrap();
        let mut policy = policy::load(&folder.path()).unwrap();
        let formats = [
            NumericFormat::F32,
            NumericFormat::I16,
            NumericFormat::F64,
            NumericFormat::I8,
        ];
        policy.numeric_format = formats[(seed % 4) as usize];
        assert_proved(&policy);
    }
}
