//! From generated files and a driver to an executable.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use policy::Policy;
use targets::{Board, CCompiler, Runner, TargetSpec};

use super::run::run_for;
use super::{Build, Tool, rust};
use crate::drivers::{self, Form};

/// What the program around the controller does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Answers events (see [`crate::protocol`]).
    Compare,
    /// Steps between the marks of the instruction counter (see [`mod@crate::measure`]); for boards only.
    Measure,
    /// Runs the back-to-back kit, which is among the files; in C, for boards only.
    Kit,
}

/// What is compiled, the same for all builds.
#[derive(Debug, Clone, Copy)]
pub struct Sources<'a> {
    /// Which driver.
    pub purpose: Purpose,
    /// The policy, for the driver.
    pub policy: &'a Policy,
    /// Generated files: relative path, text.
    pub files: &'a BTreeMap<String, String>,
    /// Whose flags are used.
    pub target: &'a TargetSpec,
    /// More flags for the C compilers, after all others.
    pub extra_flags: &'a [String],
    /// More flags for rustc, after all others.
    pub extra_rust_flags: &'a [String],
    /// A compiler that takes longer has failed.
    pub timeout: Duration,
}

/// Why there is no program.
#[derive(Debug)]
pub enum BuildError {
    /// The files have no code in the compiler's language.
    NoFiles,
    /// A file could not be written or the compiler not be started.
    Io(std::io::Error),
    /// The run-time library of the sanitisers is not installed.
    NoSanitiser,
    /// Tables, code and memory are larger than the board; the linker's text.
    TooLarge(String),
    /// The compiler refused, with its text.
    Refused(String),
}

impl From<std::io::Error> for BuildError {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error)
    }
}

/// Compiles driver and generated files in `folder`, which must be empty and private to this build.
///
/// # Errors
/// See [`BuildError`].
pub fn compile(build: &Build, sources: Sources<'_>, folder: &Path) -> Result<PathBuf, BuildError> {
    for (path, text) in sources.files {
        let path = folder.join(path);
        // the folder itself, which an interruption may have removed, must not come back
        if let Some(parent) = path.parent().filter(|parent| *parent != folder) {
            std::fs::create_dir_all(parent)?;
        }
        std::fs::write(path, text)?;
    }
    let job = Job { build, sources, folder };
    match (build.tool, &sources.target.runner) {
        (Tool::C(compiler), Runner::Emulated(board)) => {
            job.write_board(board)?;
            let objects = job.c_objects(compiler)?;
            job.link(board, &objects)
        }
        (Tool::Rust(_), Runner::Emulated(board)) => {
            job.write_board(board)?;
            let library = job.rust(Form::Board)?;
            job.link(board, &[library])
        }
        (Tool::C(compiler), Runner::Native | Runner::None(_)) => job.c_program(compiler),
        (Tool::Rust(_), Runner::Native | Runner::None(_)) => job.rust(Form::Hosted),
    }
}

/// The object file of the controller alone, in a folder where [`compile`] has built it for a board.
///
/// # Errors
/// See [`BuildError`].
pub fn controller_object(build: &Build, sources: Sources<'_>, folder: &Path) -> Result<PathBuf, BuildError> {
    let name = &sources.policy.name;
    match build.tool {
        Tool::C(_) => Ok(folder.join(format!("{name}.o"))),
        Tool::Rust(_) => Job { build, sources, folder }.rust_object(),
    }
}

/// One build in its folder.
struct Job<'a> {
    build: &'a Build,
    sources: Sources<'a>,
    folder: &'a Path,
}

impl Job<'_> {
    /// Units in C. Integrations beside the controller bring a `main` or need headers of a tool: only the kit is compiled.
    fn c_units(&self) -> impl Iterator<Item = &String> {
        let Sources { purpose, policy, .. } = self.sources;
        let is_controller = move |path: &&String| Path::new(path).file_stem().is_some_and(|stem| *stem == *policy.name);
        self.of_kind("c")
            .filter(move |path| purpose == Purpose::Kit || is_controller(path))
    }

    fn of_kind(&self, extension: &'static str) -> impl Iterator<Item = &String> {
        self.sources
            .files
            .keys()
            .filter(move |path| Path::new(path).extension().is_some_and(|e| e == extension))
    }

    fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        self.settle(&mut command);
        command
    }

    /// A compiler works in the folder of its build, also with its own temporary files, which it leaves behind if a signal
    /// ends it.
    fn settle(&self, command: &mut Command) {
        command
            .current_dir(self.folder)
            .env("TMPDIR", self.folder)
            // messages are searched for English words below
            .env("LC_ALL", "C");
    }

    /// The compiler with all flags, driver and units; the driver is written.
    fn c_command(&self, compiler: CCompiler, form: Form) -> Result<Command, BuildError> {
        let mut units = self.c_units().peekable();
        if units.peek().is_none() {
            return Err(BuildError::NoFiles);
        }
        std::fs::write(
            self.folder.join("policyc_driver.c"),
            match self.sources.purpose {
                Purpose::Compare => drivers::c::text(self.sources.policy, form),
                Purpose::Measure => drivers::measure::c(self.sources.policy),
                Purpose::Kit => drivers::kit::c(self.sources.policy),
            },
        )?;
        let mut command = self.command(compiler.program);
        command
            .args(compiler.machine_flags)
            .args(self.sources.target.c_flags)
            .args(self.build.flags)
            .args(&self.build.extra)
            // last, so that a user's flag wins over ours
            .args(self.sources.extra_flags);
        let parents = self.of_kind("h").filter_map(|path| Path::new(path).parent());
        for parent in parents.collect::<std::collections::BTreeSet<_>>() {
            command.arg("-I").arg(self.folder.join(parent));
        }
        command.arg("policyc_driver.c").args(units);
        Ok(command)
    }

    fn c_program(&self, compiler: CCompiler) -> Result<PathBuf, BuildError> {
        let executable = self.folder.join("driver.exe");
        // no -lm: the generated code must not need it
        let mut command = self.c_command(compiler, Form::Hosted)?;
        self.run(command.arg("-o").arg(&executable))?;
        Ok(executable)
    }

    fn c_objects(&self, compiler: CCompiler) -> Result<Vec<PathBuf>, BuildError> {
        let mut command = self.c_command(compiler, Form::Board)?;
        self.run(command.args(["-I", BOARD_FOLDER, "-c"]))?;
        // with -c gcc writes the objects into the working folder, without the folders of their sources
        let units = self.c_units().map(|unit| Path::new(unit).with_extension("o"));
        let names = units.filter_map(|unit| unit.file_name().map(PathBuf::from));
        Ok(std::iter::once(PathBuf::from("policyc_driver.o"))
            .chain(names)
            .collect())
    }

    /// The generated module and the compiler with all flags.
    fn rust_command(&self) -> Result<(&String, Command), BuildError> {
        let name = format!("{}.rs", self.sources.policy.name);
        let unit = self
            .of_kind("rs")
            .find(|path| Path::new(path).file_name().is_some_and(|file| *file == *name));
        let (Some(unit), Some(toolchain)) = (unit, self.build.rust) else {
            return Err(BuildError::NoFiles);
        };
        let mut command = toolchain.rustc().map_err(BuildError::Refused)?;
        self.settle(&mut command);
        command.args(self.sources.target.rust_flags).args(self.build.flags);
        if let Tool::Rust(spec) = self.build.tool {
            command.args(rust::flags(spec));
        }
        command.args(&self.build.extra).args(self.sources.extra_rust_flags);
        Ok((unit, command))
    }

    /// The generated module as a crate of its own.
    fn rust_object(&self) -> Result<PathBuf, BuildError> {
        let (unit, mut command) = self.rust_command()?;
        std::fs::write(
            self.folder.join("policyc_core.rs"),
            // alone and not with the driver, whose code would be measured as well
            format!("#![no_std]\n#[path = \"{unit}\"]\npub mod controller;\n"),
        )?;
        let object = self.folder.join("policyc_core.o");
        // one codegen unit, since `-o` names one object file
        command.args(["--crate-type=lib", "--emit=obj", "-Cpanic=abort", "-Ccodegen-units=1"]);
        self.run(command.arg("policyc_core.rs").arg("-o").arg(&object))?;
        Ok(object)
    }

    fn rust(&self, form: Form) -> Result<PathBuf, BuildError> {
        let (unit, mut command) = self.rust_command()?;
        std::fs::write(
            self.folder.join("policyc_driver.rs"),
            match self.sources.purpose {
                Purpose::Compare => drivers::rust::text(self.sources.policy, unit, form),
                Purpose::Measure => drivers::measure::rust(self.sources.policy, unit),
                Purpose::Kit => return Err(BuildError::NoFiles),
            },
        )?;
        let product = match form {
            Form::Hosted => self.folder.join("driver.exe"),
            Form::Board => {
                command.args(["--crate-type=staticlib", "-Cpanic=abort"]);
                self.folder.join("libdriver.a")
            }
        };
        self.run(command.arg("policyc_driver.rs").arg("-o").arg(&product))?;
        Ok(product)
    }

    fn write_board(&self, board: &Board) -> Result<(), BuildError> {
        let folder = self.folder.join(BOARD_FOLDER);
        std::fs::create_dir(&folder)?;
        for file in board.files {
            std::fs::write(folder.join(file.name), file.text)?;
        }
        Ok(())
    }

    /// Compiles the board's own files and links all.
    fn link(&self, board: &Board, objects: &[PathBuf]) -> Result<PathBuf, BuildError> {
        let executable = self.folder.join("driver.elf");
        // the same linker for Rust: start-up and linker script are those of C
        let Some(linker) = self.sources.target.c_compilers.first() else {
            return Err(BuildError::NoFiles);
        };
        let mut command = self.command(linker.program);
        command
            .args(linker.machine_flags)
            .args(board.link_flags)
            .args(["-I", BOARD_FOLDER, "-L", BOARD_FOLDER]);
        if let Some(script) = board.linker_script {
            command.arg("-T").arg(script);
        }
        let sources = board.files.iter().map(|file| Path::new(BOARD_FOLDER).join(file.name));
        command.args(sources.filter(|path| path.extension().is_some_and(|e| e == "c" || e == "S")));
        command.args(objects);
        if board.linker_script.is_some() {
            // helpers of the compiler: soft floats, division
            command.arg("-lgcc");
        }
        self.run(command.arg("-o").arg(&executable))?;
        Ok(executable)
    }

    fn run(&self, command: &mut Command) -> Result<(), BuildError> {
        let output = run_for(command, self.sources.timeout)?;
        if output.status.success() {
            return Ok(());
        }
        // the folder is a random name: without it the same fault gives the same text
        let text = String::from_utf8_lossy(&output.stderr).replace(&self.folder.display().to_string(), ".");
        // a linker that misses libasan is a missing package, not a fault of the code
        let sanitised = self.build.flags.iter().any(|flag| flag.starts_with("-fsanitize"));
        if text.contains("cannot find") && text.contains("san") && sanitised {
            return Err(BuildError::NoSanitiser);
        }
        // a screen; what follows the first error is mostly its echo
        let first_lines: Vec<&str> = text.lines().take(40).collect();
        let text = first_lines.join("\n");
        Err(
            if text.contains("overflowed by") || text.contains("will not fit in region") {
                BuildError::TooLarge(text)
            } else {
                BuildError::Refused(text)
            },
        )
    }
}

/// Folder of the board's files beside driver and controller.
const BOARD_FOLDER: &str = "policyc_board";
