//! The program `policyc` as a user meets it: exit codes, texts, files.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod actor;
mod budget;
mod campaign;
mod certify;
mod ci;
mod codes;
mod commands;
mod decisions;
mod design;
mod drm;
mod empirical;
mod faults;
mod files;
mod fmu;
mod gains;
mod interruption;
mod json;
mod loudness;
mod plants;
mod prove;
mod replay;
mod replayed_clips;
mod replayed_columns;
mod replayed_duties;
mod replayed_filters;
mod replayed_formats;
mod replayed_gains;
mod several;
mod shell;
mod simulate;
mod studio;
mod tables;
mod traces;
mod trained;
mod training;
mod verify;

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;

use tests::tools::{Ran, copy_folder, policyc, run};

/// A working folder with a copy of a golden case in `policy/`.
struct Desk {
    folder: tempfile::TempDir,
}

impl Desk {
    fn new(case: &str) -> Self {
        let desk = Self {
            folder: tempfile::tempdir().unwrap(),
        };
        copy_folder(
            &tests::root().join("tests/golden/cases").join(case),
            &desk.path("policy"),
        );
        std::fs::remove_dir_all(desk.path("policy/expected")).unwrap();
        desk
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn command(&self) -> Command {
        let mut command = Command::new(policyc());
        command.current_dir(self.folder.path());
        command
    }

    fn run<S: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = S>) -> Ran {
        run(self.command().args(arguments))
    }

    /// A command line without quotes.
    fn type_in(&self, line: &str) -> Ran {
        self.run(line.split(' '))
    }

    /// A run that must end with 0.
    fn succeed(&self, line: &str) -> String {
        let ran = self.type_in(line);
        assert_eq!(ran.code, Some(0), "policyc {line}\n{}{}", ran.stdout, ran.stderr);
        ran.stdout
    }

    /// A run that must end with 2, with an error that has these words and with nothing on standard output.
    #[track_caller]
    fn refuse(&self, line: &str, words: &[&str]) -> String {
        let ran = self.type_in(line);
        assert_refused(&ran, words);
        ran.stderr
    }

    fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    fn edit(&self, name: &str, old: &str, new: &str) {
        let text = self.read(name);
        assert!(text.contains(old), "{old}");
        self.write(name, &text.replacen(old, new, 1));
    }

    fn listing(&self) -> Vec<String> {
        tests::tools::listing(self.folder.path())
    }
}

#[track_caller]
fn assert_refused(ran: &Ran, words: &[&str]) {
    assert_eq!(ran.code, Some(2), "{}{}", ran.stdout, ran.stderr);
    assert_eq!(ran.stdout, "");
    assert!(ran.stderr.starts_with("error: "), "{}", ran.stderr);
    for word in words {
        assert!(ran.stderr.contains(word), "{word}\n{}", ran.stderr);
    }
}

/// Ctrl-C for a child; how it ended.
#[cfg(unix)]
fn interrupt(child: std::process::Child) -> std::process::Output {
    let signalled = run(Command::new("sh").args(["-c", &format!("kill -INT {}", child.id())]));
    assert_eq!(signalled.code, Some(0));
    child.wait_with_output().unwrap()
}

/// Name and content of each file of a folder and its folders.
fn contents(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let names = tests::tools::listing(folder);
    names
        .into_iter()
        .filter(|name| folder.join(name).is_file())
        .map(|name| (name.clone(), std::fs::read(folder.join(name)).unwrap()))
        .collect()
}
