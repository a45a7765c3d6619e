//! What one control step costs on an emulated target: memory, stack, executed instructions.
//!
//! Instructions are those the emulator executes from the call of `step` to its return, both included; the plugin that
//! counts them is `targets/boards/counter`. The stack is painted before each step and looked at afterwards. Neither is
//! time: QEMU knows no cycles.
//!
//! ```text
//! controller.o ─────────────────────────► sizes, library calls
//! controller.o + driver + board ─► image ─► QEMU with the plugin ─► pipe: depth of the stack, a word a step
//!                                     └ addresses of count_begin, count_end     └► file: instructions, a line a step
//! ```

use std::fmt;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use interp::Sample;
use policy::{Policy, Scalar};
use random::{Random, SplitMix};
use serde::Serialize;
use targets::TargetSpec;

use crate::elf::Elf;
use crate::estimate::{Estimate, estimate};
use crate::protocol::encode_sample;
use crate::runner::{ProcessRunner, Runner as _};
use crate::session::{COMPILER_TIMEOUT, Files};
use crate::toolchain::{self, Build, BuildError, Install, Missing, Purpose, Sources};
use crate::traces::sample_of;

/// Steps that are counted.
// a convention: about 64 of each of the four kinds of samples below
pub const STEPS: usize = 256;

/// What one control step costs in one build.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Costs {
    /// Such as `arm-none-eabi-gcc -O2`.
    pub build: String,
    /// Code and tables of the controller's object file in bytes, without helpers of the compiler's library.
    pub flash_bytes: u32,
    /// Static memory of the controller's object file that can be written, in bytes; the state is the caller's.
    pub static_ram_bytes: u32,
    /// Stack below the call of `step` in bytes, the largest of all steps: painted under the emulator.
    pub stack_bytes: u32,
    /// Executed instructions of a step, the fewest of all steps.
    pub instructions_min: u64,
    /// Executed instructions of a step, the most of all steps.
    pub instructions_max: u64,
    /// Model of the cycles of a step at 0 wait states, least and most; `None` where the target has no model. Not measured.
    pub model_cycles: Option<(u64, u64)>,
    /// Steps counted: inside the plausible ranges, anywhere among the floats, not a number.
    pub steps: usize,
    /// Functions that the controller calls and does not hold: the float library of a processor without FPU.
    pub library_calls: Vec<String>,
}

/// What [`usual_builds`] has found out.
#[derive(Debug, Default)]
pub struct UsualBuilds {
    /// Builds that ran.
    pub measured: Vec<Costs>,
    /// Builds that could not run, because the emulator is not on this machine.
    pub estimated: Vec<Estimate>,
    /// What was not on this machine.
    pub missing: Vec<Missing>,
}

/// Why nothing was measured.
#[derive(Debug)]
pub enum MeasureError {
    /// Tools that are not on this machine.
    Missing(Vec<Missing>),
    /// The code does not build.
    Build(BuildError),
    /// A file could not be written or read.
    Io(std::io::Error),
    /// The program did not answer as it should.
    Run(String),
}

impl fmt::Display for MeasureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing(missing) => {
                let reasons: Vec<&str> = missing.iter().map(|missing| missing.reason.as_str()).collect();
                write!(f, "{}", reasons.join(", "))
            }
            Self::Build(BuildError::Refused(text) | BuildError::TooLarge(text)) => write!(f, "{text}"),
            Self::Build(error) => write!(f, "{error:?}"),
            Self::Io(error) => write!(f, "{error}"),
            Self::Run(text) => write!(f, "{text}"),
        }
    }
}

impl std::error::Error for MeasureError {}

impl From<std::io::Error> for MeasureError {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error)
    }
}

/// Measures one build of generated files; [`toolchain::builds`] lists the builds of a target.
///
/// # Errors
/// If tools are missing or the program does not run; see [`MeasureError`].
pub fn measure(policy: &Policy, target: &TargetSpec, files: &Files, build: &Build) -> Result<Costs, MeasureError> {
    let mut missing = build.missing.clone();
    if toolchain::find(PLUGIN_COMPILER).is_none() {
        missing.push(Missing {
            reason: format!("{PLUGIN_COMPILER} is not on PATH"),
            install: Some(Install::Package(PLUGIN_COMPILER.to_owned())),
        });
    }
    if !missing.is_empty() {
        return Err(MeasureError::Missing(missing));
    }
    let folder = tempfile::tempdir()?;
    let folder = folder.path();
    let sources = Sources {
        purpose: Purpose::Measure,
        policy,
        files,
        target,
        extra_flags: &[],
        extra_rust_flags: &[],
        timeout: COMPILER_TIMEOUT,
    };
    let image = toolchain::compile(build, sources, folder).map_err(MeasureError::Build)?;
    let object = toolchain::controller_object(build, sources, folder).map_err(MeasureError::Build)?;
    let object = read_elf(&object)?;
    let marks = read_elf(&image)?;
    let counts = folder.join("counts");
    let emulator = plugin_arguments(folder, &marks, &counts)?;
    let Some(command) = toolchain::launch(target, image, &emulator) else {
        return Err(MeasureError::Run("the target has no emulator".to_owned()));
    };
    let depths = answers(policy, target, command)?;
    let counts = read_counts(&counts)?;
    Ok(Costs {
        build: build.name(),
        flash_bytes: object.flash_bytes(),
        static_ram_bytes: object.ram_bytes(),
        stack_bytes: depths.iter().copied().max().unwrap_or_default(),
        instructions_min: counts.iter().map(|count| count.instructions).min().unwrap_or_default(),
        instructions_max: counts.iter().map(|count| count.instructions).max().unwrap_or_default(),
        // least with the cheapest accesses and jumps, most with the dearest: what the processor does lies between
        model_cycles: target.cycles.map(|model| {
            let least = counts.iter().map(|count| count.cycles(model.access.0, model.jump.0));
            let most = counts.iter().map(|count| count.cycles(model.access.1, model.jump.1));
            (least.min().unwrap_or_default(), most.max().unwrap_or_default())
        }),
        steps: counts.len(),
        library_calls: calls(&object),
    })
}

/// Builds the plugin for the emulator of this machine.
const PLUGIN_COMPILER: &str = "gcc";

/// A step under the emulator takes milliseconds.
// the limit is a hundred times what all of them take, for machines under load
const RUN_TIMEOUT: Duration = Duration::from_secs(120);

pub(crate) fn read_elf(path: &Path) -> Result<Elf, MeasureError> {
    let bytes = std::fs::read(path)?;
    Elf::read(&bytes).ok_or_else(|| MeasureError::Run("the compiler wrote no ELF file of 32 bits".to_owned()))
}

/// Compiles the counter and names it to the emulator.
fn plugin_arguments(folder: &Path, marks: &Elf, counts: &Path) -> Result<Vec<String>, MeasureError> {
    let counter = targets::boards::COUNTER;
    std::fs::write(folder.join(counter.name), counter.text)?;
    let plugin = folder.join("counter.so");
    let mut command = Command::new(PLUGIN_COMPILER);
    command.args(["-shared", "-fPIC", "-O2"]).arg(folder.join(counter.name));
    // what the compiler leaves behind when it is ended goes with the folder
    command.env("TMPDIR", folder);
    let output = toolchain::run_for(command.arg("-o").arg(&plugin), COMPILER_TIMEOUT)?;
    if !output.status.success() {
        return Err(MeasureError::Run(String::from_utf8_lossy(&output.stderr).into_owned()));
    }
    let mark = |name: &str| {
        let address = marks.address(name);
        address.ok_or_else(|| MeasureError::Run(format!("the image has no symbol {name}")))
    };
    Ok(vec![
        "-plugin".to_owned(),
        format!(
            "{},begin={:#x},end={:#x},out={}",
            plugin.display(),
            mark("count_begin")?,
            mark("count_end")?,
            counts.display()
        ),
    ])
}

/// Runs all steps; one depth of the stack per step.
fn answers(policy: &Policy, target: &TargetSpec, command: Command) -> Result<Vec<u32>, MeasureError> {
    let mut runner = ProcessRunner::new(command, RUN_TIMEOUT, target.endianness);
    let fault = |error: crate::runner::RunError| MeasureError::Run(error.reason.to_string());
    runner.start(0).map_err(fault)?;
    let depths = runner.exchange(&samples(policy), STEPS).map_err(fault)?;
    // the counter closes its file when the emulator ends, and the emulator ends with the stream
    runner.finish().map_err(fault)?;
    Ok(depths)
}

/// Samples as words per step and signal: half of the steps inside the plausible ranges, a quarter anywhere, a quarter with
/// one that is not a number or at the end of the codes.
fn samples(policy: &Policy) -> Vec<u32> {
    let scalar = policy.numeric_format.scalar();
    // always the same samples: costs of two builds are compared with each other
    let mut rng = SplitMix::new(7);
    let mut words = Vec::new();
    for _ in 0..STEPS {
        let kind = rng.below(4);
        let bad = rng.below(policy.signals.len());
        for (index, signal) in policy.signals.iter().enumerate() {
            let inside = sample_of(scalar, signal, rng.uniform(signal.range.low, signal.range.high));
            let sample = match (kind, signal.adc) {
                (0, Some(_)) => Sample::Code(rng.bits() as i32),
                (0, None) => match scalar {
                    Scalar::F32 => Sample::Physical(f32::from_bits(rng.bits() as u32)),
                    Scalar::F64 => Sample::Wide(f64::from_bits(rng.bits())),
                },
                (1, None) if index == bad => Sample::Physical(f32::NAN),
                (1, Some(_)) if index == bad => Sample::Code(i32::MAX),
                _ => inside,
            };
            encode_sample(sample, scalar, &mut words);
        }
    }
    words
}

/// One passage, as the counter writes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Count {
    instructions: u64,
    accesses: u64,
    jumps: u64,
}

impl Count {
    fn read(line: &str) -> Option<Self> {
        let mut numbers = line.split_whitespace().map(str::parse);
        Some(Self {
            instructions: numbers.next()?.ok()?,
            accesses: numbers.next()?.ok()?,
            jumps: numbers.next()?.ok()?,
        })
    }

    fn cycles(self, per_access: u8, per_jump: u8) -> u64 {
        self.instructions + self.accesses * u64::from(per_access) + self.jumps * u64::from(per_jump)
    }
}

fn read_counts(path: &Path) -> Result<Vec<Count>, MeasureError> {
    let text = std::fs::read_to_string(path)?;
    let counts: Vec<Count> = text.lines().filter_map(Count::read).collect();
    // fewer would be a fault of the marks, and a minimum over the rest would look right
    if counts.len() == STEPS {
        Ok(counts)
    } else {
        Err(MeasureError::Run(format!(
            "{} of {STEPS} steps were counted",
            counts.len()
        )))
    }
}

/// Names that an object file needs from elsewhere, sorted.
fn calls(object: &Elf) -> Vec<String> {
    let mut names: Vec<String> = object
        .symbols
        .iter()
        .filter(|symbol| !symbol.is_defined)
        .map(|symbol| symbol.name.clone())
        .collect();
    names.sort();
    names.dedup();
    names
}

/// Measures the builds that firmware takes: the first C compiler at each level, and rustc; those that can be made here. Builds
/// in C are estimated if there is no emulator to run them.
///
/// # Errors
/// Of the first build that can be made and does not run; what is missing is no error.
pub fn usual_builds(
    policy: &Policy,
    target: &TargetSpec,
    files: &Files,
    languages: &[codegen::Language],
) -> Result<UsualBuilds, MeasureError> {
    let mut usual_builds = UsualBuilds::default();
    let targets::Runner::Emulated(board) = target.runner else {
        return Ok(usual_builds);
    };
    let first = target.c_compilers.first().map(|compiler| compiler.program);
    let usual = toolchain::builds(target, &[], &[]).into_iter().filter(|build| {
        languages.contains(&build.language()) && (Some(build.compiler) == first || build.compiler == toolchain::RUSTC)
    });
    let usual: Vec<Build> = usual.collect();
    // side by side: a compiler and an emulator use one processor each
    let each: Vec<Measured> = std::thread::scope(|scope| {
        let started: Vec<_> = usual
            .iter()
            .map(|build| scope.spawn(move || with_assembly(policy, target, files, build)))
            .collect();
        let ended = started.into_iter().map(|one| one.join());
        ended
            .map(|one| one.unwrap_or_else(|_| Err(MeasureError::Run("the measurement broke off".to_owned()))))
            .collect()
    });
    for (build, costs) in usual.iter().zip(each) {
        match costs {
            Ok(costs) => usual_builds.measured.extend(costs),
            Err(MeasureError::Missing(what)) => {
                let compiles = toolchain::find(build.compiler).is_some() && build.language() == codegen::Language::C;
                // only where nothing can run: a stack that is summed must not stand in for one that is measured
                if compiles && toolchain::find(board.emulator).is_none() {
                    usual_builds.estimated.push(estimate(policy, target, files, build)?);
                }
                usual_builds.missing.extend(what);
            }
            Err(error) => return Err(error),
        }
    }
    usual_builds.missing.dedup();
    Ok(usual_builds)
}

/// A build, and the same with the loops in assembly where there are such.
type Measured = Result<Vec<Costs>, MeasureError>;

fn with_assembly(policy: &Policy, target: &TargetSpec, files: &Files, build: &Build) -> Measured {
    let mut costs = vec![measure(policy, target, files, build)?];
    if let Some(build) = build.with_assembly(policy, target, files) {
        costs.push(measure(policy, target, files, &build)?);
    }
    Ok(costs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_the_counter_is_three_numbers() {
        let count = Count {
            instructions: 100,
            accesses: 20,
            jumps: 5,
        };
        assert_eq!(Count::read("100 20 5"), Some(count));
        assert_eq!(Count::read("100 20"), None);
        assert_eq!(count.cycles(0, 1), 105);
        assert_eq!(count.cycles(1, 3), 135);
    }
}
