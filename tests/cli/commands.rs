//! Exit codes, help, `new` and `inspect`.

use serde_json::Value;

use super::Desk;

#[test]
fn the_help_of_every_command_names_its_arguments() {
    let desk = Desk::new("minimal");
    let overview = desk.succeed("--help");
    for (command, arguments) in [
        ("new", &["<WEIGHTS>", "--out"][..]),
        ("inspect", &["<POLICY>", "--json"]),
        ("replay", &["<POLICY>", "<LOG>", "--exploring", "--tolerance", "--json"]),
        (
            "compile",
            &[
                "<POLICY>",
                "--emit",
                "- rust-over-c:",
                "- fmu3:",
                "[default: c]",
                "--target",
                "--out",
            ],
        ),
        (
            "verify",
            &[
                "<POLICY>",
                "--steps",
                "--seed",
                "--generated",
                "--drift-only",
                "--trace",
                "--json",
            ],
        ),
        ("prove", &["<POLICY>", "--format", "--target", "--exhaustive", "--out"]),
        ("certify", &["<POLICY>", "--format", "--axis", "--at", "--out"]),
        (
            "campaign",
            &["<PLAN>", "--out", "--engine", "--task", "--write", "--json"],
        ),
        ("merge", &["<DIR>...", "--out", "--json"]),
        ("demo", &["--out", "--steps"]),
        ("drm", &["acquire", "fit", "judge", "transfer"]),
        ("simulate", &["<SCENARIO>", "--policy", "--out", "--json"]),
        (
            "train",
            &["<SETTINGS>", "--out", "--resume", "--json", "--quiet", "--verbose"],
        ),
        ("completions", &["<SHELL>", "bash", "elvish"]),
        ("manpages", &["--out", "--force"]),
    ] {
        assert!(overview.contains(&format!("\n  {command} ")), "{overview}");
        // lines are broken where the terminal ends
        let help = desk.succeed(&format!("{command} --help"));
        let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
        for argument in arguments {
            assert!(help.contains(argument), "{command}: {argument}\n{help}");
        }
    }
    assert!(overview.contains("Exit code 0"), "{overview}");
    assert!(desk.succeed("--version").starts_with("policyc "));
}

/// A name of `--emit` that no page of the integrations shows is one that nobody can use.
#[test]
fn every_output_is_in_the_documentation() {
    let page = tests::root().join("docs/integrations/README.md");
    let text = std::fs::read_to_string(page).unwrap();
    for output in codegen::Output::ALL {
        let row = format!("| `{}` |", output.name());
        assert!(text.contains(&row), "docs/integrations/README.md has no row {row}");
    }
}

#[test]
fn a_command_line_that_cannot_be_read_ends_with_2() {
    let desk = Desk::new("minimal");
    for line in [
        "compil policy",
        "compile policy",
        "compile --out out",
        "compile policy --out out --emit cobol",
        "verify policy --steps many",
        "inspect policy --yaml",
    ] {
        desk.refuse(
            line,
            &["Usage:"]
                .iter()
                .filter(|_| !line.contains("cobol") && !line.contains("many"))
                .copied()
                .collect::<Vec<_>>(),
        );
    }
    assert_eq!(desk.listing(), Desk::new("minimal").listing());
}

#[test]
fn an_unknown_target_is_answered_with_the_known_ones() {
    let desk = Desk::new("minimal");
    desk.refuse(
        "compile policy --target pdp-11 --out out",
        &["unknown target", "pdp-11", &targets::names().join(", ")],
    );
    assert!(!desk.path("out").exists());
}

#[test]
fn one_target_is_shown_by_its_name_or_by_a_part_of_it() {
    let desk = Desk::new("minimal");
    let text = desk.succeed("targets cortex-m4f");
    for word in [
        "cortex-m4f: ",
        "arm-none-eabi-gcc",
        "-ffp-contract=off",
        "thumbv7em-none-eabihf",
        "stm32g4",
    ] {
        assert!(text.contains(word), "{word}\n{text}");
    }
    assert!(!text.contains("riscv"), "{text}");
    assert_eq!(desk.succeed("targets STM32G474RE"), text);
    let compiled = desk.type_in("compile policy --target STM32G474RE --no-costs --out out");
    assert_eq!(compiled.code, Some(0), "{}", compiled.stderr);
    assert!(
        compiled.stderr.contains("STM32G474RE has the core `cortex-m4f`"),
        "{}",
        compiled.stderr
    );
    assert!(desk.succeed("targets c2000-c28x").contains("taken for zero"));
    let json: serde_json::Value = serde_json::from_str(&desk.succeed("targets cortex-m3 --json")).unwrap();
    assert_eq!(json["name"], "cortex-m3");
    desk.refuse("targets cortex-m5", &["unknown target", "did you mean"]);
}

#[test]
fn inspect_shows_formulas_layers_actions_and_sizes() {
    let desk = Desk::new("paper");
    let text = desk.succeed("inspect policy");
    for word in [
        "paper",
        "v - v_ref",
        "delay",
        "difference",
        "6 -> 5",
        "fc0",
        "0.45 +1 * 0.1 = 0.55",
        "0.97 d_sim",
        "sha256",
        "MACs",
    ] {
        assert!(text.contains(word), "{word}\n{text}");
    }
    assert_eq!(text, desk.succeed("inspect policy/policy.toml"));
}

#[test]
fn inspect_json_is_json_with_the_numbers_of_the_policy() {
    let desk = Desk::new("paper");
    let view: Value = serde_json::from_str(&desk.succeed("inspect policy --json")).unwrap();
    assert_eq!(view["name"], "paper");
    assert_eq!(view["sample_period"], 1e-4);
    assert_eq!(view["features"].as_array().unwrap().len(), 6);
    assert_eq!(view["features"][1]["name"], "e_del");
    assert_eq!(view["actions"].as_array().unwrap().len(), 9);
    assert_eq!(view["mapping"]["load_current"], 1);
    assert_eq!(view["layers"][0]["outputs"], 5);
    assert_eq!(view["sizes"]["macs"], 6 * 5 + 5 * 4 + 4 * 9);
    assert_eq!(view["digests"]["weights"].as_str().unwrap().len(), 64);
}

#[test]
fn new_writes_a_skeleton_whose_gaps_inspect_names_one_by_one() {
    let desk = Desk::new("paper");
    assert!(
        desk.succeed("new policy/weights.safetensors --out policy/fresh.toml")
            .contains("policy/fresh.toml")
    );
    let skeleton = desk.read("policy/fresh.toml");
    assert_eq!(skeleton.matches("# network input ").count(), 6, "{skeleton}");
    assert!(
        skeleton.contains(&format!("duties = [{}]", ["\"TODO\""; 9].join(", "))),
        "{skeleton}"
    );
    let faults = desk.refuse(
        "inspect policy/fresh.toml",
        &[
            "TODO",
            "`name`",
            "`hidden_activation`",
            "`source`",
            "--> policy/fresh.toml",
            "line 5: `sample_period`",
        ],
    );
    let gaps = skeleton
        .lines()
        .filter(|line| line.split('#').next().unwrap().contains("\"TODO\""))
        .count();
    let named = faults.lines().filter(|line| line.contains("still says TODO")).count();
    assert!(named >= gaps, "{gaps} gaps\n{faults}");
    assert!(faults.lines().count() <= named + 3, "a line each\n{faults}");
}

/// The contract names its weights from its own folder, wherever the command was typed.
#[test]
fn new_names_the_weights_as_the_contract_sees_them() {
    let desk = Desk::new("linear");
    std::fs::create_dir(desk.path("elsewhere")).unwrap();
    let absolute = desk.path("policy/weights.safetensors").display().to_string();
    for (weights, out, expected) in [
        (
            "policy/weights.safetensors",
            "beside.toml",
            "policy/weights.safetensors",
        ),
        (
            "policy/weights.safetensors",
            "elsewhere/policy.toml",
            "../policy/weights.safetensors",
        ),
        (
            "policy/weights.safetensors",
            "not/yet/there/policy.toml",
            "../../../policy/weights.safetensors",
        ),
        (
            "policy/weights.safetensors",
            "gone/../up.toml",
            "policy/weights.safetensors",
        ),
        (
            "./elsewhere/../policy/weights.safetensors",
            "policy/near.toml",
            "weights.safetensors",
        ),
        (&absolute, "elsewhere/absolute.toml", "../policy/weights.safetensors"),
    ] {
        desk.succeed(&format!("new {weights} --out {out}"));
        let text = desk.read(out);
        assert!(text.contains(&format!("\nweights = \"{expected}\"\n")), "{out}\n{text}");
        // the network is read: what is left to say is the user's
        let faults = desk.refuse(&format!("inspect {out}"), &["TODO"]);
        assert!(!faults.contains("cannot find"), "{faults}");
    }
}

#[cfg(unix)]
#[test]
fn new_climbs_out_of_the_folder_that_a_link_leads_to() {
    let desk = Desk::new("linear");
    std::fs::create_dir_all(desk.path("far/away")).unwrap();
    std::os::unix::fs::symlink("far/away", desk.path("link")).unwrap();
    desk.succeed("new policy/weights.safetensors --out link/policy.toml");
    assert!(
        desk.read("far/away/policy.toml")
            .contains("\nweights = \"../../policy/weights.safetensors\"\n")
    );
    desk.refuse("inspect link/policy.toml", &["TODO"]);
}

#[cfg(unix)]
#[test]
fn new_refuses_a_path_that_a_contract_cannot_hold() {
    use std::os::unix::ffi::OsStrExt;
    let desk = Desk::new("linear");
    let folder = std::ffi::OsStr::from_bytes(b"caf\xe9");
    std::fs::rename(desk.path("policy"), desk.folder.path().join(folder)).unwrap();
    let weights = std::path::Path::new(folder).join("weights.safetensors");
    let ran = desk.run([std::ffi::OsStr::new("new"), weights.as_os_str()]);
    super::assert_refused(&ran, &["UTF-8", "weights.safetensors"]);
    assert!(!desk.path("policy.toml").exists());
}

#[test]
fn a_skeleton_filled_in_compiles() {
    let desk = Desk::new("linear");
    // a name without an extension is a folder
    let said = desk.succeed("new policy/weights.safetensors --out fresh/folder");
    assert!(said.contains("fresh/folder/policy.toml"), "{said}");
    assert!(desk.path("fresh/folder/policy.toml").is_file());
    desk.succeed("new policy/weights.safetensors --out policy/filled.toml");
    for (old, new) in [
        ("name = \"controller\"", "name = \"filled\""),
        ("sample_period = \"TODO\"", "sample_period = 1e-4"),
        (
            "{ name = \"TODO\", unit = \"TODO\", range = [\"TODO\", \"TODO\"] }",
            "{ name = \"v_out\", unit = \"V\", range = [0.0, 250.0] }",
        ),
        ("source = \"TODO\"", "source = \"v_out\""),
        ("source = \"TODO\"", "source = \"100 - v_out\""),
        ("[\"TODO\", \"TODO\", \"TODO\", \"TODO\"]", "[0.1, 0.2, 0.3, 0.4]"),
    ] {
        desk.edit("policy/filled.toml", old, new);
    }
    desk.succeed("compile policy/filled.toml --out out");
    assert!(desk.path("out/filled.c").is_file());
}

#[test]
fn new_does_not_overwrite_a_contract_nor_describe_what_is_no_network() {
    let desk = Desk::new("minimal");
    let before = desk.read("policy/policy.toml");
    desk.refuse(
        "new policy/weights.safetensors --out policy/policy.toml",
        &["exists already", "--out"],
    );
    assert_eq!(desk.read("policy/policy.toml"), before);
    desk.write("text.safetensors", "no weights");
    desk.refuse("new text.safetensors", &["text.safetensors"]);
    desk.refuse(
        "new missing.safetensors",
        &["cannot find the file", "missing.safetensors"],
    );
    assert!(!desk.path("policy.toml").exists());
}

#[test]
fn every_fault_of_a_policy_is_reported_in_one_run_with_file_and_line() {
    let desk = Desk::new("paper");
    desk.edit("policy/policy.toml", "duty = [0.3, 0.7]", "duty = [0.7, 0.3]");
    desk.edit("policy/policy.toml", "hold = 3", "hlod = 3");
    desk.edit("policy/drm.toml", "a = 0.97", "a = -0.97");
    let before = desk.listing();
    for command in ["inspect policy", "compile policy --out out", "verify policy"] {
        let text = desk.refuse(
            command,
            &[
                "limits of `duty` are crossed",
                "unknown key `hlod`",
                "`a` must be greater than 0",
                "policy/drm.toml:1:",
            ],
        );
        assert_eq!(
            text.matches("\nerror: ").count() + 1,
            text.matches("error: ").count(),
            "{text}"
        );
    }
    assert_eq!(desk.listing(), before, "nothing is written on bad input");
    desk.refuse("inspect nowhere", &["cannot find the file", "nowhere"]);
}

/// `policyc inspect policy | head -1`: a reader that has gone away is no fault.
#[test]
fn a_closed_pipe_is_no_panic() {
    let desk = Desk::new("paper");
    for line in [
        "inspect policy --json",
        "inspect policy",
        "compile policy --out out",
        "new policy/weights.safetensors",
    ] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let mut command = desk.command();
        let child = command
            .args(line.split(' '))
            .stdout(writer)
            .stderr(std::process::Stdio::piped())
            .spawn();
        let output = child.unwrap().wait_with_output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), said.as_str()), (Some(0), ""), "{line}");
    }
}

/// A full disk behind `policyc inspect policy > file` is one.
#[test]
fn an_answer_that_cannot_be_written_ends_with_2() {
    let desk = Desk::new("paper");
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let output = desk
        .command()
        .args(["inspect", "policy"])
        .stdout(full)
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.starts_with("error: cannot write to standard output"), "{said}");
}
