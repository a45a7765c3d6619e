//! What `include_policy!` says to a user: rustc run on small files with the macro's library and a fixture crate around
//! them. `cases/` must be rejected with the one error in `<name>.stderr`, `pass/` must build, run and end with 0.
//!
//! The fixture crate holds `policy/` (a copy of `examples/buck12`), `linear/` (a golden case) and `legs/` (three outputs), and in
//! `text/` the generated code of these two; a file of a policy lies in `../outside/`. Lines `//@` of a case change it:
//! `replace: OLD => NEW` in `policy/policy.toml`, `write: FILE TEXT`, `grow: FILE BYTES`, `remove: FILE`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use tests::fixture::generate;
use tests::tools::{Ran, bless, copy_folder, macro_library, run, run_silently, rustc};

struct Fixture {
    folder: tempfile::TempDir,
}

impl Fixture {
    fn new(case: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let fixture = Self { folder };
        let example = tests::root().join("examples/buck12");
        let linear = tests::root().join("tests/golden/cases/linear");
        copy_folder(&example, &fixture.path("policy"));
        copy_folder(&example, &fixture.path("../outside"));
        copy_folder(&linear, &fixture.path("linear"));
        let legs = tests::random::several::legs("constructs").unwrap();
        copy_folder(legs.folder.path(), &fixture.path("legs"));
        std::fs::create_dir(fixture.path("text")).unwrap();
        for contract in [linear.join("policy.toml"), legs.path()] {
            let policy = policy::load_with(&contract, &tests::random::several::options()).unwrap();
            let text = generate(&policy, targets::find("host").unwrap(), &[codegen::Output::Rust]).unwrap();
            let file = format!("{}.rs", policy.name);
            std::fs::write(fixture.path("text").join(&file), &text[&file]).unwrap();
        }
        for directive in case.lines().filter_map(|line| line.strip_prefix("//@ ")) {
            fixture.change(directive);
        }
        fixture
    }

    fn path(&self, name: &str) -> PathBuf {
        let root = self.folder.path();
        match name.strip_prefix("../") {
            Some(outside) => root.join(outside),
            None => root.join("crate").join(name),
        }
    }

    fn change(&self, directive: &str) {
        let (word, rest) = directive.split_once(": ").unwrap();
        let file = |rest: &str| self.path(rest.split(' ').next().unwrap());
        let last = |rest: &str| rest.split_once(' ').unwrap().1.to_owned();
        match word {
            "replace" => {
                let (old, new) = rest.split_once(" => ").unwrap();
                let text = std::fs::read_to_string(self.path("policy/policy.toml")).unwrap();
                assert!(text.contains(old), "{old}");
                std::fs::write(
                    self.path("policy/policy.toml"),
                    text.replace(old, &new.replace("\\n", "\n")),
                )
                .unwrap();
            }
            "write" => std::fs::write(file(rest), last(rest)).unwrap(),
            "grow" => {
                let file = std::fs::OpenOptions::new().write(true).open(file(rest)).unwrap();
                file.set_len(last(rest).parse().unwrap()).unwrap();
            }
            "remove" => std::fs::remove_file(file(rest)).unwrap(),
            other => panic!("no such directive: {other}"),
        }
    }

    /// rustc on `source`, seen from the root of the workspace.
    fn rustc(&self, source: &Path, flags: &[&str]) -> Command {
        let mut command = rustc();
        let library = macro_library();
        command
            .current_dir(tests::root())
            .arg(source)
            .args(["--edition=2021", "-o"]);
        command.arg(self.path("../built")).args(flags);
        command.arg(format!("--extern=policy_macro={}", library.display()));
        command.env("CARGO_MANIFEST_DIR", self.path("").components().collect::<PathBuf>());
        command
    }
}

/// The `.rs` files of `tests/ui/<folder>`, relative to the root of the workspace.
fn sources(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new("tests/ui").join(folder);
    let entries = std::fs::read_dir(tests::root().join(&folder)).unwrap();
    let names = entries.map(|entry| folder.join(entry.unwrap().file_name()));
    let mut sources: Vec<PathBuf> = names
        .filter(|name| name.extension().is_some_and(|e| e == "rs"))
        .collect();
    sources.sort();
    sources
}

fn read(source: &Path) -> String {
    std::fs::read_to_string(tests::root().join(source)).unwrap()
}

/// What rustc says about a file, each message as a person sees it; without the closing count of errors.
fn messages(fixture: &Fixture, ran: &Ran) -> Vec<(String, String)> {
    let lines = ran
        .stderr
        .lines()
        .filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let with_place = lines.filter(|message| message["spans"].as_array().is_some_and(|spans| !spans.is_empty()));
    let text = |value: &Value| {
        value
            .as_str()
            .unwrap()
            .replace(&*fixture.path("../").to_string_lossy(), "$DIR/")
    };
    with_place
        .map(|message| (text(&message["level"]), text(&message["rendered"])))
        .collect()
}

fn rejected(source: &Path) -> Result<(), String> {
    let fixture = Fixture::new(&read(source));
    let flags = ["--crate-type=lib", "--emit=metadata", "--error-format=json"];
    let ran = run(&mut fixture.rustc(source, &flags));
    let shown = source.display();
    let messages = messages(&fixture, &ran);
    let [(level, found)] = messages.as_slice() else {
        let all: String = messages.into_iter().map(|(_, text)| text).collect();
        return Err(format!("{shown}: expected exactly one error\n{all}{}", ran.stdout));
    };
    if ran.code != Some(1) || level != "error" {
        return Err(format!("{shown}: {level}, exit code {:?}\n{found}", ran.code));
    }
    let file = tests::root().join(source.with_extension("stderr"));
    if bless() {
        std::fs::write(&file, found).unwrap();
    }
    let expected = std::fs::read_to_string(&file).unwrap_or_default();
    match expected == *found {
        true => Ok(()),
        false => Err(format!("{shown}: expected\n{expected}\nfound\n{found}")),
    }
}

#[test]
fn every_rejected_call_yields_exactly_its_golden_error() {
    let faults: Vec<String> = sources("cases")
        .iter()
        .filter_map(|source| rejected(source).err())
        .collect();
    let hint = "`cargo xtask bless` rewrites the expected messages if the change is meant";
    assert!(faults.is_empty(), "{}\n{hint}", faults.join("\n"));
}

#[test]
fn a_fault_of_the_policy_is_shown_with_its_file_line_and_carets_at_the_call() {
    if bless() {
        return;
    }
    let expected = read(Path::new("tests/ui/cases/two_faults.stderr"));
    for part in [
        "--> policy/policy.toml:",
        "^^^",
        "limits of `duty` are crossed",
        "`hold` is out of range",
        "two_faults.rs:",
    ] {
        assert!(expected.contains(part), "{part}\n{expected}");
    }
}

#[test]
fn every_expected_message_belongs_to_a_case() {
    for entry in std::fs::read_dir(tests::root().join("tests/ui/cases")).unwrap() {
        let path = entry.unwrap().path();
        assert!(path.with_extension("rs").is_file(), "{} without a case", path.display());
    }
}

#[test]
fn every_accepted_call_builds_without_a_warning_and_runs() {
    let sources = sources("pass");
    assert!(sources.len() >= 6);
    for source in sources {
        let fixture = Fixture::new(&read(&source));
        run_silently(&mut fixture.rustc(&source, &["-Dwarnings"]));
        run_silently(&mut Command::new(fixture.path("../built")));
    }
}

/// The harness itself: a second error beside the macro's must not go unnoticed.
#[test]
fn a_second_error_is_counted() {
    let fixture = Fixture::new("//@ replace: hold = 3 => hold = -3\n");
    let source = fixture.path("two.rs");
    std::fs::write(
        &source,
        "policy_macro::include_policy!(\"policy/policy.toml\");\npub use buck12::NoSuchItem;\n",
    )
    .unwrap();
    let flags = ["--crate-type=lib", "--emit=metadata", "--error-format=json"];
    let ran = run(&mut fixture.rustc(&source, &flags));
    assert_eq!(messages(&fixture, &ran).len(), 2, "{}", ran.stderr);
}
