//! What a release asks for beside the tests: crates that a registry takes, and the oldest compiler that they promise.
//! Nothing is published here.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use crate::process::{self, Output};
use crate::workspace::{Crate, Kind, Workspace};

/// Largest package, bytes: a registry keeps each version for ever. The largest of ours, that of `codegen`, is a quarter of
/// this; one with the fixtures of its tests would be more.
const LARGEST: u64 = 512 * 1024;

/// One line per crate that no registry would take.
pub fn faults(crates: &[Crate]) -> Vec<String> {
    let published = || crates.iter().filter(|one| one.is_published);
    let lacking = published().filter(|one| !one.lacks.is_empty());
    let lacking = lacking.map(|one| format!("`{}` has no {}", one.package, one.lacks.join(", no ")));
    let is_private = |name: &str| crates.iter().any(|one| one.name == name && !one.is_published);
    let leaning = published().flat_map(|one| {
        let needed = one.dependencies.iter().filter(|other| other.kind != Kind::Dev);
        let private = needed.filter(|other| is_private(&other.name));
        private.map(|other| format!("`{}` needs `{}`, which is not published", one.package, other.name))
    });
    let unnamed = published().filter(|one| one.package != "policyc" && !one.package.starts_with("policyc-"));
    let unnamed = unnamed.map(|one| format!("`{}`: names in a registry begin with `policyc-`", one.package));
    lacking.chain(leaning).chain(unnamed).collect()
}

/// `-p NAME` of each published crate.
fn selection(workspace: &Workspace) -> Vec<&str> {
    published(workspace)
        .flat_map(|one| ["-p", one.package.as_str()])
        .collect()
}

/// Where the packages are unpacked.
const HOUSE: &str = "xtask/release";

/// Packs every published crate. `cargo package` would also build each of them, with all its dependencies anew for each: an hour.
pub fn pack(workspace: &Workspace, log: &Path, limit: Duration) -> Result<Vec<String>, String> {
    let mut command = workspace.cargo(&["package", "--locked", "--allow-dirty", "--no-verify"]);
    command.args(selection(workspace)).env("CARGO_TERM_COLOR", "never");
    process::run_within(&mut command, &Output::Log(log.to_owned()), limit)?;
    let mut sizes = Vec::new();
    for one in published(workspace) {
        let file = file(one);
        let path = workspace.target_dir.join("package").join(&file);
        let size = std::fs::metadata(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        sizes.push((size.len(), file));
    }
    sizes.sort();
    let large: Vec<String> = sizes
        .iter()
        .filter(|(size, _)| *size > LARGEST)
        .map(|(size, file)| format!("{file}: {size} bytes, more than {LARGEST}"))
        .collect();
    match (large.is_empty(), sizes.last()) {
        (true, Some((size, file))) => Ok(vec![format!(
            "{} packages; the largest, {file}: {size} bytes",
            sizes.len()
        )]),
        (true, None) => Err("no crate is published".into()),
        (false, _) => Err(large.join("\n")),
    }
}

fn published(workspace: &Workspace) -> impl Iterator<Item = &Crate> {
    workspace.crates.iter().filter(|one| one.is_published)
}

fn file(one: &Crate) -> String {
    format!("{}-{}.crate", one.package, one.version)
}

/// Builds what [`pack`] packed from nothing but the packages, with the compiler that `rust-version` names.
pub fn oldest(workspace: &Workspace, log: &Path, limit: Duration) -> Result<Vec<String>, String> {
    let house = unpacked(workspace, log, limit)?;
    let version = &toolchain(&workspace.rust_version);
    // the cargo that runs this program is one of a certain version: only rustup finds another
    let mut command = Command::new("rustup");
    command.args(["run", version, "cargo", "check", "--workspace", "--lib", "--bins"]);
    command.current_dir(&house).env("CARGO_TERM_COLOR", "never");
    command.env_remove("RUSTC").env_remove("RUSTUP_TOOLCHAIN");
    // beside that of the usual compiler, whose files it would replace
    command.env("CARGO_TARGET_DIR", workspace.target_dir.join("oldest"));
    let ended = process::run_within(&mut command, &Output::Log(log.to_owned()), limit);
    ended.map_err(|fault| format!("{fault}\n  = hint: rustup toolchain install {version} --profile minimal"))?;
    Ok(vec![format!("Rust {version}")])
}

/// A workspace of the unpacked packages, each of which takes the others for those of the registry.
fn unpacked(workspace: &Workspace, log: &Path, limit: Duration) -> Result<PathBuf, String> {
    let house = workspace.target_dir.join(HOUSE);
    let fault = |error: std::io::Error| format!("{}: {error}", house.display());
    if house.exists() {
        // a file that a package lacks today may be there from another day
        std::fs::remove_dir_all(&house).map_err(fault)?;
    }
    std::fs::create_dir_all(&house).map_err(fault)?;
    for one in published(workspace) {
        let mut tar = Command::new("tar");
        tar.arg("xzf").arg(workspace.target_dir.join("package").join(file(one)));
        process::run_within(tar.current_dir(&house), &Output::Log(log.to_owned()), limit)?;
    }
    std::fs::write(house.join("Cargo.toml"), manifest(workspace)).map_err(fault)?;
    // the versions that the tests have seen
    std::fs::copy(workspace.root.join("Cargo.lock"), house.join("Cargo.lock")).map_err(fault)?;
    Ok(house)
}

fn manifest(workspace: &Workspace) -> String {
    let mut text = "[workspace]\nresolver = \"3\"\nmembers = [\"policyc*\"]\n\n[patch.crates-io]\n".to_owned();
    for one in published(workspace) {
        text.push_str(&format!("{0} = {{ path = \"{0}-{1}\" }}\n", one.package, one.version));
    }
    text
}

/// The first compiler of a version: rustup takes `1.89` for the latest of its patches, which is another toolchain.
fn toolchain(version: &str) -> String {
    match version.matches('.').count() {
        1 => format!("{version}.0"),
        _ => version.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workspace::Dependency;

    fn member(package: &str, is_published: bool) -> Crate {
        Crate {
            name: package.strip_prefix("policyc-").unwrap_or(package).to_owned(),
            package: package.to_owned(),
            is_published,
            ..Crate::default()
        }
    }

    #[test]
    fn a_published_crate_needs_published_crates_all_entries_and_a_name_of_ours() {
        let mut sound = [
            member("policyc", true),
            member("policyc-plant", true),
            member("bench", false),
        ];
        sound[0].dependencies.push(Dependency {
            name: "plant".into(),
            kind: Kind::Normal,
        });
        sound[0].dependencies.push(Dependency {
            name: "bench".into(),
            kind: Kind::Dev,
        });
        assert_eq!(faults(&sound), [""; 0]);
        let mut unsound = sound.clone();
        unsound[1].is_published = false;
        assert_eq!(faults(&unsound), ["`policyc` needs `plant`, which is not published"]);
        let mut unsound = sound.clone();
        unsound[1].lacks = vec!["license", "readme"];
        assert_eq!(faults(&unsound), ["`policyc-plant` has no license, no readme"]);
        assert_eq!(faults(&[member("plant", true)]).len(), 1);
    }

    #[test]
    fn the_oldest_compiler_is_the_first_of_its_version() {
        assert_eq!(toolchain("1.89"), "1.89.0");
        assert_eq!(toolchain("1.89.1"), "1.89.1");
    }

    #[test]
    fn the_crates_of_this_repository_can_be_published() {
        let workspace = Workspace::load().unwrap();
        assert_eq!(faults(&workspace.crates), [""; 0]);
        assert!(selection(&workspace).contains(&"policyc"));
    }
}
