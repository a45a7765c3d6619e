//! What can be said of a build that runs nowhere here, for want of an emulator: sizes, and a stack that is estimated.
//!
//! ```text
//! gcc -fcallgraph-info=su ─► name.o     sizes of sections
//!                         └► name.ci    node: { title: "buck12_step" label: "...\n48 bytes (static)" }
//!                                       edge: { sourcename: "buck12_step" targetname: "buck12_eval" }
//!
//! stack of step = its frame + the deepest of what it calls
//! ```

use std::collections::BTreeMap;

use policy::Policy;
use serde::Serialize;
use targets::TargetSpec;

use crate::measure::{MeasureError, read_elf};
use crate::session::{COMPILER_TIMEOUT, Files};
use crate::toolchain::{self, Build, Purpose, Sources};

/// Costs of a build as its compiler states them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Estimate {
    /// Such as `arm-none-eabi-gcc -O2`.
    pub build: String,
    /// Code and tables of the controller's object file in bytes, without helpers of the compiler's library.
    pub flash_bytes: u32,
    /// Static memory of the controller's object file that can be written, in bytes.
    pub static_ram_bytes: u32,
    /// Bytes of stack of `step`: the frames that gcc reports, summed along the deepest chain of calls. The call itself and
    /// functions of the compiler's library are not in it. Nothing was run.
    pub estimated_stack_bytes: u32,
}

/// gcc writes the frame of every function and who calls whom beside the object file.
const CALL_GRAPH: &str = "-fcallgraph-info=su";

/// Estimates a build in C with gcc; needs the compiler only.
///
/// # Errors
/// If the code does not build, or the compiler has reported no frame of `step`.
pub fn estimate(policy: &Policy, target: &TargetSpec, files: &Files, build: &Build) -> Result<Estimate, MeasureError> {
    let folder = tempfile::tempdir()?;
    let sources = Sources {
        purpose: Purpose::Measure,
        policy,
        files,
        target,
        extra_flags: &[CALL_GRAPH.to_owned()],
        extra_rust_flags: &[],
        timeout: COMPILER_TIMEOUT,
    };
    toolchain::compile(build, sources, folder.path()).map_err(MeasureError::Build)?;
    let object = toolchain::controller_object(build, sources, folder.path()).map_err(MeasureError::Build)?;
    let graph = std::fs::read_to_string(object.with_extension("ci"))?;
    let object = read_elf(&object)?;
    let stack = deepest(&graph, &format!("{}_step", policy.name));
    Ok(Estimate {
        build: build.name(),
        flash_bytes: object.flash_bytes(),
        static_ram_bytes: object.ram_bytes(),
        estimated_stack_bytes: stack
            .ok_or_else(|| MeasureError::Run("the compiler reported no stack of the step".to_owned()))?,
    })
}

/// Stack of a function with all it calls, from the text of gcc's call graph; `None` without a frame of it, or if it calls
/// itself.
fn deepest(graph: &str, function: &str) -> Option<u32> {
    let mut frames = BTreeMap::new();
    let mut calls: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for line in graph.lines() {
        // the texts in quotes are all that is wanted of a line; gcc writes one node or edge a line
        let quoted: Vec<&str> = line.split('"').skip(1).step_by(2).collect();
        match *quoted.as_slice() {
            [title, label, ..] if line.starts_with("node:") => {
                // `name\nfile:line:column\n48 bytes (static)`; a function of another file has no such end
                let size = label.rsplit("\\n").next().and_then(|end| end.split_once(" bytes"));
                frames.insert(title, size.and_then(|(bytes, _)| bytes.parse().ok()).unwrap_or(0));
            }
            [from, to, ..] if line.starts_with("edge:") => calls.entry(from).or_default().push(to),
            _ => {}
        }
    }
    // without a frame of `step` a sum of 0 would pass for a result
    frames.contains_key(function).then_some(())?;
    below(function, &frames, &calls, frames.len())
}

/// `left` bounds the length of a chain: a longer one goes round.
fn below<'a>(
    function: &'a str,
    frames: &BTreeMap<&'a str, u32>,
    calls: &BTreeMap<&'a str, Vec<&'a str>>,
    left: usize,
) -> Option<u32> {
    // a stack without bound has no estimate
    let left = left.checked_sub(1)?;
    let mut deepest = 0;
    for callee in calls.get(function).into_iter().flatten() {
        deepest = below(callee, frames, calls, left)?.max(deepest);
    }
    Some(frames.get(function).copied().unwrap_or(0) + deepest)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRAPH: &str = r#"graph: { title: "a.c"
node: { title: "a.c:inner" label: "inner\na.c:1:1\n48 bytes (static)" }
node: { title: "a.c:other" label: "other\na.c:2:1\n8 bytes (static)" }
node: { title: "a_step" label: "a_step\na.c:3:1\n100 bytes (static)" }
edge: { sourcename: "a_step" targetname: "a.c:inner" label: "a.c:4:5" }
edge: { sourcename: "a_step" targetname: "a.c:other" label: "a.c:5:5" }
edge: { sourcename: "a.c:inner" targetname: "__aeabi_fmul" }
node: { title: "__aeabi_fmul" label: "__aeabi_fmul\n<built-in>" shape : ellipse }
}
"#;

    #[test]
    fn the_deepest_chain_of_calls_is_summed() {
        assert_eq!(deepest(GRAPH, "a_step"), Some(148));
        assert_eq!(deepest(GRAPH, "a.c:other"), Some(8));
        assert_eq!(deepest(GRAPH, "absent"), None);
    }

    #[test]
    fn a_function_that_calls_itself_has_no_estimate() {
        let round = "edge: { sourcename: \"a.c:other\" targetname: \"a_step\" }\n";
        assert_eq!(deepest(&format!("{GRAPH}{round}"), "a_step"), None);
    }
}
