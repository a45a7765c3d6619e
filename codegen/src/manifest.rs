//! `manifest.json`: what was generated, from what, and under which conditions its bits hold.

use std::collections::BTreeMap;

use policy::{Digests, Policy};
use serde::{Deserialize, Serialize};
use targets::TargetSpec;

use crate::backend::kit::Material;
use crate::crc::crc32_bytes;
use crate::files::{GeneratedFiles, TOOL};
use crate::output::{Language, Output, languages, with_cores};

/// File name of the manifest in the output folder.
pub const FILE: &str = "manifest.json";

/// Start of the entry that [`with_costs`] adds.
// as `serde_json` lays it out, so that a manifest with costs is printed like any other
const COSTS: &str = ",\n  \"costs\": ";

/// A manifest with the costs of builds as its last entry. They come from the compilers of a machine, all else does not.
///
/// # Errors
/// If the costs cannot be written as JSON.
pub fn with_costs(text: &str, costs: &impl Serialize) -> Result<String, crate::files::CodegenError> {
    let costs =
        serde_json::to_string_pretty(costs).map_err(|error| crate::files::CodegenError::Manifest(error.to_string()))?;
    // as text: read and written anew, the other entries might not keep their bytes, which `verify` compares
    let body = text.trim_end().strip_suffix("\n}").unwrap_or_default();
    Ok(format!("{body}{COSTS}{}\n}}\n", costs.replace('\n', "\n  ")))
}

/// The manifest without what [`with_costs`] added: the same on every machine.
#[must_use]
pub fn without_costs(text: &str) -> String {
    match text.split_once(COSTS) {
        Some((body, _)) => format!("{body}\n}}\n"),
        None => text.to_owned(),
    }
}

/// Content of `manifest.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Manifest {
    /// Tool and version.
    pub generator: String,
    /// Policy name.
    pub name: String,
    /// Target name.
    pub target: String,
    /// Generated languages.
    pub languages: Vec<Language>,
    /// Outputs beside the cores, by name. The key is older than the word *integration*; folders that users keep have it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub doors: Vec<&'static str>,
    /// Control steps that were asked of the back-to-back kit, if there is one: from this number the same kit is made again. It may
    /// have more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kit_steps: Option<u32>,
    /// Numeric format.
    pub numeric_format: policy::NumericFormat,
    /// Control period in s.
    pub sample_period: f64,
    /// Digests of the inputs.
    pub digests: Digests,
    /// Compiler flags under which the bits hold, by language.
    pub flags: BTreeMap<&'static str, Vec<&'static str>>,
    /// Sizes of the controller.
    pub sizes: Sizes,
    /// Generated files with their CRC-32 and length.
    pub files: BTreeMap<String, FileEntry>,
}

/// Sizes of the controller.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sizes {
    /// Signals in the measurement.
    pub signals: usize,
    /// Network inputs.
    pub features: usize,
    /// Outputs per layer.
    pub layers: Vec<usize>,
    /// Actions.
    pub actions: usize,
    /// Multiply-accumulates per step.
    pub macs: usize,
    /// Constant tables in bytes.
    pub table_bytes: usize,
    /// State struct in bytes.
    pub state_bytes: usize,
    /// Integer formats: largest magnitude that any 32-bit sum of the network can reach over the clamped box of
    /// observations, in any order of the additions; below 2^31.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accumulator_bound: Option<i64>,
    /// Neurons left out per layer, because they are 0 for every observation; Q values keep their bits.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub removed_neurons: Vec<usize>,
    /// Integer formats: proven bound of |Q - Q in real arithmetic| over the clamped box of observations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub q_error_bound: Option<f64>,
    /// The same of the duty of a continuous actor, |duty - duty in real arithmetic| before the mapping.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duty_error_bound: Option<f64>,
}

/// One generated file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileEntry {
    /// Length in bytes.
    pub bytes: usize,
    /// CRC-32 in hexadecimal.
    pub crc32: String,
}

/// Sizes of a policy's controller, the same in every language.
#[must_use]
pub fn sizes(policy: &Policy, target: &TargetSpec) -> Sizes {
    // any language would do: loops differ, checked tables and state do not
    let program = crate::lower(policy, target, Language::C);
    let mut removed: Vec<usize> = crate::lower::simplify::removable(policy).iter().map(Vec::len).collect();
    // an empty list is not written at all
    if removed.iter().all(|count| *count == 0) {
        removed.clear();
    }
    let bound = (policy.numeric_format.is_integer()).then(|| certify::Certifier::new(policy).box_bound().largest);
    let is_actor = !policy.head.is_choice();
    let is_several = matches!(policy.head, policy::Head::Several(_));
    Sizes {
        signals: policy.signals.len(),
        features: policy.features.len(),
        layers: policy.layers.iter().map(|layer| layer.outputs).collect(),
        actions: policy.outputs(),
        macs: program.macs(),
        table_bytes: program.table_bytes(),
        state_bytes: 4 * program.state_words(),
        accumulator_bound: program.network.integer().map(|code| code.accumulator_bound),
        removed_neurons: removed,
        // of several outputs one figure would be of Q values and of duties at once
        q_error_bound: bound.filter(|_| !is_actor && !is_several),
        duty_error_bound: bound.filter(|_| is_actor && !is_several),
    }
}

/// The manifest of the generated files of these outputs; `expected` is what the kit among them compares with.
#[must_use]
pub fn manifest(
    policy: &Policy,
    target: &TargetSpec,
    outputs: &[Output],
    expected: Option<&Material>,
    files: &GeneratedFiles,
) -> Manifest {
    let outputs = with_cores(outputs);
    let languages = languages(&outputs);
    let flags = |language: &Language| match language {
        Language::C => ("c", target.c_flags.to_vec()),
        Language::Rust => ("rust", target.rust_flags.to_vec()),
    };
    Manifest {
        generator: TOOL.to_owned(),
        name: policy.name.clone(),
        target: target.name.to_owned(),
        doors: outputs
            .iter()
            .filter(|output| !output.is_core())
            .map(|output| output.name())
            .collect(),
        kit_steps: expected
            .filter(|_| outputs.contains(&Output::Kit))
            .map(|expected| expected.asked),
        numeric_format: policy.numeric_format,
        sample_period: policy.sample_period,
        digests: policy.digests.clone(),
        flags: languages.iter().map(flags).collect(),
        languages,
        sizes: sizes(policy, target),
        files: files
            .files
            .iter()
            .map(|(name, text)| (name.clone(), FileEntry::of(text.as_bytes())))
            .collect(),
    }
}

impl FileEntry {
    /// That of a file with this content.
    #[must_use]
    pub fn of(content: &[u8]) -> Self {
        FileEntry {
            bytes: content.len(),
            crc32: format!("{:08x}", crc32_bytes(content.iter().copied())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_are_the_last_entry_and_come_off_again() {
        let plain = "{\n  \"name\": \"a\"\n}\n";
        let Ok(text) = with_costs(plain, &[BTreeMap::from([("stack_bytes", 5)])]) else {
            panic!("costs are JSON")
        };
        let read: Result<serde_json::Value, _> = serde_json::from_str(&text);
        assert!(
            read.is_ok_and(|value| value["name"] == "a" && value["costs"][0]["stack_bytes"] == 5),
            "{text}"
        );
        assert_eq!(without_costs(&text), plain);
        assert_eq!(without_costs(plain), plain);
    }
}
