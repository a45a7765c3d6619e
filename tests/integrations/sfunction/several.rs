//! Several outputs: a port for each duty and action, parameters for each mapping.

use codegen::Output;

use super::super::{files, legs, run_program};
use super::{Bench, MEX, passes};

#[test]
fn each_duty_of_several_has_a_port_and_each_mapping_its_parameters() {
    passes(&legs("constructs"), &["gcc", "-O2"], None);
    passes(&legs("wide"), &["clang", "-O1"], None);
    let powerpc = ["powerpc-linux-gnu-gcc", "-static", "-O2"];
    passes(&legs("constructs"), &powerpc, Some("qemu-ppc"));
    let files = files(&legs("constructs"), Output::Sfunction, 1);
    let source = &files["sf_constructs.c"];
    let out = "Ports out: duty_left, duty_right, duty_mid, action_left, action_right, action_mid, status;";
    let parameters = "Parameters: a_left, b_left, c_left, r_left, a_right, b_right, c_right, diagnostics";
    assert!(source.contains(out) && source.contains(parameters), "{source}");
    let readme = &files["README_sfunction.md"];
    for part in [
        "1 `duty_left`, 2 `duty_right`, 3 `duty_mid`, 4 `action_left`",
        "also 8 `q` [5], 9 `observation` [12]",
        "else duty_left 0.02, duty_right 0.05, duty_mid 0.1, state",
        "`duty_left` is 0.02, `duty_right` is 0.05, `duty_mid` is 0.1.",
    ] {
        assert!(readme.contains(part), "{part}\n{readme}");
    }
}

/// What would be right with one duty, or in the first of several.
#[test]
fn a_planted_fault_in_a_port_or_parameter_of_several_is_caught() {
    let policy = legs("constructs");
    let bench = Bench::new(&policy);
    let faults = [
        ("sf_constructs.c", "= answer.duty_right;", "= answer.duty_left;", "duty"),
        (
            "sf_constructs.c",
            "= answer.action_right;",
            "= answer.action_left;",
            "action",
        ),
        (
            "constructs_block.c",
            "= (double)command.duty[2];",
            "= (double)command.duty[0];",
            "duty",
        ),
        (
            "constructs_block.c",
            "command.duty[1] = CONSTRUCTS_BLOCK_FALLBACK_RIGHT;",
            "command.duty[1] = CONSTRUCTS_BLOCK_FALLBACK_LEFT;",
            "duty",
        ),
        (
            "constructs_block.c",
            "own->refused |=",
            "own->refused =",
            "a wrong parameter is accepted",
        ),
        (
            "constructs_block.c",
            "(&own->state, a_right, b_right, c_right)",
            "(&own->state, a_left, b_left, c_left)",
            "",
        ),
    ];
    for (file, from, to, complaint) in faults {
        let good = bench.text(file);
        assert!(good.contains(from), "{from}\n{good}");
        std::fs::write(bench.path().join(file), good.replacen(from, to, 1)).unwrap();
        let relaxed = ["gcc", "-O1"];
        bench.prepare_with(&relaxed, &["-std=c90"]);
        let built = bench.build(&relaxed, MEX);
        assert_eq!(built.code, Some(0), "{}", built.stderr);
        let said = run_program(None, bench.path());
        assert_ne!(said.code, Some(0), "not caught: {from} -> {to}");
        assert!(said.stdout.contains(complaint), "{from} -> {to}\n{}", said.stdout);
        std::fs::write(bench.path().join(file), good).unwrap();
    }
}
