//! The controller of the construct suite with several outputs: the small policy of the suite, its one duty in the place of three.

use policy::{Policy, ReadOptions};

use super::CONSTRUCTS;
use crate::session::VerifyError;

/// In the place of `[actions]` and all behind it: two choices with mappings of four and three terms, and a continuous head, each with
/// limits and a fallback of its own.
const OUTPUTS: &str = include_str!("constructs/outputs.toml");

/// The policy of one duty as one of three.
///
/// # Errors
/// If it does not pass the check: a fault of this program.
pub fn legs() -> Result<Policy, VerifyError> {
    let text = |wanted: &str| {
        let file = CONSTRUCTS.iter().find(|(name, _)| *name == wanted);
        file.map_or(String::new(), |(_, bytes)| String::from_utf8_lossy(bytes).into_owned())
    };
    let single = text("policy.toml");
    let top = single.split_once("[actions]").map_or("", |(top, _)| top);
    // a source of one output reads `previous_duty`; of several it says whose
    let top = top
        .replace("\"previous_duty\"", "\"left_previous_duty\"")
        .replace("previous_command", "right_previous_command");
    let four = text("drm.toml");
    let three = four.lines().filter(|line| !line.starts_with("r = "));
    let three: String = three.map(|line| format!("{line}\n")).collect();
    let weights = CONSTRUCTS.iter().find(|(name, _)| *name == "weights.safetensors");
    let files = [
        ("policy.toml", (top + OUTPUTS).into_bytes()),
        ("left.toml", four.into_bytes()),
        ("right.toml", three.replace("b = -0.0025", "b = -0.0015").into_bytes()),
        (
            "weights.safetensors",
            weights.map_or(Vec::new(), |(_, bytes)| bytes.to_vec()),
        ),
    ];
    let options = ReadOptions {
        several_outputs: true,
        ..ReadOptions::embedded(files)
    };
    let raw = policy::read("policy.toml".as_ref(), &options);
    raw.and_then(policy::check)
        .map_err(|faults| VerifyError::Constructs(faults.to_string()))
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_suite_has_two_choices_and_a_continuous_output() {
        let legs = super::legs().unwrap();
        let names: Vec<_> = legs.paths().iter().map(|path| path.name).collect();
        assert_eq!(names, [Some("left"), Some("right"), Some("mid")]);
        let mapped: Vec<bool> = legs.paths().iter().map(|path| path.mapping.is_some()).collect();
        assert_eq!(mapped, [true, true, false]);
    }
}
