//! How faults look: on a terminal, in a pipe, with a line of the file, with a near miss.

use std::process::{Command, Stdio};

use super::{Desk, assert_refused};

/// A path on the command line is relative to the working folder, not to a file's.
#[test]
fn a_missing_path_of_the_command_line_is_not_explained_by_a_file() {
    let desk = Desk::new("minimal");
    let typed = desk.refuse(
        "compile nope --out out",
        &["cannot find the file `nope`", "working folder"],
    );
    assert!(!typed.contains("folder of the file"), "{typed}");
    desk.edit("policy/policy.toml", "weights.safetensors", "gone.safetensors");
    let named = desk.refuse(
        "compile policy --out out",
        &["gone.safetensors", "folder of the file that names them"],
    );
    assert!(!named.contains("working folder"), "{named}");
}

#[test]
fn a_plant_that_a_scenario_names_is_sought_from_its_folder() {
    let desk = Desk::new("minimal");
    let examples = tests::root().join("examples");
    tests::tools::copy_folder(&examples.join("simulate"), &desk.path("simulate"));
    tests::tools::copy_folder(&examples.join("buck12"), &desk.path("buck12"));
    let line = "simulate simulate/sb3-buck12.toml --policy buck12 --out loop";
    let named = desk.refuse(line, &["cannot find the file", "folder of the file that names them"]);
    assert!(!named.contains("working folder"), "{named}");
    let typed = desk.refuse(&format!("{line} --plant nope.toml"), &["nope.toml", "working folder"]);
    assert!(!typed.contains("folder of the file that names them"), "{typed}");
}

#[test]
fn a_name_that_is_nearly_one_is_answered_with_it() {
    let desk = Desk::new("minimal");
    for (line, near) in [
        (
            "compile policy --out out --target cortexm4",
            "did you mean `cortex-m4f`?",
        ),
        (
            "compile policy --out out --emit rust-over-cc",
            "did you mean `rust-over-c`?",
        ),
        ("compile policy --out out --format f32fma", "did you mean `f32-fma`?"),
        ("verify policy --format I16", "did you mean `i16`?"),
        ("certify policy --out out --axis v_ou", "did you mean `v_out`?"),
        (
            "compile policy --out out --target thumbv7em-none-eabihf",
            "its core is that of `cortex-m4f`",
        ),
    ] {
        desk.refuse(line, &[near, "= expected: one of "]);
    }
    assert_eq!(desk.listing(), Desk::new("minimal").listing());
}

#[test]
fn a_fault_of_a_file_shows_its_line_with_a_caret() {
    let desk = Desk::new("minimal");
    desk.edit("policy/policy.toml", "hold = 0", "hold = -3");
    let text = desk.refuse(
        "inspect policy",
        &[
            "error: `hold` is out of range",
            "= found: -3",
            "= expected: 0 to ",
            "--> policy/policy.toml:",
        ],
    );
    let lines: Vec<&str> = text.lines().collect();
    let at = lines.iter().position(|line| line.ends_with("hold = -3")).expect(&text);
    let (value, caret) = (lines[at].find("-3"), lines[at + 1].find("^^"));
    assert!(value.is_some() && value == caret, "{text}");
}

/// The standard error of a run that must be refused, on a terminal or in a pipe, with a variable set.
fn standard_error(desk: &Desk, terminal: bool, variable: Option<&str>) -> String {
    let (program, line) = (tests::tools::policyc(), "inspect nope");
    let mut command = if terminal {
        // `script` runs a command on a terminal of its own; what that shows comes on standard output
        let mut command = Command::new("script");
        command.args(["-qec", &format!("{} {line}", program.display()), "/dev/null"]);
        command
    } else {
        let mut command = Command::new(program);
        command.args(line.split(' '));
        command
    };
    for name in ["NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE"] {
        command.env_remove(name);
    }
    command
        .env("TERM", "xterm")
        .current_dir(desk.folder.path())
        .stdin(Stdio::null());
    if let Some(name) = variable {
        command.env(name, "1");
    }
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned()
}

#[test]
fn a_pipe_gets_no_escape_unless_it_asks_for_them() {
    let desk = Desk::new("minimal");
    assert!(!standard_error(&desk, false, None).contains('\u{1b}'));
    assert!(standard_error(&desk, false, Some("CLICOLOR_FORCE")).contains('\u{1b}'));
}

#[cfg(target_os = "linux")]
#[test]
fn a_terminal_gets_colours_unless_it_wants_none() {
    let desk = Desk::new("minimal");
    let missing = Command::new("script").arg("--version").output().is_err();
    if missing {
        eprintln!("skipped: `script` is not on PATH");
        return;
    }
    assert!(standard_error(&desk, true, None).contains('\u{1b}'));
    let plain = standard_error(&desk, true, Some("NO_COLOR"));
    assert!(
        plain.contains("cannot find the file") && !plain.contains('\u{1b}'),
        "{plain:?}"
    );
}

/// A file of the user must not move the cursor.
#[test]
fn control_characters_of_a_file_are_not_passed_on() {
    for (value, said) in [
        ("\"\\u001b[2J\"", "`hold` is of the wrong kind"),
        ("\"\u{1b}[2J\"", "this is not valid TOML"),
    ] {
        let desk = Desk::new("minimal");
        desk.edit("policy/policy.toml", "hold = 0", &format!("hold = {value}"));
        let ran = desk.type_in("inspect policy");
        assert_refused(&ran, &[said]);
        assert!(!ran.stderr.contains('\u{1b}'), "{:?}", ran.stderr);
    }
}
