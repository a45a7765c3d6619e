//! cargo notices every edit of a policy that a crate includes, and nothing else.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::{Path, PathBuf};

use tests::tools::{Ran, artifacts, cargo, copy_folder, run, run_silently};

/// A crate that includes a copy of the golden case `paper` and prints the bits of its answers. Its name is its own: in a
/// shared target folder, crates of one name in two folders are one to cargo.
struct Crate {
    folder: tempfile::TempDir,
    name: &'static str,
}

const MAIN: &str = r#"
policy_macro::include_policy!("policy/policy.toml");

fn main() {
    assert!(paper::Controller::integrity() && paper::Controller::self_test().is_ok());
    let mut controller = paper::Controller::new();
    for step in 0..20_u8 {
        let measured = paper::Measurement { v: 90.0 + f32::from(step), i_out: 4.0 };
        let q = paper::Controller::q_values(&controller.observe(&measured));
        let command = controller.step(&measured);
        println!("{:08x} {:?}", command.duty.to_bits(), q.map(f32::to_bits));
    }
}
"#;

impl Crate {
    fn new(name: &'static str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let root = tests::root().canonicalize().unwrap();
        let manifest = format!(
            "[package]\nname = \"{name}\"\nversion = \"0.1.0\"\nedition = \"2021\"\n[workspace]\n[dependencies]\n\
             policy-macro = {{ package = \"policyc-macro\", path = {:?} }}\n",
            root.join("policy-macro")
        );
        std::fs::write(folder.path().join("Cargo.toml"), manifest).unwrap();
        // the versions that the workspace has tested
        std::fs::copy(root.join("Cargo.lock"), folder.path().join("Cargo.lock")).unwrap();
        std::fs::create_dir(folder.path().join("src")).unwrap();
        std::fs::write(folder.path().join("src/main.rs"), MAIN).unwrap();
        copy_folder(&root.join("tests/golden/cases/paper"), &folder.path().join("policy"));
        Self { folder, name }
    }

    fn cargo_build(&self) -> Ran {
        let mut command = cargo();
        command
            .args(["build", "--message-format=json"])
            .current_dir(self.folder.path());
        // shared with the firmware, which has the same dependencies
        run(command.env("CARGO_TARGET_DIR", firmware_target()))
    }

    /// Builds; whether something had to be done, and what the program prints.
    fn build(&self) -> (bool, String) {
        let ran = self.cargo_build();
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        let artifacts = artifacts(&ran.stdout);
        let own = artifacts.iter().find(|artifact| artifact.name == self.name).unwrap();
        let mut program = std::process::Command::new(&own.files[0]);
        (!own.fresh, run_silently(&mut program))
    }

    fn edit(&self, file: &str, old: &str, new: &str) {
        let path = self.folder.path().join("policy").join(file);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains(old), "{old}");
        std::fs::write(path, text.replace(old, new)).unwrap();
    }
}

/// A change of a crate's files.
type Edit<'a> = &'a dyn Fn(&Crate);

fn firmware_target() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("../firmware/no-std")
}

#[test]
fn each_edit_of_a_file_of_the_policy_rebuilds_the_crate_and_nothing_else_does() {
    let rebuilt = Crate::new("edited-policy");
    let (_, mut before) = rebuilt.build();
    assert_eq!(rebuilt.build(), (false, before.clone()), "built again without an edit");
    let one_bias = |rebuilt: &Crate| {
        let path = rebuilt.folder.path().join("policy/weights.safetensors");
        let mut bytes = std::fs::read(&path).unwrap();
        let start = tests::fixture::first_byte(&bytes, "fc2.bias").unwrap();
        bytes[start..start + 4].copy_from_slice(&0.625_f32.to_le_bytes());
        std::fs::write(path, bytes).unwrap();
    };
    let edits: [(&str, Edit<'_>); 3] = [
        ("weights.safetensors", &one_bias),
        ("drm.toml", &|rebuilt| {
            rebuilt.edit("drm.toml", "c = 0.013", "c = 0.014")
        }),
        ("policy.toml", &|rebuilt| {
            rebuilt.edit("policy.toml", "scale = 0.01", "scale = 0.0125")
        }),
    ];
    for (file, edit) in edits {
        edit(&rebuilt);
        let (built, after) = rebuilt.build();
        assert!(built, "{file} was edited");
        assert_ne!(after, before, "{file} was edited");
        assert_eq!(rebuilt.build(), (false, after.clone()), "{file} was not edited again");
        before = after;
    }
}

#[test]
fn a_policy_broken_and_then_repaired_is_noticed_both_times() {
    let rebuilt = Crate::new("broken-policy");
    let (_, before) = rebuilt.build();
    let weights = rebuilt.folder.path().join("policy/weights.safetensors");
    let elsewhere = rebuilt.folder.path().join("elsewhere");
    let breaks: [(&str, Edit<'_>, Edit<'_>); 2] = [
        (
            "limits of `duty` are crossed",
            &|rebuilt| rebuilt.edit("policy.toml", "[0.3, 0.7]", "[0.7, 0.3]"),
            &|rebuilt| rebuilt.edit("policy.toml", "[0.7, 0.3]", "[0.3, 0.7]"),
        ),
        (
            "cannot find the file",
            &|_| std::fs::rename(&weights, &elsewhere).unwrap(),
            // with the old time stamp: nothing but the failed build tells cargo that there is work
            &|_| std::fs::rename(&elsewhere, &weights).unwrap(),
        ),
    ];
    for (message, spoil, repair) in breaks {
        spoil(&rebuilt);
        for _ in 0..2 {
            let ran = rebuilt.cargo_build();
            assert_ne!(ran.code, Some(0), "{message}");
            assert!(ran.stdout.contains(message), "{message}\n{}", ran.stdout);
        }
        repair(&rebuilt);
        let (_, after) = rebuilt.build();
        assert_eq!(after, before);
        assert_eq!(rebuilt.build(), (false, before.clone()));
    }
}
