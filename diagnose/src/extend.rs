//! The extended model as a plant file.

mod edited;

use std::collections::BTreeMap;
use std::fmt::Write as _;

use plant::Parameters;

use crate::diagnosis::Diagnosis;
use crate::drive::{Model, is_even};
use crate::findings::Verdict;
use crate::problem::duty_accuracy;
use crate::words::needs;

/// A trim of the edges below this share of what edges are known to do ([`duty_accuracy`]) is none.
// 0.5 ns at 10 kHz, 0.2 ns at 100 kHz: below the scatter of any driver's delay, and 5 to 50 uV in a volt of the source. Long records
// resolve such remains of a fit, and in the file a delay of 1e-10 s would read as a finding
const NO_TRIM: f64 = 0.01;

/// Where the trim is written: as it was fitted, and as edges where an offset would be rounded to counts.
fn keys_of_trim(p: &Parameters) -> &'static [&'static str] {
    match is_even(p) && p.pwm.duty_lsb == 0.0 {
        true => &["pwm.duty_offset"],
        false => &["switch.turn_on_delay", "switch.turn_off_delay"],
    }
}

/// The trim as it is told, 1: 0 where it is less than any edge does; `f_sw` in Hz.
pub fn told(trim: f64, f_sw: f64) -> f64 {
    if trim.abs() < NO_TRIM * duty_accuracy(f_sw) {
        0.0
    } else {
        trim
    }
}

/// The extended model as one plant: the sampling instant and the trim of the edges are among its parameters.
#[must_use]
pub fn as_plant(model: &Model, trim: f64) -> Parameters {
    let mut p = model.plant.clone();
    let t_sw = p.t_sw();
    let trim = told(trim, p.converter.f_sw);
    // the same as in `drive::simulate`, so that the file shows what was fitted
    match keys_of_trim(&p) {
        ["pwm.duty_offset"] => p.pwm.duty_offset += trim,
        _ => {
            p.switch.turn_off_delay += trim.max(0.0) * t_sw;
            p.switch.turn_on_delay += (-trim).max(0.0) * t_sw;
        }
    }
    let phase = p.pwm.sampling_phase + model.late / t_sw;
    if (0.0..1.0).contains(&phase) {
        p.pwm.sampling_phase = phase;
    } else if model.late < 0.0 {
        // earlier than its PWM period: what is shown is then that much older
        for sensor in crate::drive::sensors(&mut p) {
            sensor.delay -= model.late;
        }
    } else {
        // sampled in the next period: the duty commanded then acts a period later
        p.pwm.sampling_phase = phase - phase.floor();
        p.pwm.duty_delay += phase.floor() as u32;
    }
    p
}

/// The model with what was found, or as it is, with the trim of the edges.
#[must_use]
pub fn extended_plant(diagnosis: &Diagnosis) -> Parameters {
    let mut plant = as_plant(&diagnosis.extended, diagnosis.trim);
    crate::quantised::extend(&mut plant, &diagnosis.findings.causes);
    readable(&plant, &diagnosis.given.model.plant)
}

/// A plant whose numbers, where they differ from those `given`, have as many digits as a fit tells, and more.
fn readable(plant: &Parameters, given: &Parameters) -> Parameters {
    let mut readable = plant.clone();
    for parameter in plant::parameters() {
        let value = parameter.get(plant);
        if value != parameter.get(given) {
            parameter.set(&mut readable, rounded(value));
        }
    }
    readable
}

/// Seven digits: no fit tells more than five.
pub(crate) fn rounded(number: f64) -> f64 {
    format!("{number:.6e}").parse().unwrap_or(number)
}

/// Text of `plant.extended.toml`; changed numbers carry what they were and their 95 % interval.
#[must_use]
pub fn extended_toml(diagnosis: &Diagnosis) -> String {
    let findings = &diagnosis.findings;
    let head = match findings.verdict {
        Verdict::Consistent => "The model as it was given.",
        _ => FOUND,
    };
    let mut text = format!("# {head} {}\n", findings.sentence.replace('\n', " "));
    for cause in findings.causes.iter().filter(|cause| !cause.rivals.is_empty()) {
        let rivals: Vec<String> = cause.rival_values.iter().map(|values| needs(values)).collect();
        let _ = writeln!(text, "# {} stands for a tie with {}.", cause.id, rivals.join(", "));
    }
    if is_described(diagnosis) {
        text += "# The table [empirical] is a correction of the duty that describes what no cause explains. It is no cause and no physics.\n";
    }
    let trim = told(diagnosis.trim, diagnosis.given.model.plant.converter.f_sw);
    written(diagnosis, text, &extended_plant(diagnosis), trim)
}

/// Whether the extended model has an empirical term.
fn is_described(diagnosis: &Diagnosis) -> bool {
    let term = diagnosis.findings.empirical.as_ref();
    term.is_some_and(|term| term.written)
}

/// Text of `plant.partial.toml`: the model with causes that explain only a part; nothing with another verdict, or without such a part.
#[must_use]
pub fn partial_toml(diagnosis: &Diagnosis) -> Option<String> {
    let findings = &diagnosis.findings;
    if findings.verdict != Verdict::Unexplained || findings.partial.is_empty() {
        return None;
    }
    let state = diagnosis.attribution.state();
    let f_sw = state.model.plant.converter.f_sw;
    let trim = told(state.starts.trim_or_none(f_sw), f_sw);
    let mut text = String::from(
        "# PARTIAL: these causes do not explain the records. Their values imitate something else, and are no measurement.\n",
    );
    let other = match is_described(diagnosis) {
        true => "the model without them and with the correction [empirical]",
        false => "the model as it was given",
    };
    let _ = writeln!(
        text,
        "# To look at, not to train on; {other} is in plant.extended.toml."
    );
    for worth in &findings.partial_gain {
        let _ = writeln!(text, "# {}", worth.words());
    }
    let plant = readable(&as_plant(&state.model, trim), &diagnosis.given.model.plant);
    Some(written(diagnosis, text, &plant, trim))
}

/// A plant file below the comment `text`: that of the user with its order and comments, where it is known.
fn written(diagnosis: &Diagnosis, mut text: String, after: &Parameters, trim: f64) -> String {
    let before = &diagnosis.given.model.plant;
    if trim != 0.0 {
        let time = 1e9 * trim * before.t_sw();
        let _ = match keys_of_trim(after) {
            ["pwm.duty_offset"] => writeln!(
                text,
                "# pwm.duty_offset holds {trim:.5} ({time:.1} ns) that the gate's edges seem to add to every pulse; not a cause."
            ),
            _ => writeln!(
                text,
                "# The switch's delays hold {time:.1} ns of duty that the gate's edges seem to add; not a cause."
            ),
        };
    }
    let notes = notes(diagnosis, after, trim);
    let own = diagnosis.model_text.as_deref().map(without_head);
    if let Some(edited) = own.and_then(|own| edited::edited(own, before, after, &notes)) {
        return format!("{text}\n{edited}");
    }
    let mut tables: BTreeMap<&str, String> = BTreeMap::new();
    for parameter in plant::parameters() {
        let (was, is) = (parameter.get(before), parameter.get(after));
        let needed = plant::REQUIRED.contains(&parameter.key);
        // a number that came back to neutral is written all the same: a reader looks for what has changed
        if is == parameter.neutral && !needed && was == is {
            continue;
        }
        let Some((table, key)) = parameter.key.rsplit_once('.') else {
            continue;
        };
        let value = edited::value(parameter, is);
        let note = match notes.get(parameter.key) {
            Some(note) => format!("  # {note}"),
            None if parameter.is_pure() => String::new(),
            None => format!("  # {}", parameter.unit),
        };
        let _ = writeln!(tables.entry(table).or_default(), "{key} = {value}{note}");
    }
    for (table, lines) in tables {
        let _ = write!(text, "\n[{table}]\n{lines}");
    }
    text
}

/// How the head of an extended model begins.
const FOUND: &str = "The model with what was found.";

/// A plant file without the head of the diagnosis that made it: what that one found is the model by now.
fn without_head(text: &str) -> &str {
    let is_made = text.strip_prefix("# ").is_some_and(|rest| rest.starts_with(FOUND));
    match text.split_once("\n\n") {
        Some((_, rest)) if is_made => rest,
        _ => text,
    }
}

/// What is said of each number that has changed: its unit, its interval, and what it was.
fn notes(diagnosis: &Diagnosis, after: &Parameters, trim: f64) -> BTreeMap<&'static str, String> {
    let mut intervals: BTreeMap<&str, String> = BTreeMap::new();
    // what a fit tells in a model that is wrong is no interval of the converter
    let is_right = diagnosis.findings.verdict != Verdict::Unexplained;
    let best = (diagnosis.attribution.best.iter().filter(|_| is_right)).flat_map(|fit| fit.causes.iter().enumerate());
    for (member, cause) in best {
        for (knob, profile) in diagnosis.attribution.candidates[*cause]
            .form
            .knobs
            .iter()
            .zip(diagnosis.profiles.iter().filter(|p| p.member == member))
        {
            for key in knob.valued_keys() {
                let [low, high] = profile.interval;
                intervals.insert(key, format!("95 %: {low:.5e} to {high:.5e}; "));
            }
        }
    }
    let mut notes = BTreeMap::new();
    for parameter in plant::parameters() {
        let (was, is) = (parameter.get(&diagnosis.given.model.plant), parameter.get(after));
        if was == is {
            continue;
        }
        let interval = intervals.get(parameter.key).map_or("", String::as_str);
        // a reader who looks for what was found must not take these for it
        let beside = match trim != 0.0 && keys_of_trim(after).contains(&parameter.key) {
            true => "edges of the gate, fitted beside every cause and none itself; ",
            false => "",
        };
        let was = edited::value(parameter, was);
        notes.insert(
            parameter.key,
            format!("{}; {interval}{beside}was {was}", parameter.unit),
        );
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::{told, without_head};

    #[test]
    fn the_head_of_an_earlier_diagnosis_is_not_kept() {
        let made = "# The model with what was found. The model gets dcr wrong.\n# dcr stands for a tie.\n\n# mine\n[converter]\n";
        assert_eq!(without_head(made), "# mine\n[converter]\n");
        let own = "# The board\n\n[converter]\n";
        assert_eq!(without_head(own), own);
    }

    /// At each frequency a tenth of a nanosecond is what a fit leaves, and two nanoseconds are what a gate does.
    #[test]
    fn a_trim_is_told_from_where_it_can_matter() {
        for f_sw in [1e4, 1e5, 3e5] {
            for sign in [-1.0, 1.0] {
                let (remains, edges) = (sign * 1e-10 * f_sw, sign * 2e-9 * f_sw);
                assert_eq!(told(remains, f_sw), 0.0, "{f_sw} Hz");
                assert_eq!(told(edges, f_sw), edges, "{f_sw} Hz");
            }
        }
    }
}
