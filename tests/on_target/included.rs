//! `include_policy!` itself, expanded by the compiler for the processor, in place of generated text.

use policy::Policy;
use tests::tools::macro_library;
use verify::toolchain::{RUSTC, Toolchain, toolchain};
use verify::{Options, Outcome, Report};

use super::{assert_equal, compilers, target};

/// Inside the folder of this package, where the macro looks.
const CONTRACT: &str = "golden/cases/paper/policy.toml";

fn included(policy: &Policy, name: &str) -> Option<Report> {
    let target = target(name);
    // a compiler loads macros of its own version only
    let is_ours = target.rust.is_some_and(|rust| toolchain(rust) == Ok(Toolchain::OnPath));
    if !is_ours || !compilers(target).contains(&RUSTC) {
        return None;
    }
    let text = format!("policy_macro::include_policy!(pub {CONTRACT:?});\npub use self::paper::*;\n");
    let library = macro_library();
    let report = verify::run(
        policy,
        Options {
            steps: 2000,
            seed: 4,
            target,
            generated: Some(&[("paper.rs".to_owned(), text)].into()),
            compilers: vec![RUSTC.to_owned()],
            extra_rust_flags: vec!["--extern".to_owned(), format!("policy_macro={}", library.display())],
            ..Options::default()
        },
    );
    Some(report.unwrap())
}

fn policy() -> Policy {
    policy::load(&tests::root().join("tests").join(CONTRACT)).unwrap()
}

#[test]
fn the_macro_gives_the_same_bits_on_every_processor_with_rust() {
    let policy = policy();
    for target in targets::TARGETS {
        if matches!(target.runner, targets::Runner::Emulated(_)) {
            included(&policy, target.name)
                .iter()
                .for_each(|report| assert_equal(report, target.name));
        }
    }
}

/// The comparison itself: an interpreter whose duties are off by one bit is not followed.
#[test]
fn another_policy_than_the_included_one_is_found() {
    let mut policy = policy();
    for action in policy.actions_mut() {
        let duty = action.duty as f32;
        action.duty = f64::from(f32::from_bits(duty.to_bits() + 1));
    }
    if let Some(report) = included(&policy, "cortex-m4f") {
        assert!(
            matches!(report.builds[0].outcome, Outcome::Different { .. }),
            "{report:?}"
        );
    }
}
