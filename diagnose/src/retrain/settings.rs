//! A training file that starts from the extended plant, as text: its own with another plant and another contract.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};
use toml_input::Message;

/// The text, and what was left out of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Moved {
    /// The training file.
    pub text: String,
    /// In words.
    pub notes: Vec<String>,
}

/// `text` with these files as `plant` and `contract`, and with these numbers of the plant set. Numbers that it sets itself would stand above
/// what was found: they are made comments.
///
/// # Errors
/// If the text is no training file whose entries stand for themselves.
pub fn moved(text: &str, plant: &str, contract: &str, set: &[(String, f64)]) -> Result<Moved, Message> {
    let mut out = text.to_owned();
    let mut edits: Vec<(Range<usize>, String)> = Vec::new();
    {
        let (tree, _) = DeTable::parse_recoverable(text);
        for (key, file) in [("plant", plant), ("contract", contract)] {
            let Some(value) = tree.get_ref().get(key).filter(|value| is_text(value)) else {
                return Err(Message::new(format!("the training file has no `{key}`")));
            };
            edits.push((value.span(), format!("{file:?}")));
        }
    }
    edits.sort_by_key(|(range, _)| range.start);
    for (range, new) in edits.into_iter().rev() {
        out.replace_range(range, &new);
    }
    let (out, is_out) = without_set(&out);
    let (tree, _) = DeTable::parse_recoverable(&out);
    if tree.get_ref().get("set").is_some() {
        let message = Message::new("the training file sets numbers of its plant where they cannot be taken out");
        return Err(message.hint("write them as lines under [set]"));
    }
    let mut out = out;
    if !set.is_empty() {
        out += "\n[set]  # the new contract corrects these in `adc`, before a simulation sees them\n";
        out.extend(set.iter().map(|(key, value)| format!("\"{key}\" = {value:?}\n")));
    }
    let note = "[set] of the training file is left out: it changes the plant that the policy was trained on, and the diagnosis has \
                found what this one is";
    Ok(Moved {
        text: out,
        notes: is_out.then(|| note.to_owned()).into_iter().collect(),
    })
}

fn is_text(value: &Spanned<DeValue<'_>>) -> bool {
    matches!(value.get_ref(), DeValue::String(_))
}

/// The lines of `[set]` as comments, and whether there were any.
fn without_set(text: &str) -> (String, bool) {
    let (mut inside, mut found) = (false, false);
    let line = |line: &str| {
        let bare = line.trim();
        if let Some(rest) = bare.strip_prefix('[') {
            inside = rest.split(']').next().is_some_and(|name| name.trim() == "set");
        }
        let is_inline = bare
            .strip_prefix("set")
            .is_some_and(|rest| rest.trim_start().starts_with(['=', '.']));
        let is_out = (inside || is_inline) && !bare.is_empty() && !bare.starts_with('#');
        found |= is_out;
        match is_out {
            true => format!("# {line}\n"),
            false => format!("{line}\n"),
        }
    };
    let out: String = text.lines().map(line).collect();
    (out, found)
}

#[cfg(test)]
mod tests {
    use super::moved;

    const TEXT: &str = "# mine\nplant = \"../plants/a.toml\" # the bench\ncontract = 'p/policy.toml'\nsteps = 10\n\n[set]  # the switch\n\
        \"switch.v_f\" = 0.8 # V\n\n[network]\nhidden = [8]\n";

    #[test]
    fn plant_and_contract_move_and_all_else_stays() {
        let moved = moved(TEXT, "../plant.extended.toml", "contract/policy.toml", &[]).unwrap();
        let wanted = TEXT
            .replace("\"../plants/a.toml\"", "\"../plant.extended.toml\"")
            .replace("'p/policy.toml'", "\"contract/policy.toml\"")
            .replace("[set]  # the", "# [set]  # the")
            .replace("\"switch.v_f\"", "# \"switch.v_f\"");
        assert_eq!(moved.text, wanted);
        assert_eq!(moved.notes.len(), 1);
    }

    #[test]
    fn numbers_that_are_set_in_one_line_go_too() {
        let one = "plant = \"a\"\ncontract = \"b\"\nset = { \"switch.v_f\" = 0.8 }\n";
        assert!(
            moved(one, "c", "d", &[])
                .unwrap()
                .text
                .ends_with("# set = { \"switch.v_f\" = 0.8 }\n")
        );
        assert!(moved("contract = \"b\"\n", "c", "d", &[]).is_err());
        let set = moved(one, "c", "d", &[("sensors.v_out.gain".to_owned(), 1.0)]).unwrap();
        assert!(set.text.ends_with("\n\"sensors.v_out.gain\" = 1.0\n"), "{}", set.text);
    }
}
