//! Analogue-to-digital converters whose steps show in a record and stand not in the model.
//!
//! A step is no discrepancy: rounding counts as noise, and a model that rounds predicts nothing better. A step that makes much
//! of the noise is a property of the bench that the model lacks, and is named; a finer one is noted.

use std::collections::BTreeMap;

use plant::Parameters;

use crate::drive::sensors;
use crate::findings::{Evidence, Named, Value};
use crate::problem::Problem;
use crate::record::{CHANNEL_NAMES, CHANNEL_UNITS, CHANNELS};
use crate::words::si;

/// The name of the cause.
pub const ID: &str = "adc_quantisation";
/// Its parameters, by channel, and where the plant has them.
const PARAMETERS: [(&str, &str); CHANNELS] = [
    ("v_lsb", "sensors.v_out.lsb"),
    ("i_lsb", "sensors.i_l.lsb"),
    ("i_o_lsb", "sensors.i_out.lsb"),
    ("v_in_lsb", "sensors.v_in.lsb"),
];
/// A step of 2.2 times the noise makes two fifths of it in squares, step^2 / 12: below that, other noise hides it. A
/// convention.
const COARSE: f64 = 2.2;
/// A step below a fifth of the noise adds less than 0.2 % to it, and is not worth a word.
const WORTH_A_NOTE: f64 = 0.2;

/// The steps that the model does not have: channel, step, the model's own.
fn steps(problem: &Problem) -> Vec<(usize, f64, f64)> {
    let mut plant = problem.base.plant.clone();
    let known = sensors(&mut plant).map(|sensor| sensor.lsb);
    let steps = known.into_iter().enumerate().map(|(n, known)| {
        let step = problem.records.iter().map(|r| r.lattice[n]).fold(0.0, f64::max);
        (n, step, known)
    });
    steps
        // a plant's file says 0.1 V where the record has 0.0977; a bit more or less is a factor of two
        .filter(|(_, step, known)| *step > 0.0 && (known - step).abs() > 0.02 * step)
        .collect()
}

fn is_coarse(problem: &Problem, n: usize, step: f64) -> bool {
    step >= COARSE * problem.sigma[n]
}

/// The steps that make much of the noise, as a cause.
pub fn cause(problem: &Problem) -> Option<Named> {
    let coarse = steps(problem)
        .into_iter()
        .filter(|(n, step, _)| is_coarse(problem, *n, *step));
    let parameters: BTreeMap<&'static str, Value> = coarse
        .map(|(n, step, known)| {
            let value = Value {
                value: step,
                // a convention: the step is read off the numbers, not fitted, and shows as exact
                low: 0.999 * step,
                high: 1.001 * step,
                unit: CHANNEL_UNITS[n],
                model: known,
            };
            (PARAMETERS[n].0, value)
        })
        .collect();
    (!parameters.is_empty()).then(|| Named {
        id: ID,
        words: "step of the analogue-to-digital converter",
        parameters,
        evidence: Evidence {
            // read off the values, not fitted
            delta_chi2: f64::MAX,
            threshold: 0.0,
        },
        rivals: Vec::new(),
        rival_values: Vec::new(),
    })
}

/// What is said of finer ones.
pub fn note(problem: &Problem) -> Option<String> {
    let fine = steps(problem)
        .into_iter()
        .filter(|(n, step, _)| !is_coarse(problem, *n, *step) && *step >= WORTH_A_NOTE * problem.sigma[*n]);
    let each: Vec<String> = fine
        .map(|(n, step, known)| {
            let [step, known] = [step, known].map(|value| si(value, CHANNEL_UNITS[n]));
            let key = PARAMETERS[n].1;
            format!("{} on steps of {step} ({key} of the model: {known})", CHANNEL_NAMES[n])
        })
        .collect();
    (!each.is_empty()).then(|| {
        format!(
            "values lie on the steps of an analogue-to-digital converter, which are lost in the noise and no cause; nothing has to be done: {}",
            each.join(", ")
        )
    })
}

/// Puts the steps of a cause into a plant.
pub fn extend(plant: &mut Parameters, causes: &[Named]) {
    for cause in causes.iter().filter(|cause| cause.id == ID) {
        for (sensor, (name, _)) in sensors(plant).into_iter().zip(PARAMETERS) {
            if let Some(step) = cause.parameters.get(name) {
                sensor.lsb = step.value;
            }
        }
    }
}
