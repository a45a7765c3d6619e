//! `cargo xtask bench [--json]`: counts instructions of the bench network's controllers, ours and naive code.
//!
//! Microcontrollers are emulated by QEMU: instructions and their number are those of the processor, time is not. The
//! host is timed, ours beside the naive loop in the same process. Peers are built and counted in the same run where a
//! registry has them; the others stand by the figures their measurers stated.

mod build;
mod cores;
mod peers;
mod sources;
mod table;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use policy::{NumericFormat, Policy};
use targets::{RowBlock, TargetSpec};

use build::{Bench, Failure};
use cores::{CORES, Core};
use table::Row;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (json, only_peers, picture) = match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        [] => (false, false, None),
        ["--json"] => (true, false, None),
        ["--peers"] => (false, true, None),
        ["--picture", path] => (false, true, Some(PathBuf::from(path))),
        _ => {
            eprintln!(
                "error: `bench` takes --json, --peers (Cortex-M4F alone), --picture FILE.svg (of that), or nothing"
            );
            return ExitCode::from(2);
        }
    };
    let text = rows(only_peers).and_then(|rows| {
        table::one_checksum_per_format(&rows)?;
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
const VARIANTS: [(NumericFormat, bool); 7] = [
    (NumericFormat::F32, false),
    (NumericFormat::F32, true),
    (NumericFormat::F32Fma, false),
    (NumericFormat::I16, false),
    (NumericFormat::I16, true),
    (NumericFormat::I8, false),
    (NumericFormat::I8, true),
];

/// With `only_peers` what stands beside the peers alone: the bench network on the core that they are counted on.
fn rows(only_peers: bool) -> Result<Vec<Row>, Failure> {
    let bench = Bench::new(&root())?;
    let mut rows = Vec::new();
    for (name, path) in [
        ("bench", "bench/policy/policy.toml"),
        ("buck12", "examples/buck12/policy.toml"),
    ] {
        let policy = policy::load(&root().join(path)).map_err(|faults| Failure(faults.to_string()))?;
        let peers_core = |core: &&Core| !only_peers || name == "bench" && core.name == PEERS_CORE;
        for core in CORES.iter().filter(peers_core) {
            for (format, assembly) in VARIANTS {
                let skipped = (assembly && !core.has_dsp) || (name == "buck12" && core.name != "cortex-m4f");
                let fused_without_core = format == NumericFormat::F32Fma && !core.has_fma;
                if skipped || fused_without_core || (format == NumericFormat::F32 && !core.has_fpu) {
                    continue;
                }
                let policy = policy.clone().with_format(format);
                rows.extend(bench.counts(name, &policy, &spec(RowBlock::Rows(16)), core, assembly)?);
            }
            if core.has_fpu && name == "bench" {
                rows.extend(bench.naive(&policy, core)?);
            }
            if core.name == PEERS_CORE && name == "bench" {
                rows.extend(peers::rows(&bench, &policy, core, &root()));
            }
        }
    }
    if !only_peers {
        rows.extend(host(&bench)?);
    }
    Ok(rows)
}

/// Times on this machine.
fn host(bench: &Bench) -> Result<Vec<Row>, Failure> {
    let policy =
        policy::load(&root().join("bench/policy/policy.toml")).map_err(|faults| Failure(faults.to_string()))?;
    let formats = [NumericFormat::F32, NumericFormat::I16, NumericFormat::I8];
    let mut rows = Vec::new();
    for format in formats {
        rows.extend(bench.times(&policy.clone().with_format(format), &spec(RowBlock::All))?);
    }
    Ok(rows)
}

/// The host's target with the row block of the cores that are counted.
fn spec(c_row_block: RowBlock) -> TargetSpec {
    let mut spec = targets::TARGETS[0].clone();
    spec.c_row_block = c_row_block;
    spec
}

/// Name of a policy's format as the table shows it.
fn format_name(policy: &Policy, assembly: bool) -> String {
    let name = policy.numeric_format.name();
    if assembly {
        format!("{name}, assembly")
    } else {
        name.to_owned()
    }
}
