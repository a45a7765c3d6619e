//! The back-to-back kit passes under every compiler here and fails where code, flags or machine differ.

use std::collections::BTreeMap;

use codegen::Output;
use policy::{NumericFormat, Policy};
use tests::tools::Ran;

use super::{build, build_silently, example, files, golden_case, legs, run_program, write};

const STEPS: u32 = 200;

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

fn sources(policy: &Policy) -> [String; 2] {
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

/// Each of these leaves the first output as it is, apart from the last, which would show in the status word alone.
#[test]
fn a_defect_in_an_output_that_is_not_the_first_fails() {
    let policy = legs("constructs");
    let edits = [
        (
            "constructs_greedy(&outputs[2], 2u)",
            "constructs_greedy(&outputs[0], 2u)",
        ),
        (
            "constructs_greedy(&outputs[2], 2u)",
            "constructs_greedy(&outputs[1], 2u)",
        ),
        ("command->duty[1];", "command->duty[0];"),
        ("= command->duty_sim[1];", "= command->duty_sim[0];"),
        ("= command->duty[2];", "= command->duty_sim[2];"),
        ("state->mapping_b_right = b;", "state->mapping_b_right = a;"),
        ("^ constructs_bits(state->mapping_c_right)", ""),
        (
            "state->mapping_check_right = 0x4B4B4B4Bu",
            "state->mapping_check_right = 0x4B4B4B4Au",
        ),
        ("state->soft_cap_right = ", "state->soft_cap_left = "),
        (
            "state->previous_command_mid = 0.5f",
            "state->previous_command_mid = 0.50000006f",
        ),
    ];
    all_fail(&policy, &edits);
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

/// Runs the kit with an edited core.
fn edited(policy: &Policy, edits: &[(&str, &str)]) -> Vec<Ran> {
    let folder = tempfile::tempdir().unwrap();
    let files = files(policy, Output::Kit, STEPS);
    write(&files, folder.path());
    let [core, kit] = sources(policy);
    let built = build(&["gcc", "-O1", "-c"], &[&kit], folder.path());
    assert_eq!(built.code, Some(0), "{}", built.stderr);
    std::fs::rename(folder.path().join("program"), folder.path().join("kit.o")).unwrap();
    let run_one = |(from, to): &(&str, &str)| {
        assert!(files[&core].contains(from), "{from}");
        std::fs::write(folder.path().join(&core), files[&core].replacen(from, to, 1)).unwrap();
        build_silently(&["gcc", "-O1"], &[&core, "kit.o"], folder.path());
        run_program(None, folder.path())
    };
    edits.iter().map(run_one).collect()
}

/// Each edit alone makes the kit fail.
fn all_fail(policy: &Policy, edits: &[(&str, &str)]) {
    for (ran, (from, to)) in edited(policy, edits).into_iter().zip(edits) {
        assert!(
            ran.code == Some(1) && ran.stdout.contains("FAIL"),
            "{from} => {to}: {ran:?}"
        );
    }
}

pub fn first_literal(text: &str, table: &str) -> String {
    let start = text.find(table).unwrap();
    let open = start + text[start..].find("{\n").unwrap() + 1;
    text[open..].split(',').next().unwrap().trim().to_owned()
}

/// The literal with its lowest bit changed.
pub fn flipped(literal: &str) -> String {
    let value: f32 = literal.trim_end_matches('f').parse().unwrap();
    format!("{:e}f", f32::from_bits(value.to_bits() ^ 1))
}

/// A number that a core in binary64 rounds to binary32 on its way.
#[test]
fn a_number_of_half_the_width_fails() {
    let policy = golden_case("wide");
    for ran in edited(
        &policy,
        &[
            ("front->observation[0] = ", "front->observation[0] = (double)(float)"),
            ("command->duty_sim = ", "command->duty_sim = (double)(float)"),
            ("state->held[i] = ", "state->held[i] = (double)(float)"),
        ],
    ) {
        assert_eq!(ran.code, Some(1), "{ran:?}");
        assert!(ran.stdout.contains("FAIL"), "{ran:?}");
    }
}

#[test]
fn a_flipped_weight_bit_fails() {
    let policy = example();
    let text = files(&policy, Output::Kit, STEPS)["buck12.c"].clone();
    let literal = first_literal(&text, "buck12_weights0[");
    let ran = edited(&policy, &[(&literal, &flipped(&literal))]).remove(0);
    assert_eq!(ran.code, Some(1), "{ran:?}");
    assert!(ran.stdout.starts_with("buck12: FAIL: "), "{ran:?}");
    let failed = ran.stdout.split(' ').nth(2).unwrap().parse::<u32>().unwrap();
    // not the integrity check alone: the known answers and the moves see it as well
    assert!(failed > 2, "{ran:?}");
}

#[test]
fn an_edited_constant_of_mapping_limits_or_status_fails() {
    let policy = golden_case("adc_mapping");
    let edits = [
        (
            "state->previous_command = 0.1f;",
            "state->previous_command = 0.1000001f;",
        ),
        ("0.083333336f", "0.08333334f"),
        (
            "ADC_MAPPING_STATUS_FALLBACK & (usable",
            "ADC_MAPPING_STATUS_HELD & (usable",
        ),
        ("state->mapping_r = r;", "state->mapping_r = a;"),
        (
            "state->held[i] = front->signal[i];",
            "state->held[0] = front->signal[0];",
        ),
    ];
    all_fail(&policy, &edits);
}

/// What a random run of some hundred steps meets seldom or never: limits far from the actions, the last bridged sample, the
/// end of a range, equal values of two actions, a state that is not sound, a coefficient that another check word stands
/// beside, the clip end of what a filter remembers, the number of a self-test vector, the position of a sliced check, a
/// checksum that is compared by order.
#[test]
fn an_edit_where_random_moves_seldom_come_fails() {
    let policy = example();
    let edits = [
        ("(v3, 0.4f, 0.59999996f)", "(v3, 0.38f, 0.59999996f)"),
        ("(v3, 0.4f, 0.59999996f)", "(v3, 0.4f, 0.62f)"),
        (
            "state->primed & buck12_flag(bad_count <= 3u)",
            "state->primed & buck12_flag(bad_count <= 4u)",
        ),
        ("measured->i_out, -1.0f, 40.0f", "measured->i_out, -1.0f, 40.04f"),
        ("buck12_flag(output > best)", "buck12_flag(output >= best)"),
        ("(4u - state->bad_count) |", "(5u - state->bad_count) |"),
        ("^ buck12_bits(state->mapping_c);", ";"),
        (
            "state->mapping_check = 0x4B4B4B4Bu",
            "state->mapping_check = 0x4B4B4B4Au",
        ),
        (
            "buck12_any(buck12_mapping_flips(state))",
            "(buck12_any(buck12_mapping_flips(state)) & 1u)",
        ),
        // clip ends of what a delay remembers: no measurement reaches them within a step or from a fresh start
        ("(v13, -20.0f, 20.0f)", "(v13, -20.0f, 20.02f)"),
        ("(v26, -20.0f, 20.0f)", "(v26, -20.02f, 20.0f)"),
        ("uint32_t next = 1u;", "uint32_t next = 2u;"),
        ("next = vector + 1u;", "next = vector + 2u;"),
        // a self test that loses count, or whose end does
        ("next = vector + 1u;", "next = vector - 1u;"),
        ("(right == 16u) ?", "(right == 15u) ?"),
        ("(17u - next)", "(18u - next)"),
        ("++right;", ""),
        // a number that is never written: whatever the stack holds
        ("    span.to = BUCK12_ACTIONS;\n", ""),
        ("check->position = span.to;", ""),
        ("? check->position : 0u;", "? check->position : 1u;"),
        // the first slice that touches a table takes all of it: the answer is the same in the end
        (
            "to = buck12_place(span, span->to, length);",
            "to = ((span->from > span->first) || (span->to <= span->first)) ? 0u : length;",
        ),
        // the tables of a sound build have the right checksum: another one has to be brought along
        ("(span.crc ^ 0xFFFFFFFFu) == 0x", "(span.crc ^ 0xFFFFFFFFu) >= 0x"),
        ("(span.crc ^ 0xFFFFFFFFu) == 0x", "(span.crc ^ 0xFFFFFFFFu) <= 0x"),
    ];
    all_fail(&policy, &edits);
}

/// What no sound state reaches, or one number alone: a clip end behind a held number that is far outside, two clip words of which one
/// memory sets one, a duty that is no number, a number that no step reads, two counters that hide each other.
#[test]
fn an_edit_where_one_number_of_the_state_alone_leads_fails() {
    let edits = [
        ("f34 = f11 | f15", "f34 = f11 & f15"),
        ("~(uint32_t)(stray >> 31)", "~(uint32_t)(stray << 31)"),
        ("(v18, -20.0f, 20.0f)", "(v18, -19.98f, 20.0f)"),
        ("_line_far(&state->memory[0], 2u", "_line_far(&state->memory[0], 3u"),
        (
            "(4u - state->bad_count) | state->bad_count |",
            "(4u - state->bad_count) ^ state->bad_count |",
        ),
    ];
    all_fail(&example(), &edits);
}

/// Two clips of the same bits in one step: what has to be looked for.
#[test]
fn clips_that_are_wrongly_joined_fail() {
    all_fail(&golden_case("constructs"), &[("f62 = f13 | f23", "f62 = f13 ^ f23")]);
}

/// A duty that lies within its limits but for the sign, and a cap that is the duty itself.
#[test]
fn an_edit_at_a_mirrored_duty_or_an_equal_cap_fails() {
    let edits = [
        ("return above | (width - above);", "return above ^ (width - above);"),
        ("_flag(v12 > state->soft_cap)", "_flag(v12 >= state->soft_cap)"),
    ];
    all_fail(&golden_case("constructs"), &edits);
}

/// A term of the guard joined by an exclusive or shows where its neighbour is outside as well.
#[test]
fn a_guard_that_joins_its_terms_wrongly_fails() {
    let edits = [
        ("| buck12_aside(state->held[2]", "^ buck12_aside(state->held[2]"),
        ("stray |= ", "stray ^= "),
    ];
    all_fail(&example(), &edits);
}

/// A cap that ends 0.1 % too early shows where one more step comes just below the upper limit of the duty.
#[test]
fn a_soft_start_that_ends_early_or_late_fails() {
    let edits = [
        ("_flag(v0 > 0.67999995f)", "_flag(v0 > 0.67932f)"),
        ("_flag(v0 > 0.67999995f)", "_flag(v0 > 0.68068f)"),
    ];
    all_fail(&golden_case("constructs"), &edits);
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
