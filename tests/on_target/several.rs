//! Several outputs from one network on emulated processors: every duty of every step.

use policy::NumericFormat;

use super::{assert_equal, compilers, run, target};

/// Steps of a build.
// each step shows all duties whole; the runs on the host reach the rest
const STEPS: u64 = 200;

/// A policy with choices and a continuous output, in floats and in integers, in every build of the target at one level each.
fn check(name: &str, levels: &[&str]) {
    let target = target(name);
    let mixed = |seed: &u64| {
        let folder = tests::random::several::policy(*seed).unwrap();
        folder.contract.contains("continuous = ") && folder.contract.contains("duties = ")
    };
    let seed = (0..).find(mixed).unwrap();
    let folder = tests::random::several::policy(seed).unwrap();
    let policy = policy::load_with(&folder.path(), &tests::random::several::options());
    let policy = policy.unwrap_or_else(|faults| panic!("{}\n{faults}", folder.contract));
    for format in [NumericFormat::F32, NumericFormat::I16] {
        let report = run(
            &policy.clone().with_format(format),
            target,
            &compilers(target),
            levels,
            STEPS,
        );
        assert!(!report.builds.is_empty(), "{name} has no build at {levels:?}");
        assert_equal(&report, &format!("{name} {}\n{}", format.name(), folder.contract));
    }
}

#[test]
fn several_outputs_are_equal_on_a_cortex_m4f() {
    check("cortex-m4f", &["-O2", "-O"]);
}

#[test]
fn several_outputs_are_equal_on_a_powerpc() {
    check("dspace-ds1202", &["-O2", "-O"]);
}
