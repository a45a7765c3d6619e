//! The integrity check in slices: all of the tables, once, and nothing that was changed unseen.

use std::process::Command;

use codegen::{Language, Output};
use policy::{NumericFormat, Policy};

/// Sizes of slices: some that divide no table, one larger than all tables.
const COUNTS: [usize; 4] = [1, 7, 1000, 1_000_000];

const MAIN_C: &str = r#"#include <stdio.h>
#include <stdlib.h>
#include "buck12.h"
int main(int count_of_arguments, char **arguments)
{
    buck12_check check = { 0u, 0u };
    uint32_t count = (uint32_t)atoi(arguments[1]), found, calls, turn;
    (void)count_of_arguments;
    for (turn = 0u; turn < 2u; ++turn) {
        for (calls = 1u; (found = buck12_integrity_slice(&check, count)) == BUCK12_INTEGRITY_RUNNING; ++calls) { }
        printf("%u after %u; ", (unsigned)found, (unsigned)calls);
    }
    check.position = 0xFFFFFFFFu;
    while ((found = buck12_integrity_slice(&check, count)) == BUCK12_INTEGRITY_RUNNING) { }
    printf("%u; no progress %u\n", (unsigned)found, (unsigned)buck12_integrity_slice(&check, 0u));
    return 0;
}
"#;

const MAIN_RUST: &str = r#"
#[allow(dead_code)]
mod buck12;
fn main() {
    let count: u32 = std::env::args().nth(1).unwrap().parse().unwrap();
    let mut check = buck12::IntegrityCheck::new();
    let mut found = 0;
    for _ in 0..2 {
        let mut calls = 1;
        let intact = loop {
            if let Some(intact) = check.slice(count) { break intact }
            calls += 1;
        };
        found = if intact { 1 } else { 2 };
        print!("{found} after {calls}; ");
    }
    println!("{found}; no progress {}", u32::from(check.slice(0).is_some()));
}
"#;

fn example(format: NumericFormat) -> Policy {
    policy::load(&tests::example()).unwrap().with_format(format)
}

/// What the program says for a size of slices.
fn said(policy: &Policy, language: Language, edit: &dyn Fn(&str) -> String, count: usize) -> String {
    let folder = tempfile::tempdir().unwrap();
    let files = codegen::generate(policy, targets::host(), &[language.core()], None)
        .unwrap()
        .files;
    for (name, text) in &files {
        std::fs::write(folder.path().join(name), edit(text)).unwrap();
    }
    let (main, text, compiler, arguments): (_, _, _, &[&str]) = match language {
        Language::C => (
            "main.c",
            MAIN_C,
            "gcc",
            &[
                "-std=c99",
                "-O1",
                "-ffp-contract=off",
                "buck12.c",
                "main.c",
                "-o",
                "program",
            ],
        ),
        Language::Rust => (
            "main.rs",
            MAIN_RUST,
            "rustc",
            &["--edition=2021", "-O", "main.rs", "-o", "program"],
        ),
    };
    std::fs::write(folder.path().join(main), text).unwrap();
    let built = Command::new(compiler)
        .current_dir(folder.path())
        .args(arguments)
        .output()
        .unwrap();
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let output = Command::new(folder.path().join("program"))
        .arg(count.to_string())
        .output()
        .unwrap();
    String::from_utf8(output.stdout).unwrap()
}

/// Numbers of the tables: every weight, bias and duty once. In integers the host's rows are whole words already.
fn numbers(policy: &Policy) -> usize {
    let layers = policy.layers.iter();
    let layers: usize = layers.map(|layer| layer.inputs * layer.outputs + layer.outputs).sum();
    layers + policy.outputs()
}

#[test]
fn slices_of_any_size_read_all_tables_once() {
    for format in [NumericFormat::F32, NumericFormat::F64, NumericFormat::I16] {
        let policy = example(format);
        for language in [Language::C, Language::Rust] {
            for count in COUNTS {
                let calls = numbers(&policy).div_ceil(count);
                let expected = format!("1 after {calls}; 1 after {calls}; 1; no progress 0\n");
                let found = said(&policy, language, &str::to_owned, count);
                assert_eq!(found, expected, "{} {language:?} {count}", format.name());
            }
        }
    }
}

/// The first number of a table with another first digit.
fn changed(text: &str, table: &str) -> String {
    let Some(start) = text.find(table).map(|at| at + table.len()) else {
        return text.to_owned();
    };
    let at = start + text[start..].find(|c: char| c.is_ascii_digit()).unwrap();
    let digit = if text[at..].starts_with('3') { "4" } else { "3" };
    format!("{}{digit}{}", &text[..at], &text[at + 1..])
}

#[test]
fn a_changed_number_in_any_table_is_found() {
    let policy = example(NumericFormat::F32);
    let found = |language: Language, table: &str| {
        let edit = |text: &str| changed(text, table);
        said(&policy, language, &edit, 97)
    };
    let tables = [
        ("weights0", 384),
        ("bias0", 64),
        ("weights1", 4096),
        ("bias1", 64),
        ("weights2", 768),
        ("bias2", 12),
        ("duties", 12),
    ];
    for (table, length) in tables {
        let text = found(
            Language::C,
            &format!("static const float buck12_{table}[{length}] = {{"),
        );
        assert!(text.starts_with("2 after"), "{table}: {text}");
    }
    for table in ["WEIGHTS0:", "BIAS1:", "WEIGHTS2:", "DUTIES:"] {
        let files = codegen::generate(&policy, targets::host(), &[Output::Rust], None)
            .unwrap()
            .files;
        let text = &files["buck12.rs"];
        let at = text.find(&format!("static {table}")).unwrap();
        let values = at + text[at..].find("= ").unwrap();
        let head = text[at..values + 2].to_owned();
        let text = found(Language::Rust, &head);
        assert!(text.starts_with("2 after"), "{table} {text}");
    }
}
