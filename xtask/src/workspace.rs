//! What cargo and git know about the workspace.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value;

/// Why a crate depends on another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    Normal,
    Build,
    Dev,
}

/// A dependency on a crate given by path.
#[derive(Clone, Debug)]
pub struct Dependency {
    pub name: String,
    pub kind: Kind,
}

/// A member of the workspace with its path dependencies.
#[derive(Clone, Debug, Default)]
pub struct Crate {
    /// As ARCHITECTURE.md has it.
    pub name: String,
    /// As the registry has it.
    pub package: String,
    pub version: String,
    /// Whether it is for the registry.
    pub is_published: bool,
    /// What the registry shows of it and that is missing.
    pub lacks: Vec<&'static str>,
    /// Names of its integration tests.
    pub tests: Vec<String>,
    pub dependencies: Vec<Dependency>,
}

/// The workspace the current folder belongs to.
pub struct Workspace {
    pub root: PathBuf,
    pub target_dir: PathBuf,
    /// The oldest compiler that the program promises.
    pub rust_version: String,
    pub crates: Vec<Crate>,
}

impl Workspace {
    /// # Errors
    /// Cargo's message when the current folder is in no workspace or a manifest is broken.
    pub fn load() -> Result<Self, String> {
        let text = captured(cargo().args(["metadata", "--no-deps", "--format-version", "1"]))?;
        let metadata: Value = serde_json::from_str(&text).map_err(|e| format!("cargo metadata: {e}"))?;
        Self::from_metadata(&metadata)
    }

    fn from_metadata(metadata: &Value) -> Result<Self, String> {
        let packages = metadata["packages"].as_array().ok_or("cargo metadata: no `packages`")?;
        Ok(Self {
            root: text(metadata, "workspace_root")?.into(),
            target_dir: text(metadata, "target_directory")?.into(),
            rust_version: packages
                .iter()
                .find_map(|package| package["rust_version"].as_str())
                .unwrap_or_default()
                .into(),
            crates: packages.iter().map(package).collect::<Result<_, _>>()?,
        })
    }

    /// `cargo <arguments>` in the workspace's root.
    pub fn cargo(&self, arguments: &[&str]) -> Command {
        let mut command = cargo();
        command.args(arguments).current_dir(&self.root);
        command
    }

    /// Output of `cargo <arguments>`.
    pub fn cargo_output(&self, arguments: &[&str]) -> Result<String, String> {
        captured(&mut self.cargo(arguments))
    }

    /// Files under version control and new files that are not ignored, relative to the root, sorted.
    /// Without git (a source archive): every file outside `target` and hidden folders of the root.
    pub fn files(&self) -> Result<Vec<PathBuf>, String> {
        let mut git = Command::new("git");
        // CI may run as another user than the owner of the checkout, which git refuses otherwise
        git.args(["-c", "safe.directory=*", "ls-files", "-z", "--cached"])
            .args(["--others", "--exclude-standard"])
            .current_dir(&self.root);
        let mut files = if self.root.join(".git").exists() {
            let listed = captured(&mut git)?;
            let names = listed.split('\0').filter(|name| !name.is_empty());
            names.map(PathBuf::from).collect()
        } else {
            let mut found = Vec::new();
            walk(&self.root, Path::new(""), &mut found)?;
            found
        };
        files.retain(|file| self.root.join(file).is_file());
        files.sort();
        files.dedup();
        Ok(files)
    }

    /// Folders of `firmware/` that hold a crate, sorted.
    pub fn firmware(&self) -> Result<Vec<PathBuf>, String> {
        let folder = self.root.join("firmware");
        if !folder.exists() {
            return Ok(Vec::new());
        }
        let mut crates = entries(&folder)?;
        crates.retain(|path| path.join("Cargo.toml").is_file());
        Ok(crates)
    }
}

fn cargo() -> Command {
    // the cargo that started this program; outside of `cargo run` the one on the path
    Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}

fn text<'a>(value: &'a Value, key: &str) -> Result<&'a str, String> {
    value[key]
        .as_str()
        .ok_or_else(|| format!("cargo metadata: no text at `{key}`"))
}

/// What the registry shows of a crate.
const SHOWN: [&str; 6] = [
    "description",
    "license",
    "readme",
    "keywords",
    "categories",
    "rust_version",
];

fn is_empty(value: &Value) -> bool {
    value.is_null() || value.as_array().is_some_and(Vec::is_empty)
}

/// The name of a crate in this repository: that of its folder, without what tells it apart in a registry.
fn short(package: &str) -> &str {
    match package {
        "policyc" => "cli",
        "policyc-macro" => "policy-macro",
        "policyc-build" => "policy-build",
        other => other.strip_prefix("policyc-").unwrap_or(other),
    }
}

fn package(package: &Value) -> Result<Crate, String> {
    let dependencies = package["dependencies"].as_array();
    let dependencies = dependencies.ok_or("cargo metadata: no `dependencies`")?;
    let own = dependencies.iter().filter(|d| d["path"].is_string());
    let dependency = |value: &Value| {
        Ok(Dependency {
            name: short(text(value, "name")?).into(),
            kind: match value["kind"].as_str() {
                None => Kind::Normal,
                Some("build") => Kind::Build,
                Some("dev") => Kind::Dev,
                Some(other) => return Err(format!("cargo metadata: dependency kind `{other}`")),
            },
        })
    };
    let is_test = |target: &&Value| {
        target["kind"]
            .as_array()
            .is_some_and(|kinds| kinds.iter().any(|k| k == "test"))
    };
    let targets = package["targets"].as_array().into_iter().flatten();
    Ok(Crate {
        name: short(text(package, "name")?).into(),
        package: text(package, "name")?.into(),
        version: text(package, "version")?.into(),
        // no list: every registry; an empty one: none
        is_published: package["publish"].is_null(),
        lacks: SHOWN.into_iter().filter(|key| is_empty(&package[*key])).collect(),
        tests: targets
            .filter(is_test)
            .map(|target| Ok(text(target, "name")?.into()))
            .collect::<Result<_, String>>()?,
        dependencies: own.map(dependency).collect::<Result<_, String>>()?,
    })
}

fn captured(command: &mut Command) -> Result<String, String> {
    let shown = crate::process::shown(command);
    let output = command
        .stdin(Stdio::null())
        .output()
        .map_err(|e| format!("cannot start `{shown}`: {e}"))?;
    if !output.status.success() {
        let message = String::from_utf8_lossy(&output.stderr);
        return Err(format!("`{shown}` failed: {}", message.trim()));
    }
    String::from_utf8(output.stdout).map_err(|e| format!("`{shown}`: {e}"))
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let fault = |e| format!("cannot list {}: {e}", folder.display());
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(fault)? {
        paths.push(entry.map_err(fault)?.path());
    }
    paths.sort();
    Ok(paths)
}

fn walk(root: &Path, folder: &Path, found: &mut Vec<PathBuf>) -> Result<(), String> {
    for path in entries(&root.join(folder))? {
        let Some(name) = path.file_name() else {
            continue;
        };
        let relative = folder.join(name);
        if path.is_symlink() || name == "target" || name == ".git" {
            continue;
        }
        if path.is_dir() {
            walk(root, &relative, found)?;
        } else {
            found.push(relative);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_path_dependencies_are_kept_with_their_kind() {
        let metadata = serde_json::json!({
            "workspace_root": "/w", "target_directory": "/w/target",
            "packages": [{ "name": "policyc-interp", "version": "0.1.0", "publish": null, "license": "MIT", "keywords": [], "dependencies": [
                { "name": "ndarray", "kind": null },
                { "name": "policyc-policy", "kind": null, "path": "/w/policy" },
                { "name": "plant", "kind": "dev", "path": "/w/plant" },
            ] }],
        });
        let workspace = Workspace::from_metadata(&metadata).unwrap();
        let own = &workspace.crates[0];
        assert_eq!((own.name.as_str(), own.is_published), ("interp", true));
        assert!(own.lacks.contains(&"keywords") && !own.lacks.contains(&"license"));
        let found = &workspace.crates[0].dependencies;
        let found: Vec<_> = found.iter().map(|d| (d.name.as_str(), d.kind)).collect();
        assert_eq!(found, [("policy", Kind::Normal), ("plant", Kind::Dev)]);
    }

    #[test]
    fn files_are_found_with_and_without_git() {
        let workspace = Workspace::load().unwrap();
        let own = PathBuf::from("xtask/src/workspace.rs");
        assert!(workspace.files().unwrap().contains(&own));
        let mut walked = Vec::new();
        walk(&workspace.root, Path::new(""), &mut walked).unwrap();
        assert!(walked.contains(&own));
        assert!(!walked.iter().any(|file| file.starts_with("target")));
    }
}
