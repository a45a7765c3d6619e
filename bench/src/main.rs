//! `cargo xtask bench [--json]`: counts instructions of the bench network's controllers, ours and naive code.
//!
//! Microcontrollers are emulated by QEMU: instructions and their number are those of the processor, time is not. The
//! host is timed, ours beside the naive loop in the same process. Peers are built and counted in the same run where a
//! registry has them; the others stand by the figures their measurers stated.

mod build;
mod peers;
mod row;
mod sources;
mod table;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use policy::NumericFormat;
use targets::{Fma, Fpu, IntegerLoop, Runner, TargetSpec};

use build::Bench;
use row::{Failure, Row};

/// What is measured.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Part {
    All,
    /// What stands beside the peers: the bench network on the core that they are counted on.
    Peers,
    /// Times on this machine.
    Host,
    /// Instruction counts of what policyc makes: minutes, where the peers' builds take most of an hour.
    Counts,
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (json, part, picture) = match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        [] => (false, Part::All, None),
        ["--json"] => (true, Part::All, None),
        ["--peers"] => (false, Part::Peers, None),
        ["--host"] => (false, Part::Host, None),
        ["--counts"] => (true, Part::Counts, None),
        ["--picture", path] => (false, Part::Peers, Some(PathBuf::from(path))),
        _ => {
            eprintln!(
                "error: `bench` takes --json, --peers (Cortex-M4F alone), --picture FILE.svg (of that), --host (times on this \
                 machine alone), --counts (instruction counts without peers, as JSON), or nothing"
            );
            return ExitCode::from(2);
        }
    };
    let text = rows(part).and_then(|rows| {
        table::one_checksum_per_format(&rows)?;
        table::one_count_per_kernel(&rows)?;
        if let Some(path) = picture {
            let picture = peers::picture(&rows).map_err(|error| Failure(error.to_string()))?;
            std::fs::write(&path, picture.to_string())
                .map_err(|error| Failure(format!("{}: {error}", path.display())))?;
        }
        table::text(&rows, json)
    });
    match text {
        Ok(text) => {
            print!("{text}");
            ExitCode::SUCCESS
        }
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::FAILURE
        }
    }
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Where peers are counted.
const PEERS_CORE: &str = "cortex-m4f";

/// What the bench counts of a policy: format, and whether the loops in assembly are asked for.
const VARIANTS: [(NumericFormat, bool); 8] = [
    (NumericFormat::F32, false),
    (NumericFormat::F32, true),
    (NumericFormat::F32Fma, false),
    (NumericFormat::F64, false),
    (NumericFormat::I16, false),
    (NumericFormat::I16, true),
    (NumericFormat::I8, false),
    (NumericFormat::I8, true),
];

/// Whether a variant is counted on a target.
fn is_counted(target: &TargetSpec, name: &str, format: NumericFormat, assembly: bool) -> bool {
    let has_assembly = target.integer_block.inner == IntegerLoop::Dual;
    let is_whole_controller = name == "buck12" && target.name != "cortex-m4f";
    match format {
        _ if (assembly && !has_assembly) || is_whole_controller => false,
        NumericFormat::F32 => target.fpu != Fpu::None,
        NumericFormat::F32Fma => target.fma != Fma::Absent,
        NumericFormat::F64 => target.fpu.has(true),
        NumericFormat::I16 | NumericFormat::I8 => true,
    }
}

fn rows(part: Part) -> Result<Vec<Row>, Failure> {
    let bench = Bench::new()?;
    match part {
        Part::All => Ok([counts(&bench, part)?, host(&bench)?].concat()),
        Part::Peers | Part::Counts => counts(&bench, part),
        Part::Host => host(&bench),
    }
}

/// Instructions on the emulated cores; with `only_peers` on that of the peers.
fn counts(bench: &Bench, part: Part) -> Result<Vec<Row>, Failure> {
    let mut rows = Vec::new();
    for (name, path) in [
        ("bench", "bench/policy/policy.toml"),
        ("buck12", "examples/buck12/policy.toml"),
    ] {
        let policy = policy::load(&root().join(path)).map_err(|faults| Failure(faults.to_string()))?;
        let is_wanted = |target: &&TargetSpec| part != Part::Peers || name == "bench" && target.name == PEERS_CORE;
        let emulated = targets::TARGETS.iter();
        let emulated = emulated.filter(|target| matches!(target.runner, Runner::Emulated(_)));
        for target in emulated.filter(is_wanted) {
            let levels: &[&str] = if target.name == "cortex-m4f" {
                &["-O2", "-O3"]
            } else {
                &["-O2"]
            };
            for (format, assembly) in VARIANTS {
                if is_counted(target, name, format, assembly) {
                    let policy = policy.clone().with_format(format);
                    rows.extend(bench.counts(name, &policy, target, levels, assembly)?);
                }
            }
            if target.fpu != Fpu::None && name == "bench" {
                rows.extend(bench.naive(&policy, target)?);
            }
            if target.name == PEERS_CORE && name == "bench" && part != Part::Counts {
                rows.extend(peers::rows(bench, &policy, target, &root()));
            }
        }
    }
    Ok(rows)
}

/// Instruction sets of the x86-64 family that are timed where this machine has them: SSE2, AVX2, its own.
const MACHINES: [&str; 3] = ["x86-64", "x86-64-v3", "native"];

/// Times on this machine.
fn host(bench: &Bench) -> Result<Vec<Row>, Failure> {
    let policy =
        policy::load(&root().join("bench/policy/policy.toml")).map_err(|faults| Failure(faults.to_string()))?;
    let machines = if cfg!(target_arch = "x86_64") {
        &MACHINES[..]
    } else {
        &["native"]
    };
    let mut rows = Vec::new();
    for machine in machines.iter().filter(|machine| **machine != "x86-64-v3" || has_avx2()) {
        for format in [
            NumericFormat::F32,
            NumericFormat::F64,
            NumericFormat::I16,
            NumericFormat::I8,
        ] {
            rows.extend(bench.times(&policy.clone().with_format(format), targets::host(), machine)?);
        }
    }
    Ok(rows)
}

#[cfg(target_arch = "x86_64")]
fn has_avx2() -> bool {
    is_x86_feature_detected!("avx2")
}

#[cfg(not(target_arch = "x86_64"))]
fn has_avx2() -> bool {
    false
}
