//! The user's own plant file with other numbers: order, comments and all that did not change stay.
//!
//! Lines are edited, not a tree: what a plant file holds is `key = value` under `[table]`. Whatever else TOML allows (inline tables, dotted
//! keys) may be in it; then the edited text does not read as the plant that is wanted, and the caller writes a file of its own.

use std::collections::BTreeMap;
use std::path::Path;

use plant::{Parameter, Parameters};

/// A number of the plant as TOML.
pub fn value(parameter: &Parameter, number: f64) -> String {
    match parameter.choices().get(number as usize) {
        Some(word) => format!("\"{word}\""),
        None if parameter.is_whole() => format!("{}", number as u64),
        // `{:?}`, because `{}` writes 1 for 1.0, which is an integer in TOML
        None => format!("{number:?}"),
    }
}

/// `text`, which describes `before`, with the numbers of `after`; nothing if it does not read so then.
pub fn edited(
    text: &str,
    before: &Parameters,
    after: &Parameters,
    notes: &BTreeMap<&'static str, String>,
) -> Option<String> {
    let is_changed = |parameter: &&Parameter| parameter.get(before) != parameter.get(after);
    let mut missing: Vec<&Parameter> = plant::parameters().filter(is_changed).collect();
    let mut lines: Vec<String> = Vec::new();
    // the last line of each table that holds something: what is new goes behind it
    let mut ends: BTreeMap<String, usize> = BTreeMap::new();
    let mut table = String::new();
    for line in text.lines() {
        let bare = line.trim();
        if let Some(name) = bare.strip_prefix('[').and_then(|rest| rest.split(']').next()) {
            table = name.trim().to_owned();
            ends.insert(table.clone(), lines.len());
        }
        let found = bare.split_once('=').and_then(|(key, _)| {
            let key = format!("{table}.{}", key.trim());
            missing.iter().position(|parameter| parameter.key == key)
        });
        lines.push(match found {
            Some(place) => {
                let parameter = missing.remove(place);
                replaced(line, parameter, after, notes)
            }
            None => line.to_owned(),
        });
        if !bare.is_empty() && !bare.starts_with('#') {
            ends.insert(table.clone(), lines.len() - 1);
        }
    }
    // from the last table on, so that places before it stay
    let mut added: BTreeMap<usize, Vec<String>> = BTreeMap::new();
    let mut tables: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for parameter in missing {
        let (table, key) = parameter.key.rsplit_once('.')?;
        let line = with_note(
            &format!("{key} = {}", value(parameter, parameter.get(after))),
            parameter,
            notes,
            "",
        );
        match ends.get(table) {
            Some(end) => added.entry(*end).or_default().push(line),
            None => tables.entry(table).or_default().push(line),
        }
    }
    for (end, new) in added.into_iter().rev() {
        for line in new.into_iter().rev() {
            lines.insert(end + 1, line);
        }
    }
    for (table, new) in tables {
        lines.extend([String::new(), format!("[{table}]")]);
        lines.extend(new);
    }
    let made = lines.join("\n") + "\n";
    let read = Parameters::from_toml(Path::new("plant.toml"), &made).ok()?;
    let is_same = |parameter: &Parameter| parameter.get(&read) == parameter.get(after);
    plant::parameters().all(is_same).then_some(made)
}

/// A line with another value; the user's comment stays behind what is said of it.
fn replaced(line: &str, parameter: &Parameter, after: &Parameters, notes: &BTreeMap<&'static str, String>) -> String {
    let (left, right) = line.split_once('=').unwrap_or((line, ""));
    let comment = right.split_once('#').map_or("", |(_, comment)| comment.trim());
    // the unit is said before
    let comment = if comment == parameter.unit { "" } else { comment };
    with_note(
        &format!("{left}= {}", value(parameter, parameter.get(after))),
        parameter,
        notes,
        comment,
    )
}

fn with_note(line: &str, parameter: &Parameter, notes: &BTreeMap<&'static str, String>, comment: &str) -> String {
    let note = notes.get(parameter.key).map_or(parameter.unit, String::as_str);
    match comment.is_empty() {
        true => format!("{line}  # {note}"),
        false => format!("{line}  # {note}; {comment}"),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::path::Path;

    use plant::Parameters;

    use super::edited;

    const TEXT: &str = "# my bench\n[converter]\nv_in = 200.0 # supply at 3 o'clock\ninductance = 2e-3\ncapacitance = 150e-6  # two in parallel\n\
        f_sw = 10e3\n\n# measured by Eva\n[inductor]\ndcr = 0.1 # ohm\n\n[pwm]\ncarrier = \"centre\"\n";

    #[test]
    fn order_and_comments_stay_and_new_numbers_go_into_their_tables() {
        let before = Parameters::from_toml(Path::new("a.toml"), TEXT).unwrap();
        let mut after = before.clone();
        after.converter.capacitance = 120e-6;
        (after.inductor.dcr, after.capacitor.esr) = (0.3, 0.05);
        after.pwm.carrier = plant::Carrier::Leading;
        after.pwm.sampling_phase = 0.25;
        let notes = BTreeMap::from([("converter.capacitance", "F; was 0.00015".to_owned())]);
        let made = edited(TEXT, &before, &after, &notes).unwrap();
        let wanted = TEXT
            .replace(
                "150e-6  # two in parallel",
                "0.00012  # F; was 0.00015; two in parallel",
            )
            .replace("dcr = 0.1 # ohm", "dcr = 0.3  # ohm")
            .replace("\"centre\"\n", "\"leading\"  # 1\nsampling_phase = 0.25  # 1\n")
            + "\n[capacitor]\nesr = 0.05  # ohm\n";
        assert_eq!(made, wanted);
    }

    #[test]
    fn a_file_that_lines_do_not_tell_is_not_edited() {
        let text = "converter = { v_in = 200.0, inductance = 2e-3, capacitance = 150e-6, f_sw = 10e3 }\n";
        let before = Parameters::from_toml(Path::new("a.toml"), text).unwrap();
        let mut after = before.clone();
        after.converter.capacitance = 120e-6;
        assert_eq!(edited(text, &before, &after, &BTreeMap::new()), None);
    }
}
