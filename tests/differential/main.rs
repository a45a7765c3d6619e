//! Generated code against the interpreter, step by step and bit by bit; and hostile edits that must be caught.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod codes;
mod flips;
mod formats;
mod integrity;
mod macro_crate;
mod mutations;
mod several;
mod simplified;
mod subnormal;
mod warnings;

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use policy::{NumericFormat, Policy};
use verify::traces::Recorded;
use verify::{Options, Outcome, Report};

/// Compiler names in the order in which random policies take turns.
const COMPILERS: [&str; 3] = ["gcc", "clang", "rustc"];

/// Every build was made and compared, and all are equal to the interpreter.
fn assert_equal(report: &Report, what: &str) {
    let text = serde_json::to_string_pretty(report).unwrap();
    assert!(report.equal(), "{what}: {text}");
    assert!(
        report.builds.iter().all(|build| build.outcome == Outcome::Equal),
        "{what}: a build is missing\n{text}"
    );
}

fn run(policy: &Policy, steps: u64, seed: u64, compilers: &[&str]) -> Report {
    let compilers = compilers.iter().map(|name| (*name).to_owned()).collect();
    verify::run(
        policy,
        Options {
            steps,
            seed,
            compilers,
            ..Options::default()
        },
    )
    .unwrap()
}

#[test]
fn the_example_is_equal_in_every_build_and_gives_the_trainers_answers() {
    let policy = policy::load(&tests::example()).unwrap();
    let report = run(&policy, 50_000, 11, &[]);
    assert_equal(&report, "buck12");
    assert_eq!(
        report.builds.len(),
        9,
        "gcc and clang at three levels, gcc with sanitisers, rustc at two"
    );
    let golden = report.golden.unwrap();
    assert_eq!(
        (golden.vectors, golden.actions_compared, golden.actions_equal),
        (515, 515, 515)
    );
    assert!(golden.worst_relative_error.unwrap() <= 1e-5);
}

#[test]
fn recorded_closed_loops_are_replayed() {
    let policy = policy::load(&tests::example()).unwrap();
    let recorded = Recorded::open(&policy, &tests::root().join("tests/fixtures/buck12_200_1000.csv"), "").unwrap();
    let steps = recorded.steps().len() as u64;
    assert!(steps > 500);
    let options = Options {
        steps,
        recorded: vec![recorded],
        compilers: vec!["gcc".into()],
        ..Options::default()
    };
    assert_equal(&verify::run(&policy, options).unwrap(), "recorded");
}

/// Random policies of these seeds in a format, two at a time, each with one compiler at all its levels;
/// `POLICYC_ALL_COMPILERS=1` takes all compilers for each.
fn assert_random_policies_are_equal(seeds: Range<u64>, format: NumericFormat, steps: u64) {
    let next = AtomicU64::new(seeds.start);
    let all = std::env::var_os("POLICYC_ALL_COMPILERS").is_some();
    let work = || {
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= seeds.end {
                return;
            }
            let folder = tests::random::policy(seed).unwrap();
            let policy = policy::load(&folder.path()).unwrap_or_else(|faults| panic!("{}\n{faults}", folder.contract));
            let turn = [COMPILERS[(seed % 3) as usize]];
            let compilers: &[&str] = if all { &[] } else { &turn };
            let report = run(&policy.with_format(format), steps, seed, compilers);
            assert_equal(&report, &folder.contract);
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(work);
        }
    });
}

#[test]
fn random_policies_are_equal() {
    let count = if tests::full() { 200 } else { 24 };
    assert_random_policies_are_equal(0..count, NumericFormat::F32, 3000);
}

/// Of the seeds drawn above one in five has gains: here all have, in every format.
#[test]
fn random_gain_schedules_are_equal_in_every_format() {
    let count = if tests::full() { 60 } else { 8 };
    let with_gains = |seed: &u64| tests::random::policy(*seed).unwrap().contract.contains("gains = [");
    let seeds: Vec<u64> = (5000..).filter(with_gains).take(count).collect();
    for (turn, seed) in seeds.into_iter().enumerate() {
        let folder = tests::random::policy(seed).unwrap();
        let policy = policy::load(&folder.path()).unwrap_or_else(|faults| panic!("{}\n{faults}", folder.contract));
        for (at, format) in NumericFormat::ALL.into_iter().enumerate() {
            let compiler = COMPILERS[(turn + at) % 3];
            let report = run(&policy.clone().with_format(format), 1000, seed, &[compiler]);
            assert_equal(&report, &format!("{} {compiler}\n{}", format.name(), folder.contract));
        }
    }
}

#[test]
fn random_policies_reach_every_status_bit_and_every_kind() {
    let contracts: Vec<String> = (0..200)
        .map(|seed| tests::random::policy(seed).unwrap().contract)
        .collect();
    let all = contracts.join("\n");
    for word in [
        "delay",
        "backward_difference",
        "low_pass",
        "filtered_derivative",
        "moving_average",
        "integrator",
        "leak = 0.0",
        "leak = 0.9",
        "leak = 0.99999999 ",
        "adc",
        "pairs",
        "duties",
        "slew",
        "soft_start",
        "[mapping]",
        "previous_duty",
        "previous_command",
        "[[observer]]",
        "compute_delay = 0",
        "compute_delay = 1",
        "input_voltage = \"s",
        "o0_current",
        "o0_voltage",
        "o0_bias",
        "o0_surplus",
        "topology = \"boost\"",
        "topology = \"buck-boost\"",
        "carrier = \"centre\"",
        "base = ",
        "dead_zone = [",
        "gains = [",
        "feature = \"x",
        "limits = [",
    ] {
        assert!(all.contains(word), "no random policy has {word}");
    }
    for each in policy::Activation::EACH {
        assert!(all.contains(&each.written()), "no random policy has {}", each.word());
    }
    let layers: Vec<usize> = (0..60)
        .map(|seed| {
            policy::load(&tests::random::policy(seed).unwrap().path())
                .unwrap()
                .layers
                .len()
        })
        .collect();
    assert!(
        (2..=5).all(|count| layers.contains(&count)),
        "one to four hidden layers: {layers:?}"
    );
}
