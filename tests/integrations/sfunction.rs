//! The S-function under a strict stand-in for `simstruc.h`, built as MEX file and for a real-time target.

use std::path::Path;

use codegen::Output;
use policy::Policy;
use tests::tools::Ran;

use super::{build, build_silently, example, files, golden_case, run_program, write};

mod config;
mod several;

use config::config;

const C90: &[&str] = &[
    "-std=c90",
    "-pedantic",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Wshadow",
    "-Werror",
];
const MEX: &str = "-DMATLAB_MEX_FILE";
const REAL_TIME: &str = "-DRT";

struct Bench {
    folder: tempfile::TempDir,
    name: String,
}

impl Bench {
    fn new(policy: &Policy) -> Self {
        let folder = tempfile::tempdir().unwrap();
        write(&files(policy, Output::Sfunction, 1), folder.path());
        tests::tools::copy_folder(&tests::root().join("tests/integrations/simulink"), folder.path());
        std::fs::write(folder.path().join("config.h"), config(policy)).unwrap();
        Self {
            folder,
            name: policy.name.clone(),
        }
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Compiles one file to an object of that name.
    fn object(&self, compiler: &[&str], flags: &[&str], source: &str, object: &str) -> Ran {
        let built = build(&[compiler, flags, &["-c", "-I."]].concat(), &[source], self.path());
        if built.code == Some(0) {
            std::fs::rename(self.path().join("program"), self.path().join(object)).unwrap();
        }
        built
    }

    /// Core, block and harness, which a planted fault of the S-function does not touch.
    fn prepare(&self, compiler: &[&str]) {
        self.prepare_with(compiler, C90);
    }

    /// The same with other flags for core and block.
    fn prepare_with(&self, compiler: &[&str], flags: &[&str]) {
        let own = [format!("{}.c", self.name), format!("{}_block.c", self.name)];
        for (source, object) in own.iter().zip(["core.o", "block.o"]) {
            let built = self.object(compiler, flags, source, object);
            assert!(built.code == Some(0) && built.stderr.is_empty(), "{}", built.stderr);
        }
        for (source, object) in [("standin.c", "standin.o"), ("harness.c", "harness.o")] {
            let built = self.object(compiler, &["-std=c99", "-Wall", "-Wextra", "-Werror"], source, object);
            assert_eq!(built.code, Some(0), "{}", built.stderr);
        }
    }

    /// Builds the S-function itself and links.
    fn build(&self, compiler: &[&str], mode: &str) -> Ran {
        let source = format!("sf_{}.c", self.name);
        let built = self.object(compiler, &[C90, &[mode]].concat(), &source, "sf.o");
        if built.code != Some(0) {
            return built;
        }
        let objects = ["sf.o", "core.o", "block.o", "standin.o", "harness.o", "-lm"];
        build(compiler, &objects, self.path())
    }

    fn text(&self, file: &str) -> String {
        std::fs::read_to_string(self.path().join(file)).unwrap()
    }
}

#[track_caller]
fn passes(policy: &Policy, compiler: &[&str], emulator: Option<&str>) {
    let bench = Bench::new(policy);
    bench.prepare(compiler);
    for mode in [MEX, REAL_TIME] {
        let built = bench.build(compiler, mode);
        assert_eq!(
            (built.code, built.stderr.as_str()),
            (Some(0), ""),
            "{compiler:?} {mode}"
        );
        let ran = run_program(emulator, bench.path());
        assert!(
            ran.code == Some(0) && ran.stdout.starts_with("PASS: 20000 steps"),
            "{} {compiler:?} {mode}: {ran:?}",
            policy.name
        );
    }
}

#[test]
fn twenty_thousand_steps_of_two_instances_equal_the_core() {
    passes(&example(), &["gcc", "-O2"], None);
    passes(&golden_case("constructs"), &["clang", "-O1"], None);
    passes(&golden_case("wide"), &["gcc", "-O2"], None);
}

#[test]
fn sanitisers_have_nothing_to_say_about_codes_and_the_four_term_mapping() {
    let sanitised = [
        "gcc",
        "-O1",
        "-fsanitize=address,undefined,float-cast-overflow",
        "-fno-sanitize-recover=all",
    ];
    passes(&golden_case("adc_mapping"), &sanitised, None);
}

#[test]
fn the_steps_equal_the_core_on_a_big_endian_machine() {
    for name in ["constructs", "wide"] {
        passes(
            &golden_case(name),
            &["powerpc-linux-gnu-gcc", "-static", "-O2"],
            Some("qemu-ppc"),
        );
    }
}

#[test]
fn policies_without_mapping_have_one_parameter() {
    passes(&golden_case("minimal"), &["gcc", "-O1"], None);
}

/// A fault of each kind that the stand-in and the harness look for: text, its replacement, the complaint.
const FAULTS: &[(&str, &str, &str)] = &[
    // call phases and declarations
    (
        "#define S_FUNCTION_NAME sf_NAME",
        "#define S_FUNCTION_NAME sf_other",
        "S_FUNCTION_NAME is not",
    ),
    (
        "#define S_FUNCTION_LEVEL 2",
        "#define S_FUNCTION_LEVEL 1",
        "S_FUNCTION_LEVEL is 2",
    ),
    (
        "ssSetInputPortDirectFeedThrough(S, port, 1)",
        "ssSetInputPortDirectFeedThrough(S, port, 0)",
        "without DirectFeedThrough",
    ),
    (
        "ssSetInputPortRequiredContiguous(S, port, 1)",
        "ssSetInputPortRequiredContiguous(S, port, 0)",
        "wants RequiredContiguous",
    ),
    ("        ssSetInputPortWidth(S, port, 1);\n", "", "no scalar double"),
    (
        "        ssSetOutputPortDataType(S, port, SS_DOUBLE);\n",
        "",
        "was not declared",
    ),
    ("ssSetSampleTime(S, 0, ", "ssSetSampleTime(S, 0, 2.0 * ", "sample time"),
    (
        "    ssSetNumSampleTimes(S, 1);\n",
        "    ssSetNumSampleTimes(S, 1);\n    ssSetOffsetTime(S, 0, 0.0);\n",
        "wrong phase",
    ),
    ("    ssSetDWorkUsedAsDState(S, 0, 1);\n", "", "is no state"),
    (
        "    ssSetSimStateCompliance(S, USE_DEFAULT_SIM_STATE);\n",
        "",
        "SimState",
    ),
    ("#define MDL_UPDATE\n", "", "mdlUpdate is missing"),
    (
        "#define MDL_INITIALIZE_CONDITIONS\n",
        "",
        "mdlInitializeConditions is missing",
    ),
    (
        "#define MDL_UPDATE\n",
        "#define MDL_UPDATE\n#define MDL_START\n",
        "mdlStart",
    ),
    // memory
    (
        "(int_T)UPPER_BLOCK_WORK)",
        "(int_T)UPPER_BLOCK_WORK - 1)",
        "beside the DWork",
    ),
    (
        "ssGetOutputPortRealSignal(S, 0)[0] =",
        "ssGetOutputPortRealSignal(S, 0)[1] = 0.0;\n    ssGetOutputPortRealSignal(S, 0)[0] =",
        "beside an output",
    ),
    (
        "    real_T inputs[UPPER_BLOCK_INPUTS];\n    NAME_block_answer answer;",
        "    static real_T inputs[UPPER_BLOCK_INPUTS];\n    static NAME_block_answer answer;\n    static int_T calls = 0;\n    calls = calls + 1;\n    if ((calls % 50) == 0) { return; }",
        "duty",
    ),
    // what is computed when
    ("ssGetOutputPortRealSignal(S, 2)[0] = answer.status;", "", "status"),
    (
        "    read_inputs(S, inputs);\n    NAME_block_outputs(",
        "    read_inputs(S, inputs);\n    UPDATE\n    NAME_block_outputs(",
        "mdlOutputs changed the state",
    ),
    (
        "    NAME_block_update((real_T *)ssGetDWork(S, 0), inputs",
        "    inputs[0] = 0.0;\n    NAME_block_update((real_T *)ssGetDWork(S, 0), inputs",
        "",
    ),
    // parameters
    (
        "    if (ssGetNumSFcnParams(S) != ssGetSFcnParamsCount(S)) {\n        return;\n    }\n",
        "",
        "",
    ),
    ("!mxIsDouble(given) || ", "", "a wrong parameter is accepted"),
    ("mxIsComplex(given) || ", "", "a complex parameter is accepted"),
    (
        "(mxGetNumberOfElements(given) != 1)",
        "0",
        "a wrong parameter is accepted",
    ),
    (
        "if (!NAME_block_accepts(values)) {",
        "if (!NAME_block_accepts(values) && (index < 0)) {",
        "a wrong parameter is accepted",
    ),
    (
        "if (!((value >= 0.0) && (value <= 1.0))) {",
        "if (value > 1.0) {",
        "a wrong parameter is accepted",
    ),
    ("(port == DIAGNOSTICS) ? 0 : 1", "0", "run-time parameters"),
    // the two trailers
    (
        "#ifdef MATLAB_MEX_FILE\n#include",
        "#ifndef MATLAB_MEX_FILE\n#include",
        "belongs into",
    ),
];

#[test]
fn a_planted_fault_of_each_kind_is_caught() {
    let policy = golden_case("constructs");
    let bench = Bench::new(&policy);
    bench.prepare(&["gcc", "-O1"]);
    let file = format!("sf_{}.c", policy.name);
    let good = bench.text(&file);
    let fill = |text: &str| {
        let update = "{ real_T values[4] = { 0.0, 0.0, 0.0, 0.0 }; constructs_block_update((real_T *)ssGetDWork(S, 0), inputs, values); }";
        text.replace("NAME", &policy.name)
            .replace("UPPER", &policy.name.to_uppercase())
            .replace("UPDATE\n", &format!("{update}\n"))
    };
    for (from, to, complaint) in FAULTS {
        // the macros of the S-function interface hold the same word
        let from = fill(&from.replace("MDL_UPDATE", "MDL_?")).replace("MDL_?", "MDL_UPDATE");
        let to = fill(&to.replace("MDL_UPDATE", "MDL_?").replace("S_FUNCTION_NAME", "S_?"))
            .replace("MDL_?", "MDL_UPDATE")
            .replace("S_?", "S_FUNCTION_NAME");
        let from = from.replace("S_FUNCTION_constructs", "S_FUNCTION_NAME");
        assert!(good.contains(&from), "{from}");
        std::fs::write(bench.path().join(&file), good.replacen(&from, &to, 1)).unwrap();
        let built = bench.build(&["gcc", "-O1"], MEX);
        let said = match built.code {
            Some(0) => run_program(None, bench.path()),
            _ => built,
        };
        assert_ne!(said.code, Some(0), "not caught: {from} -> {to}");
        let text = said.stdout + &said.stderr;
        assert!(text.contains(complaint), "{from} -> {to}\nexpected {complaint}\n{text}");
    }
}

/// What only MATLAB offers, outside of the guards, does not build for a real-time target.
#[test]
fn a_call_of_matlab_outside_of_the_guards_is_caught() {
    let policy = golden_case("minimal");
    let bench = Bench::new(&policy);
    bench.prepare(&["gcc", "-O0"]);
    let file = "sf_minimal.c";
    let good = bench.text(file);
    for (from, to) in [
        (
            "    UNUSED_ARG(tid);\n",
            "    UNUSED_ARG(tid);\n    (void)mexPrintf(\"\");\n",
        ),
        (
            "#if defined(MATLAB_MEX_FILE)\n#define MDL_RTW",
            "#if 1\n#define MDL_RTW",
        ),
    ] {
        assert!(good.contains(from), "{from}");
        std::fs::write(bench.path().join(file), good.replacen(from, to, 1)).unwrap();
        assert_ne!(bench.build(&["gcc", "-O0"], REAL_TIME).code, Some(0), "{from}");
    }
}

/// The functions that the Legacy Code Tool and the C Caller call: the same bits as the S-function's.
#[test]
fn the_c_caller_steps_as_the_block_does() {
    let policy = golden_case("constructs");
    let bench = Bench::new(&policy);
    let program = "#include <string.h>
#include \"constructs_caller.h\"
#include \"constructs_block.h\"
int main(void)
{
    static double work[CONSTRUCTS_BLOCK_WORK];
    const double coefficients[4] = { 1.03, -0.0025, 0.006, 0.0009 };
    double inputs[CONSTRUCTS_BLOCK_INPUTS];
    double one[3];
    double two[3];
    int i;
    constructs_block_init(work, coefficients);
    for (i = 0; i < 2000; ++i) {
        inputs[0] = 40.0 + 0.37 * (double)(i % 41);
        inputs[1] = 1500.0 + (double)(i % 1300);
        inputs[2] = 0.01 * (double)(i % 1009);
        inputs[3] = (i % 97 == 0) ? 0.0 : 1.0;
        constructs_block_step(work, inputs, coefficients, one);
        constructs_caller_step(inputs, two);
        if (memcmp(one, two, sizeof(one)) != 0) {
            return 1;
        }
    }
    return 0;
}
";
    std::fs::write(bench.path().join("caller_test.c"), program).unwrap();
    let compiler = [&["gcc", "-O1"], C90].concat();
    let sources = [
        "caller_test.c",
        "constructs_caller.c",
        "constructs_block.c",
        "constructs.c",
    ];
    build_silently(&compiler, &sources, bench.path());
    assert_eq!(run_program(None, bench.path()).code, Some(0));
    // the specification names the functions as they are declared
    let legacy = bench.text("legacy_constructs.m");
    assert!(legacy.contains("void constructs_block_init(double work1["), "{legacy}");
    assert!(legacy.contains("double u1[4], double p1[4], double y1[3])"), "{legacy}");
}

/// No tool here reads TLC: at least every directive is closed and every function called exists.
#[test]
fn the_tlc_file_is_balanced_and_calls_functions_of_the_block() {
    let policy = golden_case("constructs");
    let files = files(&policy, Output::Sfunction, 1);
    let tlc = &files["sf_constructs.tlc"];
    let count = |word: &str| tlc.lines().filter(|line| line.trim_start().starts_with(word)).count();
    assert_eq!(count("%function"), count("%endfunction"));
    assert_eq!(count("%if"), count("%endif"));
    assert_eq!(
        (tlc.matches("%<").count(), tlc.matches('{').count()),
        (tlc.matches(">").count(), tlc.matches('}').count())
    );
    assert_eq!(
        tlc.lines().find(|line| line.starts_with("%implements")),
        Some("%implements \"sf_constructs\" \"C\"")
    );
    for call in tlc.split("constructs_block_").skip(1) {
        let name: String = call
            .chars()
            .take_while(|c| c.is_ascii_alphanumeric() || *c == '_')
            .collect();
        let declared = format!("constructs_block_{name}");
        assert!(files["constructs_block.h"].contains(&declared), "{declared}");
    }
}
