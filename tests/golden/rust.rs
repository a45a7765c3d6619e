//! Every Rust file of the golden cases and of the example, built as a `no_std` library without a warning, and searched
//! for panics.

use std::path::Path;
use std::process::Command;

use policy::Scalar;
use tests::tools::{run, run_silently, rustc};

use super::{Case, cases};

/// Writes the generated file and a library around it.
fn write(case: &Case, library: &str, folder: &Path) {
    let name = format!("{}.rs", case.policy.name);
    std::fs::write(folder.join(&name), &case.files[&name]).unwrap();
    std::fs::write(folder.join("lib.rs"), library.replace("FILE", &name)).unwrap();
}

fn command(flags: &[&str], folder: &Path) -> Command {
    let mut command = rustc();
    command
        .args(flags)
        .args(["--crate-type=lib", "--crate-name=golden", "lib.rs"]);
    command.current_dir(folder);
    command
}

#[test]
fn the_code_is_a_no_std_library_without_unsafe_code_or_warning_in_every_edition() {
    let module =
        "#![no_std]\n#![forbid(unsafe_code)]\n#![deny(warnings)]\npub mod controller { include!(\"FILE\"); }\n";
    let whole = "#![no_std]\n#![forbid(unsafe_code)]\n#![deny(warnings)]\ninclude!(\"FILE\");\n";
    let mut refused = Vec::new();
    for case in cases() {
        let folder = tempfile::tempdir().unwrap();
        for library in [module, whole] {
            write(case, library, folder.path());
            for edition in ["2018", "2021", "2024"] {
                let edition = format!("--edition={edition}");
                let ran = run(&mut command(&[&edition, "--emit=metadata"], folder.path()));
                if ran.code != Some(0) || !ran.stderr.is_empty() {
                    refused.push(format!("{}, {edition}:\n{}", case.name, ran.stderr));
                }
            }
        }
    }
    assert!(refused.is_empty(), "{}", refused.join("\n"));
}

/// What a firmware calls, not inlined away and with nothing known about the arguments.
fn probes(case: &Case) -> String {
    let number = match case.policy.numeric_format.scalar() {
        Scalar::F32 => "f32",
        Scalar::F64 => "f64",
    };
    let mapping = match case.policy.mapping.map(|mapping| mapping.coefficients.r) {
        None => "",
        Some(None) => {
            "#[inline(never)] pub fn probe_mapping(x: &mut Controller, a: Number, b: Number, c: Number) -> bool \
             { x.set_mapping(a, b, c) }"
        }
        Some(Some(_)) => {
            "#[inline(never)] pub fn probe_mapping(x: &mut Controller, a: Number, b: Number, c: Number, r: Number) -> bool \
             { x.set_mapping(a, b, c, r) }"
        }
    };
    format!(
        "#![no_std]\n#![forbid(unsafe_code)]\ninclude!(\"FILE\");\ntype Number = {number};
         #[inline(never)] pub fn probe_new() -> Controller {{ Controller::new() }}
         #[inline(never)] pub fn probe_reset(x: &mut Controller) {{ x.reset() }}
         #[inline(never)] pub fn probe_eval(x: &Controller, m: &Measurement) -> Command {{ x.eval(m) }}
         #[inline(never)] pub fn probe_commit(x: &mut Controller, m: &Measurement, c: &Command) {{ x.commit(m, c) }}
         #[inline(never)] pub fn probe_step(x: &mut Controller, m: &Measurement) -> Command {{ x.step(m) }}
         #[inline(never)] pub fn probe_observe(x: &Controller, m: &Measurement) -> [Number; FEATURES] {{ x.observe(m) }}
         #[inline(never)] pub fn probe_q(o: &[Number; FEATURES]) -> [Number; ACTIONS] {{ Controller::q_values(o) }}
         #[inline(never)] pub fn probe_words(x: &Controller) -> [u32; STATE_WORDS] {{ x.state_words() }}
         #[inline(never)] pub fn probe_self_test() -> Result<(), u32> {{ Controller::self_test() }}
         #[inline(never)] pub fn probe_integrity() -> bool {{ Controller::integrity() }}
         {mapping}\n"
    )
}

/// Symbols that an optimised object takes from elsewhere; the probes are there.
fn undefined(level: &str, folder: &Path) -> Vec<String> {
    let flags = [
        "--edition=2021",
        "--emit=obj",
        "-Cpanic=abort",
        "-Ccodegen-units=1",
        level,
        "-oprobe.o",
    ];
    let ran = run(&mut command(&flags, folder));
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let names = |option: &str| run_silently(Command::new("nm").args([option, "probe.o"]).current_dir(folder));
    assert!(names("--defined-only").contains("probe_step"));
    names("-u")
        .lines()
        .map(|line| line.trim().trim_start_matches("U ").to_owned())
        .collect()
}

/// What a compiler may call for copying memory; every `no_std` program has these.
const COPYING: &[&str] = &["memcpy", "memset", "memmove"];

#[test]
fn optimised_code_holds_no_way_to_a_panic_and_calls_nothing_outside() {
    let mut found = Vec::new();
    for case in cases() {
        let folder = tempfile::tempdir().unwrap();
        write(case, &probes(case), folder.path());
        for level in ["-Copt-level=2", "-Copt-level=3", "-Copt-level=s"] {
            let mut calls = undefined(level, folder.path());
            calls.retain(|call| !COPYING.contains(&call.as_str()));
            if !calls.is_empty() {
                found.push(format!("{} {level}: {calls:?}", case.name));
            }
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// The measurement itself: an index that the compiler cannot bound must be found.
#[test]
fn a_planted_index_is_seen_as_a_panic() {
    let case = &cases()[0];
    let folder = tempfile::tempdir().unwrap();
    let planted = "#[inline(never)] pub fn probe_index(x: &[f32; FEATURES], i: usize) -> f32 { x[i] }\n";
    write(case, &(probes(case) + planted), folder.path());
    let calls = undefined("-Copt-level=3", folder.path());
    assert!(calls.iter().any(|call| call.contains("panicking")), "{calls:?}");
}

#[test]
fn unsafe_code_in_a_generated_file_would_be_refused() {
    let case = &cases()[0];
    let folder = tempfile::tempdir().unwrap();
    write(
        case,
        "#![no_std]\n#![forbid(unsafe_code)]\ninclude!(\"FILE\");\n",
        folder.path(),
    );
    let name = folder.path().join(format!("{}.rs", case.policy.name));
    let text = std::fs::read_to_string(&name).unwrap() + "pub fn f(x: *const f32) -> f32 { unsafe { *x } }\n";
    std::fs::write(&name, text).unwrap();
    let ran = run(&mut command(&["--edition=2021", "--emit=metadata"], folder.path()));
    assert!(ran.code == Some(1) && ran.stderr.contains("unsafe_code"), "{ran:?}");
}
