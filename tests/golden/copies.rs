//! Files that a published crate holds a copy of, because it cannot reach into the folders of the repository.

use tests::tools::bless;

use super::cases;

const COPIES: [(&str, &str, &[&str]); 2] = [
    (
        "examples/buck12",
        "cli/example",
        &["policy.toml", "drm.toml", "weights.safetensors", "golden.safetensors"],
    ),
    (
        "tests/golden/cases/constructs",
        "verify/src/kit/constructs",
        &["policy.toml", "drm.toml", "weights.safetensors"],
    ),
];

#[test]
fn golden_copies_in_published_crates_are_the_files_of_the_repository() {
    // draws networks anew where files are blessed
    assert!(!cases().is_empty());
    for (original, copy, names) in COPIES {
        for name in names {
            let [original, copy] = [original, copy].map(|folder| tests::root().join(folder).join(name));
            if bless() {
                std::fs::copy(&original, &copy).unwrap();
            }
            let same = std::fs::read(&original).unwrap() == std::fs::read(&copy).unwrap();
            assert!(same, "{} is not {}", copy.display(), original.display());
        }
    }
}
