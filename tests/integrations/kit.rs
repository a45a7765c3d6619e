//! The back-to-back kit passes under every compiler here and fails where code, flags or machine differ.

use std::collections::BTreeMap;

use codegen::Output;
use policy::{NumericFormat, Policy};
use tests::tools::Ran;

use super::{build, build_silently, example, files, golden_case, legs, run_program, write};

pub const STEPS: u32 = 200;

struct Compiler {
    command: &'static [&'static str],
    emulator: Option<&'static str>,
}

const fn compiler(command: &'static [&'static str], emulator: Option<&'static str>) -> Compiler {
    Compiler { command, emulator }
}

const COMPILERS: &[Compiler] = &[
    compiler(&["gcc", "-std=c99", "-O0"], None),
    compiler(&["gcc", "-std=c90", "-O3"], None),
    compiler(&["clang", "-std=c99", "-O2"], None),
    compiler(&["g++", "-x", "c++", "-std=c++98", "-O2"], None),
    compiler(&["clang++", "-x", "c++", "-std=c++17", "-O2"], None),
    compiler(
        &["powerpc-linux-gnu-gcc", "-std=c90", "-static", "-O2"],
        Some("qemu-ppc"),
    ),
    compiler(
        &[
            "gcc",
            "-O1",
            "-fsanitize=address,undefined",
            "-fno-sanitize-recover=all",
        ],
        None,
    ),
];

const STRICT: &[&str] = &["-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror"];

pub fn sources(policy: &Policy) -> [String; 2] {
    [format!("{}.c", policy.name), format!("{}_kit.c", policy.name)]
}

fn run_kit(policy: &Policy, files: &BTreeMap<String, String>, compiler: &Compiler) -> Ran {
    let folder = tempfile::tempdir().unwrap();
    write(files, folder.path());
    let sources = sources(policy);
    let command = [compiler.command, STRICT].concat();
    build_silently(&command, &sources.each_ref().map(String::as_str), folder.path());
    run_program(compiler.emulator, folder.path())
}

#[test]
fn the_kit_of_the_example_passes_under_every_compiler_in_both_widths() {
    for format in [NumericFormat::F32, NumericFormat::F64] {
        let policy = example().with_format(format);
        let files = files(&policy, Output::Kit, STEPS);
        for compiler in COMPILERS {
            let ran = run_kit(&policy, &files, compiler);
            let (command, line) = (compiler.command, &ran.stdout);
            assert_eq!((ran.code, line.lines().count()), (Some(0), 1), "{command:?}: {ran:?}");
            assert!(
                line.starts_with("buck12: PASS: ") && line.contains(" checks: "),
                "{line}"
            );
        }
    }
}

#[test]
fn the_kit_passes_for_codes_filters_activations_and_policies_without_mapping() {
    for name in ["adc_mapping", "filters", "activations", "minimal", "linear", "wide"] {
        let policy = golden_case(name);
        let ran = run_kit(&policy, &files(&policy, Output::Kit, STEPS), &COMPILERS[0]);
        assert_eq!(ran.code, Some(0), "{name}: {ran:?}");
    }
}

/// Three legs, in both widths and as integers: choices with mappings of four and three terms beside a continuous output.
#[test]
fn the_kit_of_several_outputs_passes_under_every_compiler() {
    let formats = [NumericFormat::F32, NumericFormat::I16].map(|format| legs("constructs").with_format(format));
    for policy in formats.into_iter().chain([legs("wide")]) {
        let files = files(&policy, Output::Kit, STEPS);
        for compiler in COMPILERS {
            let ran = run_kit(&policy, &files, compiler);
            let command = compiler.command;
            assert_eq!(ran.code, Some(0), "{} {command:?}: {ran:?}", policy.name);
        }
    }
}

/// Random policies have two to four outputs of any kind.
#[test]
fn the_kit_of_random_policies_with_several_outputs_passes() {
    for seed in 0..if tests::full() { 20 } else { 4 } {
        let folder = tests::random::several::policy(seed).unwrap();
        let policy = policy::load_with(&folder.path(), &tests::random::several::options()).unwrap();
        let ran = run_kit(&policy, &files(&policy, Output::Kit, STEPS), &COMPILERS[0]);
        assert_eq!(ran.code, Some(0), "{}: {ran:?}", folder.contract);
    }
}

/// Where the flash is small the parts run one after the other, and together they make the checks of the whole; the first two need
/// no controller beside them.
#[test]
fn the_parts_of_the_kit_run_alone() {
    for (policy, format) in [
        (example(), NumericFormat::F64),
        (golden_case("linear"), NumericFormat::F32),
    ] {
        let policy = policy.with_format(format);
        let folder = tempfile::tempdir().unwrap();
        write(&files(&policy, Output::Kit, 50), folder.path());
        let [core, kit] = sources(&policy);
        let checks = |part: &str, sources: &[&str]| -> u32 {
            let flag = format!("-D{}_KIT_PART={part}", policy.name.to_uppercase());
            let command = [&["gcc", "-O1", flag.as_str()][..], STRICT].concat();
            build_silently(&command, sources, folder.path());
            let ran = run_program(None, folder.path());
            assert_eq!(ran.code, Some(0), "{part}: {ran:?}");
            let number = ran
                .stdout
                .split("PASS: ")
                .nth(1)
                .and_then(|rest| rest.split(' ').next());
            number.unwrap().parse().unwrap()
        };
        let whole = checks("0", &[&core, &kit]);
        let parts = [checks("1", &[&kit]), checks("2", &[&kit]), checks("3", &[&core, &kit])];
        assert!(parts.iter().all(|part| *part > 100), "{parts:?}");
        assert_eq!(whole, parts.iter().sum::<u32>());
    }
}

/// The guards stop a compiler that says in its macros what it was asked for.
#[test]
fn fast_math_does_not_build() {
    let policy = golden_case("minimal");
    let folder = tempfile::tempdir().unwrap();
    write(&files(&policy, Output::Kit, STEPS), folder.path());
    let [core, kit] = sources(&policy);
    for source in [core, kit] {
        let built = build(&["gcc", "-O2", "-ffast-math", "-c"], &[&source], folder.path());
        assert!(
            built.code == Some(1) && built.stderr.contains("-ffast-math"),
            "{built:?}"
        );
    }
}

/// What compilers without such macros and pragmas would do: the guards are taken out.
#[test]
fn every_part_of_fast_math_fails_without_the_guards() {
    let policy = golden_case("minimal");
    let mut files = files(&policy, Output::Kit, STEPS);
    for text in files.values_mut() {
        let guard = |line: &&str| !["#error", "#pragma"].iter().any(|word| line.starts_with(word));
        *text = text
            .lines()
            .filter(guard)
            .fold(String::new(), |all, line| all + line + "\n");
    }
    let folder = tempfile::tempdir().unwrap();
    write(&files, folder.path());
    let [core, kit] = sources(&policy);
    let flags: &[&[&str]] = &[
        &["gcc", "-ffast-math"],
        &["gcc", "-fassociative-math", "-fno-signed-zeros", "-fno-trapping-math"],
        &["gcc", "-freciprocal-math"],
        &["gcc", "-fno-signed-zeros"],
        &["gcc", "-ffinite-math-only"],
        &["clang", "-ffast-math"],
        &["clang", "-freciprocal-math"],
        &["clang", "-fno-signed-zeros"],
        &["clang", "-ffinite-math-only"],
        #[cfg(target_arch = "x86_64")]
        &["gcc", "-mfma", "-ffp-contract=fast"],
    ];
    for flags in flags {
        let built = build(&[*flags, &["-O2"]].concat(), &[&core, &kit], folder.path());
        assert_eq!(built.code, Some(0), "{}", built.stderr);
        let ran = run_program(None, folder.path());
        assert!(ran.code == Some(1) && ran.stdout.contains("FAIL"), "{flags:?}: {ran:?}");
    }
    let built = build(&["gcc", "-O2", "-ffp-contract=off"], &[&core, &kit], folder.path());
    assert_eq!((built.code, run_program(None, folder.path()).code), (Some(0), Some(0)));
}

/// A board without main and standard output: the user calls the kit and reads its result.
#[test]
fn the_kit_runs_without_main_and_standard_output() {
    let policy = golden_case("minimal");
    let folder = tempfile::tempdir().unwrap();
    write(&files(&policy, Output::Kit, STEPS), folder.path());
    let own = "#include <stdint.h>\nuint32_t minimal_kit_run(void);\nint main(void) { return minimal_kit_run() == 0u ? 17 : 1; }\n";
    std::fs::write(folder.path().join("own.c"), own).unwrap();
    let compiler = ["gcc", "-DMINIMAL_KIT_NO_MAIN", "-DMINIMAL_KIT_NO_STDIO", "-O2"];
    build_silently(&compiler, &["minimal.c", "minimal_kit.c", "own.c"], folder.path());
    assert_eq!(run_program(None, folder.path()).code, Some(17));
}

#[test]
fn the_kits_of_two_policies_link_into_one_program() {
    let (one, two) = (golden_case("minimal"), golden_case("linear"));
    let folder = tempfile::tempdir().unwrap();
    write(&files(&one, Output::Kit, STEPS), folder.path());
    write(&files(&two, Output::Kit, STEPS), folder.path());
    let compiler = ["gcc", "-DLINEAR_KIT_NO_MAIN", "-O2"];
    let sources = ["minimal.c", "minimal_kit.c", "linear.c", "linear_kit.c"];
    build_silently(&compiler, &sources, folder.path());
    assert_eq!(run_program(None, folder.path()).code, Some(0));
}
