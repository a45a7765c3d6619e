//! Generated C calls what it defines: every function with the controller's prefix that a file names is in the core, in every
//! format and on every target.
#![allow(clippy::unwrap_used)]

mod common;
use std::collections::BTreeSet;

use codegen::Output;
use common::*;
use policy::{Activation, NumericFormat, Policy};
use targets::TargetSpec;

/// Words of a text that begin with the prefix and stand before a parenthesis; comments and texts in quotes are left out.
fn called(text: &str, prefix: &str) -> BTreeSet<String> {
    let text = without_comments(text);
    let mut found = BTreeSet::new();
    for (at, _) in text.match_indices('(') {
        let before = text[..at].trim_end();
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let start = before.rfind(|c| !is_word(c)).map_or(0, |at| at + 1);
        let word = &before[start..];
        if word.starts_with(prefix) {
            found.insert(word.to_owned());
        }
    }
    found
}

fn without_comments(text: &str) -> String {
    let mut parts = text.split("/*");
    let first = parts.next().unwrap().to_owned();
    parts.fold(first, |all, part| all + part.split_once("*/").unwrap().1)
}

/// Functions that the text defines: a line that begins with a type and ends the parameters without a semicolon.
fn defined(text: &str, prefix: &str) -> BTreeSet<String> {
    let lines = text.lines().filter(|line| {
        let is_start = line.starts_with(|c: char| c.is_ascii_alphabetic());
        is_start && line.contains('(') && !line.trim_end().ends_with(';')
    });
    let macros = text.lines().filter(|line| line.starts_with("#define "));
    lines.chain(macros).flat_map(|line| called(line, prefix)).collect()
}

#[track_caller]
fn assert_defined(policy: &Policy, target: &TargetSpec) {
    let Ok(files) = codegen::sources(policy, target, &[Output::C], None) else {
        // no type for the format
        assert!(target.widths.char_bits > 8);
        return;
    };
    let text: String = files.files.into_values().collect();
    let prefix = format!("{}_", policy.name);
    let (called, defined) = (called(&text, &prefix), defined(&text, &prefix));
    let missing: Vec<&String> = called.difference(&defined).collect();
    let what = (&policy.name, policy.numeric_format, target.name);
    assert!(missing.is_empty(), "{what:?}: {missing:?} of {defined:?}");
    assert!(called.len() > 10, "{what:?}: {called:?}");
}

#[test]
fn every_case_defines_what_it_calls_in_every_format() {
    for policy in cases() {
        for format in NumericFormat::ALL {
            assert_defined(&policy.clone().with_format(format), target("host"));
        }
    }
}

#[test]
fn every_activation_is_defined_with_an_fpu_and_without() {
    for activation in Activation::EACH {
        let mut policy = case("tail_blocks");
        policy.layers[0].activation = *activation;
        for format in NumericFormat::ALL {
            let policy = policy.clone().with_format(format);
            for name in ["host", "cortex-m0plus"] {
                assert_defined(&policy, target(name));
            }
        }
    }
}

#[test]
fn a_call_without_a_definition_is_seen() {
    let text = "static float x_one(float a)\n{\n    return x_two(a) + x_one(x_MASK); /* x_three(a) */\n}\nfloat x_four(float);\n";
    let names = |all: BTreeSet<String>| all.into_iter().collect::<Vec<_>>().join(" ");
    assert_eq!(names(called(text, "x_")), "x_four x_one x_two");
    assert_eq!(names(defined(text, "x_")), "x_one");
}
