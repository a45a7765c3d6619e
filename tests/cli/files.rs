//! `policyc compile` and the folder it writes to.

use serde_json::Value;
use tests::tools::{policyc, run};

use super::{Desk, assert_refused, contents};

#[test]
fn compile_writes_every_file_and_the_same_again() {
    let desk = Desk::new("paper");
    let said = desk.succeed("compile policy --emit c,rust --out a/b");
    let first = contents(&desk.path("a/b"));
    let names = ["manifest.json", "paper.c", "paper.h", "paper.rs"];
    assert_eq!(first.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), names);
    for name in names {
        assert!(said.contains(name), "{name}\n{said}");
    }
    desk.succeed("compile policy/policy.toml --emit rust,c,c --out a/b");
    assert!(contents(&desk.path("a/b")) == first);
}

#[test]
fn the_manifest_names_the_files_that_were_written_and_their_lengths() {
    let desk = Desk::new("linear");
    desk.succeed("compile policy --out out");
    let manifest: Value = serde_json::from_str(&desk.read("out/manifest.json")).unwrap();
    let files = manifest["files"].as_object().unwrap();
    assert_eq!(files.keys().collect::<Vec<_>>(), ["linear.c", "linear.h"]);
    for (name, entry) in files {
        assert_eq!(entry["bytes"], desk.read(&format!("out/{name}")).len());
    }
    assert_eq!(manifest["languages"], serde_json::json!(["c"]));
}

/// All ways to name a choice are one choice: lists, repetition, any order, and the flags from before there was one.
#[test]
fn lists_repetition_and_the_older_flags_mean_the_same() {
    let desk = Desk::new("linear");
    let base = "compile policy --kit-steps 20 --out";
    desk.succeed(&format!("{base} expected --emit rust,kit,sfunction"));
    let expected = contents(&desk.path("expected"));
    let names: Vec<&str> = expected.iter().map(|(name, _)| name.as_str()).collect();
    assert!(
        names.contains(&"linear.c") && names.contains(&"linear_kit.c"),
        "{names:?}"
    );
    for choice in [
        "--emit sfunction --emit kit,rust --emit c",
        "--lang rust --door kit --door sfunction",
        "--door kit,sfunction --emit rust",
        "--lang rust,kit --emit sfunction",
    ] {
        desk.succeed(&format!("{base} out {choice}"));
        assert!(contents(&desk.path("out")) == expected, "{choice}");
        std::fs::remove_dir_all(desk.path("out")).unwrap();
    }
    // hidden, but there
    let help = desk.succeed("compile --help");
    assert!(!help.contains("--lang") && !help.contains("--door"), "{help}");
}

/// A second run leaves what is not its own alone.
#[test]
fn strangers_in_the_output_folder_are_kept() {
    let desk = Desk::new("linear");
    std::fs::create_dir(desk.path("out")).unwrap();
    desk.write("out/README.md", "mine");
    desk.write("out/linear.c", "old");
    desk.succeed("compile policy --out out");
    assert_eq!(desk.read("out/README.md"), "mine");
    assert_ne!(desk.read("out/linear.c"), "old");
}

/// Whatever stands in the way, the run ends with 2 and every file and folder is as it was.
fn nothing_written(desk: &Desk, out: &str, words: &[&str]) {
    let (names, before) = (desk.listing(), plain_files(desk));
    desk.refuse(&format!("compile policy --emit c,rust --out {out}"), words);
    assert_eq!(desk.listing(), names);
    assert!(plain_files(desk) == before, "{out}");
}

fn plain_files(desk: &Desk) -> Vec<(String, Vec<u8>)> {
    let names = desk.listing().into_iter().filter(|name| desk.path(name).is_file());
    names
        .map(|name| (name.clone(), std::fs::read(desk.path(&name)).unwrap()))
        .collect()
}

#[test]
fn a_file_in_the_place_of_the_output_folder_is_kept() {
    let desk = Desk::new("linear");
    desk.write("out", "a file");
    nothing_written(&desk, "out", &["out", "nothing written"]);
    nothing_written(&desk, "out/below/it", &["out/below/it", "nothing written"]);
}

#[test]
fn a_folder_in_the_place_of_an_output_is_kept_and_so_are_the_other_files() {
    let desk = Desk::new("linear");
    std::fs::create_dir_all(desk.path("out/linear.rs/inner")).unwrap();
    desk.write("out/linear.c", "old");
    nothing_written(&desk, "out", &["linear.rs is a folder", "nothing written"]);
}

#[test]
fn a_symbolic_link_in_the_place_of_an_output_is_not_followed() {
    let desk = Desk::new("linear");
    std::fs::create_dir(desk.path("out")).unwrap();
    desk.write("precious", "old");
    std::os::unix::fs::symlink("../precious", desk.path("out/linear.h")).unwrap();
    nothing_written(&desk, "out", &["linear.h is a symbolic link", "nothing written"]);
    std::fs::remove_file(desk.path("out/linear.h")).unwrap();
    std::os::unix::fs::symlink("nowhere", desk.path("out/linear.h")).unwrap();
    nothing_written(&desk, "out", &["linear.h is a symbolic link", "nothing written"]);
}

/// A folder on a file system that nobody may write to, root included.
#[test]
fn a_folder_that_cannot_be_written_is_named() {
    let desk = Desk::new("linear");
    nothing_written(&desk, "/proc/policyc-out", &["/proc/policyc-out", "nothing written"]);
}

/// `ulimit -f` stands in for a full disk: the write of a larger file fails half-way.
#[test]
fn a_full_disk_leaves_the_old_files_and_no_fragments() {
    let desk = Desk::new("linear");
    for old_files in [false, true] {
        if old_files {
            desk.succeed("compile policy --emit c,rust --out out");
            desk.edit("policy/policy.toml", "duty = [0.4, 0.6]", "duty = [0.41, 0.59]");
        } else {
            std::fs::create_dir(desk.path("out")).unwrap();
        }
        let before = contents(&desk.path("out"));
        let script = format!(
            "trap '' XFSZ; ulimit -f 8; exec '{}' compile policy --emit c,rust --out out",
            policyc().display()
        );
        let mut shell = std::process::Command::new("sh");
        let ran = run(shell.args(["-c", &script]).current_dir(desk.folder.path()));
        assert_refused(&ran, &["linear", "nothing written", "File too large"]);
        assert!(contents(&desk.path("out")) == before, "{:?}", desk.listing());
    }
}

#[test]
fn a_format_without_a_type_on_the_target_is_refused() {
    let desk = Desk::new("paper");
    let ran = desk.run("compile policy --target c2000-c28x --format i8 --no-costs --out out".split(" "));
    assert_refused(&ran, &["c2000-c28x", "8 bits", "--format i16"]);
    assert!(!desk.path("out").exists());
    desk.succeed("compile policy --target c2000-c28x --format i16 --no-costs --out out");
}

/// What a user has written, or changed since, is not lost by typing a command once more.
#[test]
fn files_of_others_are_kept_unless_they_are_given_up() {
    let desk = Desk::new("linear");
    desk.write("out/linear.h", "/* mine */\n");
    let before = contents(&desk.path("out"));
    desk.refuse(
        "compile policy --out out",
        &["out/linear.h was not written by policyc", "--force"],
    );
    assert!(contents(&desk.path("out")) == before, "nothing has changed");
    desk.succeed("compile policy --out out --force");
    desk.succeed("compile policy --out out --emit c,fmu3");
    desk.succeed("compile policy --out out --emit c,fmu3");
    // an archive cannot say whose it is
    desk.write("out/linear_fmi3.fmu", "mine");
    desk.refuse(
        "compile policy --out out --emit fmu3",
        &["linear_fmi3.fmu was edited since"],
    );

    desk.write("drm.toml", "a = 1.0\n");
    desk.write("points.csv", &points());
    desk.refuse("drm fit points.csv", &["drm.toml was not written by policyc"]);
    desk.succeed("drm fit points.csv --out own.toml --report own.html");
    desk.succeed("drm fit points.csv --out own.toml --report own.html");
    desk.write("own.html", "<p>mine</p>");
    desk.refuse(
        "drm fit points.csv --out own.toml --report own.html",
        &["own.html was not written"],
    );

    desk.succeed("certify policy --out certificate --boxes 10 --samples 10");
    desk.succeed("certify policy --out certificate --boxes 10 --samples 20");
    desk.write("certificate/certificate.json", "{}");
    desk.refuse(
        "certify policy --out certificate",
        &["certificate.json was edited since policyc wrote it"],
    );

    desk.succeed("demo --out demo --steps 10");
    desk.succeed("demo --out demo --steps 10");
    desk.edit("demo/policy/policy.toml", "duty = [0.40, 0.60]", "duty = [0.45, 0.55]");
    desk.refuse(
        "demo --out demo --steps 10",
        &["policy.toml was edited since policyc wrote it"],
    );
}

/// Settled points of a converter with losses.
fn points() -> String {
    let mut text = String::from("duty,v_out,i_out,v_in\n");
    for duty in [0.45, 0.5, 0.55, 0.6] {
        for i_out in [2.0, 5.0, 8.0] {
            let v_out = 200.0 * duty - 0.8 * (1.0 - duty) - 0.2 * i_out;
            text += &format!("{duty},{v_out:.4},{i_out},200.0\n");
        }
    }
    text
}

#[test]
fn a_folder_holds_the_code_of_one_policy() {
    let desk = Desk::new("linear");
    desk.succeed("compile policy --out out");
    desk.edit("policy/policy.toml", "name = \"linear\"", "name = \"other\"");
    desk.refuse(
        "compile policy --out out",
        &["the code of another policy", "= found: linear"],
    );
    desk.succeed("verify policy --steps 10");
    desk.succeed("compile policy --out apart");
}

/// A source beside the header of another run is a controller that no policy has.
#[test]
fn a_source_refuses_the_header_of_another_run() {
    let desk = Desk::new("linear");
    desk.succeed("compile policy --out first --emit c,sfunction,fmu2,kit --kit-steps 5");
    desk.edit("policy/policy.toml", "hold = ", "hold = 1");
    desk.succeed("compile policy --out second --emit c,sfunction,fmu2,kit --kit-steps 5");
    let compile = |source: &str, header: &str| {
        let mut gcc = std::process::Command::new("gcc");
        gcc.args(["-std=c99", "-fsyntax-only", "-iquote"])
            .arg(desk.path(header));
        // a header beside the source would come first
        let apart = desk.path("apart.c");
        std::fs::copy(desk.path(source), &apart).unwrap();
        run(gcc.arg(apart))
    };
    for file in [
        "linear.c",
        "linear_kit.c",
        "linear_block.c",
        "linear_caller.c",
        "linear_fmu.c",
        "linear_fmi2.c",
    ] {
        let ran = compile(&format!("first/{file}"), "first");
        assert_eq!(ran.code, Some(0), "{file}\n{}", ran.stderr);
        let ran = compile(&format!("first/{file}"), "second");
        assert!(
            ran.code == Some(1) && ran.stderr.contains("two runs of policyc"),
            "{file}\n{}",
            ran.stderr
        );
    }
}

/// `buck` with an S-function has a `buck_block.c`; so has a policy of that name.
#[test]
fn no_policy_is_called_like_a_file_beside_another() {
    let desk = Desk::new("linear");
    let all = codegen::Output::ALL.map(|output| output.name()).join(",");
    desk.succeed(&format!("compile policy --out out --kit-steps 5 --emit {all}"));
    let contract = desk.read("policy/policy.toml");
    let mut tried = 0;
    for (file, _) in contents(&desk.path("out")) {
        let (stem, ending) = file.split_once('.').unwrap();
        if stem == "linear" || !stem.contains("linear") || !["c", "h", "rs"].contains(&ending) {
            continue;
        }
        desk.write(
            "policy/policy.toml",
            &contract.replace("name = \"linear\"", &format!("name = \"{stem}\"")),
        );
        desk.refuse(
            "inspect policy",
            &["is what files beside another policy's controller are called"],
        );
        tried += 1;
    }
    assert!(tried >= 8, "{tried}");
}
