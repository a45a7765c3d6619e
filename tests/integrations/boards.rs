//! The back-to-back kit on the boards: built with the processor's own gcc, run under its emulator.

use std::collections::BTreeMap;
use std::time::Duration;

use codegen::Output;
use policy::Policy;
use targets::{Runner, TargetSpec};
use verify::toolchain::{self, Build, BuildError, Purpose, Sources};

use super::{example, files, golden_case, legs};

const STEPS: u32 = 100;
const TIMEOUT: Duration = Duration::from_secs(120);

fn emulated() -> impl Iterator<Item = &'static TargetSpec> {
    let is_emulated = |target: &&TargetSpec| matches!(target.runner, Runner::Emulated(_));
    targets::TARGETS.iter().filter(is_emulated)
}

/// The kit of a policy; a bare board has no `<string.h>`.
fn kit(policy: &Policy) -> BTreeMap<String, String> {
    let mut files = files(policy, Output::Kit, STEPS);
    files.insert("string.h".to_owned(), "#include <board.h>\n".to_owned());
    files
}

/// The target's first C compiler at -O2.
fn build(target: &TargetSpec) -> Build {
    let compiler = target.c_compilers[0].program.to_owned();
    toolchain::builds(target, &[compiler], &["-O2".to_owned()]).remove(0)
}

/// Exit code and number of differences.
fn run(
    policy: &Policy,
    target: &TargetSpec,
    files: &BTreeMap<String, String>,
    flags: &[&str],
) -> Result<(Option<i32>, u32), BuildError> {
    let folder = tempfile::tempdir().unwrap();
    let upper = policy.name.to_uppercase();
    let mut extra_flags = vec![format!("-D{upper}_KIT_NO_MAIN"), format!("-D{upper}_KIT_NO_STDIO")];
    extra_flags.extend(flags.iter().map(|flag| (*flag).to_owned()));
    let sources = Sources {
        purpose: Purpose::Kit,
        policy,
        files,
        target,
        extra_flags: &extra_flags,
        extra_rust_flags: &[],
        timeout: TIMEOUT,
    };
    let program = toolchain::compile(&build(target), sources, folder.path())?;
    let mut command = toolchain::launch(target, program, &[]).unwrap();
    let output = toolchain::run_for(&mut command, TIMEOUT).unwrap();
    let word = <[u8; 4]>::try_from(output.stdout.as_slice()).unwrap_or_else(|_| panic!("{output:?}"));
    let failed = match target.endianness {
        targets::Endianness::Big => u32::from_be_bytes(word),
        _ => u32::from_le_bytes(word),
    };
    Ok((output.status.code(), failed))
}

#[test]
fn the_kit_passes_on_every_board() {
    let policy = example();
    let files = kit(&policy);
    for target in emulated() {
        assert_eq!(
            run(&policy, target, &files, &[]).unwrap(),
            (Some(0), 0),
            "{}",
            target.name
        );
    }
}

#[test]
fn the_kit_of_several_outputs_passes_on_every_board() {
    let policy = legs("constructs");
    let mut files = kit(&policy);
    for target in emulated() {
        let found = run(&policy, target, &files, &[]).unwrap();
        assert_eq!(found, (Some(0), 0), "{}", target.name);
    }
    let text = files.get_mut("constructs.c").unwrap();
    let (from, to) = ("= command->duty[2];", "= command->duty[1];");
    assert!(text.contains(from), "{text}");
    *text = text.replacen(from, to, 1);
    for target in emulated() {
        let (code, failed) = run(&policy, target, &files, &[]).unwrap();
        assert!(code == Some(1) && failed > 1, "{}: {failed}", target.name);
    }
}

#[test]
fn a_flipped_weight_bit_fails_on_every_board() {
    let policy = golden_case("paper");
    let mut files = kit(&policy);
    let text = files.get_mut("paper.c").unwrap();
    let literal = super::kit_defects::first_literal(text, "paper_weights0[");
    *text = text.replacen(&literal, &super::kit_defects::flipped(&literal), 1);
    for target in emulated() {
        let (code, failed) = run(&policy, target, &files, &[]).unwrap();
        // not the integrity check alone: the known answers see it as well
        assert!(code == Some(1) && failed > 1, "{}: {failed}", target.name);
    }
}

/// The guards of the core stop it.
#[test]
fn fast_math_builds_on_no_board() {
    let policy = golden_case("minimal");
    let files = kit(&policy);
    for target in emulated() {
        let built = run(&policy, target, &files, &["-ffast-math"]);
        assert!(
            matches!(&built, Err(BuildError::Refused(text)) if text.contains("fast-math")),
            "{}: {built:?}",
            target.name
        );
    }
}
