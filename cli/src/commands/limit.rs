//! `policyc limit`

use closed_loop::limit::{Question, left_out};
use closed_loop::{LoadKind, LoadStep, band_text, doubts, holds_power, limits, reaches};
use plant::Parameters;
use toml_input::Message;

use super::progress_line::Working;
use crate::arguments::Limit;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;
use crate::talk;

/// Prints a table of limits.
pub fn run(options: &Limit) -> Result<Outcome, Failure> {
    let (plant, is_outside) = Parameters::nominal_from_file(options.plant.as_path())?;
    let [low, high] = options.duty;
    if !(0.0..high).contains(&low) || high > 1.0 {
        let message = Message::new("--duty is no range").found(format!("{low},{high}"));
        return Err(message.expected("0 <= LOW < HIGH <= 1").into());
    }
    let steps = options.steps();
    let loads: Vec<_> = steps.iter().flat_map(LoadStep::loads).collect();
    if !(options.v_ref > 0.0 && options.v_ref.is_finite()) {
        let message = Message::new("--v-ref is no voltage").found(options.v_ref.to_string());
        return Err(message.expected("more than 0 V").into());
    }
    reaches(&plant, options.v_ref, &options.plant)?;
    let outside = |step: &&LoadStep| {
        let range = step.kind.range();
        step.values.iter().any(|value| !range.contains(value))
    };
    if let Some(step) = steps.iter().find(outside) {
        let (range, unit) = (step.kind.range(), step.kind.unit());
        let message = Message::new("this is no load step").found(step.to_string());
        let expected = format!("loads from {} to {} {unit}", range.start(), range.end());
        return Err(message.expected(expected).into());
    }
    if steps.iter().any(|step| step.kind == LoadKind::Power) {
        holds_power(&plant, options.v_ref, &options.plant)?;
    }
    let working = Working::new("searching the limit");
    let mut found = Vec::new();
    for step in steps {
        let question = Question::new(&plant, options.v_ref, step, options.duty);
        found.push((
            step,
            question
                .map_err(|faults| faults.in_file(&options.plant))?
                .of_all_instants(),
        ));
    }
    drop(working);
    output::say(&format!(
        "What no controller can beat on this plant: errors from {} V at the sampling instants, settled within {}, duties from\n\
         {low} to {high}. Each pair: load step at a sampling instant / at the worst instant, right behind one.\n\n{}",
        options.v_ref,
        band_text(options.v_ref),
        limits(&found).trim_end()
    ))?;
    doubts(&plant, options.v_ref, &loads)
        .iter()
        .for_each(|doubt| talk::note(doubt));
    if is_outside {
        talk::note(
            "the limit is that of the nominal numbers beside the FMU: that of an unknown model cannot be computed",
        );
    }
    let left_out = left_out(&plant);
    if !left_out.is_empty() {
        talk::note(&format!(
            "the limit is that of the plain circuit; it leaves out {}",
            left_out.join(", ")
        ));
    }
    Ok(Outcome::Done)
}
