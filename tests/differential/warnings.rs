//! A firmware that takes a generated file into its crate sees no warning of rustc.

use std::process::Command;

use codegen::Output;
use policy::NumericFormat;

#[test]
fn generated_rust_has_no_warnings() {
    let folders: Vec<_> = (300..304).map(|seed| tests::random::policy(seed).unwrap()).collect();
    let paths = folders.iter().map(tests::random::Folder::path);
    for path in paths.chain([tests::example()]) {
        let policy = policy::load(&path).unwrap();
        for format in NumericFormat::ALL {
            let policy = policy.clone().with_format(format);
            let files = codegen::generate(&policy, targets::host(), &[Output::Rust], None)
                .unwrap()
                .files;
            let crate_folder = tempfile::tempdir().unwrap();
            let put = |name: &str, text: &str| std::fs::write(crate_folder.path().join(name), text).unwrap();
            put(&format!("{}.rs", policy.name), &files[&format!("{}.rs", policy.name)]);
            put("lib.rs", &format!("#![no_std]\npub mod {};\n", policy.name));
            for edition in ["2021", "2024"] {
                let output = Command::new("rustc")
                    .current_dir(crate_folder.path())
                    .args([
                        "--edition",
                        edition,
                        "--crate-type=lib",
                        // as cargo does: a condition that it does not know is a warning
                        "--check-cfg=cfg()",
                        "--emit=metadata",
                        "-Dwarnings",
                        "lib.rs",
                    ])
                    .output()
                    .unwrap();
                let text = String::from_utf8_lossy(&output.stderr);
                assert!(output.status.success(), "{} {edition}: {text}", format.name());
            }
        }
    }
}
