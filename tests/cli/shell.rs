//! `policyc completions` and `policyc manpages`: what an installation asks for.

use std::process::Command;

use tests::tools::{listing, run};

use super::Desk;

/// What bash offers for the last of these words, asked as readline asks.
fn completed(desk: &Desk, words: &[&str]) -> Vec<String> {
    desk.write("completions.bash", &desk.succeed("completions bash"));
    // the function that is registered for the program, with the three arguments that bash gives it
    let script = r#"
        source ./completions.bash
        function=$(complete -p policyc | sed 's/.*-F \([^ ]*\).*/\1/')
        COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
        "$function" policyc "${COMP_WORDS[COMP_CWORD]}" "${COMP_WORDS[COMP_CWORD - 1]}"
        printf '%s\n' "${COMPREPLY[@]}"
    "#;
    let mut bash = Command::new("bash");
    bash.args(["--norc", "-c", script, "bash"]).args(words);
    let ran = run(bash.current_dir(desk.folder.path()));
    assert_eq!((ran.code, ran.stderr.as_str()), (Some(0), ""), "{words:?}");
    ran.stdout.lines().map(str::to_owned).collect()
}

#[test]
fn bash_completes_commands_options_and_values() {
    let desk = Desk::new("minimal");
    assert_eq!(completed(&desk, &["policyc", "com"]), ["compile", "completions"]);
    assert_eq!(completed(&desk, &["policyc", "drm", "ac"]), ["acquire"]);
    assert_eq!(
        completed(&desk, &["policyc", "verify", "--dri"]),
        ["--drift-only"],
        "an option"
    );
    assert_eq!(
        completed(&desk, &["policyc", "compile", "--format", "i"]),
        ["i16", "i8"],
        "a value"
    );
    assert_eq!(completed(&desk, &["policyc", "frobnicat"]), [""], "nothing");
}

#[test]
fn every_shell_gets_a_script_that_knows_the_commands_and_others_are_refused() {
    let desk = Desk::new("minimal");
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = desk.succeed(&format!("completions {shell}"));
        for word in ["policyc", "simulate", "drift-only", "acquire"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    desk.refuse("completions tcsh", &["unknown shell `tcsh`", "bash, zsh, fish"]);
}

/// Names of the pages that a command and those below it ought to have.
fn expected(command: &clap::Command, name: &str, pages: &mut Vec<String>) {
    pages.push(format!("{name}.1"));
    for below in command.get_subcommands() {
        expected(below, &format!("{name}-{}", below.get_name()), pages);
    }
}

#[test]
fn each_command_has_a_page_that_names_its_options_and_renders_without_a_warning() {
    let desk = Desk::new("minimal");
    desk.succeed("manpages --out man");
    let mut pages = Vec::new();
    expected(&cli::api::command(), "policyc", &mut pages);
    pages.sort();
    assert!(pages.len() > 15, "{pages:?}");
    assert_eq!(listing(&desk.path("man")), pages);
    for page in &pages {
        let text = desk.read(&format!("man/{page}"));
        assert!(text.contains("\\-\\-quiet"), "{page}");
        // a line of text that begins like a macro would vanish
        let known = ["TH", "SH", "PP", "TP", "RS", "RE", "IP", "br", "ie", "el", "\\\""];
        for line in text.lines().filter(|line| line.starts_with(['.', '\''])) {
            assert!(known.iter().any(|name| line[1..].starts_with(name)), "{page}: {line}");
        }
        if verify::toolchain::find("groff").is_none() {
            eprintln!("groff is not here: the rendering of {page} is NOT tested");
            continue;
        }
        let mut groff = Command::new("groff");
        groff.args(["-man", "-Tutf8", "-Kutf8", "-ww"]);
        let ran = run(groff.arg(desk.path("man").join(page)));
        assert_eq!((ran.code, ran.stderr.as_str()), (Some(0), ""), "{page}");
        assert!(ran.stdout.contains("Only answers and errors"), "{page}\n{}", ran.stdout);
    }
    assert!(desk.read("man/policyc-verify.1").contains("\\-\\-drift\\-only"));
}

#[test]
fn pages_replace_pages_and_nothing_that_others_wrote() {
    let desk = Desk::new("minimal");
    desk.succeed("manpages --out man");
    desk.edit("man/policyc-drm.1", "Duty ratio mapping", "An older version");
    desk.succeed("manpages --out man");
    assert!(desk.read("man/policyc-drm.1").contains("Duty ratio mapping"));
    desk.write("man/policyc-drm.1", "mine");
    let page = desk.read("man/policyc.1");
    desk.write("man/policyc.1", &format!("{page}an older version"));
    desk.refuse(
        "manpages --out man",
        &["policyc-drm.1 was not written by policyc", "--force"],
    );
    assert_eq!(desk.read("man/policyc-drm.1"), "mine");
    assert_ne!(desk.read("man/policyc.1"), page, "all or nothing");
    desk.succeed("manpages --out man --force");
    assert_eq!(desk.read("man/policyc.1"), page);
}
