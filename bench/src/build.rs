//! Builds the programs and runs them.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use codegen::Output;
use policy::Policy;
use targets::{Board, CCompiler, Endianness, Runner, TargetSpec};
use tempfile::TempDir;

use crate::row::{Failure, Row, variant};
use crate::sources::{self, CALLS};

/// Compilers and emulators with a folder to work in.
pub struct Bench {
    folder: TempDir,
}

/// Flags of every C build.
const EXACT: [&str; 2] = ["-std=c99", "-ffp-contract=off"];

/// The emulated board of a target.
fn board(target: &TargetSpec) -> Result<Board, Failure> {
    match target.runner {
        Runner::Emulated(board) => Ok(board),
        _ => Err(Failure(format!("{} has no emulator", target.name))),
    }
}

/// The compiler that also links.
fn linker(target: &TargetSpec) -> Result<CCompiler, Failure> {
    let first = target.c_compilers.first();
    first
        .copied()
        .ok_or_else(|| Failure(format!("{} has no compiler", target.name)))
}

impl Bench {
    /// Builds the instruction counter.
    ///
    /// # Errors
    /// If the counter cannot be built.
    pub fn new() -> Result<Self, Failure> {
        let folder = tempfile::tempdir().map_err(|error| Failure(error.to_string()))?;
        let bench = Self { folder };
        let counter = targets::boards::COUNTER;
        bench.put(counter.name, counter.text)?;
        run(Command::new("gcc").current_dir(bench.folder.path()).args([
            "-shared",
            "-fPIC",
            "-O2",
            "-o",
            "counter.so",
            counter.name,
        ]))?;
        Ok(bench)
    }

    /// Our controller on a core: each C compiler, then rustc.
    ///
    /// # Errors
    /// If a program cannot be built or does not run to its end.
    pub fn counts(
        &self,
        name: &str,
        policy: &Policy,
        target: &TargetSpec,
        levels: &[&str],
        assembly: bool,
    ) -> Result<Vec<Row>, Failure> {
        self.write(policy, target)?;
        self.put("main.c", &sources::c(policy))?;
        self.put("lib.rs", &sources::rust(policy))?;
        let define = format!("-D{}_ASSEMBLY", policy.name.to_uppercase());
        let extra: &[&str] = if assembly { &[&define] } else { &[] };
        let mut rows = Vec::new();
        for compiler in target.c_compilers {
            for level in levels {
                self.object(compiler, level, &format!("{}.c", policy.name), extra)?;
                let mut row = self.counted(target, &["unit.o"], &["main.c"])?;
                row.flash = Some(size(target, &self.path("unit.o"))?);
                self.linked(target, compiler, level, policy, extra, &mut row)?;
                let family = if compiler.program == "clang" { "clang" } else { "gcc" };
                row.compiler = format!("{family} {level}");
                rows.push(row);
            }
        }
        self.rust_archive(target, assembly)?;
        let mut row = self.counted(target, &["unit.a"], &[])?;
        row.compiler = "rustc -O3".to_owned();
        rows.push(row);
        for row in &mut rows {
            row.policy = name.to_owned();
            row.variant = variant(policy, assembly);
        }
        Ok(rows)
    }

    /// The naive network on a core.
    ///
    /// # Errors
    /// As [`Bench::counts`].
    pub fn naive(&self, policy: &Policy, target: &TargetSpec) -> Result<Vec<Row>, Failure> {
        self.put_naive(policy)?;
        self.put("main.c", &sources::naive_main(policy))?;
        let mut rows = Vec::new();
        for (variant, extra) in [
            ("naive C", &[][..]),
            ("naive C, contracted", &["-ffp-contract=fast"][..]),
        ] {
            self.object(&linker(target)?, "-O2", "naive.c", extra)?;
            let mut row = self.counted(target, &["unit.o"], &["main.c"])?;
            row.flash = Some(size(target, &self.path("unit.o"))?);
            row.network_flash = row.flash;
            row.compiler = "gcc -O2".to_owned();
            row.policy = "bench".to_owned();
            row.variant = variant.to_owned();
            row.step = None;
            rows.push(row);
        }
        Ok(rows)
    }

    /// Times on this machine, compiled for `machine`: gcc -O3 and rustc beside the naive loop under gcc -O3.
    ///
    /// # Errors
    /// If a program cannot be built or run.
    pub fn times(&self, policy: &Policy, target: &TargetSpec, machine: &str) -> Result<Vec<Row>, Failure> {
        self.write(policy, target)?;
        self.put_naive(policy)?;
        self.put("host.c", &sources::host(policy))?;
        self.put("host.rs", &sources::host_rust(policy))?;
        run(Command::new("rustc").current_dir(self.folder.path()).args([
            "--edition=2021",
            "-Copt-level=3",
            "-Cpanic=abort",
            &format!("-Ctarget-cpu={machine}"),
            "--crate-type=staticlib",
            "-Aunsafe_op_in_unsafe_fn",
            "host.rs",
            "-o",
            "host.a",
        ]))?;
        let unit = format!("{}.c", policy.name);
        let mut rows = Vec::new();
        for (compiler, unit) in [("gcc -O3", unit.as_str()), ("rustc -O3", "host.a")] {
            let mut command = Command::new("gcc");
            command.current_dir(self.folder.path()).args(EXACT).args([
                "-O3",
                &format!("-march={machine}"),
                "host.c",
                "naive.c",
                unit,
            ]);
            run(command.args(["-lpthread", "-ldl", "-o", "host"]))?;
            let text = run(&mut Command::new(self.path("host")))?;
            let text = String::from_utf8_lossy(&text).into_owned();
            let (ratio, checksum) = text.trim().split_once(' ').unwrap_or_default();
            rows.push(Row {
                compiler: format!("{compiler} {machine}"),
                policy: "bench".to_owned(),
                variant: policy.numeric_format.name().to_owned(),
                checksum: Some(checksum.to_owned()),
                time_ratio: ratio.parse().ok(),
                ..blank(std::env::consts::ARCH)
            });
        }
        Ok(rows)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn put(&self, name: &str, text: &str) -> Result<(), Failure> {
        std::fs::write(self.path(name), text).map_err(|error| Failure(format!("{name}: {error}")))
    }

    pub(crate) fn put_naive(&self, policy: &Policy) -> Result<(), Failure> {
        let (header, text) = sources::naive(policy);
        self.put("naive.h", &header)?;
        self.put("naive.c", &text)
    }

    fn write(&self, policy: &Policy, target: &TargetSpec) -> Result<(), Failure> {
        let files =
            codegen::sources(policy, target, &Output::CORES, None).map_err(|error| Failure(error.to_string()))?;
        files.files.iter().try_for_each(|(name, text)| self.put(name, text))
    }

    pub(crate) fn object(&self, compiler: &CCompiler, level: &str, unit: &str, extra: &[&str]) -> Result<(), Failure> {
        let mut command = Command::new(compiler.program);
        command.current_dir(self.folder.path()).args(compiler.machine_flags);
        if compiler.program == "clang" {
            command.arg("-ffreestanding");
        }
        command.args(EXACT).arg(level).args(extra);
        run(command.args(["-c", unit, "-o", "unit.o"])).map(|_| ())
    }

    fn rust_archive(&self, target: &TargetSpec, assembly: bool) -> Result<(), Failure> {
        let rust = target
            .rust
            .ok_or_else(|| Failure(format!("{} has no Rust", target.name)))?;
        let mut command = Command::new("rustc");
        command
            .current_dir(self.folder.path())
            .args(["--edition=2021", "--target", rust.triple])
            .args(rust.machine_flags);
        command.args([
            "-Copt-level=3",
            "-Cpanic=abort",
            "-Ccodegen-units=1",
            "--crate-type=staticlib",
        ]);
        if assembly {
            command.args(["--cfg", "policyc_assembly"]);
        }
        run(command.args(["lib.rs", "-o", "unit.a"])).map(|_| ())
    }

    /// What a linker keeps of the controller: for a firmware that asks for Q values alone, and for one that calls start-up,
    /// step and the integrity check in slices, but neither self test nor setters.
    fn linked(
        &self,
        target: &TargetSpec,
        compiler: &CCompiler,
        level: &str,
        policy: &Policy,
        extra: &[&str],
        row: &mut Row,
    ) -> Result<(), Failure> {
        let sections = ["-ffunction-sections", "-fdata-sections"];
        let flags: Vec<&str> = extra.iter().copied().chain(sections).collect();
        self.object(compiler, level, &format!("{}.c", policy.name), &flags)?;
        let linker = linker(target)?;
        let kept = |functions: &[&str]| {
            let mut command = Command::new(linker.program);
            command.current_dir(self.folder.path()).args(linker.machine_flags);
            command.args(["-nostdlib", "-r", "-Wl,--gc-sections"]);
            let roots = functions
                .iter()
                .map(|function| format!("-Wl,-u,{}_{function}", policy.name));
            run(command.args(roots).args(["unit.o", "-o", "kept.o"]))?;
            size(target, &self.path("kept.o"))
        };
        row.network_flash = Some(kept(&["q_values"])?);
        row.step_flash = Some(kept(&["init", "step", "integrity_slice"])?);
        Ok(())
    }

    /// Code and tables of the last linked program, with the board's.
    pub(crate) fn linked_flash(&self, target: &TargetSpec) -> Result<u64, Failure> {
        size(target, &self.path("program.elf"))
    }

    /// Links with the board, runs, reads counts and words.
    pub(crate) fn counted(&self, target: &TargetSpec, units: &[&str], mains: &[&str]) -> Result<Row, Failure> {
        let (board, linker) = (board(target)?, linker(target)?);
        board.files.iter().try_for_each(|file| self.put(file.name, file.text))?;
        let sources = board.files.iter().map(|file| file.name);
        let sources = sources.filter(|name| name.ends_with(".c") || name.ends_with(".S"));
        let mut link = Command::new(linker.program);
        link.current_dir(self.folder.path())
            .args(linker.machine_flags)
            .args(board.link_flags)
            .args(["-I.", "-L."])
            .args(board.linker_script.into_iter().flat_map(|script| ["-T", script]))
            .args(mains)
            .args(sources)
            .args(units)
            .args(["-lgcc", "-o", "program.elf"]);
        run(&mut link)?;
        let symbols = run(Command::new(tool(target, "nm")?).arg(self.path("program.elf")))?;
        let symbols = String::from_utf8_lossy(&symbols).into_owned();
        let (begin, end) = (address(&symbols, "count_begin")?, address(&symbols, "count_end")?);
        let (counter, counts) = (self.path("counter.so"), self.path("counts"));
        let plugin = format!(
            "{},begin=0x{begin},end=0x{end},out={}",
            counter.display(),
            counts.display()
        );
        let mut emulator = Command::new(board.emulator);
        emulator.args(["-plugin", &plugin]).args(board.arguments);
        let words = run(emulator.arg(self.path("program.elf")))?;
        let words: Vec<u32> = words
            .chunks_exact(4)
            .map(|bytes| {
                let append = |word: u32, byte: &u8| word << 8 | u32::from(*byte);
                match target.endianness {
                    Endianness::Big => bytes.iter().fold(0, append),
                    _ => bytes.iter().rev().fold(0, append),
                }
            })
            .collect();
        let [self_test, checksum, stack] = words.as_slice() else {
            return Err(Failure(format!(
                "{}: expected three words, found {}",
                target.name,
                words.len()
            )));
        };
        if *self_test != 0 {
            return Err(Failure(format!(
                "{}: the self test failed at vector {self_test}",
                target.name
            )));
        }
        let counts = std::fs::read_to_string(&counts).map_err(|error| Failure(error.to_string()))?;
        // instructions, accesses to memory, jumps
        let instructions = |line: &str| line.split_whitespace().next()?.parse().ok();
        let counts: Vec<u64> = counts.lines().filter_map(instructions).collect();
        let (q_values, rest) = counts.split_at_checked(CALLS).unwrap_or_default();
        let (step, slice) = rest.split_at_checked(CALLS).unwrap_or_default();
        Ok(Row {
            q_values: extremes(q_values),
            step: extremes(step),
            slice: extremes(slice),
            stack: Some(u64::from(*stack)),
            checksum: Some(format!("{checksum:08x}")),
            ..blank(target.name)
        })
    }
}

pub(crate) fn blank(core: &str) -> Row {
    Row {
        policy: String::new(),
        core: core.to_owned(),
        compiler: String::new(),
        variant: String::new(),
        q_values: None,
        step: None,
        slice: None,
        flash: None,
        network_flash: None,
        step_flash: None,
        stack: None,
        checksum: None,
        time_ratio: None,
    }
}

fn extremes(counts: &[u64]) -> Option<(u64, u64)> {
    Some((*counts.iter().min()?, *counts.iter().max()?))
}

fn address<'a>(symbols: &'a str, name: &str) -> Result<&'a str, Failure> {
    symbols
        .lines()
        .filter_map(|line| line.split_once(' '))
        .find(|(_, rest)| rest.split(' ').next_back() == Some(name))
        .map(|(address, _)| address)
        .ok_or_else(|| Failure(format!("no symbol `{name}`")))
}

/// A tool of the target's binary utilities.
fn tool(target: &TargetSpec, name: &str) -> Result<String, Failure> {
    Ok(linker(target)?.program.replace("gcc", name))
}

/// Code and constant tables of an object file.
fn size(target: &TargetSpec, object: &Path) -> Result<u64, Failure> {
    let tool = tool(target, "size")?;
    let text = run(Command::new(&tool).arg(object))?;
    let text = String::from_utf8_lossy(&text).into_owned();
    let first = text.lines().nth(1).and_then(|line| line.split_whitespace().next());
    first
        .and_then(|bytes| bytes.parse().ok())
        .ok_or_else(|| Failure(format!("{tool}: no size")))
}

pub(crate) fn run(command: &mut Command) -> Result<Vec<u8>, Failure> {
    let output = command.stdin(Stdio::null()).env("LC_ALL", "C").output();
    let program = command.get_program().to_string_lossy().into_owned();
    let output = output.map_err(|error| Failure(format!("{program}: {error}")))?;
    if output.status.success() {
        return Ok(output.stdout);
    }
    let text = String::from_utf8_lossy(&output.stderr);
    let text: Vec<&str> = text.lines().take(20).collect();
    Err(Failure(format!("{program}: {}\n{}", output.status, text.join("\n"))))
}
