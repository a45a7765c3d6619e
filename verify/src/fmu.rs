//! The archive of an FMU: generated files and, where this machine can make one, a binary.

use std::path::Path;
use std::process::Command;

use codegen::Output;
use codegen::backend::fmu::{self, Fmi};
use policy::Policy;
use targets::{Runner, TargetSpec};

use crate::session::{COMPILER_TIMEOUT, Files, VerifyError};
use crate::toolchain::{find, run_for};
use crate::zip;

/// An FMU as a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Archive {
    /// Such as `buck12_fmi2.fmu`.
    pub file: String,
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// Folder of the binary in it and the compiler that made it; or why there is none.
    pub binary: Result<(&'static str, &'static str), String>,
}

/// The archives of those outputs that are FMUs, of files that [`codegen::generate`] gave.
///
/// # Errors
/// If a file is missing or there is no temporary folder. That no binary can be made is no error: an importer compiles the
/// sources.
pub fn archives(
    policy: &Policy,
    target: &TargetSpec,
    outputs: &[Output],
    files: &Files,
) -> Result<Vec<Archive>, VerifyError> {
    let versions = outputs.iter().filter_map(|output| version(*output));
    versions.map(|fmi| archive(policy, target, fmi, files)).collect()
}

/// The version of FMI, if this output is an FMU.
#[must_use]
pub fn version(output: Output) -> Option<Fmi> {
    match output {
        Output::Fmu2 => Some(Fmi::Two),
        Output::Fmu3 => Some(Fmi::Three),
        Output::C | Output::Rust | Output::RustOverC | Output::Kit | Output::Sfunction => None,
    }
}

fn archive(policy: &Policy, target: &TargetSpec, fmi: Fmi, files: &Files) -> Result<Archive, VerifyError> {
    let name = &policy.name;
    let mut members = Vec::new();
    for (path, file) in fmu::layout(name, fmi) {
        let Some(text) = files.get(&file) else {
            return Err(fault("the FMU lacks a file"));
        };
        members.push((path, text.clone().into_bytes()));
    }
    let binary = match binary(name, target, fmi, files) {
        Ok((folder, compiler, bytes)) => {
            members.push((format!("binaries/{folder}/{name}.so"), bytes));
            Ok((folder, compiler))
        }
        Err(Absence::Told(reason)) => Err(reason),
        Err(Absence::Io(error)) => return Err(VerifyError::Io(std::env::temp_dir(), error)),
    };
    Ok(Archive {
        file: format!("{name}_{}.fmu", fmi.name()),
        bytes: zip::archive(&members).ok_or_else(|| fault("the FMU has more than 4 GiB"))?,
        binary,
    })
}

fn fault(text: &'static str) -> VerifyError {
    VerifyError::Codegen(codegen::CodegenError::Output(text))
}

/// Why there is no binary.
enum Absence {
    Told(String),
    Io(std::io::Error),
}

impl From<std::io::Error> for Absence {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error)
    }
}

/// The folder of this machine's binaries.
fn platform(fmi: Fmi) -> Option<&'static str> {
    match (std::env::consts::OS, std::env::consts::ARCH, fmi) {
        ("linux", "x86_64", Fmi::Two) => Some("linux64"),
        ("linux", "x86_64", Fmi::Three) => Some("x86_64-linux"),
        ("linux", "aarch64", Fmi::Three) => Some("aarch64-linux"),
        _ => None,
    }
}

type Binary = (&'static str, &'static str, Vec<u8>);

fn binary(name: &str, target: &TargetSpec, fmi: Fmi, files: &Files) -> Result<Binary, Absence> {
    if !matches!(target.runner, Runner::Native) {
        return Err(Absence::Told(format!(
            "the code is for {}, not for this machine; compile once more without --target for a binary of this machine",
            target.name
        )));
    }
    let Some(folder) = platform(fmi) else {
        return Err(Absence::Told("binaries are made on Linux for x86-64 only".to_owned()));
    };
    let compilers = || target.c_compilers.iter().map(|compiler| compiler.program);
    let Some(compiler) = compilers().find(|program| find(program).is_some()) else {
        let names: Vec<&str> = compilers().collect();
        return Err(Absence::Told(format!("no C compiler on PATH ({})", names.join(" or "))));
    };
    let temporary = tempfile::tempdir()?;
    for (_, file) in fmu::layout(name, fmi) {
        std::fs::write(
            temporary.path().join(&file),
            files.get(&file).map_or("", String::as_str),
        )?;
    }
    let mut command = Command::new(compiler);
    command.current_dir(temporary.path()).env("LC_ALL", "C");
    command.env("TMPDIR", temporary.path());
    command.args(target.c_flags).args(FLAGS);
    command.arg(format!("-D{}_OVERRIDE_FUNCTION_PREFIX", fmi.name().to_uppercase()));
    command.arg(format!("-D{}_FMI_OWN_HEADER", name.to_uppercase()));
    let output = run_for(
        command.args(fmu::sources(name, fmi)).args(["-o", LIBRARY]),
        COMPILER_TIMEOUT,
    )?;
    if !output.status.success() {
        let text = String::from_utf8_lossy(&output.stderr);
        let first = text.lines().find(|line| line.contains("error")).unwrap_or("no message");
        return Err(Absence::Told(format!("{compiler} did not build it: {first}")));
    }
    let library: &Path = &temporary.path().join(LIBRARY);
    Ok((folder, compiler, std::fs::read(library)?))
}

const LIBRARY: &str = "library.so";
/// Only the functions of FMI leave the library.
const FLAGS: [&str; 4] = ["-O2", "-shared", "-fPIC", "-fvisibility=hidden"];
