//! The Python package: built by maturin, installed into a folder of its own, tested by pytest.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use crate::process::{self, Output};
use crate::tools;
use crate::workspace::Workspace;

/// What the step needs beyond Rust.
const NEEDED: [&str; 5] = ["maturin", "numpy", "pandas", "gymnasium", "pytest"];

/// The libraries that trainers use, for the long form alone: they are gigabytes.
const TRAINERS: [&str; 3] = ["stable-baselines3==2.9.2", "sb3-contrib==2.9.2", "onnxscript"];

/// What a cluster of two nodes on this machine needs, for the long form alone.
const CLUSTER: [&str; 1] = ["ray>=2.9"];

/// Tests for the long form.
const LONG: [&str; 2] = ["trainers", "clusters"];

/// Where everything of it lies.
struct Folders {
    /// The crate.
    package: PathBuf,
    /// Built wheels.
    wheels: PathBuf,
    /// What is imported: nothing gets into an environment, so that a run leaves none behind in it.
    site: PathBuf,
    /// An environment with the trainers' libraries.
    trainers: PathBuf,
}

impl Folders {
    fn of(workspace: &Workspace) -> Self {
        let below = workspace.target_dir.join("wheel");
        Self {
            package: workspace.root.join("python"),
            wheels: below.join("built"),
            site: below.join("site"),
            trainers: below.join("trainers"),
        }
    }
}

/// Builds, installs and tests the wheel; what there is to say of it. `Err` of the first is why it is left out.
///
/// # Errors
/// What failed.
pub fn test(
    workspace: &Workspace,
    full: bool,
    log: &Path,
    limit: Duration,
) -> Result<Result<Vec<String>, String>, String> {
    let lacking = tools::lacking(&workspace.target_dir, &NEEDED);
    if !lacking.is_empty() {
        return Ok(Err(format!(
            "not there: {}; the wheel is NOT tested",
            lacking.join(", ")
        )));
    }
    let folders = Folders::of(workspace);
    let python = tools::python_program(&workspace.target_dir);
    let output = Output::Log(log.to_path_buf());
    let run = |command: &mut Command| process::run_within(command, &output, limit);
    // the program to hold it against
    run(&mut workspace.cargo(&["build", "--workspace", "--bin", "policyc"]))?;
    let wheel = build(&folders, &python, &run)?;
    let mut install = pip(&python);
    install.args(["--no-deps", "--no-index", "--upgrade", "--target"]);
    run(install.arg(&folders.site).arg(&wheel))?;
    let program = workspace.target_dir.join("debug/policyc");
    let mut pytest = Command::new(&python);
    pytest.args(["-m", "pytest", "-q", "-p", "no:cacheprovider", "--durations=5"]);
    let tests = folders.package.join("tests");
    pytest.arg(&tests);
    for folder in LONG {
        pytest.arg("--ignore").arg(tests.join(folder));
    }
    pytest.current_dir(&workspace.root).env("PYTHONPATH", &folders.site);
    run(pytest.env("POLICYC_PROGRAM", &program))?;
    let mut notes = vec![counted(log)];
    if full {
        with_trainers(&folders, &wheel, &program, &run)?;
        notes.push(format!("with the trainers' libraries and Ray: {}", counted(log)));
    }
    Ok(Ok(notes))
}

fn build(
    folders: &Folders,
    python: &Path,
    run: &impl Fn(&mut Command) -> Result<(), String>,
) -> Result<PathBuf, String> {
    // one wheel alone, so that it is known which was built now
    let _ = std::fs::remove_dir_all(&folders.wheels);
    let mut maturin = Command::new(python);
    maturin.args(["-m", "maturin", "build", "--profile", "dev", "--interpreter"]);
    maturin.arg(python).arg("--out").arg(&folders.wheels);
    run(maturin.current_dir(&folders.package))?;
    let built = std::fs::read_dir(&folders.wheels).map_err(|e| format!("cannot list the wheels: {e}"))?;
    let mut paths = built.flatten().map(|entry| entry.path());
    let wheel = paths.find(|path| path.extension().is_some_and(|extension| extension == "whl"));
    wheel.ok_or_else(|| "maturin has built no wheel".to_owned())
}

/// The way of a user: a clean environment, the wheel, the real libraries.
fn with_trainers(
    folders: &Folders,
    wheel: &Path,
    program: &Path,
    run: &impl Fn(&mut Command) -> Result<(), String>,
) -> Result<(), String> {
    let python = folders.trainers.join("bin/python3");
    if !python.exists() {
        run(Command::new("python3").args(["-m", "venv"]).arg(&folders.trainers))?;
    }
    run(pip(&python).arg("torch"))?;
    run(pip(&python)
        .args(TRAINERS)
        .args(["pytest", "pandas", "polars", "gymnasium"]))?;
    run(pip(&python).args(CLUSTER))?;
    run(pip(&python).args(["--no-deps", "--force-reinstall"]).arg(wheel))?;
    let mut pytest = Command::new(&python);
    pytest.args(["-m", "pytest", "-q", "-p", "no:cacheprovider", "--durations=5"]);
    let tests = folders.package.join("tests");
    pytest.args(LONG.map(|folder| tests.join(folder)));
    pytest.current_dir(&folders.package).env("PYTHONPATH", &tests);
    run(pytest.env("POLICYC_PROGRAM", program))
}

fn pip(python: &Path) -> Command {
    let mut pip = Command::new(python);
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
    pip
}

/// The last line of pytest.
fn counted(log: &Path) -> String {
    let text = process::read_lossy(log);
    let line = text.lines().rev().find(|line| line.contains(" passed"));
    line.unwrap_or("no test").trim_matches(['=', ' ']).to_owned()
}
