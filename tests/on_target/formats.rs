//! The loops in assembly on the emulated processors against the interpreter, bit by bit, in every format that has them.

use policy::{NumericFormat, Policy};
use targets::{Runner, TargetSpec};
use verify::{Options, Report};

use super::{assert_equal, compilers, steps};

/// Steps of a build: the network and what is around it are the same code as in the long runs.
const STEPS: u64 = 1_000;

fn run(policy: &Policy, target: &'static TargetSpec, usual_steps: u64) -> Report {
    let owned = |text: &str| text.to_owned();
    let options = Options {
        steps: steps(usual_steps),
        seed: 7,
        target,
        compilers: compilers(target).into_iter().map(owned).collect(),
        // of the C compilers and of rustc
        levels: ["-O2", "-O"].map(owned).to_vec(),
        extra_flags: vec![format!("-D{}_ASSEMBLY", policy.name.to_uppercase())],
        extra_rust_flags: ["--cfg", "policyc_assembly"].map(owned).to_vec(),
        ..Options::default()
    };
    verify::run(policy, options).unwrap()
}

fn emulated() -> impl Iterator<Item = &'static TargetSpec> {
    let all = targets::TARGETS.iter();
    all.filter(|target| matches!(target.runner, Runner::Emulated(_)))
}

fn example(format: NumericFormat) -> Policy {
    policy::load(&tests::example()).unwrap().with_format(format)
}

/// Cores that have loops in assembly, by what the formats need of them.
fn has_assembly(target: &TargetSpec, format: NumericFormat) -> bool {
    match format {
        NumericFormat::F32 => target.has_float_assembly,
        _ => target.has_float_assembly && target.integer_block.inner == targets::IntegerLoop::Dual,
    }
}

const IN_ASSEMBLY: [NumericFormat; 3] = [NumericFormat::F32, NumericFormat::I16, NumericFormat::I8];

#[test]
fn the_loops_in_assembly_are_equal() {
    let mut checked = 0;
    for format in IN_ASSEMBLY {
        for target in emulated().filter(|target| has_assembly(target, format)) {
            let report = run(&example(format), target, STEPS);
            assert_equal(&report, &format!("{} {}, assembly", target.name, format.name()));
            checked += 1;
        }
    }
    assert_eq!(checked, 9, "Cortex-M4F, M7 and M33 in three formats");
}

/// Layers of other sizes and activations: tails of blocks, odd numbers of inputs, one layer.
#[test]
fn so_are_those_of_random_policies() {
    let target = super::target("cortex-m4f");
    for seed in 8100..8108 {
        let folder = tests::random::policy(seed).unwrap();
        let policy = policy::load(&folder.path()).unwrap();
        for format in IN_ASSEMBLY {
            let report = run(&policy.clone().with_format(format), target, 500);
            assert_equal(&report, &format!("seed {seed}, {}\n{}", format.name(), folder.contract));
        }
    }
}
