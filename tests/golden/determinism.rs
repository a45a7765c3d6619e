//! Equal policies give equal bytes, wherever and however their files are written.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use tests::tools::{copy_folder, policyc, run};

use super::cases;

/// A folder name and a user that no generated text has a reason to contain.
const PLACE: &str = "quokka-7391";
const USER: &str = "wombat-4417";

fn compile(policy: &Path, out: &Path, place: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut command = Command::new(policyc());
    command
        .args(["compile", "--emit", "rust,c", "--out"])
        .arg(out)
        .arg(policy);
    command
        .env("USER", USER)
        .env("LOGNAME", USER)
        .env("HOME", place)
        .env("TZ", "Asia/Tokyo");
    let ran = run(command.current_dir(place));
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let out = place.join(out);
    let entries = std::fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().path());
    let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
    entries
        .map(|path| (name(&path), std::fs::read(&path).unwrap()))
        .collect()
}

/// The same content with other line ends, comments, blanks and a byte order mark.
fn rewrite(path: &Path) {
    let text = std::fs::read_to_string(path).unwrap();
    let mut other = String::from("\u{feff}# another comment\r\n\r\n");
    for line in text.lines().filter(|line| !line.trim_start().starts_with('#')) {
        let line = match line.split_once(" = ") {
            Some((key, value)) => format!("\t{key}   =\t{value}"),
            None => line.to_owned(),
        };
        other += &format!("{line}   # another comment, at \"{}\"\r\n\r\n", path.display());
    }
    std::fs::write(path, other).unwrap();
}

#[test]
fn equal_policies_give_equal_bytes_from_every_folder_and_in_every_layout() {
    for case in cases() {
        let base = tempfile::tempdir().unwrap();
        let place = base.path().join(PLACE);
        copy_folder(&case.folder, &place.join("one"));
        copy_folder(&case.folder, &place.join("deep/er/two"));
        let here = compile(Path::new("one"), Path::new("out"), &place);
        let expected: BTreeMap<String, Vec<u8>> = case
            .files
            .iter()
            .map(|(name, text)| (name.clone(), text.clone().into_bytes()))
            .collect();
        assert!(
            here == expected,
            "{}: `policyc compile` writes other bytes than the library",
            case.name
        );
        let absolute = compile(&place.join("one/policy.toml"), &place.join("out2"), base.path());
        assert!(here == absolute, "{}: the working folder shows", case.name);
        for file in ["policy.toml", "drm.toml"] {
            let path = place.join("deep/er/two").join(file);
            if path.exists() {
                rewrite(&path);
            }
        }
        let rewritten = compile(Path::new("../deep/er/two"), Path::new("out"), &place.join("one"));
        assert!(here == rewritten, "{}: layout or line ends show", case.name);
    }
}

#[test]
fn another_number_gives_other_bytes() {
    let case = cases().iter().find(|case| case.name == "minimal").unwrap();
    let base = tempfile::tempdir().unwrap();
    copy_folder(&case.folder, &base.path().join("a"));
    let before = compile(Path::new("a"), Path::new("out"), base.path());
    let path = base.path().join("a/policy.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let other = text.replace("duty = [0.1, 0.9]", "duty = [0.2, 0.9]");
    assert_ne!(text, other);
    std::fs::write(&path, other).unwrap();
    let after = compile(Path::new("a"), Path::new("out"), base.path());
    assert!(before.iter().all(|(name, bytes)| after[name] != *bytes));
}

#[test]
fn no_path_date_time_or_user_stands_in_a_generated_file() {
    for case in cases() {
        let base = tempfile::tempdir().unwrap();
        let place = base.path().join(PLACE);
        copy_folder(&case.folder, &place.join("policy"));
        let root = tests::root().canonicalize().unwrap();
        let words = [
            PLACE,
            USER,
            &base.path().to_string_lossy(),
            &root.to_string_lossy(),
            "/home",
            "policy.toml",
            "__DATE__",
            "__TIME__",
        ]
        .map(str::to_owned);
        for (name, bytes) in compile(Path::new("policy"), Path::new("out"), &place) {
            let text = String::from_utf8(bytes).unwrap();
            for word in &words {
                assert!(!text.contains(word), "{}/{name} contains {word}", case.name);
            }
            let dated = text.lines().find(|line| has_date(line));
            assert_eq!(dated, None, "{}/{name}", case.name);
        }
    }
}

/// `2026-11-21`, `21.11.2026`, `11:58:03`.
fn has_date(line: &str) -> bool {
    let shape: String = line.chars().map(|c| if c.is_ascii_digit() { '9' } else { c }).collect();
    let dates = ["9999-99-99", "9999/99/99", "99:99:99", "99.99.9999"];
    // a table of numbers may hold the shape of the last, but not beside a letter f or a comma
    dates[..3].iter().any(|date| shape.contains(date)) || shape.split(' ').any(|word| word == dates[3])
}

#[test]
fn the_search_for_dates_finds_some() {
    for line in ["made 2026-11-21", " * 11:58:03 *", "on 21.11.2026"] {
        assert!(has_date(line), "{line}");
    }
    for line in ["1.25f, 0.75e-05f,", "-0.11, 12.3456", "Network 6-64-64-12, 5248 MACs"] {
        assert!(!has_date(line), "{line}");
    }
}
