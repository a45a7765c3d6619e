//! Every reader reads what once broke it, and a few hundred new inputs.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;

use fuzz::driver::{Plan, Until, run};
use fuzz::guard::probe;
use fuzz::targets;

/// Inputs of each target: together a few seconds.
const EXECUTIONS: u64 = 300;

// one test for all targets: the count of memory is that of the whole process
#[test]
fn no_reader_breaks_over_a_regression_or_a_short_run() {
    let mut faults = Vec::new();
    let folder = tempfile::tempdir().unwrap();
    for target in targets::all() {
        faults.extend(replayed(target, &targets::regressions(target)));
        let plan = Plan {
            seed: 7,
            until: Until {
                executions: Some(EXECUTIONS),
                seconds: None,
            },
            findings: folder.path().to_owned(),
        };
        let summary = run(target, &plan, None, &|_| {}).unwrap();
        assert_eq!(summary.executions, EXECUTIONS, "{}", target.name);
        assert!(summary.accepted > 0, "{} takes none of its seeds", target.name);
        faults.extend(summary.findings);
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

fn replayed(target: &targets::Target, folder: &Path) -> Vec<String> {
    let Ok(files) = std::fs::read_dir(folder) else {
        return Vec::new();
    };
    let reader = (target.reader)().unwrap();
    let fault = |file: std::fs::DirEntry| {
        let input = std::fs::read(file.path()).unwrap();
        let fault = probe(&*reader, &input, &target.limits).err()?;
        Some(format!("{}: {fault}", file.path().display()))
    };
    files.flatten().filter_map(fault).collect()
}

#[test]
fn every_folder_of_regressions_is_that_of_a_target() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("regressions");
    for entry in std::fs::read_dir(folder).unwrap().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        assert!(targets::find(&name).is_some(), "no target `{name}`");
    }
}
