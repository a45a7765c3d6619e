//! The profile for processors without 8-bit types (TI C28x: a `char` has 16 bits, `sizeof(uint32_t)` is 2): no TI compiler is at
//! hand, so the core is built on this machine with headers that lack those types, and a lint reads its words.

use std::collections::BTreeMap;

use codegen::Output;
use policy::Policy;

use super::{build, files, golden_case, write};

const CASES: &[&str] = &[
    "constructs",
    "adc_mapping",
    "filters",
    "activations",
    "minimal",
    "linear",
    "tail_blocks",
    "paper",
];

/// Types with 8 bits or of unknown width, and what counts bytes as if they had 8 bits.
const FORBIDDEN: &[&str] = &[
    "char",
    "int8_t",
    "uint8_t",
    "int_fast8_t",
    "uint_fast8_t",
    "int_least8_t",
    "uint_least8_t",
    "short",
    "long",
    "double",
    "size_t",
    "unsigned",
];

fn core(policy: &Policy) -> BTreeMap<String, String> {
    let target = targets::find("c2000-c28x").unwrap();
    codegen::sources(policy, target, &[Output::C], None).unwrap().files
}

/// Words of C code outside of comments and strings that the profile forbids.
fn forbidden(text: &str) -> Vec<String> {
    let mut code = String::new();
    let mut rest = text;
    while let Some(start) = rest.find("/*") {
        code += &rest[..start];
        rest = rest[start..].split_once("*/").map_or("", |(_, rest)| rest);
    }
    code += rest;
    let without_strings: String = code.split('"').step_by(2).collect();
    let words = without_strings.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
    words
        .filter(|word| FORBIDDEN.contains(word))
        .map(str::to_owned)
        .collect()
}

#[test]
fn the_core_uses_no_type_of_8_bits_or_of_unknown_width() {
    for name in CASES {
        for (file, text) in core(&golden_case(name)) {
            assert_eq!(forbidden(&text), [""; 0], "{file}");
        }
    }
}

#[test]
fn the_lint_finds_what_it_looks_for() {
    let text = "/* char */ static uint8_t a[sizeof(\"char\")]; double b; uint32_t long_name;";
    assert_eq!(forbidden(text), ["uint8_t", "double"]);
}

/// `-nostdinc`: the stand-ins are the only headers there are. With 16 bits a byte, this machine's types have half the bytes.
const COMPILER: &[&str] = &[
    "gcc",
    "-std=c99",
    "-nostdinc",
    "-isystem",
    "c2000",
    "-Dsizeof(x)=(sizeof(x)/2u)",
    "-O2",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-pedantic",
    "-Werror",
    "-c",
];

fn bench(files: &BTreeMap<String, String>) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    write(files, folder.path());
    tests::tools::copy_folder(
        &tests::root().join("tests/integrations/c2000"),
        &folder.path().join("c2000"),
    );
    folder
}

#[test]
fn the_core_builds_with_headers_that_lack_8_bit_types() {
    for name in CASES {
        let policy = golden_case(name);
        let folder = bench(&core(&policy));
        for union in [
            "-DDEFAULT".to_owned(),
            format!("-D{}_UNION", policy.name.to_uppercase()),
        ] {
            let source = format!("{}.c", policy.name);
            let built = build(&[COMPILER, &[&union]].concat(), &[&source], folder.path());
            assert!(
                built.code == Some(0) && built.stderr.is_empty(),
                "{name}: {}",
                built.stderr
            );
        }
    }
}

#[test]
fn an_8_bit_type_does_not_build_with_these_headers() {
    let policy = golden_case("minimal");
    let mut files = core(&policy);
    *files.get_mut("minimal.c").unwrap() += "static uint8_t planted;\n";
    let built = build(COMPILER, &["minimal.c"], bench(&files).path());
    assert!(built.code == Some(1) && built.stderr.contains("uint8_t"), "{built:?}");
}

/// On a machine with bytes of 8 bits, the core for the C28x does not build, and says why.
#[test]
fn the_core_asserts_widths_at_compile_time() {
    let policy = golden_case("minimal");
    let files = core(&policy);
    let folder = bench(&files);
    let built = build(&["gcc", "-c"], &["minimal.c"], folder.path());
    for name in ["bytes_have_16_bits", "int_has_16_bits"] {
        assert!(
            built.code == Some(1) && built.stderr.contains(name),
            "{name}: {built:?}"
        );
    }
    // bytes of 16 bits, but types that do not have 32
    let without: Vec<&str> = COMPILER
        .iter()
        .copied()
        .filter(|flag| !flag.contains("sizeof"))
        .collect();
    let built = build(&without, &["minimal.c"], folder.path());
    let types = [
        "uint32_has_32_bits",
        "int32_has_32_bits",
        "float_has_32_bits",
        "state_is_32_bit_words",
    ];
    for name in types {
        assert!(
            built.code == Some(1) && built.stderr.contains(name),
            "{name}: {built:?}"
        );
    }
    let host = super::files(&policy, Output::C, 1);
    assert!(!host["minimal.c"].contains("limits.h"), "nothing of that elsewhere");
}

/// The kit checks widths when it is compiled, in bits and not in bytes: `sizeof(uint32_t) * CHAR_BIT`.
#[test]
fn the_kit_asserts_widths_at_compile_time() {
    let policy = golden_case("minimal");
    let mut files = files(&policy, Output::Kit, 1);
    let kit = files.get_mut("minimal_kit.c").unwrap();
    assert_eq!(kit.matches("* CHAR_BIT == 32u").count(), 2);
    // a machine whose bytes are wider than its header says
    *kit = kit.replacen(
        "#include <limits.h>",
        "#include <limits.h>\n#undef CHAR_BIT\n#define CHAR_BIT 16",
        1,
    );
    let folder = bench(&files);
    let built = build(&["gcc", "-c"], &["minimal_kit.c"], folder.path());
    assert!(
        built.code == Some(1) && built.stderr.contains("uint32_has_32_bits"),
        "{built:?}"
    );
}
