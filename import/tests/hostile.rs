//! Files that are cut off, damaged, or made to hold a reader up: refused, and at once.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::disallowed_methods)]

mod common;

use std::time::{Duration, Instant};

use common::library::{fixture, refusal};
use common::write;
use import::Options;

// the longest that a file may keep a user waiting for a refusal
// wall clock on a machine that does other work beside: ten times the 0.2 s that they take at most on a calm core, and far below
// what a blow-up takes
const AT_ONCE: Duration = Duration::from_secs(2);

/// A file of these bytes is refused for this reason, at once.
fn refused(name: &str, bytes: &[u8], reason: &str) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("hostile");
    write(&file, bytes);
    let begun = Instant::now();
    let faults = refusal(&file);
    assert!(begun.elapsed() < AT_ONCE, "{name}: {:?}", begun.elapsed());
    assert!(faults.contains(reason), "{name}: {faults}");
}

/// Every prefix and every changed byte is read or refused, and soon.
#[test]
fn damaged_files_are_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    for name in [
        "arrays_2.pkl",
        "flat.mat",
        "struct.mat",
        "cells.mat",
        "keras.onnx",
        "activations/silu.dynamo.onnx",
    ] {
        let whole = std::fs::read(fixture(name)).unwrap();
        let file = folder.path().join("damaged");
        let mut longest = Duration::ZERO;
        let mut read = |bytes: &[u8]| {
            write(&file, bytes);
            let begun = Instant::now();
            let new = import::new_policy(&file, &folder.path().join("policy.toml"), &Options::default());
            longest = longest.max(begun.elapsed());
            new.is_ok()
        };
        for cut in (0..whole.len() - 1).step_by(23) {
            assert!(!read(&whole[..cut]), "{name} cut off at {cut}");
        }
        for at in (0..whole.len()).step_by(5) {
            let mut damaged = whole.clone();
            damaged[at] ^= [0xff, 0x01, 0x80][at % 3];
            read(&damaged);
        }
        assert!(longest < AT_ONCE, "{name}: {longest:?}");
    }
}

/// A header of a MAT file, and elements.
fn mat(elements: &[&[u8]]) -> Vec<u8> {
    let mut bytes = b"MATLAB 5.0 MAT-file".to_vec();
    bytes.resize(124, b' ');
    bytes.extend(b"\0\x01IM");
    bytes.extend(elements.concat());
    bytes
}

fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let size = u32::try_from(data.len()).unwrap();
    let mut bytes = [kind.to_le_bytes(), size.to_le_bytes()].concat();
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

fn matrix(class: u32, axes: &[i32], inner: &[u8]) -> Vec<u8> {
    let axes: Vec<u8> = axes.iter().flat_map(|size| size.to_le_bytes()).collect();
    let flags = [class.to_le_bytes(), [0; 4]].concat();
    element(
        14,
        &[element(6, &flags), element(5, &axes), element(1, b"p"), inner.to_vec()].concat(),
    )
}

#[test]
fn hostile_mat_files_are_refused_at_once() {
    let mut deep = matrix(6, &[1, 1], &element(9, &[0; 8]));
    for _ in 0..2000 {
        deep = matrix(1, &[1, 1], &deep);
    }
    // 64 MiB of zeros in a few thousand bytes
    let zeros = miniz_oxide::deflate::compress_to_vec_zlib(&vec![0; 64 << 20], 6);
    for (name, elements, reason) in [
        ("deep", deep, "nested deeper"),
        (
            "a claim of axes",
            matrix(6, &[i32::MAX, i32::MAX], &element(9, &[0; 8])),
            "do not hold together",
        ),
        (
            "negative axes",
            matrix(6, &[-1, 2], &element(9, &[0; 8])),
            "do not hold together",
        ),
        ("a claim of cells", matrix(1, &[i32::MAX, 1], &[]), "more parts"),
        ("a bomb", element(15, &zeros), "hold more than"),
        ("a sparse matrix", matrix(5, &[2, 2], &[]), "sparse"),
        (
            "a complex matrix",
            matrix(6 | 0x800, &[1, 1], &element(9, &[0; 8])),
            "complex",
        ),
        (
            "not a number",
            matrix(6, &[1, 1], &element(9, &f64::NAN.to_le_bytes())),
            "not finite",
        ),
        ("text alone", matrix(4, &[1, 1], &element(4, b"a\0")), "no matrices"),
    ] {
        refused(name, &mat(&[&elements]), reason);
    }
    // of the objects of MATLAB only the name is in its place
    let opaque = [element(6, &[17, 0, 0, 0, 0, 0, 0, 0]), element(1, b"agent")].concat();
    refused("an object", &mat(&[&element(14, &opaque)]), "`agent` is an object");
}

#[test]
fn a_huge_graph_is_refused_at_once() {
    // a field of a length that the file does not have, and 2 million nodes that take nothing
    let claim = b"\x08\x08\x3a\xff\xff\xff\xff\x0f".to_vec();
    let nodes = b"\x0a\x00".repeat(2_000_000);
    let size = u32::try_from(nodes.len()).unwrap();
    let varint = |mut number: u32| {
        let mut bytes = Vec::new();
        while number >= 128 {
            bytes.push((number & 127) as u8 | 128);
            number >>= 7;
        }
        bytes.push(number as u8);
        bytes
    };
    let many = [&b"\x08\x08\x3a"[..], &varint(size), &nodes].concat();
    refused("a claim", &claim, "not a sound ONNX model");
    refused("many nodes", &many, "more parts than a network");
}

#[test]
fn weights_of_whole_numbers_are_refused_whatever_shape_they_claim() {
    // fields of less than 128 bytes
    let field = |number: u8, bytes: &[u8]| [&[number << 3 | 2, bytes.len() as u8][..], bytes].concat();
    let node = [field(1, b"x"), field(1, b"w"), field(2, b"y"), field(4, b"MatMul")].concat();
    // a row of 2^31 columns, of the type int64, without data
    let tensor = [b"\x08\x01\x08\x80\x80\x80\x80\x08\x10\x07".to_vec(), field(8, b"w")].concat();
    let graph = [
        field(1, &node),
        field(5, &tensor),
        field(11, &field(1, b"x")),
        field(12, &field(1, b"y")),
    ];
    let model = [b"\x08\x08".to_vec(), field(7, &graph.concat())].concat();
    refused("whole numbers", &model, "this node is not read");
}

/// An archive with `data.pkl` alone, whose directory claims `size` bytes and a method of compression.
fn archive(program: &[u8], size: u32, method: u16) -> Vec<u8> {
    let mut bytes = b"PK\x03\x04".to_vec();
    bytes.extend([0; 22]);
    bytes.extend([8, 0, 0, 0]);
    bytes.extend(b"data.pkl");
    bytes.extend(program);
    let directory = u32::try_from(bytes.len()).unwrap();
    bytes.extend(b"PK\x01\x02");
    bytes.extend([0; 6]);
    bytes.extend(method.to_le_bytes());
    bytes.extend([0; 8]);
    bytes.extend(size.to_le_bytes());
    bytes.extend(size.to_le_bytes());
    bytes.extend([8, 0, 0, 0, 0, 0]);
    bytes.extend([0; 12]);
    bytes.extend(b"data.pkl");
    bytes.extend(b"PK\x05\x06\0\0\0\0\x01\0\x01\0");
    bytes.extend([0; 4]);
    bytes.extend(directory.to_le_bytes());
    bytes.extend([0; 2]);
    bytes
}

#[test]
fn a_size_beyond_the_file_is_refused_at_once() {
    refused(
        "a claim",
        &archive(b"", u32::MAX - 1, 0),
        "4294967294 bytes in a file of",
    );
    refused("compressed", &archive(b"", 10, 8), "is compressed");
}

#[test]
fn hostile_pickles_are_refused_at_once() {
    let whole = |program: &[u8]| archive(program, u32::try_from(program.len()).unwrap(), 0);
    let lists = [&b"\x80\x02"[..], &b"]".repeat(300_000), &b"a".repeat(299_999), b"."].concat();
    // {"a": {"a": ...}}
    let dicts = [
        &b"\x80\x02"[..],
        &b"}X\x01\0\0\0a".repeat(30_000),
        b"}",
        &b"s".repeat(30_000),
        b".",
    ]
    .concat();
    // each dict holds the one before it twice: 2^60 ways lead to the innermost
    let mut shared = b"\x80\x02}q\x00".to_vec();
    for index in 0..60 {
        shared.extend(b"}(");
        for key in [b'a', b'b'] {
            shared.extend([b'X', 1, 0, 0, 0, key, b'h', index]);
        }
        shared.extend([b'u', b'q', index + 1]);
    }
    shared.push(b'.');
    let many = [&b"\x80\x02"[..], &b"]".repeat(40_000_000)].concat();
    let endless = [&b"\x80\x02"[..], &b"(".repeat(300_000)].concat();
    let idle = [&b"\x80\x02}q\x00"[..], &b"h\x000".repeat(5_000_000)].concat();
    for (name, program, reason) in [
        ("fetched and dropped", idle, "operations"),
        (
            "a planted call",
            b"\x80\x02cposix\nsystem\n(U\x04truetR.".to_vec(),
            "`posix.system`",
        ),
        ("nested lists", lists, "values"),
        ("nested dicts", dicts, "deeper"),
        ("a dict of itself", shared, "deeper"),
        ("40 million lists", many, "values"),
        ("marks without end", endless, "ends in the middle"),
        (
            "a text of 4 GB",
            b"\x80\x02X\xff\xff\xff\xff.".to_vec(),
            "ends in the middle",
        ),
        ("no stop", b"\x80\x02}".to_vec(), "ends in the middle"),
        ("an empty stack", b"\x80\x02u.".to_vec(), "ends in the middle"),
    ] {
        refused(name, &whole(&program), reason);
        // the same without an archive
        refused(
            name,
            &program,
            if reason == "deeper" {
                "before version 1.6"
            } else {
                reason
            },
        );
    }
}
