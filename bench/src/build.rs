//! Builds the programs and runs them.

use std::fmt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use codegen::Language;
use policy::Policy;
use targets::TargetSpec;
use tempfile::TempDir;

use crate::cores::Core;
use crate::format_name;
use crate::sources::{self, CALLS};
use crate::table::Row;

/// Why there is no table.
#[derive(Debug)]
pub struct Failure(pub String);

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Compilers and emulators with the boards' files.
pub struct Bench {
    boards: PathBuf,
    folder: TempDir,
}

/// Flags of every C build.
const EXACT: [&str; 2] = ["-std=c99", "-ffp-contract=off"];
const C_LEVELS: [(&str, &str); 4] = [("gcc", "-O2"), ("gcc", "-O3"), ("clang", "-O2"), ("clang", "-O3")];

impl Bench {
    /// With the boards of the source tree; builds the instruction counter.
    ///
    /// # Errors
    /// If the counter cannot be built.
    pub fn new(root: &Path) -> Result<Self, Failure> {
        let folder = tempfile::tempdir().map_err(|error| Failure(error.to_string()))?;
        let boards = root.join("targets/boards");
        let counter = folder.path().join("counter.so");
        run(Command::new("gcc")
            .args(["-shared", "-fPIC", "-O2", "-o"])
            .arg(&counter)
            .arg(boards.join("counter/counter.c")))?;
        Ok(Self { boards, folder })
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
        core: &Core,
        assembly: bool,
    ) -> Result<Vec<Row>, Failure> {
        self.write(policy, target)?;
        self.put("main.c", &sources::c(policy))?;
        self.put("lib.rs", &sources::rust(policy))?;
        let define = format!("-D{}_ASSEMBLY", policy.name.to_uppercase());
        let extra: &[&str] = if assembly { &[&define] } else { &[] };
        let mut rows = Vec::new();
        for (compiler, level) in C_LEVELS {
            self.object(core, compiler, level, &format!("{}.c", policy.name), extra)?;
            let mut row = self.counted(core, &["unit.o"], &["main.c"])?;
            row.flash = Some(size(&self.path("unit.o"))?);
            row.compiler = format!("{compiler} {level}");
            rows.push(row);
        }
        // Rust has loops in assembly for integers only
        if !assembly || policy::scales::is_integer(policy.numeric_format) {
            self.rust_archive(core, assembly)?;
            let mut row = self.counted(core, &["unit.a"], &[])?;
            row.compiler = "rustc -O3".to_owned();
            rows.push(row);
        }
        for row in &mut rows {
            row.policy = name.to_owned();
            row.variant = format_name(policy, assembly);
        }
        Ok(rows)
    }

    /// The naive network on a core.
    ///
    /// # Errors
    /// As [`Bench::counts`].
    pub fn naive(&self, policy: &Policy, core: &Core) -> Result<Vec<Row>, Failure> {
        self.put_naive(policy)?;
        self.put("main.c", &sources::naive_main(policy))?;
        let mut rows = Vec::new();
        for (variant, extra) in [
            ("naive C", &[][..]),
            ("naive C, contracted", &["-ffp-contract=fast"][..]),
        ] {
            self.object(core, "gcc", "-O2", "naive.c", extra)?;
            let mut row = self.counted(core, &["unit.o"], &["main.c"])?;
            row.flash = Some(size(&self.path("unit.o"))?);
            row.compiler = "gcc -O2".to_owned();
            row.policy = "bench".to_owned();
            row.variant = variant.to_owned();
            row.step = None;
            rows.push(row);
        }
        Ok(rows)
    }

    /// Times on this machine: gcc -O3 and rustc beside the naive loop under gcc -O3.
    ///
    /// # Errors
    /// If a program cannot be built or run.
    pub fn times(&self, policy: &Policy, target: &TargetSpec) -> Result<Vec<Row>, Failure> {
        self.write(policy, target)?;
        self.put_naive(policy)?;
        self.put("host.c", &sources::host(policy))?;
        self.put("host.rs", &sources::host_rust(policy))?;
        run(Command::new("rustc").current_dir(self.folder.path()).args([
            "--edition=2021",
            "-Copt-level=3",
            "-Cpanic=abort",
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
            command
                .current_dir(self.folder.path())
                .args(EXACT)
                .args(["-O3", "host.c", "naive.c", unit]);
            run(command.args(["-lpthread", "-ldl", "-o", "host"]))?;
            let text = run(&mut Command::new(self.path("host")))?;
            let text = String::from_utf8_lossy(&text).into_owned();
            let (ratio, checksum) = text.trim().split_once(' ').unwrap_or_default();
            rows.push(Row {
                compiler: compiler.to_owned(),
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
        let files = codegen::generate(policy, target, &Language::ALL).map_err(|error| Failure(error.to_string()))?;
        files.files.iter().try_for_each(|(name, text)| self.put(name, text))
    }

    pub(crate) fn object(
        &self,
        core: &Core,
        compiler: &str,
        level: &str,
        unit: &str,
        extra: &[&str],
    ) -> Result<(), Failure> {
        let mut command = if compiler == "gcc" {
            Command::new("arm-none-eabi-gcc")
        } else {
            let mut clang = Command::new("clang");
            clang.args(["-ffreestanding", &format!("--target={}", core.triple)]);
            clang
        };
        command
            .current_dir(self.folder.path())
            .args(core.gcc)
            .args(EXACT)
            .arg(level)
            .args(extra);
        run(command.args(["-c", unit, "-o", "unit.o"])).map(|_| ())
    }

    fn rust_archive(&self, core: &Core, assembly: bool) -> Result<(), Failure> {
        let mut command = Command::new("rustc");
        command
            .current_dir(self.folder.path())
            .args(["--edition=2021", "--target", core.triple]);
        command.arg(format!("-Ctarget-cpu={}", core.cpu));
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

    /// Code and tables of the last linked program, with the board's.
    pub(crate) fn linked_flash(&self) -> Result<u64, Failure> {
        size(&self.path("program.elf"))
    }

    /// Links with the board, runs, reads counts and words.
    pub(crate) fn counted(&self, core: &Core, unit: &[&str], mains: &[&str]) -> Result<Row, Failure> {
        let board = |name: &str| self.boards.join(name);
        let mut link = Command::new("arm-none-eabi-gcc");
        link.current_dir(self.folder.path())
            .args(core.gcc)
            .args([
                "-std=gnu99",
                "-O2",
                "-ffreestanding",
                "-fno-tree-loop-distribute-patterns",
                "-nostdlib",
            ])
            .args(["-Wl,--gc-sections", "-I"])
            .arg(&self.boards)
            .arg("-L")
            .arg(&self.boards)
            .arg("-T")
            .arg(board("arm").join(core.script))
            .args(mains)
            .args(["arm/start.c", "memory.c", "reset.c", "semihosting.c", "words.c"].map(board))
            .args(unit)
            .args(["-lgcc", "-o", "program.elf"]);
        run(&mut link)?;
        let symbols = run(Command::new("arm-none-eabi-nm").arg(self.path("program.elf")))?;
        let symbols = String::from_utf8_lossy(&symbols).into_owned();
        let (begin, end) = (address(&symbols, "count_begin")?, address(&symbols, "count_end")?);
        let (counter, counts) = (self.path("counter.so"), self.path("counts"));
        let plugin = format!(
            "{},begin=0x{begin},end=0x{end},out={}",
            counter.display(),
            counts.display()
        );
        let mut emulator = Command::new("qemu-system-arm");
        emulator.args([
            "-machine",
            core.machine,
            "-display",
            "none",
            "-serial",
            "none",
            "-monitor",
            "none",
        ]);
        emulator.args([
            "-semihosting-config",
            "enable=on,target=native",
            "-plugin",
            &plugin,
            "-kernel",
        ]);
        let words = run(emulator.arg(self.path("program.elf")))?;
        let words: Vec<u32> = words
            .chunks_exact(4)
            .map(|bytes| bytes.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte)))
            .collect();
        let [self_test, checksum, stack] = words.as_slice() else {
            return Err(Failure(format!(
                "{}: expected three words, found {}",
                core.name,
                words.len()
            )));
        };
        if *self_test != 0 {
            return Err(Failure(format!(
                "{}: the self test failed at vector {self_test}",
                core.name
            )));
        }
        let counts = std::fs::read_to_string(&counts).map_err(|error| Failure(error.to_string()))?;
        // instructions, accesses to memory, jumps
        let instructions = |line: &str| line.split_whitespace().next()?.parse().ok();
        let counts: Vec<u64> = counts.lines().filter_map(instructions).collect();
        let (q_values, step) = counts.split_at_checked(CALLS).unwrap_or_default();
        Ok(Row {
            q_values: extremes(q_values),
            step: extremes(step),
            stack: Some(u64::from(*stack)),
            checksum: Some(format!("{checksum:08x}")),
            ..blank(core.name)
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
        flash: None,
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

/// Code and constant tables of an object file.
fn size(object: &Path) -> Result<u64, Failure> {
    let text = run(Command::new("arm-none-eabi-size").arg(object))?;
    let text = String::from_utf8_lossy(&text).into_owned();
    let first = text.lines().nth(1).and_then(|line| line.split_whitespace().next());
    first
        .and_then(|bytes| bytes.parse().ok())
        .ok_or_else(|| Failure("arm-none-eabi-size: no size".to_owned()))
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
