//! Only `cli` writes files; all other crates return data.

use std::path::Path;

use super::source;

/// `policy-build` writes into the folder that cargo gives a build script, `verify` and `spice` compile in temporary folders, `train` checks a contract in one; `xtask`, `tests` and `bench` are the test side.
const MAY_WRITE: &[&str] = &[
    "cli",
    "policy-build",
    "verify",
    "train",
    "spice",
    "xtask",
    "tests",
    "bench",
];

const WRITES: &[&str] = &[
    "fs::write",
    "fs::copy",
    "fs::rename",
    "fs::remove_",
    "File::create",
    "File::options",
    "OpenOptions",
    "create_dir",
    "DirBuilder",
];

/// Whether the rule looks at this file: Rust of `<crate>/src` that is not test code by its name.
pub fn applies(path: &Path) -> bool {
    let mut parts = path.iter().filter_map(|part| part.to_str());
    let (member, folder) = (parts.next(), parts.next());
    let is_test = parts.any(|part| part == "tests" || part == "tests.rs");
    let is_rust = path.extension().is_some_and(|extension| extension == "rs");
    is_rust && folder == Some("src") && !is_test && member.is_some_and(|m| !MAY_WRITE.contains(&m))
}

/// One line per place outside of `#[cfg(test)]`.
pub fn check(path: &Path, text: &str) -> Vec<String> {
    let code = source::without_tests(&source::mask(text));
    let mut faults = Vec::new();
    for (index, line) in code.lines().enumerate() {
        for word in WRITES.iter().filter(|word| line.contains(**word)) {
            let place = format!("{}:{}", path.display(), index + 1);
            faults.push(format!("{place}: `{word}`: only cli writes files"));
        }
    }
    faults
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rule_looks_at_library_code_only() {
        for path in ["codegen/src/lib.rs", "policy/src/a/b.rs"] {
            assert!(applies(Path::new(path)), "{path}");
        }
        for path in [
            "cli/src/main.rs",
            "codegen/tests/a.rs",
            "codegen/src/tests.rs",
            "policy/src/a.md",
            "docs/a.rs",
        ] {
            assert!(!applies(Path::new(path)), "{path}");
        }
    }

    #[test]
    fn a_writing_backend_is_found_with_its_line() {
        let faults = check(
            Path::new("codegen/src/c99.rs"),
            "fn emit() {\n    std::fs::write(path, text);\n}\n",
        );
        assert_eq!(faults, ["codegen/src/c99.rs:2: `fs::write`: only cli writes files"]);
    }

    #[test]
    fn tests_comments_and_generated_text_may_name_it() {
        let text = "\
// fs::write is cli's
const TEXT: &str = \"File::create\";
#[cfg(test)]
mod tests {
    fn f() { std::fs::create_dir_all(\"x\"); }
}
";
        assert_eq!(check(Path::new("codegen/src/lib.rs"), text), [""; 0]);
    }
}
