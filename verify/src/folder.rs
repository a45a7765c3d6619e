//! A folder of generated code, as `compile` wrote it: its manifest says for what it was made.

use std::path::Path;

use codegen::{Output, manifest};
use policy::{NumericFormat, Policy};
use serde::Deserialize;
use targets::TargetSpec;
use toml_input::{Fault, Faults, Message, messages};

use crate::drift::{Drift, drift, read_text};
use crate::kit;
use crate::session::Files;

/// A folder of generated code beside the policy that it should be of.
#[derive(Debug, Clone)]
pub struct Folder {
    /// Text of the cores in it, by file name; those that are missing are part of the drift.
    pub files: Files,
    /// How all its files differ from what the policy yields today.
    pub drift: Drift,
    /// What it was generated for.
    pub target: &'static TargetSpec,
}

/// What a manifest says its folder was generated for.
#[derive(Debug, Clone, PartialEq)]
pub struct Asked {
    /// The deployment target.
    pub target: &'static TargetSpec,
    /// Cores, and what stands beside them.
    pub outputs: Vec<Output>,
    /// Control steps of the kit.
    pub kit_steps: u32,
}

impl Asked {
    /// Reads the text of a manifest; `path` only names it in faults.
    ///
    /// # Errors
    /// If it is no manifest of this program, or names what this version does not know.
    pub fn read(path: &Path, text: &str) -> Result<Self, Faults> {
        let fault = |message: Message| Fault::in_file(path, message);
        let origin: Origin = serde_json::from_str(text).map_err(|error| {
            let message = Message::new(format!("not a manifest of policyc: {error}"));
            fault(message.hint(remedy(path.parent().unwrap_or(path))))
        })?;
        Ok(Self {
            target: codegen::target(&origin.target)?,
            outputs: outputs(&origin).map_err(fault)?,
            kit_steps: kit_steps(&origin).map_err(fault)?,
        })
    }
}

fn remedy(folder: &Path) -> String {
    format!(
        "make the folder with `policyc compile POLICY --out {}`",
        folder.display()
    )
}

/// The parts of a manifest that say how the folder was generated.
#[derive(Deserialize)]
struct Origin {
    target: String,
    languages: Vec<String>,
    #[serde(default)]
    doors: Vec<String>,
    #[serde(default)]
    kit_steps: Option<u32>,
}

impl Folder {
    /// Reads a folder and compares it with what `policy` yields for the same target and outputs.
    ///
    /// # Errors
    /// If it has no manifest of this program, the manifest names what this version does not know, or a file is there but
    /// cannot be read.
    pub fn open(policy: &Policy, folder: &Path) -> Result<Self, Faults> {
        let path = folder.join(manifest::FILE);
        let text = read_text(&path).map_err(|error| {
            let message = Message::new(error.to_string()).expected("the manifest that compile wrote");
            Fault::in_file(&path, message.hint(remedy(folder)))
        })?;
        let Asked {
            target,
            outputs,
            kit_steps,
        } = Asked::read(&path, &text)?;
        let expected = kit::expected(policy, target, &outputs, kit_steps)?;
        let yielded = codegen::generate(policy, target, &outputs, expected.as_ref())?.files;
        let drift = drift(policy, &yielded, folder)?;
        let cores: Vec<Output> = outputs.into_iter().filter(|output| output.is_core()).collect();
        let mut files = Files::new();
        for name in codegen::sources(policy, target, &cores, None)?.files.into_keys() {
            // a missing file is already part of the drift
            if let Ok(text) = read_text(&folder.join(&name)) {
                files.insert(name, text);
            }
        }
        Ok(Self { files, drift, target })
    }
}

/// The numeric format that a folder's manifest names; nothing if the manifest cannot be read, of which [`Folder::open`]
/// tells.
#[must_use]
pub fn numeric_format(folder: &Path) -> Option<NumericFormat> {
    #[derive(Deserialize)]
    struct Written {
        numeric_format: String,
    }
    let text = read_text(&folder.join(manifest::FILE)).ok()?;
    let written: Written = serde_json::from_str(&text).ok()?;
    NumericFormat::find(&written.numeric_format)
}

/// As many as `compile` takes: the kit is made again for the comparison, and a number from elsewhere could ask for hours of it.
fn kit_steps(origin: &Origin) -> Result<u32, Message> {
    let steps = origin.kit_steps.unwrap_or(kit::DEFAULT_STEPS);
    match (1..=kit::MOST_STEPS).contains(&steps) {
        true => Ok(steps),
        false => {
            let message = Message::new("`kit_steps` is out of range").found(steps.to_string());
            Err(message.expected(format!("1 to {}", kit::MOST_STEPS)))
        }
    }
}

/// What the folder was made of.
fn outputs(origin: &Origin) -> Result<Vec<Output>, Message> {
    let known: Vec<&str> = Output::ALL.iter().map(|output| output.name()).collect();
    let names = origin.languages.iter().chain(&origin.doors);
    let found = names.map(|name| Output::find(name).ok_or_else(|| messages::unknown("output", name, &known)));
    let outputs = found.collect::<Result<Vec<_>, _>>()?;
    if outputs.iter().any(|output| output.is_core()) {
        Ok(outputs)
    } else {
        Err(Message::new("no language").expected("`languages` with c, rust or both"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(kit_steps: &str) -> Result<Asked, Faults> {
        let text = format!("{{\"target\": \"host\", \"languages\": [\"c\"], \"doors\": [\"kit\"]{kit_steps}}}");
        Asked::read(Path::new("out/manifest.json"), &text)
    }

    #[test]
    fn a_manifest_asks_for_no_more_steps_of_a_kit_than_compile_makes() {
        assert_eq!(read("").unwrap().kit_steps, kit::DEFAULT_STEPS);
        assert_eq!(read(", \"kit_steps\": 200000").unwrap().kit_steps, 200_000);
        for steps in ["0", "200001", "4294967295"] {
            let faults = read(&format!(", \"kit_steps\": {steps}")).unwrap_err().to_string();
            assert!(faults.contains(steps) && faults.contains("1 to 200000"), "{faults}");
        }
    }
}
