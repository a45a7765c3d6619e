//! Planted faults: each must be seen by the importing program or by FMPy.

use super::super::golden_case;
use tests::tools::is_without;

use super::unit::{Descriptions, Unit, VERSIONS};
use codegen::Output;

/// Ending of the file, text, its replacement, what is said of it: anything where nothing is given.
type Fault = (&'static str, &'static str, &'static str, &'static str);

const FAULTS: &[Fault] = &[
    // the token
    (
        "_fmu.c",
        "(strcmp(token, CONSTRUCTS_FMU_TOKEN) != 0)",
        "(0)",
        "another token is refused",
    ),
    (
        "_fmu.c",
        "(token == NULL) || ",
        "(token == NULL) ? 0 : ",
        "no token is refused",
    ),
    // steps
    (
        "_fmu.c",
        "!(magnitude(step - CONSTRUCTS_FMU_PERIOD) <= slack)",
        "0",
        "another step size is refused",
    ),
    (
        "_fmu.c",
        "const double slack = 1e-6",
        "const double slack = 1e-2",
        "another step size is refused",
    ),
    (
        "_fmu.c",
        "!(magnitude(time - fmu->state.next) <= slack)",
        "0",
        "another communication point is refused",
    ),
    (
        "_fmu.c",
        "fmu->state.next = time + CONSTRUCTS_FMU_PERIOD;",
        "",
        "a step of the control period is taken",
    ),
    // outputs and state
    (
        "_fmu.c",
        "constructs_block_step(fmu->state.work, fmu->state.inputs, fmu->state.coefficients, fmu->state.outputs);",
        "constructs_block_update(fmu->state.work, fmu->state.inputs, fmu->state.coefficients);",
        "outputs follow the inputs",
    ),
    (
        "_fmu.c",
        "constructs_block_step(fmu->state.work, fmu->state.inputs, fmu->state.coefficients, fmu->state.outputs);",
        "evaluate(fmu);",
        "",
    ),
    (
        "_fmu.c",
        "constructs_block_step(fmu->state.work,",
        "static double shared[CONSTRUCTS_BLOCK_WORK]; static int first = 1; if (first) { first = 0; memcpy(shared, \
         fmu->state.work, sizeof(shared)); } constructs_block_step(shared,",
        "",
    ),
    (
        "_fmu.c",
        "constructs_block_init(fmu->state.work, fmu->state.coefficients);\n    evaluate(fmu);",
        "evaluate(fmu);",
        "",
    ),
    ("_fmu.c", "memcpy(&fmu->state, state, sizeof(fmu->state));", "", ""),
    (
        "_fmu.c",
        "(other.signature == SIGNATURE)",
        "(1)",
        "bytes that are no state are refused",
    ),
    (
        "_fmu.c",
        "(size != sizeof(other))",
        "(0)",
        "a part of a state is refused",
    ),
    // variables
    ("_fmu.c", "|| (types[index] != type)", "", "another type"),
    (
        "_fmu.c",
        "(reference <= INPUTS + OUTPUTS)",
        "(reference < INPUTS)",
        "an output cannot be set",
    ),
    ("_fmu.c", "fmu->state.tuned = 1u;", "", "is warned of"),
    (
        "_fmu.c",
        "if (constructs_block_accepts(fmu->state.coefficients) == 0)",
        "if (0)",
        "ends the initialisation",
    ),
    // modes
    ("_fmu.c", "if ((fmu->state.mode & modes) != 0u)", "if (1)", "no step"),
];

#[test]
fn planted_faults_are_seen_by_the_importing_program() {
    if is_without("FMPy") {
        return;
    }
    let policy = golden_case("constructs");
    let good = VERSIONS.map(|output| Unit::new(&policy, output));
    good.iter().for_each(Unit::build_importer);
    for (index, (ending, from, to, complaint)) in FAULTS.iter().enumerate() {
        // the faults are in what both versions share
        let unit = Unit::edited(&policy, VERSIONS[index % 2], ending, from, to);
        unit.take_importer(&good[index % 2]);
        let ran = unit.check();
        assert_eq!(ran.code, Some(1), "not seen: {from} -> {to}");
        assert!(
            ran.stdout.starts_with("FAIL: ") && ran.stdout.contains(complaint),
            "{from} -> {to}\n{}",
            ran.stdout
        );
    }
}

/// The same in the shells.
#[test]
fn planted_faults_of_the_shells_are_seen() {
    if is_without("FMPy") {
        return;
    }
    let policy = golden_case("minimal");
    let faults: &[(Output, Fault)] = &[
        (
            Output::Fmu2,
            ("_fmi2.c", "release(&callbacks, c);", "", "all memory is given back"),
        ),
        (
            Output::Fmu2,
            (
                "_fmi2.c",
                "own->fmu.state.next = start;",
                "",
                "a step of the control period is taken",
            ),
        ),
        (
            Output::Fmu3,
            (
                "_fmi3.c",
                "own->fmu.state.next = start;",
                "",
                "a step of the control period is taken",
            ),
        ),
        (
            Output::Fmu2,
            (
                "_fmi2.c",
                "if (callbacks->logger != NULL)",
                "if (0)",
                "no step without initialisation",
            ),
        ),
        (
            Output::Fmu3,
            (
                "_fmi3.c",
                "if (own->log != NULL)",
                "if (0)",
                "no step without initialisation",
            ),
        ),
        (
            Output::Fmu2,
            (
                "_fmi2.c",
                "type != fmi2CoSimulation",
                "0",
                "other kinds of FMU are refused",
            ),
        ),
        (
            Output::Fmu3,
            ("_fmi3.c", "if (event_mode)", "if (0)", "other kinds of FMU are refused"),
        ),
        (
            Output::Fmu3,
            (
                "_fmi3.c",
                "*last = own->fmu.state.next;",
                "*last = -2.0;",
                "a step of the control period is taken",
            ),
        ),
    ];
    let good = VERSIONS.map(|output| Unit::new(&policy, output));
    good.iter().for_each(Unit::build_importer);
    for (output, (ending, from, to, complaint)) in faults {
        let unit = Unit::edited(&policy, *output, ending, from, to);
        unit.take_importer(&good[usize::from(*output == Output::Fmu3)]);
        let ran = unit.check();
        assert_eq!(ran.code, Some(1), "not seen: {from} -> {to}");
        assert!(ran.stdout.contains(complaint), "{from} -> {to}\n{}", ran.stdout);
    }
}

#[test]
fn fmpy_sees_faults_of_the_description() {
    if is_without("FMPy") {
        return;
    }
    let policy = golden_case("adc_mapping");
    let common: [(&str, &str); 3] = [
        (" start=\"true\"", ""),
        ("variability=\"tunable\"", "variability=\"constant\""),
        ("name=\"duty\"", "name=\"status\""),
    ];
    let two = [
        ("<Unknown index=\"4\"/>", ""),
        ("<Unknown index=\"4\"/>", "<Unknown index=\"3\"/>"),
        ("guid=", "uuid="),
    ];
    let three = [
        ("<Output valueReference=\"4\"/>", ""),
        ("causality=\"independent\"", "causality=\"local\""),
        ("instantiationToken=", "guid="),
    ];
    let (mut descriptions, mut edits) = (Descriptions::default(), Vec::new());
    for (output, own) in VERSIONS.into_iter().zip([two, three]) {
        for (from, to) in common.into_iter().chain(own) {
            descriptions.add(&policy, output, from, to);
            edits.push((from, to));
        }
    }
    for (problem, edit) in descriptions.problems().iter().zip(edits) {
        assert!(!problem.is_empty(), "not seen: {edit:?}");
    }
}
