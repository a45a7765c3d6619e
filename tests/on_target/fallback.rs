//! A toolchain without the processor's library: Debian's Rust stands in.

use std::os::unix::fs::PermissionsExt;
use std::process::Command;

use tests::tools::{policyc, run};
use verify::toolchain::debian;

/// The real compiler, which denies that it has a library for another machine.
const HIDING: &str = r#"#!/bin/sh
for argument; do
    [ "$argument" = target-libdir ] && exit 1
done
exec "$REAL_RUSTC" "$@"
"#;

/// Where Debian's Rust is not installed, `cargo xtask test` says that this is not tested.
#[test]
fn without_the_target_of_rustup_debians_rust_gives_the_same_bits() {
    if debian::cargo().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let hiding = folder.path().join("rustc");
    std::fs::write(&hiding, HIDING).unwrap();
    std::fs::set_permissions(&hiding, std::fs::Permissions::from_mode(0o755)).unwrap();
    let path = std::env::var_os("PATH").unwrap();
    let real = verify::toolchain::find("rustc").unwrap();
    let path = std::env::join_paths(std::iter::once(folder.path().to_owned()).chain(std::env::split_paths(&path)));
    let version = run(Command::new("/usr/bin/rustc").arg("--version")).stdout;
    for target in ["cortex-m4f", "riscv32imc", "dspace-ds1202"] {
        let mut command = Command::new(policyc());
        command.arg("verify").arg(tests::example());
        command.args(["--target", target, "--steps", "500"]);
        let ran = run(command.env("PATH", path.as_ref().unwrap()).env("REAL_RUSTC", &real));
        assert_eq!(ran.code, Some(0), "{target}: {ran:?}");
        let line = ran.stdout.lines().find(|line| line.starts_with("rustc -O")).unwrap();
        assert!(
            line.contains("equal") && line.contains(version.trim()),
            "{target}: {line}\n{version}"
        );
    }
}
