//! What `verify` and `prove` read: manifests, generated code, object files, a clock of the command line.

use std::path::Path;

use equivalence::{Reading, Source, Sources, goals};
use verify::budget::Clock;
use verify::elf::Elf;
use verify::folder::Asked;

use super::Target;
use super::seeds::{answer, at, files, read};
use crate::forms::Form;
use crate::guard::{Answer, Limits, Reader};

const CASE: &str = "tests/golden/cases/linear";

pub(super) static TARGETS: &[Target] = &[
    Target {
        name: "manifest",
        about: "manifest.json of a folder of generated code",
        form: Form::Bytes,
        words: &[
            "target",
            "languages",
            "doors",
            "kit_steps",
            "\"c\"",
            "\"rust\"",
            "\"kit\"",
            "\"host\"",
            "\"cortex-m4\"",
            "null",
            "{}",
            "[]",
            "files",
            "\"simulink\"",
            "\"fmu\"",
            "4294967296",
            "-1",
            "[[[[[[[[",
        ],
        limits: Limits::READER,
        seeds: || {
            files(&[
                "tests/golden/buck12/manifest.json",
                "tests/golden/cases/minimal/expected/manifest.json",
                "tests/golden/integrations/adc_mapping/manifest.json",
                "tests/golden/integrations/minimal/manifest.json",
            ])
        },
        reader: || {
            Ok(Box::new(|bytes| match std::str::from_utf8(bytes) {
                Ok(text) => answer(Asked::read(Path::new("manifest.json"), text), |_| "manifest".to_owned()),
                Err(_) => Answer::refused("no text"),
            }))
        },
    },
    Target {
        name: "generated-c",
        about: "C of a folder, as the proof reads it",
        form: Form::Bytes,
        words: C_WORDS,
        limits: Limits::READER,
        seeds: || files(&["tests/golden/cases/linear/expected/linear.c"]),
        reader: generated_c,
    },
    Target {
        name: "generated-rust",
        about: "Rust of a folder, as the proof reads it",
        form: Form::Bytes,
        words: RUST_WORDS,
        limits: Limits::READER,
        seeds: || files(&["tests/golden/cases/linear/expected/linear.rs"]),
        reader: generated_rust,
    },
    Target {
        name: "elf",
        about: "object files and images of 32 bits",
        form: Form::Bytes,
        words: &[".text", ".bss", ".symtab", "\u{7f}ELF\u{1}\u{1}\u{1}"],
        limits: Limits::READER,
        seeds: || Ok(vec![object(false), object(true)]),
        reader: || Ok(Box::new(elf)),
    },
    Target {
        name: "clock",
        about: "the clock of a processor on the command line",
        form: Form::Bytes,
        words: &[
            "168MHz", "48 MHz", "1.2GHz", "32768Hz", "k", "M", "G", ".", "e3", "\u{b5}", "\u{2126}",
        ],
        limits: Limits::READER,
        seeds: || {
            Ok(["168MHz", "48 MHz", "1.2GHz", "32768Hz"]
                .map(|text| text.as_bytes().to_vec())
                .to_vec())
        },
        reader: || {
            Ok(Box::new(|bytes| match Clock::parse(&String::from_utf8_lossy(bytes)) {
                Ok(clock) => {
                    let again = Clock::parse(&clock.to_string());
                    assert!(again.is_ok(), "a clock is not read as it is shown: {clock}");
                    Answer::accepted("clock")
                }
                Err(message) => Answer::refused(message),
            }))
        },
    },
];

const C_WORDS: &[&str] = &[
    "static",
    "const",
    "float",
    "uint32_t",
    "int32_t",
    "if",
    "else",
    "for",
    "return",
    "struct",
    "(",
    ")",
    "{",
    "}",
    "[",
    "]",
    "->",
    ".",
    "&",
    "*",
    "+",
    "-",
    "<<",
    ">>",
    "?",
    ":",
    "!",
    "==",
    "!=",
    "<=",
    "0u",
    "1.0f",
    "0x1p-3f",
    "#if",
    "#endif",
    "#define",
    "/*",
    "*/",
    "//",
    "((((((((((((((((",
    "----------------",
    "union",
    "memcpy",
    "sizeof",
];
const RUST_WORDS: &[&str] = &[
    "fn",
    "let",
    "mut",
    "const",
    "static",
    "f32",
    "u32",
    "i32",
    "if",
    "else",
    "for",
    "in",
    "return",
    "struct",
    "impl",
    "self",
    "&mut",
    "as",
    "to_bits",
    "from_bits",
    "wrapping_add",
    "(",
    ")",
    "{",
    "}",
    "[",
    "]",
    "0u32",
    "1.0f32",
    "0..",
    "..=",
    "#[inline]",
    "unsafe",
    "match",
    "((((((((((((((((",
    "----------------",
    "macro_rules!",
    "'a'",
    "r#\"",
];

fn case() -> Result<(policy::Policy, String, String, String), String> {
    let policy = policy::load(&at(&format!("{CASE}/policy.toml"))).map_err(|faults| faults.faults.to_string())?;
    let text = |end: &str| {
        Ok::<_, String>(String::from_utf8_lossy(&read(&format!("{CASE}/expected/linear.{end}"))?).into_owned())
    };
    Ok((policy, text("h")?, text("c")?, text("rs")?))
}

fn generated_c() -> Result<Box<Reader>, String> {
    let (policy, header, ..) = case()?;
    Ok(Box::new(move |bytes| {
        let text = String::from_utf8_lossy(bytes);
        let source = |name, text| Source { name, text };
        judged(
            &policy,
            &Sources {
                c: Some((source("a.h", &header), source("a.c", &text))),
                readings: &[Reading::Compiler, Reading::FramaC],
                rust: None,
            },
        )
    }))
}

fn generated_rust() -> Result<Box<Reader>, String> {
    let (policy, ..) = case()?;
    Ok(Box::new(move |bytes| {
        let text = String::from_utf8_lossy(bytes);
        let answer = judged(
            &policy,
            &Sources {
                rust: Some(Source {
                    name: "a.rs",
                    text: &text,
                }),
                ..Sources::default()
            },
        );
        // a parse keeps its text for the life of the thread: right for a compiler, without bound for a million inputs
        proc_macro2::extra::invalidate_current_thread_spans();
        answer
    }))
}

fn judged(policy: &policy::Policy, sources: &Sources<'_>) -> Answer {
    match goals(policy, sources) {
        Ok(goals) => Answer::accepted(format!("goals {}", goals.is_empty())),
        Err(refusal) => Answer::refused(refusal.message),
    }
}

fn elf(bytes: &[u8]) -> Answer {
    match Elf::read(bytes) {
        None => Answer::refused("no ELF file of 32 bits"),
        Some(elf) => {
            let sizes = (elf.flash_bytes() > 0, elf.ram_bytes() > 0);
            let found = elf.address("a_step").is_some();
            Answer::accepted(format!("sections {sizes:?} {found}"))
        }
    }
}

/// Name, type, flags, data; link, information, size of an entry.
type Section<'a> = (u32, u32, u32, &'a [u8], [u32; 3]);

/// A small object file: code, cleared memory, one symbol. Sections as in the specification of ELF.
fn object(is_big: bool) -> Vec<u8> {
    const NAMES: &[u8] = b"\0.text\0.bss\0.symtab\0.strtab\0";
    let word = |number: u32| {
        if is_big {
            number.to_be_bytes()
        } else {
            number.to_le_bytes()
        }
    };
    let half = |number: u16| {
        if is_big {
            number.to_be_bytes()
        } else {
            number.to_le_bytes()
        }
    };
    let (code, strings) = ([0_u8; 16], b"\0a_step\0");
    // symbol: name, value, size, info, other, section
    let symbol = [&word(1)[..], &word(0x101), &word(16), &[0x12, 0], &half(1)].concat();
    let symbols = [&[0; 16][..], &symbol].concat();
    let (mut content, mut rows) = (Vec::new(), [0; 40].to_vec());
    let sections: [Section<'_>; 5] = [
        (1, 1, 6, &code, [0, 0, 0]),
        (7, 8, 3, &[], [0, 0, 0]),
        (12, 2, 0, &symbols, [4, 1, 16]),
        (20, 3, 0, strings, [0, 0, 0]),
        (20, 3, 0, NAMES, [0, 0, 0]),
    ];
    for (name, kind, flags, data, [link, info, entry]) in sections {
        let size = if kind == 8 { 64 } else { data.len() as u32 };
        let at = 52 + content.len() as u32;
        for number in [name, kind, flags, 0, at, size, link, info, 4, entry] {
            rows.extend(word(number));
        }
        content.extend_from_slice(data);
    }
    let mark = [0x7f, b'E', b'L', b'F', 1, if is_big { 2 } else { 1 }, 1];
    let mut bytes = mark.to_vec();
    bytes.resize(16, 0);
    // an object for Arm, version 1
    bytes.extend([half(1), half(40)].concat());
    bytes.extend([word(1), word(0), word(0), word(52 + content.len() as u32), word(0)].concat());
    bytes.extend([52_u16, 0, 0, 40, 6, 5].map(half).concat());
    [bytes, content, rows].concat()
}
