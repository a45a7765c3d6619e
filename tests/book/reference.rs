//! Reference pages that would drift without a test: commands and status bits.

use std::process::Command;

use tests::tools::{bless, policyc, run};

const PAGE: &str = "docs/reference/commands.md";

const HEAD: &str = "\
<!-- written by `cargo xtask bless` from the commands' own --help: edit the texts there -->

# Commands

Each command prints its section of this page with `--help`, and a summary of it with `-h`. [Exit codes](exit-codes.md) are the same for
all of them.
";

fn help(words: &[&str]) -> String {
    let mut command = Command::new(policyc());
    // clap wraps at the width of the terminal, and at this one where there is none
    command.args(words).arg("--help").env("COLUMNS", "100");
    let ran = run(&mut command);
    assert_eq!(ran.code, Some(0), "{words:?}\n{}", ran.stderr);
    ran.stdout
}

/// Names below `Commands:`.
fn subcommands(help: &str) -> Vec<String> {
    let rows = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let rows = rows.take_while(|line| line.starts_with("  "));
    let names = rows
        .filter(|line| !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next());
    names.filter(|name| *name != "help").map(str::to_owned).collect()
}

fn section(words: &[&str], page: &mut String) {
    let text = help(words);
    let title = [&["policyc"], words].concat().join(" ");
    let shown = text.lines().map(str::trim_end).collect::<Vec<_>>().join("\n");
    page.push_str(&format!("\n## {title}\n\n```text\n{}\n```\n", shown.trim_end()));
    for name in subcommands(&text) {
        section(&[words, &[name.as_str()]].concat(), page);
    }
}

#[test]
fn golden_page_of_commands_is_what_they_say_of_themselves() {
    let mut page = HEAD.to_owned();
    section(&[], &mut page);
    let path = tests::root().join(PAGE);
    if bless() {
        std::fs::write(&path, &page).unwrap();
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        found == page,
        "{PAGE} is not what --help says: `cargo xtask bless` writes it"
    );
    // a command that the walk over the help misses would be missing in silence
    for name in ["new", "compile", "verify", "drm acquire", "drm transfer"] {
        assert!(page.contains(&format!("\n## policyc {name}\n")), "{name}");
    }
}

/// The header of a golden case stands for every generated one.
#[test]
fn the_page_of_status_bits_has_every_bit_of_the_header() {
    let header = std::fs::read_to_string(tests::root().join("tests/golden/cases/paper/expected/paper.h")).unwrap();
    let page = std::fs::read_to_string(tests::root().join("docs/reference/status-bits.md")).unwrap();
    let bits = header
        .lines()
        .filter_map(|line| line.strip_prefix("#define PAPER_STATUS_"));
    let mut count = 0;
    for bit in bits {
        let mut words = bit.split_whitespace();
        let (name, value) = (words.next().unwrap(), words.next().unwrap().trim_end_matches('u'));
        let row = format!("| {value} | `{name}` |");
        assert!(page.contains(&row), "no row {row}");
        count += 1;
    }
    assert!(count > 0, "the header has its bits in another form");
}
