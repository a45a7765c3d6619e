//! FMUs in FMPy and in a program of our own that imports them with the standard headers, as shared libraries and linked with
//! their prefix.

mod faults;
mod several;
mod unit;

use std::collections::BTreeSet;
use std::process::Command;

use closed_loop::{Answer, Call, External, interpreter};
use codegen::Output;
use interp::Sample;
use policy::{NumericFormat, Policy};
use tests::tools::{is_without, run, run_silently};

use super::{example, files, golden_case};
use unit::{Descriptions, Unit, VERSIONS, closed_loop, line, standard_headers};

/// 500 ms of the example.
const PERIODS: usize = 5000;

fn interpreted(policy: &Policy, periods: usize) -> Vec<(Vec<Sample>, Answer)> {
    closed_loop(policy, interpreter(policy).unwrap().as_mut(), periods)
}

fn lines(trajectory: &[(Vec<Sample>, Answer)]) -> Vec<String> {
    trajectory.iter().map(|(_, answer)| line(answer)).collect()
}

const FMPY: &[&str] = &["simulate.py"];
const FMPY_FROM_SOURCES: &[&str] = &["simulate.py", "--compile"];

/// Every duty, action and status has the interpreter's bits.
#[track_caller]
fn agrees(policy: &Policy, periods: usize, outputs: &[Output], script: &[&str]) {
    // both scripts read descriptions with it
    if is_without("FMPy") {
        return;
    }
    let trajectory = interpreted(policy, periods);
    let expected = lines(&trajectory);
    let samples: Vec<Vec<Sample>> = trajectory.into_iter().map(|(samples, _)| samples).collect();
    simulated(policy, &samples, &expected, outputs, script);
}

/// The importer answers these samples with these lines.
#[track_caller]
fn simulated(policy: &Policy, samples: &[Vec<Sample>], expected: &[String], outputs: &[Output], script: &[&str]) {
    for output in outputs {
        let unit = Unit::new(policy, *output);
        let (ran, answers) = unit.simulate(samples, script);
        let name = &policy.name;
        assert_eq!(ran.code, Some(0), "{name} {output:?}\n{}{}", ran.stdout, ran.stderr);
        assert!(!ran.stderr.contains("warning:"), "{name} {output:?}\n{}", ran.stderr);
        assert_eq!(answers.len(), samples.len());
        let different = answers.iter().zip(expected).filter(|(a, b)| a != b).count();
        assert_eq!(different, 0, "{name} {output:?}");
    }
}

#[test]
fn fmpy_validates_and_simulates_half_a_second_of_closed_loop() {
    agrees(&example(), PERIODS, &VERSIONS, FMPY);
}

#[test]
fn fmpy_compiles_the_sources_and_simulates_them() {
    agrees(&example(), PERIODS, &VERSIONS, FMPY_FROM_SOURCES);
}

#[test]
fn fmpy_takes_codes_filters_and_policies_without_mapping() {
    for name in ["adc_mapping", "filters", "activations", "linear", "wide"] {
        agrees(&golden_case(name), 500, &VERSIONS, FMPY);
    }
}

/// It does not take FMI 3.
#[test]
fn libcosim_steps_half_a_second_of_closed_loop() {
    if is_without("libcosim") {
        return;
    }
    agrees(&example(), PERIODS, &[Output::Fmu2], &["libcosim.py"]);
    agrees(&golden_case("adc_mapping"), 500, &[Output::Fmu2], &["libcosim.py"]);
}

/// The plant steps the FMU: what it answers to a sample is what the converter does until the next one.
#[test]
fn the_plant_as_importing_program_sees_the_duties_of_the_interpreter() {
    if is_without("FMPy") {
        return;
    }
    let formats = [
        NumericFormat::F32Fma,
        NumericFormat::F64,
        NumericFormat::I16,
        NumericFormat::I8,
    ];
    let others = formats.map(|format| (example().with_format(format), 1000));
    let exact = [(example(), PERIODS), (golden_case("adc_mapping"), 1000)];
    for (policy, periods) in exact.into_iter().chain(others) {
        let expected = interpreted(&policy, periods);
        for output in VERSIONS {
            let unit = Unit::new(&policy, output);
            unit.build_importer();
            let mut running = unit.run();
            let ask = |call: Call<'_>| match call {
                Call::Restart => Ok(None),
                Call::Step(samples) => {
                    let answer = running.step(samples).map(Some);
                    answer.map_err(|text| toml_input::Message::new(text).into())
                }
            };
            let found = closed_loop(&policy, &mut External::new(&policy, ask).unwrap(), periods);
            assert_eq!(lines(&found), lines(&expected), "{} {output:?}", policy.name);
        }
        // a loop that rests would say nothing
        let moved = lines(&expected).iter().collect::<BTreeSet<_>>().len();
        assert!(moved > 2, "{moved}");
    }
}

#[test]
fn instances_states_times_and_refusals_are_as_the_standard_says() {
    if is_without("FMPy") {
        return;
    }
    for policy in [
        example(),
        golden_case("constructs"),
        golden_case("wide"),
        golden_case("minimal"),
    ] {
        for output in VERSIONS {
            let unit = Unit::new(&policy, output);
            unit.build_importer();
            let ran = unit.check();
            assert_eq!(ran.stdout, "PASS\n", "{} {output:?}\n{}", policy.name, ran.stderr);
        }
    }
}

/// Links FMUs with their prefix into one program that looks at each of them.
fn link(units: &[&Unit], more: &[&str]) -> Result<Vec<String>, String> {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new("gcc");
    command.args(more).arg("main.c").current_dir(folder.path());
    let (mut declarations, mut calls) = (String::new(), String::new());
    for (index, unit) in units.iter().enumerate() {
        let main = format!("main_{index}");
        let built = unit.build_objects(&main, more);
        assert_eq!((built.code, built.stderr.as_str()), (Some(0), ""), "{main}");
        command.args(unit.objects());
        declarations += &format!("int {main}(int, char **);\n");
        calls += &format!(" || {main}(count, arguments)");
    }
    let text = format!("{declarations}int main(int count, char **arguments) {{ return 0{calls}; }}\n");
    std::fs::write(folder.path().join("main.c"), text).unwrap();
    let linked = run(command.args(["-o", "program"]));
    if linked.code != Some(0) {
        return Err(linked.stderr);
    }
    let ran = run(Command::new(folder.path().join("program")).args(["linked", "check"]));
    match ran.code {
        Some(0) => Ok(ran.stdout.lines().map(str::to_owned).collect()),
        _ => Err(ran.stdout + &ran.stderr),
    }
}

/// All four: two policies in both versions of FMI, under sanitisers.
#[test]
fn several_fmus_link_into_one_program_with_the_standard_headers() {
    if is_without("FMPy") {
        return;
    }
    let sanitised = ["-O1", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"];
    let mut units = Vec::new();
    for policy in [golden_case("constructs"), golden_case("minimal")] {
        units.extend(VERSIONS.map(|output| Unit::new(&policy, output)));
    }
    // core, block and unit are the same for both versions: each version is a program
    for version in 0..2 {
        let units = [&units[version], &units[version + 2]];
        assert_eq!(link(&units, &sanitised), Ok(vec!["PASS".to_owned(); 2]));
    }
}

#[test]
fn without_the_prefix_two_fmus_do_not_link() {
    if is_without("FMPy") {
        return;
    }
    for output in VERSIONS {
        let version = verify::fmu::version(output).unwrap().name();
        let define = format!("#define {}_FUNCTION_PREFIX", version.to_uppercase());
        let strip = |name: &str| {
            let policy = golden_case(name);
            let unit = Unit::edited(&policy, output, &format!("_{version}.h"), &define, "#define NO_PREFIX");
            // the importing program must find the plain names
            let config = std::fs::read_to_string(unit.path().join("config.h")).unwrap();
            let plain = config.replace(&format!("#define NAME {name}_"), "#define NAME");
            std::fs::write(unit.path().join("config.h"), plain).unwrap();
            unit
        };
        let error = link(&[&strip("constructs"), &strip("minimal")], &["-O1"]).unwrap_err();
        assert!(error.contains("multiple definition"), "{error}");
    }
}

/// The library offers what the standard's headers declare and nothing of the core.
#[test]
fn the_binary_exports_the_functions_of_the_standard_and_no_others() {
    if is_without("FMPy") {
        return;
    }
    for (output, count) in [(Output::Fmu2, 34), (Output::Fmu3, 75)] {
        let unit = Unit::new(&golden_case("minimal"), output);
        let version = unit.version();
        let header = std::fs::read_to_string(standard_headers().join(format!("{version}Functions.h"))).unwrap();
        // FMI 2 asks for the functions of model exchange only where it is offered
        let skipped = |line: &str| line.contains("for Model Exchange") && output == Output::Fmu2;
        let mut declared = BTreeSet::new();
        let mut skipping = false;
        let declarations = header.split("/* Inquire version numbers").last().unwrap();
        for line in declarations.lines() {
            skipping = skipped(line) || (skipping && !line.contains("for Co-Simulation"));
            if let Some(rest) = line
                .trim_start()
                .strip_prefix(&format!("{}_Export", version.to_uppercase()))
            {
                let name = rest.split_whitespace().nth(1).unwrap().trim_end_matches(';');
                declared.extend((!skipping).then(|| name.to_owned()));
            }
        }
        let symbols = run_silently(Command::new("nm").args(["-D", "--defined-only"]).arg(unit.library()));
        let exported: BTreeSet<String> = symbols
            .lines()
            .map(|l| l.rsplit(' ').next().unwrap().to_owned())
            .collect();
        assert_eq!(exported.len(), count);
        assert_eq!(exported, declared);
    }
}

#[test]
fn the_sources_are_strict_c_with_and_without_the_standard_headers() {
    if is_without("FMPy") {
        return;
    }
    let strict = "-pedantic -Wall -Wextra -Wconversion -Wshadow -Wstrict-prototypes -Wmissing-prototypes -Werror";
    let headers = format!("-isystem{}", standard_headers().display());
    for (output, dialect) in [(Output::Fmu2, "-std=c90"), (Output::Fmu3, "-std=c99")] {
        for policy in ["constructs", "minimal"] {
            let unit = Unit::new(&golden_case(policy), output);
            for compiler in ["gcc", "clang"] {
                for more in ["-O2", &headers] {
                    let mut command = Command::new(compiler);
                    command.arg(dialect).args(strict.split(' ')).args([more, "-c"]);
                    run_silently(command.args(unit.sources()).current_dir(unit.path()));
                }
            }
        }
    }
}

#[test]
fn signals_may_have_the_names_of_outputs_parameters_and_time() {
    if is_without("FMPy") {
        return;
    }
    let mut descriptions = Descriptions::default();
    for taken in ["duty", "enable", "status", "time", "a"] {
        let mut policy = golden_case("adc_mapping");
        policy.signals[0].name = taken.to_owned();
        for output in VERSIONS {
            let text = descriptions.add(&policy, output, "", "");
            let quoted = |name: &str| format!(" name=\"{name}\"");
            assert_eq!(text.matches(&quoted(taken)).count(), 1, "{text}");
            // FMI 2 does without the time
            if (taken, output) != ("time", Output::Fmu2) {
                assert!(text.contains(&quoted(&format!("{taken}_"))), "{text}");
            }
        }
    }
    assert_eq!(descriptions.problems(), [""; 10]);
}

/// A unit is free text in the contract.
#[test]
fn units_are_escaped_and_defined_whatever_they_are() {
    if is_without("FMPy") {
        return;
    }
    let mut descriptions = Descriptions::default();
    for unit in ["V", "", "ohm", "A & \"B\" <°C>", "µWb·turn"] {
        let mut policy = golden_case("minimal");
        policy.signals[0].unit = unit.to_owned();
        for output in VERSIONS {
            descriptions.add(&policy, output, "", "");
        }
    }
    assert_eq!(descriptions.problems(), [""; 10]);
}

/// Code for another processor is not built here: the importer does that.
#[test]
fn an_fmu_for_another_target_has_sources_only_and_says_so() {
    let policy = golden_case("minimal");
    let target = targets::find("dspace-ds1202").unwrap();
    let files = codegen::generate(&policy, target, &VERSIONS, None).unwrap().files;
    for archive in verify::fmu::archives(&policy, target, &VERSIONS, &files).unwrap() {
        let reason = archive.binary.unwrap_err();
        assert!(reason.contains("dspace-ds1202"), "{reason}");
        let find = |text: &str| {
            archive
                .bytes
                .windows(text.len())
                .any(|window| window == text.as_bytes())
        };
        assert!(find("sources/minimal.c") && !find("binaries/"));
    }
}

/// Another controller is another FMU; the same one is the same, bytes and all, apart from what compilers add.
#[test]
fn the_token_follows_the_controller() {
    let token = |policy: &Policy, output: Output| {
        let all = files(policy, output, 1);
        let text = &all[&format!("{}_{}.xml", policy.name, verify::fmu::version(output).unwrap().name())];
        let start = text.find('{').unwrap();
        text[start..start + 38].to_owned()
    };
    let policy = golden_case("minimal");
    let own = token(&policy, Output::Fmu2);
    assert_eq!(own, token(&policy, Output::Fmu2));
    assert_eq!(own, token(&policy, Output::Fmu3));
    let mut other = policy.clone();
    other.limits.duty.high -= 0.01;
    assert_ne!(own, token(&other, Output::Fmu2));
}

#[test]
fn compile_writes_the_archives_and_verify_finds_the_files_as_generated() {
    let folder = tempfile::tempdir().unwrap();
    let policy = tests::root().join("tests/golden/cases/minimal");
    let out = folder.path().join("out");
    let mut command = Command::new(tests::tools::policyc());
    command
        .arg("compile")
        .arg(&policy)
        .args(["--no-costs", "--emit", "fmu2", "--emit", "fmu3", "--out"]);
    let said = run_silently(command.arg(&out));
    for (file, platform) in [("minimal_fmi2.fmu", "linux64"), ("minimal_fmi3.fmu", "x86_64-linux")] {
        assert!(
            said.contains(&format!("{file}: sources and a binary for {platform}, built with")),
            "{said}"
        );
        assert!(std::fs::read(out.join(file)).unwrap().starts_with(b"PK\x03\x04"));
    }
    let mut command = Command::new(tests::tools::policyc());
    command
        .arg("verify")
        .arg(&policy)
        .args(["--steps", "100", "--generated"]);
    let ran = run(command.arg(&out));
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
}
