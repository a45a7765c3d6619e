//! Whatever the bytes are, the answer is a policy or faults, never a panic.
#![allow(clippy::unwrap_used)]

mod common;
use common::*;

const PIECES: [&[u8]; 24] = [
    b"nan",
    b"inf",
    b"-",
    b"\"",
    b"[",
    b"]",
    b"{",
    b"}",
    b"=",
    b"1e999",
    b"0",
    b",",
    b"\n",
    b"\xff",
    b"TODO",
    b"[[signal]]",
    b"source",
    b"9223372036854775808",
    b"1979-05-27",
    b"\\u0000",
    b"#",
    b".",
    b"((((((((",
    b"\xef\xbb\xbf",
];

fn mutate(bytes: &[u8], random: &mut Draws) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..=random.below(4) {
        let at = random.below(bytes.len().max(1));
        match random.below(6) {
            0 if !bytes.is_empty() => bytes[at] = random.next() as u8,
            1 if !bytes.is_empty() => bytes[at] ^= 1 << random.below(8),
            2 => bytes.truncate(at),
            3 if !bytes.is_empty() => {
                let end = (at + random.below(20)).min(bytes.len());
                bytes.drain(at..end);
            }
            4 if !bytes.is_empty() => {
                let end = (at + random.below(60)).min(bytes.len());
                let copy = bytes[at..end].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, copy);
            }
            _ => {
                let piece = PIECES[random.below(PIECES.len())];
                let at = at.min(bytes.len());
                bytes.splice(at..at, piece.iter().copied());
            }
        }
    }
    bytes
}

fn survives(folder: &Folder) {
    if let Err(faults) = folder.load() {
        assert!(!faults.faults.list.is_empty());
        for fault in &faults.faults {
            let text = fault.to_string();
            assert!(text.starts_with("error: "));
            assert!(text.chars().all(|c| c == '\n' || !c.is_control()), "{text:?}");
        }
    }
}

fn mutated(file: &str, seed: u64, rounds: usize) {
    let mut random = Draws::new(seed);
    let mut folder = Folder::new();
    let golden = [
        f32_tensor("obs", &[1, 2], &[1.0, 5.0]),
        f32_tensor("q", &[1, 3], &[0.0, 1.0, 0.5]),
    ];
    folder = folder.golden(&golden);
    let original = std::fs::read(folder.path().join(file)).unwrap();
    for _ in 0..rounds {
        folder = folder.file(file, &mutate(&original, &mut random));
        survives(&folder);
    }
}

#[test]
fn mutated_contracts_never_panic() {
    mutated("policy.toml", 1, 1_500);
}

#[test]
fn mutated_mappings_never_panic() {
    mutated("drm.toml", 2, 500);
}

#[test]
fn mutated_weights_never_panic() {
    mutated("weights.safetensors", 3, 1_500);
}

#[test]
fn mutated_golden_vectors_never_panic() {
    mutated("golden.safetensors", 4, 800);
}

#[test]
fn random_bytes_never_panic() {
    let mut random = Draws::new(5);
    let mut folder = Folder::new();
    for _ in 0..500 {
        let length = random.below(200);
        let bytes: Vec<u8> = (0..length).map(|_| random.next() as u8).collect();
        folder = folder.file("weights.safetensors", &bytes);
        survives(&folder);
        let name = if random.below(2) == 0 {
            "policy.toml"
        } else {
            "drm.toml"
        };
        survives(&Folder::new().file(name, &bytes));
    }
}

#[test]
fn random_expressions_never_panic() {
    let mut random = Draws::new(6);
    let pieces = [
        "v_out", "i_out", "v_ref", "(", ")", "+", "-", "*", "/", " ", "0", "1e", "2.5", "1e-300", ",", "é", "x", "\t",
    ];
    let mut folder = Folder::new();
    for _ in 0..1_000 {
        let source: String = (0..random.below(12))
            .map(|_| pieces[random.below(pieces.len())])
            .collect();
        let text = CONTRACT.replacen("v_ref - v_out", &source.replace('\t', "\\t"), 1);
        folder = folder.contract(&text);
        survives(&folder);
    }
}

#[test]
fn deep_toml_and_json_never_overflow_the_stack() {
    let deep = |open: &str, close: &str| format!("{}{}", open.repeat(50_000), close.repeat(50_000));
    survives(&Folder::new().contract(&format!("x = {}", deep("[", "]"))));
    survives(&Folder::new().contract(&format!("{}[y]", "[[x]]\n".repeat(50_000))));
    survives(&Folder::new().file("weights.safetensors", &with_header(&deep("[", "]"), &[])));
    survives(&Folder::new().file(
        "weights.safetensors",
        &with_header(&format!("{{\"a\":{}}}", deep("{\"a\":", "}")), &[]),
    ));
}
