//! What `docs/reference/equivalence.md` claims: every step of the emitted code is that of the contract, and no planted defect passes.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod defects;
mod several;

use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use codegen::Output;
use equivalence::{Claim, Goal, Options, Reading, Solver, Source, Sources, Verdict};
use policy::{NumericFormat, Policy};

/// The solver of `cargo xtask setup`; none if it cannot be had here.
fn solver() -> Option<Solver> {
    if tests::tools::is_without("Bitwuzla") {
        return None;
    }
    let python = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .with_file_name("python")
        .join("bin/python3");
    let installed =
        Solver::in_python(&python).or_else(|| Solver::find().into_iter().find(|solver| solver.name == "bitwuzla"));
    Some(installed.expect("bitwuzla: `cargo xtask setup` installs it"))
}

/// Header, C and Rust as text.
struct Code {
    name: String,
    header: String,
    c: String,
    rust: String,
}

impl Code {
    fn of(policy: &Policy) -> Self {
        let host = targets::find("host").unwrap();
        let files = tests::fixture::generate(policy, host, &Output::CORES).unwrap();
        let text = |extension: &str| {
            files
                .iter()
                .find(|(name, _)| name.ends_with(extension))
                .unwrap()
                .1
                .clone()
        };
        Code {
            name: policy.name.clone(),
            header: text(".h"),
            c: text(".c"),
            rust: text(".rs"),
        }
    }

    fn goals(&self, policy: &Policy) -> Vec<Goal> {
        let names = [".h", ".c", ".rs"].map(|extension| format!("{}{extension}", self.name));
        let [header, c, rust] = [&self.header, &self.c, &self.rust].map(String::as_str);
        let sources = Sources {
            c: Some((
                Source {
                    name: &names[0],
                    text: header,
                },
                Source {
                    name: &names[1],
                    text: c,
                },
            )),
            readings: &[Reading::Compiler, Reading::FramaC],
            rust: Some(Source {
                name: &names[2],
                text: rust,
            }),
        };
        equivalence::goals(policy, &sources).unwrap_or_else(|refusal| panic!("{refusal}"))
    }
}

fn run(goals: &[Goal], solver: &Solver) -> Vec<Claim> {
    let options = Options {
        // twenty times what the slowest goal of a random policy takes on a calm machine
        limit: Duration::from_secs(300),
        parallel: 2,
    };
    equivalence::run(goals, solver, options, &AtomicBool::new(false), |_| {})
}

fn assert_proved(policy: &Policy, solver: &Solver) {
    let claims = run(&Code::of(policy).goals(policy), solver);
    for claim in &claims {
        let title = format!("{} in {}: {}", policy.name, policy.numeric_format.name(), claim.name);
        assert_eq!(claim.verdict, Verdict::Proved, "{title}: {}", claim.claim);
    }
    let seconds: f64 = claims.iter().map(|claim| claim.seconds).sum();
    let (name, format, solver) = (&policy.name, policy.numeric_format.name(), solver.title());
    eprintln!(
        "{name} in {format}: {} claims, {seconds:.1} s of {solver}",
        claims.len()
    );
}

fn load(path: &str) -> Policy {
    let path = tests::root().join(path).join("policy.toml");
    policy::load_with(&path, &tests::random::several::options()).unwrap_or_else(|faults| panic!("{faults}"))
}

#[test]
fn the_examples_do_what_their_contracts_say() {
    let Some(solver) = solver() else { return };
    let all = [
        "examples/buck12",
        // its integrator leaks, which no random policy of a plain run does
        "tests/golden/cases/linear",
        // gains of every map
        "tests/golden/cases/scheduled",
        "examples/drm",
        "examples/blind/policy",
        "examples/train/wide",
    ];
    let count = if tests::full() { all.len() } else { 3 };
    for path in &all[..count] {
        assert_proved(&load(path), &solver);
    }
}

#[test]
fn random_policies_do_what_their_contracts_say() {
    let Some(solver) = solver() else { return };
    let count = if tests::full() { 24 } else { 2 };
    for seed in 900..900 + count {
        let folder = tests::random::policy(seed).unwrap();
        let policy = policy::load(&folder.path()).unwrap();
        assert_proved(&policy, &solver);
    }
}

#[test]
fn so_do_they_in_the_other_formats() {
    let Some(solver) = solver() else { return };
    let seeds = if tests::full() { 900..906 } else { 900..901 };
    for seed in seeds {
        let folder = tests::random::policy(seed).unwrap();
        let mut policy = policy::load(&folder.path()).unwrap();
        let formats = [
            NumericFormat::I16,
            NumericFormat::F64,
            NumericFormat::I8,
            NumericFormat::F32Fma,
        ];
        let count = if tests::full() { formats.len() } else { 1 };
        for format in &formats[..count] {
            policy.numeric_format = *format;
            assert_proved(&policy, &solver);
        }
    }
}
