//! Sentences that the summary and the page share.

use report::grouped;

use super::findings::{Check, Findings, Setting, Step};
use crate::scenario::settled_band;
use crate::tables::digits;

/// The plant's file and the numbers that were replaced.
pub(super) fn plant_text(setting: &Setting) -> String {
    let set = setting.scenario.set.iter();
    set.fold(setting.plant.display().to_string(), |text, (key, value)| {
        format!("{text}, {key} = {value}")
    })
}

/// The settling band with its unit: `0.5 V`, `16.5 mV`.
#[must_use]
pub fn band_text(v_ref: f64) -> String {
    let band = settled_band(v_ref);
    // shortest digits of the number rounded to four: 3.3 / 200 is not 0.0165 to the last bit
    let short = |x: f64| format!("{x:.3e}").parse::<f64>().unwrap_or(x);
    match digits(band) {
        2 => format!("{} V", short(band)),
        _ => format!("{} mV", short(1e3 * band)),
    }
}

/// What the figures are of.
pub(super) fn explanation(setting: &Setting) -> String {
    let task = &setting.scenario.task;
    format!(
        "True voltages at the sampling instants, errors from {} V, settled within {}. Each pair: worst of {} \
         sampling instants / worst of {} instants and phases.",
        setting.v_ref,
        band_text(setting.v_ref),
        task.sampling_instants,
        task.all_instants().len(),
    )
}

/// Share of the largest error at rest that is no offset, from which on the policy swings: a sine has .36 of it. A convention.
const SWINGS: f64 = 0.25;

/// The load steps before or after which the policy does not stay within the settling band, in words.
pub(super) fn unsettled(found: &Findings) -> Option<String> {
    let lost = |step: &Step| {
        let worst = step.courses.first().map(|(_, policy)| &policy.finding.worst);
        worst.map_or([false; 2], |worst| {
            [worst.pre_error, worst.tail_max].map(|error| error > worst.band)
        })
    };
    let of = |side: [bool; 2], words: &str| {
        let steps = found.steps.iter().filter(|step| lost(step) == side);
        let steps: Vec<String> = steps.map(|step| step.step.to_string()).collect();
        (!steps.is_empty()).then(|| format!("{words} {}", steps.join(", ")))
    };
    let places = [
        of([true, false], "before"),
        of([false, true], "after"),
        of([true, true], "before and after"),
    ];
    // an offset stands still: who swings before a step meets it anywhere in that swing
    let swings = found.steps.iter().any(|step| {
        let worst = step.courses.first().map(|(_, policy)| &policy.finding.worst);
        lost(step)[0] && worst.is_some_and(|worst| worst.tail_max - worst.tail_mean > SWINGS * worst.tail_max)
    });
    let more = match swings {
        true => "; a load step meets it anywhere in its swing, and more instants may find a worse deviation",
        false => "",
    };
    let places: Vec<String> = places.into_iter().flatten().collect();
    (!places.is_empty()).then(|| {
        format!(
            "the policy does not settle within {} of {} V {}{more}",
            band_text(found.setting.v_ref),
            found.setting.v_ref,
            places.join("; ")
        )
    })
}

/// How the comparison of the controllers came out.
pub(super) fn check_text(check: &Check) -> String {
    let names = check.names.join(", ");
    let periods = grouped(check.periods as u64);
    if check.differences.is_empty() {
        return format!("equal to the bit over {periods} control periods: {names}");
    }
    let first = check.names.first().map(String::as_str).unwrap_or_default();
    format!(
        "DIFFERENT from {first} within {periods} control periods:\n  {}",
        check.differences.join("\n  ")
    )
}
