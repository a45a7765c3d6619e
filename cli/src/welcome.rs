//! What `policyc` says to whoever asks nothing: the ways in.

use std::io::Write;

use crate::look::{self, Meaning};

/// Who comes, and the first command for it.
const WAYS: [(&str, &[&str]); 4] = [
    (
        "I have a trained model",
        &[
            "policyc new model.zip --out policy",
            "policyc compile policy --out generated",
        ],
    ),
    (
        "I have a converter and no policy yet",
        &["policyc new --plant plant.toml --v-ref 48 --loads 50,400 --out start"],
    ),
    (
        "My bench disagrees with the simulation",
        &["policyc diagnose --model plant.toml --train record.csv --out found"],
    ),
    (
        "I keep generated code in a repository",
        &["policyc verify policy --generated generated --drift-only"],
    ),
];

/// Prints the ways in, on standard error: nothing was asked, so there is no answer.
pub fn print() {
    // a closed pipe is no reason for another exit code
    let _ = write!(anstream::stderr(), "{}", text());
}

fn text() -> String {
    let mut lines = vec!["policyc: from a trained controller to verified code for a converter".to_owned()];
    for (who, commands) in WAYS {
        lines.extend([String::new(), look::of(Meaning::Title, who)]);
        lines.extend(commands.iter().map(|command| format!("  {command}")));
    }
    lines.extend([
        String::new(),
        "Nothing at hand? `policyc demo` compiles and verifies a built-in example.".to_owned(),
        "All commands: policyc --help. What one takes: policyc COMMAND --help.".to_owned(),
    ]);
    lines.join("\n") + "\n"
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::arguments::Arguments;

    #[test]
    fn every_way_in_is_a_command_that_is_understood() {
        for command in WAYS.iter().flat_map(|(_, commands)| *commands) {
            let parsed = Arguments::try_parse_from(command.split(' '));
            assert!(parsed.is_ok(), "{command}: {:?}", parsed.err());
        }
    }

    #[test]
    fn it_fits_a_narrow_terminal() {
        let plain = anstream::adapter::strip_str(&text()).to_string();
        assert!(plain.lines().all(|line| line.chars().count() <= 80), "{plain}");
    }
}
