//! Generated code on every emulated processor against the interpreter, bit by bit.
//!
//! `POLICYC_TARGET_STEPS=20000` sets the steps of every build.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod check_costs;
mod costs;
mod counter;
mod fallback;
mod formats;
mod included;
mod saved;
mod several;

use std::collections::BTreeMap;

use codegen::Output;
use policy::{NumericFormat, Policy};
use targets::{Fpu, TargetSpec};
use verify::{Options, Outcome, Report};

/// Policies drawn at random beside the example.
const RANDOM_POLICIES: u64 = 20;
/// Those of them that a target has every day: each target others, so that all targets together have all of them.
/// `POLICYC_FULL` gives every target all of them.
const RANDOM_POLICIES_A_DAY: u64 = 3;
/// Seed of the first.
const FIRST_SEED: u64 = 5000;

/// Steps of a build with `POLICYC_FULL`.
const STEPS: u64 = 20_000;
// What the steps have to reach, the host's runs of a million have reached; a processor has to show that its compiler and its
// arithmetic do the same, which every step shows whole.
/// Steps of the example where floats are hardware.
const EXAMPLE_STEPS: u64 = 2_000;
/// Steps of a build in the integer formats.
const INTEGER_STEPS: u64 = 500;
/// Steps of a build in the other float formats: on some of their processors every operation is a call of a library.
const FLOAT_STEPS: u64 = 150;
/// Steps of the example where every float operation is a call of a library, which takes ten times as long to emulate.
const STEPS_WITHOUT_FPU: u64 = 500;
/// Steps of a random policy.
const RANDOM_STEPS: u64 = 1_000;
/// Steps of a random policy where every float operation is a call of a library.
const RANDOM_STEPS_WITHOUT_FPU: u64 = 200;

fn target(name: &str) -> &'static TargetSpec {
    targets::find(name).unwrap()
}

fn steps(usual: u64) -> u64 {
    let asked = std::env::var("POLICYC_TARGET_STEPS").ok();
    asked.map_or(usual, |text| text.parse().expect("POLICYC_TARGET_STEPS is a number"))
}

fn assert_equal(report: &Report, what: &str) {
    let text = serde_json::to_string_pretty(report).unwrap();
    assert!(report.equal(), "{what}: {text}");
    assert!(
        report.builds.iter().all(|build| build.outcome == Outcome::Equal),
        "{what}: a build is missing\n{text}"
    );
}

fn run(policy: &Policy, target: &'static TargetSpec, compilers: &[&str], levels: &[&str], usual_steps: u64) -> Report {
    let owned = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    verify::run(
        policy,
        Options {
            steps: steps(usual_steps),
            seed: 3,
            target,
            compilers: owned(compilers),
            levels: owned(levels),
            ..Options::default()
        },
    )
    .unwrap()
}

/// Compilers of the target: all, but Rust where `cargo xtask test` could not have its library and has said so.
fn compilers(target: &TargetSpec) -> Vec<&'static str> {
    let without = std::env::var("POLICYC_WITHOUT_RUST_TARGETS").unwrap_or_default();
    let rust = target
        .rust
        .filter(|rust| !without.split(',').any(|triple| triple == rust.triple));
    let c = target.c_compilers.iter().map(|compiler| compiler.program);
    c.chain(rust.map(|_| verify::toolchain::RUSTC)).collect()
}

/// The example in every build of the target; the random policies in Rust and in one build of the C each, in turn. Emulating
/// float libraries takes ten times as long: there, every second random policy is in Rust and the others in C.
fn check(name: &str) {
    let target = target(name);
    let example = policy::load(&tests::example()).unwrap();
    let (example_steps, random_steps) = match target.fpu {
        _ if tests::full() => (STEPS, STEPS),
        Fpu::None => (STEPS_WITHOUT_FPU, RANDOM_STEPS_WITHOUT_FPU),
        _ => (EXAMPLE_STEPS, RANDOM_STEPS),
    };
    let report = run(&example, target, &compilers(target), &[], example_steps);
    assert_equal(&report, name);
    let builds = report.builds.iter().map(|build| build.build.rsplit_once(' ').unwrap());
    let (rust, c): (Vec<_>, Vec<_>) = builds.partition(|(compiler, _)| *compiler == verify::toolchain::RUSTC);
    for (seed, (compiler, level)) in seeds(target).zip(c.iter().cycle()) {
        let folder = tests::random::policy(seed).unwrap();
        let policy = policy::load(&folder.path()).unwrap_or_else(|faults| panic!("{}\n{faults}", folder.contract));
        let mut builds: Vec<_> = rust.iter().copied().chain([(*compiler, *level)]).collect();
        if target.fpu == Fpu::None && builds.len() > 1 {
            builds.swap_remove((seed % 2) as usize);
        }
        let (compilers, levels): (Vec<_>, Vec<_>) = builds.into_iter().unzip();
        let report = run(&policy, target, &compilers, &levels, random_steps);
        assert_eq!(report.builds.len(), compilers.len(), "{report:?}");
        assert_equal(&report, &format!("{name}, {compiler} {level}\n{}", folder.contract));
    }
}

/// The random policies of a target.
fn seeds(target: &TargetSpec) -> impl Iterator<Item = u64> {
    let place = targets::TARGETS.iter().position(|other| other.name == target.name);
    let first = place.unwrap_or(0) as u64 * RANDOM_POLICIES_A_DAY;
    let count = if tests::full() {
        RANDOM_POLICIES
    } else {
        RANDOM_POLICIES_A_DAY
    };
    (first..first + count).map(|number| FIRST_SEED + number % RANDOM_POLICIES)
}

#[test]
fn all_targets_together_have_all_random_policies() {
    let emulated = targets::TARGETS
        .iter()
        .filter(|t| matches!(t.runner, targets::Runner::Emulated(_)));
    let seeds: std::collections::BTreeSet<u64> = emulated.flat_map(seeds).collect();
    assert!(seeds.into_iter().eq(FIRST_SEED..FIRST_SEED + RANDOM_POLICIES));
}

macro_rules! equal_on {
    ($($test:ident: $target:literal,)*) => {
        $(
            #[test]
            fn $test() {
                check($target);
            }
        )*

        #[test]
        fn every_emulated_target_has_its_test() {
            let emulated = targets::TARGETS.iter().filter(|t| matches!(t.runner, targets::Runner::Emulated(_)));
            assert_eq!(emulated.map(|t| t.name).collect::<Vec<_>>(), [$($target),*]);
        }
    };
}

equal_on! {
    equal_on_cortex_m0plus: "cortex-m0plus",
    equal_on_cortex_m3: "cortex-m3",
    equal_on_cortex_m4f: "cortex-m4f",
    equal_on_cortex_m7: "cortex-m7",
    equal_on_cortex_m33: "cortex-m33",
    equal_on_riscv32imc: "riscv32imc",
    equal_on_riscv32imfc: "riscv32imfc",
    equal_on_powerpc_big_endian: "dspace-ds1202",
}

/// Every format on this machine and every processor that has it, in every language: one checksum of all words per format.
/// Binary64 also where it is a library, on one such processor.
fn one_checksum(format: NumericFormat, is_wanted: impl Fn(&TargetSpec) -> bool) {
    let example = policy::load(&tests::example()).unwrap().with_format(format);
    let mut checksums = BTreeMap::new();
    let emulated = targets::TARGETS
        .iter()
        .filter(|target| matches!(target.runner, targets::Runner::Emulated(_)) && is_wanted(target));
    for target in emulated.chain([target("host")]) {
        let usual = match format {
            _ if tests::full() => STEPS,
            NumericFormat::I16 | NumericFormat::I8 => INTEGER_STEPS,
            _ => FLOAT_STEPS,
        };
        let report = run(&example, target, &compilers(target), &["-O2", "-O"], usual);
        assert_eq!(report.builds.len(), compilers(target).len(), "{report:?}");
        assert_equal(&report, &format!("{} {}", target.name, format.name()));
        checksums.insert(report.checksum, target.name);
    }
    assert_eq!(checksums.len(), 1, "{}: {checksums:?}", format.name());
}

#[test]
fn i16_has_one_checksum_on_every_processor_and_in_every_language() {
    one_checksum(NumericFormat::I16, |_| true);
}

#[test]
fn i8_has_one_checksum_on_every_processor_and_in_every_language() {
    one_checksum(NumericFormat::I8, |_| true);
}

#[test]
fn binary64_has_one_checksum_on_every_kind_of_processor_and_in_every_language() {
    let kinds = [
        "cortex-m0plus",
        "cortex-m4f",
        "cortex-m7",
        "riscv32imfc",
        "dspace-ds1202",
    ];
    one_checksum(NumericFormat::F64, |target| kinds.contains(&target.name));
}

#[test]
fn f32_fma_has_one_checksum_where_it_is_an_instruction_and_where_it_is_none() {
    one_checksum(NumericFormat::F32Fma, |target| {
        target.fma != targets::Fma::Absent || target.name == "cortex-m0plus"
    });
}

/// Random policies in binary64 where it is in hardware: C and Rust, big-endian.
#[test]
fn random_policies_are_equal_in_binary64_on_powerpc() {
    let target = target("dspace-ds1202");
    for seed in seeds(target) {
        let folder = tests::random::policy(seed).unwrap();
        let policy = policy::load(&folder.path()).unwrap().with_format(NumericFormat::F64);
        let report = run(&policy, target, &compilers(target), &["-O2", "-O"], 2_000);
        assert_equal(&report, &folder.contract);
    }
}

/// The comparison itself: one flipped bit of one weight must be found, on both byte orders.
#[test]
fn a_flipped_weight_bit_is_found() {
    let policy = policy::load(&tests::example()).unwrap();
    for name in ["cortex-m4f", "dspace-ds1202"] {
        let target = target(name);
        let files = codegen::generate(&policy, target, &[Output::C], None).unwrap().files;
        let spoilt = with_flipped_weight(&files, &policy.name);
        let report = verify::run(
            &policy,
            Options {
                steps: 50,
                target,
                generated: Some(&spoilt),
                compilers: vec![target.c_compilers[0].program.to_owned()],
                levels: vec!["-O2".to_owned()],
                ..Options::default()
            },
        )
        .unwrap();
        let Outcome::Different { difference } = &report.builds[0].outcome else {
            panic!("{name}: {report:?}")
        };
        assert_eq!(
            (difference.event.as_str(), difference.what.as_str()),
            ("start", "self_test")
        );
    }
}

/// The lowest bit of the first weight, changed in the text.
fn with_flipped_weight(files: &BTreeMap<String, String>, name: &str) -> BTreeMap<String, String> {
    let mut files = files.clone();
    let text = files.get_mut(&format!("{name}.c")).unwrap();
    let table = text.find(&format!("{name}_weights0[")).unwrap();
    let start = table + text[table..].find("{\n").unwrap() + 2;
    let end = start + text[start..].find("f,").unwrap();
    let weight: f32 = text[start..end].trim().parse().unwrap();
    let flipped = f32::from_bits(weight.to_bits() ^ 1);
    text.replace_range(start..end, &format!("    {flipped:?}"));
    files
}
